!> Systems with branches and solutions in closed form: an oscillator with play, switches at given times, a relay.
module nocdyn_switching_systems
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: evaluation_fatal, system_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: play_problem, play_solution, clock_problem, relay_problem

  !> x'' = -ground x - contact (|x| - edge)+ sign(x), [x, x'], and the work of the contact as a quadrature. Branches: 0 free,
  !> 1 in contact above, -1 below.
  type, extends(system_t), public :: play_t
    real(wp), allocatable :: ground(:), contact(:), edge(:)
    integer, allocatable :: branch(:)
  contains
    procedure :: derivative => play_derivative
    procedure :: jacobian => play_jacobian
    procedure :: start_lane => play_enter
    procedure :: indicator_values => play_values
    procedure :: block_indicators => play_block_values
    procedure :: change_branch => play_cross
    procedure :: switch_name => play_name
  end type play_t

  !> x' = n - rate x, where n is the number of switching times of the lane before t; one switch for each.
  type, extends(system_t), public :: clock_t
    real(wp), allocatable :: time(:, :)       !! [switches, lanes]
    real(wp) :: rate = 0.0_wp
    integer :: refused = huge(1)              !! after so many switching times the evaluation fails
    logical, allocatable :: passed(:, :)
    integer, allocatable :: calls(:)          !! calls of `change_branch`, [switches]
    integer :: looks = 0                      !! calls of `indicator_values`
  contains
    procedure :: derivative => clock_derivative
    procedure :: jacobian => clock_jacobian
    procedure :: start_lane => clock_enter
    procedure :: indicator_values => clock_values
    procedure :: change_branch => clock_cross
  end type clock_t

  !> x' = -1 above zero, 1 below: at zero the solution cannot continue.
  type, extends(system_t), public :: relay_t
    real(wp) :: overlap = 0.0_wp              !! of the branches
    real(wp), allocatable :: side(:)
  contains
    procedure :: derivative => relay_derivative
    procedure :: jacobian => relay_jacobian
    procedure :: start_lane => relay_enter
    procedure :: indicator_values => relay_values
    procedure :: change_branch => relay_cross
  end type relay_t

  real(wp), parameter :: overlap = 1.0e-14_wp   ! of the branches of `play_t`, relative to the edge

contains

  pure function play_problem(ground, contact, edge) result(problem)
    real(wp), intent(in) :: ground(:), contact(:), edge(:)
    type(play_t) :: problem

    problem%lanes = size(edge)
    problem%states = 2
    problem%quadratures = 1
    problem%switches = 2
    allocate (problem%ground, source=ground)
    allocate (problem%contact, source=contact)
    allocate (problem%edge, source=edge)
    allocate (problem%branch(size(edge)), source=0)
  end function play_problem

  !> x(t) and x'(t) from x = 0 with the velocity v: an odd function of period 4 q, symmetric about q, composed of the free motion
  !> and of the contact.
  elemental subroutine play_solution(ground, contact, edge, v, t, x, x_dot)
    real(wp), intent(in) :: ground, contact, edge, v, t
    real(wp), intent(out) :: x, x_dot
    real(wp) :: omega, stiff, rest, swing, t_edge, v_edge, q, phase, sign_x, sign_v

    omega = sqrt(ground)
    stiff = sqrt(ground + contact)
    t_edge = edge / v
    if (ground > 0) t_edge = asin(min(1.0_wp, edge * omega / v)) / omega
    v_edge = sqrt(max(0.0_wp, v**2 - ground * edge**2))
    rest = contact * edge / (ground + contact)
    swing = hypot(edge - rest, v_edge / stiff)
    q = t_edge + atan2(v_edge / stiff, edge - rest) / stiff
    if (v_edge <= 0) q = 0.5_wp * acos(-1.0_wp) / omega
    phase = modulo(t, 4 * q)
    sign_x = merge(1.0_wp, -1.0_wp, phase < 2 * q)
    phase = modulo(phase, 2 * q)
    sign_v = merge(sign_x, -sign_x, phase < q)
    phase = min(phase, 2 * q - phase)
    if (phase > t_edge) then
      x = sign_x * (rest + swing * cos(stiff * (q - phase)))
      x_dot = sign_v * swing * stiff * sin(stiff * (q - phase))
    else if (ground > 0) then
      x = sign_x * v / omega * sin(omega * phase)
      x_dot = sign_v * v * cos(omega * phase)
    else
      x = sign_x * v * phase
      x_dot = sign_v * v
    end if
  end subroutine play_solution

  subroutine play_derivative(self, t, y, dydt, status)
    class(play_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    real(wp) :: force
    integer :: lane

    do lane = 1, self%lanes
      force = -abs(self%branch(lane)) * self%contact(lane) * (y(lane, 1) - self%branch(lane) * self%edge(lane))
      dydt(lane, 1) = y(lane, 2)
      dydt(lane, 2) = force - self%ground(lane) * y(lane, 1)
      dydt(lane, 3) = force * y(lane, 2)
    end do
  end subroutine play_derivative

  subroutine play_jacobian(self, t, y, dfdy, dfdt, status)
    class(play_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    real(wp) :: stiffness
    integer :: lane

    do lane = 1, self%lanes
      stiffness = abs(self%branch(lane)) * self%contact(lane)
      dfdy(lane, :) = [0.0_wp, -stiffness - self%ground(lane), -stiffness * y(lane, 2), &
                       1.0_wp, 0.0_wp, -stiffness * (y(lane, 1) - self%branch(lane) * self%edge(lane))]
      dfdt(lane, :) = 0.0_wp
    end do
  end subroutine play_jacobian

  subroutine play_enter(self, lane, t, y)
    class(play_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%branch(lane) = merge(1, 0, y(1) > self%edge(lane)) - merge(1, 0, y(1) < -self%edge(lane))
  end subroutine play_enter

  subroutine play_values(self, lane, t, y, g)
    class(play_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    associate (edge => self%edge(lane), branch => self%branch(lane))
      g(1) = merge(y(1) - edge, edge - y(1), branch == 1)
      g(2) = merge(-edge - y(1), edge + y(1), branch == -1)
      if (branch == 1) g(2) = edge
      if (branch == -1) g(1) = edge
      g(:) = g + overlap * edge
    end associate
  end subroutine play_values

  subroutine play_block_values(self, columns, t, y, g)
    class(play_t), intent(inout) :: self
    integer, intent(in) :: columns
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, columns)
    real(wp), intent(inout) :: g(self%lanes, self%switches)
    real(wp) :: one_g(2), one_y(3)
    integer :: lane

    do lane = 1, self%lanes
      one_y = y(lane, :3)
      call self%indicator_values(lane, t(lane), one_y, one_g)
      g(lane, :) = one_g
    end do
  end subroutine play_block_values

  subroutine play_cross(self, lane, which, t, y)
    class(play_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)

    self%branch(lane) = merge(3 - 2 * which, 0, self%branch(lane) == 0)
  end subroutine play_cross

  function play_name(self, which) result(name)
    class(play_t), intent(in) :: self
    integer, intent(in) :: which
    character(len=:), allocatable :: name

    name = 'edge ' // to_text(which)
    if (which > self%switches) error stop 'nocdyn_switching_systems: there are two edges'
  end function play_name

  pure function clock_problem(time) result(problem)
    real(wp), intent(in) :: time(:, :)   !! [switches, lanes]
    type(clock_t) :: problem

    problem%lanes = size(time, 2)
    problem%states = 1
    problem%switches = size(time, 1)
    allocate (problem%time, source=time)
    allocate (problem%passed(size(time, 1), size(time, 2)), source=.false.)
    allocate (problem%calls(size(time, 1)), source=0)
  end function clock_problem

  subroutine clock_derivative(self, t, y, dydt, status)
    class(clock_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dydt(:, 1) = count(self%passed, dim=1) - self%rate * y(:, 1)
    where (count(self%passed, dim=1) >= self%refused) status = evaluation_fatal
  end subroutine clock_derivative

  subroutine clock_jacobian(self, t, y, dfdy, dfdt, status)
    class(clock_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dfdy(:, :) = -self%rate
    dfdt(:, :) = 0.0_wp
  end subroutine clock_jacobian

  subroutine clock_enter(self, lane, t, y)
    class(clock_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%passed(:, lane) = .false.
  end subroutine clock_enter

  subroutine clock_values(self, lane, t, y, g)
    class(clock_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    g(:) = merge(1.0_wp, self%time(:, lane) - t, self%passed(:, lane))
    self%looks = self%looks + 1
  end subroutine clock_values

  subroutine clock_cross(self, lane, which, t, y)
    class(clock_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)

    self%passed(which, lane) = .true.
    self%calls(which) = self%calls(which) + 1
  end subroutine clock_cross

  pure function relay_problem(lanes, overlap) result(problem)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: overlap
    type(relay_t) :: problem

    problem%lanes = lanes
    problem%states = 1
    problem%switches = 1
    problem%overlap = overlap
    allocate (problem%side(lanes), source=1.0_wp)
  end function relay_problem

  subroutine relay_derivative(self, t, y, dydt, status)
    class(relay_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dydt(:, 1) = -self%side
  end subroutine relay_derivative

  subroutine relay_jacobian(self, t, y, dfdy, dfdt, status)
    class(relay_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dfdy(:, :) = 0.0_wp
    dfdt(:, :) = 0.0_wp
  end subroutine relay_jacobian

  subroutine relay_enter(self, lane, t, y)
    class(relay_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%side(lane) = sign(1.0_wp, y(1))
  end subroutine relay_enter

  subroutine relay_values(self, lane, t, y, g)
    class(relay_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    g(1) = self%side(lane) * y(1) + self%overlap
  end subroutine relay_values

  subroutine relay_cross(self, lane, which, t, y)
    class(relay_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)

    self%side(lane) = -self%side(lane)
  end subroutine relay_cross

end module nocdyn_switching_systems
