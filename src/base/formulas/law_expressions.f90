!> Formulas of the law of an element: `moment = -stiffness * (angle - rest)` with values of type `expression_t` adds the
!> operations of the right side to the list of the law.
module nocdyn_law_expressions
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: at_element, at_phase, law_node_t, law_tape_t, op_add, op_angle, op_fixed, op_literal, op_multiply, &
    op_parameter, op_pick, op_reciprocal, op_scale, op_segment, op_shift, op_sine, op_speed, op_state, op_subtract, op_time, &
    op_wave
  implicit none (type, external)
  private

  public :: operator(+), operator(-), operator(*), operator(/), operator(**)
  public :: angle_of, speed_of, phase_of, phase_speed_of, time_of, state_of, parameter_of, pick, segment_part, literal, node_of
  public :: apply, add_list

  !> A number of each element and lane. It points to the list of the law, which has to stay where it is while formulas are
  !> written.
  type, public :: expression_t
    type(law_tape_t), pointer :: tape => null()
    integer :: node = 0   !! of the list
  end type expression_t

  interface operator(+)
    procedure :: sum_of, sum_with_number, number_plus
  end interface operator(+)
  interface operator(-)
    procedure :: difference_of, difference_with_number, number_minus, negative_of
  end interface operator(-)
  interface operator(*)
    procedure :: product_of, number_times
  end interface operator(*)
  interface operator(/)
    procedure :: quotient_of, number_over
  end interface operator(/)
  interface operator(**)
    procedure :: power_of
  end interface operator(**)
