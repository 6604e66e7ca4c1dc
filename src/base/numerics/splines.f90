!> Cubic splines: twice differentiable curves through points, which repeat with their span or go on straight beyond it; the same
!> between dwells, and monotone cubics.
module nocdyn_splines
  use nocdyn_curve_slopes, only: dwell_slopes, has_dwell, monotone_slopes, spline_slopes
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_spline

  integer, parameter, public :: spline_smooth = 1     !! with two continuous derivatives
  integer, parameter, public :: spline_dwells = 2     !! as `spline_smooth` between segments of equal values, which stay
  integer, parameter, public :: spline_monotone = 3   !! without overshoot; the second derivative jumps at the points

  !> Segment s lies between points s and s + 1.
  type, public :: spline_t
    real(wp), allocatable, private :: x(:)      !! points, ascending
    real(wp), allocatable, private :: c(:, :)   !! of the powers of x - x(s), [0:3, segments]
    logical, private :: repeats = .false.
    real(wp), private :: advance = 0.0_wp       !! of y over the span, if it repeats
  contains
    procedure :: derivatives
  end type spline_t

  interface
    subroutine dptsv(n, nrhs, d, e, b, ldb, info)
      import :: wp
      integer, intent(in) :: n, nrhs, ldb
      real(wp), intent(inout) :: d(n), e(n - 1), b(ldb, nrhs)
      integer, intent(out) :: info
    end subroutine dptsv
  end interface

contains

  !> The spline through points (x, y). If it repeats, y - advance x / span is periodic; else it has no knots next to its ends.
  function new_spline(x, y, repeats, shape) result(self)
    real(wp), intent(in) :: x(:)      !! ascending, at least 2; 3 if it repeats
    real(wp), intent(in) :: y(:)      !! [points]
    logical, intent(in) :: repeats
    integer, intent(in), optional :: shape   !! spline_..., smooth if absent
    type(spline_t) :: self
    real(wp) :: bend(size(x)), h(size(x) - 1), longer(size(x) + 2), secant(size(x) - 1), slope(size(x))
    integer :: kind, m, n

    n = size(x)
    m = n - 1
    kind = spline_smooth
    if (present(shape)) kind = shape
    h = x(2:) - x(:n - 1)
    if (n < merge(3, 2, repeats) .or. any(h <= 0)) error stop 'nocdyn_splines: a spline needs ascending points'
    secant = (y(2:) - y(:n - 1)) / h
    if (kind == spline_dwells .and. .not. any(has_dwell(secant))) kind = spline_smooth
    self%repeats = repeats
    if (repeats) self%advance = y(n) - y(1)
    allocate (self%x, source=x)
    allocate (self%c(0:3, n - 1))
    self%c(0, :) = y(:n - 1)
    if (repeats .and. kind == spline_smooth) then
      call find_periodic_bends(h, secant, bend)
      self%c(1, :) = secant - h * (2.0_wp * bend(:m) + bend(2:)) / 6.0_wp
      self%c(2, :) = 0.5_wp * bend(:m)
      self%c(3, :) = (bend(2:) - bend(:m)) / (6.0_wp * h)
      return
    end if
    select case (kind)
    case (spline_smooth)
      slope = spline_slopes(h, secant, [.false., .false.])
    case (spline_dwells)
      slope = dwell_slopes(h, secant, repeats)
    case default
      if (repeats) then
        longer = monotone_slopes([h(m), h, h(1)], [secant(m), secant, secant(1)])
        slope = longer(2:m + 2)
      else if (m > 1) then
        slope = monotone_slopes(h, secant)
      else
        slope = secant(1)
      end if
    end select
    self%c(1, :) = slope(:m)   ! Hermite's cubics
    self%c(2, :) = (3.0_wp * secant - 2.0_wp * slope(:m) - slope(2:)) / h
    self%c(3, :) = (slope(:m) + slope(2:) - 2.0_wp * secant) / h**2
  end function new_spline

  !> The second derivatives of a periodic spline: a tridiagonal system with two corners, which is one without them and a product
  !> of two vectors (Sherman and Morrison).
  subroutine find_periodic_bends(h, secant, bend)
    real(wp), intent(in) :: h(:), secant(:)   !! widths and slopes of the segments
    real(wp), intent(out) :: bend(:)          !! [segments + 1], the last is the first
    real(wp), dimension(size(h)) :: corner, diagonal, right, solution, correction
    integer :: m

    m = size(h)
    diagonal = 2.0_wp * (cshift(h, -1) + h)
    right = 6.0_wp * (secant - cshift(secant, -1))
    if (m == 2) then   ! both neighbours of a point are the other point
      associate (total => sum(h))
        bend(1) = (2.0_wp * right(1) - right(2)) / (3.0_wp * total)
        bend(2) = (2.0_wp * right(2) - right(1)) / (3.0_wp * total)
      end associate
    else
      corner = 0.0_wp
      corner([1, m]) = h(m)
      diagonal([1, m]) = diagonal([1, m]) - h(m)
      call solve_tridiagonal(diagonal, h(:m - 1), right, solution)
      call solve_tridiagonal(diagonal, h(:m - 1), corner, correction)
      bend(:m) = solution - correction * (solution(1) + solution(m)) / (1.0_wp + correction(1) + correction(m))
    end if
    bend(m + 1) = bend(1)
  end subroutine find_periodic_bends

  !> Solves a symmetric positive definite tridiagonal system (DPTSV).
  subroutine solve_tridiagonal(diagonal, beside, right, solution)
    real(wp), intent(in) :: diagonal(:), beside(:)   !! [n], [n - 1]
    real(wp), intent(in) :: right(:)                 !! [n]
    real(wp), intent(out) :: solution(:)             !! [n]
    real(wp) :: b(size(right), 1), d(size(diagonal)), e(size(beside))
    integer :: info

    d = diagonal
    e = beside
    b(:, 1) = right
    call dptsv(size(d), 1, d, e, b, size(b, 1), info)
    if (info /= 0) error stop 'nocdyn_splines: the points of a spline ascend'
    solution = b(:, 1)
  end subroutine solve_tridiagonal

  !> The value and the first three derivatives at x.
  pure function derivatives(self, x) result(y)
    class(spline_t), intent(in) :: self
    real(wp), intent(in) :: x
    real(wp) :: y(0:3), d, turns
    integer :: first, last, middle

    turns = 0.0_wp
    associate (points => self%x, n => size(self%x))
      if (self%repeats) turns = real(floor((x - points(1)) / (points(n) - points(1))), wp)
      d = x - turns * (points(n) - points(1))
      first = 1
      last = n - 1
      do while (first < last)
        middle = (first + last + 1) / 2
        if (d >= points(middle)) then
          first = middle
        else
          last = middle - 1
        end if
      end do
      d = d - points(first)
      if (.not. self%repeats .and. x > points(n)) d = points(n) - points(n - 1)
      if (.not. self%repeats .and. x < points(1)) d = 0.0_wp
    end associate
    associate (c => self%c(:, first))
      y(0) = c(1) + d * (c(2) + d * (c(3) + d * c(4))) + turns * self%advance
      y(1) = c(2) + d * (2.0_wp * c(3) + 3.0_wp * d * c(4))
      y(2) = 2.0_wp * c(3) + 6.0_wp * d * c(4)
      y(3) = 6.0_wp * c(4)
    end associate
    if (self%repeats) return
    d = x - min(max(x, self%x(1)), self%x(size(self%x)))
    if (abs(d) > 0) y = [y(0) + d * y(1), y(1), 0.0_wp, 0.0_wp]
  end function derivatives

end module nocdyn_splines
