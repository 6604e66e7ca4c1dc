!> The damped modes of a machine over its speed, each a branch that keeps its number.
module nocdyn_speed_modes
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  integer, parameter, public :: most_coordinates = 600   !! of a machine whose modes are computed at every speed

  !> The oscillating modes, in the order of their frequencies at the first speed; then those that begin at other speeds.
  type, public :: speed_modes_t
    integer :: modes = 0
    logical, allocatable :: exists(:, :)           !! whether a mode oscillates, [modes, points]
    real(wp), allocatable :: frequency(:, :)       !! of the damped oscillations, 0 where there is none [rad/s], [modes, points]
    real(wp), allocatable :: damping_ratio(:, :)   !! negative where they grow, [modes, points]
    real(wp), allocatable :: undamped(:, :)        !! frequency of the most similar undamped mode [rad/s], [modes, points];
                                                   !! 0 of a mode that is mostly an internal state
    real(wp), allocatable :: divergence(:)         !! negative where a negative stiffness drives a motion apart [rad/s], [points]
    integer, allocatable :: internal(:)            !! the internal state that a mode mostly is, or 0, [modes]
    logical, allocatable :: is_electrical(:)       !! whether that is a current or a flux, [modes]
    real(wp), allocatable :: shape(:, :)           !! angles of the bodies where a mode begins, the largest 1, [bodies, modes]
    complex(wp), allocatable :: twists(:, :)       !! of all elements there, in any scale, [elements, modes]
    logical :: is_constant = .true.                !! whether all points have the same frequencies
  end type speed_modes_t

end module nocdyn_speed_modes