contains

  !> Adds an operation to the list of the law.
  function apply(tape, operation, a, b) result(value)
    type(law_tape_t), pointer, intent(in) :: tape
    integer, intent(in) :: operation
    integer, intent(in), optional :: a, b   !! as in `law_node_t`
    type(expression_t) :: value
    type(law_node_t) :: node

    node%operation = operation
    if (present(a)) node%a = a
    if (present(b)) node%b = b
    value%tape => tape
    call tape%append(node, value%node)
  end function apply

  pure logical function is_constant(x)
    type(expression_t), intent(in) :: x

    is_constant = x%tape%node(x%node)%is_constant
  end function is_constant

  !> The number of the node that holds an expression, a variable.
  integer function node_of(x)
    type(expression_t), intent(in) :: x
    type(expression_t) :: variable

    variable = x
    if (is_constant(x)) variable = apply(x%tape, op_fixed, x%node)
    node_of = variable%node
  end function node_of

  !> The relative angle u of the element [rad].
  function angle_of(tape) result(angle)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: angle

    angle = apply(tape, op_angle, at_element)
  end function angle_of

  !> The relative speed u' of the element [rad/s].
  function speed_of(tape) result(speed)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: speed

    speed = apply(tape, op_speed, at_element)
  end function speed_of

  !> The angle of the phase of the element [rad].
  function phase_of(tape) result(angle)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: angle

    angle = apply(tape, op_angle, at_phase)
  end function phase_of

  !> The speed of the phase of the element [rad/s].
  function phase_speed_of(tape) result(speed)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: speed

    speed = apply(tape, op_speed, at_phase)
  end function phase_speed_of

  !> The time [s].
  function time_of(tape) result(time)
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: time

    time = apply(tape, op_time)
  end function time_of

  !> Internal state number `index` of the element.
  function state_of(tape, index) result(state)
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: index
    type(expression_t) :: state

    state = apply(tape, op_state, index)
  end function state_of

  !> Parameter number `index` of the bank, from one of its columns for each element, 0 for the value zero.
  function parameter_of(tape, index, columns) result(parameter)
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: index
    integer, intent(in) :: columns(:)   !! [elements]
    type(expression_t) :: parameter
    type(law_node_t) :: node

    node%operation = op_parameter
    node%a = index
    call add_list(tape, columns, node)
    parameter%tape => tape
    call tape%append(node, parameter%node)
  end function parameter_of

  !> A number that all elements share.
  function literal(tape, value) result(number)
    type(law_tape_t), target, intent(inout) :: tape
    real(wp), intent(in) :: value   !! in any unit
    type(expression_t) :: number
    type(law_node_t) :: node

    node%operation = op_literal
    node%value = value
    number%tape => tape
    call tape%append(node, number%node)
  end function literal

  !> The constant of the present branch, 1 to the number of choices, of a switch of the element.
  function pick(switch, choices) result(picked)
    integer, intent(in) :: switch                  !! of each element, 1 for its first one
    type(expression_t), intent(in) :: choices(:)   !! constants, by branch
    type(expression_t) :: picked
    type(law_node_t) :: node
    integer :: i

    node%operation = op_pick
    node%a = switch
    picked%tape => choices(1)%tape
    call add_list(picked%tape, [(choices(i)%node, i=1, size(choices))], node)
    call picked%tape%append(node, picked%node)
  end function pick

  !> A number of the present segment of the curve of the element.
  function segment_part(tape, part) result(number)
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: part   !! as in `segment_numbers` of `curve_t`
    type(expression_t) :: number

    number = apply(tape, op_segment, part)
  end function segment_part

  !> Adds a part to `list` for a node.
  subroutine add_list(tape, numbers, node)
    type(law_tape_t), intent(inout) :: tape
    integer, intent(in) :: numbers(:)
    type(law_node_t), intent(inout) :: node

    node%first = size(tape%list) + 1
    tape%list = [tape%list, numbers]
    node%last = size(tape%list)
  end subroutine add_list

  function sum_of(x, y) result(sum)
    type(expression_t), intent(in) :: x, y
    type(expression_t) :: sum

    if (is_constant(x) .and. .not. is_constant(y)) then
      sum = apply(x%tape, op_shift, y%node, x%node)
    else if (is_constant(y) .and. .not. is_constant(x)) then
      sum = apply(x%tape, op_shift, x%node, y%node)
    else
      sum = apply(x%tape, op_add, x%node, y%node)
    end if
  end function sum_of

  function sum_with_number(x, y) result(sum)
    type(expression_t), intent(in) :: x
    real(wp), intent(in) :: y   !! in the unit of x
    type(expression_t) :: sum

    sum = sum_of(x, literal(x%tape, y))
  end function sum_with_number

  function number_plus(x, y) result(sum)
    real(wp), intent(in) :: x   !! in the unit of y
    type(expression_t), intent(in) :: y
    type(expression_t) :: sum

    sum = sum_of(literal(y%tape, x), y)
  end function number_plus

  function negative_of(x) result(negative)
    type(expression_t), intent(in) :: x
    type(expression_t) :: negative

    negative = number_times(-1.0_wp, x)
  end function negative_of

  function difference_of(x, y) result(difference)
    type(expression_t), intent(in) :: x, y
    type(expression_t) :: difference

    if (is_constant(x) .neqv. is_constant(y)) then
      difference = sum_of(x, negative_of(y))
    else
      difference = apply(x%tape, op_subtract, x%node, y%node)
    end if
  end function difference_of

  function difference_with_number(x, y) result(difference)
    type(expression_t), intent(in) :: x
    real(wp), intent(in) :: y   !! in the unit of x
    type(expression_t) :: difference

    difference = sum_of(x, literal(x%tape, -y))
  end function difference_with_number

  function number_minus(x, y) result(difference)
    real(wp), intent(in) :: x   !! in the unit of y
    type(expression_t), intent(in) :: y
    type(expression_t) :: difference

    difference = difference_of(literal(y%tape, x), y)
  end function number_minus

  function product_of(x, y) result(product)
    type(expression_t), intent(in) :: x, y
    type(expression_t) :: product

    if (is_constant(x) .and. .not. is_constant(y)) then
      product = scaled(y, x)
    else if (is_constant(y) .and. .not. is_constant(x)) then
      product = scaled(x, y)
    else
      product = apply(x%tape, op_multiply, x%node, y%node)
    end if
  end function product_of

  !> x c with a constant c.
  function scaled(x, c) result(product)
    type(expression_t), intent(in) :: x, c
    type(expression_t) :: product
    type(law_node_t) :: node

    node = x%tape%node(x%node)
    if (node%operation == op_sine) then
      if (x%tape%node(node%a)%degree == 1) then
        product = apply(x%tape, op_wave, node%a, c%node)
        return
      end if
    end if
    product = apply(x%tape, op_scale, x%node, c%node)
  end function scaled

  function number_times(x, y) result(product)
    real(wp), intent(in) :: x
    type(expression_t), intent(in) :: y
    type(expression_t) :: product

    product = product_of(literal(y%tape, x), y)
  end function number_times

  function quotient_of(x, y) result(quotient)
    type(expression_t), intent(in) :: x, y   !! y is not zero
    type(expression_t) :: quotient

    quotient = product_of(x, apply(x%tape, op_reciprocal, y%node))
  end function quotient_of

  function number_over(x, y) result(quotient)
    real(wp), intent(in) :: x
    type(expression_t), intent(in) :: y   !! not zero
    type(expression_t) :: quotient

    quotient = number_times(x, apply(y%tape, op_reciprocal, y%node))
  end function number_over

  !> x^n by products; for n < 0, the reciprocal of x^(-n).
  function power_of(x, n) result(power)
    type(expression_t), intent(in) :: x   !! not zero if n < 0
    integer, intent(in) :: n
    type(expression_t) :: power
    integer :: i

    power = x
    if (n == 0) power = literal(x%tape, 1.0_wp)
    do i = 2, abs(n)
      power = product_of(power, x)
    end do
    if (n < 0) power = apply(x%tape, op_reciprocal, power%node)
  end function power_of

end module nocdyn_law_expressions
