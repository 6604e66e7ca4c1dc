!> Step-size control: the next step size of each lane, from the error norm of its last attempt (`nocdyn_error_norm`).
module nocdyn_step_control
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_vector_functions, only: exp2s, log2s
  implicit none (type, external)
  private

  public :: step_control, reset_control, resume_control, adapt_steps, shorten_step, propose_steps, smallest_step, any_too_small

  ! The constants of Hairer's DOPRI5, for any order of the error estimate.
  real(wp), parameter :: beta = 0.04_wp             !! exponent of the previous error in the PI controller
  real(wp), parameter :: pi_correction = 0.75_wp    !! times beta: reduction of the exponent of the present error
  real(wp), parameter :: safety = 0.9_wp
  real(wp), parameter :: min_factor = 0.2_wp        !! smallest ratio of a step size to the last one
  real(wp), parameter, public :: final_stretch = 1.01_wp   !! a step is stretched by up to 1 % to end on the final time
  real(wp), parameter :: min_log_error = -13.287712379549449_wp   !! log2 of 1e-4

  real(wp), parameter :: no_error = 1.0e-30_wp         !! replaces an error of zero, whose logarithm is infinite

  type, public :: step_control_t
    real(wp) :: rtol, atol
    real(wp) :: t_end                                  !! final time [s]
    real(wp) :: longest_step                           !! largest step size of all lanes [s]
    real(wp), allocatable :: longest(:)                !! largest step size of each lane [s], [lanes]
    real(wp), allocatable :: h(:)                      !! next step size of each lane [s]
    real(wp), allocatable :: log_error(:)              !! logarithm to base 2 of the error norm of the last accepted step
    logical, allocatable :: was_rejected(:)            !! whether the last attempt was rejected
    logical, allocatable :: ends_at_t_end(:)           !! whether the present attempt ends on t_end
    logical, allocatable :: is_given(:)                !! whether the method has chosen the step size: no error is estimated
    real(wp), allocatable :: mean_square(:)            !! square of the error norm of the present attempt, 1 at the tolerance
    real(wp), allocatable :: log_ratio(:), factor(:)   !! work space
    ! If the system measures errors in quantities of its own, [lanes, measures]:
    real(wp), allocatable :: size(:, :)                !! of the quantities at the starts of the steps, after `measure_start`
    real(wp), allocatable :: new_size(:, :)            !! at the ends
    real(wp), allocatable :: kept_size(:, :)           !! work space
    real(wp), allocatable :: error(:, :)               !! of the quantities; after the test their terms of `mean_square`
  end type step_control_t

