!> An ordinary subroutine f(t, y, dydt) as a system of one lane.
module nocdyn_plain_system
  use nocdyn_finite, only: all_finite
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: plain_system, plain_derivative_interface, plain_jacobian_interface

  real(wp), parameter :: most = 1.0e100_wp   !! of a threshold; its reciprocal is the least
  real(wp), parameter :: share = epsilon(1.0_wp)**(1.0_wp / 3)   !! of a size, by which an argument is shifted

  abstract interface

    !> dydt = f(t, y)
    subroutine plain_derivative_interface(t, y, dydt)
      import :: wp
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: dydt(:)
    end subroutine plain_derivative_interface

    !> The partial derivatives of f: dfdy(i, j) by y(j), dfdt by t.
    subroutine plain_jacobian_interface(t, y, dfdy, dfdt)
      import :: wp
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: dfdy(:, :), dfdt(:)
    end subroutine plain_jacobian_interface

  end interface

  !> Without `f_jacobian` the derivatives are differences of second order, for a Rosenbrock method loses its order with a Jacobian
  !> that is not exact: two evaluations of f for each state and three more, which the solver status does not count.
  type, extends(system_t), public :: plain_system_t
    procedure(plain_derivative_interface), pointer, nopass :: f => null()
    procedure(plain_jacobian_interface), pointer, nopass :: f_jacobian => null()
    real(wp), private :: threshold = 1.0e-3_wp   !! atol / rtol: a component below it is as uncertain as one of that size
    real(wp), private :: t_end = huge(1.0_wp)    !! of the integration [s]
    real(wp), private :: t_last = 0.0_wp       !! time of the last differences [s]
    real(wp), private :: last_step = 0.0_wp    !! between the last two [s], 0 at the start
    real(wp), allocatable, private :: dydt(:), near_dydt(:), far_dydt(:), shifted_y(:), dfdy(:, :)
  contains
    procedure :: derivative, jacobian, prepare_integration, start_lane
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
    allocate (system%dydt(states), system%near_dydt(states), system%far_dydt(states), system%shifted_y(states), &
              system%dfdy(states, states), source=0.0_wp)
  end function plain_system

  subroutine derivative(self, t, y, dydt, status)
    class(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes), y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    call self%f(t(1), y(1, :), dydt(1, :))
  end subroutine derivative

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes), y(self%lanes, self%states + self%quadratures)
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

  subroutine prepare_integration(self, rtol, atol, t_end)
    class(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: rtol, atol, t_end

    self%threshold = max(min(atol, most * rtol) / rtol, 1 / most)
    self%t_end = t_end
  end subroutine prepare_integration

  !> What the last integration has left does not change the differences of the next.
  subroutine start_lane(self, lane, t, y)
    class(plain_system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%t_last = t
    self%last_step = 0.0_wp
  end subroutine start_lane

  !> Sets dfdy and dfdt by differences. A shift is the cube root of the rounding error, where the errors by rounding and by
  !> curvature meet, times the largest of a component's value, its change over a step, and what the tolerances tell from zero.
  subroutine take_differences(self, t, y, dfdt)
    type(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: t, y(:)
    real(wp), intent(out) :: dfdt(:)
    real(wp) :: h, rate, shift
    integer :: i

    call self%f(t, y, self%dydt)
    ! sets `last_step`; at the start, to the time in which the fastest component changes by its size
    if (self%last_step > 0) then
      if (t > self%t_last) self%last_step = t - self%t_last
    else
      rate = maxval(abs(self%dydt) / max(abs(y), self%threshold))
      self%last_step = self%t_end - t
      if (rate > 1 / self%last_step) self%last_step = 1 / rate
    end if
    self%t_last = t
    h = self%last_step
    do i = 1, self%states
      shift = share * max(abs(y(i)), h * abs(self%dydt(i)), self%threshold)
      call differ_by_state(self, t, y, i, shift)
      if (.not. all_finite(self%states, self%dfdy(:, i))) call differ_by_state(self, t, y, i, -shift)
    end do
    shift = min(share * h * max(1.0_wp, abs(t) / h)**(1.0_wp / 3), (self%t_end - t) / 2)
    shift = max(shift, spacing(t))
    call self%f(t + shift, y, self%near_dydt)
    call self%f(t + 2 * shift, y, self%far_dydt)
    dfdt(:) = slope_of(self%dydt, self%near_dydt, self%far_dydt, (t + shift) - t, (t + 2 * shift) - t)
  end subroutine take_differences

  !> Sets column i of dfdy by the values of f at y and where y(i) is shifted once and twice.
  subroutine differ_by_state(self, t, y, i, shift)
    type(plain_system_t), intent(inout) :: self
    real(wp), intent(in) :: t, y(:)
    integer, intent(in) :: i
    real(wp), intent(in) :: shift
    real(wp) :: near

    self%shifted_y(:) = y
    self%shifted_y(i) = y(i) + shift
    near = self%shifted_y(i) - y(i)
    call self%f(t, self%shifted_y, self%near_dydt)
    self%shifted_y(i) = y(i) + 2 * shift
    call self%f(t, self%shifted_y, self%far_dydt)
    self%dfdy(:, i) = slope_of(self%dydt, self%near_dydt, self%far_dydt, near, self%shifted_y(i) - y(i))
  end subroutine differ_by_state

  !> The slope at 0 of the parabola through f0 there, `f_near` at `near` and `f_far` at `far`.
  elemental real(wp) function slope_of(f0, f_near, f_far, near, far)
    real(wp), intent(in) :: f0, f_near, f_far, near, far

    slope_of = (f_near - f0) / near
    slope_of = slope_of + (slope_of - (f_far - f0) / far) * (near / (far - near))
  end function slope_of

end module nocdyn_plain_system
