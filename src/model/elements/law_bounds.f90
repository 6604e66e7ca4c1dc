!> Bounds of the moments of an element inside a step: how fast they change, and how much they bend, while the motion does so.
!>
!> Every variable of the list of a law gets a range, and bounds on its first and second derivative by the share of the step, from
!> the ones of its operands. A step cannot change the branches.
module nocdyn_law_bounds
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: at_element, law_inputs_t, law_tape_t, op_add, op_arctangent, op_cosine, op_exponential, op_fixed, &
    op_harmonics, op_log_cosh, op_logarithm, op_multiply, op_reciprocal, op_scale, op_shift, op_sine, &
    op_square_root, op_subtract, op_tanh, op_wave
  use nocdyn_laws, only: law_t
  implicit none (type, external)
  private

  public :: has_bounds, new_law_bounds, largest

  integer, parameter :: bounded(17) = [op_fixed, op_add, op_subtract, op_multiply, op_shift, op_scale, op_reciprocal, op_wave, &
    op_sine, op_cosine, op_tanh, op_exponential, op_square_root, op_log_cosh, op_harmonics, op_logarithm, op_arctangent]
  real(wp), parameter :: most_exponent = 300.0_wp   ! of numbers that can be squared
  real(wp), parameter :: least_argument = 1.0e-30_wp   ! of a function with a pole, whose third power counts

  !> A variable in a step.
  type, public :: variable_bounds_t
    real(wp) :: low = 0.0_wp, high = 0.0_wp   !! its range
    real(wp) :: slope = 0.0_wp                !! largest size of its derivative by theta
    real(wp) :: bend = 0.0_wp                 !! ... of its second derivative
  end type variable_bounds_t

  type, extends(law_inputs_t), public :: law_bounds_t
    integer :: restoring = 0, applied = 0                    !! nodes, as in `law_tape_t`
    integer, allocatable, private :: nodes(:)                !! that are computed
    type(variable_bounds_t), allocatable, private :: x(:)    !! of all nodes, [0:nodes]
  contains
    procedure :: bound
  end type law_bounds_t

