!> Extremes in continuous time of functions of the solution, such as moments and reactions.
!>
!> In every step each function is replaced by the polynomial through its values at a few places of the solution inside the
!> step (Chebyshev-Lobatto places, as many as that solution has coefficients: a linear function of the state is met
!> exactly). Its critical points are found to machine precision wherever they can exceed the extremes so far. The polynomials
!> are sums of Chebyshev polynomials, which are well-conditioned at any degree.
module nocdyn_extremes
  use nocdyn_dense_output, only: dense_output_t, sample
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: observer_t, ranges_t
  use nocdyn_trial, only: trial_t
  implicit none (type, external)
  private

  public :: allocate_extremes, start_extremes, resume_extremes, follow_extremes

  real(wp), parameter :: overshoot = 0.25_wp   !! of the spread of the values: no polynomial is expected to pass them by more
  real(wp), parameter :: right_before = 64.0_wp   !! spacings of the times: more than an observer may allow for their rounding
  integer, parameter :: most_places = 40       !! in a step
  integer, parameter :: most_newton_steps = 60   !! bisection alone would need as many

  type, public :: extremes_t
    type(ranges_t), allocatable :: ranges(:)               !! [lanes]
    real(wp), allocatable, private :: last(:, :)           !! values at the end of the last step, [functions, lanes]
    real(wp), allocatable, private :: places(:)            !! in the step, -1 to 1, [places]
    real(wp), allocatable, private :: to_series(:, :)      !! from values to the coefficients of T_0, T_1, ...
    real(wp), allocatable, private :: values(:, :)         !! [functions, places]
    real(wp), allocatable, private :: y(:)                 !! [components]
  end type extremes_t

