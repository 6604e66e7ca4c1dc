!> The rows of L_lambda, eqs. (8), (23): linear relations between the speeds of bodies that are joined rigidly.
module nocdyn_constraints
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_sparse_map, only: transposed_order
  use nocdyn_text, only: selected, string_t, strings
  implicit none (type, external)
  private

  public :: new_constraints

  !> Torques of rows on some of their members, reported beside the multipliers: factor * multiplier [N m].
  type, public :: member_torques_t
    type(string_t), allocatable :: names(:)   !! names of the members, such as 'ring'
    integer, allocatable :: row(:)            !! row of each member, ascending
    real(wp), allocatable :: factor(:, :)     !! coefficient of the member in the row, [lanes, members]
  end type member_torques_t

  !> Row r: sum over its entries of coefficient * omega(body) = demand, entries first(r) to first(r + 1) - 1. Only drives of a
  !> steady state have a demand; the coordinates leave it out (`driven_speed` of a machine).
  type, public :: constraints_t
    integer :: bodies = 0                        !! bodies of the machine
    type(string_t), allocatable :: kinds(:)      !! what the input calls each row, such as 'gear'
    type(string_t), allocatable :: names(:)      !! names of the rows
    type(string_t), allocatable :: units(:)      !! units of the multipliers
    integer, allocatable :: first(:)             !! first entry of each row, [rows + 1]
    integer, allocatable :: body(:)              !! [entries], different bodies in each row
    real(wp), allocatable :: coefficient(:, :)   !! never 0, [lanes, entries]
    real(wp), allocatable :: least(:), most(:)   !! the multipliers that steady states may have, huge without bounds, [rows]
    real(wp), allocatable :: demand(:)           !! [rad/s] of a drive, [rows]
    logical, allocatable :: may_stop(:)          !! whether bodies may be held still by the row, as by a closed brake
    type(member_torques_t) :: members
  contains
    procedure :: rows
    procedure :: entries
    procedure :: is_of_teeth
    procedure :: pair_coefficients
    procedure :: subset
    procedure :: list_body_rows
    procedure :: block
    procedure :: residual
    procedure :: pass_parameters
  end type constraints_t

