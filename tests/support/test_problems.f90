!> Systems of equations for tests of the integrators.
!>
!> gfortran -O3 vectorises sines and cosines by glibc's libmvec, whose last bits differ from the scalar functions, so that a lane
!> would depend on its index in the block: loops with such calls are marked `novector`.
module nocdyn_test_problems
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: evaluation_ok, evaluation_fatal, evaluation_recoverable, pattern_t, system_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: smooth_problem, smooth_solution, smooth_quadrature, stiff_problem, duffing_problem, wall_problem, rest_problem

  !> What a `wall_t` returns beyond the wall.
  integer, parameter, public :: wall_absent = 0
  integer, parameter, public :: wall_not_finite = 1
  integer, parameter, public :: wall_shorten = 2
  integer, parameter, public :: wall_give_up = 3
  integer, parameter, public :: wall_jump = 4       !! the slope jumps by a factor of 1e30
  integer, parameter, public :: wall_jacobian = 5   !! only the Jacobian is not finite there

  !> y' = rate (g(y) - g(u)) + u' with y = u(t), and one quadrature w' = y1 y2^2 - u1 u2^2 + cos(2 t) with w = sin(2 t) / 2;
  !> g = (-y1 y2 + y2^2 / 2, y1^2 / 2 - y2).
  type, extends(system_t), public :: smooth_t
    real(wp), allocatable :: rate(:)
  contains
    procedure :: derivative => smooth_derivative
    procedure :: jacobian => smooth_jacobian
  end type smooth_t

  !> Prothero and Robinson: y' = -stiffness (y - cos t) - sin t, with y = cos t, and a quadrature w' = y.
  type, extends(system_t), public :: stiff_t
    real(wp), allocatable :: stiffness(:)
  contains
    procedure :: derivative => stiff_derivative
    procedure :: jacobian => stiff_jacobian
  end type stiff_t

  !> x'' + 0.1 x' + stiffness x + x^3 = 3 cos(1.3 t), and the work of the damper as a quadrature.
  type, extends(system_t), public :: duffing_t
    real(wp), allocatable :: stiffness(:)
  contains
    procedure :: derivative => duffing_derivative
    procedure :: jacobian => duffing_jacobian
    procedure :: jacobian_pattern => duffing_pattern
  end type duffing_t

  !> (y1', y2') = (1, cos t) as long as y1 < place; then whatever `answer` says.
  type, extends(system_t), public :: wall_t
    real(wp), allocatable :: place(:)
    integer, allocatable :: answer(:)   !! wall_...
  contains
    procedure :: derivative => wall_derivative
    procedure :: jacobian => wall_jacobian_values
    procedure :: component_name => wall_name
  end type wall_t

  !> The states are constant; the quadratures, if there are any, grow with the slope 1.
  type, extends(system_t), public :: rest_t
  contains
    procedure :: derivative => rest_derivative
    procedure :: jacobian => rest_jacobian
  end type rest_t

