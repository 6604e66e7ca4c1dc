!> Tables of the angle of one body over the one of another: cams, non-circular gears, levers; splines through their points.
!>
!> These are no formulas of a law: the segment, and the turn of a table that repeats, follow from the angle wherever it is asked
!> for, while the segments of a curve in a law are branches, which end at events. A spline needs none.
module nocdyn_relation_rows
  use nocdyn_bank, only: role_relation
  use nocdyn_bank_states, only: bank_state_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_moving_rows, only: moving_rows_t
  use nocdyn_splines, only: new_spline, spline_t
  implicit none (type, external)
  private

  public :: new_relation_rows

  type, extends(moving_rows_t), public :: relation_rows_t
    integer, allocatable :: points(:)          !! first point of each element, [elements + 1]
    logical, allocatable :: repeats(:)         !! whether its table does, [elements]
    integer, allocatable :: shape(:)           !! spline_..., [elements]
    type(spline_t), allocatable :: spline(:)   !! of each element, in the first lane
  contains
    procedure :: motions
    procedure :: refresh_lane
  end type relation_rows_t

contains

  !> A bank of relations; their first bodies are the drivers.
  function new_relation_rows(keys, repeats, shape) result(bank)
    class(element_keys_t), intent(in) :: keys
    logical, intent(in) :: repeats(:)       !! [relations]
    integer, intent(in) :: shape(:)         !! spline_..., [relations]
    type(relation_rows_t) :: bank
    integer :: e

    call bank%connect_rows_only(role_relation, keys%lanes, keys%names, keys%bodies('bodies', 2))
    allocate (bank%spline(bank%count))
    associate (owner => keys%owners('table_angle'))
      bank%points = [(1 + count(owner < e), e=1, bank%count + 1)]
      call bank%add_parameter('driving', keys%joined('table_angle'), .false., owner)
      call bank%add_parameter('driven', keys%joined('table_driven'), .false., owner)
    end associate
    bank%repeats = repeats
    bank%shape = shape
    call bank%refresh_lane(1)
  end function new_relation_rows

  !> The splines through the points of the first lane.
  subroutine refresh_lane(self, lane)
    class(relation_rows_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: e

    if (lane > 1) return
    do e = 1, self%count
      associate (first => self%points(e), last => self%points(e + 1) - 1)
        self%spline(e) = new_spline(self%parameters(1)%value(1, first:last), self%parameters(2)%value(1, first:last), &
                                    self%repeats(e), self%shape(e))
      end associate
    end do
  end subroutine refresh_lane

  pure subroutine motions(self, state, v, g)
    class(relation_rows_t), intent(in) :: self
    type(bank_state_t), intent(in) :: state
    real(wp), intent(in) :: v(self%count)          !! angles of the first bodies [rad]
    real(wp), intent(out) :: g(0:3, self%count)    !! of the second ones [rad]
    integer :: e

    do e = 1, self%count
      g(:, e) = self%spline(e)%derivatives(v(e))
    end do
  end subroutine motions

end module nocdyn_relation_rows
