!> Laws with a tabulated part: a moment over the twist, over the speed or over the time.
module nocdyn_tables
  use nocdyn_bank, only: bank_t
  use nocdyn_curves, only: curve_t, segment_area, segment_begin, segment_cubic, segment_end, segment_half_curvature, &
    segment_origin, segment_size, segment_slope, segment_value
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), segment_part
  use nocdyn_law_functions, only: add_guard
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: add_table, curve_value, curve_integral, guard_segment

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
    type(expression_t) :: d, value

    d = x - segment_part(tape, segment_origin)
    value = segment_part(tape, segment_value) + d * (segment_part(tape, segment_slope) &
            + d * (segment_part(tape, segment_half_curvature) + segment_part(tape, segment_cubic) * d))
  end function curve_value

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

  !> The ends of the segment are the boundaries of the branch. Those of a time are not shifted: it does not go back.
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
