!> Interpolation of points: by straight lines, or by cubics with the slopes of a monotone cubic, of a spline, or of splines
!> between dwells.
module nocdyn_curves
  use, intrinsic :: iso_c_binding, only: c_loc, c_long, c_null_ptr, c_ptr
  use nocdyn_curve_slopes, only: dwell_slopes, monotone_slopes, spline_slopes
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_curve, new_curve_by_slopes, new_steps

  integer, parameter, public :: interpolation_linear = 1
  integer, parameter, public :: interpolation_cubic = 2    !! without overshoot (monotone); its second derivative jumps
  integer, parameter, public :: interpolation_spline = 3   !! with two continuous derivatives
  integer, parameter, public :: interpolation_dwells = 4   !! as `interpolation_spline` between dwells, which stay
  integer, parameter, public :: extrapolation_linear = 1     !! with the slope at the end
  integer, parameter, public :: extrapolation_constant = 2   !! with the value at the end

  !> Numbers of a segment.
  integer, parameter, public :: segment_origin = 1, segment_value = 2, segment_slope = 3, segment_half_curvature = 4
  integer, parameter, public :: segment_cubic = 5, segment_area = 6
  integer, parameter, public :: segment_begin = 7, segment_end = 8   !! huge where there is none
  integer, parameter, public :: segment_size = 9                     !! largest |x| of all points

  !> Segment s lies between points s and s + 1, segment 0 before the first point, segment `points` behind the last one. The
  !> polynomial of a segment may be evaluated anywhere.
  type, public :: curve_t
    real(wp), allocatable, private :: knot(:)            !! ascending, at least 2; or 1, of steps
    real(wp), allocatable, private :: origin(:)          !! where the polynomial of each segment begins, [0:points]
    real(wp), allocatable, private :: coefficient(:, :)  !! of the powers of x - origin, [0:3, 0:points]
    real(wp), allocatable, private :: area(:)            !! integral from the first point to the origin, [0:points]
  contains
    procedure :: points, knots, is_same, segment, segment_number, value, derivatives, integral_to, describe
  end type curve_t

  !> Where the numbers of a curve stand, for programs in C: as `curve` of base/code/steps.inc.
  type, bind(c), public :: plain_curve_t
    integer(c_long) :: points = 0
    type(c_ptr) :: knot = c_null_ptr, origin = c_null_ptr, coefficient = c_null_ptr, area = c_null_ptr
  end type plain_curve_t

