!> One swing of each pendulum, forth and back: its period and its highest speed.
module swings
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: integration_stopped, solver_status_t
  use nocdyn_ensemble, only: ensemble_t
  use nocdyn_observer, only: event_falling, observer_t, ranges_t
  use nocdyn_system, only: system_t
  use pendulum, only: pendulum_t
  implicit none (type, external)
  private

  public :: swing_watcher, swing_queue

  !> Ends a lane where the speed falls through zero, and tracks the speed for its extremes.
  type, extends(observer_t), public :: swing_watcher_t
    type(ranges_t), allocatable :: ranges(:)   !! of the last variant in each lane
  contains
    procedure :: on_output
    procedure :: event_values
    procedure :: on_event
    procedure :: tracked_values
    procedure :: on_extremes
  end type swing_watcher_t

  !> Variant i starts at rest. Results that are not found stay 0.
  type, extends(ensemble_t), public :: swing_queue_t
    real(wp), allocatable :: amplitude(:)      !! [rad], [variants]
    real(wp), allocatable :: omega_0(:)
    real(wp), allocatable :: period(:), highest_speed(:), integral(:)
    type(swing_watcher_t), pointer, private :: watcher => null()
    integer, allocatable, private :: variant(:)   !! number of the variant in each lane
    integer, private :: begun = 0
  contains
    procedure :: next
    procedure :: finish
  end type swing_queue_t

contains

  function swing_watcher(lanes) result(watcher)
    integer, intent(in) :: lanes
    type(swing_watcher_t) :: watcher

    allocate (watcher%directions, source=[event_falling])
    watcher%tracked = 1
    allocate (watcher%ranges(lanes))
  end function swing_watcher

  !> The states at the requested times are not needed.
  subroutine on_output(self, lane, t, y)
    class(swing_watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
  end subroutine on_output

  subroutine event_values(self, lane, t, y, g)
    class(swing_watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    g(1) = y(2)
  end subroutine event_values

  subroutine on_event(self, lane, event, t, y, is_terminal)
    class(swing_watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: event
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    logical, intent(out) :: is_terminal

    is_terminal = .true.
  end subroutine on_event

  subroutine tracked_values(self, lane, t, y, values)
    class(swing_watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: values(:)

    values(1) = y(2)
  end subroutine tracked_values

  subroutine on_extremes(self, lane, ranges)
    class(swing_watcher_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(ranges_t), intent(in) :: ranges

    self%ranges(lane) = ranges
  end subroutine on_extremes

  function swing_queue(amplitude, omega_0, lanes, watcher) result(ensemble)
    real(wp), intent(in) :: amplitude(:), omega_0(:)
    integer, intent(in) :: lanes
    type(swing_watcher_t), target, intent(in) :: watcher
    type(swing_queue_t) :: ensemble

    allocate (ensemble%amplitude, source=amplitude)
    allocate (ensemble%omega_0, source=omega_0)
    associate (variants => size(amplitude))
      allocate (ensemble%period(variants), ensemble%highest_speed(variants), ensemble%integral(variants), source=0.0_wp)
    end associate
    allocate (ensemble%variant(lanes), source=0)
    ensemble%watcher => watcher
  end function swing_queue

  subroutine next(self, system, lane, t, y, found)
    class(swing_queue_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: found

    found = self%begun < size(self%amplitude)
    if (.not. found) return
    self%begun = self%begun + 1
    self%variant(lane) = self%begun
    y(:) = [self%amplitude(self%begun), 0.0_wp, 0.0_wp]
    select type (system)
    type is (pendulum_t)
      system%omega_0(lane) = self%omega_0(self%begun)
    class default
      error stop 'swings: the system must be a block of pendulums'
    end select
  end subroutine next

  subroutine finish(self, lane, y, solver_status)
    class(swing_queue_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(solver_status_t), intent(in) :: solver_status

    if (solver_status%code(lane) /= integration_stopped) return
    associate (variant => self%variant(lane))
      self%period(variant) = solver_status%t(lane)
      self%highest_speed(variant) = self%watcher%ranges(lane)%highest(1)
      self%integral(variant) = y(3)
    end associate
  end subroutine finish

end module swings
