!> Other branches that leave a branch of periodic motions: of twice the period at period doublings, of the same one at branch
!> points, and from those again.
!>
!> At such a point the equations have a second direction in which nothing resists. The first motion of the other branch is found
!> by Newton's method in a plane across this direction, a little off the point.
module nocdyn_branch_switching
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: padded_series
  use nocdyn_harmonic_problem, only: even_harmonics, harmonic_problem_t, odd_harmonics
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_branch, only: follow_walk
  use nocdyn_orbit_corrector, only: find_null_direction
  use nocdyn_orbit_points, only: add_multipliers, branch_t, complete_point, walk_t
  use nocdyn_orbit_problem, only: branch_point, doubling, measured, orbit_point_t
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_periodic_machine, only: orbit_t
  implicit none (type, external)
  private

  public :: follow_switches

  integer, parameter :: most_doublings = 8     ! times the period of the first branch
  real(wp), parameter :: off = 0.02_wp         ! of the first motion from the point, as a share of the motion
  integer, parameter :: trials = 4             ! each a quarter as far off

contains

  !> Follows the branches that leave the known ones, and those that leave them.
  subroutine follow_switches(problem, settings, branch)
    class(harmonic_problem_t), intent(in) :: problem      !! of the first branch
    type(orbit_settings_t), intent(in) :: settings
    type(branch_t), intent(inout) :: branch              !! all known branches, gets the others
    integer :: i

    i = 1
    do while (i < branch%count - 1)   ! the count grows
      i = i + 1
      if (branch%points(i)%kind == branch_point) call leave_branch(problem, settings, i, branch)
      if (branch%points(i)%kind /= doubling) cycle
      if (2 * branch%points(i)%orbit%subharmonic > most_doublings * problem%periodic%subharmonic) cycle
      call double_period(problem, settings, i, branch)
    end do
  end subroutine follow_switches

  !> Follows the branch of twice the period from a period doubling, unless one that is known ends there.
  subroutine double_period(problem, settings, place, branch)
    class(harmonic_problem_t), intent(in) :: problem
    type(orbit_settings_t), intent(in) :: settings
    integer, intent(in) :: place   !! of the special point
    type(branch_t), intent(inout) :: branch
    class(harmonic_problem_t), allocatable :: twice
    type(error_t), allocatable :: error
    type(branch_t) :: found
    type(walk_t) :: walk
    real(wp), allocatable :: secant(:), x(:)
    integer :: number
    logical :: is_found

    associate (points => branch%points(place - 1:place + 1))
      allocate (twice, source=problem)
      call twice%set_subharmonic(2 * points(2)%orbit%subharmonic)
      number = branch_that_ends_at(points(2)%orbit, twice%periodic%subharmonic, branch, problem%range())
      points(2)%leads_to = number
      if (number > 0) return
      twice%vanishing = odd_harmonics
      twice%harmonics = 2 * problem%harmonics
      call twice%begin(error)
      if (.not. allocated(error)) then
        call twice%equations%set_harmonics(max(twice%equations%basis%harmonics, 2 * points(2)%harmonics), error)
      end if
      if (allocated(error)) return
      x = twice%put_together(with_twice_the_period(points(2)%orbit))
      secant = twice%put_together(with_twice_the_period(points(3)%orbit)) - &
               twice%put_together(with_twice_the_period(points(1)%orbit))
      call twice%keep_phase(with_twice_the_period(points(2)%orbit))
    end associate
    call step_off(twice, settings, secant, 1.0_wp, x, walk, is_found)
    if (.not. is_found) return
    call follow_walk(twice, walk, found, error)
    if (allocated(error)) return
    number = branch%next_number()
    branch%points(place)%leads_to = number
    call branch%add_branch(found, number)
  end subroutine double_period

  !> Follows the other branch of a branch point to both sides, unless one that is known ends there.
  subroutine leave_branch(problem, settings, place, branch)
    class(harmonic_problem_t), intent(in) :: problem
    type(orbit_settings_t), intent(in) :: settings
    integer, intent(in) :: place   !! of the special point
    type(branch_t), intent(inout) :: branch
    class(harmonic_problem_t), allocatable :: other
    type(error_t), allocatable :: error
    type(branch_t) :: sides(2)
    type(walk_t) :: walk
    real(wp), allocatable :: secant(:), x(:)
    integer :: i, number
    logical :: is_found

    associate (points => branch%points(place - 1:place + 1))
      if (points(2)%harmonics == 0) return   ! of steady states
      allocate (other, source=problem)
      call other%set_subharmonic(points(2)%orbit%subharmonic)
      other%vanishing = merge(even_harmonics, 0, is_symmetric(points(2)%orbit))
      if (other%vanishing == even_harmonics) then
        number = branch_that_ends_at(points(2)%orbit, points(2)%orbit%subharmonic, branch, problem%range())
        points(2)%leads_to = number
        if (number > 0) return
      end if
      call other%equations%set_harmonics(points(2)%harmonics, error)
      if (allocated(error)) return
      x = other%put_together(points(2)%orbit)
      secant = other%put_together(points(3)%orbit) - other%put_together(points(1)%orbit)
      call other%keep_phase(points(2)%orbit)
    end associate
    do i = 1, 2
      allocate (sides(i)%points(0))
      call step_off(other, settings, secant, 3.0_wp - 2.0_wp * i, x, walk, is_found)
      if (is_found) call follow_walk(other, walk, sides(i), error)
      if (allocated(error)) return
      if (sides(i)%is_closed .or. sides(i)%is_back) exit
      call other%equations%set_harmonics(branch%points(place)%harmonics, error)
      if (allocated(error)) return
    end do
    if (sides(1)%count == 0) return
    number = branch%next_number()
    branch%points(place)%leads_to = number
    call branch%add_reversed(sides(2), 1, number)
    call branch%add_branch(sides(1), number)
  end subroutine leave_branch

  !> A motion a little off a point, along the second direction in which nothing resists, and the walk away from the point.
  subroutine step_off(problem, settings, secant, side, x, walk, is_found)
    class(harmonic_problem_t), intent(inout) :: problem
    type(orbit_settings_t), intent(in) :: settings
    real(wp), intent(in) :: secant(:)   !! along the known branch
    real(wp), intent(in) :: side        !! 1 or -1
    real(wp), intent(in) :: x(:)        !! the unknowns of the point
    type(walk_t), intent(out) :: walk
    logical, intent(out) :: is_found
    type(error_t), allocatable :: error
    real(wp), dimension(size(x)) :: direction, row, weights
    real(wp) :: distance
    integer :: i, iterations

    is_found = .false.
    weights = problem%weights_of(x)
    row = weights**2 * secant / measured(secant, weights)
    call find_null_direction(problem%equations, problem%range(), row, x, direction, error)
    if (allocated(error)) return
    if (problem%vanishing == odd_harmonics) call problem%keep_vanishing(direction)
    direction = side * direction / measured(direction, weights)
    row = weights**2 * direction
    distance = off
    do i = 1, trials
      walk%x = x + distance * direction
      call problem%correct(row, dot_product(row, walk%x), walk%x, iterations, is_found, error)
      if (allocated(error)) return
      is_found = is_found .and. measured(walk%x - x, weights) < 2 * distance
      if (is_found) exit
      distance = 0.25_wp * distance
    end do
    if (.not. is_found) return
    walk%settings = settings
    walk%range = problem%range()
    call complete_point(problem, walk, error)
    if (.not. allocated(error)) call add_multipliers(problem, settings, walk%point, error)
    is_found = .not. allocated(error)
  end subroutine step_off

  !> The branch of a subharmonic whose first or last point is next to a motion, 0 if there is none.
  pure integer function branch_that_ends_at(orbit, subharmonic, branch, range) result(number)
    type(orbit_t), intent(in) :: orbit
    integer, intent(in) :: subharmonic
    type(branch_t), intent(in) :: branch
    real(wp), intent(in) :: range
    real(wp), parameter :: near = 0.02_wp, alike = 0.2_wp   ! of the range, of the motion
    type(orbit_t) :: here
    integer :: i

    number = 0
    here = orbit
    if (subharmonic > orbit%subharmonic) here = with_twice_the_period(orbit)
    do i = 2, branch%count
      associate (point => branch%points(i))
        if (point%orbit%subharmonic /= subharmonic .or. point%branch == 1) cycle
        if (i < branch%count) then
          if (branch%points(i + 1)%branch == point%branch) cycle
        end if
        if (abs(point%orbit%value - orbit%value) > near * range) cycle
        associate (other => padded_series(point%orbit%series, size(here%series, 1)))
          if (norm2(other(2:, :) - here%series(2:, :)) < alike * norm2(here%series(2:, :))) number = point%branch
        end associate
      end associate
    end do
  end function branch_that_ends_at

  !> A motion as one of twice the period.
  pure type(orbit_t) function with_twice_the_period(orbit) result(twice)
    type(orbit_t), intent(in) :: orbit
    integer :: k

    twice = orbit
    twice%rate = 0.5_wp * orbit%rate
    twice%subharmonic = 2 * orbit%subharmonic
    if (allocated(twice%series)) deallocate (twice%series)
    allocate (twice%series(2 * size(orbit%series, 1) - 1, size(orbit%series, 2)), source=0.0_wp)
    twice%series(1, :) = orbit%series(1, :)
    do k = 1, size(orbit%series, 1) / 2
      twice%series(4 * k:4 * k + 1, :) = orbit%series(2 * k:2 * k + 1, :)
    end do
  end function with_twice_the_period

  !> Whether a motion has no even harmonics: its second half is the first one with the opposite sign.
  pure logical function is_symmetric(orbit)
    type(orbit_t), intent(in) :: orbit
    real(wp), parameter :: none = 1.0e-6_wp
    integer :: k

    is_symmetric = .true.
    do k = 2, size(orbit%series, 1) / 2, 2
      is_symmetric = is_symmetric .and. norm2(orbit%series(2 * k:2 * k + 1, :)) <= none * norm2(orbit%series(2:, :))
    end do
  end function is_symmetric

end module nocdyn_branch_switching
