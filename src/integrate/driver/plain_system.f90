!> An ordinary subroutine f(t, y, dydt) as a system of one lane.
module nocdyn_plain_system
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: plain_system, plain_derivative_interface, plain_jacobian_interface

  abstract interface

    !> dydt = f(t, y)
    subroutine plain_derivative_interface(t, y, dydt)
      import :: wp
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: dydt(:)
    end subroutine plain_derivative_interface

    !> The partial derivatives of f: dfdy(i, j) by y(j), dfdt by t.
    subroutine plain_jacobian_interface(t, y, dfdy, dfdt)
      import :: wp
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: dfdy(:, :)
      real(wp), intent(out) :: dfdt(:)
    end subroutine plain_jacobian_interface

  end interface

  !> Without `f_jacobian` the Jacobian is a forward difference, as in Hairer's RODAS: one evaluation of f for each state and two
  !> more, which the solver status does not count.
  type, extends(system_t), public :: plain_system_t
    procedure(plain_derivative_interface), pointer, nopass :: f => null()
    procedure(plain_jacobian_interface), pointer, nopass :: f_jacobian => null()
    real(wp), allocatable, private :: dydt(:), shifted_dydt(:), shifted_y(:)
    real(wp), allocatable, private :: dfdy(:, :)
  contains
    procedure :: derivative
    procedure :: jacobian
  end type plain_system_t

contains

  !> The system y' = f(t, y) of `states` equations; its `f_jacobian` may be set afterwards.
  function plain_system(states, f) result(system)
    integer, intent(in) :: states
    procedure(plain_derivative_interface) :: f
    type(plain_system_t) :: system

    system%lanes = 1
    system%states = states
    system%f => f
    allocate (system%dydt(states), system%shifted_dydt(states), system%shifted_y(states), system%dfdy(states, states), &
              source=0.0_wp)
  end function plain_system

  subroutine derivative(self, t, y, dydt, status)
    class(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    call self%f(t(1), y(1, :), dydt(1, :))
  end subroutine derivative

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: j

    if (associated(self%f_jacobian)) then
      call self%f_jacobian(t(1), y(1, :), self%dfdy, dfdt(1, :))
    else
      call take_differences(self, t(1), y(1, :), dfdt(1, :))
    end if
    do j = 1, self%states
      dfdy(1, (j - 1) * self%states + 1:j * self%states) = self%dfdy(:, j)
    end do
  end subroutine jacobian

  !> Sets dfdy and dfdt by forward differences; the shift of an argument is `step_of` it.
  subroutine take_differences(self, t, y, dfdt)
    type(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)
    real(wp), intent(out) :: dfdt(:)
    real(wp) :: shift
    integer :: i

    call self%f(t, y, self%dydt)
    do i = 1, self%states
      self%shifted_y(:) = y
      self%shifted_y(i) = y(i) + step_of(y(i))
      shift = self%shifted_y(i) - y(i)
      call self%f(t, self%shifted_y, self%shifted_dydt)
      self%dfdy(:, i) = (self%shifted_dydt - self%dydt) / shift
    end do
    shift = (t + step_of(t)) - t
    call self%f(t + shift, y, self%shifted_dydt)
    dfdt(:) = (self%shifted_dydt - self%dydt) / shift
  end subroutine take_differences

  !> The shift of an argument x: the square root of its rounding error.
  elemental real(wp) function step_of(x)
    real(wp), intent(in) :: x
    real(wp), parameter :: smallest = 1.0e-5_wp   !! replaces smaller sizes

    step_of = sqrt(epsilon(x) * max(smallest, abs(x)))
  end function step_of

end module nocdyn_plain_system