contains

  !> Rows from their entries; the arrays are components of `constraints_t`.
  function new_constraints(bodies, names, units, first, body, coefficient, kinds, members) result(constraints)
    integer, intent(in) :: bodies   !! bodies of the machine
    type(string_t), intent(in) :: names(:), units(:)
    integer, intent(in) :: first(:), body(:)
    real(wp), intent(in) :: coefficient(:, :)                 !! [lanes, entries]
    type(string_t), intent(in), optional :: kinds(:)          !! all are 'constraint' if absent
    type(member_torques_t), intent(in), optional :: members   !! none if absent
    type(constraints_t) :: constraints

    if (size(first) /= size(names) + 1) error stop 'nocdyn_constraints: first must have one entry more than names'
    constraints%bodies = bodies
    allocate (constraints%names, source=names)
    allocate (constraints%units, source=units)
    allocate (constraints%first, source=first)
    allocate (constraints%body, source=body)
    allocate (constraints%coefficient, source=coefficient)
    if (present(kinds)) then
      allocate (constraints%kinds, source=kinds)
    else
      allocate (constraints%kinds, source=strings(spread('constraint', 1, size(names))))
    end if
    allocate (constraints%may_stop(size(names)), source=.false.)
    allocate (constraints%demand(size(names)), source=0.0_wp)
    allocate (constraints%most(size(names)), source=huge(1.0_wp))
    allocate (constraints%least, source=-constraints%most)
    if (present(members)) then
      constraints%members = members
    else
      allocate (constraints%members%names(0), constraints%members%row(0), constraints%members%factor(size(coefficient, 1), 0))
    end if
  end function new_constraints

  !> Number of rows.
  pure integer function rows(self)
    class(constraints_t), intent(in) :: self

    rows = size(self%names)
  end function rows

  !> Whether a row is one of gears, whose multiplier is a reaction; the multiplier of other rows, as of clutches, is a torque.
  pure logical function is_of_teeth(self, row)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: row

    is_of_teeth = any(self%kinds(row)%text == [character(len=12) :: 'gear', 'planetary', 'differential', 'constraint'])
  end function is_of_teeth

  !> Number of bodies in a row.
  pure integer function entries(self, row)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: row

    entries = self%first(row + 1) - self%first(row)
  end function entries

  !> Coefficients of a body and of the other body, in a row of two bodies.
  pure subroutine pair_coefficients(self, lane, row, body, own, other)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: lane, row, body   !! `body` is one of the two
    real(wp), intent(out) :: own, other      !! coefficients of `body` and of the other body

    associate (first => self%first(row))
      if (self%body(first) == body) then
        own = self%coefficient(lane, first)
        other = self%coefficient(lane, first + 1)
      else
        own = self%coefficient(lane, first + 1)
        other = self%coefficient(lane, first)
      end if
    end associate
  end subroutine pair_coefficients

  !> Some of the rows, without their torques on members.
  function subset(self, rows) result(some)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: rows(:)
    type(constraints_t) :: some
    integer :: entry(sum(self%first(rows + 1) - self%first(rows))), first(size(rows) + 1), i, k

    first(1) = 1
    do i = 1, size(rows)
      first(i + 1) = first(i) + self%entries(rows(i))
      entry(first(i):first(i + 1) - 1) = [(k, k=self%first(rows(i)), self%first(rows(i) + 1) - 1)]
    end do
    some = new_constraints(self%bodies, selected(self%names, rows), selected(self%units, rows), first, self%body(entry), &
                           self%coefficient(:, entry))
  end function subset

  !> Lists the chosen rows of each body, ascending: row(first(b)) to row(first(b + 1) - 1).
  subroutine list_body_rows(self, is_chosen, first, row)
    class(constraints_t), intent(in) :: self
    logical, intent(in) :: is_chosen(:)                     !! [rows]
    integer, allocatable, intent(out) :: first(:), row(:)   !! [bodies + 1], [entries of the chosen rows]
    integer :: body(size(self%body)), row_of(size(self%body))   ! of each entry of a chosen row
    integer, allocatable :: order(:)
    integer :: entry, n, r

    n = 0
    do r = 1, size(is_chosen)
      if (.not. is_chosen(r)) cycle
      do entry = self%first(r), self%first(r + 1) - 1
        n = n + 1
        body(n) = self%body(entry)
        row_of(n) = r
      end do
    end do
    allocate (first(self%bodies + 1), order(n))
    call transposed_order(body(:n), self%bodies, order, first)
    row = row_of(order)
  end subroutine list_body_rows

  !> Dense submatrix of L_lambda for the given rows and bodies.
  pure function block(self, lane, chosen, bodies) result(dense)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: chosen(:)   !! rows
    integer, intent(in) :: bodies(:)   !! columns
    real(wp) :: dense(size(chosen), size(bodies))
    integer :: column, entry, i

    dense = 0.0_wp
    do i = 1, size(chosen)
      do entry = self%first(chosen(i)), self%first(chosen(i) + 1) - 1
        column = findloc(bodies, self%body(entry), dim=1)
        if (column > 0) dense(i, column) = self%coefficient(lane, entry)
      end do
    end do
  end function block

  !> L_lambda omega of one row, and the sum of its absolute terms as a measure of rounding.
  pure subroutine residual(self, lane, row, omega, value, scale)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: lane, row
    real(wp), intent(in) :: omega(:)        !! [rad/s], [bodies]
    real(wp), intent(out) :: value, scale   !! in the unit of the row
    integer :: entry

    value = 0.0_wp
    scale = 0.0_wp
    do entry = self%first(row), self%first(row + 1) - 1
      value = value + self%coefficient(lane, entry) * omega(self%body(entry))
      scale = scale + abs(self%coefficient(lane, entry) * omega(self%body(entry)))
    end do
  end subroutine residual

  !> Passes the arrays whose values may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(constraints_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%first, self%body)
    call parameters%add('constraints: coefficient', self%coefficient)
    call parameters%add('constraints: factor', self%members%factor)
  end subroutine pass_parameters

end module nocdyn_constraints