contains

  !> The curve through points (x, y). Two points give a straight line with either interpolation.
  function new_curve(x, y, interpolation, extrapolation) result(self)
    real(wp), intent(in) :: x(:)             !! ascending, at least 2
    real(wp), intent(in) :: y(:)             !! [points]
    integer, intent(in) :: interpolation     !! interpolation_...
    integer, intent(in) :: extrapolation     !! extrapolation_...
    type(curve_t) :: self
    real(wp) :: h(size(x) - 1), secant(size(x) - 1), slope(size(x))
    integer :: n

    n = size(x)
    call start_curve(x, y, self)
    h = x(2:) - x(:n - 1)
    secant = (y(2:) - y(:n - 1)) / h
    self%coefficient(1, 1:n - 1) = secant
    slope = [secant, secant(n - 1)]
    if (interpolation /= interpolation_linear .and. n > 2) then
      select case (interpolation)
      case (interpolation_spline)
        slope = spline_slopes(h, secant, [.false., .false.])
      case (interpolation_dwells)
        slope = dwell_slopes(h, secant, .false.)
      case default
        slope = monotone_slopes(h, secant)
      end select
      call set_cubics(h, secant, slope, self)
    end if
    if (extrapolation == extrapolation_linear) self%coefficient(1, [0, n]) = slope([1, n])
    call sum_areas(x, self)
  end function new_curve

  !> The curve of cubics through points (x, y) with given slopes there, straight beyond its ends.
  function new_curve_by_slopes(x, y, slope) result(self)
    real(wp), intent(in) :: x(:)                !! ascending, at least 2
    real(wp), intent(in) :: y(:), slope(:)      !! [points]
    type(curve_t) :: self
    real(wp) :: h(size(x) - 1)

    call start_curve(x, y, self)
    h = x(2:) - x(:size(x) - 1)
    call set_cubics(h, (y(2:) - y(:size(x) - 1)) / h, slope, self)
    self%coefficient(1, [0, size(x)]) = slope([1, size(x)])
    call sum_areas(x, self)
  end function new_curve_by_slopes

  !> Sets the points of a curve, which is constant between them.
  subroutine start_curve(x, y, self)
    real(wp), intent(in) :: x(:), y(:)   !! [points]
    type(curve_t), intent(inout) :: self

    if (size(x) < 2) error stop 'nocdyn_curves: a curve has at least two points'
    if (any(x(2:) - x(:size(x) - 1) <= 0)) error stop 'nocdyn_curves: the points of a curve ascend'
    allocate (self%knot, source=x)
    allocate (self%origin(0:size(x)), self%area(0:size(x)), self%coefficient(0:3, 0:size(x)), source=0.0_wp)
    self%origin(:) = [x(1), x]
    self%coefficient(0, :) = [y(1), y]
  end subroutine start_curve

  !> Sets the cubics between the points by the slopes there.
  pure subroutine set_cubics(h, secant, slope, self)
    real(wp), intent(in) :: h(:), secant(:)   !! distance of the points and slope between them, [points - 1]
    real(wp), intent(in) :: slope(:)          !! at the points
    type(curve_t), intent(inout) :: self
    integer :: i

    do i = 1, size(h)
      self%coefficient(1, i) = slope(i)
      self%coefficient(2, i) = (3.0_wp * secant(i) - 2.0_wp * slope(i) - slope(i + 1)) / h(i)
      self%coefficient(3, i) = (slope(i) + slope(i + 1) - 2.0_wp * secant(i)) / h(i)**2
    end do
  end subroutine set_cubics

  !> Sets the integrals from the first point to the others.
  pure subroutine sum_areas(x, self)
    real(wp), intent(in) :: x(:)   !! of the points
    type(curve_t), intent(inout) :: self
    integer :: i

    do i = 1, size(x) - 1
      self%area(i + 1) = integral_to(self, i, x(i + 1))
    end do
  end subroutine sum_areas

  !> Where the numbers stand, as long as the curve is not changed.
  subroutine describe(self, plain)
    class(curve_t), target, intent(in) :: self
    type(plain_curve_t), intent(out) :: plain

    plain = plain_curve_t(size(self%knot, kind=c_long), c_loc(self%knot), c_loc(self%origin), c_loc(self%coefficient), &
                          c_loc(self%area))
  end subroutine describe

  !> The value of each point until the next one; 0 before the first.
  function new_steps(x, y) result(self)
    real(wp), intent(in) :: x(:)   !! ascending, at least 1
    real(wp), intent(in) :: y(:)   !! [points]
    type(curve_t) :: self
    integer :: n

    n = size(x)
    allocate (self%knot, source=x)
    allocate (self%origin(0:n), self%area(0:n), self%coefficient(0:3, 0:n), source=0.0_wp)
    self%origin(:) = [x(1), x]
    self%coefficient(0, 1:) = y
    call sum_areas(x, self)
  end function new_steps

  !> Number of points.
  pure integer function points(self)
    class(curve_t), intent(in) :: self

    points = size(self%knot)
  end function points

  !> Arguments of the points, ascending.
  pure function knots(self) result(x)
    class(curve_t), intent(in) :: self
    real(wp), allocatable :: x(:)

    allocate (x, source=self%knot)
  end function knots

  !> Whether two curves with the same number of points are equal.
  pure logical function is_same(self, other)
    class(curve_t), intent(in) :: self
    type(curve_t), intent(in) :: other

    is_same = .not. (any(abs(self%knot - other%knot) > 0) .or. any(abs(self%coefficient - other%coefficient) > 0))
  end function is_same

  !> The segment in which x lies.
  pure integer function segment(self, x)
    class(curve_t), intent(in) :: self
    real(wp), intent(in) :: x
    integer :: last, middle

    segment = 0
    last = size(self%knot)
    do while (segment < last)
      middle = (segment + last + 1) / 2
      if (x >= self%knot(middle)) then
        segment = middle
      else
        last = middle - 1
      end if
    end do
  end function segment

  !> A number of a segment, by its name. On the segment the curve is value + d (slope + d (half_curvature + d cubic)) with
  !> d = x - origin; `area` is its integral from zero to the origin.
  pure real(wp) function segment_number(self, segment, name) result(number)
    class(curve_t), intent(in) :: self
    integer, intent(in) :: segment   !! 0 to points
    integer, intent(in) :: name      !! segment_...
    integer :: at_zero

    select case (name)
    case (segment_origin)
      number = self%origin(segment)
    case (segment_value, segment_slope, segment_half_curvature, segment_cubic)
      number = self%coefficient(name - segment_value, segment)
    case (segment_area)
      at_zero = self%segment(0.0_wp)
      number = self%area(segment) - integral_to(self, at_zero, 0.0_wp)
    case (segment_begin)
      number = -huge(number)
      if (segment > 0) number = self%knot(segment)
    case (segment_end)
      number = huge(number)
      if (segment < size(self%knot)) number = self%knot(segment + 1)
    case (segment_size)
      number = max(abs(self%knot(1)), abs(self%knot(size(self%knot))))
    case default
      number = 0.0_wp
      error stop 'nocdyn_curves: no such number of a segment'
    end select
  end function segment_number

  !> The curve at x.
  pure real(wp) function value(self, x)
    class(curve_t), intent(in) :: self
    real(wp), intent(in) :: x
    integer :: s

    s = self%segment(x)
    associate (d => x - self%origin(s), c => self%coefficient(:, s))
      value = c(1) + d * (c(2) + d * (c(3) + d * c(4)))
    end associate
  end function value

  !> The value and the first three derivatives of the polynomial of a segment.
  pure function derivatives(self, segment, x) result(y)
    class(curve_t), intent(in) :: self
    integer, intent(in) :: segment   !! 0 to points
    real(wp), intent(in) :: x
    real(wp) :: y(0:3)

    associate (d => x - self%origin(segment), c => self%coefficient(:, segment))
      y(0) = c(1) + d * (c(2) + d * (c(3) + d * c(4)))
      y(1) = c(2) + d * (2.0_wp * c(3) + 3.0_wp * d * c(4))
      y(2) = 2.0_wp * c(3) + 6.0_wp * d * c(4)
      y(3) = 6.0_wp * c(4)
    end associate
  end function derivatives

  !> The integral from the first point to x.
  pure function integral_to(self, segment, x) result(integral)
    class(curve_t), intent(in) :: self
    integer, intent(in) :: segment   !! that contains x
    real(wp), intent(in) :: x
    real(wp) :: d, integral

    d = x - self%origin(segment)
    associate (c => self%coefficient(:, segment))
      integral = self%area(segment) + d * (c(1) + d * (c(2) / 2.0_wp + d * (c(3) / 3.0_wp + d * c(4) / 4.0_wp)))
    end associate
  end function integral_to

end module nocdyn_curves
