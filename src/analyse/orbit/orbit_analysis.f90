!> Periodic motions of a machine over a number of its input or over a speed: from the input to the branch.
module nocdyn_orbit_analysis
  use nocdyn_column_names, only: choose_signals
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_harmonic_basis, only: padded_series
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_branch, only: follow_branch
  use nocdyn_orbit_equations, only: body_turning, orbit_equations_t, orbit_t, samples_of
  use nocdyn_orbit_guess, only: find_settled_guess, find_steady_guess
  use nocdyn_orbit_multipliers, only: steps_of
  use nocdyn_orbit_period, only: find_period
  use nocdyn_orbit_points, only: branch_t
  use nocdyn_orbit_scatter, only: find_isolated, scatter_t
  use nocdyn_orbit_settings, only: orbit_settings_t, read_orbit_settings
  use nocdyn_orbit_signals, only: list_orbit_signals, measure_signals, signal_range_t
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  use nocdyn_sampled_machine, only: new_sampled_machine
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t
  implicit none (type, external)
  private

  public :: analyse_orbits

  integer, parameter :: first_harmonics = 5          ! of the equations before the branch chooses its own
  integer, parameter :: most_steps = 5000            ! over a period, for multipliers that are not asked for

  type, public :: orbit_analysis_t
    type(orbit_settings_t) :: settings
    character(len=:), allocatable :: parameter, unit   !! what changes
    character(len=:), allocatable :: body_name         !! whose speed is held, ''
    type(signal_t), allocatable :: signals(:)          !! in SI units
    type(branch_t) :: branch                           !! with the points of all branches
    type(scatter_t) :: found                           !! what scattered starts have found
    type(signal_range_t), allocatable :: ranges(:, :)  !! [signals, points]
    type(string_t), allocatable :: notes(:)
  end type orbit_analysis_t

