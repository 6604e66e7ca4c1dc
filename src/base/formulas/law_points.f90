!> The values of a law at one operating point of one element, and the derivatives of one of them by all others.
!>
!> The point has branches of its own, so that nothing of the law changes. Derivatives follow from the last operation to the first
!> one (A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, section 3.2).
module nocdyn_law_points
  use nocdyn_curves, only: curve_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: law_node_t, law_tape_t, op_add, op_arctangent, op_cosine, op_exponential, op_fixed, op_harmonics, &
    op_larger, op_literal, op_log_cosh, op_logarithm, op_multiply, op_parameter, op_pick, op_power, op_reciprocal, op_scale, &
    op_sech_squared, op_segment, op_shift, op_sine, op_square_root, op_subtract, op_tanh, op_wave
  use nocdyn_law_values, only: value_of
  use nocdyn_laws, only: law_parameter_t
  use nocdyn_vector_functions, only: cosine_of, sine_of
  implicit none (type, external)
  private

  public :: new_law_point

  type, public :: law_point_t
    integer :: element = 0
    integer, allocatable :: branch(:)      !! of the switches of the element
    real(wp), allocatable :: x(:)          !! values of all nodes, [0:nodes]
    logical, allocatable :: is_void(:)     !! constants that the element lacks, as the amplitude of a further term, [0:nodes]
    real(wp), allocatable :: slope(:)      !! derivatives by all nodes, [0:nodes]
    logical, allocatable :: reaches(:)     !! whether the result of `differentiate` can depend on a node, [0:nodes]
  contains
    procedure :: set_constants, evaluate, differentiate
  end type law_point_t

