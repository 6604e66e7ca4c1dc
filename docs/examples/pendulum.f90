!> Pendulums without friction, one in each lane: phi'' = -omega_0^2 sin(phi).
module pendulum
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: evaluation_fatal, pattern_t, system_t
  use nocdyn_vector_functions, only: cosines, sines
  implicit none (type, external)
  private

  public :: pendulum_block

  !> States: angle phi [rad], speed omega [rad/s]. Quadrature: the integral of omega^2 over the time [rad2/s].
  type, extends(system_t), public :: pendulum_t
    real(wp), allocatable :: omega_0(:)          !! frequency of small swings [rad/s], [lanes]
    real(wp), allocatable, private :: x(:)       !! work space, [lanes]
  contains
    procedure :: derivative
    procedure :: jacobian
    procedure :: jacobian_pattern
    procedure :: component_name
  end type pendulum_t

contains

  function pendulum_block(lanes) result(system)
    integer, intent(in) :: lanes
    type(pendulum_t) :: system

    system%lanes = lanes
    system%states = 2
    system%quadratures = 1
    allocate (system%omega_0(lanes), system%x(lanes), source=1.0_wp)
  end function pendulum_block

  subroutine derivative(self, t, y, dydt, status)
    class(pendulum_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    self%x(:) = y(:, 1)
    call sines(self%lanes, self%x)
    do lane = 1, self%lanes
      dydt(lane, 1) = y(lane, 2)
      dydt(lane, 2) = -self%omega_0(lane)**2 * self%x(lane)
      dydt(lane, 3) = y(lane, 2)**2
    end do
    where (self%omega_0 <= 0) status = evaluation_fatal
  end subroutine derivative

  !> The values at the positions of `jacobian_pattern`, in their order.
  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(pendulum_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    self%x(:) = y(:, 1)
    call cosines(self%lanes, self%x)
    dfdy(:, 1) = -self%omega_0**2 * self%x
    dfdy(:, 2) = 1.0_wp
    dfdy(:, 3) = 2 * y(:, 2)
    dfdt(:, :) = 0.0_wp
  end subroutine jacobian

  function jacobian_pattern(self) result(pattern)
    class(pendulum_t), intent(in) :: self
    type(pattern_t) :: pattern

    pattern = pattern_t(row=[2, 1, 3], column=[1, 2, 2])
  end function jacobian_pattern

  !> Names in messages about failures.
  function component_name(self, index) result(name)
    class(pendulum_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name
    character(len=8), parameter :: names(3) = [character(len=8) :: 'angle', 'speed', 'integral']

    name = trim(names(index))
  end function component_name

end module pendulum
