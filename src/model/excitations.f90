!> Harmonic excitations, eq. (17): M_0 sin(omega_p t + phase).
module nocdyn_excitations
  use nocdyn_bank, only: bank_t, role_excitation
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  use nocdyn_vector_functions, only: cosines, sines
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
  end type excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_excitations(names, body, amplitude, frequency, phase) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: amplitude(:, :), frequency(:, :), phase(:, :)   !! [lanes, excitations]
    type(excitations_t) :: bank
    integer :: e

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
    integer :: i, l

    if (lanes == 1) then
      do i = 1, n
        working(i) = frequency(i) * time(1) + phase(i)
      end do
    else
      do i = 0, n - lanes, lanes
        do l = 1, lanes
          working(i + l) = frequency(i + l) * time(l) + phase(i + l)
        end do
      end do
    end if
    call sines(n, working)
    do i = 1, n
      working(i) = amplitude(i) * working(i)
    end do
  end subroutine harmonic_torques

  subroutine differentiate(self, elements)
    class(excitations_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    integer :: e, l

    associate (slope => elements%working_time(:, self%first:self%last()))
      do e = 1, size(self%to)
        do l = 1, self%lanes
          slope(l, e) = self%frequency(l, e) * elements%time(l) + self%phase(l, e)
        end do
      end do
      call cosines(size(slope), slope)
      slope = self%amplitude * self%frequency * slope
    end associate
  end subroutine differentiate

end module nocdyn_excitations
