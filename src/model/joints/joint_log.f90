!> The events of joints in a motion: when they locked, and when they began to slip.
module nocdyn_joint_log
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_joint_log

  !> A joint that has locked or begun to slip.
  type, public :: joint_event_t
    real(wp) :: time = 0.0_wp     !! [s]
    integer :: joint = 0
    integer :: from = 0, to = 0   !! modes
    real(wp) :: slip = 0.0_wp     !! speed of the first body minus speed of the second one, before the event [rad/s]
    real(wp) :: torque = 0.0_wp   !! moment after the event [N m]
    real(wp) :: impulse = 0.0_wp  !! of an impact [N m s]
  end type joint_event_t

  type, public :: joint_log_t
    type(joint_event_t), allocatable :: event(:)   !! the first `count` are in use
    integer :: count = 0
  contains
    procedure :: add
  end type joint_log_t

contains

  !> A log without events, with room for some.
  type(joint_log_t) function new_joint_log() result(self)

    allocate (self%event(16))
  end function new_joint_log

  !> Adds an event.
  subroutine add(self, event)
    class(joint_log_t), intent(inout) :: self
    type(joint_event_t), intent(in) :: event
    type(joint_event_t), allocatable :: longer(:)

    if (self%count == size(self%event)) then
      allocate (longer(2 * self%count))
      longer(:self%count) = self%event
      call move_alloc(longer, self%event)
    end if
    self%count = self%count + 1
    self%event(self%count) = event
  end subroutine add

end module nocdyn_joint_log
