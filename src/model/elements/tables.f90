!> Laws with a tabulated part: a moment over the twist, over the speed or over the time.
module nocdyn_tables
  use nocdyn_bank, only: bank_t
  use nocdyn_curves, only: curve_t, segment_area, segment_begin, segment_cubic, segment_end, segment_half_curvature, &
    segment_origin, segment_size, segment_slope, segment_value
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), pick, &
    segment_part
  use nocdyn_law_functions, only: add_guard
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: add_table, curve_value, curve_slope, curve_integral, guard_segment, picked_value, guard_picked_square

contains

  !> Gives every element a curve, and a switch between its segments; after `connect`, before other switches.
  subroutine add_table(bank, curve)
    class(bank_t), intent(inout) :: bank
    type(curve_t), intent(in) :: curve(:, :)   !! [lanes, elements]
    integer :: e

    allocate (bank%curve, source=curve)
    call bank%add_switches([('point in the table', e=1, bank%count)], 0)
  end subroutine add_table

  !> The curve of the element at x, on its present segment.
  function curve_value(tape, x) result(value)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: x
    type(expression_t) :: value

    value = cubic(x - segment_part(tape, segment_origin), segment_part(tape, segment_value), segment_part(tape, segment_slope), &
                  segment_part(tape, segment_half_curvature), segment_part(tape, segment_cubic))
  end function curve_value

  !> The slope of the curve of the element at x, on its present segment.
  function curve_slope(tape, x) result(slope)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: x
    type(expression_t) :: d, slope

    d = x - segment_part(tape, segment_origin)
    slope = segment_part(tape, segment_slope) + d * (2.0_wp * segment_part(tape, segment_half_curvature) + &
                                                     3.0_wp * segment_part(tape, segment_cubic) * d)
  end function curve_slope

  !> value + d (slope + d (half_curvature + d cubic)).
  function cubic(d, value, slope, half_curvature, third)
    type(expression_t), intent(in) :: d, value, slope, half_curvature, third
    type(expression_t) :: cubic

    cubic = value + d * (slope + d * (half_curvature + third * d))
  end function cubic

  !> A curve of all elements at x, whose segments are the branches of a switch. There is none before its first point.
  function picked_value(tape, curve, switch, x) result(value)
    type(law_tape_t), target, intent(inout) :: tape
    type(curve_t), intent(in) :: curve
    integer, intent(in) :: switch   !! of each element
    type(expression_t), intent(in) :: x
    type(expression_t) :: value

    value = cubic(x - part(segment_origin), part(segment_value), part(segment_slope), part(segment_half_curvature), &
                  part(segment_cubic))

  contains

    !> One of the numbers of the present segment.
    type(expression_t) function part(which)
      integer, intent(in) :: which   !! segment_...
      integer :: i

      part = pick(switch, [(literal(tape, curve%segment_number(i, which)), i=1, curve%points())])
    end function part

  end function picked_value

  !> The ends of its segments are the boundaries of the branches, where x is 0 or more: by its square, as guards have no picks.
  subroutine guard_picked_square(tape, curve, switch, square)
    type(law_tape_t), target, intent(inout) :: tape
    type(curve_t), intent(in) :: curve
    integer, intent(in) :: switch                !! of each element
    type(expression_t), intent(in) :: square     !! of x
    real(wp) :: edge
    integer :: k

    do k = 1, curve%points()
      edge = curve%segment_number(k, segment_begin)
      if (k > 1) call add_guard(switch, k, square - literal(tape, edge**2), literal(tape, boundary_width * edge**2))
      edge = curve%segment_number(k, segment_end)
      if (edge < huge(edge)) call add_guard(switch, k, literal(tape, edge**2) - square, literal(tape, boundary_width * edge**2))
    end do
  end subroutine guard_picked_square

  !> Its integral from 0 to x.
  function curve_integral(tape, x) result(integral)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: x
    type(expression_t) :: d, integral

    d = x - segment_part(tape, segment_origin)
    integral = (1.0_wp / 3.0_wp) * segment_part(tape, segment_half_curvature) + 0.25_wp * segment_part(tape, segment_cubic) * d
    integral = segment_part(tape, segment_value) + d * (0.5_wp * segment_part(tape, segment_slope) + d * integral)
    integral = segment_part(tape, segment_area) + d * integral
  end function curve_integral

  !> The ends of the segment are the boundaries of the branch. The ones of a time are not shifted: it does not go back.
  subroutine guard_segment(tape, x, is_time)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: x
    logical, intent(in), optional :: is_time   !! x is not if this is absent
    type(expression_t) :: shift
    logical :: goes_back

    goes_back = .true.
    if (present(is_time)) goes_back = .not. is_time
    tape%argument = node_of(x)
    shift = boundary_width * segment_part(tape, segment_size)
    if (.not. goes_back) shift = literal(tape, 0.0_wp)
    call add_guard(1, 0, segment_part(tape, segment_end) - x, shift)
    if (goes_back) call add_guard(1, 0, x - segment_part(tape, segment_begin), shift)
  end subroutine guard_segment

end module nocdyn_tables
