!> Branches that no other one leads to, found by runs from scattered states.
!>
!> The values of the parameter and the states at the start are points of Sobol, as far from the steady state as four times the
!> largest motion that is known. A run settles, or decays for some periods: then its oscillation may be near to a motion on which
!> few runs settle. If the motion that Newton's method finds is on no known branch, its branch is followed in both directions.
module nocdyn_orbit_scatter
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: harmonic_basis_t, new_harmonic_basis
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_branch, only: follow_branch, start_walk
  use nocdyn_orbit_guess, only: find_settled_guess, find_steady_guess
  use nocdyn_orbit_points, only: branch_t, distance_between, interpolated, walk_t
  use nocdyn_orbit_problem, only: measured, orbit_problem_t
  use nocdyn_orbit_settings, only: orbit_settings_t, usual_periods
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_sobol_points, only: max_dimensions, sobol_points, sobol_points_t
  implicit none (type, external)
  private

  public :: find_high, find_isolated

  !> What the starts have found.
  type, public :: scatter_t
    integer :: tried = 0
    integer :: periodic = 0                  !! starts that have led to a periodic motion
    integer :: branches = 0                  !! isolated branches
  end type scatter_t

  real(wp), parameter :: spread_of_starts = 4.0_wp   ! as a multiple of the largest motion
  integer, parameter :: high_starts = 32             ! runs that look for the largest motion at one value
  real(wp), parameter :: high_scales(4) = [2.0_wp, 4.0_wp, 8.0_wp, 16.0_wp]   ! of their states, as multiples of the low motion
  integer, parameter :: shorter = 8                  ! lengths of runs, each half of the one before
  real(wp), parameter :: near = 0.3_wp               ! distance of motions that may be the same, as a share
  real(wp), parameter :: same = 1.0e-5_wp            ! distance of motions that are the same

