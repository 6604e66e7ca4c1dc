!> The rigid part of a machine: rows of L_lambda, eqs. (8), (23), each a linear relation between body speeds.
module nocdyn_constraints
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_constraints

  !> Row r: sum over its entries of coefficient * omega(body) = 0, entries first(r) to first(r + 1) - 1.
  type, public :: constraints_t
    integer :: bodies = 0                        !! of the machine
    type(string_t), allocatable :: names(:)      !! of the rows
    type(string_t), allocatable :: units(:)      !! of their multipliers
    integer, allocatable :: first(:)             !! [rows + 1]
    integer, allocatable :: body(:)              !! [entries]
    real(wp), allocatable :: coefficient(:, :)   !! never 0, [lanes, entries]
  contains
    procedure :: rows
    procedure :: block
    procedure :: residual
  end type constraints_t

contains

  !> Rows from their entries; the arrays are described at `constraints_t`.
  function new_constraints(bodies, names, units, first, body, coefficient) result(constraints)
    integer, intent(in) :: bodies
    type(string_t), intent(in) :: names(:), units(:)
    integer, intent(in) :: first(:), body(:)
    real(wp), intent(in) :: coefficient(:, :)
    type(constraints_t) :: constraints

    if (size(first) /= size(names) + 1) error stop 'nocdyn_constraints: first must have one entry more than names'
    constraints = constraints_t(bodies, names, units, first, body, coefficient)
  end function new_constraints

  pure integer function rows(self)
    class(constraints_t), intent(in) :: self

    rows = size(self%names)
  end function rows

  !> The dense part of L_lambda in the given rows and columns.
  pure function block(self, lane, chosen, bodies) result(dense)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: chosen(:)   !! rows
    integer, intent(in) :: bodies(:)   !! columns; no row may have an entry outside them
    real(wp) :: dense(size(chosen), size(bodies))
    integer :: column, entry, i

    dense = 0.0_wp
    do i = 1, size(chosen)
      do entry = self%first(chosen(i)), self%first(chosen(i) + 1) - 1
        column = findloc(bodies, self%body(entry), dim=1)
        dense(i, column) = dense(i, column) + self%coefficient(lane, entry)
      end do
    end do
  end function block

  !> L_lambda omega of one row, and the sum of its absolute terms as the measure of what is small.
  pure subroutine residual(self, lane, row, omega, value, scale)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: lane, row
    real(wp), intent(in) :: omega(:)   !! [bodies]
    real(wp), intent(out) :: value, scale
    integer :: entry

    value = 0.0_wp
    scale = 0.0_wp
    do entry = self%first(row), self%first(row + 1) - 1
      value = value + self%coefficient(lane, entry) * omega(self%body(entry))
      scale = scale + abs(self%coefficient(lane, entry) * omega(self%body(entry)))
    end do
  end subroutine residual

end module nocdyn_constraints
