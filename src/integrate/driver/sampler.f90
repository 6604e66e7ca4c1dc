!> An observer that stores the solution at the output times; extensions may add events.
module nocdyn_sampler
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t
  implicit none (type, external)
  private

  public :: sampler

  type, extends(observer_t), public :: sampler_t
    integer, allocatable :: count(:)       !! output times so far, [lanes]
    real(wp), allocatable :: t(:, :)       !! [times, lanes]
    real(wp), allocatable :: y(:, :, :)    !! [components, times, lanes]
  contains
    procedure :: on_output
  end type sampler_t

contains

  !> A sampler for `times` output times in every lane.
  pure function sampler(lanes, components, times)
    integer, intent(in) :: lanes, components, times
    type(sampler_t) :: sampler

    allocate (sampler%count(lanes), source=0)
    allocate (sampler%t(times, lanes), sampler%y(components, times, lanes), source=0.0_wp)
  end function sampler

  subroutine on_output(self, lane, t, y)
    class(sampler_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%count(lane) = self%count(lane) + 1
    self%t(self%count(lane), lane) = t
    self%y(:, self%count(lane), lane) = y
  end subroutine on_output

end module nocdyn_sampler
