!> Extremes of polynomials on [-1, 1], which are given by their values at the Chebyshev-Lobatto nodes; none is missed.
!>
!> A polynomial is a sum c_0 T_0 + c_1 T_1 + ... of Chebyshev polynomials, which is well-conditioned at any degree, and so are its
!> slope and its curvature. As |T_k| <= 1, the coefficients bound all three. A part of the interval in which the polynomial may be
!> too large, and in which these bounds do not show that it is monotonic, convex or concave, is halved.
module nocdyn_chebyshev
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_interpolation, raise_to_maximum, find_last_exit, list_extremes, last_terms, time_at

  integer, parameter, public :: max_degree = 39
  integer, parameter :: max_halvings = 52           !! of [-1, 1], until no number is left inside a part
  integer, parameter :: max_parts = 1000            ! far more than are needed to resolve a polynomial
  integer, parameter :: max_newton_steps = 60       ! bisection alone would need as many
  integer, parameter :: rows = 8                    ! of the matrix that are multiplied together
  real(wp), parameter :: last_change = 1.0e-4_wp    ! of Newton's method: the error of x is its square, of the maximum less
  real(wp), parameter :: least_half = 1.0e-8_wp     ! length of a part: its middle is a maximum to rounding
  real(wp), parameter :: lebesgue_constant = 4.0_wp   ! bound on the ratio of a polynomial to its values at up to 40 nodes

  !> Interpolation at the nodes of one degree.
  type, public :: interpolation_t
    integer :: degree = 0
    real(wp), allocatable :: nodes(:)                !! -cos(pi i / degree), ascending, [0:degree]
    real(wp), allocatable, private :: series(:, :)   !! from values to coefficients and zeros, [whole vectors, 0:degree]
  end type interpolation_t

  !> Parts of [-1, 1] that are left to be searched; the last one is next.
  type :: series_parts_t
    integer :: count
    real(wp) :: middle(max_halvings + 2), half(max_halvings + 2)   !! middles and half lengths
  end type series_parts_t

