!> An observer that stores all output times and states.
module nocdyn_recorder
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: recorder

  type, extends(observer_t), public :: recorder_t
    integer, allocatable :: count(:)         !! output times of each lane
    real(wp), allocatable :: t(:, :)         !! [lanes, times]
    real(wp), allocatable :: y(:, :, :)      !! [lanes, times, components]
    real(wp) :: stop_time = huge(1.0_wp)     !! stops the integration once the slowest lane has reached it
    integer :: questions = 0                 !! calls of `wants_stop`
  contains
    procedure :: on_output
    procedure :: wants_stop
  end type recorder_t

contains

  pure function recorder(system, times)
    class(system_t), intent(in) :: system
    integer, intent(in) :: times
    type(recorder_t) :: recorder

    allocate (recorder%count(system%lanes), source=0)
    allocate (recorder%t(system%lanes, times), source=0.0_wp)
    allocate (recorder%y(system%lanes, times, system%states + system%quadratures), source=0.0_wp)
  end function recorder

  subroutine on_output(self, lane, t, y)
    class(recorder_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%count(lane) = self%count(lane) + 1
    self%t(lane, self%count(lane)) = t
    self%y(lane, self%count(lane), :) = y
  end subroutine on_output

  function wants_stop(self, t)
    class(recorder_t), intent(inout) :: self
    real(wp), intent(in) :: t
    logical :: wants_stop

    self%questions = self%questions + 1
    wants_stop = t >= self%stop_time
  end function wants_stop

end module nocdyn_recorder