contains

  !> Room for the tracked functions of an observer, on solutions of a degree inside the step.
  subroutine allocate_extremes(extremes, functions, degree, trial)
    type(extremes_t), intent(out) :: extremes
    integer, intent(in) :: functions
    integer, intent(in) :: degree
    type(trial_t), intent(in) :: trial
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer :: i, k, lane

    if (degree >= most_places) error stop 'nocdyn_extremes: the solution inside the step has too many coefficients'
    allocate (extremes%places(degree + 1), extremes%to_series(degree + 1, degree + 1))
    do i = 0, degree
      extremes%places(i + 1) = -cos(pi * i / degree)
      do k = 0, degree
        extremes%to_series(k + 1, i + 1) = 2 * end_weight(i, degree) * end_weight(k, degree) / degree &
                                           * cos(pi * k * (degree - i) / degree)
      end do
    end do
    allocate (extremes%ranges(trial%lanes))
    do lane = 1, trial%lanes
      associate (ranges => extremes%ranges(lane))
        allocate (ranges%lowest(functions), ranges%lowest_time(functions), ranges%highest(functions), &
                  ranges%highest_time(functions), source=0.0_wp)
      end associate
    end do
    allocate (extremes%last(functions, trial%lanes), extremes%values(functions, degree + 1), extremes%y(trial%components), &
              source=0.0_wp)
  end subroutine allocate_extremes

  !> 1/2 for the first and the last term of the sums that interpolate at Chebyshev-Lobatto places.
  pure real(wp) function end_weight(i, last)
    integer, intent(in) :: i, last

    end_weight = merge(0.5_wp, 1.0_wp, i == 0 .or. i == last)
  end function end_weight

  !> The ranges of a lane at its start.
  subroutine start_extremes(extremes, observer, trial, lane)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(trial_t), intent(in) :: trial
    integer, intent(in) :: lane

    call resume_extremes(extremes, observer, trial, lane)
    associate (ranges => extremes%ranges(lane))
      ranges%lowest(:) = extremes%last(:, lane)
      ranges%highest(:) = extremes%last(:, lane)
      ranges%lowest_time(:) = trial%t(lane)
      ranges%highest_time(:) = trial%t(lane)
    end associate
  end subroutine start_extremes

  !> Takes the tracked functions anew where a lane is: they may have jumped.
  subroutine resume_extremes(extremes, observer, trial, lane)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(trial_t), intent(in) :: trial
    integer, intent(in) :: lane

    extremes%y(:) = trial%y(lane, :trial%components)
    call observer%tracked_values(lane, trial%t(lane), extremes%y, extremes%last(:, lane))
  end subroutine resume_extremes

  !> Widens the ranges of a lane by its last step, up to t_end. A function that jumps at a crossing there is taken right before:
  !> a jump is no part of the step, and would spoil the polynomial.
  subroutine follow_extremes(extremes, observer, dense, t_end, ends_at_crossing)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp), intent(in) :: t_end
    logical, intent(in) :: ends_at_crossing
    real(wp) :: t, half, middle
    integer :: i, last

    last = size(extremes%places)
    half = 0.5_wp * (t_end - dense%t)
    middle = dense%t + half
    extremes%values(:, 1) = extremes%last(:, dense%lane)
    do i = 2, last
      t = middle + extremes%places(i) * half
      if (i == last .and. ends_at_crossing) t = max(dense%t, t_end - right_before * spacing(t_end))
      call sample(dense, min(1.0_wp, (t - dense%t) / dense%h), extremes%y)
      call observer%tracked_values(dense%lane, t, extremes%y, extremes%values(:, i))
    end do
    extremes%last(:, dense%lane) = extremes%values(:, last)
    call widen(last, extremes%places, extremes%to_series, extremes%values, extremes%ranges(dense%lane), dense%t, t_end)
  end subroutine follow_extremes

  !> Widens the ranges by the polynomials through `values_of`, over the times from t_start to t_end.
  pure subroutine widen(n, places, to_series, values_of, ranges, t_start, t_end)
    integer, intent(in) :: n   !! places
    real(wp), intent(in) :: places(n), to_series(n, n)
    real(wp), contiguous, intent(in) :: values_of(:, :)   !! [functions, places]
    type(ranges_t), intent(inout) :: ranges
    real(wp), intent(in) :: t_start, t_end
    real(wp) :: values(most_places), lowest, highest, margin
    integer :: function

    do function = 1, size(values_of, 1)
      values(:n) = values_of(function, :)
      lowest = minval(values(:n))
      highest = maxval(values(:n))
      margin = overshoot * (highest - lowest)
      if (highest + margin > ranges%highest(function)) then
        call raise(n, places, to_series, values, t_start, t_end, ranges%highest(function), ranges%highest_time(function))
      end if
      if (lowest - margin < ranges%lowest(function)) then
        values(:n) = -values(:n)
        ranges%lowest(function) = -ranges%lowest(function)
        call raise(n, places, to_series, values, t_start, t_end, ranges%lowest(function), ranges%lowest_time(function))
        ranges%lowest(function) = -ranges%lowest(function)
      end if
    end do
  end subroutine widen

  !> Raises `highest` to the largest value of the polynomial through `values`, if that is larger.
  pure subroutine raise(n, places, to_series, values, t_start, t_end, highest, time)
    integer, intent(in) :: n
    real(wp), intent(in) :: places(n), to_series(n, n)
    real(wp), intent(in) :: values(most_places)
    real(wp), intent(in) :: t_start, t_end
    real(wp), intent(inout) :: highest, time
    real(wp) :: place, peak

    call find_peak(n, places, to_series, values, place, peak)
    if (peak <= highest) return
    highest = peak
    time = t_start + 0.5_wp * (1 + place) * (t_end - t_start)
    if (place >= 1) time = t_end
  end subroutine raise

  !> The largest value of the polynomial through `values` and its place, by Newton's method on the derivative with
  !> bisection as safeguard, between the neighbours of the largest of the values.
  pure subroutine find_peak(n, places, to_series, values, place, peak)
    integer, intent(in) :: n
    real(wp), intent(in) :: places(n), to_series(n, n), values(n)
    real(wp), intent(out) :: place, peak
    real(wp), dimension(most_places) :: c, slopes, curvatures   ! coefficients of the polynomial and of its derivatives
    real(wp) :: below, above, candidate, slope, curvature
    integer :: i, step

    i = maxloc(values, dim=1)
    place = places(i)
    peak = values(i)
    c(:n) = 0.0_wp
    do step = 1, n
      c(:n) = c(:n) + to_series(:, step) * values(step)
    end do
    call differentiate(n, c, slopes)
    below = places(max(i - 1, 1))
    above = places(min(i + 1, n))
    if (series_value(n, slopes, below) <= 0 .or. series_value(n, slopes, above) >= 0) return
    call differentiate(n, slopes, curvatures)
    candidate = place
    do step = 1, most_newton_steps
      slope = series_value(n, slopes, candidate)
      curvature = series_value(n, curvatures, candidate)
      if (slope > 0) then
        below = candidate
      else
        above = candidate
      end if
      candidate = 0.5_wp * (below + above)
      if (curvature < 0) then
        if (abs(slope) < -curvature * (above - below)) candidate = min(above, max(below, place - slope / curvature))
      end if
      if (abs(candidate - place) <= epsilon(place)) exit
      place = candidate
    end do
    peak = max(peak, series_value(n, c, place))
  end subroutine find_peak

  !> The coefficients of the derivative of a sum of Chebyshev polynomials: d_(k-1) = d_(k+1) + 2 k c_k, the first halved.
  pure subroutine differentiate(n, c, d)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(n)   !! of T_0 to T_(n-1)
    real(wp), intent(inout) :: d(n)
    real(wp) :: after(most_places + 2)
    integer :: k

    after(:n + 2) = 0.0_wp
    do k = n - 1, 1, -1
      after(k) = after(k + 2) + 2 * k * c(k + 1)
    end do
    d = after(:n)
    d(1) = 0.5_wp * d(1)
  end subroutine differentiate

  !> The sum of Chebyshev polynomials at x, by Clenshaw's recurrence.
  pure real(wp) function series_value(n, c, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(n), x
    real(wp) :: last, last_but_one, next
    integer :: k

    last = 0.0_wp
    last_but_one = 0.0_wp
    do k = n, 2, -1
      next = c(k) + 2 * x * last - last_but_one
      last_but_one = last
      last = next
    end do
    series_value = c(1) + x * last - last_but_one
  end function series_value

end module nocdyn_extremes