contains

  !> The nodes of a degree.
  pure type(interpolation_t) function new_interpolation(degree) result(self)
    integer, intent(in) :: degree   !! 1 to `max_degree`
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer :: i, k

    if (degree > max_degree) error stop 'nocdyn_chebyshev: a polynomial has too many coefficients'
    self%degree = degree
    allocate (self%nodes(0:degree))
    allocate (self%series(0:rows * (degree / rows + 1) - 1, 0:degree), source=0.0_wp)
    do i = 0, degree
      self%nodes(i) = -cos(pi * i / degree)
      do k = 0, degree
        self%series(k, i) = 2 * end_weight(i, degree) * end_weight(k, degree) / degree * cos(pi * k * (degree - i) / degree)
      end do
    end do
  end function new_interpolation

  !> The weight of a term in interpolation at Chebyshev-Lobatto nodes: 1/2 for the first and last one, else 1.
  pure real(wp) function end_weight(i, last)
    integer, intent(in) :: i, last

    end_weight = merge(0.5_wp, 1.0_wp, i == 0 .or. i == last)
  end function end_weight

  !> Raises `highest` to the largest value of a polynomial, if that is larger.
  pure subroutine raise_to_maximum(rule, values, highest, position, found)
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: values(0:rule%degree)   !! at the nodes
    real(wp), intent(inout) :: highest              !! largest value so far
    real(wp), intent(out) :: position               !! of the maximum, -1 to 1
    logical, intent(out) :: found                   !! whether `highest` has been raised
    real(wp), dimension(0:max_degree) :: whole, part_values, c, slopes, bends
    real(wp) :: middle, half, rounding, sizes, turn, x
    type(series_parts_t) :: parts
    logical, dimension(2) :: has_none, has_one   ! of maxima, of minima
    integer :: bottom, i, part, top

    top = 0
    bottom = 0
    do i = 1, rule%degree
      if (values(i) > values(top)) top = i
      if (values(i) < values(bottom)) bottom = i
    end do
    position = rule%nodes(top)
    found = values(top) > highest
    if (found) highest = values(top)
    if (0.5_wp * ((1 - lebesgue_constant) * values(bottom) + (1 + lebesgue_constant) * values(top)) <= highest) return
    call find_series(rule, values, whole)
    parts%count = 0
    call add_part(parts, 0.0_wp, 1.0_wp)
    do part = 1, max_parts
      if (parts%count == 0) exit
      call take_part(rule, values, whole, parts, middle, half, part_values, c)
      sizes = sum(abs(c(:rule%degree)))
      rounding = 8 * rule%degree * max(epsilon(sizes) * sizes, tiny(sizes))
      if (.not. c(0) - abs(c(0)) + sizes - rounding > highest) cycle
      call differentiate(rule%degree, c, slopes)
      call differentiate(rule%degree, slopes, bends)
      call count_turns(rule%degree, slopes, bends, has_none, has_one)
      if (has_none(1)) cycle
      x = 0.0_wp
      if (has_one(1)) call find_turn(rule, part_values, slopes, bends, x)
      turn = value(rule%degree, c, x)
      if (turn > highest) then
        highest = turn
        position = middle + half * x
        found = .true.
      end if
      if (has_one(1) .or. half <= least_half) cycle
      call add_part(parts, middle + 0.5_wp * half, 0.5_wp * half)
      call add_part(parts, middle - 0.5_wp * half, 0.5_wp * half)
    end do
  end subroutine raise_to_maximum

  !> The last position at which |p| > tolerance.
  pure subroutine find_last_exit(rule, values, tolerance, position, found)
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: values(0:rule%degree)   !! of p at the nodes
    real(wp), intent(in) :: tolerance
    real(wp), intent(out) :: position               !! -1 to 1
    logical, intent(out) :: found                   !! whether there is one
    real(wp), dimension(0:max_degree) :: whole, part, c
    real(wp) :: middle, half
    type(series_parts_t) :: parts

    found = .false.
    position = -1.0_wp
    if (lebesgue_constant * maxval(abs(values)) <= tolerance) return
    call find_series(rule, values, whole)
    parts%count = 0
    call add_part(parts, 0.0_wp, 1.0_wp)
    do while (parts%count > 0)
      call take_part(rule, values, whole, parts, middle, half, part, c)
      if (.not. sum(abs(c(:rule%degree))) > tolerance) cycle
      position = middle + half
      found = abs(sum(c(:rule%degree))) > tolerance .or. half <= epsilon(half)
      if (found) return
      call add_part(parts, middle - 0.5_wp * half, 0.5_wp * half)
      call add_part(parts, middle + 0.5_wp * half, 0.5_wp * half)
    end do
  end subroutine find_last_exit

  !> The values of the extremes between the ends, ascending with their positions. Parts are left out in which the polynomial
  !> changes by less than a range: their extremes do not count.
  pure subroutine list_extremes(rule, values, least, extremes, count)
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: values(0:rule%degree)   !! at the nodes
    real(wp), intent(in) :: least                   !! that range
    real(wp), intent(out) :: extremes(max_degree)
    integer, intent(out) :: count
    real(wp), dimension(0:max_degree) :: whole, part_values, c, slopes, bends
    real(wp) :: middle, half, x
    type(series_parts_t) :: parts
    logical, dimension(2) :: has_none, has_one   ! of maxima, of minima
    integer :: part

    count = 0
    call find_series(rule, values, whole)
    parts%count = 0
    call add_part(parts, 0.0_wp, 1.0_wp)
    do part = 1, max_parts
      if (parts%count == 0 .or. count == max_degree) exit
      call take_part(rule, values, whole, parts, middle, half, part_values, c)
      if (.not. 2 * sum(abs(c(1:rule%degree))) > least) cycle
      call differentiate(rule%degree, c, slopes)
      call differentiate(rule%degree, slopes, bends)
      call count_turns(rule%degree, slopes, bends, has_none, has_one)
      if (all(has_none)) cycle
      x = 0.0_wp
      if (has_one(2)) then   ! of the negative polynomial that is a maximum
        part_values(:rule%degree) = -part_values(:rule%degree)
        slopes(:rule%degree) = -slopes(:rule%degree)
        bends(:rule%degree) = -bends(:rule%degree)
      end if
      if (any(has_one)) call find_turn(rule, part_values, slopes, bends, x)
      if (any(has_one) .or. half <= least_half) then
        count = count + 1
        extremes(count) = value(rule%degree, c, x)
      else
        call add_part(parts, middle + 0.5_wp * half, 0.5_wp * half)
        call add_part(parts, middle - 0.5_wp * half, 0.5_wp * half)
      end if
    end do
  end subroutine list_extremes

  pure subroutine add_part(parts, middle, half)
    type(series_parts_t), intent(inout) :: parts
    real(wp), intent(in) :: middle, half

    parts%count = parts%count + 1
    parts%middle(parts%count) = middle
    parts%half(parts%count) = half
  end subroutine add_part

  !> Takes the next part off the list: its middle, its half length, and the polynomial in it.
  pure subroutine take_part(rule, whole_values, whole, parts, middle, half, values, c)
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: whole_values(0:rule%degree), whole(0:max_degree)   !! of the whole polynomial: values, coefficients
    type(series_parts_t), intent(inout) :: parts
    real(wp), intent(out) :: middle, half, values(0:max_degree), c(0:max_degree)
    real(wp) :: x(0:max_degree)

    middle = parts%middle(parts%count)
    half = parts%half(parts%count)
    parts%count = parts%count - 1
    if (half >= 1) then
      values(:rule%degree) = whole_values
      c(:rule%degree) = whole(:rule%degree)
      return
    end if
    x = 0.0_wp
    x(:rule%degree) = middle + half * rule%nodes
    call find_values(rule%degree, whole, x, values)
    call find_series(rule, values, c)
  end subroutine take_part

  !> The values at the points x, as many as coefficients, as by `value`: many points at once.
  pure subroutine find_values(n, c, x, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n), x(0:max_degree)
    real(wp), intent(out) :: values(0:max_degree)
    real(wp), dimension(rows) :: last, last_but_one, next
    integer :: i, k, p

    do p = 0, n, rows
      last = 0.0_wp
      last_but_one = 0.0_wp
      do k = n, 1, -1
        do i = 1, rows
          next(i) = 2 * x(p + i - 1) * last(i) + (c(k) - last_but_one(i))
          last_but_one(i) = last(i)
          last(i) = next(i)
        end do
      end do
      do i = 1, rows
        values(p + i - 1) = c(0) + x(p + i - 1) * last(i) - last_but_one(i)
      end do
    end do
  end subroutine find_values

  !> The coefficients from the values at the nodes.
  pure subroutine find_series(rule, values, c)
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: values(0:rule%degree)
    real(wp), intent(out) :: c(0:max_degree)
    real(wp) :: sum(rows)
    integer :: i, k

    do k = 0, rule%degree, rows
      sum = 0.0_wp
      do i = 0, rule%degree
        sum = sum + rule%series(k:k + rows - 1, i) * values(i)
      end do
      c(k:k + rows - 1) = sum
    end do
  end subroutine find_series

  !> The size of the last terms of a polynomial, a measure of the terms that it lacks. The last term but one counts a little, as
  !> the last one may be zero by symmetry.
  pure real(wp) function last_terms(rule, values) result(size)
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: values(0:rule%degree)   !! at the nodes
    real(wp), parameter :: weight = 0.02_wp         ! of the last but one

    size = abs(dot_product(rule%series(rule%degree, :), values))
    if (rule%degree > 2) size = max(size, weight * abs(dot_product(rule%series(rule%degree - 1, :), values)))
  end function last_terms

  !> Whether bounds show that there is no maximum, or minimum, between the ends, or one.
  pure subroutine count_turns(n, slopes, bends, has_none, has_one)
    integer, intent(in) :: n
    real(wp), intent(in) :: slopes(0:n), bends(0:n)       !! coefficients of the derivatives
    logical, intent(out) :: has_none(2), has_one(2)       !! of maxima, of minima
    real(wp) :: end_slopes(2), change, difference
    integer :: k

    change = 0.0_wp
    difference = 0.0_wp
    end_slopes = slopes(0)
    do k = 1, n
      change = change + abs(slopes(k))
      difference = difference + abs(bends(k))
      end_slopes(1) = slopes(k) - end_slopes(1)
      end_slopes(2) = slopes(k) + end_slopes(2)
    end do
    if (modulo(n, 2) == 1) end_slopes(1) = -end_slopes(1)
    has_one = [-bends(0), bends(0)] > difference
    has_none = abs(slopes(0)) >= change .or. [bends(0), -bends(0)] >= difference
    if (has_one(1)) has_none(1) = has_none(1) .or. end_slopes(1) <= 0 .or. end_slopes(2) >= 0
    if (has_one(2)) has_none(2) = has_none(2) .or. end_slopes(1) >= 0 .or. end_slopes(2) <= 0
  end subroutine count_turns

  !> The single root of the slope of a concave polynomial, by Newton's method, with bisection as safeguard. It starts from a
  !> parabola through the largest value and those next to it.
  pure subroutine find_turn(rule, values, slopes, bends, x)
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: values(0:rule%degree)   !! at the nodes
    real(wp), intent(in) :: slopes(0:rule%degree), bends(0:rule%degree)   !! coefficients of the derivatives
    real(wp), intent(out) :: x
    real(wp) :: above, below, change, slope
    integer :: i, step

    i = max(1, min(rule%degree - 1, maxloc(values, dim=1) - 1))
    below = rule%nodes(i - 1)
    above = rule%nodes(i + 1)
    change = values(i - 1) - 2 * values(i) + values(i + 1)
    x = rule%nodes(i)
    if (change < 0) x = max(below, min(above, x + 0.25_wp * (values(i - 1) - values(i + 1)) / change * (above - below)))
    do step = 1, max_newton_steps
      slope = value(rule%degree - 1, slopes, x)
      if (slope > 0) then
        below = x
      else
        above = x
      end if
      change = -slope / value(rule%degree - 2, bends, x)
      x = x + change
      if (abs(change) <= last_change) exit
      if (x <= below .or. x >= above) x = 0.5_wp * (below + above)
    end do
  end subroutine find_turn

  !> The coefficients of the derivative: d_(k-1) = d_(k+1) + 2 k c_k, with d_0 halved.
  pure subroutine differentiate(n, c, d)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n)
    real(wp), intent(out) :: d(0:max_degree)
    real(wp) :: after, factor, last
    integer :: k

    d(n) = 0.0_wp
    after = 0.0_wp
    last = 0.0_wp
    factor = 2 * n
    do k = n, 1, -1
      d(k - 1) = after + factor * c(k)
      after = last
      last = d(k - 1)
      factor = factor - 2
    end do
    d(0) = 0.5_wp * d(0)
  end subroutine differentiate

  !> The value at x, by Clenshaw's recurrence.
  pure real(wp) function value(n, c, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n), x
    real(wp) :: last, last_but_one, next
    integer :: k

    last = 0.0_wp
    last_but_one = 0.0_wp
    do k = n, 1, -1
      next = 2 * x * last + (c(k) - last_but_one)
      last_but_one = last
      last = next
    end do
    value = c(0) + x * last - last_but_one
  end function value

  !> The time at a position, t_end for 1 exactly.
  pure real(wp) function time_at(position, t_start, t_end)
    real(wp), intent(in) :: position         !! -1 to 1
    real(wp), intent(in) :: t_start, t_end   !! times of -1 and 1, any unit

    time_at = t_start + 0.5_wp * (1 + position) * (t_end - t_start)
    if (position >= 1) time_at = t_end
  end function time_at

end module nocdyn_chebyshev
