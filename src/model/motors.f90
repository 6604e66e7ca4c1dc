!> Motors with a quadratic torque-speed curve, eq. (20): M_m = A - B omega - C omega^2.
module nocdyn_motors
  use nocdyn_bank, only: bank_t, role_motor
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_motors

  type, extends(bank_t), public :: motors_t
    real(wp), allocatable :: a(:, :)   !! stall torque A [N m], shape [lanes, motors]
    real(wp), allocatable :: b(:, :)   !! B [N m s/rad]
    real(wp), allocatable :: c(:, :)   !! C [N m s2/rad2]
  contains
    procedure :: evaluate
    procedure :: differentiate
  end type motors_t

contains

  !> A bank of motors, each on one body.
  function new_motors(names, body, a, b, c) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: a(:, :), b(:, :), c(:, :)   !! [lanes, motors]
    type(motors_t) :: bank
    integer :: e

    call bank%connect(role_motor, size(a, 1), names, [(0, e=1, size(body))], body)
    bank%a = a
    bank%b = b
    bank%c = c
  end function new_motors

  subroutine evaluate(self, t)
    class(motors_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(t)
        self%working(l, e) = self%a(l, e) - (self%b(l, e) + self%c(l, e) * self%speed(l, e)) * self%speed(l, e)
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, t)
    class(motors_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(t)
        self%working_speed(l, e) = -self%b(l, e) - 2.0_wp * self%c(l, e) * self%speed(l, e)
      end do
    end do
  end subroutine differentiate

end module nocdyn_motors
