!> The signals of a machine along a periodic motion: half range, largest magnitude and mean.
module nocdyn_orbit_signals
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: differentiated, harmonic_basis_t, new_harmonic_basis
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_orbit_problem, only: signal_range_t
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_signal_values, only: new_signal_values, signal_values_t
  use nocdyn_signals, only: list_signals, signal_angle, signal_kinetic, signal_source_t, signal_t, signal_time
  implicit none (type, external)
  private

  public :: list_orbit_signals, measure_signals

  integer, parameter :: iterations = 6        ! of Newton's method at an extreme
  real(wp), parameter :: near = 0.1_wp        ! samples so near to the extreme, as a share of the range, may be beside it

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
    type(signal_values_t) :: values
    type(signal_source_t), allocatable :: sources(:)
    type(harmonic_basis_t) :: all
    real(wp) :: row(size(signals)), state(equations%machine%states), y(equations%machine%samples, equations%machine%states)
    real(wp) :: t(equations%machine%samples), samples(equations%machine%samples, size(signals))
    integer :: i, l

    call equations%set_value(orbit, error)
    if (allocated(error)) return
    call equations%sample(orbit, equations%basis, t, y)
    sources = signals%source
    values = new_signal_values(equations%machine%formulation, sources)
    call values%observe(t, y)
    do l = 1, size(t)
      state = y(l, :)
      call values%fill_row(l, t(l), state, row)
      samples(l, :) = row
    end do
    all = new_harmonic_basis((size(t) - 1) / 4, size(t))
    do i = 1, size(signals)
      if (signals(i)%source%kind == signal_angle) samples(:, i) = samples(:, i) - &
        dot_product(equations%turning(signals(i)%source%index, :), orbit%speed) * t
      call find_range(all, samples(:, i), ranges(i))
    end do
  end subroutine measure_signals

  !> The range of the trigonometric polynomial through samples.
  subroutine find_range(basis, samples, range)
    type(harmonic_basis_t), intent(in) :: basis
    real(wp), intent(in) :: samples(:)
    type(signal_range_t), intent(out) :: range
    real(wp) :: highest, lowest, series(size(basis%wide, 1))

    series = matmul(basis%wide, samples)
    range%mean = series(1)
    highest = highest_of(samples, series)
    lowest = -highest_of(-samples, -series)
    range%half_range = 0.5_wp * (highest - lowest)
    range%largest = max(abs(highest), abs(lowest))
  end subroutine find_range

  !> The highest value: samples near to the highest one are followed to the maximum beside them.
  pure real(wp) function highest_of(samples, series) result(highest)
    real(wp), intent(in) :: samples(:), series(:)
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    real(wp) :: first(size(series), 1), second(size(series), 1), slope, step, tau
    integer :: i, k, n

    n = size(samples)
    highest = maxval(samples)
    if (.not. highest > minval(samples)) return
    first = differentiated(reshape(series, [size(series), 1]))
    second = differentiated(first)
    associate (bound => highest - near * (highest - minval(samples)))
      do i = 1, n
        if (samples(i) < bound .or. samples(i) < samples(modulo(i, n) + 1) .or. samples(i) < samples(modulo(i - 2, n) + 1)) cycle
        tau = turn * (i - 1) / n
        do k = 1, iterations
          slope = value_of(second(:, 1), tau)
          if (.not. slope < 0) exit
          step = -value_of(first(:, 1), tau) / slope
          tau = tau + min(max(step, -turn / n), turn / n)
        end do
        highest = max(highest, value_of(series, tau))
      end do
    end associate
  end function highest_of

  !> The value of a series.
  pure real(wp) function value_of(series, tau) result(value)
    real(wp), intent(in) :: series(:), tau
    integer :: k

    value = series(1)
    do k = 1, size(series) / 2
      value = value + series(2 * k) * cos(k * tau) + series(2 * k + 1) * sin(k * tau)
    end do
  end function value_of

end module nocdyn_orbit_signals
