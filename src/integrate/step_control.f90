!> How long the next step of each lane is.
module nocdyn_step_control
  use nocdyn_kinds, only: wp
  use nocdyn_trial, only: trial_t
  implicit none (type, external)
  private

  public :: step_control, weigh_error, accept_or_reject, shorten, propose, smallest_step

  ! The constants of Hairer's DOPRI5, for any order of the error estimate.
  real(wp), parameter :: beta = 0.04_wp            !! weight of the last error in the PI controller
  real(wp), parameter :: integral_loss = 0.75_wp   !! what beta takes from the exponent of the present error
  real(wp), parameter :: safety = 0.9_wp
  real(wp), parameter :: least_change = 0.2_wp
  real(wp), parameter :: most_change = 10.0_wp
  real(wp), parameter :: end_stretch = 1.01_wp     !! a step is stretched by up to 1 % to end on the final time
  real(wp), parameter :: least_old_error = 1.0e-4_wp

  real(wp), parameter :: no_error = 1.0e-30_wp         !! stands for an error of zero under the logarithm
  real(wp), parameter :: largest_ratio = 1.0e100_wp    !! keeps the square of an error ratio finite

  type, public :: step_control_t
    real(wp) :: rtol, atol
    real(wp) :: t_end
    real(wp) :: longest
    real(wp) :: exponent                               !! of the present error
    real(wp), allocatable :: h(:)                      !! next step size of each lane
    real(wp), allocatable :: log_error(:)              !! logarithm of the error of the last accepted step
    logical, allocatable :: was_rejected(:)
    logical, allocatable :: reaches_end(:)             !! the present step ends on t_end
    real(wp), allocatable :: mean_square(:)            !! mean squared error ratio of the present step, 1 at the tolerance
  end type step_control_t

contains

  !> A controller for an error estimate of order `error_order`; the first step sizes are still to be set.
  pure function step_control(lanes, error_order, rtol, atol, t_end, longest) result(control)
    integer, intent(in) :: lanes
    integer, intent(in) :: error_order
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(in) :: t_end
    real(wp), intent(in) :: longest
    type(step_control_t) :: control

    control%rtol = rtol
    control%atol = atol
    control%t_end = t_end
    control%longest = longest
    control%exponent = 1.0_wp / (error_order + 1) - integral_loss * beta
    allocate (control%h(lanes), control%mean_square(lanes), source=0.0_wp)
    allocate (control%log_error(lanes), source=log(least_old_error))
    allocate (control%was_rejected(lanes), control%reaches_end(lanes), source=.false.)
  end function step_control

  !> No step can be shorter: ten spacings of the numbers at t.
  elemental function smallest_step(t)
    real(wp), intent(in) :: t
    real(wp) :: smallest_step

    smallest_step = 10 * spacing(t)
  end function smallest_step

  !> Sets the size of the next attempt of a lane, so that no sliver is left before the final time.
  pure subroutine propose(control, lane, t, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), intent(out) :: h

    h = max(min(control%h(lane), control%longest), smallest_step(t))
    control%reaches_end(lane) = t + end_stretch * h >= control%t_end
    if (control%reaches_end(lane)) h = control%t_end - t
  end subroutine propose

  !> The mean over the states of (deviation / (atol + rtol max(|y|, |y_new|)))^2; leaves each term in `deviation`.
  pure subroutine weigh_error(control, trial)
    type(step_control_t), intent(inout) :: control
    type(trial_t), intent(inout) :: trial

    call weigh(trial%lanes, trial%states, control%rtol, control%atol, trial%y, trial%y_new, trial%deviation, &
               control%mean_square)
  end subroutine weigh_error

  pure subroutine weigh(lanes, states, rtol, atol, y, y_new, deviation, mean_square)
    integer, intent(in) :: lanes, states
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(in) :: y(lanes * states), y_new(lanes * states)
    real(wp), intent(inout) :: deviation(lanes * states)
    real(wp), intent(inout) :: mean_square(lanes)
    real(wp) :: total
    integer :: i, lane

    do i = 1, lanes * states
      deviation(i) = min(abs(deviation(i)) / (atol + rtol * max(abs(y(i)), abs(y_new(i)))), largest_ratio)**2
    end do
    do lane = 1, lanes
      total = 0.0_wp
      do i = lane, lanes * states, lanes
        total = total + deviation(i)
      end do
      mean_square(lane) = total / max(states, 1)
    end do
  end subroutine weigh

  !> PI control after a completed attempt of size h.
  pure subroutine accept_or_reject(control, lane, h, accepted)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    real(wp), intent(in) :: h
    logical, intent(out) :: accepted
    real(wp) :: log_error, change

    log_error = 0.5_wp * log(max(control%mean_square(lane), no_error))
    accepted = control%mean_square(lane) <= 1
    if (accepted) then
      change = safety * exp(beta * control%log_error(lane) - control%exponent * log_error)
      change = max(least_change, min(change, most_change))
      if (control%was_rejected(lane)) change = min(change, 1.0_wp)
      control%log_error(lane) = max(log_error, log(least_old_error))
    else
      change = max(least_change, safety * exp(-control%exponent * log_error))
    end if
    control%was_rejected(lane) = .not. accepted
    control%h(lane) = change * h
  end subroutine accept_or_reject

  !> After an attempt of size h that could not be completed.
  pure subroutine shorten(control, lane, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    real(wp), intent(in) :: h

    control%was_rejected(lane) = .true.
    control%h(lane) = least_change * h
  end subroutine shorten

end module nocdyn_step_control
