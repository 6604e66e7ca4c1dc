!> A linear function x of the state in the last steps of a strip of lanes: a polynomial in each, in vector loops over the lanes.
module nocdyn_step_strips
  use nocdyn_chebyshev, only: max_degree
  use nocdyn_kinds, only: wp
  use nocdyn_column_statistics, only: width
  use nocdyn_observer, only: step_block_t
  implicit none (type, external)
  private

  public :: fill_chord_gaps, fill_hull, expand, expand_single, bound_excursions, exclude_monotonic, exclude_by_hull, find_part
  public :: values_at, add_integrals

  !> The last steps of the lanes of a strip, and x in them.
  type, public :: strip_t
    integer :: lanes = 0
    integer :: before = 0                             !! number of lanes in the strips before
    logical :: is_complete = .false.                  !! whether it has `width` lanes, and all have taken a step
    real(wp), dimension(width) :: t_end = 0.0_wp
    real(wp), dimension(width) :: scale = 0.0_wp      !! 0 in lanes that have not taken a step: x is constant there
    real(wp), dimension(width) :: x_start = 0.0_wp, x_end = 0.0_wp
    real(wp) :: c(width, max_degree) = 0.0_wp         !! x = x_start + sum of c_p (scale s)^p, s from 0 to 1
    real(wp), dimension(width) :: above = 0.0_wp, below = 0.0_wp   !! bounds of how far x leaves the range of its ends
  end type strip_t

