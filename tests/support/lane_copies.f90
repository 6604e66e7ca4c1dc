!> Runs of variants one after the other in the lanes of a block, into which their parameters are copied.
module nocdyn_test_lane_copies
  use nocdyn_errors, only: error_t
  use nocdyn_integration, only: integrate_ensemble
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_machine, only: machine_t
  use nocdyn_solver_status, only: integration_done, solver_status_t
  use nocdyn_ensemble, only: ensemble_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_observer, only: observer_t
  use nocdyn_system, only: system_t
  use nocdyn_test_states, only: reduced_form
  implicit none (type, external)
  private

  public :: copy_lane, have_same_structure, run_alone, run_copied

  type, public :: machine_slot_t
    class(machine_t), allocatable :: machine
  end type machine_slot_t

  !> Copies the lanes of a source, in their order, into the lanes that become free.
  type, extends(ensemble_t) :: copies_t
    class(reduced_t), pointer :: source => null()
    real(wp), allocatable :: y(:, :)     !! [variants, components]: start states, then end states
    integer, allocatable :: variant(:)   !! in each lane
    integer :: next_variant = 1
    integer :: done = 0
  contains
    procedure :: next
    procedure :: finish
  end type copies_t

contains

  !> Gives a lane of a block the parameters of a lane of a source with the same structure.
  subroutine copy_lane(source, from, block, lane)
    class(reduced_t), intent(inout) :: source, block
    integer, intent(in) :: from, lane
    type(lane_parameters_t) :: parameters

    call parameters%take(from)
    call source%pass_parameters(parameters)
    call parameters%give(lane)
    call block%pass_parameters(parameters)
  end subroutine copy_lane

  logical function have_same_structure(one, other)
    class(reduced_t), intent(inout) :: one, other
    type(lane_parameters_t) :: here, there

    call here%take(1)
    call one%pass_parameters(here)
    call there%take(1)
    call other%pass_parameters(there)
    have_same_structure = here%has_same_structure(there)
  end function have_same_structure

  !> End states of machines, each run in a block of its own.
  subroutine run_alone(machines, method, times, y)
    type(machine_slot_t), intent(in) :: machines(:)   !! with one lane each
    character(len=*), intent(in) :: method
    real(wp), contiguous, intent(in) :: times(:)
    real(wp), allocatable, intent(out) :: y(:, :)   !! [machines, components]
    class(reduced_t), allocatable, target :: system
    type(copies_t) :: ensemble
    integer :: i

    do i = 1, size(machines)
      system = reduced_form(machines(i)%machine, .true.)
      ensemble%next_variant = 1
      ensemble%done = 0
      allocate (ensemble%y, source=system%start())
      allocate (ensemble%variant(1), source=0)
      call run(system, method, times, ensemble)
      if (.not. allocated(y)) allocate (y(size(machines), size(ensemble%y, 2)))
      y(i, :) = ensemble%y(1, :)
      deallocate (ensemble%y, ensemble%variant)
    end do
  end subroutine run_alone

  !> End states of the lanes of a source, copied into the lanes of a block with other parameters.
  subroutine run_copied(source, block, method, times, y)
    type(reduced_t), target, intent(inout) :: source, block
    character(len=*), intent(in) :: method
    real(wp), contiguous, intent(in) :: times(:)
    real(wp), allocatable, intent(out) :: y(:, :)   !! [lanes of the source, components]; not allocated: the structures differ
    type(copies_t) :: ensemble

    if (.not. have_same_structure(source, block)) return
    ensemble%source => source
    allocate (ensemble%y, source=source%start())
    allocate (ensemble%variant(block%lanes), source=0)
    call run(block, method, times, ensemble)
    if (ensemble%done < source%lanes) error stop 'nocdyn_test_lane_copies: a variant was not run'
    allocate (y, source=ensemble%y)
  end subroutine run_copied

  subroutine run(system, method, times, ensemble)
    type(reduced_t), intent(inout) :: system
    character(len=*), intent(in) :: method
    real(wp), contiguous, intent(in) :: times(:)
    type(copies_t), intent(inout) :: ensemble
    type(integration_settings_t) :: settings
    type(solver_status_t) :: solver_status
    type(error_t), allocatable :: error
    type(observer_t) :: nobody

    settings%method = method
    settings%rtol = 1.0e-8_wp
    call integrate_ensemble(system, settings, times, ensemble, nobody, solver_status, error)
    if (allocated(error)) error stop 'nocdyn_test_lane_copies: a setting was refused'
  end subroutine run

  subroutine next(self, system, lane, t, y, found)
    class(copies_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: found

    found = self%next_variant <= size(self%y, 1)
    if (.not. found) return
    if (associated(self%source)) then
      select type (system)
      class is (reduced_t)
        call copy_lane(self%source, self%next_variant, system, lane)
      end select
    end if
    y(:) = self%y(self%next_variant, :)
    self%variant(lane) = self%next_variant
    self%next_variant = self%next_variant + 1
  end subroutine next

  subroutine finish(self, lane, y, solver_status)
    class(copies_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(solver_status_t), intent(in) :: solver_status

    self%y(self%variant(lane), :) = 0.0_wp   ! of a run that has failed
    if (solver_status%code(lane) == integration_done) self%y(self%variant(lane), :) = y
    self%done = self%done + 1
  end subroutine finish

end module nocdyn_test_lane_copies
