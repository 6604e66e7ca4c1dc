!> Guesses of the first motion of a branch: the steady state by the mean torques, or the motion on which a run settles.
module nocdyn_orbit_guess
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_series, only: find_series
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_sampled_machine, only: with_start
  use nocdyn_sampler, only: sampler, sampler_t
  use nocdyn_solver_status, only: failure_message, integration_done, solver_status_t
  use nocdyn_targets, only: set_targets
  implicit none (type, external)
  private

  public :: advance, find_settled_guess, find_steady_guess, formulation_angles, start_machine

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter, public :: guess_samples = 64   !! of a period from which series are found

contains

  !> A motion without oscillation: in the steady state of the machine, if there is one, else at its start.
  subroutine find_steady_guess(input, settings, periodic, guess)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    type(periodic_machine_t), intent(inout) :: periodic
    type(orbit_t), intent(inout) :: guess
    type(machine_t) :: steady
    integer :: c

    call start_machine(input, settings, steady)
    associate (machine => periodic%machine%formulation%machine, f => periodic%machine%freedoms)
      guess%value = settings%at
      guess%subharmonic = periodic%subharmonic
      if (allocated(guess%state)) deallocate (guess%state)
      if (allocated(guess%series)) deallocate (guess%series)
      allocate (guess%series(1, periodic%machine%states - f), source=0.0_wp)
      guess%speed = steady%start_speed(1, machine%coordinates%body(periodic%free))
      do c = 1, f
        associate (b => machine%coordinates%body(c))
          guess%series(1, c) = steady%start_angle(1, b) - machine%start_angle(1, b)
        end associate
      end do
      guess%series(1, :f) = guess%series(1, :f) - matmul(periodic%rigid, guess%series(1, periodic%free))
      guess%series(:, f + 1:) = steady%start_internal()
    end associate
  end subroutine find_steady_guess

  !> The machine with the first value of the parameter, in its steady state if there is one.
  subroutine start_machine(input, settings, machine, as_given)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    type(machine_t), intent(out) :: machine   !! of one lane
    logical, intent(in), optional :: as_given !! not in equilibrium; absent: no
    type(input_t) :: changed
    type(error_t), allocatable :: error
    character(len=:), allocatable :: message

    changed = with_start(input, 'equilibrium')
    if (present(as_given)) changed = with_start(input, 'given')
    if (size(settings%targets) > 0) call set_targets(changed, settings%targets, [settings%at], message)
    call assemble_machine(changed, machine, error)
    if (.not. allocated(error)) return
    deallocate (error)
    call assemble_machine(with_start(changed, 'given'), machine, error)   ! as the samples, which have been assembled
  end subroutine start_machine

  !> The last period of a run from the steady state, after many periods.
  subroutine find_settled_guess(input, settings, periodic, guess, error, push)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    type(periodic_machine_t), intent(in) :: periodic
    type(orbit_t), intent(inout) :: guess              !! in the steady state, with its rate; then the settled motion
    type(error_t), allocatable, intent(out) :: error   !! the integration fails
    real(wp), intent(in), optional :: push(:)          !! added to the state of the start, [states]
    class(formulation_t), allocatable :: formulation
    type(machine_t) :: machine
    real(wp), allocatable :: last(:, :), y(:, :)
    real(wp) :: begin, period
    integer :: i

    call start_machine(input, settings, machine)
    call new_formulation('reduced', machine, formulation, with_energy_balance=.false.)
    allocate (y, source=formulation%start())
    if (present(push)) y(1, :) = y(1, :) + push
    period = turn / guess%rate
    begin = settings%periods * period
    call advance(formulation, [0.0_wp, 0.5_wp * begin, begin], y, last, error)
    if (allocated(error)) return
    associate (f => periodic%machine%freedoms, m => periodic%period%motion)
      if (m > 0) period = abs((last(f + periodic%free(m), 3) - last(f + periodic%free(m), 2)) / (0.5_wp * begin))
      if (m > 0) period = turn * periodic%subharmonic / (periodic%period%rate * period)
      call advance(formulation, begin + [(period * i / guess_samples, i=0, guess_samples)], y, last, error)
      if (allocated(error)) return
      last(f + 1:2 * f, :) = last(f + 1:2 * f, :) + spread(formulation_angles(machine, periodic), 2, guess_samples + 1)
      call find_series(periodic, last(f + 1:, :), 0.0_wp, period, guess)   ! it begins after whole periods
      if (m == 0) guess%state = last(:, 1)                                 ! else the time is counted from elsewhere
    end associate
  end subroutine find_settled_guess

  !> Angles of the coordinates at the start, from those of the samples [rad], [coordinates].
  pure function formulation_angles(machine, periodic) result(angles)
    type(machine_t), intent(in) :: machine
    type(periodic_machine_t), intent(in) :: periodic
    real(wp) :: angles(periodic%machine%freedoms)

    associate (b => machine%coordinates%body)
      angles = machine%start_angle(1, b) - periodic%machine%formulation%machine%start_angle(1, b)
    end associate
  end function formulation_angles

  !> Integrates through some times and keeps the states.
  subroutine advance(formulation, times, y, states, error)
    class(formulation_t), intent(inout) :: formulation
    real(wp), contiguous, intent(in) :: times(:)      !! [s]
    real(wp), contiguous, intent(inout) :: y(:, :)    !! state at the first time, then at the last one
    real(wp), allocatable, intent(out) :: states(:, :)
    type(error_t), allocatable, intent(out) :: error
    type(sampler_t) :: observer
    type(integration_settings_t) :: settings
    type(solver_status_t) :: status

    settings%rtol = 1.0e-8_wp
    settings%atol = 1.0e-10_wp
    settings%max_steps = 100000000
    observer = sampler(1, size(y, 2), size(times))
    call integrate(formulation, settings, times, y, observer, status, error)
    if (allocated(error)) return
    if (status%code(1) /= integration_done) then
      call raise(error, exit_failed, 'the run that should settle: ' // &
                 failure_message(status, 1, formulation, settings%rtol, settings%atol))
    end if
    allocate (states, source=observer%y(:, :, 1))
  end subroutine advance

end module nocdyn_orbit_guess
