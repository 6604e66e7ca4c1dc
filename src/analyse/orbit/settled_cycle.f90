!> The limit cycle on which a run settles, with the period that it shows.
module nocdyn_settled_cycle
  use nocdyn_assembly, only: new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_guess, only: advance, formulation_angles, guess_samples, start_machine
  use nocdyn_orbit_series, only: find_series
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  implicit none (type, external)
  private

  public :: find_cycle_of_run, find_settled_cycle

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter :: windows = 8                      ! periods of the small oscillation that are looked at first
  integer, parameter :: longer = 3                       ! times that they are lengthened
  integer, parameter :: most_crossings = 16              ! of its mean by the main oscillation in a period

contains

  !> Runs from the steady state and a push, and finds the last period of it, if it is periodic.
  subroutine find_settled_cycle(input, settings, periodic, push, guess, is_cycle, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    type(periodic_machine_t), intent(in) :: periodic
    real(wp), intent(in) :: push(:)           !! added to the state of the start, [states]
    type(orbit_t), intent(inout) :: guess     !! the steady state, with the rate of its least stable oscillation; then the cycle
    logical, intent(out) :: is_cycle
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: decayed = 1.0e-3_wp   ! of the push
    class(formulation_t), allocatable :: formulation
    type(machine_t) :: machine
    real(wp), allocatable :: states(:, :), y(:, :)
    real(wp) :: now, period, width
    integer :: i, k

    is_cycle = .false.
    call start_machine(input, settings, machine)
    call new_formulation('reduced', machine, formulation, with_energy_balance=.false.)
    allocate (y, source=formulation%start())
    y(1, :) = y(1, :) + push
    width = windows * turn / guess%rate
    now = settings%periods * turn / guess%rate
    call advance(formulation, [0.0_wp, now], y, states, error)
    if (allocated(error)) return
    associate (f => periodic%machine%freedoms)
      do k = 1, longer
        call advance(formulation, now + [(width * i / (guess_samples * windows), i=0, guess_samples * windows)], y, states, error)
        if (allocated(error)) return
        now = now + width
        if (maxval(abs(beside_mean(states(:f, :)))) < decayed * guess%rate * maxval(abs(push(f + 1:2 * f)))) return
        call find_period(states, f, width, period)
        is_cycle = period > 0
        if (is_cycle) exit
        width = 4 * width
      end do
      if (.not. is_cycle) return
      call take_cycle(formulation, machine, periodic, now, period, y, guess, error)
    end associate
  end subroutine find_settled_cycle

  !> Runs from the start of the input, and finds the last period, if the motion is periodic then. It begins where the speed that
  !> oscillates most passes its mean upwards, so that nothing sticks there.
  subroutine find_cycle_of_run(input, settings, periodic, guess, is_cycle, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings
    type(periodic_machine_t), intent(in) :: periodic
    type(orbit_t), intent(inout) :: guess     !! the steady state, then the cycle, with its state
    logical, intent(out) :: is_cycle
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: samples = 4096, few = 4   ! of a run; periods that are looked at in the end
    real(wp), parameter :: quiet = 1.0e-6_wp        ! oscillation of speeds, as a share of the largest one
    class(formulation_t), allocatable :: formulation
    type(machine_t) :: machine
    real(wp), allocatable :: states(:, :), y(:, :)
    real(wp) :: last, now, period, width
    integer :: i, k

    is_cycle = .false.
    call start_machine(input, settings, machine, as_given=.true.)
    call new_formulation('reduced', machine, formulation, with_energy_balance=.false.)
    allocate (y, source=formulation%start())
    width = input%groups(input%position('run'))%number('t_end')
    now = 0.0_wp
    period = 0.0_wp
    associate (f => periodic%machine%freedoms)
      do k = 1, 2 * longer
        call look(width)
        if (allocated(error)) return
        if (.not. maxval(abs(beside_mean(states(:f, :)))) > quiet * maxval(abs(states(:f, :)))) return
        if (k > 1) call find_period(states, f, width, period, last)
        if (period > 0) exit
        if (k > 1) width = 2 * width
      end do
      if (.not. period > 0) return
      call advance(formulation, [now, now + settings%periods * period], y, states, error)
      if (allocated(error)) return
      now = now + settings%periods * period
      width = few * period
      call look(width)
      if (allocated(error)) return
      call find_period(states, f, width, period, last)
      is_cycle = period > 0
      if (.not. is_cycle) return
      associate (wait => period + last - width)
        call advance(formulation, [now, now + wait], y, states, error)
        if (allocated(error)) return
        now = now + wait
      end associate
      guess%state = y(1, :)
      guess%state(f + 1:2 * f) = guess%state(f + 1:2 * f) + formulation_angles(machine, periodic)
      call take_cycle(formulation, machine, periodic, now, period, y, guess, error)
    end associate

  contains

    subroutine look(duration)
      real(wp), intent(in) :: duration   !! [s]

      call advance(formulation, now + [(duration * i / samples, i=0, samples)], y, states, error)
      now = now + duration
    end subroutine look

  end subroutine find_cycle_of_run

  !> The series of a period that begins now.
  subroutine take_cycle(formulation, machine, periodic, now, period, y, guess, error)
    class(formulation_t), intent(inout) :: formulation
    type(machine_t), intent(in) :: machine                !! which has been formulated
    type(periodic_machine_t), intent(in) :: periodic
    real(wp), intent(in) :: now, period                   !! [s]
    real(wp), contiguous, intent(inout) :: y(:, :)        !! state now, then after the period
    type(orbit_t), intent(inout) :: guess
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: states(:, :)
    integer :: i

    call advance(formulation, now + [(period * i / guess_samples, i=0, guess_samples)], y, states, error)
    if (allocated(error)) return
    associate (f => periodic%machine%freedoms)
      states(f + 1:2 * f, :) = states(f + 1:2 * f, :) + spread(formulation_angles(machine, periodic), 2, size(states, 2))
      guess%rate = turn / period
      call find_series(periodic, states(f + 1:, :), 0.0_wp, period, guess)
    end associate
  end subroutine take_cycle

  !> The time after which the speeds return, by the upward passages of the one that oscillates most through its mean; 0: none.
  pure subroutine find_period(states, freedoms, width, period, last)
    real(wp), intent(in) :: states(:, :)   !! at even distances of time, [states, times]
    integer, intent(in) :: freedoms        !! the first states are their speeds
    real(wp), intent(in) :: width          !! of all times [s]
    real(wp), intent(out) :: period        !! [s]
    real(wp), intent(out), optional :: last   !! time of the last passage [s]
    real(wp), parameter :: returned = 0.05_wp   ! distance of speeds that are the same, as a share of their oscillation
    real(wp) :: beside(freedoms, size(states, 2)), times(size(states, 2)), speeds(freedoms, size(states, 2)), share
    integer :: i, main, n

    period = 0.0_wp
    beside = beside_mean(states(:freedoms, :))
    main = maxloc(maxval(abs(beside), dim=2), dim=1)
    n = 0
    do i = 1, size(states, 2) - 1
      if (.not. (beside(main, i) < 0 .and. beside(main, i + 1) >= 0)) cycle
      n = n + 1
      share = beside(main, i) / (beside(main, i) - beside(main, i + 1))
      times(n) = width * (i - 1 + share) / (size(states, 2) - 1)
      speeds(:, n) = beside(:, i) + share * (beside(:, i + 1) - beside(:, i))
    end do
    do i = 1, min(n - 1, most_crossings)
      if (maxval(abs(speeds(:, n) - speeds(:, n - i))) > returned * maxval(abs(beside))) cycle
      period = times(n) - times(n - i)
      if (present(last)) last = times(n)
      return
    end do
  end subroutine find_period

  !> Values without their means over time.
  pure function beside_mean(values) result(beside)
    real(wp), intent(in) :: values(:, :)   !! [quantities, times]
    real(wp) :: beside(size(values, 1), size(values, 2))

    beside = values - spread(sum(values, dim=2) / size(values, 2), 2, size(values, 2))
  end function beside_mean

end module nocdyn_settled_cycle
