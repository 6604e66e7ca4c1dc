!> Errors of the analytic derivatives and of the energy of a bank with one element and one lane.
module nocdyn_test_law_checks
  use nocdyn_bank, only: bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_test_law_differences, only: bank_values_t, by_angle, by_state, by_speed, by_time, choose_branches, difference_laws, &
                                         elements_of, evaluate_all, law_slopes_t
  implicit none (type, external)
  private

  public :: law_error, energy_error

  real(wp), parameter :: step = 1.0e-3_wp   !! the error is step^4 / 30 times the fifth derivative, and rounding of 1e-13

contains

  !> The largest difference between a derivative and its finite difference, relative to the largest derivative or 1.
  function law_error(bank, angle, speed, time, internal) result(error)
    class(bank_t), intent(in) :: bank
    real(wp), intent(in) :: angle, speed            !! u [rad], u' [rad/s]
    real(wp), intent(in), optional :: time          !! [s]; absent: 0
    real(wp), intent(in), optional :: internal(:)   !! internal states; absent: 0
    real(wp) :: error
    type(bank_values_t) :: elements
    type(law_slopes_t) :: slopes
    integer :: s

    elements = elements_of(bank)
    elements%angle = angle
    elements%speed = speed
    if (present(time)) elements%time = time
    if (present(internal)) elements%internal%value(1, :) = internal
    call choose_branches(bank, elements)
    call evaluate_all(bank, elements)
    error = 0.0_wp
    slopes = difference_laws(bank, elements, by_angle, step)
    error = max(error, misfit(slopes%restoring, elements%restoring_angle), misfit(slopes%applied, elements%applied_angle))
    error = max(error, misfit(slopes%tangent, elements%restoring_curvature), misfit(-slopes%stored, elements%restoring))
    error = max(error, maxval([0.0_wp, abs(slopes%rate)]))
    slopes = difference_laws(bank, elements, by_speed, step)
    error = max(error, misfit(slopes%applied, elements%applied_speed), maxval(abs(slopes%restoring)))
    error = max(error, misfit(slopes%rate, elements%internal%rate_speed))
    slopes = difference_laws(bank, elements, by_time, step)
    error = max(error, misfit(slopes%applied, elements%applied_time), maxval(abs(slopes%restoring)))
    error = max(error, misfit(slopes%rate, elements%internal%rate_time))
    do s = 1, bank%states
      slopes = difference_laws(bank, elements, by_state + s, step)
      error = max(error, misfit(slopes%applied, elements%internal%applied(:, s:s)), maxval(abs(slopes%restoring)))
      error = max(error, misfit(slopes%rate, elements%internal%rate_internal(:, s, :)))
    end do
  end function law_error

  pure function misfit(expected, found)
    real(wp), intent(in) :: expected(:, :), found(:, :)
    real(wp) :: misfit

    misfit = maxval([0.0_wp, abs(expected - found)]) / max(1.0_wp, maxval([0.0_wp, abs(expected)]))
  end function misfit

  !> The difference between the increase of the stored energy and the integral of the restoring moment (trapezoidal rule),
  !> relative to the largest energy. The range of angles should contain all branches.
  function energy_error(bank, low, high) result(error)
    class(bank_t), intent(in) :: bank
    real(wp), intent(in) :: low, high   !! ends of the range of angles [rad]
    real(wp) :: error
    type(bank_values_t) :: elements
    integer, parameter :: steps = 20000
    real(wp) :: area, before, largest, start
    integer :: i

    elements = elements_of(bank)
    area = 0.0_wp
    before = 0.0_wp
    start = 0.0_wp
    largest = 0.0_wp
    do i = 0, steps
      elements%angle = low + (high - low) * i / steps
      call choose_branches(bank, elements)
      call evaluate_all(bank, elements)
      if (i == 0) start = elements%stored(1, 1)
      if (i > 0) area = area - 0.5_wp * (before + elements%restoring(1, 1)) * (high - low) / steps
      before = elements%restoring(1, 1)
      largest = max(largest, abs(elements%stored(1, 1)))
    end do
    error = abs(elements%stored(1, 1) - start - area) / largest
  end function energy_error

end module nocdyn_test_law_checks
