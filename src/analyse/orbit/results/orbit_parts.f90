!> Parts of the branches of an orbit analysis: between special points the stability does not change, nor does the direction.
module nocdyn_orbit_parts
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_problem, only: orbit_point_t
  implicit none (type, external)
  private

  public :: find_parts, jump_direction, unstable_stretches

  !> A part of a branch without a change of its stability, nor of its direction.
  type, public :: part_t
    integer :: first = 1, last = 1   !! points
    logical :: is_stable = .true.
  end type part_t

contains

  !> The parts of the branch.
  pure subroutine find_parts(points, parts)
    type(orbit_point_t), intent(in) :: points(:)
    type(part_t), allocatable, intent(out) :: parts(:)
    integer :: i

    allocate (parts(0))
    if (size(points) == 0) return
    parts = [part_t(1, 1, points(1)%is_stable())]
    do i = 2, size(points)
      if (points(i)%branch /= points(i - 1)%branch) then
        parts = [parts, part_t(i, i, points(i)%is_stable())]
        cycle
      end if
      associate (last => parts(size(parts)))
        last%last = i
        if (last%last - last%first == 1 .and. points(last%first)%kind /= '') last%is_stable = points(i)%is_stable()
      end associate
      if (points(i)%kind == '' .or. i == size(points)) cycle
      if (points(i + 1)%branch == points(i)%branch) parts = [parts, part_t(i, i, points(i + 1)%is_stable())]
    end do
  end subroutine find_parts

  !> Unstable parts that follow one another on a branch as one.
  subroutine unstable_stretches(points, stretches)
    type(orbit_point_t), intent(in) :: points(:)
    type(part_t), allocatable, intent(out) :: stretches(:)
    type(part_t), allocatable :: parts(:)
    integer :: i
    logical :: goes_on

    call find_parts(points, parts)
    allocate (stretches(0))
    do i = 1, size(parts)
      if (parts(i)%is_stable) cycle
      goes_on = .false.
      if (i > 1) goes_on = .not. parts(i - 1)%is_stable .and. parts(i - 1)%last == parts(i)%first
      if (goes_on) stretches(size(stretches))%last = parts(i)%last
      if (.not. goes_on) stretches = [stretches, parts(i)]
    end do
  end subroutine unstable_stretches

  !> Where a slow change of the parameter leaves the motions at a fold: 1 a rising value does, -1 a falling one, 0 neither, as the
  !> motions on both sides of the fold are unstable.
  pure integer function jump_direction(points, number) result(direction)
    type(orbit_point_t), intent(in) :: points(:)   !! of branches
    integer, intent(in) :: number                  !! of the fold, between two other points of its branch

    direction = 0
    associate (before => points(number - 1), after => points(number + 1))
      if (before%is_stable()) direction = nint(sign(1.0_wp, before%direction))
      if (after%is_stable()) direction = -nint(sign(1.0_wp, after%direction))
    end associate
  end function jump_direction

end module nocdyn_orbit_parts
