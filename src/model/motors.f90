!> Motors with a quadratic torque-speed curve, eq. (20): M_m = A - B omega - C omega^2.
module nocdyn_motors
  use nocdyn_bank, only: bank_t, role_motor
  use nocdyn_elements, only: elements_t
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

  subroutine evaluate(self, time, angle, speed, restoring, working)
    class(motors_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), working(self%values)

    call motor_torques(self%values, self%a, self%b, self%c, speed, working)
  end subroutine evaluate

  !> Eq. (20).
  pure subroutine motor_torques(n, a, b, c, speed, working)
    integer, intent(in) :: n
    real(wp), intent(in) :: a(n), b(n), c(n), speed(n)
    real(wp), intent(inout) :: working(n)
    integer :: i

    do i = 1, n
      working(i) = a(i) - (b(i) + c(i) * speed(i)) * speed(i)
    end do
  end subroutine motor_torques

  subroutine differentiate(self, elements)
    class(motors_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        elements%working_speed(l, i) = -self%b(l, e) - 2.0_wp * self%c(l, e) * elements%speed(l, i)
      end do
    end do
  end subroutine differentiate

end module nocdyn_motors