contains

  !> The largest values of s - s^p for s from 0 to 1.
  pure subroutine fill_chord_gaps(chord_gap)
    real(wp), intent(out) :: chord_gap(:)   !! for p = 1, 2, ...
    integer :: p

    chord_gap(1) = 0.0_wp
    do p = 2, size(chord_gap)
      chord_gap(p) = (1.0_wp / p)**(1.0_wp / (p - 1)) * (1.0_wp - 1.0_wp / p)
    end do
  end subroutine fill_chord_gaps

  !> The weights of powers in the control points of Bernstein's form: s^p is the sum of hull(j, p) B_j(s), with hull(0, p) = 0.
  pure subroutine fill_hull(hull)
    real(wp), intent(out) :: hull(:, :)   !! [j, p], both up to the degree
    real(wp) :: weight
    integer :: j, p

    do j = 1, size(hull, 1)
      weight = 1.0_wp
      do p = 1, size(hull, 2)
        weight = weight * max(0, j - p + 1) / (size(hull, 1) - p + 1)
        hull(j, p) = weight
      end do
    end do
  end subroutine fill_hull

  !> Computes x = offset + sum of factor * y at the ends of the steps, and its coefficients, in the lanes from `at` on.
  pure subroutine expand(lanes, states, degree, at, chord_gap, entries, component, factor, offset, y, y_new, c, strip)
    integer, intent(in) :: lanes, states, degree, at
    real(wp), intent(in) :: chord_gap(degree)
    integer, intent(in) :: entries   !! even
    integer, intent(in) :: component(entries)
    real(wp), intent(in) :: factor(width, entries), offset(width)
    real(wp), intent(in) :: y(lanes, states), y_new(lanes, states), c(lanes, states, degree)
    type(strip_t), intent(inout) :: strip
    integer :: k

    strip%x_start = offset
    strip%x_end = offset
    do k = 1, entries
      strip%x_start = strip%x_start + factor(:, k) * y(at:at + width - 1, component(k))
      strip%x_end = strip%x_end + factor(:, k) * y_new(at:at + width - 1, component(k))
    end do
    call set_pair(lanes, states, degree, at, component(1), component(2), factor(:, 1), factor(:, 2), c, strip%c)
    do k = 3, entries, 2
      call add_pair(lanes, states, degree, at, component(k), component(k + 1), factor(:, k), factor(:, k + 1), c, strip%c)
    end do
    call bound_excursions(degree, chord_gap, strip%scale, strip%c, strip%above, strip%below)
  end subroutine expand

  !> `expand`, in the same bits, without the bounds and for a column of a block of one lane. The strip has a column in each place.
  pure subroutine expand_single(states, degree, entries, component, factor, offset, y, y_new, c, place, strip)
    integer, intent(in) :: states, degree
    integer, intent(in) :: entries   !! even
    integer, intent(in) :: component(entries)
    real(wp), intent(in) :: factor(width, entries), offset   !! the ones of the first lane
    real(wp), intent(in) :: y(states), y_new(states), c(states, degree)
    integer, intent(in) :: place
    type(strip_t), intent(inout) :: strip
    real(wp) :: x(max_degree)
    integer :: k

    strip%x_start(place) = offset
    strip%x_end(place) = offset
    do k = 1, entries
      strip%x_start(place) = strip%x_start(place) + factor(1, k) * y(component(k))
      strip%x_end(place) = strip%x_end(place) + factor(1, k) * y_new(component(k))
    end do
    x(:degree) = factor(1, 1) * c(component(1), :) + factor(1, 2) * c(component(2), :)
    do k = 3, entries, 2
      x(:degree) = x(:degree) + (factor(1, k) * c(component(k), :) + factor(1, k + 1) * c(component(k + 1), :))
    end do
    strip%c(place, :degree) = x(:degree)
  end subroutine expand_single

  pure subroutine set_pair(lanes, states, degree, at, j, k, factor_j, factor_k, c, x)
    integer, intent(in) :: lanes, states, degree, at, j, k
    real(wp), intent(in) :: factor_j(width), factor_k(width), c(lanes, states, degree)
    real(wp), intent(inout) :: x(width, degree)
    integer :: p

    do p = 1, degree
      x(:, p) = factor_j * c(at:at + width - 1, j, p) + factor_k * c(at:at + width - 1, k, p)
    end do
  end subroutine set_pair

  pure subroutine add_pair(lanes, states, degree, at, j, k, factor_j, factor_k, c, x)
    integer, intent(in) :: lanes, states, degree, at, j, k
    real(wp), intent(in) :: factor_j(width), factor_k(width), c(lanes, states, degree)
    real(wp), intent(inout) :: x(width, degree)
    integer :: p

    do p = 1, degree
      x(:, p) = x(:, p) + (factor_j * c(at:at + width - 1, j, p) + factor_k * c(at:at + width - 1, k, p))
    end do
  end subroutine add_pair

  !> Bounds how far x leaves the range of its ends: x(s) = (1 - s) x(0) + s x(1) - sum of c_p scale^p (s - s^p).
  pure subroutine bound_excursions(degree, chord_gap, scale, c, above, below)
    integer, intent(in) :: degree
    real(wp), intent(in) :: chord_gap(degree), scale(width), c(width, degree)
    real(wp), intent(out) :: above(width), below(width)
    real(wp) :: sizes(width), sum(width), term
    integer :: i, p

    sum = 0.0_wp
    sizes = 0.0_wp
    do p = degree, 2, -1
      !GCC$ unroll 1
      do i = 1, width
        term = chord_gap(p) * c(i, p)
        sum(i) = term + scale(i) * sum(i)
        sizes(i) = abs(term) + scale(i) * sizes(i)
      end do
    end do
    !GCC$ unroll 1
    do i = 1, width
      above(i) = 0.5_wp * (scale(i) * scale(i)) * (sizes(i) - sum(i))
      below(i) = 0.5_wp * (scale(i) * scale(i)) * (sizes(i) + sum(i))
    end do
  end subroutine bound_excursions

  !> Excludes the steps in which x is monotonic, because its extremes are at their ends:
  !> x' = (1 - s) x'(0) + s x'(1) - sum of p c_p scale^p (s - s^(p-1)).
  pure subroutine exclude_monotonic(degree, chord_gap, scale, c, rise, fall)
    integer, intent(in) :: degree
    real(wp), intent(in) :: chord_gap(degree), scale(width), c(width, degree)
    real(wp), intent(inout) :: rise(width), fall(width)
    real(wp) :: excursions(width), end_slope(width), factor, least, most, sum(width), term
    integer :: i, p

    end_slope = 0.0_wp
    sum = 0.0_wp
    excursions = 0.0_wp
    do p = degree, 2, -1
      factor = real(p, wp)
      !GCC$ unroll 1
      do i = 1, width
        term = factor * c(i, p)
        end_slope(i) = (term + end_slope(i)) * scale(i)
        sum(i) = (chord_gap(p - 1) * term + sum(i)) * scale(i)
        excursions(i) = (chord_gap(p - 1) * abs(term) + excursions(i)) * scale(i)
      end do
    end do
    !GCC$ unroll 1
    do i = 1, width
      end_slope(i) = c(i, 1) + end_slope(i)
      least = min(c(i, 1), end_slope(i)) - 0.5_wp * (excursions(i) + sum(i))
      most = max(c(i, 1), end_slope(i)) + 0.5_wp * (excursions(i) - sum(i))
      rise(i) = merge(rise(i), -1.0_wp, least * most <= 0)
      fall(i) = merge(fall(i), -1.0_wp, least * most <= 0)
    end do
  end subroutine exclude_monotonic

  !> Excludes the steps in which the control points between the ends are inside the range so far: x is in their convex hull.
  pure subroutine exclude_by_hull(degree, hull, scale, x_start, c, highest, lowest, rise, fall)
    integer, intent(in) :: degree
    real(wp), intent(in) :: hull(degree, degree)
    real(wp), intent(in), dimension(width) :: scale, x_start, highest, lowest
    real(wp), intent(in) :: c(width, degree)
    real(wp), intent(inout) :: rise(width), fall(width)
    real(wp), parameter :: rounding = 1.0e-14_wp
    real(wp), dimension(width) :: most, least, point, power, size
    real(wp) :: term(width, max_degree)
    integer :: j, p

    power = 1.0_wp
    size = abs(x_start)
    do p = 1, degree
      power = power * scale
      term(:, p) = power * c(:, p)
      size = size + abs(term(:, p))
    end do
    most = -huge(most)
    least = huge(least)
    do j = 1, degree - 1
      point = x_start
      do p = 1, j
        point = point + hull(j, p) * term(:, p)
      end do
      most = max(most, point)
      least = min(least, point)
    end do
    where (most + rounding * size <= highest) rise = -1.0_wp
    where (least - rounding * size >= lowest) fall = -1.0_wp
  end subroutine exclude_by_hull

  !> The part of a step after `from` and before its end: scale s at its ends, and when it starts [s].
  pure subroutine find_part(lane, from, steps, begin, end, t_start)
    integer, intent(in) :: lane
    real(wp), intent(in) :: from     !! [s]
    type(step_block_t), intent(in) :: steps
    real(wp), intent(out) :: begin, end, t_start

    t_start = max(steps%t(lane), from)
    begin = steps%scale(lane) * ((t_start - steps%t(lane)) / steps%h(lane))
    end = steps%scale(lane) * steps%theta_end(lane)
  end subroutine find_part

  !> x of one lane at the nodes of the part of its step between two values of scale s.
  pure subroutine values_at(strip, i, degree, nodes, begin, end, values)
    type(strip_t), intent(in) :: strip
    integer, intent(in) :: i
    integer, intent(in) :: degree
    real(wp), intent(in) :: nodes(degree + 1)   !! -1 to 1
    real(wp), intent(in) :: begin, end
    real(wp), intent(out) :: values(degree + 1)
    real(wp) :: s(max_degree + 1)
    integer :: p

    s(:degree + 1) = begin + (0.5_wp * (end - begin)) * (1 + nodes)
    values = strip%c(i, degree)
    do p = degree - 1, 1, -1
      values = strip%c(i, p) + s(:degree + 1) * values
    end do
    values = strip%x_start(i) + s(:degree + 1) * values
  end subroutine values_at

  !> Adds the integrals of a column and of its square over parts of the steps, by a Gauss rule with as many nodes as x has
  !> coefficients: it is exact for x and for its square.
  pure subroutine add_integrals(strip, degree, nodes, weights, begin, end, duration, linear, cubic, integral, square)
    type(strip_t), intent(in) :: strip
    integer, intent(in) :: degree
    real(wp), intent(in) :: nodes(degree + 1), weights(degree + 1)   !! -1 to 1
    real(wp), intent(in) :: begin(width), end(width)                 !! of the parts: scale s
    real(wp), intent(in) :: duration(width)                          !! of the parts [s]
    real(wp), intent(in) :: linear(width), cubic(width)
    real(wp), intent(inout) :: integral(width), square(width)
    real(wp) :: s(width), x(width)
    integer :: node, p

    do node = 1, degree + 1
      s = begin + (0.5_wp * (1 + nodes(node))) * (end - begin)
      x = strip%c(:, degree)
      do p = degree - 1, 1, -1
        x = strip%c(:, p) + s * x
      end do
      x = strip%x_start + s * x
      x = (linear + cubic * x * x) * x
      integral = integral + duration * weights(node) * x
      square = square + duration * weights(node) * (x * x)
    end do
  end subroutine add_integrals

end module nocdyn_step_strips
