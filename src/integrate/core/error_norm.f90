!> The error norm of a step attempt: the root mean square of the errors, each relative to its tolerance.
!>
!> Errors are measured in the states, or in the quantities that the system names. The size of such a quantity is remembered
!> over some dozens of steps, so that an oscillation is as large where it passes through zero as elsewhere.
module nocdyn_error_norm
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_step_control, only: step_control_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: measure_start, forget_sizes, remember, measure_error, worst_measure, quadrature_tolerance

  real(wp), parameter :: low_order_share = 0.01_wp  !! weight of the second estimate in the error norm of Hairer's DOP853
  real(wp), parameter :: quadrature_leniency = 100.0_wp    !! ratio of the errors allowed in quadratures to those in states
  real(wp), parameter, public :: memory = 0.95_wp          !! of the sizes of measured quantities, from step to step
  real(wp), parameter :: usual_rtol = 1.0e-6_wp            !! the quadratures are not less accurate than with this rtol

  real(wp), parameter :: largest_ratio = 1.0e100_wp    !! keeps the square of an error ratio finite

contains

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

  !> Forgets the sizes of the lanes that start: those that `remember` sets first are the ones of `measure_start`.
  pure subroutine forget_sizes(control, starting)
    type(step_control_t), intent(inout) :: control
    logical, intent(in) :: starting(:)   !! [lanes]
    integer :: i

    do i = 1, size(starting)
      if (starting(i)) control%size(i, :) = 0.0_wp
    end do
  end subroutine forget_sizes

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

  !> Sets `mean_square`, the mean of (error / (atol + rtol max(|y|, |y_new|)))^2 over the states, or over the quantities that the
  !> system measures. Each term replaces the error. Two estimates are combined as in DOP853: E5^2 / (E5 + 0.01 E3), where E5
  !> and E3 are sums of such terms. A lane whose step size is given has no error, and keeps the sizes that came with that.
  subroutine measure_error(control, system, attempt)
    type(step_control_t), intent(inout) :: control
    class(system_t), intent(in) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: lane
    logical :: are_some_given

    if (all_true(attempt%lanes, control%is_given)) return
    are_some_given = any_true(attempt%lanes, control%is_given)
    if (are_some_given) control%kept_size(:, :) = control%new_size
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
    if (attempt%components > attempt%states) call limit_by_quadratures(attempt, control)
    if (.not. are_some_given) return
    do lane = 1, attempt%lanes
      if (.not. control%is_given(lane)) cycle
      control%mean_square(lane) = 0.0_wp
      control%new_size(lane, :) = control%kept_size(lane, :)
    end do
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
  pure subroutine limit_by_quadratures(attempt, control)
    type(step_attempt_t), intent(in) :: attempt
    type(step_control_t), intent(inout) :: control
    real(wp) :: low_order, error, largest, change
    integer :: i, lane

    do lane = 1, attempt%lanes
      error = 0.0_wp
      low_order = 0.0_wp
      largest = 0.0_wp
      change = 0.0_wp
      do i = attempt%states + 1, attempt%components
        error = max(error, abs(attempt%error_estimate(lane, i)))
        if (attempt%has_low_order_estimate) low_order = max(low_order, abs(attempt%low_order_estimate(lane, i)))
        largest = max(largest, abs(attempt%y(lane, i)), abs(attempt%y_new(lane, i)))
        change = max(change, abs(attempt%y_new(lane, i) - attempt%y(lane, i)))
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
    real(wp), intent(in) :: rtol, atol, y(n), y_new(n)
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

end module nocdyn_error_norm
