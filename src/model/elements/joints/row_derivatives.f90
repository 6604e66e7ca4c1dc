!> The values and the first three derivatives of nodes of a law by its only variable, an angle or the time, at a point: for one
!> element, without work space, so that they may be asked for anywhere.
!>
!> This is the Taylor arithmetic of `law_series.inc` (`nocdyn_law_walk`), but each operation gives all coefficients at once, which
!> takes less than a third of the time for one element. Tests compare both. Of the operations it knows those that rows need.
module nocdyn_row_derivatives
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: law_tape_t, op_add, op_arctangent, op_cosine, op_fixed, op_multiply, op_reciprocal, op_scale, &
    op_shift, op_sine, op_square_root, op_subtract, op_wave
  use nocdyn_laws, only: law_t
  use nocdyn_vector_functions, only: cosine_of, sine_of
  implicit none (type, external)
  private

  public :: new_row_derivatives

  integer, parameter :: order = 3          ! of the last derivative
  integer, parameter :: most_steps = 40
  integer, parameter :: known(*) = [op_fixed, op_add, op_subtract, op_multiply, op_shift, op_scale, op_reciprocal, op_wave, &
                                    op_sine, op_cosine, op_square_root, op_arctangent]

  !> The operations that give the nodes. Their coefficients are the columns of a local array; the variable is column 0.
  type, public :: row_derivatives_t
    integer, private :: steps = 0
    integer, allocatable, private :: operation(:), a(:), b(:)   !! columns of coefficients or constants, [steps]
    integer, allocatable, private :: results(:)                 !! their columns
  contains
    procedure :: compute
  end type row_derivatives_t

contains

  !> The operations that give some nodes.
  function new_row_derivatives(tape, variable, results) result(self)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: variable     !! node of an angle or of the time, all that the results depend on
    integer, intent(in) :: results(:)   !! nodes
    type(row_derivatives_t) :: self
    integer, allocatable :: constants(:), nodes(:)
    integer :: column(0:tape%count), i

    associate (needed => tape%needed(results, .false.))
      associate (cosines => pack(needed, [(tape%node(needed(i))%operation == op_cosine, i=1, size(needed))]))
        allocate (nodes, source=tape%needed([results, cosines - 1], .false.))   ! with the sine before each
      end associate
    end associate
    nodes = pack(nodes, nodes /= variable)
    self%steps = size(nodes)
    if (self%steps > most_steps) error stop 'nocdyn_row_derivatives: too many operations'
    column = 0
    constants = tape%constants()
    column(constants) = [(i, i=1, size(constants))]   ! as in `law_t`
    column(nodes) = [(i, i=1, size(nodes))]
    allocate (self%results(size(results)), self%operation(self%steps), self%a(self%steps), self%b(self%steps))
    self%results(:) = column(results)
    do i = 1, self%steps
      associate (node => tape%node(nodes(i)))
        if (all(node%operation /= known)) error stop 'nocdyn_row_derivatives: an operation that rows have not needed so far'
        self%operation(i) = node%operation
        self%a(i) = column(node%a)
        self%b(i) = column(node%b)
      end associate
    end do
  end function new_row_derivatives

  !> The values and their derivatives.
  pure subroutine compute(self, law, slot, v, g)
    class(row_derivatives_t), intent(in) :: self
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot           !! of the element, counted through all strips
    real(wp), intent(in) :: v             !! variable [rad] or [s]
    real(wp), intent(out) :: g(0:order, size(self%results))   !! in the unit of the node by powers of the unit of v
    real(wp) :: f(0:order), x(0:order, 0:most_steps)
    integer :: i

    x(:, 0) = [v, 1.0_wp, 0.0_wp, 0.0_wp]
    do i = 1, self%steps
      associate (a => self%a(i), b => self%b(i))
        select case (self%operation(i))
        case (op_fixed)
          x(:, i) = [law%constant(slot, a), 0.0_wp, 0.0_wp, 0.0_wp]
        case (op_add)
          x(:, i) = x(:, a) + x(:, b)
        case (op_subtract)
          x(:, i) = x(:, a) - x(:, b)
        case (op_multiply)
          x(:, i) = product_of(x(:, a), x(:, b))
        case (op_shift)
          x(:, i) = x(:, a) + [law%constant(slot, b), 0.0_wp, 0.0_wp, 0.0_wp]
        case (op_scale)
          x(:, i) = law%constant(slot, b) * x(:, a)
        case (op_wave)
          x(:, i) = law%constant(slot, b) * chained(sine_series(x(0, a)), x(:, a))
        case (op_sine)
          f = sine_series(x(0, a))
          x(:, i) = chained(f, x(:, a))
        case (op_cosine)   ! after its sine
          x(:, i) = chained([f(1), -f(0), 3.0_wp * f(3), -f(2) / 3.0_wp], x(:, a))
        case default
          x(:, i) = chained(function_series(self%operation(i), x(0, a)), x(:, a))
        end select
      end associate
    end do
    do i = 1, size(self%results)
      g(:, i) = [1.0_wp, 1.0_wp, 2.0_wp, 6.0_wp] * x(:, self%results(i))
    end do
  end subroutine compute

  pure function product_of(x, y) result(z)
    real(wp), intent(in) :: x(0:order), y(0:order)
    real(wp) :: z(0:order)

    z(0) = x(0) * y(0)
    z(1) = x(0) * y(1) + x(1) * y(0)
    z(2) = x(0) * y(2) + x(1) * y(1) + x(2) * y(0)
    z(3) = x(0) * y(3) + x(1) * y(2) + x(2) * y(1) + x(3) * y(0)
  end function product_of

  !> f(x) by the coefficients of f in powers of x - x(0).
  pure function chained(f, x) result(z)
    real(wp), intent(in) :: f(0:order), x(0:order)
    real(wp) :: z(0:order)

    z(0) = f(0)
    z(1) = f(1) * x(1)
    z(2) = f(1) * x(2) + f(2) * x(1)**2
    z(3) = f(1) * x(3) + (2.0_wp * f(2) * x(2) + f(3) * x(1)**2) * x(1)
  end function chained

  !> The coefficients of a function at x.
  pure function function_series(operation, x) result(f)
    integer, intent(in) :: operation
    real(wp), intent(in) :: x
    real(wp) :: f(0:order), q

    select case (operation)
    case (op_reciprocal)
      q = 1.0_wp / x
      f = q * [1.0_wp, -q, q * q, -q * q * q]
    case (op_square_root)
      q = 0.5_wp / x
      f = sqrt(x) * [1.0_wp, q, -0.5_wp * q * q, 0.5_wp * q * q * q]
    case default   ! the arctangent
      q = 1.0_wp / (1.0_wp + x * x)
      f = [atan(x), q, -x * q * q, (x * x - 1.0_wp / 3.0_wp) * q * q * q]
    end select
  end function function_series

  pure function sine_series(x) result(f)
    real(wp), intent(in) :: x   !! [rad]
    real(wp) :: f(0:order)

    f(0) = sine_of(x)
    f(1) = cosine_of(x)
    f(2:) = [-0.5_wp, -1.0_wp / 6.0_wp] * f(:1)
  end function sine_series

end module nocdyn_row_derivatives
