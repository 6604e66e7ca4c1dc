!> Operators of formulas as they are written in Fortran: with numbers on either side, whole numbers, and any powers.
!>
!> They extend the operators of `nocdyn_law_expressions`. A quotient x / c is x times 1 / c.
module nocdyn_law_operators
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: apply, expression_t, literal, operator(*), operator(**), operator(+), operator(-), operator(/)
  use nocdyn_law_tape, only: op_power
  implicit none (type, external)
  private

  public :: operator(+), operator(-), operator(*), operator(/), operator(**), constant

  interface operator(+)
    procedure :: itself, sum_with_integer, integer_plus
  end interface operator(+)
  interface operator(-)
    procedure :: difference_with_integer, integer_minus
  end interface operator(-)
  interface operator(*)
    procedure :: times_number, times_integer, integer_times
  end interface operator(*)
  interface operator(/)
    procedure :: over_number, over_integer, integer_over
  end interface operator(/)
  interface operator(**)
    procedure :: power_with_number
  end interface operator(**)

contains

  !> A number as an expression among those to which `like` belongs, for instance a rate that is constant.
  function constant(like, value) result(number)
    type(expression_t), intent(in) :: like
    real(wp), intent(in) :: value   !! in any unit
    type(expression_t) :: number

    number = literal(like%tape, value)
  end function constant

  function itself(x) result(same)
    type(expression_t), intent(in) :: x
    type(expression_t) :: same

    same = x
  end function itself

  function sum_with_integer(x, y) result(sum)
    type(expression_t), intent(in) :: x
    integer, intent(in) :: y
    type(expression_t) :: sum

    sum = x + real(y, wp)
  end function sum_with_integer

  function integer_plus(x, y) result(sum)
    integer, intent(in) :: x
    type(expression_t), intent(in) :: y
    type(expression_t) :: sum

    sum = real(x, wp) + y
  end function integer_plus

  function difference_with_integer(x, y) result(difference)
    type(expression_t), intent(in) :: x
    integer, intent(in) :: y
    type(expression_t) :: difference

    difference = x - real(y, wp)
  end function difference_with_integer

  function integer_minus(x, y) result(difference)
    integer, intent(in) :: x
    type(expression_t), intent(in) :: y
    type(expression_t) :: difference

    difference = real(x, wp) - y
  end function integer_minus

  function times_number(x, y) result(product)
    type(expression_t), intent(in) :: x
    real(wp), intent(in) :: y
    type(expression_t) :: product

    product = y * x
  end function times_number

  function times_integer(x, y) result(product)
    type(expression_t), intent(in) :: x
    integer, intent(in) :: y
    type(expression_t) :: product

    product = real(y, wp) * x
  end function times_integer

  function integer_times(x, y) result(product)
    integer, intent(in) :: x
    type(expression_t), intent(in) :: y
    type(expression_t) :: product

    product = real(x, wp) * y
  end function integer_times

  function over_number(x, y) result(quotient)
    type(expression_t), intent(in) :: x
    real(wp), intent(in) :: y   !! not zero
    type(expression_t) :: quotient

    quotient = (1 / y) * x
  end function over_number

  function over_integer(x, y) result(quotient)
    type(expression_t), intent(in) :: x
    integer, intent(in) :: y   !! not zero
    type(expression_t) :: quotient

    quotient = (1.0_wp / y) * x
  end function over_integer

  function integer_over(x, y) result(quotient)
    integer, intent(in) :: x
    type(expression_t), intent(in) :: y   !! not zero
    type(expression_t) :: quotient

    quotient = real(x, wp) / y
  end function integer_over

  !> x^y for a positive x.
  function power_with_number(x, y) result(power)
    type(expression_t), intent(in) :: x
    real(wp), intent(in) :: y
    type(expression_t) :: power, exponent

    exponent = literal(x%tape, y)
    power = apply(x%tape, op_power, x%node, exponent%node)
  end function power_with_number

end module nocdyn_law_operators
