!> Harmonic excitations, eq. (17): M_0 sin(omega_p t + phase).
module nocdyn_excitations
  use nocdyn_bank, only: bank_t, role_excitation
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  use nocdyn_vector_functions, only: cosine_of, cosines, sine_of, sines
  implicit none (type, external)
  private

  public :: new_excitations

  type, extends(bank_t), public :: excitations_t
    real(wp), allocatable :: amplitude(:, :)   !! M_0 [N m], shape [lanes, excitations]
    real(wp), allocatable :: frequency(:, :)   !! omega_p [rad/s]
    real(wp), allocatable :: phase(:, :)       !! [rad]
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: has_series
    procedure :: forcing_series
    procedure :: to_mean_torque
  end type excitations_t

  integer, parameter :: strip = 64   ! sines that are computed at a time

contains

  !> A bank of excitations, each on one body.
  function new_excitations(names, body, amplitude, frequency, phase) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: amplitude(:, :), frequency(:, :), phase(:, :)   !! [N m], [rad/s], [rad], shape [lanes, excitations]
    type(excitations_t) :: bank

    bank%is_polynomial = .false.
    bank%is_time_only = .true.
    call bank%connect(role_excitation, size(amplitude, 1), names, body)
    bank%amplitude = amplitude
    bank%frequency = frequency
    bank%phase = phase
  end function new_excitations

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(excitations_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]

    call harmonic_torques(self%lanes, self%values, self%amplitude, self%frequency, self%phase, time, applied)
  end subroutine evaluate

  !> Eq. (17).
  pure subroutine harmonic_torques(lanes, n, amplitude, frequency, phase, time, applied)
    integer, intent(in) :: lanes, n
    real(wp), intent(in) :: amplitude(n), frequency(n), phase(n), time(lanes)
    real(wp), intent(inout) :: applied(n)
    real(wp) :: wave(strip)
    integer :: before, i, length, next

    if (n == 1) then
      applied(1) = applied(1) + amplitude(1) * sine_of(frequency(1) * time(1) + phase(1))
      return
    end if
    before = 0
    do while (before < n)
      next = modulo(before, lanes)   ! lane, counted from 0
      length = min(strip, merge(n - before, lanes - next, lanes == 1))
      if (lanes == 1) then
        do i = 1, length
          wave(i) = frequency(before + i) * time(1) + phase(before + i)
        end do
      else
        do i = 1, length
          wave(i) = frequency(before + i) * time(next + i) + phase(before + i)
        end do
      end if
      call sines(length, wave)
      do i = 1, length
        applied(before + i) = applied(before + i) + amplitude(before + i) * wave(i)
      end do
      before = before + length
    end do
  end subroutine harmonic_torques

  pure logical function has_series(self)
    class(excitations_t), intent(in) :: self

    has_series = .true.
  end function has_series

  subroutine forcing_series(self, last, stride, time, applied)
    class(excitations_t), intent(in) :: self
    integer, intent(in) :: last, stride                  !! number of the last coefficient; from column to column
    real(wp), intent(in) :: time(self%lanes)             !! t [s]
    real(wp), intent(inout) :: applied(stride, 0:last)   !! [N m / s^k]

    call harmonic_series(self%lanes, self%values, last, stride, self%amplitude, self%frequency, self%phase, time, applied)
  end subroutine forcing_series

  !> Taylor coefficients from M and M' at the given time, by M'' = -omega_p^2 M.
  pure subroutine harmonic_series(lanes, n, last, stride, amplitude, frequency, phase, time, applied)
    integer, intent(in) :: lanes, n, last, stride
    real(wp), intent(in) :: amplitude(n), frequency(n), phase(n), time(lanes)
    real(wp), intent(inout) :: applied(stride, 0:last)
    real(wp) :: factor
    integer :: e, i, k, l

    do e = 1, n / lanes
      do l = 1, lanes
        i = (e - 1) * lanes + l
        applied(i, 0) = frequency(i) * time(l) + phase(i)
      end do
    end do
    applied(:n, 1) = applied(:n, 0)
    call sines(n, applied(:n, 0))
    call cosines(n, applied(:n, 1))
    do i = 1, n
      applied(i, 0) = amplitude(i) * applied(i, 0)
      applied(i, 1) = amplitude(i) * frequency(i) * applied(i, 1)
    end do
    do k = 2, last
      factor = -1.0_wp / (k * (k - 1))
      do i = 1, n
        applied(i, k) = factor * frequency(i)**2 * applied(i, k - 2)
      end do
    end do
  end subroutine harmonic_series

  subroutine differentiate(self, elements)
    class(excitations_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    integer :: e

    associate (slope => elements%applied_time(:, self%first:self%last()))
      do e = 1, size(self%to)
        slope(:, e) = slope(:, e) + self%amplitude(:, e) * self%frequency(:, e) &
                                    * cosine_of(self%frequency(:, e) * elements%time + self%phase(:, e))
      end do
    end associate
  end subroutine differentiate

  !> The mean of a sine is zero; with the frequency 0 it is a constant.
  subroutine to_mean_torque(self)
    class(excitations_t), intent(inout) :: self

    where (abs(self%frequency) > 0.0_wp) self%amplitude = 0.0_wp
    self%frequency = 0.0_wp
  end subroutine to_mean_torque

  subroutine list_parameters(self, parameters)
    class(excitations_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_key('amplitude', self%amplitude)
    call parameters%add_key('frequency', self%frequency)
    call parameters%add_key('phase', self%phase)
  end subroutine list_parameters

end module nocdyn_excitations