contains

  !> A point of an element in the first lane, without inputs; its constants are not yet set.
  function new_law_point(tape, element, branch) result(self)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: element
    integer, intent(in) :: branch(:)   !! of the switches of the element
    type(law_point_t) :: self

    self%element = element
    allocate (self%branch, source=branch)
    allocate (self%x(0:tape%count), source=0.0_wp)
    allocate (self%slope(0:tape%count), source=0.0_wp)
    allocate (self%is_void(0:tape%count), self%reaches(0:tape%count), source=.false.)
  end function new_law_point

  !> Computes the constants from the parameters, on the branches of the point.
  pure subroutine set_constants(self, tape, parameters, curve)
    class(law_point_t), intent(inout) :: self
    type(law_tape_t), intent(in) :: tape
    type(law_parameter_t), intent(in) :: parameters(:)
    type(curve_t), intent(in), optional :: curve   !! of the element
    integer :: a, i

    do i = 1, tape%count
      associate (node => tape%node(i), x => self%x)
        if (.not. node%is_constant) cycle
        self%is_void(i) = lacks(self, tape, node)
        select case (node%operation)
        case (op_literal)
          x(i) = node%value
        case (op_parameter)
          x(i) = 0.0_wp
          if (.not. self%is_void(i)) x(i) = parameters(node%a)%value(1, tape%list(node%first - 1 + self%element))
        case (op_pick)
          x(i) = x(tape%list(node%first - 1 + self%branch(node%a)))
        case (op_segment)
          x(i) = curve%segment_number(self%branch(1), node%a)
        case default
          a = merge(i - 1, node%a, node%operation == op_sech_squared)
          x(i) = value_of(node%operation, x(a), x(node%b))
        end select
      end associate
    end do
  end subroutine set_constants

  !> Whether a constant is zero because the element has no column of a parameter.
  pure logical function lacks(self, tape, node)
    class(law_point_t), intent(in) :: self
    type(law_tape_t), intent(in) :: tape
    type(law_node_t), intent(in) :: node

    select case (node%operation)
    case (op_parameter)
      lacks = tape%list(node%first - 1 + self%element) == 0
    case (op_pick)
      lacks = all(self%is_void(tape%list(node%first:node%last)))
    case (op_add, op_subtract)
      lacks = self%is_void(node%a) .and. self%is_void(node%b)
    case (op_multiply)
      lacks = self%is_void(node%a) .or. self%is_void(node%b)
    case default
      lacks = .false.
    end select
  end function lacks

  !> Computes all variables from the inputs and constants.
  pure subroutine evaluate(self, tape, kept)
    class(law_point_t), intent(inout) :: self
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: kept   !! node that keeps its value; 0: none
    integer :: a, i

    do i = 1, tape%count
      associate (node => tape%node(i), x => self%x)
        if (node%is_constant .or. node%operation < op_fixed .or. i == kept) cycle
        if (node%operation == op_harmonics) then
          x(i) = harmonic_value(self, tape, node)
        else
          a = merge(i - 1, node%a, node%operation == op_sech_squared)
          x(i) = value_of(node%operation, x(a), x(node%b))
        end if
      end associate
    end do
  end subroutine evaluate

  pure real(wp) function harmonic_value(self, tape, node) result(value)
    class(law_point_t), intent(in) :: self
    type(law_tape_t), intent(in) :: tape
    type(law_node_t), intent(in) :: node
    integer :: k, terms

    terms = (node%last - node%first + 1) / 3
    value = 0.0_wp
    do k = node%first, node%first + terms - 1
      associate (angle => tape%list(k) * self%x(node%a), a => tape%list(k + terms), b => tape%list(k + 2 * terms))
        value = value + self%x(a) * sine_of(angle) + self%x(b) * cosine_of(angle)
      end associate
    end do
  end function harmonic_value

  !> The derivatives of a variable by all variables before it, after `evaluate`.
  pure subroutine differentiate(self, tape, result)
    class(law_point_t), intent(inout) :: self
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: result   !! node, of which 0 depends on nothing
    integer :: i
    real(wp) :: by_a, by_b

    self%slope = 0.0_wp
    self%reaches = .false.
    self%slope(result) = 1.0_wp
    self%reaches(result) = result > 0
    do i = result, 1, -1
      associate (node => tape%node(i), x => self%x)
        if (.not. self%reaches(i) .or. node%is_constant .or. node%operation <= op_fixed) cycle
        self%reaches(node%b) = .true.
        if (.not. self%is_void(node%b) .or. node%operation == op_shift) self%reaches(node%a) = .true.
        if (node%operation == op_harmonics) then
          by_a = harmonic_slope(self, tape, node)
          by_b = 0.0_wp
        else
          call find_partials(node, x(node%a), x(node%b), x(i), by_a, by_b)
        end if
        self%slope(node%a) = self%slope(node%a) + by_a * self%slope(i)
        self%slope(node%b) = self%slope(node%b) + by_b * self%slope(i)
      end associate
    end do
    self%reaches(0) = .false.
  end subroutine differentiate

  pure real(wp) function harmonic_slope(self, tape, node) result(slope)
    class(law_point_t), intent(in) :: self
    type(law_tape_t), intent(in) :: tape
    type(law_node_t), intent(in) :: node
    integer :: k, terms

    terms = (node%last - node%first + 1) / 3
    slope = 0.0_wp
    do k = node%first, node%first + terms - 1
      associate (n => tape%list(k), a => tape%list(k + terms), b => tape%list(k + 2 * terms))
        slope = slope + n * (self%x(a) * cosine_of(n * self%x(node%a)) - self%x(b) * sine_of(n * self%x(node%a)))
      end associate
    end do
  end function harmonic_slope

  !> The derivatives of an operation by its operands.
  pure subroutine find_partials(node, x, y, z, by_x, by_y)
    type(law_node_t), intent(in) :: node
    real(wp), intent(in) :: x, y   !! operands
    real(wp), intent(in) :: z      !! the value
    real(wp), intent(out) :: by_x, by_y

    by_y = 0.0_wp
    select case (node%operation)
    case (op_add)
      by_x = 1.0_wp
      by_y = 1.0_wp
    case (op_subtract)
      by_x = 1.0_wp
      by_y = -1.0_wp
    case (op_multiply)
      by_x = y
      by_y = x
    case (op_shift)
      by_x = 1.0_wp
    case (op_scale)
      by_x = y
    case (op_reciprocal)
      by_x = -z * z
    case (op_wave)
      by_x = y * cosine_of(x)
    case (op_sine)
      by_x = cosine_of(x)
    case (op_cosine)
      by_x = -sine_of(x)
    case (op_tanh)
      by_x = 1.0_wp - z * z
    case (op_sech_squared)
      by_x = -2.0_wp * tanh(x) * z
    case (op_exponential)
      by_x = z
    case (op_square_root)
      by_x = 0.5_wp / z
    case (op_log_cosh)
      by_x = tanh(x)
    case (op_logarithm)
      by_x = 1.0_wp / x
    case (op_power)
      by_x = y * z / x
    case (op_arctangent)
      by_x = 1.0_wp / y
    case (op_larger)
      by_x = merge(1.0_wp, 0.0_wp, x >= y)
      by_y = 1.0_wp - by_x
    case default
      error stop 'nocdyn_law_points: no such operation'
    end select
  end subroutine find_partials

end module nocdyn_law_points
