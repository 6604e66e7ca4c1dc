!> How a machine is looked at: over the time, or in a steady state.
module nocdyn_steady_views
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  !> By default over the time.
  type, public :: steady_view_t
    logical :: is_steady = .false.        !! whether means stand for ratios that depend on the position
    logical :: locks_joints = .false.     !! whether clutches and freewheels are locked or open then
    logical :: sets_speed = .false.       !! whether an analysis sets the speed in place of a drive
    real(wp) :: at = huge(1.0_wp)         !! the time at which joints are so [s]
    logical, allocatable :: overruns(:)   !! freewheels that are open then, [groups of the input]; not allocated: none
  end type steady_view_t

end module nocdyn_steady_views