contains

  !> Whether there are bounds for the moments of a law.
  pure logical function has_bounds(tape)
    type(law_tape_t), intent(in) :: tape
    type(law_inputs_t) :: inputs
    integer :: i

    inputs = tape%inputs()
    associate (nodes => tape%needed([tape%restoring, tape%applied], .false.))
      has_bounds = inputs%ports == at_element .and. all([(tape%node(nodes(i))%operation < op_fixed .or. &
                                                          any(tape%node(nodes(i))%operation == bounded), i=1, size(nodes))])
    end associate
  end function has_bounds

  !> Work space for a law that `has_bounds`.
  type(law_bounds_t) function new_law_bounds(tape) result(self)
    type(law_tape_t), intent(in) :: tape
    integer, allocatable :: nodes(:)
    integer :: i

    self%law_inputs_t = tape%inputs()
    self%restoring = tape%restoring
    self%applied = tape%applied
    allocate (nodes, source=tape%needed([tape%restoring, tape%applied], .false.))
    allocate (self%nodes, source=pack(nodes, [(tape%node(nodes(i))%operation >= op_fixed, i=1, size(nodes))]))
    allocate (self%x(0:tape%count))
  end function new_law_bounds

  !> Bounds of the moments of one element from the ones of its inputs.
  pure subroutine bound(self, law, slot, motion, internal, moments, is_bounded)
    class(law_bounds_t), intent(inout) :: self
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot                               !! of the element
    type(variable_bounds_t), intent(in) :: motion(3)          !! time [s], angle [rad], speed [rad/s]
    type(variable_bounds_t), intent(in) :: internal(:)        !! internal states
    type(variable_bounds_t), intent(out) :: moments(2)        !! restoring, applied [N m]
    logical, intent(out) :: is_bounded                        !! else a function is not smooth in the range of its argument
    integer :: i

    self%x(self%time) = motion(1)
    self%x(self%angle) = motion(2)
    self%x(self%speed) = motion(3)
    do i = 1, size(self%state)
      self%x(self%state(i)) = internal(i)
    end do
    self%x(0) = variable_bounds_t()
    is_bounded = .true.
    do i = 1, size(self%nodes)
      call bound_node(law, slot, self%nodes(i), self%x, is_bounded)
      if (.not. is_bounded) exit
    end do
    moments(1) = self%x(self%restoring)
    moments(2) = self%x(self%applied)
  end subroutine bound

  !> Bounds of a node from the ones of its operands.
  pure subroutine bound_node(law, slot, i, x, is_bounded)
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot, i
    type(variable_bounds_t), intent(inout) :: x(0:)   !! of all nodes
    logical, intent(inout) :: is_bounded
    real(wp) :: sizes(0:2)

    associate (node => law%tape%node(i), a => x(law%tape%node(i)%a), b => x(law%tape%node(i)%b))
      select case (node%operation)
      case (op_fixed)
        x(i) = variable_bounds_t(constant(node%a), constant(node%a))
      case (op_add)
        x(i) = variable_bounds_t(a%low + b%low, a%high + b%high, a%slope + b%slope, a%bend + b%bend)
      case (op_subtract)
        x(i) = variable_bounds_t(a%low - b%high, a%high - b%low, a%slope + b%slope, a%bend + b%bend)
      case (op_multiply)
        x(i) = product_of(a, b)
      case (op_shift)
        x(i) = variable_bounds_t(a%low + constant(node%b), a%high + constant(node%b), a%slope, a%bend)
      case (op_scale)
        x(i) = product_of(a, variable_bounds_t(constant(node%b), constant(node%b)))
      case (op_wave)
        x(i) = chained(a, abs(constant(node%b)) * [-1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp])
      case (op_sine, op_cosine)
        x(i) = chained(a, [-1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp])
      case (op_harmonics)
        sizes = sizes_of_harmonics(law, slot, i)
        x(i) = chained(a, [-sizes(0), sizes(0), sizes(1), sizes(2)])
      case default
        call bound_function(node%operation, a, x(i), is_bounded)
      end select
    end associate

  contains

    pure real(wp) function constant(number)
      integer, intent(in) :: number   ! node

      constant = law%constant(slot, law%column(number))
    end function constant

  end subroutine bound_node

  !> Bounds of a monotonic function, or of log cosh: its range, and the sizes of its derivatives there.
  pure subroutine bound_function(operation, a, x, is_bounded)
    integer, intent(in) :: operation
    type(variable_bounds_t), intent(in) :: a
    type(variable_bounds_t), intent(inout) :: x
    logical, intent(inout) :: is_bounded
    real(wp) :: least

    least = min(abs(a%low), abs(a%high))
    select case (operation)
    case (op_tanh)
      if (a%low <= 0 .and. a%high >= 0) least = 0.0_wp
      least = 1.0_wp - tanh(least)**2   ! the largest slope
      x = chained(a, [tanh(a%low), tanh(a%high), least, min(2 * least, 0.77_wp)])
    case (op_log_cosh)
      x = chained(a, [0.0_wp, largest(a), 1.0_wp, 1.0_wp])
    case (op_arctangent)
      x = chained(a, [atan(a%low), atan(a%high), 1.0_wp, 0.65_wp])
    case (op_exponential)
      is_bounded = max(a%high, -a%low) < most_exponent
      if (is_bounded) x = chained(a, [exp(a%low), exp(a%high), exp(a%high), exp(a%high)])
    case (op_reciprocal)
      is_bounded = a%low > least_argument .or. a%high < -least_argument
      if (is_bounded) x = chained(a, [1 / a%high, 1 / a%low, 1 / least**2, 2 / least**3])
    case (op_square_root)
      is_bounded = a%low > least_argument
      if (is_bounded) x = chained(a, [sqrt(a%low), sqrt(a%high), 0.5_wp / sqrt(a%low), 0.25_wp / (a%low * sqrt(a%low))])
    case (op_logarithm)
      is_bounded = a%low > least_argument
      if (is_bounded) x = chained(a, [log(a%low), log(a%high), 1 / a%low, 1 / a%low**2])
    case default
      is_bounded = .false.
    end select
  end subroutine bound_function

  !> Sizes of the sum of harmonics and of its first two derivatives by the argument.
  pure function sizes_of_harmonics(law, slot, i) result(sizes)
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot, i
    real(wp) :: sizes(0:2)
    real(wp) :: amplitude
    integer :: k, n, terms

    sizes = 0.0_wp
    associate (node => law%tape%node(i), list => law%tape%list)
      terms = (node%last - node%first + 1) / 3
      do k = node%first, node%first + terms - 1
        n = list(k)
        amplitude = abs(law%constant(slot, law%column(list(k + terms)))) &
                    + abs(law%constant(slot, law%column(list(k + 2 * terms))))
        sizes(0) = sizes(0) + amplitude
        sizes(1) = sizes(1) + n * amplitude
        sizes(2) = sizes(2) + n**2 * amplitude
      end do
    end associate
  end function sizes_of_harmonics

  pure type(variable_bounds_t) function product_of(a, b) result(x)
    type(variable_bounds_t), intent(in) :: a, b
    real(wp) :: corners(4)

    corners = [a%low * b%low, a%low * b%high, a%high * b%low, a%high * b%high]
    x = variable_bounds_t(minval(corners), maxval(corners), largest(a) * b%slope + largest(b) * a%slope, &
                          largest(a) * b%bend + 2 * a%slope * b%slope + largest(b) * a%bend)
  end function product_of

  !> A function of a variable.
  pure type(variable_bounds_t) function chained(a, of) result(x)
    type(variable_bounds_t), intent(in) :: a
    real(wp), intent(in) :: of(4)   !! lowest and highest value of the function, sizes of its derivatives

    x = variable_bounds_t(of(1), of(2), of(3) * a%slope, of(3) * a%bend + of(4) * a%slope**2)
  end function chained

  !> The largest size of a variable.
  elemental real(wp) function largest(x)
    type(variable_bounds_t), intent(in) :: x

    largest = max(abs(x%low), abs(x%high))
  end function largest

end module nocdyn_law_bounds
