!> The march of a block of lanes through time: each lane at its own pace, all of them in one loop.
module nocdyn_march
  use nocdyn_dense_output, only: allocate_dense_output, dense_output_t
  use nocdyn_events, only: allocate_events, events_t, start_events
  use nocdyn_extremes, only: allocate_extremes, extremes_t, start_extremes
  use nocdyn_first_step, only: guess_first_steps
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_other
  use nocdyn_outcome, only: integration_gave_up, integration_not_finite, integration_running, outcome_t, reset_outcome
  use nocdyn_queue, only: queue_t
  use nocdyn_step_control, only: propose, restart, step_control, step_control_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_switching, only: allocate_switching, start_switching, switching_t
  use nocdyn_system, only: observer_t, steps_t, system_t
  use nocdyn_trial, only: allocate_trial, evaluate_start, set_out, trial_not_finite, trial_t
  implicit none (type, external)
  private

  public :: prepare, fill_lanes, start_slopes, set_out_lanes, advance_lanes, empty_lanes

  type, public :: march_t
    type(trial_t) :: trial
    type(step_control_t) :: control
    type(dense_output_t) :: dense                    !! the lane that is looked at
    type(events_t) :: events
    type(extremes_t) :: extremes
    type(switching_t) :: switching
    real(wp) :: first_step                           !! 0: find it
    integer :: max_steps
    logical :: has_events = .false.
    logical :: has_extremes = .false.
    logical :: has_switches = .false.
    logical :: is_followed = .false.                 !! whether the observer is handed the solution inside all steps
    logical :: wants_all = .false.                   !! whether it is that of `interpolate`
    logical :: is_exhausted = .false.                !! the queue has no variant left
    integer :: free = 0                              !! lanes that hold no variant
    logical :: is_due = .false.                      !! whether the accepted steps are looked at lane by lane
    logical, allocatable :: occupied(:)              !! lanes that hold a variant
    logical, allocatable :: running(:)               !! lanes that took part in the last attempt
    logical, allocatable :: rejected(:)              !! lanes whose last attempt was finished, but not accepted
    logical, allocatable :: starting(:)              !! lanes that have just been given one, or go on from branch to branch
    logical, allocatable :: accepted(:)              !! lanes whose last attempt was accepted
    logical, allocatable :: wanted(:)                !! lanes whose solution inside the last step is wanted
    logical, allocatable :: inspected(:)             !! lanes whose solution there is looked at on its own
    type(steps_t) :: steps                           !! as the observer is told of them
    real(wp), allocatable :: t_new(:)                !! end of the last attempt of each lane
    real(wp), allocatable :: next_time(:)            !! first requested time of each lane that is not recorded yet; or never
    integer, allocatable :: next(:)                  !! number of the first requested time of each lane that is not recorded yet
    real(wp), allocatable :: sample(:)               !! one lane's state at a requested time
    real(wp), allocatable :: coefficients(:, :, :)   !! of the solution inside the last step
  end type march_t

