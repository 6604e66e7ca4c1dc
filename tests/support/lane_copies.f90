!> Runs of variants one after the other in the lanes of a block, whose numbers are copied.
module nocdyn_test_lane_copies
  use nocdyn_errors, only: error_t
  use nocdyn_integration, only: integrate_queue
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_machine, only: machine_t
  use nocdyn_outcome, only: integration_done, outcome_t
  use nocdyn_queue, only: queue_t
  use nocdyn_reduced, only: new_reduced, reduced_t
  use nocdyn_system, only: observer_t, system_t
  implicit none (type, external)
  private

  public :: run_alone, run_copied

  !> Copies the lanes of a source, in their order, into whatever lane is free.
  type, extends(queue_t) :: copies_t
    type(lane_numbers_t) :: block, source
    real(wp), allocatable :: y(:, :)     !! [variants, components]: starts, and then ends
    integer, allocatable :: variant(:)   !! in each lane
    integer :: next_variant = 1
    integer :: done = 0
  contains
    procedure :: next
    procedure :: finish
  end type copies_t

contains

  !> Ends of the lanes of a machine, each run in a block of its own.
  subroutine run_alone(machines, method, times, y)
    type(machine_t), intent(in) :: machines(:)   !! of one lane each
    character(len=*), intent(in) :: method
    real(wp), contiguous, intent(in) :: times(:)
    real(wp), allocatable, intent(out) :: y(:, :)   !! [machines, components]
    type(reduced_t), target :: system
    type(copies_t) :: queue
    integer :: i

    do i = 1, size(machines)
      system = new_reduced(machines(i), .true.)
      queue = copies_t()
      allocate (queue%y, source=system%start())
      allocate (queue%variant(1), source=0)
      call run(system, method, times, queue)
      if (.not. allocated(y)) allocate (y(size(machines), size(queue%y, 2)))
      y(i, :) = queue%y(1, :)
      deallocate (queue%y, queue%variant)
    end do
  end subroutine run_alone

  !> Ends of the lanes of a source, copied into those of a block that holds other numbers.
  subroutine run_copied(source, block, method, times, y)
    type(reduced_t), target, intent(inout) :: source, block
    character(len=*), intent(in) :: method
    real(wp), contiguous, intent(in) :: times(:)
    real(wp), allocatable, intent(out) :: y(:, :)   !! [lanes of the source, components]; not allocated: the layouts differ
    type(copies_t) :: queue

    call source%list_numbers(queue%source)
    call block%list_numbers(queue%block)
    if (.not. queue%block%is_congruent(queue%source)) return
    allocate (queue%y, source=source%start())
    allocate (queue%variant(block%lanes), source=0)
    call run(block, method, times, queue)
    if (queue%done < source%lanes) error stop 'nocdyn_test_lane_copies: a variant was not run'
    allocate (y, source=queue%y)
  end subroutine run_copied

  subroutine run(system, method, times, queue)
    type(reduced_t), intent(inout) :: system
    character(len=*), intent(in) :: method
    real(wp), contiguous, intent(in) :: times(:)
    type(copies_t), intent(inout) :: queue
    type(integration_settings_t) :: settings
    type(outcome_t) :: outcome
    type(error_t), allocatable :: error
    type(observer_t) :: nobody

    settings%method = method
    settings%rtol = 1.0e-8_wp
    call integrate_queue(system, settings, times, queue, nobody, outcome, error)
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
    if (self%source%slabs > 0) call self%block%copy_lane(lane, self%source, self%next_variant)
    y(:) = self%y(self%next_variant, :)
    self%variant(lane) = self%next_variant
    self%next_variant = self%next_variant + 1
  end subroutine next

  subroutine finish(self, lane, y, outcome)
    class(copies_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(outcome_t), intent(in) :: outcome

    self%y(self%variant(lane), :) = 0.0_wp   ! of a run that has failed
    if (outcome%status(lane) == integration_done) self%y(self%variant(lane), :) = y
    self%done = self%done + 1
  end subroutine finish

end module nocdyn_test_lane_copies
