!> Keeps the states at the output times in memory.
module kept_states
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t
  implicit none (type, external)
  private

  type, extends(observer_t), public :: keeper_t
    real(wp), allocatable :: t(:)      !! [outputs]
    real(wp), allocatable :: y(:, :)   !! [components, outputs]
    integer :: outputs = 0
    real(wp), allocatable :: shift(:)  !! what has been taken out of the states so far, [components]
  contains
    procedure :: on_output
    procedure :: on_shift
    procedure :: wants_stop
  end type keeper_t

contains

  subroutine on_output(self, lane, t, y)
    class(keeper_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (lane /= 1) error stop 'kept_states: a run is one lane'
    self%outputs = self%outputs + 1
    self%t(self%outputs) = t
    self%y(:, self%outputs) = y
    if (allocated(self%shift)) self%y(:, self%outputs) = y + self%shift
  end subroutine on_output

  subroutine on_shift(self, lane, shift)
    class(keeper_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: shift(:)

    if (.not. allocated(self%shift)) allocate (self%shift, source=0.0_wp * shift)
    self%shift(:) = self%shift + shift
  end subroutine on_shift

  function wants_stop(self, t)
    class(keeper_t), intent(inout) :: self
    real(wp), intent(in) :: t
    logical :: wants_stop

    wants_stop = self%outputs == size(self%t) .and. t < self%t(1)
  end function wants_stop

end module kept_states

!> nocdyn_workloads INPUT METHOD RTOL ATOL REPETITIONS STATES_FILE, or nocdyn_workloads methods.
!>
!> Integrates the machine of a namelist file as `nocdyn run` does, without its files and its energy balance, because the other
!> programs do not integrate the works. Writes omega and phi of all bodies at the output times to STATES_FILE. `methods` prints
!> the names of the methods.
program nocdyn_workloads
  use contest, only: number_argument, print_report, seconds_now, text_argument, whole_argument, write_states
  use kept_states, only: keeper_t
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_methods, only: method_names
  use nocdyn_solver_status, only: failure_message, integration_done, solver_status_t
  use nocdyn_output_times, only: output_times, row_count
  use nocdyn_text, only: string_t
  implicit none (type, external)

  class(formulation_t), allocatable :: formulation
  type(integration_settings_t) :: settings
  real(wp), allocatable :: times(:)

  if (text_argument(1) == 'methods') then
    print '(*(a, :, 1x))', method_names
  else
    call set_up()
    call measure()
  end if

contains

  subroutine set_up()
    type(input_t) :: input
    type(machine_t) :: machine
    type(group_t) :: run
    type(error_t), allocatable :: error
    type(string_t) :: overrides(0)

    call read_input(text_argument(1), overrides, input, error)
    if (.not. allocated(error)) call assemble_machine(input, machine, error)
    if (allocated(error)) call give_up(error%message)
    run = input%single('run')
    call new_formulation(run%text('formulation'), machine, formulation, with_energy_balance=.false.)
    times = output_times(input, row_count(input))
    settings%method = text_argument(2)
    settings%rtol = number_argument(3)
    settings%atol = number_argument(4)
    settings%max_steps = 100000000
  end subroutine set_up

  subroutine measure()
    type(keeper_t) :: keeper
    type(solver_status_t) :: solver_status
    type(error_t), allocatable :: error
    real(wp), allocatable :: y(:, :), seconds(:)
    integer :: i

    allocate (seconds(whole_argument(5)), keeper%t(size(times)))
    allocate (keeper%y(formulation%states + formulation%quadratures, size(times)))
    do i = 1, size(seconds)
      y = formulation%start()
      keeper%outputs = 0
      if (allocated(keeper%shift)) deallocate (keeper%shift)
      keeper%takes_shifts = .true.
      seconds(i) = seconds_now()
      call integrate(formulation, settings, times, y, keeper, solver_status, error)
      seconds(i) = seconds_now() - seconds(i)
      if (allocated(error)) call give_up(error%message)
      if (solver_status%code(1) /= integration_done) then
        call give_up(failure_message(solver_status, 1, formulation, settings%rtol, settings%atol))
      end if
    end do
    call write_states(text_argument(6), states_of_bodies(keeper))
    call print_report(seconds, solver_status%steps(1), solver_status%evaluations(1))
  end subroutine measure

  !> omega and phi of all bodies, [2 bodies, outputs].
  function states_of_bodies(keeper) result(states)
    type(keeper_t), intent(in) :: keeper
    real(wp), allocatable :: states(:, :)
    integer :: i

    associate (bodies => formulation%machine%bodies)
      allocate (states(2 * bodies, keeper%outputs))
      do i = 1, keeper%outputs
        call formulation%set_state(reshape(keeper%y(:, i), [1, size(keeper%y, 1)]))
        states(:bodies, i) = formulation%omega(1, 1:)
        states(bodies + 1:, i) = formulation%phi(1, 1:)
      end do
    end associate
  end function states_of_bodies

  subroutine give_up(message)
    use, intrinsic :: iso_fortran_env, only: error_unit
    character(len=*), intent(in) :: message

    write (error_unit, '(a)') 'nocdyn_workloads: ' // message
    error stop 1
  end subroutine give_up

end program nocdyn_workloads
