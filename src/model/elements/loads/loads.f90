!> Loads with the viscous resistance of eq. (5), M_r = -c omega, and those that resist with c omega + quadratic |omega| omega +
!> constant tanh(omega / constant_speed) + table(omega): fans and propellers, Coulomb friction made smooth.
module nocdyn_loads
  use nocdyn_bank, only: role_load
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_table_laws, only: over_speed, table_laws_t
  use nocdyn_text, only: string_t
  use nocdyn_vector_functions, only: tanh_of
  implicit none (type, external)
  private

  public :: new_loads, new_nonlinear_loads

  type, extends(table_laws_t), public :: loads_t
    real(wp), allocatable :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
  contains
    procedure :: list_parameters => list_loads
    procedure :: polynomials
  end type loads_t

  type, extends(loads_t), public :: nonlinear_loads_t
    real(wp), allocatable :: quadratic(:, :)        !! [N m s2/rad2], shape [lanes, loads] as all parameters
    real(wp), allocatable :: constant(:, :)         !! [N m]
    real(wp), allocatable :: constant_speed(:, :)   !! [rad/s], positive
  contains
    procedure :: list_parameters => list_nonlinear
    procedure :: evaluate
    procedure :: differentiate
  end type nonlinear_loads_t

contains

  !> A bank of viscous loads, each on one body.
  function new_loads(names, body, viscous) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
    type(loads_t) :: bank

    call bank%connect(role_load, size(viscous, 1), names, body)
    bank%viscous = viscous
  end function new_loads

  !> The coefficients c are in C, eq. (22).
  subroutine polynomials(self, laws)
    class(loads_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    laws%by_speed(:, self%first:self%last()) = -self%viscous
    laws%damping(:, self%first:self%last()) = self%viscous
  end subroutine polynomials

  subroutine list_loads(self, parameters)
    class(loads_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%table_laws_t%list_parameters(parameters)
    call parameters%add_key('viscous', self%viscous)
  end subroutine list_loads

  !> A bank of loads with all these terms, each on one body.
  function new_nonlinear_loads(names, body, viscous, quadratic, constant, constant_speed, curve) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :), quadratic(:, :)         !! [N m s/rad], [N m s2/rad2], shape [lanes, loads]
    real(wp), intent(in) :: constant(:, :), constant_speed(:, :)   !! [N m], [rad/s], shape [lanes, loads]
    type(curve_t), intent(in), optional :: curve(:, :)   !! resisting torque [N m] over speed [rad/s], [lanes, loads]; absent: 0
    type(nonlinear_loads_t) :: bank

    bank%loads_t = new_loads(names, body, viscous)
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    allocate (bank%quadratic, source=quadratic)
    allocate (bank%constant, source=constant)
    allocate (bank%constant_speed, source=constant_speed)
    if (present(curve)) call bank%set_curves(over_speed, curve)
  end function new_nonlinear_loads

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(nonlinear_loads_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]

    call resist(self%values, self%quadratic, self%constant, self%constant_speed, speed, applied)
    call self%loads_t%evaluate(time, angle, speed, restoring, applied)
  end subroutine evaluate

  pure subroutine resist(n, quadratic, constant, constant_speed, speed, applied)
    integer, intent(in) :: n
    real(wp), intent(in) :: quadratic(n), constant(n), constant_speed(n), speed(n)
    real(wp), intent(inout) :: applied(n)
    integer :: i

    do i = 1, n
      applied(i) = applied(i) - (quadratic(i) * abs(speed(i)) * speed(i) + constant(i) * tanh_of(speed(i) / constant_speed(i)))
    end do
  end subroutine resist

  subroutine differentiate(self, elements)
    class(nonlinear_loads_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements

    associate (slope => elements%applied_speed(:, self%first:self%last()), speed => elements%speed(:, self%first:self%last()))
      slope = slope - (2.0_wp * self%quadratic * abs(speed) &
                       + self%constant / self%constant_speed * (1.0_wp - tanh_of(speed / self%constant_speed)**2))
    end associate
    call self%loads_t%differentiate(elements)
  end subroutine differentiate

  subroutine list_nonlinear(self, parameters)
    class(nonlinear_loads_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%loads_t%list_parameters(parameters)
    call parameters%add_key('quadratic', self%quadratic)
    call parameters%add_key('constant', self%constant)
    call parameters%add_key('constant_speed', self%constant_speed)
  end subroutine list_nonlinear

end module nocdyn_loads