contains

  pure function smooth_problem(rate) result(problem)
    real(wp), intent(in) :: rate(:)
    type(smooth_t) :: problem

    problem%lanes = size(rate)
    problem%states = 2
    problem%quadratures = 1
    allocate (problem%rate, source=rate)
  end function smooth_problem

  pure function smooth_solution(t) result(u)
    real(wp), intent(in) :: t
    real(wp) :: u(2)

    u = [1 + 0.5_wp * sin(t), exp(-0.5_wp * t) * cos(2 * t)]
  end function smooth_solution

  pure function smooth_slope(t) result(slope)
    real(wp), intent(in) :: t
    real(wp) :: slope(2)

    slope = [0.5_wp * cos(t), exp(-0.5_wp * t) * (-0.5_wp * cos(2 * t) - 2 * sin(2 * t))]
  end function smooth_slope

  pure function smooth_curvature(t) result(curvature)
    real(wp), intent(in) :: t
    real(wp) :: curvature(2)

    curvature = [-0.5_wp * sin(t), exp(-0.5_wp * t) * (-3.75_wp * cos(2 * t) + 2 * sin(2 * t))]
  end function smooth_curvature

  pure function smooth_quadrature(t) result(w)
    real(wp), intent(in) :: t
    real(wp) :: w

    w = 0.5_wp * sin(2 * t)
  end function smooth_quadrature

  pure function smooth_coupling(y) result(g)
    real(wp), intent(in) :: y(2)
    real(wp) :: g(2)

    g = [-y(1) * y(2) + 0.5_wp * y(2)**2, 0.5_wp * y(1)**2 - y(2)]
  end function smooth_coupling

  subroutine smooth_derivative(self, t, y, dydt, status)
    class(smooth_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    real(wp) :: u(2)
    integer :: lane

    status = evaluation_ok
    !GCC$ novector
    do lane = 1, self%lanes
      u = smooth_solution(t(lane))
      dydt(lane, 1:2) = self%rate(lane) * (smooth_coupling(y(lane, 1:2)) - smooth_coupling(u)) + smooth_slope(t(lane))
      dydt(lane, 3) = y(lane, 1) * y(lane, 2)**2 - u(1) * u(2)**2 + cos(2 * t(lane))
    end do
  end subroutine smooth_derivative

  subroutine smooth_jacobian(self, t, y, dfdy, dfdt, status)
    class(smooth_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    real(wp) :: u(2), v(2)
    integer :: lane

    status = evaluation_ok
    !GCC$ novector
    do lane = 1, self%lanes
      u = smooth_solution(t(lane))
      v = smooth_slope(t(lane))
      dfdy(lane, 1:3) = [-self%rate(lane) * y(lane, 2), self%rate(lane) * y(lane, 1), y(lane, 2)**2]
      dfdy(lane, 4:6) = [self%rate(lane) * (y(lane, 2) - y(lane, 1)), -self%rate(lane), 2 * y(lane, 1) * y(lane, 2)]
      dfdt(lane, 1:2) = smooth_curvature(t(lane)) &
        - self%rate(lane) * [-v(1) * u(2) - u(1) * v(2) + u(2) * v(2), u(1) * v(1) - v(2)]
      dfdt(lane, 3) = -v(1) * u(2)**2 - 2 * u(1) * u(2) * v(2) - 2 * sin(2 * t(lane))
    end do
  end subroutine smooth_jacobian

  pure function stiff_problem(stiffness) result(problem)
    real(wp), intent(in) :: stiffness(:)
    type(stiff_t) :: problem

    problem%lanes = size(stiffness)
    problem%states = 1
    problem%quadratures = 1
    allocate (problem%stiffness, source=stiffness)
  end function stiff_problem

  subroutine stiff_derivative(self, t, y, dydt, status)
    class(stiff_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    status = evaluation_ok
    !GCC$ novector
    do lane = 1, self%lanes
      dydt(lane, 1) = -self%stiffness(lane) * (y(lane, 1) - cos(t(lane))) - sin(t(lane))
      dydt(lane, 2) = y(lane, 1)
    end do
  end subroutine stiff_derivative

  subroutine stiff_jacobian(self, t, y, dfdy, dfdt, status)
    class(stiff_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    status = evaluation_ok
    dfdt(:, 2) = 0.0_wp * y(:, 2)
    !GCC$ novector
    do lane = 1, self%lanes
      dfdy(lane, 1) = -self%stiffness(lane)
      dfdy(lane, 2) = 1.0_wp
      dfdt(lane, 1) = -self%stiffness(lane) * sin(t(lane)) - cos(t(lane))
    end do
  end subroutine stiff_jacobian

  pure function duffing_problem(stiffness) result(problem)
    real(wp), intent(in) :: stiffness(:)
    type(duffing_t) :: problem

    problem%lanes = size(stiffness)
    problem%states = 2
    problem%quadratures = 1
    allocate (problem%stiffness, source=stiffness)
  end function duffing_problem

  subroutine duffing_derivative(self, t, y, dydt, status)
    class(duffing_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    status = evaluation_ok
    !GCC$ novector
    do lane = 1, self%lanes
      dydt(lane, 1) = y(lane, 2)
      dydt(lane, 2) = 3 * cos(1.3_wp * t(lane)) - 0.1_wp * y(lane, 2) - self%stiffness(lane) * y(lane, 1) - y(lane, 1)**3
      dydt(lane, 3) = 0.1_wp * y(lane, 2)**2
    end do
  end subroutine duffing_derivative

  function duffing_pattern(self) result(pattern)
    class(duffing_t), intent(in) :: self
    type(pattern_t) :: pattern

    allocate (pattern%row, source=[2, 1, 2, self%states + 1])
    allocate (pattern%column, source=[1, 2, 2, 2])
  end function duffing_pattern

  subroutine duffing_jacobian(self, t, y, dfdy, dfdt, status)
    class(duffing_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    status = evaluation_ok
    dfdy(:, 1) = -self%stiffness - 3 * y(:, 1)**2
    dfdy(:, 2) = 1.0_wp
    dfdy(:, 3) = -0.1_wp
    dfdy(:, 4) = 0.2_wp * y(:, 2)
    dfdt(:, :) = 0.0_wp
    !GCC$ novector
    do lane = 1, self%lanes
      dfdt(lane, 2) = -3.9_wp * sin(1.3_wp * t(lane))
    end do
  end subroutine duffing_jacobian

  pure function wall_problem(place, answer) result(problem)
    real(wp), intent(in) :: place(:)
    integer, intent(in) :: answer(:)
    type(wall_t) :: problem

    problem%lanes = size(place)
    problem%states = 2
    allocate (problem%place, source=place)
    allocate (problem%answer, source=answer)
  end function wall_problem

  subroutine wall_derivative(self, t, y, dydt, status)
    class(wall_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    status = evaluation_ok
    !GCC$ novector
    do lane = 1, self%lanes
      dydt(lane, 1) = 1.0_wp
      dydt(lane, 2) = cos(t(lane))
      if (y(lane, 1) < self%place(lane)) cycle
      select case (self%answer(lane))
      case (wall_not_finite)
        dydt(lane, 2) = quiet_nan()
      case (wall_shorten)
        status(lane) = evaluation_recoverable
      case (wall_give_up)
        status(lane) = evaluation_fatal
      case (wall_jump)
        dydt(lane, 2) = 1.0e30_wp
      case default
        status(lane) = evaluation_ok
      end select
    end do
  end subroutine wall_derivative

  subroutine wall_jacobian_values(self, t, y, dfdy, dfdt, status)
    class(wall_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    status = evaluation_ok
    dfdy(:, :) = 0.0_wp
    dfdt(:, :) = 0.0_wp
    !GCC$ novector
    do lane = 1, self%lanes
      dfdt(lane, 2) = -sin(t(lane))
      if (self%answer(lane) == wall_jacobian .and. y(lane, 1) >= self%place(lane)) dfdy(lane, 3) = quiet_nan()
    end do
  end subroutine wall_jacobian_values

  function wall_name(self, index) result(name)
    class(wall_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    name = 'wall state ' // to_text(index)
    if (index > self%states) error stop 'nocdyn_test_problems: the wall has no quadratures'
  end function wall_name

  !> A NaN whose creation and copies raise no exception.
  pure function quiet_nan() result(nan)
    use, intrinsic :: iso_fortran_env, only: int64
    real(wp) :: nan

    nan = transfer(int(z'7FF8000000000000', int64), nan)
  end function quiet_nan

  pure function rest_problem(lanes, states, quadratures) result(problem)
    integer, intent(in) :: lanes, states, quadratures
    type(rest_t) :: problem

    problem%lanes = lanes
    problem%states = states
    problem%quadratures = quadratures
  end function rest_problem

  subroutine rest_derivative(self, t, y, dydt, status)
    class(rest_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    status = merge(evaluation_ok, evaluation_fatal, size(t) == self%lanes .and. size(y, 1) == self%lanes)
    dydt(:, :self%states) = 0.0_wp
    dydt(:, self%states + 1:) = 1.0_wp
  end subroutine rest_derivative

  subroutine rest_jacobian(self, t, y, dfdy, dfdt, status)
    class(rest_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    status = merge(evaluation_ok, evaluation_fatal, size(t) == self%lanes .and. size(y, 1) == self%lanes)
    dfdy(:, :) = 0.0_wp
    dfdt(:, :) = 0.0_wp
  end subroutine rest_jacobian

end module nocdyn_test_problems
