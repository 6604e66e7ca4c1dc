!> Harmonic oscillators x'' = -omega^2 x on lanes of different frequencies, and an observer of events and tracked functions.
module nocdyn_oscillators
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t, ranges_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: oscillators, watcher

  integer, parameter, public :: most_events = 100

  type, extends(system_t), public :: oscillators_t
    real(wp), allocatable :: omega(:)
  contains
    procedure :: derivative
    procedure :: jacobian
  end type oscillators_t

  !> The events are x = level(i) for each level, the tracked functions x, x', x^3. The event with the index `terminal` ends its
  !> lane.
  type, extends(observer_t), public :: watcher_t
    real(wp), allocatable :: level(:)
    integer :: terminal = 0
    integer, allocatable :: count(:)         !! events of each lane
    integer, allocatable :: event(:, :)      !! [most_events, lanes]
    real(wp), allocatable :: time(:, :)      !! of the events
    real(wp), allocatable :: x(:, :)         !! at the events
    integer, allocatable :: records(:)       !! number of output times of each lane
    real(wp), allocatable :: last_time(:)    !! of an output or an event of each lane
    logical :: in_order = .true.             !! whether outputs and events came in the order of their times
    type(ranges_t), allocatable :: ranges(:) !! of each lane
  contains
    procedure :: on_output
    procedure :: event_values
    procedure :: on_event
    procedure :: tracked_values
    procedure :: on_extremes
  end type watcher_t

contains

  pure function oscillators(omega) result(system)
    real(wp), intent(in) :: omega(:)
    type(oscillators_t) :: system

    system%lanes = size(omega)
    system%states = 2
    allocate (system%omega, source=omega)
  end function oscillators

  subroutine derivative(self, t, y, dydt, status)
    class(oscillators_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dydt(:, 1) = y(:, 2)
    dydt(:, 2) = -self%omega**2 * y(:, 1)
  end subroutine derivative

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(oscillators_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dfdy(:, :) = 0.0_wp
    dfdy(:, 2) = -self%omega**2
    dfdy(:, 3) = 1.0_wp
    dfdt(:, :) = 0.0_wp
  end subroutine jacobian

  !> An observer of the crossings of `level` in the given directions and of the tracked functions.
  pure function watcher(lanes, level, directions)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: level(:)
    integer, intent(in) :: directions(:)
    type(watcher_t) :: watcher

    allocate (watcher%level, source=level)
    allocate (watcher%directions, source=directions)
    watcher%tracked = 3
    allocate (watcher%count(lanes), watcher%records(lanes), watcher%event(most_events, lanes), source=0)
    allocate (watcher%time(most_events, lanes), watcher%x(most_events, lanes), source=0.0_wp)
    allocate (watcher%last_time(lanes), source=-huge(1.0_wp))
    allocate (watcher%ranges(lanes))
  end function watcher

  subroutine on_output(self, lane, t, y)
    class(watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%records(lane) = self%records(lane) + 1
    self%in_order = self%in_order .and. t >= self%last_time(lane)
    self%last_time(lane) = t
  end subroutine on_output

  subroutine event_values(self, lane, t, y, g)
    class(watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    g(:) = y(1) - self%level
  end subroutine event_values

  subroutine on_event(self, lane, event, t, y, is_terminal)
    class(watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: event
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    logical, intent(out) :: is_terminal

    self%in_order = self%in_order .and. t >= self%last_time(lane)
    self%last_time(lane) = t
    self%count(lane) = self%count(lane) + 1
    self%event(self%count(lane), lane) = event
    self%time(self%count(lane), lane) = t
    self%x(self%count(lane), lane) = y(1)
    is_terminal = event == self%terminal
  end subroutine on_event

  subroutine tracked_values(self, lane, t, y, values)
    class(watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: values(:)

    values(:) = [y(1), y(2), y(1)**3]
  end subroutine tracked_values

  subroutine on_extremes(self, lane, ranges)
    class(watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(ranges_t), intent(in) :: ranges

    self%ranges(lane) = ranges
  end subroutine on_extremes

end module nocdyn_oscillators
