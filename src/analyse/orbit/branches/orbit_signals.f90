!> The signals of a machine along a periodic motion of harmonic balance.
module nocdyn_orbit_signals
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: harmonic_basis_t, new_harmonic_basis
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_equations, only: orbit_equations_t, samples_of
  use nocdyn_orbit_problem, only: signal_range_t
  use nocdyn_periodic_machine, only: orbit_t
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signal_values, only: new_signal_values, signal_values_t
  use nocdyn_signals, only: list_signals, signal_angle, signal_kinetic, signal_t, signal_time
  implicit none (type, external)
  private

  public :: list_orbit_signals, measure_signals, sample_signals

contains

  !> The signals that repeat themselves with the motion: all but the time, energies and works.
  subroutine list_orbit_signals(machine, signals)
    type(machine_t), intent(in) :: machine
    type(signal_t), allocatable, intent(out) :: signals(:)
    type(signal_t), allocatable :: all(:)
    integer :: i

    call list_signals(machine, all)
    signals = all(pack([(i, i=1, size(all))], all%source%kind /= signal_time .and. all%source%kind < signal_kinetic))
  end subroutine list_orbit_signals

  !> Their ranges on a motion. Angles are those beside the mean rotation.
  subroutine measure_signals(equations, orbit, signals, ranges, error)
    type(orbit_equations_t), target, intent(inout) :: equations   !! with more harmonics than the motion, for those of the laws
    type(orbit_t), intent(inout) :: orbit
    type(signal_t), intent(in) :: signals(:)
    type(signal_range_t), intent(out) :: ranges(:)
    type(error_t), allocatable, intent(out) :: error
    type(signal_samples_t) :: samples
    real(wp) :: highest, lowest
    integer :: i

    call sample_signals(equations, orbit, signals, samples, error)
    if (allocated(error)) return
    do i = 1, size(signals)
      call samples%find_extremes(i, lowest, highest)
      ranges(i) = signal_range_t(0.5_wp * (highest - lowest), max(abs(highest), abs(lowest)), samples%series(1, i))
    end do
  end subroutine measure_signals

  !> Samples of a motion. Angles lose their mean rotation.
  subroutine sample_signals(equations, orbit, signals, samples, error)
    type(orbit_equations_t), target, intent(inout) :: equations   !! with more harmonics than the motion, for those of the laws
    type(orbit_t), intent(inout) :: orbit
    type(signal_t), intent(in) :: signals(:)
    type(signal_samples_t), intent(out) :: samples
    type(error_t), allocatable, intent(out) :: error
    type(signal_values_t) :: values
    type(harmonic_basis_t) :: all
    real(wp) :: row(size(signals)), state(equations%machine%states)
    real(wp) :: y(equations%machine%samples, equations%machine%states)
    integer :: i, l

    call equations%set_value(orbit, error)
    if (allocated(error)) return
    allocate (samples%t(size(y, 1)), samples%values(size(y, 1), size(row)), samples%rotation(size(row)), source=0.0_wp)
    call equations%sample(orbit, equations%basis, samples%t, y)
    values = new_signal_values(equations%machine%formulation, signals%source)
    call values%observe(samples%t, y)
    do l = 1, size(samples%t)
      state = y(l, :)
      call values%fill_row(l, samples%t(l), state, row)
      samples%values(l, :) = row
    end do
    do i = 1, size(row)
      if (signals(i)%source%kind /= signal_angle) cycle
      samples%rotation(i) = dot_product(equations%turning(signals(i)%source%index, :), orbit%speed)
      samples%values(:, i) = samples%values(:, i) - samples%rotation(i) * samples%t
    end do
    if (size(samples%t) > samples_of(equations%basis%harmonics)) then
      all = new_harmonic_basis((size(samples%t) - 1) / 4, size(samples%t))
      samples%series = all%coefficients_of(samples%values, 2 * all%harmonics)
    else
      samples%series = equations%basis%coefficients_of(samples%values, 2 * equations%basis%harmonics)
    end if
  end subroutine sample_signals

end module nocdyn_orbit_signals
