!> The signals of a machine over a period that is integrated: extremes in continuous time, as those of runs, and means.
module nocdyn_period_signals
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: harmonic_basis_t, new_harmonic_basis
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: ranges_t, step_block_t
  use nocdyn_orbit_problem, only: signal_range_t
  use nocdyn_period_flow, only: flow_observer_t, flow_over, stages, state_in_step
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signal_values, only: new_signal_values, signal_values_t
  use nocdyn_signals, only: signal_angle, signal_source_t, signal_t
  use nocdyn_varied_machine, only: varied_machine_t
  implicit none (type, external)
  private

  public :: measure_period, sample_period

  integer, parameter :: fewest_samples = 1024   ! turning values are those of samples
  integer, parameter :: harmonics = 100         ! that are told of

  type, extends(flow_observer_t) :: signal_observer_t
    type(signal_values_t) :: values
    real(wp), allocatable :: drift(:)       !! mean rotation of angles [rad/s], [signals]
    real(wp), allocatable :: integral(:)    !! over the time
    real(wp), allocatable :: lowest_value(:), highest_value(:)
  contains
    procedure :: on_steps => add_steps
    procedure :: observe_lanes, tracked_values, find_pace, on_extremes
  end type signal_observer_t

  !> Keeps rows of signals at the output times.
  type, extends(flow_observer_t) :: sample_rows_t
    type(signal_values_t) :: values
    real(wp), allocatable :: rows(:, :)     !! [times, signals]
  contains
    procedure :: on_output => keep_row
  end type sample_rows_t

