!> Counts the rows that an integrator hands out.
module row_counter
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t
  implicit none (type, external)
  private

  type, extends(observer_t), public :: row_counter_t
    integer :: rows = 0
  contains
    procedure :: on_output
    procedure :: wants_stop
  end type row_counter_t

contains

  subroutine on_output(self, lane, t, y)
    class(row_counter_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (lane == 1 .and. t >= 0 .and. size(y) > 0) self%rows = self%rows + 1
  end subroutine on_output

  function wants_stop(self, t)
    class(row_counter_t), intent(inout) :: self
    real(wp), intent(in) :: t
    logical :: wants_stop

    wants_stop = self%rows < 0 .and. t < 0
  end function wants_stop

end module row_counter

!> Reads a machine, integrates it for ten seconds with the library, and prints rows and final speeds.
program spin_up
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_solver_status, only: integration_done, solver_status_t
  use nocdyn_text, only: string_t
  use row_counter, only: row_counter_t
  implicit none (type, external)

  type(input_t) :: input
  type(machine_t) :: machine
  class(formulation_t), allocatable :: formulation
  type(row_counter_t) :: counter
  type(solver_status_t) :: solver_status
  type(error_t), allocatable :: error
  type(string_t) :: overrides(0)
  real(wp), allocatable :: y(:, :)
  real(wp), parameter :: times(3) = [0.0_wp, 5.0_wp, 10.0_wp]
  character(len=1000) :: file

  call get_command_argument(1, file)
  call read_input(trim(file), overrides, input, error)
  if (.not. allocated(error)) call assemble_machine(input, machine, error)
  if (allocated(error)) error stop error%message
  call new_formulation('reduced', machine, formulation)
  y = formulation%start()
  call integrate(formulation, integration_settings_t(rtol=1.0e-11_wp, atol=1.0e-12_wp), times, y, counter, solver_status, error)
  if (allocated(error)) error stop error%message
  if (solver_status%code(1) /= integration_done) error stop 'spin_up: the integration did not reach its end'
  call formulation%observe(times(3:), y)
  print '(i0, *(1x, es23.16))', counter%rows, formulation%omega(1, 1:)
end program spin_up
