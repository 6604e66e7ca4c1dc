!> The march of a block of lanes through time: each lane at its own pace, all of them in one loop.
module nocdyn_march
  use nocdyn_first_step, only: guess_first_steps
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_outcome, only: integration_done, integration_gave_up, integration_not_finite, integration_running, &
    integration_step_too_small, integration_too_many_steps, outcome_t
  use nocdyn_step_control, only: accept_or_reject, propose, shorten, smallest_step, step_control, step_control_t, weigh_error
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: observer_t, system_t
  use nocdyn_trial, only: allocate_trial, evaluate_start, set_out, trial_fine, trial_give_up, trial_not_finite, trial_t
  implicit none (type, external)
  private

  public :: prepare, start, set_out_lanes, judge_lanes, record_lanes, advance_lanes

  type, public :: march_t
    type(trial_t) :: trial
    type(step_control_t) :: control
    integer :: max_steps
    logical, allocatable :: accepted(:)              !! lanes whose last attempt was accepted
    real(wp), allocatable :: t_new(:)                !! end of the last attempt of each lane
    integer, allocatable :: next(:)                  !! first requested time of each lane that is not recorded yet
    real(wp), allocatable :: sample(:)               !! one lane's state at a requested time
    real(wp), allocatable :: coefficients(:, :, :)   !! of the solution inside the last step
  end type march_t

