!> A branch of periodic motions, through folds, until it leaves the range of its parameter.
!>
!> Pseudo-arclength continuation: from a point along the tangent, then back to the branch in the plane across it.
module nocdyn_orbit_branch
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_checkpoints, only: keep_end, keep_step, recall_branch
  use nocdyn_orbit_points, only: adapt_resolution, add_multipliers, branch_t, complete_point, distance_between, settle_at, &
    take_step, walk_t
  use nocdyn_orbit_problem, only: measured, orbit_point_t, orbit_problem_t
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_orbit_specials, only: add_between
  use nocdyn_periodic_machine, only: orbit_t
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: follow_branch, follow_walk, start_walk

  real(wp), parameter :: first_step = 0.01_wp, longest_step = 0.06_wp, shortest_step = 1.0e-7_wp
  real(wp), parameter :: very_straight = 0.997_wp   ! cosine between tangents
  integer, parameter :: usual_iterations = 4
  real(wp), parameter :: near = 0.05_wp             ! distance between motions, as a share of the motion

contains

  !> Follows the branch of a guess from the first value of the parameter until it leaves the range.
  subroutine follow_branch(problem, settings, guess, branch, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_t), intent(in) :: guess
    type(branch_t), intent(out) :: branch
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: walk
    logical :: has_begun

    call start_walk(problem, settings, guess, walk, has_begun, error)
    if (.not. allocated(error)) call follow_walk(problem, walk, branch, error)
    branch%has_begun = has_begun
  end subroutine follow_branch

  !> Follows a branch from a motion on it along its tangent until it leaves the range.
  subroutine follow_walk(problem, walk, branch, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(inout) :: walk   !! the first motion, then the last one
    type(branch_t), intent(out) :: branch
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: next
    character(len=:), allocatable :: fault
    real(wp) :: step
    integer :: iterations, kept, steps
    logical :: is_done, is_good, is_whole

    allocate (branch%points(0))
    branch%ending = ''
    step = first_step
    call recall_branch(problem, branch, walk, step, is_whole, error)
    branch%has_begun = .true.
    if (allocated(error) .or. is_whole) return
    kept = branch%count
    if (kept == 0) then
      call branch%add(walk%point)
    else
      call problem%keep_phase(walk%point%orbit)
    end if
    steps = kept
    is_done = .false.
    do while (.not. is_done)
      if (walk%settings%is_stopped()) return
      if (branch%count >= walk%settings%most_points) then
        branch%ending = 'after most_points = ' // to_text(walk%settings%most_points) // ' points'
        exit
      end if
      call take_step(problem, walk, step, next, iterations, is_good, error)
      if (.not. is_good) then
        step = step / 2
        if (step > shortest_step) cycle
        call end_branch(walk, 'no convergence with ' // problem%resolution(), branch, error)
        exit
      end if
      call complete_point(problem, next, error)
      if (dot_product(walk%weights**2 * walk%tangent, next%tangent) < 0) call next%turn()
      if (.not. allocated(error)) call adapt_resolution(problem, walk, next, error)
      if (.not. allocated(error)) branch%is_back = problem%meets_other(walk%point%orbit, next%point%orbit)
      if (branch%is_back) exit
      steps = steps + 1
      fault = ''
      if (.not. allocated(error)) call problem%find_fault(next%point, fault)
      if (.not. allocated(error) .and. fault == '') then
        call conclude_step(problem, walk, next, branch, is_done, error)
      end if
      if (allocated(error) .or. fault /= '') then
        call end_branch(walk, fault, branch, error)
        exit
      end if
      if (steps > 1) branch%is_closed = comes_back(branch%points(1), walk%point, next%point)
      if (is_done .or. branch%is_closed) exit
      call adapt_step(iterations, walk, next, step)
      walk = next
      call problem%keep_phase(walk%point%orbit)
      call keep_step(problem, branch, walk, step, kept, error)
      if (allocated(error)) return
    end do
    call keep_end(walk%settings, branch, kept, error)
  end subroutine follow_walk

  !> Whether a branch passes its first point again between two others, in the same direction.
  pure logical function comes_back(first, walk, next)
    type(orbit_point_t), intent(in) :: first, walk, next

    comes_back = .false.
    if ((first%orbit%value - walk%orbit%value) * (first%orbit%value - next%orbit%value) >= 0) return
    if (first%direction * next%direction <= 0 .or. first%direction * walk%direction <= 0) return
    comes_back = distance_between(first%orbit, walk%orbit, next%orbit) < near
  end function comes_back

  !> Ends a branch before it leaves the range. An error then is no reason to drop its points.
  subroutine end_branch(walk, fault, branch, error)
    type(walk_t), intent(in) :: walk
    character(len=*), intent(in) :: fault   !! why, without an error
    type(branch_t), intent(inout) :: branch
    type(error_t), allocatable, intent(inout) :: error

    branch%ending = 'at ' // rounded_text(walk%x(size(walk%x)), 8) // ': ' // fault
    if (.not. allocated(error)) return
    branch%ending = 'at ' // rounded_text(walk%x(size(walk%x)), 8) // ': ' // error%message
    deallocate (error)
  end subroutine end_branch

  !> The first point, in the resolution that it needs, and the direction into the range.
  subroutine start_walk(problem, settings, guess, walk, has_begun, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_t), intent(in) :: guess
    type(walk_t), intent(inout) :: walk
    logical, intent(out) :: has_begun   !! whether there is a point, in however fine a resolution
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: none = 1.0e-20_wp   ! [rad]
    type(orbit_t) :: start
    character(len=:), allocatable :: fault
    real(wp), allocatable :: row(:)
    integer :: iterations
    logical :: has_changed, has_converged

    walk%settings = settings
    walk%range = problem%range()
    start = guess
    has_begun = .false.
    call problem%begin(error)
    if (allocated(error)) return
    do
      walk%x = problem%put_together(start)
      if (allocated(row)) deallocate (row)
      allocate (row(size(walk%x)), source=0.0_wp)
      row(size(row)) = 1.0_wp
      call problem%correct(row, settings%at, walk%x, iterations, has_converged, error)
      if (allocated(error)) return
      if (.not. has_converged) then
        call raise(error, exit_failed, 'no convergence at the first value, ' // rounded_text(settings%at, 8) // ', with ' // &
                   problem%resolution() // '; what helps: a range that begins far from resonances')
        return
      end if
      has_begun = .true.
      call problem%set_scale(walk%x)
      if (.not. problem%oscillation(walk%x) > none) then
        call raise(error, exit_failed, 'nothing oscillates at the first value, ' // rounded_text(settings%at, 8) // &
                   ', nor near it; required: an excitation with an amplitude')
        return
      end if
      call complete_point(problem, walk, error)
      if (allocated(error)) return
      if (walk%point%error <= problem%tolerance) exit
      call problem%adapt(walk%point, has_changed, error)
      if (allocated(error)) return
      if (.not. has_changed) exit
      start = walk%point%orbit
    end do
    call problem%find_fault(walk%point, fault)
    if (fault /= '') then
      has_begun = walk%point%crossed > 0   ! else it may be no motion at all
      call raise(error, exit_failed, 'at the first value, ' // rounded_text(settings%at, 8) // ', ' // fault)
      return
    end if
    if (settings%ahead * walk%tangent(size(row)) < 0) walk%tangent = -walk%tangent
    walk%point%direction = walk%tangent(size(row)) / walk%range
    call add_multipliers(problem, walk%settings, walk%point, error)
  end subroutine start_walk

  !> Longer steps where the branch is straight and Newton's method fast.
  subroutine adapt_step(iterations, walk, next, step)
    integer, intent(in) :: iterations
    type(walk_t), intent(in) :: walk, next
    real(wp), intent(inout) :: step
    real(wp) :: cosine

    step = min(longest_step, 1.4_wp * step)
    if (size(walk%x) /= size(next%x)) return
    cosine = dot_product(walk%weights * walk%tangent, walk%weights * next%tangent) / measured(next%tangent, walk%weights)
    if (cosine < very_straight .or. iterations > usual_iterations) step = step / 1.4_wp
    if (iterations > usual_iterations + 2) step = step / 1.4_wp
  end subroutine adapt_step

  !> Adds what lies between two points, and the second one, or the end of the range.
  subroutine conclude_step(problem, walk, next, branch, is_done, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(in) :: walk
    type(walk_t), intent(inout) :: next
    type(branch_t), intent(inout) :: branch
    logical, intent(out) :: is_done
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: beyond
    real(wp) :: bound, value

    value = next%x(size(next%x))
    is_done = value >= problem%periodic%bounds(2) .or. value <= problem%periodic%bounds(1)
    if (value > problem%periodic%bounds(2) .or. value < problem%periodic%bounds(1)) then
      bound = merge(problem%periodic%bounds(2), problem%periodic%bounds(1), value > problem%periodic%bounds(2))
      beyond = next
      call settle_at(problem, walk, beyond, bound, next, error)
      if (allocated(error)) return
    end if
    call add_multipliers(problem, next%settings, next%point, error)
    if (allocated(error)) return
    call add_between(problem, walk, next, branch, error)
    if (.not. allocated(error)) call branch%add(next%point)
  end subroutine conclude_step

end module nocdyn_orbit_branch
