!> A periodic motion as series, from its states at even times, and its state from series.
module nocdyn_orbit_series
  use nocdyn_harmonic_basis, only: harmonic_basis_t, new_harmonic_basis
  use nocdyn_kinds, only: wp
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  implicit none (type, external)
  private

  public :: find_series, state_of_series

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter :: harmonics = 15

contains

  !> The series of a period. Where orders excite, the time is counted from where the mean angle is zero.
  subroutine find_series(periodic, states, begin, period, guess)
    type(periodic_machine_t), intent(in) :: periodic
    real(wp), intent(in) :: states(:, :)        !! coordinates and internal states, [nodes, samples + 1]
    real(wp), intent(in) :: begin               !! time of the first sample [s]
    real(wp), intent(in) :: period              !! [s]
    type(orbit_t), intent(inout) :: guess
    type(harmonic_basis_t) :: basis
    real(wp) :: beside(size(states, 2) - 1, size(states, 1)), mean(size(periodic%free)), phase
    real(wp) :: series(2 * harmonics + 1, size(states, 1))
    integer :: i, k, samples

    samples = size(states, 2) - 1
    guess%speed = (states(periodic%free, samples + 1) - states(periodic%free, 1)) / period
    beside = transpose(states(:, :samples))
    associate (f => periodic%machine%freedoms, steady => matmul(periodic%rigid, guess%speed))
      do i = 1, samples
        beside(i, :f) = beside(i, :f) - steady * (period * (i - 1) / samples)
      end do
    end associate
    basis = new_harmonic_basis(harmonics, samples)
    series = basis%coefficients_of(beside, harmonics)
    mean = series(1, periodic%free)
    associate (f => periodic%machine%freedoms, m => periodic%period%motion)
      series(1, :f) = series(1, :f) - matmul(periodic%rigid, mean)
      phase = turn / period * begin
      if (m > 0) phase = turn / period * mean(m) / guess%speed(m)
      guess%series = series
      do k = 1, harmonics
        guess%series(2 * k, :) = cos(k * phase) * series(2 * k, :) - sin(k * phase) * series(2 * k + 1, :)
        guess%series(2 * k + 1, :) = sin(k * phase) * series(2 * k, :) + cos(k * phase) * series(2 * k + 1, :)
      end do
    end associate
  end subroutine find_series

  !> The state of series where the angles of the free rotations are zero; where orders excite, it comes at another time.
  subroutine state_of_series(periodic, orbit, state)
    type(periodic_machine_t), intent(in) :: periodic
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(out) :: state(:)
    integer, parameter :: corrections = 20
    real(wp) :: angle, phase, steady(periodic%machine%freedoms)
    integer :: i, k

    associate (f => periodic%machine%freedoms, m => periodic%period%motion)
      steady = matmul(periodic%rigid, orbit%speed)
      phase = 0.0_wp
      do i = 1, merge(corrections, 0, m > 0)
        call values_at(phase)
        angle = state(f + periodic%free(m)) + orbit%speed(m) * phase / orbit%rate
        phase = phase - angle * orbit%rate / orbit%speed(m)
      end do
      call values_at(phase)
      state(:f) = state(:f) + steady
    end associate

  contains

    subroutine values_at(tau)
      real(wp), intent(in) :: tau

      associate (f => periodic%machine%freedoms, series => orbit%series)
        state(:f) = 0.0_wp
        state(f + 1:) = series(1, :)
        state(f + periodic%free) = 0.0_wp
        do k = 1, size(series, 1) / 2
          state(f + 1:) = state(f + 1:) + series(2 * k, :) * cos(k * tau) + series(2 * k + 1, :) * sin(k * tau)
          state(:f) = state(:f) + (k * orbit%rate) * (series(2 * k + 1, :f) * cos(k * tau) - series(2 * k, :f) * sin(k * tau))
        end do
      end associate
    end subroutine values_at

  end subroutine state_of_series

end module nocdyn_orbit_series
