!> Functions in the formulas of laws.
module nocdyn_law_functions
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: add_list, apply, expression_t, node_of, operator(*), operator(+)
  use nocdyn_law_tape, only: law_node_t, op_arctangent, op_cosine, op_exponential, op_harmonics, op_larger, op_log_cosh, &
    op_logarithm, op_sech_squared, op_sine, op_size, op_square_root, op_tanh
  implicit none (type, external)
  private

  public :: sin, cos, tanh, exp, log, sqrt, atan, log_cosh, larger, size_of, polynomial, harmonics, add_guard

  interface sin
    procedure :: sine_of
  end interface sin
  interface cos
    procedure :: cosine_of
  end interface cos
  interface tanh
    procedure :: tanh_of
  end interface tanh
  interface exp
    procedure :: exponential_of
  end interface exp
  interface log
    procedure :: logarithm_of
  end interface log
  interface sqrt
    procedure :: root_of
  end interface sqrt
  interface atan
    procedure :: arctangent_of
  end interface atan

contains

  function sine_of(x) result(sine)
    type(expression_t), intent(in) :: x
    type(expression_t) :: cosine, sine

    sine = apply(x%tape, op_sine, x%node)
    cosine = apply(x%tape, op_cosine, x%node)
  end function sine_of

  function cosine_of(x) result(cosine)
    type(expression_t), intent(in) :: x
    type(expression_t) :: cosine, sine

    sine = apply(x%tape, op_sine, x%node)
    cosine = apply(x%tape, op_cosine, x%node)
  end function cosine_of

  function tanh_of(x) result(value)
    type(expression_t), intent(in) :: x
    type(expression_t) :: rest, value

    value = apply(x%tape, op_tanh, x%node)
    rest = apply(x%tape, op_sech_squared, x%node)
  end function tanh_of

  function exponential_of(x) result(exponential)
    type(expression_t), intent(in) :: x
    type(expression_t) :: exponential

    exponential = apply(x%tape, op_exponential, x%node)
  end function exponential_of

  !> Natural logarithm.
  function logarithm_of(x) result(logarithm)
    type(expression_t), intent(in) :: x   !! positive
    type(expression_t) :: logarithm

    logarithm = apply(x%tape, op_logarithm, x%node)
  end function logarithm_of

  function root_of(x) result(root)
    type(expression_t), intent(in) :: x   !! positive
    type(expression_t) :: root

    root = apply(x%tape, op_square_root, x%node)
  end function root_of

  !> The angle between -pi/2 and pi/2 whose tangent is x.
  function arctangent_of(x) result(arctangent)
    type(expression_t), intent(in) :: x
    type(expression_t) :: arctangent, by_derivative

    by_derivative = 1.0_wp + x * x
    arctangent = apply(x%tape, op_arctangent, x%node, by_derivative%node)
  end function arctangent_of

  !> ln cosh x, whose derivative is tanh x.
  function log_cosh(x) result(value)
    type(expression_t), intent(in) :: x
    type(expression_t) :: derivative, value

    derivative = tanh_of(x)
    value = apply(x%tape, op_log_cosh, x%node, derivative%node)
  end function log_cosh

  !> The larger of two; it has no series, and is for guards alone.
  function larger(x, y) result(value)
    type(expression_t), intent(in) :: x, y
    type(expression_t) :: value

    value = apply(x%tape, op_larger, node_of(x), node_of(y))
  end function larger

  !> |c| of a constant c.
  function size_of(c) result(value)
    type(expression_t), intent(in) :: c
    type(expression_t) :: value

    value = apply(c%tape, op_size, c%node)
  end function size_of

  !> Adds a function that is positive inside a branch of a switch. The boundary where it is zero is shifted outwards.
  subroutine add_guard(switch, branch, value, shift)
    integer, intent(in) :: switch   !! of the element
    integer, intent(in) :: branch   !! of the switch, 0 for all
    type(expression_t), intent(in) :: value
    type(expression_t), intent(in) :: shift   !! a constant, in the unit of the value
    integer :: node

    node = node_of(value)
    associate (tape => value%tape)
      tape%guard = [tape%guard, node]
      tape%guarded_switch = [tape%guarded_switch, switch]
      tape%guarded_branch = [tape%guarded_branch, branch]
      tape%guard_shift = [tape%guard_shift, shift%node]
    end associate
  end subroutine add_guard

  !> Coefficients(1) x + coefficients(2) x^2 + ...
  function polynomial(coefficients, x) result(value)
    type(expression_t), intent(in) :: coefficients(:), x
    type(expression_t) :: value
    integer :: k

    value = coefficients(size(coefficients)) * x
    do k = size(coefficients) - 1, 1, -1
      value = (coefficients(k) + value) * x
    end do
  end function polynomial

  !> The sum of a(k) sin(n(k) x) + b(k) cos(n(k) x).
  function harmonics(n, a, b, x) result(value)
    integer, intent(in) :: n(:)              !! ascending whole numbers, positive
    type(expression_t), intent(in) :: a(:), b(:)   !! constants
    type(expression_t), intent(in) :: x
    type(expression_t) :: value
    type(law_node_t) :: node
    integer :: i

    node%operation = op_harmonics
    node%a = x%node
    call add_list(x%tape, [n, (a(i)%node, i=1, size(a)), (b(i)%node, i=1, size(b))], node)
    value%tape => x%tape
    call x%tape%append(node, value%node)
  end function harmonics

end module nocdyn_law_functions