contains

  !> Follows the branch of an input.
  subroutine analyse_orbits(input, machine, self, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! one lane
    type(orbit_analysis_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(orbit_equations_t), allocatable, target :: equations, finer
    type(orbit_t) :: guess

    allocate (self%notes(0), equations)
    call read_orbit_settings(input, machine, self%settings, error)
    if (allocated(error)) return
    self%body_name = ''
    if (self%settings%body > 0) then
      self%body_name = machine%names(self%settings%body)%text
      self%parameter = 'mean_speed_' // self%body_name
      self%unit = 'rad/s'
    else
      self%parameter = self%settings%targets(1)%path
      self%unit = self%settings%targets(1)%unit
    end if
    call state_equations(input, self%settings, equations, guess, error)
    if (.not. allocated(error)) call choose_orbit_signals(input, equations, self, error)
    if (.not. allocated(error)) then
      allocate (finer, source=equations)
      call follow_from(input, equations, finer, guess, self, error)
    end if
    if (.not. allocated(error) .and. self%settings%starts > 0) then
      call find_isolated(input, self%settings, equations, finer, self%branch, self%found)
    end if
    if (.not. allocated(error)) call measure_points(finer, self, error)
    if (.not. allocated(error)) return
    if (index(error%message, input%shown_case()) /= 1) error%message = input%shown_case() // ': ' // error%message
  end subroutine analyse_orbits

  !> Follows the branch from the steady state, or from the motion on which a run settles: if this is asked for, or if Newton's
  !> method does not find a motion from the steady state.
  subroutine follow_from(input, equations, finer, guess, self, error)
    type(input_t), intent(in) :: input
    type(orbit_equations_t), intent(inout) :: equations, finer
    type(orbit_t), intent(inout) :: guess
    type(orbit_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: first

    if (.not. self%settings%settles) then
      call follow_branch(equations, finer, self%settings, guess, self%branch, first)
      if (.not. allocated(first)) return
      if (self%branch%has_begun .or. self%settings%body > 0) then
        error = first
        return
      end if
      call append(self%notes, 'the first motion is the one on which a run settles: from the steady state none was found')
    end if
    call find_settled_guess(input, self%settings, equations, guess, error)
    if (.not. allocated(error)) call follow_branch(equations, finer, self%settings, guess, self%branch, error)
  end subroutine follow_from

  !> Chooses the columns.
  subroutine choose_orbit_signals(input, equations, self, error)
    type(input_t), intent(in) :: input
    type(orbit_equations_t), intent(in) :: equations
    type(orbit_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(signal_t), allocatable :: signals(:)
    integer, allocatable :: chosen(:)

    call list_orbit_signals(equations, signals)
    call choose_signals(input, 'orbit', signals, chosen, self%notes, error)
    if (.not. allocated(error)) self%signals = signals(chosen)
  end subroutine choose_orbit_signals

  !> The equations, and a guess of the first motion: the steady state by the mean torques.
  subroutine state_equations(input, settings, equations, guess, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(inout) :: settings   !! is told if multipliers take too long
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: guess
    type(error_t), allocatable, intent(out) :: error

    call new_sampled_machine(input, settings%targets, settings%from, samples_of(first_harmonics), equations%machine, error)
    if (allocated(error)) return
    call find_rigid(equations)
    equations%subharmonic = settings%subharmonic
    equations%bounds = [min(settings%from, settings%to), max(settings%from, settings%to)]
    call find_period(equations%machine%formulation%machine, equations%turning, equations%period, error)
    if (allocated(error)) return
    if (size(equations%period%multiples) == 0) then
      call raise(error, exit_failed, 'nothing excites the machine periodically; required: an excitation with a frequency or ' // &
                 'orders. Oscillations that excite themselves are not computed')
      return
    end if
    equations%held = settings%body
    if (equations%held > 0) then
      equations%held_motion = maxloc(abs(equations%turning(equations%held, :)), dim=1)
      if (equations%held_motion == 0) then
        call raise(error, exit_failed, quoted(equations%machine%formulation%machine%names(equations%held)%text) // &
                   ' does not turn freely, so that no mean speed of it can be held')
        return
      end if
    end if
    call find_steady_guess(input, settings, equations, guess)
    call find_floating(equations)
    call equations%prepare()
    call equations%set_harmonics(first_harmonics, error)
    if (.not. allocated(error)) call check_period(input, equations, guess, error)
    if (allocated(error) .or. settings%asks_stability) return
    if (steps_of(equations, padded(guess, equations)) > most_steps) settings%has_stability = .false.
  end subroutine state_equations

  !> The free rotations of the machine.
  subroutine find_rigid(equations)
    type(orbit_equations_t), intent(inout) :: equations
    type(rigid_motions_t) :: motions
    integer :: c, k

    associate (formulation => equations%machine%formulation)
      motions = new_rigid_motions(equations%machine%freedoms, formulation%incidence, formulation%machine%elastic())
    end associate
    equations%free = motions%free
    allocate (equations%rigid(equations%machine%freedoms, size(motions%free)), source=0.0_wp)
    do c = 1, equations%machine%freedoms
      do k = motions%first(c), motions%first(c + 1) - 1
        equations%rigid(c, motions%freedom(k)) = motions%ratio(k)
      end do
    end do
    allocate (equations%turning, source=body_turning(equations%machine, equations%rigid))
  end subroutine find_rigid

  !> Rigid motions on which no torque depends: their speed remains the one of the start.
  subroutine find_floating(equations)
    type(orbit_equations_t), intent(inout) :: equations
    real(wp), parameter :: none = 1.0e-9_wp
    real(wp) :: t(equations%machine%samples), speeds(2), torques(2)
    real(wp), dimension(equations%machine%samples, equations%machine%states) :: rates, y
    type(error_t), allocatable :: error
    integer :: i, m

    equations%floating_speed = equations%machine%formulation%machine%start_speed(1, &
      equations%machine%formulation%machine%coordinates%body(equations%free))
    allocate (equations%border(0))
    t = 0.0_wp
    do m = 1, size(equations%free)
      speeds = equations%floating_speed(m) + 0.01_wp * [-1.0_wp, 1.0_wp] * max(1.0_wp, abs(equations%floating_speed(m)))
      do i = 1, 2
        y = 0.0_wp
        y(:, :equations%machine%freedoms) = spread(equations%rigid(:, m) * speeds(i), 1, size(t))
        call equations%machine%rates(t, y, rates, error)
        torques(i) = mean_torque(equations, m, rates(1, :equations%machine%freedoms))
      end do
      if (m /= equations%held_motion .and. abs(torques(2) - torques(1)) <= none * maxval(abs(torques))) cycle
      equations%border = [equations%border, m]
    end do
  end subroutine find_floating

  !> The rate of the momentum along a rigid motion [N m].
  pure real(wp) function mean_torque(equations, motion, acceleration) result(torque)
    type(orbit_equations_t), intent(in) :: equations
    integer, intent(in) :: motion
    real(wp), intent(in) :: acceleration(:)   !! of the coordinates [rad/s2]
    integer :: b, k
    real(wp) :: rate

    torque = 0.0_wp
    associate (machine => equations%machine%formulation%machine, coordinates => equations%machine%formulation%machine%coordinates)
      do b = 1, machine%bodies
        rate = 0.0_wp
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          rate = rate + coordinates%ratio(1, k) * acceleration(coordinates%coordinate(k))
        end do
        torque = torque + equations%turning(b, motion) * machine%inertia(1, b) * rate
      end do
    end associate
  end function mean_torque

  !> Refuses a machine that stands still where its turning excites it, or whose torques do not repeat themselves.
  subroutine check_period(input, equations, guess, error)
    type(input_t), intent(in) :: input
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: guess   !! gets its rate
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp), none = 1.0e-9_wp   ! [rad], [rad/s]
    type(orbit_t) :: motion
    logical :: repeats_late, repeats_soon
    integer :: turns

    motion = guess
    call equations%take_apart(equations%put_together(padded(guess, equations)), motion)
    call equations%set_value(motion, error)
    if (allocated(error)) return
    if (.not. motion%rate > none) then
      call raise(error, exit_failed, 'the machine does not turn at its start, so that its orders have no period; required: ' // &
                 'speeds of the bodies at the start')
      return
    end if
    guess%rate = motion%rate
    turns = ceiling(input%groups(input%position('run'))%number('t_end') * motion%rate / turn) + 1
    call equations%repeats(motion, 1, repeats_soon, error)
    if (.not. allocated(error)) call equations%repeats(motion, turns, repeats_late, error)
    if (allocated(error)) return
    if (repeats_soon .and. repeats_late) return
    call raise(error, exit_failed, 'the torques do not repeat themselves with the period of the excitations, ' // &
               rounded_text(turn / motion%rate, 6) // ' s: some follow the time in another way')
  end subroutine check_period

  !> A motion with the harmonics of the equations.
  type(orbit_t) function padded(guess, equations) result(motion)
    type(orbit_t), intent(in) :: guess
    type(orbit_equations_t), intent(in) :: equations

    motion = guess
    motion%series = padded_series(guess%series, equations%basis%length)
  end function padded

  !> The signals of all points.
  subroutine measure_points(finer, self, error)
    type(orbit_equations_t), target, intent(inout) :: finer
    type(orbit_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    allocate (self%ranges(size(self%signals), self%branch%count))
    do i = 1, self%branch%count
      associate (point => self%branch%points(i))
        call finer%set_harmonics(2 * point%harmonics, error)
        if (.not. allocated(error)) call measure_signals(finer, point%orbit, self%signals, self%ranges(:, i), error)
        if (allocated(error)) return
      end associate
    end do
  end subroutine measure_points

end module nocdyn_orbit_analysis