contains

  !> A controller for a block of lanes; the caller sets the first step sizes `h`.
  pure function step_control(lanes, measures, rtol, atol, t_end, longest) result(control)
    integer, intent(in) :: lanes
    integer, intent(in) :: measures   !! of the system
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(in) :: t_end     !! final time [s]
    real(wp), intent(in) :: longest   !! largest step size [s]
    type(step_control_t) :: control

    control%rtol = rtol
    control%atol = atol
    control%t_end = t_end
    control%longest_step = longest
    allocate (control%longest(lanes), source=longest)
    allocate (control%h(lanes), control%mean_square(lanes), control%log_ratio(lanes), control%factor(lanes), source=0.0_wp)
    allocate (control%size(lanes, measures), control%new_size(lanes, measures), control%kept_size(lanes, measures), &
              control%error(lanes, measures), source=0.0_wp)
    allocate (control%log_error(lanes), source=min_log_error)
    allocate (control%was_rejected(lanes), control%ends_at_t_end(lanes), control%is_given(lanes), source=.false.)
  end function step_control

  !> Clears the history of a lane.
  pure subroutine reset_control(control, lane)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane

    control%log_error(lane) = min_log_error
    control%was_rejected(lane) = .false.
  end subroutine reset_control

  !> Clears the history of a lane whose equations have changed within a step. The next step is not longer than that one.
  pure subroutine resume_control(control, lane, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    real(wp), intent(in) :: h   !! size of that step [s]

    call reset_control(control, lane)
    control%h(lane) = min(control%h(lane), h)
  end subroutine resume_control

  !> Smallest step size at the time t: ten times the rounding error of t.
  elemental function smallest_step(t)
    real(wp), intent(in) :: t
    real(wp) :: smallest_step

    smallest_step = 10 * max(epsilon(t) * abs(t), tiny(t))
  end function smallest_step

  !> Whether the step size of any lane is at most `smallest_step`.
  pure logical function any_too_small(lanes, t, h)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: t(lanes), h(lanes)   !! times and step sizes [s]
    integer :: lane, small

    small = 0
    do lane = 1, lanes
      small = small + merge(1, 0, h(lane) <= smallest_step(t(lane)))
    end do
    any_too_small = small > 0
  end function any_too_small

  !> Sets the sizes and ends of the next attempts. A step that would leave a tiny rest before the final time is stretched.
  pure subroutine propose_steps(control, lanes, t, h, t_new)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lanes
    real(wp), intent(in) :: t(lanes)          !! present times [s]
    real(wp), intent(inout) :: h(lanes)       !! step sizes [s]
    real(wp), intent(inout) :: t_new(lanes)   !! ends of the steps [s]
    integer :: lane
    real(wp) :: overshoot, rest, step

    associate (longest => control%longest, t_end => control%t_end, wanted => control%h)
      do lane = 1, lanes
        rest = t_end - t(lane)
        step = max(min(wanted(lane), longest(lane)), smallest_step(t(lane)))
        overshoot = min((t(lane) + final_stretch * step) - t_end, longest(lane) - rest)
        h(lane) = merge(rest, step, overshoot >= 0)
        t_new(lane) = merge(t_end, t(lane) + step, overshoot >= 0)
      end do
      control%ends_at_t_end(:) = t_new >= t_end
    end associate
  end subroutine propose_steps

  !> The next step sizes of lanes after attempts of size h, unless they are given: PI control where the attempt was accepted, a
  !> shorter step where it was rejected. All logarithms are to base 2.
  pure subroutine adapt_steps(control, lanes, accepted, rejected, error_order, max_growth, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lanes
    logical, intent(in) :: accepted(lanes), rejected(lanes)   !! both false: the lane keeps its step size
    integer, intent(in) :: error_order(lanes)    !! the error falls as h^(error_order + 1)
    real(wp), intent(in) :: max_growth(lanes)   !! largest ratio of the next step size to h
    real(wp), intent(in) :: h(lanes)   !! sizes of the attempts [s]
    integer :: lane
    real(wp) :: most, present_exponent

    if (all_true(lanes, control%is_given)) return
    ! the logarithms of the error norms, and the factors of the step sizes
    control%log_ratio(:) = max(control%mean_square, no_error)
    call log2s(lanes, control%log_ratio)
    do lane = 1, lanes
      present_exponent = 1.0_wp / (error_order(lane) + 1) - pi_correction * beta
      control%log_ratio(lane) = 0.5_wp * control%log_ratio(lane)
      control%factor(lane) = merge(beta, 0.0_wp, accepted(lane)) * control%log_error(lane) &
                             - present_exponent * control%log_ratio(lane)
    end do
    call exp2s(lanes, control%factor)
    if (lanes > 1) then
      if (all_true(lanes, accepted) .and. .not. any_true(lanes, control%was_rejected) &
          .and. .not. any_true(lanes, control%is_given)) then
        do lane = 1, lanes   ! the general case without a branch
          control%h(lane) = max(min_factor, min(safety * control%factor(lane), max_growth(lane))) * h(lane)
          control%log_error(lane) = max(control%log_ratio(lane), min_log_error)
        end do
        return
      end if
    end if
    do lane = 1, lanes
      if (control%is_given(lane)) cycle
      if (accepted(lane) .or. rejected(lane)) then
        most = max_growth(lane)   ! no growth right after a rejection
        if (control%was_rejected(lane)) most = min(most, 1.0_wp)
        control%h(lane) = max(min_factor, min(safety * control%factor(lane), most)) * h(lane)
        control%was_rejected(lane) = .not. accepted(lane)
        if (accepted(lane)) control%log_error(lane) = max(control%log_ratio(lane), min_log_error)
      end if
    end do
  end subroutine adapt_steps

  !> Sets a shorter step after an attempt of size h that failed before its error was known.
  pure subroutine shorten_step(control, lane, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    real(wp), intent(in) :: h   !! [s]

    control%was_rejected(lane) = .true.
    control%h(lane) = min_factor * h
  end subroutine shorten_step

end module nocdyn_step_control
