!> Cardan joints (Hooke's joints) of two shafts at an angle: tan(phi_2) = tan(phi_1) / cos(angle), where phi_1 is zero when the
!> fork of the first shaft lies in the plane of both shafts.
!>
!> The second shaft then leads by an angle that oscillates twice in a turn; its speed lies between cos(angle) and 1 / cos(angle)
!> times the one of the first: H. Chr. Seherr-Thoss, F. Schmelz, E. Aucktor, Universal Joints and Driveshafts, section 1.2.
module nocdyn_cardan_rows
  use nocdyn_bank, only: role_cardan
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_moving_rows, only: moving_rows_t
  implicit none (type, external)
  private

  public :: new_cardan_rows

  type, extends(moving_rows_t), public :: cardan_rows_t
  contains
    procedure :: motion
  end type cardan_rows_t

contains

  !> A bank of joints; their first shafts are the drivers.
  function new_cardan_rows(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(cardan_rows_t) :: bank

    call bank%connect_rows_only(role_cardan, keys%lanes, keys%names, keys%bodies('bodies', 2))
    call bank%add_parameter('angle', keys%values('angle'), is_key=.false.)
    call bank%add_parameter('phase', keys%values('phase'), is_key=.false.)
  end function new_cardan_rows

  !> phi_2 = phi_1 + atan2((1 - c) sin phi_1 cos phi_1, c cos^2 phi_1 + sin^2 phi_1), c = cos(angle).
  pure subroutine motion(self, element, segment, v, g)
    class(cardan_rows_t), intent(in) :: self
    integer, intent(in) :: element, segment
    real(wp), intent(in) :: v          !! angle of the first body [rad]
    real(wp), intent(out) :: g(0:3)    !! of the second [rad]
    real(wp) :: bend, c, d(0:2), s, shift

    shift = self%parameters(2)%value(1, element)
    c = cos(self%parameters(1)%value(1, element))
    bend = sin(self%parameters(1)%value(1, element))**2
    s = sin(v + shift)
    d(0) = 1.0_wp - bend * (1.0_wp - s**2)
    d(1) = bend * sin(2.0_wp * (v + shift))
    d(2) = 2.0_wp * bend * cos(2.0_wp * (v + shift))
    g(0) = v + atan2((1.0_wp - c) * s * cos(v + shift), c + (1.0_wp - c) * s**2)
    g(1) = c / d(0)
    g(2) = -c * d(1) / d(0)**2
    g(3) = c * (2.0_wp * d(1)**2 / d(0) - d(2)) / d(0)**2
  end subroutine motion

end module nocdyn_cardan_rows
