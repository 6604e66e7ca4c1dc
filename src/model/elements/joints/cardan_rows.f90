!> Cardan joints (Hooke's joints) of two shafts at an angle: tan(phi_2) = tan(phi_1) / cos(angle), where phi_1 is zero when the
!> fork of the first shaft lies in the plane of both shafts.
!>
!> The second shaft then leads by an angle that oscillates twice in a turn; its speed lies between cos(angle) and 1 / cos(angle)
!> times the one of the first: H. Chr. Seherr-Thoss, F. Schmelz, E. Aucktor, Universal Joints and Driveshafts, section 1.2.
module nocdyn_cardan_rows
  use nocdyn_bank, only: role_cardan
  use nocdyn_described_rows, only: described_rows_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(+), operator(-), operator(/)
  use nocdyn_law_functions, only: atan, cos, sin
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_cardan_rows

  type, extends(described_rows_t), public :: cardan_rows_t
  contains
    procedure :: describe
  end type cardan_rows_t

contains

  !> A bank of joints; their first shafts are the drivers.
  function new_cardan_rows(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(cardan_rows_t) :: bank

    call bank%connect_rows_only(role_cardan, keys%lanes, keys%names, keys%bodies('bodies', 2))
    call bank%add_parameter('angle', keys%values('angle'), is_key=.false.)
    call bank%add_parameter('phase', keys%values('phase'), is_key=.false.)
    call bank%prepare_rows()
  end function new_cardan_rows

  !> phi_2 = phi_1 - atan(m sin(2 phi_1) / (1 + m cos(2 phi_1))), m = -tan^2(angle / 2) = (c - 1) / (c + 1), c = cos(angle).
  subroutine describe(self, tape)
    class(cardan_rows_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: c, m, twice, v

    v = self%driver(tape)
    c = cos(self%parameter(tape, 'angle'))
    m = (c - 1.0_wp) / (c + 1.0_wp)
    twice = 2.0_wp * (v + self%parameter(tape, 'phase'))
    tape%row = [node_of(v - atan(sin(twice) * (m / (m * cos(twice) + 1.0_wp))))]
  end subroutine describe

end module nocdyn_cardan_rows
