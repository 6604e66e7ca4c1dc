!> A branch of periodic motions, through folds, until it leaves the range of its parameter.
!>
!> Pseudo-arclength continuation: from a point along the tangent, then back to the branch in the plane across it.
module nocdyn_orbit_branch
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_harmonic_basis, only: padded_series
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_corrector, only: correct, measured, oscillation, set_least_oscillation
  use nocdyn_orbit_equations, only: orbit_equations_t, orbit_t
  use nocdyn_orbit_points, only: adapt_harmonics, add_multipliers, branch_t, complete_point, distance_between, find_fault, &
    least_harmonics, more_harmonics, orbit_point_t, settle_at, take_step, walk_t
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_orbit_specials, only: add_between
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: follow_branch, start_walk

  real(wp), parameter :: first_step = 0.01_wp, longest_step = 0.06_wp, shortest_step = 1.0e-7_wp
  real(wp), parameter :: very_straight = 0.997_wp   ! cosine between tangents
  integer, parameter :: usual_iterations = 4
  real(wp), parameter :: near = 0.05_wp             ! distance between motions, as a share of the motion

contains

  !> Follows the branch of a guess from the first value of the parameter until it leaves the range.
  subroutine follow_branch(equations, finer, settings, guess, branch, error)
    type(orbit_equations_t), intent(inout) :: equations, finer   !! the same machine; harmonics are set here
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_t), intent(in) :: guess
    type(branch_t), intent(out) :: branch
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: walk, next
    character(len=:), allocatable :: fault
    real(wp) :: step
    integer :: iterations
    logical :: is_done, is_good

    allocate (branch%points(0))
    branch%ending = ''
    call start_walk(equations, finer, settings, guess, walk, branch%has_begun, error)
    if (allocated(error)) return
    call branch%add(walk%point)
    step = first_step
    is_done = .false.
    do while (.not. is_done)
      if (branch%count >= settings%most_points) then
        branch%ending = 'after most_points = ' // to_text(settings%most_points) // ' points'
        exit
      end if
      call take_step(equations, walk, step, next, iterations, is_good, error)
      if (.not. is_good) then
        step = step / 2
        if (step > shortest_step) cycle
        call end_branch(walk, 'no convergence with ' // to_text(equations%basis%harmonics) // ' harmonics', branch, error)
        exit
      end if
      call complete_point(equations, finer, next, error)
      if (dot_product(walk%weights**2 * walk%tangent, next%tangent) < 0) call next%turn()
      if (.not. allocated(error) .and. next%settings%harmonics == 0) then
        call adapt_harmonics(equations, finer, walk, next, error)
      end if
      fault = ''
      if (.not. allocated(error)) call find_fault(equations, next%point, fault)
      if (.not. allocated(error) .and. fault == '') then
        call conclude_step(equations, finer, walk, next, branch, is_done, error)
      end if
      if (allocated(error) .or. fault /= '') then
        call end_branch(walk, fault, branch, error)
        exit
      end if
      branch%is_closed = comes_back(branch%points(1), walk%point, next%point)
      if (is_done .or. branch%is_closed) exit
      call adapt_step(iterations, walk, next, step)
      walk = next
    end do
  end subroutine follow_branch

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

  !> The first point, with as many harmonics as it needs, and the direction into the range.
  subroutine start_walk(equations, finer, settings, guess, walk, has_begun, error)
    type(orbit_equations_t), intent(inout) :: equations, finer
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_t), intent(in) :: guess
    type(walk_t), intent(inout) :: walk
    logical, intent(out) :: has_begun   !! whether there is a point, with however many harmonics
    type(error_t), allocatable, intent(out) :: error
    type(orbit_t) :: start
    character(len=:), allocatable :: fault
    real(wp), allocatable :: row(:)
    integer :: harmonics, iterations
    logical :: has_converged

    walk%settings = settings
    walk%range = abs(settings%to - settings%from)
    harmonics = least_harmonics(equations)
    if (settings%harmonics > 0) harmonics = settings%harmonics
    start = guess
    has_begun = .false.
    do
      call equations%set_harmonics(harmonics, error)
      if (allocated(error)) return
      start%series = padded_series(start%series, equations%basis%length)
      walk%x = equations%put_together(start)
      if (allocated(row)) deallocate (row)
      allocate (row(size(walk%x)), source=0.0_wp)
      row(size(row)) = 1.0_wp
      call correct(equations, walk%range, row, settings%at, walk%x, iterations, has_converged, error)
      if (allocated(error)) return
      if (.not. has_converged) then
        call raise(error, exit_failed, 'no convergence at the first value, ' // rounded_text(settings%at, 8) // ', with ' // &
                   to_text(harmonics) // ' harmonics; what helps: a range that begins far from resonances')
        return
      end if
      has_begun = .true.
      call set_least_oscillation(equations, walk%x, walk%range)
      if (.not. oscillates(equations, walk)) then
        call raise(error, exit_failed, 'nothing oscillates at the first value, ' // rounded_text(settings%at, 8) // &
                   ', nor near it; required: an excitation with an amplitude')
        return
      end if
      call complete_point(equations, finer, walk, error)
      if (allocated(error)) return
      if (settings%harmonics > 0 .or. walk%point%error <= settings%tolerance) exit
      if (harmonics >= more_harmonics(harmonics, walk%point%crossed)) exit
      harmonics = more_harmonics(harmonics, walk%point%crossed)
      start = walk%point%orbit
    end do
    call find_fault(equations, walk%point, fault)
    if (fault /= '') then
      call raise(error, exit_failed, 'at the first value, ' // rounded_text(settings%at, 8) // ', ' // fault)
      return
    end if
    if (settings%ahead * walk%tangent(size(row)) < 0) walk%tangent = -walk%tangent
    walk%point%direction = walk%tangent(size(row)) / walk%range
    call add_multipliers(equations, walk%settings, walk%point, error)
  end subroutine start_walk

  !> Whether a machine oscillates, or begins to.
  pure logical function oscillates(equations, walk)
    type(orbit_equations_t), intent(in) :: equations
    type(walk_t), intent(in) :: walk
    real(wp), parameter :: none = 1.0e-20_wp   ! [rad]

    oscillates = oscillation(equations, walk%x) > none
  end function oscillates

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
  subroutine conclude_step(equations, finer, walk, next, branch, is_done, error)
    type(orbit_equations_t), intent(inout) :: equations, finer
    type(walk_t), intent(in) :: walk
    type(walk_t), intent(inout) :: next
    type(branch_t), intent(inout) :: branch
    logical, intent(out) :: is_done
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: beyond
    real(wp) :: bound, value

    value = next%x(size(next%x))
    is_done = value >= equations%bounds(2) .or. value <= equations%bounds(1)
    if (value > equations%bounds(2) .or. value < equations%bounds(1)) then
      bound = merge(equations%bounds(2), equations%bounds(1), value > equations%bounds(2))
      beyond = next
      call settle_at(equations, finer, walk, beyond, bound, next, error)
      if (allocated(error)) return
    end if
    call add_multipliers(equations, next%settings, next%point, error)
    if (allocated(error)) return
    call add_between(equations, finer, walk, next, branch, error)
    if (.not. allocated(error)) call branch%add(next%point)
  end subroutine conclude_step

end module nocdyn_orbit_branch
