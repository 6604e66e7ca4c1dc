!> The list of the columns of trajectory.csv with their labels.
module nocdyn_trajectory_columns
  use nocdyn_bank, only: quantity_t, role_crank
  use nocdyn_constraints, only: constraints_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shafts, only: shafts_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: list_columns, list_points, is_largest_along, column_count, table_bytes

  integer, parameter, public :: column_time = 1
  integer, parameter, public :: column_angle = 2        !! of a body
  integer, parameter, public :: column_speed = 3
  integer, parameter, public :: column_element = 4      !! a quantity of an element of a bank
  integer, parameter, public :: column_reaction = 5     !! multiplier of a constraint row
  integer, parameter, public :: column_member = 6       !! torque of a row on one of its members
  integer, parameter, public :: column_point_moment = 7 !! at a point of a shaft, see `list_points`
  integer, parameter, public :: column_point_stress = 8
  integer, parameter, public :: column_kinetic = 9      !! this and the following: energies and works of the machine
  integer, parameter, public :: column_elastic = 10
  integer, parameter, public :: column_work_in = 11
  integer, parameter, public :: column_work_out = 12
  integer, parameter, public :: column_residual = 13

  character(len=*), parameter, public :: energy_labels(column_kinetic:column_residual) = &
    [character(len=19) :: 'kinetic_energy [J]', 'elastic_energy [J]', 'work_in [J]', 'work_out [J]', 'energy_residual [J]']

  type, public :: column_t
    integer :: kind = column_time   !! column_...
    integer :: bank = 0             !! of an element
    integer :: quantity = 0         !! of the bank: index in `quantities`; of a point: the shaft
    integer :: index = 0            !! of the body, of the element within its bank, of the row or of the member; the point
  end type column_t

