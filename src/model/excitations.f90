!> Harmonic excitations, eq. (17): M_0 sin(omega_p t + phase).
!>
!> The loops over lanes are not vectorised: a vector sine differs from the scalar one in its last bit, and a lane's result
!> would depend on its place in the block.
module nocdyn_excitations
  use nocdyn_bank, only: bank_t, role_excitation
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
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

  subroutine evaluate(self, t)
    class(excitations_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    integer :: e, l

    do e = 1, size(self%to)
      !GCC$ novector
      do l = 1, size(t)
        self%working(l, e) = self%amplitude(l, e) * sin(self%frequency(l, e) * t(l) + self%phase(l, e))
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, t)
    class(excitations_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    integer :: e, l

    do e = 1, size(self%to)
      !GCC$ novector
      do l = 1, size(t)
        self%working_time(l, e) = self%amplitude(l, e) * self%frequency(l, e) &
                                  * cos(self%frequency(l, e) * t(l) + self%phase(l, e))
      end do
    end do
  end subroutine differentiate

end module nocdyn_excitations