contains

  !> Samples of signals over the period of an orbit, whose value has been set.
  subroutine sample_period(periodic, orbit, rtol, signals, least_samples, samples, error)
    type(periodic_machine_t), target, intent(inout) :: periodic   !! as in `measure_period`
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: rtol
    type(signal_t), intent(in) :: signals(:)
    integer, intent(in) :: least_samples
    type(signal_samples_t), intent(out) :: samples
    type(error_t), allocatable, intent(out) :: error
    type(sample_rows_t) :: observer
    type(harmonic_basis_t) :: basis
    type(signal_source_t), allocatable :: sources(:)
    real(wp) :: period
    integer :: i, n

    n = max(fewest_samples, 4 * ((least_samples + 3) / 4))
    period = 2.0_wp * acos(-1.0_wp) / orbit%rate
    sources = signals%source
    observer%values = new_signal_values(periodic%machine%formulation, sources)
    observer%values%in_motion = .true.
    allocate (observer%rows(n + 1, size(signals)), source=0.0_wp)
    call flow_from(periodic, orbit, rtol, [(period * i / n, i=0, n)], observer, error)
    if (allocated(error)) return
    samples%t = [(period * i / n, i=0, n - 1)]
    allocate (samples%rotation(size(signals)), source=0.0_wp)
    samples%values = observer%rows(:n, :)
    do i = 1, size(signals)
      if (sources(i)%kind /= signal_angle) cycle
      samples%rotation(i) = dot_product(periodic%turning(sources(i)%index, :), orbit%speed)
      samples%values(:, i) = samples%values(:, i) - samples%rotation(i) * samples%t
    end do
    basis = new_harmonic_basis((n - 1) / 4, n)
    samples%series = basis%coefficients_of(samples%values, 2 * basis%harmonics)
    samples%has_kinks = .true.
    samples%harmonics = harmonics
  end subroutine sample_period

  !> Integrates from the begin of an orbit through some times, without variations.
  subroutine flow_from(periodic, orbit, rtol, times, observer, error)
    type(periodic_machine_t), target, intent(inout) :: periodic
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: rtol
    real(wp), contiguous, intent(in) :: times(:)   !! [s]
    class(flow_observer_t), intent(inout) :: observer
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: y(periodic%machine%states)

    observer%mean_rate = spread(0.0_wp, 1, size(y))
    y = orbit%state
    select type (machine => periodic%machine%formulation)
    class is (varied_machine_t)
      machine%outside = periodic%holding_acceleration(orbit%torque)
      call machine%begin_variations(0.0_wp, y, .false.)
      call flow_over(machine, rtol, times, y, observer, error)
    end select
  end subroutine flow_from

  subroutine keep_row(self, lane, t, y)
    class(sample_rows_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp) :: row(size(self%rows, 2)), state(1, size(y))

    self%count = self%count + 1
    state(1, :) = y
    call self%values%observe([t], state)
    call self%values%fill_row(lane, t, y, row)
    self%rows(self%count, :) = row
  end subroutine keep_row

  !> The ranges of signals over the period of an orbit, whose value has been set. Angles are those beside the mean rotation.
  subroutine measure_period(periodic, orbit, rtol, signals, ranges, error)
    type(periodic_machine_t), target, intent(inout) :: periodic   !! of one sample, which carries variations
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: rtol
    type(signal_t), intent(in) :: signals(:)
    type(signal_range_t), intent(out) :: ranges(:)
    type(error_t), allocatable, intent(out) :: error
    type(signal_observer_t) :: observer
    type(signal_source_t) :: sources(size(signals))
    real(wp) :: period
    integer :: i

    period = 2.0_wp * acos(-1.0_wp) / orbit%rate
    sources = signals%source
    observer%values = new_signal_values(periodic%machine%formulation, sources)
    observer%values%in_motion = .true.
    observer%tracked = size(signals)
    allocate (observer%bends(size(signals)), source=.true.)
    allocate (observer%drift(size(signals)), observer%integral(size(signals)), observer%lowest_value(size(signals)), &
              observer%highest_value(size(signals)), source=0.0_wp)
    do i = 1, size(signals)
      if (sources(i)%kind == signal_angle) observer%drift(i) = dot_product(periodic%turning(sources(i)%index, :), orbit%speed)
    end do
    call flow_from(periodic, orbit, rtol, [0.0_wp, period], observer, error)
    if (allocated(error)) return
    ranges%half_range = 0.5_wp * (observer%highest_value - observer%lowest_value)
    ranges%largest = max(abs(observer%highest_value), abs(observer%lowest_value))
    ranges%mean = observer%integral / period
  end subroutine measure_period

  !> Adds to the integrals.
  subroutine add_steps(self, steps, y, y_new, c)
    class(signal_observer_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)
    real(wp) :: row(size(self%drift)), state(1, self%machine%states), t
    integer :: i

    if (.not. steps%taken(1)) return
    do i = 1, stages
      t = steps%t(1) + self%nodes(i) * steps%theta_end(1) * steps%h(1)
      call state_in_step(steps, y, c, self%nodes(i) * steps%theta_end(1), state(1, :))
      call self%values%observe([t], state)
      call self%values%fill_row(1, t, state(1, :), row)
      self%integral = self%integral + (self%weights(i) * steps%theta_end(1) * steps%h(1)) * (row - self%drift * t)
    end do
  end subroutine add_steps

  subroutine observe_lanes(self, t, y)
    class(signal_observer_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:), y(:, :)

    call self%values%observe(t, y)
  end subroutine observe_lanes

  subroutine tracked_values(self, lane, t, y, values)
    class(signal_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: values(:)

    call self%values%fill_row(lane, t, y, values)
    values = values - self%drift * t
  end subroutine tracked_values

  subroutine find_pace(self, lane, fastest, scale)
    class(signal_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: fastest, scale

    call self%values%find_pace(lane, fastest, scale)
  end subroutine find_pace

  subroutine on_extremes(self, lane, ranges)
    class(signal_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(ranges_t), intent(in) :: ranges

    self%lowest_value = ranges%lowest
    self%highest_value = ranges%highest
  end subroutine on_extremes

end module nocdyn_period_signals
