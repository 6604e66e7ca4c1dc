!> Periodic motions at any value of the parameter, found between the points of branches.
module nocdyn_orbit_motions
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_analysis, only: orbit_analysis_t
  use nocdyn_orbit_points, only: add_multipliers, settle_at, walk_t
  use nocdyn_orbit_problem, only: orbit_point_t
  implicit none (type, external)
  private

  public :: find_motions, settle_between

  type, public :: motion_t
    type(orbit_point_t) :: point
    integer :: after = 0   !! the last point of its branch before it, or the one that it is
  end type motion_t

  real(wp), parameter :: same = 1.0e-12_wp   ! distance of values that are the same, as a share of the range

contains

  !> The motions of all branches at a value. Where Newton's method fails there is none.
  subroutine find_motions(analysis, value, motions)
    class(orbit_analysis_t), intent(inout) :: analysis
    real(wp), intent(in) :: value                         !! in the unit of the parameter
    type(motion_t), allocatable, intent(out) :: motions(:)
    type(error_t), allocatable :: error
    type(motion_t) :: one
    real(wp) :: least
    integer :: i

    allocate (motions(0))
    least = same * abs(analysis%settings%to - analysis%settings%from)
    do i = 1, analysis%branch%count
      one%after = i
      if (abs(analysis%branch%points(i)%orbit%value - value) <= least) then
        one%point = analysis%branch%points(i)
      else
        if (.not. is_between(analysis, i, value, least)) cycle
        call settle_between(analysis, i, value, one%point, error)
        if (allocated(error)) cycle
      end if
      motions = [motions, one]
    end do
  end subroutine find_motions

  !> Whether a value is between those of a point and the next one of its branch, and at neither.
  pure logical function is_between(analysis, number, value, least)
    class(orbit_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number          !! of the first point
    real(wp), intent(in) :: value, least   !! distance from the points

    is_between = .false.
    if (number == analysis%branch%count) return
    associate (first => analysis%branch%points(number), second => analysis%branch%points(number + 1))
      if (first%branch /= second%branch) return
      is_between = (first%orbit%value - value) * (second%orbit%value - value) < 0 .and. abs(second%orbit%value - value) > least
    end associate
  end function is_between

  !> The motion at a value between those of two points that follow one another.
  subroutine settle_between(analysis, number, value, point, error)
    class(orbit_analysis_t), intent(inout) :: analysis
    integer, intent(in) :: number                 !! of the first point
    real(wp), intent(in) :: value
    type(orbit_point_t), intent(out) :: point
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: before, next, middle

    associate (first => analysis%branch%points(number), second => analysis%branch%points(number + 1))
      if (first%harmonics >= second%harmonics) call analysis%problem%restore(first, analysis%problem%least_size(), error)
      if (first%harmonics < second%harmonics) call analysis%problem%restore(second, analysis%problem%least_size(), error)
      if (allocated(error)) return
      before = walk_at(first)
      next = walk_at(second)
      call settle_at(analysis%problem, before, next, value, middle, error)
      if (.not. allocated(error)) call add_multipliers(analysis%problem, analysis%settings, middle%point, error)
      if (allocated(error)) return
      point = middle%point
      point%branch = first%branch
    end associate

  contains

    type(walk_t) function walk_at(there) result(walk)
      type(orbit_point_t), intent(in) :: there

      walk%settings = analysis%settings
      walk%range = analysis%problem%range()
      walk%x = analysis%problem%put_together(there%orbit)
    end function walk_at

  end subroutine settle_between

end module nocdyn_orbit_motions
