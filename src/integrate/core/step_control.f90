!> Step-size control: the weighted error norm of a step attempt and the next step size, for each lane.
module nocdyn_step_control
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_system, only: system_t
  use nocdyn_vector_functions, only: exp2s, log2s
  implicit none (type, external)
  private

  public :: step_control, reset_control, resume_control, measure_start, remember, advance_measures, measure_error, worst_measure, &
    quadrature_tolerance, adapt_steps, shorten_step, propose_steps, smallest_step, any_too_small

  ! The constants of Hairer's DOPRI5, for any order of the error estimate.
  real(wp), parameter :: beta = 0.04_wp             !! exponent of the previous error in the PI controller
  real(wp), parameter :: pi_correction = 0.75_wp    !! times beta: reduction of the exponent of the present error
  real(wp), parameter :: safety = 0.9_wp
  real(wp), parameter :: min_factor = 0.2_wp        !! smallest ratio of a step size to the last one
  real(wp), parameter :: final_stretch = 1.01_wp    !! a step is stretched by up to 1 % to end on the final time
  real(wp), parameter :: min_log_error = -13.287712379549449_wp   !! log2 of 1e-4
  real(wp), parameter :: low_order_share = 0.01_wp  !! weight of the second estimate in the error norm of Hairer's DOP853
  real(wp), parameter :: quadrature_leniency = 100.0_wp    !! ratio of the errors allowed in quadratures to those in states
  real(wp), parameter :: memory = 0.95_wp                  !! of the sizes of measured quantities, from step to step
  real(wp), parameter :: usual_rtol = 1.0e-6_wp            !! the quadratures are not less accurate than with this rtol

  real(wp), parameter :: no_error = 1.0e-30_wp         !! replaces an error of zero, whose logarithm is infinite
  real(wp), parameter :: largest_ratio = 1.0e100_wp    !! keeps the square of an error ratio finite

  type, public :: step_control_t
    real(wp) :: rtol, atol
    real(wp) :: t_end                                  !! final time [s]
    real(wp) :: longest                                !! largest step size [s]
    real(wp), allocatable :: h(:)                      !! next step size of each lane [s]
    real(wp), allocatable :: log_error(:)              !! logarithm to base 2 of the error norm of the last accepted step
    logical, allocatable :: was_rejected(:)            !! whether the last attempt was rejected
    logical, allocatable :: ends_at_t_end(:)           !! whether the present attempt ends on t_end
    real(wp), allocatable :: mean_square(:)            !! square of the error norm of the present attempt, 1 at the tolerance
    real(wp), allocatable :: log_ratio(:), factor(:)   !! work space
    ! If the system measures errors in quantities of its own, [lanes, measures]:
    real(wp), allocatable :: size(:, :)                !! of the quantities at the starts of the steps, after `measure_start`
    real(wp), allocatable :: new_size(:, :)            !! at the ends
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
    control%longest = longest
    allocate (control%h(lanes), control%mean_square(lanes), control%log_ratio(lanes), control%factor(lanes), source=0.0_wp)
    allocate (control%size(lanes, measures), control%new_size(lanes, measures), control%error(lanes, measures), source=0.0_wp)
    allocate (control%log_error(lanes), source=min_log_error)
    allocate (control%was_rejected(lanes), control%ends_at_t_end(lanes), source=.false.)
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

    associate (longest => control%longest, t_end => control%t_end, wanted => control%h)
      do lane = 1, lanes
        call propose_one(longest, t_end, t(lane), wanted(lane), h(lane), t_new(lane))
      end do
      control%ends_at_t_end(:) = t_new >= t_end
    end associate
  end subroutine propose_steps

  !> The step of one lane, whose controller wants the size `wanted`.
  pure subroutine propose_one(longest, t_end, t, wanted, h, t_new)
    real(wp), intent(in) :: longest, t_end, t, wanted
    real(wp), intent(out) :: h, t_new
    real(wp) :: overshoot, rest, step

    rest = t_end - t
    step = max(min(wanted, longest), smallest_step(t))
    overshoot = min((t + final_stretch * step) - t_end, longest - rest)
    h = merge(rest, step, overshoot >= 0)
    t_new = merge(t_end, t + step, overshoot >= 0)
  end subroutine propose_one

  !> Measures the sizes at the states of the lanes that start.
  subroutine measure_start(control, system, attempt, starting)
    type(step_control_t), intent(inout) :: control
    class(system_t), intent(in) :: system
    type(step_attempt_t), intent(in) :: attempt
    logical, intent(in) :: starting(:)   !! [lanes]
    integer :: i

    if (system%measures == 0) return
    call system%measure(size(attempt%y, 2), attempt%y, attempt%y, control%new_size, control%error)
    do i = 1, system%measures
      control%size(:, i) = merge(abs(control%new_size(:, i)), control%size(:, i), starting)
    end do
  end subroutine measure_start

  !> Sizes for the next step: the absolute values, or those before if they were larger, forgotten within some dozens of steps. An
  !> oscillation is then as large where it passes through zero as elsewhere.
  pure subroutine remember(n, before, size)
    integer, intent(in) :: n   !! lanes * measures
    real(wp), intent(in) :: before(n)
    real(wp), intent(inout) :: size(n)
    integer :: i

    do i = 1, n
      size(i) = max(abs(size(i)), memory * before(i))
    end do
  end subroutine remember

  !> Takes the sizes at the ends of accepted steps for the next ones.
  pure subroutine advance_measures(control, accepted)
    type(step_control_t), intent(inout) :: control
    logical, intent(in) :: accepted(:)
    real(wp), allocatable :: spare(:, :)
    integer :: i

    if (size(control%size) == 0) return
    if (all_true(size(accepted), accepted)) then
      call move_alloc(control%size, spare)
      call move_alloc(control%new_size, control%size)
      call move_alloc(spare, control%new_size)
    else
      do i = 1, size(control%size, 2)
        control%size(:, i) = merge(control%new_size(:, i), control%size(:, i), accepted)
      end do
    end if
  end subroutine advance_measures

  !> Sets `mean_square`, the mean of (error / (atol + rtol max(|y|, |y_new|)))^2 over the states, or over the quantities that the
  !> system measures. Each term replaces the error. Two estimates are combined as in DOP853: E5^2 / (E5 + 0.01 E3), where E5
  !> and E3 are sums of such terms.
  subroutine measure_error(control, system, attempt)
    type(step_control_t), intent(inout) :: control
    class(system_t), intent(in) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: lane

    if (attempt%has_low_order_estimate) call sum_errors(control, system, attempt, attempt%low_order_estimate, attempt%scratch)
    call sum_errors(control, system, attempt, attempt%error_estimate, control%mean_square)
    if (attempt%has_low_order_estimate) then
      do lane = 1, attempt%lanes
        associate (error_norm => control%mean_square(lane), low_order => attempt%scratch(lane))
          if (error_norm > 0) error_norm = error_norm * (error_norm / (error_norm + low_order_share * low_order))
        end associate
      end do
    end if
    control%mean_square(:) = control%mean_square / max(measured(system), 1)
    if (attempt%components > attempt%states) then
      call limit_by_quadratures(attempt, attempt%y, attempt%y_new, attempt%error_estimate, attempt%low_order_estimate, control)
    end if
  end subroutine measure_error

  !> The number of measured quantities.
  pure integer function measured(system)
    class(system_t), intent(in) :: system

    measured = merge(system%measures, system%states, system%measures > 0)
  end function measured

  !> The sum of the squared errors of a step, each relative to its tolerance.
  subroutine sum_errors(control, system, attempt, estimate, total)
    type(step_control_t), intent(inout) :: control
    class(system_t), intent(in) :: system
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(inout) :: estimate(:, :)   !! an error estimate, [lanes, padded columns]
    real(wp), contiguous, intent(inout) :: total(:)         !! [lanes]

    associate (terms => attempt%lanes * measured(system))
      if (system%measures > 0) then
        call system%measure(size(estimate, 2), attempt%y_new, estimate, control%new_size, control%error)
        call remember(terms, control%size, control%new_size)
        call square_scaled_errors(terms, control%rtol, control%atol, control%size, control%new_size, control%error)
        call sum_over_states(attempt%lanes, system%measures, control%error, total)
      else
        call square_scaled_errors(terms, control%rtol, control%atol, attempt%y, attempt%y_new, estimate)
        call sum_over_states(attempt%lanes, system%states, estimate, total)
      end if
    end associate
  end subroutine sum_errors

  !> The measured quantity, or the state, whose error was the largest in the last test of a lane.
  pure integer function worst_measure(control, attempt, lane)
    type(step_control_t), intent(in) :: control
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: lane

    if (size(control%error) > 0) then
      worst_measure = maxloc(control%error(lane, :), dim=1)
    else
      worst_measure = maxloc(attempt%error_estimate(lane, :attempt%states), dim=1)
    end if
  end function worst_measure

  !> Raises `mean_square` where the largest error of the quadratures exceeds what `quadrature_tolerance` allows. Nothing else
  !> limits steps over which the states have no error, e.g. polynomials of the time. Two estimates are combined as for the states.
  pure subroutine limit_by_quadratures(attempt, y, y_new, error_estimate, low_order_estimate, control)
    type(step_attempt_t), intent(in) :: attempt
    real(wp), intent(in), dimension(attempt%lanes, attempt%components) :: y, y_new, error_estimate, low_order_estimate
    type(step_control_t), intent(inout) :: control
    real(wp) :: low_order, error, largest, change
    integer :: i, lane

    do lane = 1, attempt%lanes
      error = 0.0_wp
      low_order = 0.0_wp
      largest = 0.0_wp
      change = 0.0_wp
      do i = attempt%states + 1, attempt%components
        error = max(error, abs(error_estimate(lane, i)))
        if (attempt%has_low_order_estimate) low_order = max(low_order, abs(low_order_estimate(lane, i)))
        largest = max(largest, abs(y(lane, i)), abs(y_new(lane, i)))
        change = max(change, abs(y_new(lane, i) - y(lane, i)))
      end do
      error = min(error, largest_ratio)
      if (error > 0) error = error * (error / hypot(error, sqrt(low_order_share) * low_order))
      associate (ratio => error / quadrature_tolerance(control, largest, change))
        control%mean_square(lane) = max(control%mean_square(lane), min(ratio, largest_ratio)**2)
      end associate
    end do
  end subroutine limit_by_quadratures

  !> The error allowed to the quadratures in a step: a share of what they change by, so that their errors add up to no more than
  !> this share of all that is turned over; where they hardly change, 100 times the tolerance.
  elemental real(wp) function quadrature_tolerance(control, largest, change) result(tolerance)
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: largest   !! absolute value of a quadrature
    real(wp), intent(in) :: change    !! absolute change of a quadrature in the step

    tolerance = quadrature_leniency * (control%atol + min(control%rtol, usual_rtol) * change) &
                + min(control%rtol, usual_rtol) * largest
  end function quadrature_tolerance

  !> Replaces each error by (error / (atol + rtol max(|y|, |y_new|)))^2.
  pure subroutine square_scaled_errors(n, rtol, atol, y, y_new, error_estimate)
    integer, intent(in) :: n   !! lanes * states
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(in) :: y(n), y_new(n)
    real(wp), intent(inout) :: error_estimate(n)
    integer :: i

    do i = 1, n
      error_estimate(i) = min(abs(error_estimate(i)) / (atol + rtol * max(abs(y(i)), abs(y_new(i)))), largest_ratio)**2
    end do
  end subroutine square_scaled_errors

  !> Sums over the states. Four partial sums, each over every fourth state, keep the additions independent of one another.
  pure subroutine sum_over_states(lanes, states, squares, total)
    integer, intent(in) :: lanes, states
    real(wp), intent(in) :: squares(lanes, states)
    real(wp), intent(inout) :: total(lanes)
    real(wp) :: part(4)
    integer :: lane, state, whole

    whole = states - modulo(states, 4)
    if (lanes > 1 .and. whole == 4) then
      do lane = 1, lanes
        total(lane) = (squares(lane, 1) + squares(lane, 2)) + (squares(lane, 3) + squares(lane, 4))
      end do
    else
      do lane = 1, lanes
        part = 0.0_wp
        do state = 1, whole, 4
          part = part + squares(lane, state:state + 3)
        end do
        total(lane) = (part(1) + part(2)) + (part(3) + part(4))
      end do
    end if
    do state = whole + 1, states
      do lane = 1, lanes
        total(lane) = total(lane) + squares(lane, state)
      end do
    end do
  end subroutine sum_over_states

  !> The next step sizes of lanes after attempts of size h: PI control where the attempt was accepted, a shorter step where it was
  !> rejected. All logarithms are to base 2.
  pure subroutine adapt_steps(control, lanes, accepted, rejected, error_order, max_growth, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lanes
    logical, intent(in) :: accepted(lanes), rejected(lanes)   !! both false: the lane keeps its step size
    integer, intent(in) :: error_order(lanes)    !! the error falls as h^(error_order + 1)
    real(wp), intent(in) :: max_growth(lanes)   !! largest ratio of the next step size to h
    real(wp), intent(in) :: h(lanes)   !! sizes of the attempts [s]
    integer :: lane

    call find_step_factors(lanes, accepted, error_order, control%mean_square, control%log_error, control%log_ratio, &
                           control%factor)
    if (lanes > 1) then
      if (all_true(lanes, accepted) .and. .not. any_true(lanes, control%was_rejected)) then
        do lane = 1, lanes   ! the general case without a branch
          control%h(lane) = max(min_factor, min(safety * control%factor(lane), max_growth(lane))) * h(lane)
          control%log_error(lane) = max(control%log_ratio(lane), min_log_error)
        end do
        return
      end if
    end if
    do lane = 1, lanes
      if (accepted(lane) .or. rejected(lane)) call set_next_step(control, lane, accepted(lane), max_growth(lane), h(lane))
    end do
  end subroutine adapt_steps

  !> The logarithms of the error norms, and the factors of the step sizes.
  pure subroutine find_step_factors(lanes, accepted, error_order, mean_square, log_error, log_ratio, factor)
    integer, intent(in) :: lanes
    logical, intent(in) :: accepted(lanes)
    integer, intent(in) :: error_order(lanes)
    real(wp), intent(in) :: mean_square(lanes), log_error(lanes)
    real(wp), intent(inout) :: log_ratio(lanes), factor(lanes)
    real(wp) :: present_exponent
    integer :: lane

    log_ratio = max(mean_square, no_error)
    call log2s(lanes, log_ratio)
    do lane = 1, lanes
      present_exponent = 1.0_wp / (error_order(lane) + 1) - pi_correction * beta
      log_ratio(lane) = 0.5_wp * log_ratio(lane)
      factor(lane) = merge(beta, 0.0_wp, accepted(lane)) * log_error(lane) - present_exponent * log_ratio(lane)
    end do
    call exp2s(lanes, factor)
  end subroutine find_step_factors

  !> Multiplies the step size h of a lane by its factor, within the limits; no growth right after a rejection.
  pure subroutine set_next_step(control, lane, is_accepted, max_growth, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    logical, intent(in) :: is_accepted
    real(wp), intent(in) :: max_growth, h
    real(wp) :: most

    most = max_growth
    if (control%was_rejected(lane)) most = min(most, 1.0_wp)
    control%h(lane) = max(min_factor, min(safety * control%factor(lane), most)) * h
    control%was_rejected(lane) = .not. is_accepted
    if (is_accepted) control%log_error(lane) = max(control%log_ratio(lane), min_log_error)
  end subroutine set_next_step

  !> Sets a shorter step after an attempt of size h that failed before its error was known.
  pure subroutine shorten_step(control, lane, h)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    real(wp), intent(in) :: h   !! [s]

    control%was_rejected(lane) = .true.
    control%h(lane) = min_factor * h
  end subroutine shorten_step

end module nocdyn_step_control