contains

  !> Tries the starts and adds the branches that they find. Starts that fail do not count.
  subroutine find_isolated(input, settings, problem, branch, found)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    class(orbit_problem_t), intent(inout) :: problem
    type(branch_t), intent(inout) :: branch            !! with the points of the first branch; the others are added
    type(scatter_t), intent(out) :: found
    type(sobol_points_t) :: points
    type(orbit_settings_t) :: here
    type(walk_t) :: walk
    real(wp) :: largest(problem%periodic%machine%states), push(problem%periodic%machine%states)
    integer :: i, k
    logical :: is_periodic

    points = sobol_points(min(max_dimensions, size(push) + 1), 0)
    largest = largest_states(problem%periodic, branch)
    here = settings
    do i = 1, settings%starts
      if (settings%is_stopped()) return
      here%at = settings%from + points%coordinate(i, 1) * (settings%to - settings%from)
      push = 0.0_wp
      do k = 1, min(max_dimensions - 1, size(push))
        push(k) = spread_of_starts * (2.0_wp * points%coordinate(i, k + 1) - 1.0_wp) * largest(k)
      end do
      here%periods = usual_periods / 2**modulo(i, shorter)
      found%tried = found%tried + 1
      call settle_from(input, here, problem, push, walk, is_periodic)
      if (.not. is_periodic) cycle
      found%periodic = found%periodic + 1
      if (is_known(problem, walk, branch)) cycle
      found%branches = found%branches + 1
      call follow_both_ways(problem, here, walk%point%orbit, found%branches + 1, branch)
    end do
  end subroutine find_isolated

  !> The motion of the largest half range of a coordinate at the first value, of those on which runs from scattered states settle
  !> and the one near the steady state, if there is one.
  subroutine find_high(input, settings, problem, guess, found)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    class(orbit_problem_t), intent(inout) :: problem
    type(orbit_t), intent(inout) :: guess              !! in the steady state; then the largest motion
    type(scatter_t), intent(out) :: found
    type(sobol_points_t) :: points
    type(branch_t) :: known
    type(walk_t) :: walk
    type(error_t), allocatable :: error
    real(wp) :: half_range, largest(problem%periodic%machine%states), push(problem%periodic%machine%states)
    integer :: i, k
    logical :: has_begun, is_periodic

    allocate (known%points(0))
    half_range = 0.0_wp
    call start_walk(problem, settings, guess, walk, has_begun, error)
    is_periodic = .not. allocated(error)
    points = sobol_points(min(max_dimensions, size(push)), 0)
    do i = 0, high_starts
      if (settings%is_stopped()) return
      push = 0.0_wp
      if (i > 0) then
        do k = 1, min(max_dimensions, size(push))
          push(k) = high_scales(1 + modulo(i, size(high_scales))) * (2.0_wp * points%coordinate(i, k) - 1.0_wp) * largest(k)
        end do
        found%tried = found%tried + 1
      end if
      if (i > 0 .or. .not. is_periodic) call settle_from(input, settings, problem, push, walk, is_periodic)
      if (.not. is_periodic .and. i == 0) return
      if (.not. is_periodic) cycle
      if (i > 0) found%periodic = found%periodic + 1
      if (half_range_of(problem%periodic, walk%point%orbit) > half_range) then
        half_range = half_range_of(problem%periodic, walk%point%orbit)
        guess = walk%point%orbit
      end if
      if (i > 0) cycle
      call known%add(walk%point)
      largest = largest_states(problem%periodic, known)
    end do
  end subroutine find_high

  !> The largest half range of a coordinate [rad].
  real(wp) function half_range_of(periodic, orbit) result(half_range)
    type(periodic_machine_t), intent(in) :: periodic
    type(orbit_t), intent(in) :: orbit
    type(harmonic_basis_t) :: basis
    real(wp), allocatable :: values(:, :)
    integer :: c

    associate (harmonics => size(orbit%series, 1) / 2, f => periodic%machine%freedoms)
      basis = new_harmonic_basis(harmonics, 8 * (harmonics + 1))
      values = basis%values_of(orbit%series(:, :f))
      half_range = 0.5_wp * maxval([(maxval(values(:, c)) - minval(values(:, c)), c=1, f)])
    end associate
  end function half_range_of

  !> The largest oscillation of each state on known motions, [states].
  pure function largest_states(periodic, branch) result(largest)
    type(periodic_machine_t), intent(in) :: periodic
    type(branch_t), intent(in) :: branch
    real(wp) :: largest(periodic%machine%states)
    integer :: c, i

    largest = 0.0_wp
    associate (f => periodic%machine%freedoms)
      do i = 1, branch%count
        associate (orbit => branch%points(i)%orbit)
          do c = 1, size(orbit%series, 2)
            largest(f + c) = max(largest(f + c), maxval(abs(orbit%series(2:, c))))
            if (c <= f) largest(c) = max(largest(c), orbit%rate * maxval(abs(orbit%series(2:, c))))
          end do
        end associate
      end do
    end associate
  end function largest_states

  !> The motion on which a run settles, if it is periodic.
  subroutine settle_from(input, settings, problem, push, walk, is_periodic)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    class(orbit_problem_t), intent(inout) :: problem
    real(wp), intent(in) :: push(:)
    type(walk_t), intent(out) :: walk
    logical, intent(out) :: is_periodic
    type(error_t), allocatable :: error
    type(orbit_t) :: guess
    logical :: has_begun

    is_periodic = .false.
    associate (periodic => problem%periodic)
      guess%speed = periodic%floating_speed
      call find_steady_guess(input, settings, periodic, guess)
      call periodic%set_value(guess, error)
      if (.not. allocated(error)) call find_settled_guess(input, settings, periodic, guess, error, push)
    end associate
    if (.not. allocated(error)) call start_walk(problem, settings, guess, walk, has_begun, error)
    is_periodic = .not. allocated(error)
  end subroutine settle_from

  !> Whether a motion is on a known branch: Newton's method from between two of its points finds it.
  logical function is_known(problem, walk, branch)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(in) :: walk
    type(branch_t), intent(in) :: branch
    type(error_t), allocatable :: error
    type(orbit_t) :: other
    real(wp) :: row(size(walk%x)), x(size(walk%x))
    integer :: i, iterations
    logical :: has_converged

    is_known = .false.
    row = 0.0_wp
    row(size(row)) = 1.0_wp
    associate (orbit => walk%point%orbit, points => branch%points)
      do i = 2, branch%count
        if (points(i)%branch /= points(i - 1)%branch) cycle
        if ((orbit%value - points(i - 1)%orbit%value) * (orbit%value - points(i)%orbit%value) > 0) cycle
        if (.not. abs(points(i)%orbit%value - points(i - 1)%orbit%value) > 0) cycle
        if (distance_between(orbit, points(i - 1)%orbit, points(i)%orbit) > near) cycle
        other = orbit
        other%series = interpolated(orbit, points(i - 1)%orbit, points(i)%orbit)
        if (allocated(other%state)) deallocate (other%state)
        x = problem%put_together(other)
        call problem%correct(row, orbit%value, x, iterations, has_converged, error)
        if (allocated(error) .or. .not. has_converged) cycle
        is_known = measured(x - walk%x, walk%weights) < same
        if (is_known) return
      end do
    end associate
  end function is_known

  !> Follows a branch from a motion on it in both directions.
  subroutine follow_both_ways(problem, settings, start, number, branch)
    class(orbit_problem_t), intent(inout) :: problem
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_t), intent(in) :: start
    integer, intent(in) :: number              !! of the branch
    type(branch_t), intent(inout) :: branch
    type(branch_t) :: ahead, back
    type(orbit_settings_t) :: other
    type(error_t), allocatable :: error

    other = settings
    call follow_branch(problem, other, start, ahead, error)
    if (.not. ahead%is_closed) then
      other%ahead = -settings%ahead
      call follow_branch(problem, other, start, back, error)
      call branch%add_reversed(back, 2, number)
    end if
    call branch%add_branch(ahead, number)
  end subroutine follow_both_ways

end module nocdyn_orbit_scatter
