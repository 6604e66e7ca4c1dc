!> Van der Pol's oscillators y'' = mu (1 - y^2) y' - y on lanes.
module nocdyn_relaxation
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: relaxation

  type, extends(system_t), public :: relaxation_t
    real(wp), allocatable :: mu(:)
    integer :: jacobians_made = 0   !! calls of `jacobian`
  contains
    procedure :: derivative
    procedure :: jacobian
  end type relaxation_t

contains

  pure function relaxation(mu) result(system)
    real(wp), intent(in) :: mu(:)
    type(relaxation_t) :: system

    system%lanes = size(mu)
    system%states = 2
    allocate (system%mu, source=mu)
  end function relaxation

  subroutine derivative(self, t, y, dydt, status)
    class(relaxation_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dydt(:, 1) = y(:, 2)
    dydt(:, 2) = self%mu * ((1 - y(:, 1)**2) * y(:, 2)) - y(:, 1)
  end subroutine derivative

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(relaxation_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    self%jacobians_made = self%jacobians_made + 1
    dfdy(:, 1) = 0.0_wp
    dfdy(:, 2) = -2 * self%mu * y(:, 1) * y(:, 2) - 1
    dfdy(:, 3) = 1.0_wp
    dfdy(:, 4) = self%mu * (1 - y(:, 1)**2)
    dfdt(:, :) = 0.0_wp
  end subroutine jacobian

end module nocdyn_relaxation
