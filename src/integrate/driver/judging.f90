!> What becomes of the attempts of the lanes: steps, shorter attempts, or ends.
module nocdyn_judging
  use nocdyn_combinations, only: width
  use nocdyn_kinds, only: wp
  use nocdyn_march, only: march_t
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_outcome, only: integration_done, integration_gave_up, integration_not_finite, integration_step_too_small, &
    integration_too_many_steps, note_method, outcome_t
  use nocdyn_step_control, only: adapt, shorten, smallest_step, weigh_error
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: observer_t, system_t
  use nocdyn_trial, only: trial_fine, trial_give_up, trial_not_finite
  implicit none (type, external)
  private

  public :: judge_lanes

contains

  !> Accepts or rejects the last attempt of each lane, and ends the lanes that cannot go on.
  subroutine judge_lanes(march, stepper, system, observer, outcome)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    class(observer_t), intent(in) :: observer
    type(outcome_t), intent(inout) :: outcome
    integer :: failed, lane, wanted
    logical :: usual   ! whether all lanes have taken steps that have only to be counted

    if (.not. stepper%plans_steps) call weigh_error(march%control, march%trial)
    march%is_due = march%has_events .or. march%has_extremes .or. march%has_switches
    usual = .false.
    if (march%trial%lanes > 1) usual = is_usual(march, outcome)
    if (usual) then
      call accept_all(march, wanted)
    else
      call find_wanted(march, wanted)
    end if
    if (wanted > 0) then
      call choose_columns(march, observer)
      call stepper%interpolate(system, march%trial, march%wanted, march%coefficients)
      usual = usual .and. all_true(march%trial%lanes, march%trial%working)
    end if
    failed = 0
    if (usual) then
      outcome%accepted(:) = outcome%accepted + 1
      call end_lanes(march%trial%lanes, march%control%reaches_end, outcome%status)
      march%is_due = has_passed(march%trial%lanes, march%next_time, march%t_new)
    else
      call settle_lanes(march, outcome, failed)
    end if
    if (.not. stepper%plans_steps) then
      call adapt(march%control, march%trial%lanes, march%accepted, march%rejected, march%trial%error_order, &
                 march%trial%most_growth, outcome%h)
    end if
    if (failed == 0) return
    do lane = 1, march%trial%lanes
      if (march%running(lane) .and. .not. march%accepted(lane)) call judge_rejection(march, lane, outcome)
    end do
  end subroutine judge_lanes

  !> Whether all lanes have taken explicit steps within the tolerances, in which no requested time lies but at their end: nothing
  !> has to be decided for one of them then. The answer is no too if they do not make whole vectors.
  pure logical function is_usual(march, outcome)
    type(march_t), intent(in) :: march
    type(outcome_t), intent(in) :: outcome

    is_usual = .false.
    associate (trial => march%trial)
      if (modulo(trial%lanes, width) /= 0 .or. march%is_due) return
      if (largest_excess(trial%lanes, march%control%mean_square, march%t_new, march%next_time) > 0) return
      if (largest_count(trial%lanes, outcome%steps) >= march%max_steps) return
      if (any_true(trial%lanes, trial%implicit) .or. any_true(trial%lanes, outcome%implicit)) return
      is_usual = all_true(trial%lanes, trial%working)
    end associate
  end function is_usual

  !> The largest error beyond the tolerances or time beyond the next requested one; whole vectors.
  pure real(wp) function largest_excess(lanes, mean_square, t_new, next_time) result(excess)
    integer, intent(in) :: lanes
    real(wp), intent(in), dimension(lanes) :: mean_square, t_new, next_time
    real(wp) :: most(width)
    integer :: i

    most = -1.0_wp
    do i = 1, lanes, width
      most = max(most, max(mean_square(i:i + width - 1) - 1.0_wp, t_new(i:i + width - 1) - next_time(i:i + width - 1)))
    end do
    excess = max(max(most(1), most(2)), max(most(3), most(4)))
  end function largest_excess

  pure integer function largest_count(lanes, counts) result(largest)
    integer, intent(in) :: lanes
    integer, intent(in) :: counts(lanes)
    integer :: i

    largest = 0
    do i = 1, lanes
      largest = max(largest, counts(i))
    end do
  end function largest_count

  !> The lanes whose steps end on the final time are done.
  pure subroutine end_lanes(lanes, reaches_end, status)
    integer, intent(in) :: lanes
    logical, intent(in) :: reaches_end(lanes)
    integer, intent(inout) :: status(lanes)
    integer :: i

    do i = 1, lanes
      status(i) = merge(integration_done, status(i), reaches_end(i))
    end do
  end subroutine end_lanes

  !> Whether a lane has passed a time.
  pure logical function has_passed(lanes, time, t)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: time(lanes), t(lanes)
    integer :: i, passed

    passed = 0
    do i = 1, lanes
      passed = passed + merge(1, 0, time(i) <= t(i))
    end do
    has_passed = passed > 0
  end function has_passed

  !> Accepts the steps of all lanes.
  pure subroutine accept_all(march, wanted)
    type(march_t), intent(inout) :: march
    integer, intent(out) :: wanted

    march%accepted(:) = .true.
    march%rejected(:) = .false.
    march%inspected(:) = .false.
    march%wanted(:) = march%wants_all
    wanted = merge(march%trial%lanes, 0, march%wants_all)
  end subroutine accept_all

  !> The lanes whose error is within the tolerances, and those of them whose solution inside the step is wanted.
  pure subroutine find_wanted(march, wanted)
    type(march_t), intent(inout) :: march
    integer, intent(out) :: wanted   !! how many
    integer :: lane

    wanted = 0
    do lane = 1, march%trial%lanes
      march%accepted(lane) = march%trial%working(lane) .and. march%control%mean_square(lane) <= 1
      march%inspected(lane) = march%accepted(lane) .and. (march%is_due .or. march%next_time(lane) < march%t_new(lane))
      march%wanted(lane) = march%inspected(lane) .or. (march%accepted(lane) .and. march%wants_all)
      if (march%wanted(lane)) wanted = wanted + 1
    end do
  end subroutine find_wanted

  !> The columns of the state whose course is of interest: those that the observer follows, or all for the lanes that are
  !> looked at on their own.
  pure subroutine choose_columns(march, observer)
    type(march_t), intent(inout) :: march
    class(observer_t), intent(in) :: observer

    associate (trial => march%trial)
      trial%first_inside = 1
      trial%last_inside = size(trial%y, 2)
      if (modulo(trial%lanes, width) /= 0 .or. any(march%inspected)) return
      trial%first_inside = observer%first_followed
      trial%last_inside = min(observer%last_followed, trial%last_inside)
    end associate
  end subroutine choose_columns

  !> Counts the accepted steps and ends the lanes that have reached the final time or may take no more steps.
  pure subroutine settle_lanes(march, outcome, failed)
    type(march_t), intent(inout) :: march
    type(outcome_t), intent(inout) :: outcome
    integer, intent(out) :: failed   !! attempts that were not accepted
    logical :: is_fine
    integer :: lane

    failed = 0
    do lane = 1, march%trial%lanes
      march%rejected(lane) = .false.
      if (.not. march%running(lane)) cycle
      if (outcome%steps(lane) >= march%max_steps) outcome%status(lane) = integration_too_many_steps
      is_fine = march%trial%verdict(lane) == trial_fine
      march%rejected(lane) = is_fine .and. .not. march%accepted(lane)
      march%accepted(lane) = is_fine .and. march%accepted(lane)
      if (march%accepted(lane)) then
        call note_method(outcome, lane, march%trial%t(lane), march%trial%implicit(lane))
        if (march%control%reaches_end(lane)) outcome%status(lane) = integration_done
        if (march%next_time(lane) <= march%t_new(lane)) march%is_due = .true.
      else
        failed = failed + 1
      end if
    end do
  end subroutine settle_lanes

  !> A lane takes a shorter step, or fails if no shorter step will help or none is possible.
  subroutine judge_rejection(march, lane, outcome)
    type(march_t), intent(inout) :: march
    integer, intent(in) :: lane
    type(outcome_t), intent(inout) :: outcome

    outcome%rejected(lane) = outcome%rejected(lane) + 1
    associate (trial => march%trial)
      if (trial%verdict(lane) /= trial_fine) call shorten(march%control, lane, outcome%h(lane))
      if (trial%verdict(lane) == trial_give_up) then
        outcome%status(lane) = integration_gave_up
      else if (outcome%h(lane) <= smallest_step(trial%t(lane))) then
        select case (trial%verdict(lane))
        case (trial_fine)
          outcome%status(lane) = integration_step_too_small
          outcome%component(lane) = maxloc(trial%deviation(lane, :trial%states), dim=1)
        case (trial_not_finite)
          outcome%status(lane) = integration_not_finite
          outcome%component(lane) = trial%culprit(lane)
        case default
          outcome%status(lane) = integration_step_too_small
          outcome%component(lane) = trial%culprit(lane)
        end select
      end if
    end associate
  end subroutine judge_rejection

end module nocdyn_judging
