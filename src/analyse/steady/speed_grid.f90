!> Speeds at which laws are looked at: they grow geometrically on both sides of zero, and are dense about those where a law bends.
module nocdyn_speed_grid
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: sort_ascending
  implicit none (type, external)
  private

  public :: new_speed_grid

  integer, parameter :: decades = 6            ! from 1e-6 to 1e6 rad/s, in both directions
  integer, parameter :: knee_decades = 8       ! distances from a knee, down to 1e-8 of its speed
  integer, parameter :: knee_points = 6        ! per decade
  integer, parameter :: most_dense_knees = 30  ! of more, only the knees themselves are added

contains

  !> The grid, ascending.
  function new_speed_grid(points_per_decade, unit, knees) result(grid)
    integer, intent(in) :: points_per_decade
    real(wp), intent(in) :: unit       !! the speed that is 1 rad/s of the fastest body [rad/s]
    real(wp), intent(in) :: knees(:)   !! [rad/s]
    real(wp), allocatable :: grid(:)
    real(wp) :: nearness(knee_decades * knee_points), steps(2 * decades * points_per_decade + 1)
    integer :: i

    steps = unit * [(10.0_wp**(real(i, wp) / points_per_decade), i=-decades * points_per_decade, decades * points_per_decade)]
    allocate (grid, source=[-steps, 0.0_wp, steps, knees])
    if (size(knees) <= most_dense_knees) then
      nearness = [(10.0_wp**(-real(i, wp) / knee_points), i=1, size(nearness))]
      do i = 1, size(knees)
        grid = [grid, knees(i) * (1.0_wp - nearness), knees(i) * (1.0_wp + nearness)]
      end do
    end if
    call sort_ascending(grid)
    grid = pack(grid, [.true., grid(2:) > grid(:size(grid) - 1)])
  end function new_speed_grid

end module nocdyn_speed_grid
