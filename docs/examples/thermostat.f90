!> A room of temperature y(1) [C] that a heater warms: on below 19 C, off above 21 C.
module room
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: heated_room

  real(wp), parameter, public :: lowest = 19.0_wp, highest = 21.0_wp
  real(wp), parameter, public :: outside = 5.0_wp, heating = 30.0_wp, slowness = 3.0_wp   !! [C], [C], [h]

  !> A system with two branches in each lane: the heater is on or off.
  type, extends(system_t), public :: room_t
    logical, allocatable :: is_on(:)
  contains
    procedure :: derivative
    procedure :: jacobian
    procedure :: start_lane
    procedure :: indicator_values
    procedure :: change_branch
    procedure :: switch_name
  end type room_t

contains

  function heated_room(lanes) result(room)
    integer, intent(in) :: lanes
    type(room_t) :: room

    room%lanes = lanes
    room%states = 1
    room%switches = 1
    allocate (room%is_on(lanes), source=.false.)
  end function heated_room

  subroutine derivative(self, t, y, dydt, status)
    class(room_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dydt(:, 1) = (outside + merge(heating, 0.0_wp, self%is_on) - y(:, 1)) / slowness
  end subroutine derivative

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(room_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    dfdy(:, :) = -1 / slowness
    dfdt(:, :) = 0.0_wp
  end subroutine jacobian

  subroutine start_lane(self, lane, t, y)
    class(room_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%is_on(lane) = y(1) < highest
  end subroutine start_lane

  subroutine indicator_values(self, lane, t, y, g)
    class(room_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    g(1) = merge(highest - y(1), y(1) - lowest, self%is_on(lane))
  end subroutine indicator_values

  subroutine change_branch(self, lane, which, t, y)
    class(room_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)

    self%is_on(lane) = .not. self%is_on(lane)
  end subroutine change_branch

  function switch_name(self, which) result(name)
    class(room_t), intent(in) :: self
    integer, intent(in) :: which
    character(len=:), allocatable :: name

    name = 'heater'
  end function switch_name

end module room

!> Prints the temperature after a day, and how often the heater was switched.
program thermostat
  use nocdyn_errors, only: error_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: failure_message, integration_done, solver_status_t
  use nocdyn_observer, only: observer_t
  use room, only: heated_room, heating, highest, lowest, outside, room_t, slowness
  implicit none (type, external)
  real(wp), parameter :: day = 24.0_wp, start = 15.0_wp, hot = outside + heating
  type(integration_settings_t), parameter :: settings = integration_settings_t(rtol=1.0e-11_wp, atol=1.0e-11_wp)
  type(room_t) :: system
  type(observer_t) :: nobody
  type(solver_status_t) :: solver_status
  type(error_t), allocatable :: error
  real(wp) :: y(1, 1), first, cooling, warming, rest

  system = heated_room(1)
  y = start
  call integrate(system, settings, [0.0_wp, day], y, nobody, solver_status, error)
  if (allocated(error)) error stop error%message
  if (solver_status%code(1) /= integration_done) error stop failure_message(solver_status, 1, system, settings%rtol, &
                                                                            settings%atol)
  print '("after a day", f14.9, " C, the heater was switched ", i0, " times in ", i0, " steps")', &
    y, solver_status%crossings(1), solver_status%accepted(1)

  first = slowness * log((hot - start) / (hot - highest))
  cooling = slowness * log((highest - outside) / (lowest - outside))
  warming = slowness * log((hot - lowest) / (hot - highest))
  rest = modulo(day - first, cooling + warming)
  if (rest < cooling) then
    rest = outside + (highest - outside) * exp(-rest / slowness)
  else
    rest = hot - (hot - lowest) * exp(-(rest - cooling) / slowness)
  end if
  print '("exact      ", f14.9, " C")', rest
end program thermostat
