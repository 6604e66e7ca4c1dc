!> Loads: the viscous resistance of eq. (5), M_r = -c omega.
module nocdyn_loads
  use nocdyn_bank, only: bank_t, role_load
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_loads

  !> The coefficients c are the `damping` of the bank.
  type, extends(bank_t), public :: loads_t
  contains
    procedure :: evaluate
    procedure :: differentiate
  end type loads_t

contains

  !> A bank of viscous loads, each on one body.
  function new_loads(names, body, viscous) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
    type(loads_t) :: bank
    integer :: e

    call bank%connect(role_load, size(viscous, 1), names, [(0, e=1, size(body))], body)
    bank%damping = viscous
  end function new_loads

  subroutine evaluate(self, t)
    class(loads_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(t)
        self%working(l, e) = -self%damping(l, e) * self%speed(l, e)
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, t)
    class(loads_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)

    self%working_speed(:size(t), :) = -self%damping
  end subroutine differentiate

end module nocdyn_loads
