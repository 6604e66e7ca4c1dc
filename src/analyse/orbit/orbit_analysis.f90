!> Periodic motions of a machine over a number of its input or over a speed: from the input to the branch.
module nocdyn_orbit_analysis
  use nocdyn_backbone_start, only: start_backbone
  use nocdyn_branch_switching, only: follow_switches
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_harmonic_problem, only: harmonic_problem_t, new_harmonic_problem
  use nocdyn_input, only: input_t
  use nocdyn_joint_simplifications, only: has_joint_that_locks, refuse_joints
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_backbone, only: backbone_t, find_quasi_linear, note_left_out
  use nocdyn_orbit_branch, only: follow_branch
  use nocdyn_orbit_couplings, only: orbit_couplings_t
  use nocdyn_orbit_guess, only: find_settled_guess, find_steady_guess
  use nocdyn_orbit_log, only: orbit_log_t
  use nocdyn_orbit_period, only: find_period
  use nocdyn_orbit_points, only: branch_t
  use nocdyn_orbit_problem, only: orbit_problem_t
  use nocdyn_orbit_scatter, only: find_high, find_isolated, scatter_t
  use nocdyn_orbit_settings, only: harmonic_balance, orbit_settings_t, read_orbit_settings, shooting
  use nocdyn_orbit_start_file, only: find_file_guess
  use nocdyn_periodic_machine, only: body_turning, orbit_t, periodic_machine_t
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  use nocdyn_sampled_machine, only: new_sampled_machine
  use nocdyn_self_excited, only: follow_cycle_of_run, follow_self_excited
  use nocdyn_shooting_problem, only: new_shooting_problem, shooting_problem_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: analyse_orbits

  integer, parameter :: few_samples = 24             ! of a period, for questions to the machine as such

  type, public :: orbit_analysis_t
    type(orbit_settings_t) :: settings
    logical :: is_self_excited = .false.               !! whether nothing excites the machine periodically
    character(len=:), allocatable :: parameter, unit   !! what changes
    character(len=:), allocatable :: body_name         !! whose speed is held, ''
    type(branch_t) :: branch                           !! with the points of all branches
    type(scatter_t) :: found                           !! what scattered starts have found
    type(orbit_couplings_t) :: couplings               !! their describing functions
    type(backbone_t) :: backbone                       !! frequencies of a mode
    class(orbit_problem_t), allocatable :: problem     !! whose motions they are
    type(string_t), allocatable :: notes(:)
    logical :: is_unfinished = .false.                 !! whether the user has interrupted it; there are points
  end type orbit_analysis_t