contains

  !> All columns of a machine, in the order of the table.
  subroutine list_columns(machine, columns, labels)
    type(machine_t), intent(in) :: machine
    type(column_t), allocatable, intent(out) :: columns(:)
    type(string_t), allocatable, intent(out) :: labels(:)
    type(quantity_t), allocatable :: quantities(:)
    character(len=:), allocatable :: name
    integer :: b, bank, count, e, kind, q

    count = column_count(machine)
    allocate (columns(count), labels(count))
    count = 0
    call add_column(columns, labels, count, column_t(column_time), 't [s]')
    do b = 1, machine%bodies
      name = 'phi_' // machine%names(b)%text // ' [rad]'
      if (is_straight(machine, b)) name = 'x_' // machine%names(b)%text // ' [m]'
      call add_column(columns, labels, count, column_t(column_angle, index=b), name)
    end do
    do b = 1, machine%bodies
      name = 'omega_' // machine%names(b)%text // ' [rad/s]'
      if (is_straight(machine, b)) name = 'v_' // machine%names(b)%text // ' [m/s]'
      call add_column(columns, labels, count, column_t(column_speed, index=b), name)
    end do
    do bank = 1, size(machine%banks)
      quantities = machine%banks(bank)%bank%quantities()
      do q = 1, size(quantities)
        do e = 1, size(quantities(q)%elements)
          associate (element => quantities(q)%elements(e), names => machine%banks(bank)%bank%names)
            call add_column(columns, labels, count, column_t(column_element, bank, q, element), &
                            trim(quantities(q)%name) // '_' // names(element)%text // trim(quantities(q)%suffix) // ' [' // &
                            trim(quantities(q)%unit) // ']')
          end associate
        end do
      end do
    end do
    call add_reactions(machine%constraints, columns, labels, count)
    do kind = column_kinetic, column_residual
      call add_column(columns, labels, count, column_t(kind), trim(energy_labels(kind)))
    end do
  end subroutine list_columns

  !> The columns of all points of a shaft, which the table does not have; none if there is no such shaft.
  subroutine list_points(machine, shaft, kind, columns)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: shaft   !! its name
    integer, intent(in) :: kind             !! column_point_...
    type(column_t), allocatable, intent(out) :: columns(:)
    integer :: b, p, s

    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      type is (shafts_t)
        do s = 1, size(bank%shafts)
          if (bank%names(bank%shafts(s)%first)%text /= shaft) cycle
          allocate (columns(bank%shafts(s)%last_point - bank%shafts(s)%first_point + 1))
          do p = 1, size(columns)
            columns(p) = column_t(kind, b, s, p)
          end do
          return
        end do
      class default
        cycle
      end select
    end do
    allocate (columns(0))
  end subroutine list_points

  !> Whether a column is the largest moment or stress along a shaft with inertia.
  logical function is_largest_along(machine, column, is_stress)
    type(machine_t), intent(in) :: machine
    type(column_t), intent(in) :: column
    logical, intent(out) :: is_stress
    integer :: shaft

    is_largest_along = .false.
    is_stress = .false.
    if (column%kind /= column_element) return
    select type (bank => machine%banks(column%bank)%bank)
    type is (shafts_t)
      is_stress = bank%is_stress(column%quantity)
      shaft = findloc(bank%shafts%first, column%index, dim=1)
      is_largest_along = (is_stress .or. bank%is_largest_moment(column%quantity)) .and. size(bank%shafts(shaft)%elements) > 0
    class default
      return
    end select
  end function is_largest_along

  !> Whether a body moves along a line: pistons and rods of cranks, but not the angles of rods.
  logical function is_straight(machine, body)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body
    integer :: e, i

    is_straight = .false.
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%role /= role_crank .or. bank%moving_rows == 0) cycle
        is_straight = is_straight .or. any([(bank%rows%last_body(e) == body, e=1, min(bank%count, 3))])
      end associate
    end do
  end function is_straight

  pure subroutine add_column(columns, labels, count, column, label)
    type(column_t), intent(inout) :: columns(:)
    type(string_t), intent(inout) :: labels(:)
    integer, intent(inout) :: count
    type(column_t), intent(in) :: column
    character(len=*), intent(in) :: label

    count = count + 1
    columns(count) = column
    labels(count)%text = label
  end subroutine add_column

  !> The multiplier of each row, followed by the torques on those of its members that have a column.
  subroutine add_reactions(constraints, columns, labels, count)
    type(constraints_t), intent(in) :: constraints
    type(column_t), intent(inout) :: columns(:)
    type(string_t), intent(inout) :: labels(:)
    integer, intent(inout) :: count
    character(len=:), allocatable :: name
    integer :: member, row

    member = 1
    do row = 1, constraints%rows()
      call constraints%name_column(row, name)
      call add_column(columns, labels, count, column_t(column_reaction, index=row), &
                      name // ' [' // constraints%units(row)%text // ']')
      do while (member <= size(constraints%members%row))
        if (constraints%members%row(member) /= row) exit
        call add_column(columns, labels, count, column_t(column_member, index=member), &
                        name // '_' // constraints%members%names(member)%text // ' [N m]')
        member = member + 1
      end do
    end do
  end subroutine add_reactions

  !> About the size of a table of numbers as text [bytes].
  pure real(wp) function table_bytes(rows, columns)
    integer, intent(in) :: rows, columns
    real(wp), parameter :: of_number = 19.0_wp   ! 17 digits, point and comma; signs and exponents make up for shorter numbers

    table_bytes = of_number * rows * columns
  end function table_bytes

  !> The number of the columns.
  integer function column_count(machine)
    type(machine_t), intent(in) :: machine
    type(quantity_t), allocatable :: quantities(:)
    integer :: i, q

    column_count = 1 + 2 * machine%bodies + machine%constraints%rows() + size(machine%constraints%members%row) &
                   + size(energy_labels)
    do i = 1, size(machine%banks)
      quantities = machine%banks(i)%bank%quantities()
      do q = 1, size(quantities)
        column_count = column_count + size(quantities(q)%elements)
      end do
    end do
  end function column_count

end module nocdyn_trajectory_columns
