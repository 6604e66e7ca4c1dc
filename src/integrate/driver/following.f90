!> What happens inside the accepted steps of the lanes: requested times, events, extremes, crossings from branch to branch.
module nocdyn_following
  use nocdyn_dense_output, only: batch, sample, sample_batch, take_lane
  use nocdyn_events, only: find_events
  use nocdyn_extremes, only: follow_extremes, resume_extremes
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true
  use nocdyn_march, only: march_t, start_slopes
  use nocdyn_outcome, only: integration_done, integration_running, integration_stopped, integration_too_many_steps, outcome_t
  use nocdyn_step_control, only: resume
  use nocdyn_stepper, only: stepper_t
  use nocdyn_switching, only: cross_borders, find_fall
  use nocdyn_system, only: observer_t, system_t
  implicit none (type, external)
  private

  public :: follow_lanes, show_steps, cross_lanes

contains

  !> Tells the observer what lies in the accepted steps: requested times, events, extremes.
  subroutine follow_lanes(march, system, times, observer, outcome)
    type(march_t), intent(inout) :: march
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    associate (steps => march%steps)
      steps%until(:) = 1.0_wp
      steps%crosses(:) = .false.
      if (.not. march%is_due) return
      do lane = 1, march%trial%lanes
        if (.not. march%accepted(lane)) cycle
        if (march%inspected(lane)) call take_lane(march%dense, march%trial, march%coefficients, lane)
        if (march%has_switches) then
          call end_at_crossing(march, system, observer, lane, outcome, steps%until(lane))
          steps%crosses(lane) = march%switching%due(lane) > 0
        end if
        if (march%has_events) call pass_events(march, system, lane, steps%until(lane), times, observer, outcome)
        if (march%next_time(lane) <= march%t_new(lane)) call record_until(march, lane, march%t_new(lane), times, observer)
        if (march%has_extremes) then
          call follow_extremes(march%extremes, observer, march%dense, march%t_new(lane), steps%crosses(lane))
        end if
      end do
    end associate
  end subroutine follow_lanes

  !> Hands an observer that follows the steps those of the whole block, after `follow_lanes`.
  subroutine show_steps(march, stepper, observer)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(in) :: stepper
    class(observer_t), intent(inout) :: observer

    associate (steps => march%steps, trial => march%trial)
      steps%taken(:) = march%accepted
      steps%are_all_taken = all_true(size(march%accepted), march%accepted)
      steps%may_be_cut = march%has_switches .or. march%has_events
      steps%t(:) = trial%t
      steps%h(:) = trial%h
      steps%t_new(:) = march%t_new
      call stepper%show(steps, trial, march%coefficients, observer)
    end associate
  end subroutine show_steps

  !> Cuts the step of a lane where a branch of the system ends.
  subroutine end_at_crossing(march, system, observer, lane, outcome, until)
    type(march_t), intent(inout) :: march
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    integer, intent(in) :: lane
    type(outcome_t), intent(inout) :: outcome
    real(wp), intent(out) :: until   !! place of the cut in the step, 1 if there is none
    real(wp) :: t

    call find_fall(march%switching, system, observer, march%dense, until)
    if (march%switching%due(lane) == 0) return
    t = march%trial%t(lane) + until * march%trial%h(lane)
    if (t >= march%t_new(lane)) then
      until = 1.0_wp
      return
    end if
    march%t_new(lane) = t
    call sample(march%dense, until, march%sample)
    march%trial%y_new(lane, :march%trial%components) = march%sample
    if (outcome%status(lane) /= integration_done) return
    outcome%status(lane) = merge(integration_too_many_steps, integration_running, outcome%steps(lane) >= march%max_steps)
  end subroutine end_at_crossing

  !> The events of a lane in their order, with the requested times between them; a terminal event ends the step and the lane.
  subroutine pass_events(march, system, lane, until, times, observer, outcome)
    type(march_t), intent(inout) :: march
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: until   !! end of the step, 1 if it has not been cut
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    real(wp) :: t
    logical :: is_terminal
    integer :: i

    call find_events(march%events, system, observer, march%dense, until)
    do i = 1, march%events%found
      t = min(march%trial%t(lane) + march%events%theta(i) * march%trial%h(lane), march%t_new(lane))
      call record_until(march, lane, t, times, observer)
      call sample(march%dense, march%events%theta(i), march%sample)
      call observer%happen(lane, march%events%which(i), t, march%sample, is_terminal)
      if (.not. is_terminal) cycle
      outcome%status(lane) = integration_stopped
      until = march%events%theta(i)
      march%t_new(lane) = t
      march%trial%y_new(lane, :march%trial%components) = march%sample
      exit
    end do
  end subroutine pass_events

  !> Records the requested times up to t that have not been recorded yet.
  subroutine record_until(march, lane, t, times, observer)
    type(march_t), intent(inout) :: march
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    real(wp) :: theta(batch)
    integer :: ahead, i

    associate (next => march%next(lane))
      do while (next <= size(times))
        theta = 0.0_wp
        ahead = 0
        do while (ahead < min(batch, size(times) + 1 - next))
          if (times(next + ahead) > t .or. times(next + ahead) >= march%t_new(lane)) exit
          ahead = ahead + 1
          theta(ahead) = (times(next + ahead - 1) - march%dense%t) / march%dense%h
        end do
        if (ahead == 0) exit
        call sample_batch(march%dense, theta)
        do i = 1, ahead
          call observer%record(lane, times(next), march%dense%states(:march%trial%components, i))
          next = next + 1
        end do
      end do
      if (next > size(times)) return
      if (times(next) > t) return
      march%sample(:) = march%trial%y_new(lane, :march%trial%components)
      call observer%record(lane, times(next), march%sample)
      next = next + 1
    end associate
  end subroutine record_until

  !> The lanes that have moved to the end of a branch, and go on, change to the next one and start again there.
  subroutine cross_lanes(march, stepper, system, observer, outcome)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    associate (trial => march%trial, starting => march%starting)
      do lane = 1, trial%lanes
        starting(lane) = march%accepted(lane) .and. outcome%status(lane) == integration_running &
                         .and. march%switching%due(lane) > 0
        if (.not. starting(lane)) cycle
        call cross_borders(march%switching, system, observer, trial, lane, outcome)
        call resume(march%control, lane, outcome%h(lane))
      end do
      if (.not. any(starting)) return
      call start_slopes(march, system, outcome)
      call stepper%resume(trial, starting)
      if (.not. march%has_extremes) return
      do lane = 1, trial%lanes
        if (starting(lane)) call resume_extremes(march%extremes, observer, trial, lane)
      end do
    end associate
  end subroutine cross_lanes

end module nocdyn_following
