!> Machines that nothing excites periodically: their steady state over the parameter, the Hopf points at which it loses its
!> stability to oscillations, and the limit cycles that begin there.
module nocdyn_self_excited
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_harmonic_problem, only: harmonic_problem_t
  use nocdyn_hopf_start, only: start_at_hopf
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_branch, only: follow_branch, follow_walk
  use nocdyn_orbit_eigenvalues, only: find_eigenvalues, find_oscillation
  use nocdyn_orbit_points, only: branch_t, walk_t
  use nocdyn_orbit_problem, only: hopf, orbit_point_t, orbit_problem_t
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_periodic_machine, only: orbit_t
  use nocdyn_settled_cycle, only: find_cycle_of_run, find_settled_cycle
  use nocdyn_steady_problem, only: new_steady_problem, steady_problem_t
  use nocdyn_text, only: append, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: follow_cycle_of_run, follow_self_excited

contains

  !> Follows the steady state, as branch 1, and the limit cycles from all of its Hopf points.
  subroutine follow_self_excited(input, problem, settings, guess, branch, notes, error)
    type(input_t), intent(in) :: input
    class(harmonic_problem_t), intent(inout) :: problem   !! of an unknown rate
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_t), intent(in) :: guess                   !! the steady state at the first value
    type(branch_t), intent(out) :: branch
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    class(steady_problem_t), allocatable :: steady
    integer :: i, steady_points
    logical :: has_hopf

    call new_steady_problem(problem%periodic, steady, error)
    if (.not. allocated(error)) call follow_branch(steady, settings, guess, branch, error)
    if (allocated(error)) return
    steady_points = branch%count
    has_hopf = .false.
    do i = 2, merge(0, steady_points - 1, settings%settles)
      if (branch%points(i)%kind /= hopf) cycle
      has_hopf = .true.
      call follow_cycles(problem, steady, settings, i, branch, notes)
    end do
    if (settings%settles .or. .not. has_hopf) then
      call follow_settled(input, problem, steady, settings, branch, error)
    end if
  end subroutine follow_self_excited

  !> Adds the limit cycles of a Hopf point, unless those of another one end there.
  subroutine follow_cycles(problem, steady, settings, place, branch, notes)
    class(harmonic_problem_t), intent(inout) :: problem
    class(steady_problem_t), intent(inout) :: steady
    type(orbit_settings_t), intent(in) :: settings
    integer, intent(in) :: place                     !! of the Hopf point in the branch
    type(branch_t), intent(inout) :: branch
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(branch_t) :: cycles
    type(walk_t) :: walk
    type(error_t), allocatable :: error
    integer :: number

    number = 0
    call start_at_hopf(problem, steady, settings, branch%points(place), walk, error)
    if (.not. allocated(error)) then
      number = branch_that_ends_at(walk%point%orbit, branch, problem%range())
      associate (change => walk%point%orbit%value - branch%points(place)%orbit%value)
        branch%points(place)%is_supercritical = change * unstable_side(branch%points(place - 1:place + 1)) > 0
      end associate
      if (number == 0) call follow_walk(problem, walk, cycles, error)
    end if
    if (allocated(error)) then
      call append(notes, error%message)
      return
    end if
    if (number == 0) then
      number = branch%next_number()
      call branch%add_branch(cycles, number)
      if (cycles%ending /= '') call append(notes, 'branch ' // to_text(number) // ' ends ' // cycles%ending)
    end if
    branch%points(place)%leads_to = number
  end subroutine follow_cycles

  !> Adds the limit cycles from the one on which a run settles at the first value.
  subroutine follow_settled(input, problem, steady, settings, branch, error)
    type(input_t), intent(in) :: input
    class(harmonic_problem_t), intent(inout) :: problem
    class(steady_problem_t), intent(inout) :: steady
    type(orbit_settings_t), intent(in) :: settings
    type(branch_t), intent(inout) :: branch   !! with the steady states
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: some = 0.5_wp, least = 0.1_wp   ! of the speed; [rad]
    type(branch_t) :: cycles
    type(orbit_t) :: guess
    complex(wp), allocatable :: values(:)
    real(wp), allocatable :: oscillation(:, :)
    real(wp) :: push(problem%periodic%machine%states), size_of_push
    integer :: first
    logical :: is_cycle

    guess = branch%points(1)%orbit
    call steady%begin(error)
    if (.not. allocated(error)) call find_eigenvalues(steady%equations, guess, values, error)
    if (allocated(error)) return
    is_cycle = .false.
    first = findloc(aimag(values) > 0, .true., dim=1)
    if (first > 0) then
      guess%rate = aimag(values(first))
      call find_oscillation(steady%equations, guess, values(first), oscillation, error)
      if (allocated(error)) return
      associate (f => steady%equations%freedoms)
        size_of_push = max(least, maxval([0.0_wp, some * abs(matmul(problem%periodic%rigid, guess%speed)) / guess%rate]), &
                           10 * maxval(abs(guess%series(1, :f))))
        push(:f) = size_of_push * guess%rate * oscillation(2, :f)
        push(f + 1:) = size_of_push * oscillation(1, :)
      end associate
      call find_settled_cycle(input, settings, problem%periodic, push, guess, is_cycle, error)
      if (allocated(error)) return
    end if
    if (.not. is_cycle) then
      call refuse(branch, values, error)
      return
    end if
    call problem%begin(error)
    if (allocated(error)) return
    call problem%keep_phase(guess)
    call follow_branch(problem, settings, guess, cycles, error)
    if (allocated(error)) return
    call branch%add_branch(cycles, 2)
    branch%ending = cycles%ending
  end subroutine follow_settled

  !> Follows the limit cycles from the one on which the run of the input settles at the first value.
  subroutine follow_cycle_of_run(input, problem, settings, guess, branch, error)
    type(input_t), intent(in) :: input
    class(orbit_problem_t), intent(inout) :: problem   !! of an unknown rate
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_t), intent(in) :: guess                 !! the steady state at the first value
    type(branch_t), intent(out) :: branch
    type(error_t), allocatable, intent(out) :: error
    type(orbit_t) :: cycle
    logical :: is_cycle

    cycle = guess
    call find_cycle_of_run(input, settings, problem%periodic, cycle, is_cycle, error)
    if (allocated(error)) return
    if (.not. is_cycle) then
      call raise(error, exit_failed, 'nothing excites the machine periodically, and its run settles on no oscillation at ' // &
                 'the first value; required: an excitation with a frequency or orders, a start away from the steady state, ' // &
                 'or a longer &run t_end')
      return
    end if
    call problem%begin(error)
    if (allocated(error)) return
    call problem%keep_phase(cycle)
    call follow_branch(problem, settings, cycle, branch, error)
  end subroutine follow_cycle_of_run

  !> Refuses a machine that nothing excites, with what its steady state says.
  subroutine refuse(branch, values, error)
    type(branch_t), intent(in) :: branch      !! the steady states
    complex(wp), intent(in) :: values(:)      !! eigenvalues at the first value [1/s]
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text

    text = 'nothing excites the machine periodically, and it does not excite itself: no oscillation of the steady state ' // &
           'begins within the range, and a run decays at the first value'
    if (size(values) > 0) text = text // ', where the least stable eigenvalue has the real part ' // &
                                 rounded_text(real(values(1), wp), 6) // ' 1/s'
    call raise(error, exit_failed, text // '; required: an excitation with a frequency or orders, or another range')
  end subroutine refuse

  !> The branch of limit cycles whose last point is next to a small one, 0 if there is none.
  pure integer function branch_that_ends_at(small, branch, range) result(number)
    type(orbit_t), intent(in) :: small
    type(branch_t), intent(in) :: branch
    real(wp), intent(in) :: range
    real(wp), parameter :: near = 0.02_wp   ! of the range, of the rate
    real(wp), parameter :: larger = 100.0_wp
    integer :: i

    number = 0
    do i = 2, branch%count
      associate (point => branch%points(i))
        if (point%branch == 1) cycle
        if (i < branch%count) then
          if (branch%points(i + 1)%branch == point%branch) cycle
        end if
        if (abs(point%orbit%value - small%value) > near * range .or. abs(point%orbit%rate - small%rate) > near * small%rate) cycle
        if (norm2(point%orbit%series(2:, :)) < larger * norm2(small%series(2:, :))) number = point%branch
      end associate
    end do
  end function branch_that_ends_at

  !> The sign of the direction from a Hopf point to the values at which more oscillations grow.
  pure real(wp) function unstable_side(points) result(side)
    type(orbit_point_t), intent(in) :: points(3)   !! before it, the Hopf point, and after it

    side = sign(1.0_wp, points(2)%direction * (points(3)%unstable() - points(1)%unstable()))
  end function unstable_side

end module nocdyn_self_excited
