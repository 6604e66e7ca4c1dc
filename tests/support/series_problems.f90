!> Systems with Taylor series of their solutions.
module nocdyn_series_problems
  use nocdyn_kinds, only: wp
  use nocdyn_oscillators, only: oscillators_t
  use nocdyn_relaxation, only: relaxation_t
  use nocdyn_system, only: evaluation_ok, system_t
  use nocdyn_test_problems, only: duffing_t
  implicit none (type, external)
  private

  public :: burst_problem

  integer, parameter, public :: answer_nan = -1   !! of a `burst_t`: its series are not finite

  !> The Duffing oscillator of `duffing_problem`.
  type, extends(duffing_t), public :: duffing_series_t
    real(wp), allocatable :: square(:, :)   !! of x, [lanes, 0:order - 1]
  contains
    procedure :: series_obstacle => duffing_obstacle
    procedure :: prepare_series => prepare_duffing
    procedure :: series => duffing_series
  end type duffing_series_t

  !> The oscillators of `oscillators`.
  type, extends(oscillators_t), public :: oscillator_series_t
  contains
    procedure :: series_obstacle => oscillator_obstacle
    procedure :: prepare_series => prepare_oscillators
    procedure :: series => oscillator_series
  end type oscillator_series_t

  !> Van der Pol's oscillators of `relaxation`.
  type, extends(relaxation_t), public :: relaxation_series_t
  contains
    procedure :: series_obstacle => relaxation_obstacle
    procedure :: prepare_series => prepare_relaxation
    procedure :: series => relaxation_series
  end type relaxation_series_t

  !> u' = u^2, whose solution u = u0 / (1 - u0 t) has a pole at t = 1 / u0; beyond u = limit the evaluation returns `answer`.
  type, extends(system_t), public :: burst_t
    real(wp), allocatable :: limit(:)
    integer, allocatable :: answer(:)    !! evaluation_... or answer_nan
    integer :: expansions = 0            !! calls of `series`
    integer :: evaluations = 0           !! calls of `derivative`
  contains
    procedure :: derivative => burst_derivative
    procedure :: jacobian => burst_jacobian
    procedure :: series_obstacle => burst_obstacle
    procedure :: prepare_series => prepare_burst
    procedure :: series => burst_series
  end type burst_t