contains

  !> Allocates all that the march needs; nothing is allocated later.
  subroutine prepare(march, stepper, system, settings, times)
    type(march_t), intent(out) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(in) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: times(:)

    call stepper%prepare(system)
    call allocate_trial(march%trial, system)
    march%control = step_control(system%lanes, stepper%error_order, settings%rtol, settings%atol, times(size(times)), &
                                 settings%longest_step)
    march%max_steps = settings%max_steps
    associate (lanes => system%lanes, components => system%states + system%quadratures)
      allocate (march%accepted(lanes), source=.false.)
      allocate (march%t_new(lanes), source=times(1))
      allocate (march%next(lanes), source=2)
      allocate (march%sample(components), source=0.0_wp)
      allocate (march%coefficients(lanes, components, size(stepper%dense)), source=0.0_wp)
    end associate
  end subroutine prepare

  !> Records the start, evaluates the slope there and chooses the first step of each lane.
  subroutine start(march, stepper, system, y, first_step, observer, outcome)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: y(:, :)
    real(wp), intent(in) :: first_step   !! 0: find it
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    associate (trial => march%trial)
      trial%t(:) = march%t_new
      trial%y(:, :) = y
      do lane = 1, trial%lanes
        march%sample(:) = y(lane, :)
        call observer%record(lane, trial%t(lane), march%sample)
      end do
      call evaluate_start(trial, system, trial%working, trial%slope)
      call stepper%begin(trial)
      do lane = 1, trial%lanes
        if (trial%working(lane)) cycle
        outcome%status(lane) = merge(integration_not_finite, integration_gave_up, trial%verdict(lane) == trial_not_finite)
        outcome%component(lane) = trial%culprit(lane)
      end do
    end associate
    march%control%h(:) = first_step
    if (first_step <= 0.0_wp) call guess_first_steps(march%control, stepper%order, system, march%trial)
  end subroutine start

  !> The next attempt of the lanes that are still running.
  subroutine set_out_lanes(march, outcome)
    type(march_t), intent(inout) :: march
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    associate (trial => march%trial)
      do lane = 1, trial%lanes
        trial%working(lane) = outcome%status(lane) == integration_running
        trial%h(lane) = 0.0_wp
        if (.not. trial%working(lane)) cycle
        call propose(march%control, lane, trial%t(lane), trial%h(lane))
        outcome%h(lane) = trial%h(lane)
        outcome%steps(lane) = outcome%steps(lane) + 1
        march%t_new(lane) = trial%t(lane) + trial%h(lane)
        if (march%control%reaches_end(lane)) march%t_new(lane) = march%control%t_end
      end do
      call set_out(trial)
    end associate
  end subroutine set_out_lanes

  !> Accepts or rejects the last attempt of each lane, and ends the lanes that cannot go on.
  subroutine judge_lanes(march, outcome)
    type(march_t), intent(inout) :: march
    type(outcome_t), intent(inout) :: outcome
    integer :: lane

    call weigh_error(march%control, march%trial)
    do lane = 1, march%trial%lanes
      march%accepted(lane) = .false.
      if (outcome%status(lane) /= integration_running) cycle
      if (march%trial%verdict(lane) == trial_fine) then
        call accept_or_reject(march%control, lane, outcome%h(lane), march%accepted(lane))
      else
        call shorten(march%control, lane, outcome%h(lane))
      end if
      if (march%accepted(lane)) then
        outcome%accepted(lane) = outcome%accepted(lane) + 1
        if (march%control%reaches_end(lane)) outcome%status(lane) = integration_done
      else
        outcome%rejected(lane) = outcome%rejected(lane) + 1
        call judge_rejection(march, lane, outcome)
      end if
      if (outcome%status(lane) == integration_running .and. outcome%steps(lane) >= march%max_steps) then
        outcome%status(lane) = integration_too_many_steps
      end if
    end do
  end subroutine judge_lanes

  !> A lane fails if no shorter step will help or none is possible.
  subroutine judge_rejection(march, lane, outcome)
    type(march_t), intent(in) :: march
    integer, intent(in) :: lane
    type(outcome_t), intent(inout) :: outcome

    associate (trial => march%trial)
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
        end select
      end if
    end associate
  end subroutine judge_rejection

  !> Hands the observer the requested times that the accepted steps have passed.
  subroutine record_lanes(march, stepper, times, observer)
    type(march_t), intent(inout) :: march
    class(stepper_t), intent(in) :: stepper
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    logical :: interpolated   ! the whole block at once, when the first lane needs it
    integer :: lane

    interpolated = .false.
    do lane = 1, march%trial%lanes
      if (.not. march%accepted(lane) .or. times(march%next(lane)) > march%t_new(lane)) cycle
      if (.not. interpolated) call stepper%interpolate(march%trial, march%coefficients)
      interpolated = .true.
      call record_lane(march, lane, times, observer)
    end do
  end subroutine record_lanes

  subroutine record_lane(march, lane, times, observer)
    type(march_t), intent(inout) :: march
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    real(wp) :: theta

    associate (trial => march%trial, next => march%next(lane))
      do while (times(next) <= march%t_new(lane))
        if (times(next) < march%t_new(lane)) then
          theta = (times(next) - trial%t(lane)) / trial%h(lane)
          call sample_lane(lane, theta, trial%y, march%coefficients, march%sample)
        else
          march%sample(:) = trial%y_new(lane, :)
        end if
        call observer%record(lane, times(next), march%sample)
        if (next == size(times)) exit
        next = next + 1
      end do
    end associate
  end subroutine record_lane

  !> sample = y + sum over p of coefficients(:, :, p) theta^p, of one lane.
  pure subroutine sample_lane(lane, theta, y, coefficients, sample)
    integer, intent(in) :: lane
    real(wp), intent(in) :: theta
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)
    real(wp), contiguous, intent(inout) :: sample(:)
    real(wp) :: polynomial
    integer :: component, power

    do component = 1, size(sample)
      polynomial = 0.0_wp
      do power = size(coefficients, 3), 1, -1
        polynomial = theta * (polynomial + coefficients(lane, component, power))
      end do
      sample(component) = y(lane, component) + polynomial
    end do
  end subroutine sample_lane

  !> The accepted lanes move to the end of their step.
  subroutine advance_lanes(march)
    type(march_t), intent(inout) :: march
    integer :: lane, component

    associate (trial => march%trial, accepted => march%accepted)
      do lane = 1, trial%lanes
        if (accepted(lane)) trial%t(lane) = march%t_new(lane)
      end do
      if (all(accepted)) then
        trial%y(:, :) = trial%y_new
      else
        do component = 1, trial%components
          do lane = 1, trial%lanes
            if (accepted(lane)) trial%y(lane, component) = trial%y_new(lane, component)
          end do
        end do
      end if
    end associate
  end subroutine advance_lanes

end module nocdyn_march