contains

  !> Allocates all that the march needs; nothing is allocated later.
  subroutine prepare(march, stepper, system, settings, times, observer)
    type(march_t), intent(out) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(in) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: times(:)
    class(observer_t), intent(in) :: observer

    call stepper%prepare(system)
    call allocate_trial(march%trial, system)
    march%trial%t(:) = times(1)
    march%trial%error_order(:) = stepper%error_order
    march%trial%most_growth(:) = stepper%most_growth
    march%trial%has_coarse_deviation = stepper%has_coarse_error
    march%control = step_control(system%lanes, settings%rtol, settings%atol, times(size(times)), settings%longest_step)
    march%first_step = settings%first_step
    march%max_steps = settings%max_steps
    call allocate_lanes(march, system%lanes, system%states + system%quadratures, stepper%degree, times(1))
    call allocate_dense_output(march%dense, march%trial%components, stepper%degree)
    march%is_followed = observer%follows_steps
    march%wants_all = march%is_followed .and. .not. stepper%shows_own
    march%has_switches = system%switches > 0
    if (march%has_switches) then
      call allocate_switching(march%switching, system, stepper%degree, march%trial, times(size(times)) - times(1))
    end if
    march%has_extremes = observer%tracked > 0
    if (march%has_extremes) call allocate_extremes(march%extremes, observer%tracked, stepper%degree, march%trial)
    if (.not. allocated(observer%directions)) return
    march%has_events = size(observer%directions) > 0
    if (march%has_events) call allocate_events(march%events, observer, stepper%degree, march%trial)
  end subroutine prepare

  !> What is known of each lane; none holds a variant.
  pure subroutine allocate_lanes(march, lanes, components, degree, t_start)
    type(march_t), intent(inout) :: march
    integer, intent(in) :: lanes, components, degree
    real(wp), intent(in) :: t_start

    march%free = lanes
    allocate (march%occupied(lanes), march%running(lanes), march%starting(lanes), march%accepted(lanes), &
              march%rejected(lanes), march%wanted(lanes), march%inspected(lanes), march%steps%taken(lanes), &
              march%steps%crosses(lanes), source=.false.)
    allocate (march%t_new(lanes), march%next_time(lanes), source=t_start)
    allocate (march%steps%t(lanes), march%steps%h(lanes), march%steps%scale(lanes), march%steps%until(lanes), &
              march%steps%t_new(lanes), source=0.0_wp)
    allocate (march%next(lanes), source=2)
    allocate (march%sample(components), source=0.0_wp)
    allocate (march%coefficients(lanes, size(march%trial%y, 2), degree), source=0.0_wp)
  end subroutine allocate_lanes

  !> Gives the free lanes their next variants and starts them.
  subroutine fill_lanes(march, stepper, system, queue, times, observer, outcome)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    class(queue_t), intent(inout) :: queue
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    real(wp) :: t
    integer :: lane

    if (march%is_exhausted .or. march%free == 0) return
    do lane = 1, size(march%occupied)
      march%starting(lane) = .false.
      if (march%occupied(lane) .or. march%is_exhausted) cycle
      t = times(1)
      call queue%next(system, lane, t, march%sample, march%starting(lane))
      march%occupied(lane) = march%starting(lane)
      march%is_exhausted = .not. march%starting(lane)
      if (.not. march%starting(lane)) cycle
      march%free = march%free - 1
      call place_start(march, lane, t, times, outcome)
    end do
    if (any(march%starting)) call start_lanes(march, stepper, system, times, observer, outcome)
  end subroutine fill_lanes

  !> Puts the state in `sample` at the start of a lane that has done nothing yet.
  subroutine place_start(march, lane, t, times, outcome)
    type(march_t), intent(inout) :: march
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: times(:)
    type(outcome_t), intent(inout) :: outcome

    associate (trial => march%trial)
      trial%t(lane) = t
      trial%y(lane, :trial%components) = march%sample
      trial%evaluations(lane) = 0
      trial%jacobians(lane) = 0
      trial%factorisations(lane) = 0
      trial%implicit(lane) = .false.
    end associate
    if (.not. (t >= times(1) .and. t < times(size(times)))) error stop 'nocdyn_march: a variant must start within the times'
    march%next(lane) = 2
    do while (times(march%next(lane)) <= t)
      march%next(lane) = march%next(lane) + 1
    end do
    march%next_time(lane) = times(march%next(lane))
    call restart(march%control, lane)
    call reset_outcome(outcome, lane)
  end subroutine place_start

  !> Records the start if it is a requested time, evaluates the slope there and chooses the first step of the lanes in `starting`.
  subroutine start_lanes(march, stepper, system, times, observer, outcome)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    associate (trial => march%trial)
      do lane = 1, trial%lanes
        if (march%starting(lane)) call enter_branches(march, system, observer, lane, outcome)
      end do
      call start_slopes(march, system, outcome)
      call stepper%begin(trial, march%starting)
      do lane = 1, trial%lanes
        if (.not. march%starting(lane)) cycle
        march%sample(:) = trial%y(lane, :trial%components)
        if (times(march%next(lane) - 1) >= trial%t(lane)) call observer%record(lane, trial%t(lane), march%sample)
        march%control%h(lane) = march%first_step
        if (.not. trial%working(lane)) cycle
        if (march%has_events) call start_events(march%events, system, observer, trial, lane)
        if (march%has_extremes) call start_extremes(march%extremes, observer, trial, lane)
      end do
      if (march%first_step > 0 .or. stepper%plans_steps) return
      call guess_first_steps(march%control, stepper%order, system, trial)
    end associate
  end subroutine start_lanes

  subroutine enter_branches(march, system, observer, lane, outcome)
    type(march_t), intent(inout) :: march
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    integer, intent(in) :: lane
    type(outcome_t), intent(inout) :: outcome

    associate (trial => march%trial)
      march%sample(:) = trial%y(lane, :trial%components)
      call system%enter(lane, trial%t(lane), march%sample)
      if (march%has_switches) call start_switching(march%switching, system, observer, trial, lane, outcome)
    end associate
  end subroutine enter_branches

  !> Evaluates the slope where the lanes in `starting` are, and ends those where that fails.
  subroutine start_slopes(march, system, outcome)
    type(march_t), intent(inout) :: march
    class(system_t), intent(inout) :: system
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    associate (trial => march%trial)
      trial%working(:) = march%starting
      call evaluate_start(trial, system, march%starting, trial%slope)
      do lane = 1, trial%lanes
        if (.not. march%starting(lane) .or. trial%working(lane)) cycle
        if (outcome%status(lane) /= integration_running) cycle
        outcome%status(lane) = merge(integration_not_finite, integration_gave_up, trial%verdict(lane) == trial_not_finite)
        outcome%component(lane) = trial%culprit(lane)
      end do
    end associate
  end subroutine start_slopes

  !> The next attempt of the lanes that are still running.
  subroutine set_out_lanes(march, stepper, system, outcome)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    type(outcome_t), intent(inout) :: outcome

    associate (trial => march%trial)
      call find_running(trial%lanes, march%occupied, outcome%status, march%running)
      trial%working(:) = march%running
      if (stepper%plans_steps) call plan_steps(march, stepper, system, outcome)
      call propose(march%control, trial%lanes, trial%t, trial%h, march%t_new)
      call begin_attempts(trial%lanes, march%running, trial%h, outcome%h, outcome%steps)
      call set_out(trial)
    end associate
  end subroutine set_out_lanes

  pure subroutine find_running(lanes, occupied, status, running)
    integer, intent(in) :: lanes
    logical, intent(in) :: occupied(lanes)
    integer, intent(in) :: status(lanes)
    logical, intent(inout) :: running(lanes)

    running = merge(occupied, .false., status == integration_running)
  end subroutine find_running

  !> Notes and counts the attempts of the running lanes; the others get steps of zero.
  pure subroutine begin_attempts(lanes, running, h, h_noted, steps)
    integer, intent(in) :: lanes
    logical, intent(in) :: running(lanes)
    real(wp), intent(inout) :: h(lanes), h_noted(lanes)
    integer, intent(inout) :: steps(lanes)
    integer :: lane

    do lane = 1, lanes
      h_noted(lane) = merge(h(lane), h_noted(lane), running(lane))
      h(lane) = merge(h(lane), 0.0_wp, running(lane))
      steps(lane) = steps(lane) + merge(1, 0, running(lane))
    end do
  end subroutine begin_attempts

  !> Lets the stepper choose the steps; the first is not longer than the one that was asked for.
  subroutine plan_steps(march, stepper, system, outcome)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    type(outcome_t), intent(in) :: outcome
    integer :: lane

    call stepper%plan(system, march%trial, march%control)
    if (march%first_step <= 0) return
    do lane = 1, march%trial%lanes
      if (outcome%steps(lane) == 0) march%control%h(lane) = min(march%control%h(lane), march%first_step)
    end do
  end subroutine plan_steps

  !> The accepted lanes move to the end of their step.
  subroutine advance_lanes(march, times)
    type(march_t), intent(inout) :: march
    real(wp), contiguous, intent(in) :: times(:)
    real(wp), allocatable :: spare(:, :)
    integer :: component, lane

    associate (trial => march%trial, accepted => march%accepted)
      if (all_true(trial%lanes, accepted)) then   ! the arrays change their names: nothing asks for y_new any more
        trial%t(:) = march%t_new
        call move_alloc(trial%y, spare)
        call move_alloc(trial%y_new, trial%y)
        call move_alloc(spare, trial%y_new)
      else
        do lane = 1, trial%lanes
          if (accepted(lane)) trial%t(lane) = march%t_new(lane)
        end do
        do component = 1, trial%components
          call take_accepted(trial%lanes, accepted, trial%y_new(1, component), trial%y(1, component))
        end do
      end if
      if (.not. march%is_due) return
      do lane = 1, trial%lanes
        march%next_time(lane) = huge(march%next_time)
        if (march%next(lane) <= size(times)) march%next_time(lane) = times(march%next(lane))
      end do
    end associate
  end subroutine advance_lanes

  pure subroutine take_accepted(lanes, accepted, new, old)
    integer, intent(in) :: lanes
    logical, intent(in) :: accepted(lanes)
    real(wp), intent(in) :: new(lanes)
    real(wp), intent(inout) :: old(lanes)

    old = merge(new, old, accepted)
  end subroutine take_accepted

  !> Hands the lanes that have ended to the queue and frees them.
  subroutine empty_lanes(march, queue, observer, outcome)
    type(march_t), intent(inout) :: march
    class(queue_t), intent(inout) :: queue
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    if (.not. any_other(size(outcome%status), outcome%status, integration_running)) return
    do lane = 1, size(march%occupied)
      if (.not. march%occupied(lane) .or. outcome%status(lane) == integration_running) cycle
      march%occupied(lane) = .false.
      march%free = march%free + 1
      outcome%t(lane) = march%trial%t(lane)
      outcome%evaluations(lane) = march%trial%evaluations(lane)
      outcome%jacobians(lane) = march%trial%jacobians(lane)
      outcome%factorisations(lane) = march%trial%factorisations(lane)
      if (march%has_extremes .and. outcome%steps(lane) > 0) call observer%take_ranges(lane, march%extremes%ranges(lane))
      march%sample(:) = march%trial%y(lane, :march%trial%components)
      call queue%finish(lane, march%sample, outcome)
    end do
  end subroutine empty_lanes

end module nocdyn_march
