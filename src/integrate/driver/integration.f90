!> Integration of a block of lanes from the first to the last requested time.
module nocdyn_integration
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_following, only: cross_lanes, follow_lanes, show_steps
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_judging, only: judge_lanes
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: any_other, any_true
  use nocdyn_march, only: advance_lanes, empty_lanes, fill_lanes, march_t, prepare, set_out_lanes
  use nocdyn_methods, only: select_method
  use nocdyn_outcome, only: allocate_outcome, integration_interrupted, integration_running, outcome_t
  use nocdyn_queue, only: one_each, one_each_t, queue_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: observer_t, system_t
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: integrate, integrate_queue, integrate_with

contains

  !> Solves y' = f(t, y) once in each lane, with the method that `settings` names.
  subroutine integrate(system, settings, times, y, observer, outcome, error)
    class(system_t), intent(inout) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)       !! ascending; the first is the start, the last is the end
    real(wp), contiguous, intent(inout) :: y(:, :)     !! [lanes, components]: the start, on return where each lane stopped
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(out) :: outcome            !! says which lanes failed
    type(error_t), allocatable, intent(out) :: error   !! allocated if a setting is refused
    type(one_each_t) :: queue

    if (size(y, 1) /= system%lanes .or. size(y, 2) /= system%states + system%quadratures) then
      error stop 'nocdyn_integration: y must have the shape [lanes, states + quadratures]'
    end if
    queue = one_each(y)
    call integrate_queue(system, settings, times, queue, observer, outcome, error)
    y = queue%y
  end subroutine integrate

  !> Solves y' = f(t, y) for all variants of a queue; a lane that has ended takes the next variant.
  subroutine integrate_queue(system, settings, times, queue, observer, outcome, error)
    class(system_t), intent(inout) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)       !! of every variant
    class(queue_t), intent(inout) :: queue             !! hands out the variants and takes their ends
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(out) :: outcome            !! of the last variant in each lane
    type(error_t), allocatable, intent(out) :: error   !! allocated if a setting is refused
    class(stepper_t), allocatable :: stepper

    call check_settings(settings, error)
    if (allocated(error)) return
    call select_method(settings, stepper, error)
    if (.not. allocated(error)) call refuse_missing_series(stepper, system, settings, error)
    if (allocated(error)) return
    call integrate_with(stepper, system, settings, times, queue, observer, outcome)
  end subroutine integrate_queue

  !> A method that is made of Taylor series needs a system that has them.
  subroutine refuse_missing_series(stepper, system, settings, error)
    class(stepper_t), intent(in) :: stepper
    class(system_t), intent(in) :: system
    type(integration_settings_t), intent(in) :: settings
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: obstacle

    if (.not. stepper%needs_series) return
    obstacle = system%series_obstacle()
    if (len(obstacle) == 0) return
    call raise(error, exit_input, 'method ' // quoted(trim(settings%method)) // ' cannot be used: ' // obstacle)
  end subroutine refuse_missing_series

  !> The same with any stepper and with settings that have been checked.
  subroutine integrate_with(stepper, system, settings, times, queue, observer, outcome)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)
    class(queue_t), intent(inout) :: queue
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(out) :: outcome
    type(march_t) :: march
    logical :: is_interrupted

    if (size(times) < 2) error stop 'nocdyn_integration: times needs a start and an end'
    if (.not. all(times(2:) > times(:size(times) - 1))) error stop 'nocdyn_integration: times must ascend'
    call allocate_outcome(outcome, system%lanes)
    if (stepper%needs_series) call system%prepare_series(stepper%order)
    call prepare(march, stepper, system, settings, times, observer)
    do
      call fill_lanes(march, stepper, system, queue, times, observer, outcome)
      if (march%free == system%lanes) exit
      call set_out_lanes(march, stepper, system, outcome)
      call stepper%attempt(system, march%trial)
      call judge_lanes(march, stepper, system, observer, outcome)
      if (any_true(system%lanes, march%accepted)) then
        if (march%is_due .or. march%is_followed) call follow_lanes(march, system, times, observer, outcome)
        if (march%is_followed) call show_steps(march, stepper, observer)
        call advance_lanes(march, times)
        call stepper%accept(march%accepted)
        if (march%has_switches) call cross_lanes(march, stepper, system, observer, outcome)
      end if
      call interrupt_if_asked(march, observer, outcome, is_interrupted)
      call empty_lanes(march, queue, observer, outcome)
      if (is_interrupted) exit
    end do
  end subroutine integrate_with

  !> Ends the lanes that are running if the observer wants to stop at the time of the slowest.
  subroutine interrupt_if_asked(march, observer, outcome, is_interrupted)
    type(march_t), intent(in) :: march
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    logical, intent(out) :: is_interrupted
    real(wp) :: slowest
    integer :: lane

    is_interrupted = .false.
    slowest = huge(slowest)
    if (any_other(size(outcome%status), outcome%status, integration_running)) then
      do lane = 1, size(outcome%status)
        if (outcome%status(lane) == integration_running) slowest = min(slowest, march%trial%t(lane))
      end do
    else
      do lane = 1, size(outcome%status)
        slowest = min(slowest, march%trial%t(lane))
      end do
    end if
    if (slowest >= huge(slowest)) return
    is_interrupted = observer%stops(slowest)
    if (.not. is_interrupted) return
    do lane = 1, size(outcome%status)
      if (outcome%status(lane) == integration_running) outcome%status(lane) = integration_interrupted
    end do
  end subroutine interrupt_if_asked

end module nocdyn_integration
