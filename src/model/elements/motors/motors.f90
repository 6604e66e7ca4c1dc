!> Motors with a quadratic torque-speed curve, eq. (20): M_m = A - B omega - C omega^2.
module nocdyn_motors
  use nocdyn_bank, only: bank_t, role_motor
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_motors

  type, extends(bank_t), public :: motors_t
    real(wp), allocatable :: a(:, :)   !! stall torque A [N m], shape [lanes, motors]
    real(wp), allocatable :: b(:, :)   !! B [N m s/rad]
    real(wp), allocatable :: c(:, :)   !! C [N m s2/rad2]
  contains
    procedure :: list_parameters
    procedure :: polynomials
  end type motors_t

contains

  !> A bank of motors, each on one body.
  function new_motors(names, body, a, b, c) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: a(:, :), b(:, :), c(:, :)   !! [N m], [N m s/rad], [N m s2/rad2], shape [lanes, motors]
    type(motors_t) :: bank
    integer :: e

    call bank%connect(role_motor, size(a, 1), names, [(0, e=1, size(body))], body)
    bank%a = a
    bank%b = b
    bank%c = c
  end function new_motors

  subroutine polynomials(self, laws)
    class(motors_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    associate (first => self%first, last => self%last())
      laws%constant(:, first:last) = self%a
      laws%by_speed(:, first:last) = -self%b
      laws%by_speed_squared(:, first:last) = -self%c
    end associate
  end subroutine polynomials

  subroutine list_parameters(self, parameters)
    class(motors_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_key('a', self%a)
    call parameters%add_key('b', self%b)
    call parameters%add_key('c', self%c)
  end subroutine list_parameters

end module nocdyn_motors