contains

  subroutine duffing_obstacle(self, obstacle)
    class(duffing_series_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = ''
  end subroutine duffing_obstacle

  subroutine prepare_duffing(self, order)
    class(duffing_series_t), intent(inout) :: self
    integer, intent(in) :: order

    if (allocated(self%square)) deallocate (self%square)
    allocate (self%square(self%lanes, 0:order - 1), source=0.0_wp)
  end subroutine prepare_duffing

  subroutine duffing_series(self, order, columns, t, y, status)
    class(duffing_series_t), intent(inout) :: self
    integer, intent(in) :: order, columns
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)
    integer, intent(inout) :: status(self%lanes)
    real(wp), parameter :: frequency = 1.3_wp
    real(wp) :: cube, force, slope, swap, work
    integer :: j, k, lane

    status = evaluation_ok
    !GCC$ novector
    do lane = 1, self%lanes
      force = 3 * cos(frequency * t(lane))
      slope = -3 * frequency * sin(frequency * t(lane))   ! the next coefficient of the force
      associate (x => y(lane, 1, :), v => y(lane, 2, :), w => y(lane, 3, :), square => self%square(lane, :))
        do k = 0, order - 1
          square(k + 1) = sum([(x(j + 1) * x(k - j + 1), j=0, k)])   ! here the coefficients are counted from 1
          cube = sum([(square(j + 1) * x(k - j + 1), j=0, k)])
          work = sum([(v(j + 1) * v(k - j + 1), j=0, k)])
          x(k + 2) = v(k + 1) / (k + 1)
          v(k + 2) = (force - 0.1_wp * v(k + 1) - self%stiffness(lane) * x(k + 1) - cube) / (k + 1)
          w(k + 2) = 0.1_wp * work / (k + 1)
          swap = slope
          slope = -frequency**2 * force / ((k + 1) * (k + 2))
          force = swap
        end do
      end associate
    end do
  end subroutine duffing_series

  subroutine oscillator_obstacle(self, obstacle)
    class(oscillator_series_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = ''
  end subroutine oscillator_obstacle

  subroutine prepare_oscillators(self, order)
    class(oscillator_series_t), intent(inout) :: self
    integer, intent(in) :: order

    if (order < 2) error stop 'nocdyn_series_problems: the order of a series is at least 2'
    if (.not. allocated(self%omega)) error stop 'nocdyn_series_problems: an oscillator needs a frequency'
  end subroutine prepare_oscillators

  subroutine oscillator_series(self, order, columns, t, y, status)
    class(oscillator_series_t), intent(inout) :: self
    integer, intent(in) :: order, columns
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)
    integer, intent(inout) :: status(self%lanes)
    integer :: k

    status = merge(evaluation_ok, status, t >= 0)
    do k = 0, order - 1
      y(:, 1, k + 1) = y(:, 2, k) / (k + 1)
      y(:, 2, k + 1) = -self%omega**2 * y(:, 1, k) / (k + 1)
    end do
  end subroutine oscillator_series

  pure function burst_problem(limit, answer) result(problem)
    real(wp), intent(in) :: limit(:)
    integer, intent(in) :: answer(:)
    type(burst_t) :: problem

    problem%lanes = size(limit)
    problem%states = 1
    allocate (problem%limit, source=limit)
    allocate (problem%answer, source=answer)
  end function burst_problem

  subroutine relaxation_obstacle(self, obstacle)
    class(relaxation_series_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = ''
  end subroutine relaxation_obstacle

  subroutine prepare_relaxation(self, order)
    class(relaxation_series_t), intent(inout) :: self
    integer, intent(in) :: order

    if (order < 2) error stop 'nocdyn_series_problems: the order must be at least 2'
  end subroutine prepare_relaxation

  subroutine relaxation_series(self, order, columns, t, y, status)
    class(relaxation_series_t), intent(inout) :: self
    integer, intent(in) :: order, columns
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)
    integer, intent(inout) :: status(self%lanes)
    real(wp) :: damping(0:order), product
    integer :: j, k, lane

    do lane = 1, self%lanes
      do k = 0, order - 1
        damping(k) = merge(1.0_wp, 0.0_wp, k == 0)
        product = 0.0_wp
        do j = 0, k
          damping(k) = damping(k) - y(lane, 1, j) * y(lane, 1, k - j)
        end do
        do j = 0, k
          product = product + damping(j) * y(lane, 2, k - j)
        end do
        y(lane, 1, k + 1) = y(lane, 2, k) / (k + 1)
        y(lane, 2, k + 1) = (self%mu(lane) * product - y(lane, 1, k)) / (k + 1)
      end do
    end do
    status = evaluation_ok
  end subroutine relaxation_series

  subroutine burst_derivative(self, t, y, dydt, status)
    class(burst_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    self%evaluations = self%evaluations + 1
    dydt(:, 1) = y(:, 1)**2
    where (y(:, 1) > self%limit .and. t >= 0) status = max(evaluation_ok, self%answer)
  end subroutine burst_derivative

  subroutine burst_jacobian(self, t, y, dfdy, dfdt, status)
    class(burst_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dfdy(:, 1) = 2 * y(:, 1)
    dfdt(:, 1) = 0.0_wp * t
    where (y(:, 1) > self%limit) status = max(evaluation_ok, self%answer)
  end subroutine burst_jacobian

  subroutine burst_obstacle(self, obstacle)
    class(burst_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = ''
  end subroutine burst_obstacle

  subroutine prepare_burst(self, order)
    class(burst_t), intent(inout) :: self
    integer, intent(in) :: order

    self%expansions = 0
    if (order < 2) error stop 'nocdyn_series_problems: the order of a series is at least 2'
  end subroutine prepare_burst

  subroutine burst_series(self, order, columns, t, y, status)
    class(burst_t), intent(inout) :: self
    integer, intent(in) :: order, columns
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)
    integer, intent(inout) :: status(self%lanes)
    integer :: j, k

    self%expansions = self%expansions + 1
    do k = 0, order - 1
      y(:, 1, k + 1) = 0.0_wp
      do j = 0, k
        y(:, 1, k + 1) = y(:, 1, k + 1) + y(:, 1, j) * y(:, 1, k - j)
      end do
      y(:, 1, k + 1) = y(:, 1, k + 1) / (k + 1)
    end do
    where (y(:, 1, 0) > self%limit .and. t >= 0)
      status = max(evaluation_ok, self%answer)
      y(:, 1, order) = merge(quiet_nan(), y(:, 1, order), self%answer == answer_nan)
    end where
  end subroutine burst_series

  !> A NaN whose creation and copies raise no exception.
  pure function quiet_nan() result(nan)
    use, intrinsic :: iso_fortran_env, only: int64
    real(wp) :: nan

    nan = transfer(int(z'7FF8000000000000', int64), nan)
  end function quiet_nan

end module nocdyn_series_problems
