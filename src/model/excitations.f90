!> Harmonic excitations, eq. (17): M_0 sin(omega_p t + phase).
module nocdyn_excitations
  use nocdyn_bank, only: bank_t, role_excitation
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  use nocdyn_vector_functions, only: cosines, sine_of, sines
  implicit none (type, external)
  private

  public :: new_excitations

  type, extends(bank_t), public :: excitations_t
    real(wp), allocatable :: amplitude(:, :)   !! M_0 [N m], shape [lanes, excitations]
    real(wp), allocatable :: frequency(:, :)   !! omega_p [rad/s]
    real(wp), allocatable :: phase(:, :)       !! [rad]
  contains
    procedure :: evaluate
    procedure :: differentiate
    procedure :: settle
  end type excitations_t

  integer, parameter :: strip = 64   ! arguments whose sines are taken at a time

contains

  !> A bank of excitations, each on one body.
  function new_excitations(names, body, amplitude, frequency, phase) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: amplitude(:, :), frequency(:, :), phase(:, :)   !! [lanes, excitations]
    type(excitations_t) :: bank
    integer :: e

    bank%is_polynomial = .false.
    call bank%connect(role_excitation, size(amplitude, 1), names, [(0, e=1, size(body))], body)
    bank%amplitude = amplitude
    bank%frequency = frequency
    bank%phase = phase
  end function new_excitations

  subroutine evaluate(self, time, angle, speed, restoring, working)
    class(excitations_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), working(self%values)

    call harmonic_torques(self%lanes, self%values, self%amplitude, self%frequency, self%phase, time, working)
  end subroutine evaluate

  !> Eq. (17).
  pure subroutine harmonic_torques(lanes, n, amplitude, frequency, phase, time, working)
    integer, intent(in) :: lanes, n
    real(wp), intent(in) :: amplitude(n), frequency(n), phase(n), time(lanes)
    real(wp), intent(inout) :: working(n)
    real(wp) :: wave(strip)
    integer :: before, i, length, next

    if (n == 1) then
      working(1) = working(1) + amplitude(1) * sine_of(frequency(1) * time(1) + phase(1))
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
        working(before + i) = working(before + i) + amplitude(before + i) * wave(i)
      end do
      before = before + length
    end do
  end subroutine harmonic_torques

  subroutine differentiate(self, elements)
    class(excitations_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: wave(1)
    integer :: e, l

    associate (slope => elements%working_time(:, self%first:self%last()))
      do e = 1, size(self%to)
        do l = 1, self%lanes
          wave(1) = self%frequency(l, e) * elements%time(l) + self%phase(l, e)
          call cosines(1, wave)
          slope(l, e) = slope(l, e) + self%amplitude(l, e) * self%frequency(l, e) * wave(1)
        end do
      end do
    end associate
  end subroutine differentiate

  !> The mean of a sine is zero.
  subroutine settle(self)
    class(excitations_t), intent(inout) :: self

    self%amplitude = 0.0_wp
    self%frequency = 0.0_wp
  end subroutine settle

end module nocdyn_excitations
