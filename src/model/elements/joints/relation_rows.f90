!> Tables of the angle of one body over that of another: cams, non-circular gears, levers; splines through their points.
module nocdyn_relation_rows
  use nocdyn_bank, only: role_relation
  use nocdyn_element_rows, only: rows_between
  use nocdyn_kinds, only: wp
  use nocdyn_moving_rows, only: moving_rows_t
  use nocdyn_splines, only: spline_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_relation_rows

  type, extends(moving_rows_t), public :: relation_rows_t
    type(spline_t), allocatable :: spline(:)   !! of each element, in the first lane
  contains
    procedure :: motion
  end type relation_rows_t

contains

  !> A bank of relations; their first bodies are the drivers.
  function new_relation_rows(lanes, names, driven, spline) result(bank)
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: driven(:)          !! the second bodies
    type(spline_t), intent(in) :: spline(:)   !! [relations]
    type(relation_rows_t) :: bank

    call bank%connect_rows_only(role_relation, lanes, names, rows_between(0 * driven, driven))
    allocate (bank%spline, source=spline)
  end function new_relation_rows

  pure subroutine motion(self, element, v, g)
    class(relation_rows_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: v          !! angle of the first body [rad]
    real(wp), intent(out) :: g(0:3)    !! of the second [rad]

    g = self%spline(element)%derivatives(v)
  end subroutine motion

end module nocdyn_relation_rows
