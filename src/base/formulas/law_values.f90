!> The list of a law carried out number by number, for the values of one element in one lane. They have the bits that the walk
!> over groups gives (`nocdyn_law_walk`), which takes longer if a bank has few elements.
module nocdyn_law_values
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: law_tape_t, op_add, op_arctangent, op_cosine, op_exponential, op_fixed, op_harmonics, op_is_zero, &
    op_larger, op_log_cosh, op_logarithm, op_multiply, op_power, op_reciprocal, op_scale, op_sech_squared, op_shift, op_sine, &
    op_size, op_square_root, op_subtract, op_tanh, op_wave
  use nocdyn_vector_functions, only: cosine_of, exp_of, log_cosh_of, sine_of, tanh_of
  implicit none (type, external)
  private

  public :: new_law_program, value_of

  !> The operations that give some nodes.
  type, public :: law_program_t
    integer :: steps = 0
    integer, allocatable :: node(:), operation(:), a(:), b(:)   !! as in `law_node_t`, [steps]
  contains
    procedure :: compute, has_harmonics
  end type law_program_t

contains

  !> The operations that give the values of some nodes.
  pure function new_law_program(tape, results) result(self)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: results(:)   !! nodes, or 0
    type(law_program_t) :: self
    integer :: i

    associate (nodes => tape%needed(results, .false.))
      allocate (self%node, source=pack(nodes, [(tape%node(nodes(i))%operation >= op_fixed, i=1, size(nodes))]))
    end associate
    self%steps = size(self%node)
    allocate (self%operation(self%steps), self%a(self%steps), self%b(self%steps))
    do i = 1, self%steps
      associate (node => tape%node(self%node(i)))
        self%operation(i) = node%operation
        self%a(i) = node%a
        self%b(i) = node%b
        if (node%operation == op_sech_squared) self%a(i) = self%node(i) - 1
      end associate
    end do
  end function new_law_program

  !> Whether there are sums that are not carried out number by number.
  pure logical function has_harmonics(self)
    class(law_program_t), intent(in) :: self

    has_harmonics = any(self%operation == op_harmonics)
  end function has_harmonics

  !> Computes the values from the inputs and constants.
  pure subroutine compute(self, last, x)
    class(law_program_t), intent(in) :: self
    integer, intent(in) :: last               !! node
    real(wp), intent(inout) :: x(0:last)      !! of all nodes, in units of the law
    integer :: i

    do i = 1, self%steps
      x(self%node(i)) = value_of(self%operation(i), x(self%a(i)), x(self%b(i)))
    end do
  end subroutine compute

  !> The value of an operation.
  pure real(wp) function value_of(operation, x, y) result(value)
    integer, intent(in) :: operation
    real(wp), intent(in) :: x, y   !! operands; of `sech_squared`, the hyperbolic tangent

    select case (operation)
    case (op_fixed)
      value = x
    case (op_add, op_shift)
      value = x + y
    case (op_subtract)
      value = x - y
    case (op_multiply, op_scale)
      value = x * y
    case (op_reciprocal)
      value = 1.0_wp / x
    case (op_wave)
      value = y * sine_of(x)
    case (op_sine)
      value = sine_of(x)
    case (op_cosine)
      value = cosine_of(x)
    case (op_tanh)
      value = tanh_of(x)
    case (op_sech_squared)
      value = 1.0_wp - x * x
    case (op_exponential)
      value = exp_of(x)
    case (op_square_root)
      value = sqrt(x)
    case (op_log_cosh)
      value = log_cosh_of(x)
    case (op_logarithm)
      value = log(x)
    case (op_power)
      value = x**y
    case (op_arctangent)
      value = atan(x)
    case (op_larger)
      value = max(x, y)
    case (op_size)
      value = abs(x)
    case (op_is_zero)
      value = merge(0.0_wp, 1.0_wp, abs(x) > 0)
    case default
      value = 0.0_wp
      error stop 'nocdyn_law_values: no such operation'
    end select
  end function value_of

end module nocdyn_law_values