contains

  !> Follows the branch of an input.
  subroutine analyse_orbits(input, machine, self, error, log)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! one lane
    type(orbit_analysis_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(orbit_log_t), target, intent(inout), optional :: log   !! journal, which must live as long as `self`
    type(periodic_machine_t) :: periodic
    class(orbit_problem_t), allocatable :: problem
    type(orbit_t) :: guess
    logical :: has_joints

    allocate (self%notes(0))
    call read_orbit_settings(input, machine, self%settings, error)
    if (allocated(error)) return
    if (present(log)) self%settings%log => log
    self%body_name = ''
    if (self%settings%body > 0) then
      self%body_name = machine%names(self%settings%body)%text
      self%parameter = 'mean_speed_' // self%body_name
      self%unit = 'rad/s'
    else if (self%settings%mode > 0) then
      self%unit = 'rad'
      if (self%settings%is_over_energy) self%unit = 'J'
    else
      self%parameter = self%settings%targets(1)%path
      self%unit = self%settings%targets(1)%unit
    end if
    has_joints = has_joint_that_locks(input)
    call refuse_moving_rows(input, self%settings, error)
    if (allocated(error)) return
    if (self%settings%mode > 0) then
      call study_mode(input, machine, periodic, guess, self, error)
    else
      call study_machine(input, self%settings, merge(1, few_samples, has_joints), periodic, guess, error)
      self%is_self_excited = periodic%rate_is_unknown .and. .not. has_joints
      if (periodic%rate_is_unknown .and. .not. allocated(error)) call refuse_keys(input, self%settings, error)
    end if
    if (.not. allocated(error)) then
      if (has_joints .or. self%settings%method == shooting) then
        call follow_by_shooting(input, periodic, guess, self, problem, error)
      else
        call follow_by_harmonics(input, periodic, guess, self, problem, error)
      end if
    end if
    if (.not. allocated(error) .and. self%settings%mode > 0) call find_quasi_linear(problem, self%branch, self%backbone)
    if (.not. allocated(error) .and. self%settings%starts > 0) then
      call find_isolated(input, self%settings, problem, self%branch, self%found)
    end if
    if (.not. allocated(error) .and. self%settings%switches) then
      select type (problem)
      class is (harmonic_problem_t)
        call follow_switches(problem, self%settings, self%branch)
      end select
    end if
    if (.not. allocated(error)) then
      self%is_unfinished = self%settings%is_stopped()
      call move_alloc(problem, self%problem)
      return
    end if
    call input%name_case(error)
  end subroutine analyse_orbits

  !> Refuses what has no meaning for a machine that nothing excites.
  subroutine refuse_keys(input, settings, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: key

    key = ''
    if (settings%subharmonic > 1) key = 'subharmonic'
    if (settings%starts > 0) key = 'starts'
    if (settings%starts_high .or. settings%start_file /= '') key = 'start'
    if (key == '') return
    call raise(error, exit_input, input%location(settings%group, key) // ': ' // key // ': nothing excites this machine ' // &
               "periodically; allowed: the limit cycles that begin at its steady state, or start = 'settled_run'")
  end subroutine refuse_keys

  !> Refuses rows that move, and harmonic balance for joints that lock.
  subroutine refuse_moving_rows(input, settings, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: drives(:)

    if (settings%mode > 0) then
      call refuse_joints(input, .false., 'a backbone curve', error)
      if (.not. allocated(error) .and. settings%method == shooting) call raise(error, exit_input, &
        input%location(settings%group, 'method') // ": method = 'shooting': a backbone curve is found by harmonic balance; " // &
        "allowed: 'harmonic_balance'")
      return
    end if
    call refuse_joints(input, .false., 'nocdyn orbit', error, knows_locks=.true.)
    if (allocated(error)) return
    allocate (drives, source=input%groups_named('drive'))
    if (size(drives) > 0) call raise(error, exit_input, input%location(drives(1)) // ': nocdyn orbit takes no prescribed ' // &
                                     'motions; allowed: motors and excitations')
    if (allocated(error) .or. settings%method /= harmonic_balance .or. .not. has_joint_that_locks(input)) return
    call refuse_joints(input, .false., "method = 'harmonic_balance'", error)
    if (allocated(error)) return
    call raise(error, exit_input, input%location(settings%group, 'method') // ": method = 'harmonic_balance' " // &
               "does not follow teeth with losses; allowed: 'shooting'")
  end subroutine refuse_moving_rows

  !> By harmonic balance; by shooting if motions cross kinks of laws, unless the method is given.
  subroutine follow_by_harmonics(input, periodic, guess, self, problem, error)
    type(input_t), intent(in) :: input
    type(periodic_machine_t), intent(in) :: periodic
    type(orbit_t), intent(in) :: guess
    type(orbit_analysis_t), intent(inout) :: self
    class(orbit_problem_t), allocatable, intent(out) :: problem
    type(error_t), allocatable, intent(out) :: error
    class(orbit_problem_t), allocatable :: other
    type(harmonic_problem_t), allocatable :: harmonic
    type(branch_t) :: branch
    type(error_t), allocatable :: other_error
    type(string_t), allocatable :: notes(:)
    integer :: kink

    allocate (harmonic)
    call new_harmonic_problem(periodic, self%settings%harmonics, self%settings%tolerance, harmonic, error)
    if (allocated(error)) return
    if (self%settings%mode > 0) then
      call harmonic%equations%anchor(guess)
      call harmonic%finer%anchor(guess)
    else if (periodic%rate_is_unknown) then
      self%settings%has_stability = .true.   ! which steady states lose
    else if (self%settings%has_stability .and. .not. self%settings%asks_stability) then
      if (harmonic%takes_long(guess)) self%settings%has_stability = .false.
    end if
    allocate (notes, source=self%notes)
    call follow_from(input, harmonic, guess, self, error)
    kink = harmonic%kink
    call move_alloc(harmonic, problem)
    if (kink == 0 .or. self%settings%method == harmonic_balance .or. self%settings%mode > 0) return
    if (periodic%rate_is_unknown) then
      call append(self%notes, 'limit cycles cross the ' // periodic%machine%formulation%switch_name(kink) // &
                  "; method = 'shooting' follows them")
      return
    end if
    if (.not. allocated(error)) branch = self%branch
    self%notes = notes
    call append(self%notes, 'method = shooting, as motions cross the ' // periodic%machine%formulation%switch_name(kink))
    call follow_by_shooting(input, periodic, guess, self, other, other_error)
    if (.not. allocated(other_error)) then
      call move_alloc(other, problem)
      if (allocated(error)) deallocate (error)
    else if (allocated(error)) then
      error%message = error%message // '; by shooting: ' // other_error%message
    else
      self%branch = branch
      call move_alloc(notes, self%notes)
    end if
  end subroutine follow_by_harmonics

  !> By shooting.
  subroutine follow_by_shooting(input, periodic, guess, self, problem, error)
    type(input_t), intent(in) :: input
    type(periodic_machine_t), intent(in) :: periodic
    type(orbit_t), intent(in) :: guess
    type(orbit_analysis_t), intent(inout) :: self
    class(orbit_problem_t), allocatable, intent(out) :: problem
    type(error_t), allocatable, intent(out) :: error
    type(shooting_problem_t), allocatable :: shot

    allocate (shot)
    call new_shooting_problem(input, self%settings%targets, periodic, self%settings%tolerance, shot, error)
    if (allocated(error)) return
    call follow_from(input, shot, guess, self, error)
    call move_alloc(shot, problem)
  end subroutine follow_by_shooting

  !> Follows the branch from the motion that is asked for: the one near the steady state, the largest one, the one of a file or
  !> the one on which a run settles; from this too if Newton's method does not find a motion from the steady state.
  subroutine follow_from(input, problem, steady, self, error)
    type(input_t), intent(in) :: input
    class(orbit_problem_t), intent(inout) :: problem
    type(orbit_t), intent(in) :: steady
    type(orbit_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: first
    type(scatter_t) :: high
    type(orbit_t) :: guess

    guess = steady
    if (self%settings%mode > 0) then
      call follow_branch(problem, self%settings, guess, self%branch, error)
      return
    else if (problem%periodic%rate_is_unknown) then
      select type (problem)
      class is (harmonic_problem_t)
        call follow_self_excited(input, problem, self%settings, guess, self%branch, self%notes, error)
      class default
        self%is_self_excited = .false.   ! steady states are not followed
        call follow_cycle_of_run(input, problem, self%settings, guess, self%branch, error)
      end select
      return
    end if
    if (self%settings%start_file /= '') then
      call find_file_guess(input, self%settings, problem%periodic, guess, error)
      if (.not. allocated(error)) call follow_branch(problem, self%settings, guess, self%branch, error)
      return
    end if
    if (self%settings%starts_high) then
      call find_high(input, self%settings, problem, guess, high)
      call append(self%notes, 'the first motion is the largest one of ' // to_text(high%tried) // &
                  ' runs from scattered states, ' // to_text(high%periodic) // ' of which led to periodic motions, and of ' // &
                  'the one near the steady state')
    end if
    if (.not. self%settings%settles) then
      call follow_branch(problem, self%settings, guess, self%branch, first)
      if (.not. allocated(first)) return
      if (self%branch%has_begun .or. self%settings%body > 0) then
        error = first
        return
      end if
      call append(self%notes, 'the first motion is the one on which a run settles: from the steady state none was found')
    end if
    call find_settled_guess(input, self%settings, problem%periodic, guess, error)
    if (.not. allocated(error)) call follow_branch(problem, self%settings, guess, self%branch, error)
  end subroutine follow_from

  !> The machine and its period, and a guess of the first motion: the steady state by the mean torques.
  subroutine study_machine(input, settings, samples, periodic, guess, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    integer, intent(in) :: samples
    type(periodic_machine_t), intent(inout) :: periodic
    type(orbit_t), intent(inout) :: guess
    type(error_t), allocatable, intent(out) :: error

    call new_sampled_machine(input, settings%targets, settings%from, samples, periodic%machine, error)
    if (allocated(error)) return
    call find_rigid(periodic)
    periodic%subharmonic = settings%subharmonic
    periodic%bounds = [min(settings%from, settings%to), max(settings%from, settings%to)]
    call find_period(periodic%machine%formulation%machine, periodic%turning, periodic%period, error)
    if (allocated(error)) return
    periodic%rate_is_unknown = size(periodic%period%multiples) == 0
    periodic%held = settings%body
    if (periodic%held > 0) then
      periodic%held_motion = maxloc(abs(periodic%turning(periodic%held, :)), dim=1)
      if (periodic%held_motion == 0) then
        call raise(error, exit_failed, quoted(periodic%machine%formulation%machine%names(periodic%held)%text) // &
                   ' does not turn freely, so that no mean speed of it can be held')
        return
      end if
    end if
    call find_steady_guess(input, settings, periodic, guess)
    call find_floating(periodic)
    call check_period(input, periodic, guess, error)
  end subroutine study_machine

  !> The conservative machine, and its linear motion in the mode as a guess.
  subroutine study_mode(input, machine, periodic, guess, self, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! the whole one
    type(periodic_machine_t), intent(inout) :: periodic
    type(orbit_t), intent(inout) :: guess
    type(orbit_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    integer :: body

    associate (settings => self%settings)
      call new_sampled_machine(input, settings%targets, settings%from, few_samples, periodic%machine, error, &
                               is_conservative=.true.)
      if (allocated(error)) return
      call find_rigid(periodic)
      periodic%bounds = [min(settings%from, settings%to), max(settings%from, settings%to)]
      periodic%is_over_energy = settings%is_over_energy
      call find_steady_guess(input, settings, periodic, guess)
      call start_backbone(settings%mode, periodic, guess, body, self%backbone%linear_rate, error)
      if (allocated(error)) return
      self%parameter = 'amplitude_phi_' // machine%names(body)%text
      if (settings%is_over_energy) self%parameter = 'energy'
      call note_left_out(machine, self%notes)
    end associate
  end subroutine study_mode

  !> The free rotations of the machine.
  subroutine find_rigid(periodic)
    type(periodic_machine_t), intent(inout) :: periodic
    type(rigid_motions_t) :: motions
    integer :: c, k

    associate (formulation => periodic%machine%formulation)
      motions = new_rigid_motions(periodic%machine%freedoms, formulation%incidence, formulation%machine%elastic())
    end associate
    periodic%free = motions%free
    allocate (periodic%rigid(periodic%machine%freedoms, size(motions%free)), source=0.0_wp)
    do c = 1, periodic%machine%freedoms
      do k = motions%first(c), motions%first(c + 1) - 1
        periodic%rigid(c, motions%freedom(k)) = motions%ratio(k)
      end do
    end do
    allocate (periodic%turning, source=body_turning(periodic%machine, periodic%rigid))
  end subroutine find_rigid

  !> Rigid motions on which no torque depends: their speed remains the one of the start.
  subroutine find_floating(periodic)
    type(periodic_machine_t), intent(inout) :: periodic
    real(wp), parameter :: none = 1.0e-9_wp
    real(wp) :: t(periodic%machine%samples), speeds(2), torques(2)
    real(wp), dimension(periodic%machine%samples, periodic%machine%states) :: rates, y
    type(error_t), allocatable :: error
    integer :: i, m
    logical :: rubs

    periodic%floating_speed = periodic%machine%formulation%machine%start_speed(1, &
      periodic%machine%formulation%machine%coordinates%body(periodic%free))
    allocate (periodic%border(0))
    t = 0.0_wp
    do m = 1, size(periodic%free)
      speeds = periodic%floating_speed(m) + 0.01_wp * [-1.0_wp, 1.0_wp] * max(1.0_wp, abs(periodic%floating_speed(m)))
      do i = 1, 2
        y = 0.0_wp
        y(:, :periodic%machine%freedoms) = spread(periodic%rigid(:, m) * speeds(i), 1, size(t))
        call periodic%machine%rates(t, y, rates, error)
        torques(i) = mean_torque(periodic, m, rates(1, :periodic%machine%freedoms))
      end do
      rubs = is_rubbed(m)
      if (m /= periodic%held_motion .and. .not. rubs .and. &
          abs(torques(2) - torques(1)) <= none * maxval(abs(torques))) cycle
      periodic%border = [periodic%border, m]
    end do

  contains

    !> Whether the motion makes a joint slip.
    logical function is_rubbed(motion)
      integer, intent(in) :: motion
      integer :: j

      associate (formulation => periodic%machine%formulation)
        is_rubbed = any([(abs(formulation%joint_rate(j, periodic%rigid(:, motion))) > none, j=1, formulation%joints%count)])
      end associate
    end function is_rubbed

  end subroutine find_floating

  !> The rate of the momentum along a rigid motion [N m].
  pure real(wp) function mean_torque(periodic, motion, acceleration) result(torque)
    type(periodic_machine_t), intent(in) :: periodic
    integer, intent(in) :: motion
    real(wp), intent(in) :: acceleration(:)   !! of the coordinates [rad/s2]
    integer :: b, k
    real(wp) :: rate

    torque = 0.0_wp
    associate (machine => periodic%machine%formulation%machine, coordinates => periodic%machine%formulation%machine%coordinates)
      do b = 1, machine%bodies
        rate = 0.0_wp
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          rate = rate + coordinates%ratio(1, k) * acceleration(coordinates%coordinate(k))
        end do
        torque = torque + periodic%turning(b, motion) * machine%inertia(1, b) * rate
      end do
    end associate
  end function mean_torque

  !> Refuses a machine that stands still where its turning excites it, or whose torques do not repeat themselves.
  subroutine check_period(input, periodic, guess, error)
    type(input_t), intent(in) :: input
    type(periodic_machine_t), intent(inout) :: periodic
    type(orbit_t), intent(inout) :: guess   !! gets its rate
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp), none = 1.0e-9_wp   ! [rad], [rad/s]
    type(orbit_t) :: motion
    logical :: repeats_late, repeats_soon
    integer :: turns

    motion = guess
    if (periodic%rate_is_unknown) motion%rate = turn / input%groups(input%position('run'))%number('t_end')
    call periodic%take_border(periodic%put_border(guess), guess%value, motion)
    call periodic%set_value(motion, error)
    if (allocated(error)) return
    if (.not. motion%rate > none) then
      call raise(error, exit_failed, 'the machine does not turn at its start, so that its orders have no period; required: ' // &
                 'speeds of the bodies at the start')
      return
    end if
    guess%rate = motion%rate
    turns = ceiling(input%groups(input%position('run'))%number('t_end') * motion%rate / turn) + 1
    call periodic%repeats(motion, 1, repeats_soon, error)
    if (.not. allocated(error)) call periodic%repeats(motion, turns, repeats_late, error)
    if (allocated(error)) return
    if (repeats_soon .and. repeats_late) return
    call raise(error, exit_failed, 'the torques do not repeat themselves with the period of the excitations, ' // &
               rounded_text(turn / motion%rate, 6) // ' s: some follow the time in another way')
  end subroutine check_period

end module nocdyn_orbit_analysis
