!> The mass-elastic sheet of a machine, a table with a row for each body and the coupling, shaft or gear from it to another one;
!> `nocdyn import` reads it. Numbers have all their digits, in SI units.
module nocdyn_mass_elastic_sheet
  use nocdyn_derived_values, only: derive_values
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_schema, only: first_key, has_word, key_rules
  use nocdyn_text, only: append, quoted, string_t, to_text
  use nocdyn_version, only: version
  implicit none (type, external)
  private

  public :: put_sheet, left_out

  character(len=*), parameter, public :: sheet_file = 'mass_elastic.csv'
  character(len=*), parameter :: headings = 'station,name,inertia [kg m2],speed ratio,connects to,connection,' // &
    'stiffness [N m/rad],damping [N m s/rad],relative damping,magnifier,damping frequency [rad/s],outer diameter [m],' // &
    'inner diameter [m],length [m],shear modulus [Pa],density [kg/m3]'
  !> Keys that the sheet holds, in the order of its columns from stiffness on.
  character(len=*), parameter :: body_keys = 'name inertia', gear_keys = 'name bodies radii teeth internal', &
    coupling_keys = 'stiffness damping relative_damping magnifier damping_frequency diameter bore', &
    shaft_keys = '- - relative_damping - damping_frequency diameters bores lengths shear_modulus density'
  integer, parameter :: columns_behind = 10   ! the connection's name

  !> A coupling, shaft or gear.
  type :: connection_t
    integer :: group        !! index in the input
    integer :: ends(2)      !! stations of its bodies, 0: the ground
    real(wp) :: step        !! speed of the second one by the one of the first
  end type connection_t

contains

  !> Writes the sheet. Comments at its head say what it does not hold.
  subroutine put_sheet(given, file)
    type(input_t), intent(in) :: given
    type(output_file_t), intent(inout) :: file
    type(input_t), allocatable :: input   ! with the numbers of dampers and rubber couplings that follow from others
    integer, allocatable :: bodies(:)
    integer :: b, c, g
    logical :: is_first
    real(wp), allocatable :: ratios(:)
    type(connection_t), allocatable :: connections(:)
    type(string_t), allocatable :: missing(:)

    allocate (input, source=given)
    call derive_values(input)
    call file%put('# Mass-elastic data of ' // given%shown_file() // ', nocdyn ' // version // new_line('a'))
    call left_out(given, missing)
    do g = 1, size(missing)
      call file%put('# not in this sheet: ' // missing(g)%text // new_line('a'))
    end do
    call file%put(headings // new_line('a'))
    bodies = input%groups_named('body')
    call list_connections(input, bodies, connections)
    call find_ratios(connections, size(bodies), ratios)
    do b = 1, size(bodies)
      is_first = .true.
      do c = 1, size(connections)
        if (station_of(connections(c)) == b) call put_row(connection_cells(input%groups(connections(c)%group), &
                                                                           sum(connections(c)%ends) - b))
      end do
      if (is_first) call put_row('-' // repeat(',', columns_behind + 1))
    end do

  contains

    subroutine put_row(rest)
      character(len=*), intent(in) :: rest   !! from the column 'connects to' on

      associate (body => input%groups(bodies(b)))
        if (is_first) then
          call file%put(to_text(b) // ',' // cell(body%name) // ',' // to_text(body%number('inertia')) // ',' // &
                        to_text(ratios(b)) // ',' // rest // new_line('a'))
        else
          call file%put(to_text(b) // ',,,,' // rest // new_line('a'))
        end if
      end associate
      is_first = .false.
    end subroutine put_row

  end subroutine put_sheet

  !> What of the input the sheet does not hold, for the user: "coupling 'rubber': gap, cubic_stiffness", "motor 'drive'".
  subroutine left_out(input, missing)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(out) :: missing(:)
    character(len=:), allocatable :: keys
    integer :: g

    allocate (missing(0))
    do g = 1, size(input%groups)
      associate (group => input%groups(g))
        select case (group%kind)
        case ('case', 'run', 'output', 'sweep', 'vary', 'record', 'load_case', 'response', 'transit', 'orbit', 'damper')
          cycle
        case ('body')
          keys = other_keys(group, body_keys)
        case ('coupling')
          keys = other_keys(group, 'name bodies ' // coupling_keys)
        case ('shaft')
          keys = other_keys(group, 'name bodies ' // shaft_keys)
        case ('gear')
          keys = other_keys(group, gear_keys)
          if (group%is_given('radii')) keys = keys // ', radii (their ratio is in it)'
          if (group%is_given('teeth')) keys = keys // ', teeth (their ratio is in it)'
        case default
          keys = ' '
        end select
        if (keys == '') then
          if (len(keys) == 0) cycle
          call append(missing, trim(group%kind // ' ' // merge_name(group%name)))
        else
          call append(missing, group%kind // ' ' // quoted(group%name) // ': ' // keys(3:))
        end if
      end associate
    end do
  end subroutine left_out

  pure function merge_name(name) result(text)
    character(len=*), intent(in) :: name   !! '' of groups without names
    character(len=:), allocatable :: text

    text = ''
    if (name /= '') text = quoted(name)
  end function merge_name

  !> The keys of a group with values other than their defaults, but for some: ", gap, friction".
  function other_keys(group, held) result(text)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: held   !! separated by blanks
    character(len=:), allocatable :: text
    integer :: k

    text = ''
    do k = 1, size(group%values)
      associate (rule => key_rules(first_key(group%rule) + k - 1))
        if (has_word(held, rule%name) .or. .not. group%values(k)%has_any()) cycle
        if (.not. group%values(k)%is_given .or. is_default(group%values(k), trim(rule%default))) cycle
        text = text // ', ' // trim(rule%name)
      end associate
    end do
  end function other_keys

  !> Whether all values of a key are its default.
  pure logical function is_default(value, default)
    type(value_t), intent(in) :: value
    character(len=*), intent(in) :: default   !! as the schema writes it
    integer :: i

    is_default = .true.
    do i = 1, value%count()
      if (allocated(value%numbers)) then
        is_default = is_default .and. to_text(value%numbers(i)) == default
      else if (allocated(value%whole_numbers)) then
        is_default = is_default .and. to_text(value%whole_numbers(i)) == default
      else if (allocated(value%flags)) then
        is_default = is_default .and. trim(merge('.true. ', '.false.', value%flags(i))) == default
      else
        is_default = is_default .and. quoted(value%texts(i)%text) == default
      end if
    end do
  end function is_default

  !> The couplings, shafts and gears of a machine.
  subroutine list_connections(input, bodies, connections)
    type(input_t), intent(in) :: input
    integer, intent(in) :: bodies(:)   !! indices of the groups, by station
    type(connection_t), allocatable, intent(out) :: connections(:)
    type(string_t) :: ends(2)
    integer :: c, e, g

    allocate (connections(count([(has_word('coupling shaft gear', input%groups(g)%kind), g=1, size(input%groups))])))
    c = 0
    do g = 1, size(input%groups)
      if (.not. has_word('coupling shaft gear', input%groups(g)%kind)) cycle
      c = c + 1
      ends = input%groups(g)%texts('bodies')
      connections(c)%group = g
      do e = 1, 2
        connections(c)%ends(e) = body_index(input, bodies, ends(e)%text)
      end do
      connections(c)%step = ratio_of(input%groups(g))
    end do
  end subroutine list_connections

  !> The station in whose rows a connection stands, its first body, or the second one if the first is the ground.
  elemental integer function station_of(connection) result(station)
    type(connection_t), intent(in) :: connection

    station = connection%ends(1)
    if (station == 0) station = connection%ends(2)
  end function station_of

  !> Station of a body, 0: the ground.
  pure integer function body_index(input, bodies, name) result(station)
    type(input_t), intent(in) :: input
    integer, intent(in) :: bodies(:)   !! as of `list_connections`
    character(len=*), intent(in) :: name

    do station = size(bodies), 1, -1
      if (input%groups(bodies(station))%name == name) return
    end do
  end function body_index

  !> The cells of a connection, from 'connects to' on.
  function connection_cells(group, other) result(text)
    type(group_t), intent(in) :: group
    integer, intent(in) :: other   !! the station that it connects to, 0: the ground
    character(len=:), allocatable :: text

    text = 'ground'
    if (other > 0) text = to_text(other)
    text = text // ',' // cell(group%name)
    select case (group%kind)
    case ('gear')
      text = text // ',gear' // repeat(',', columns_behind - 1)
    case ('coupling')
      text = text // cells(group, coupling_keys) // repeat(',', 3)
    case default
      text = text // cells(group, shaft_keys)
    end select
  end function connection_cells

  !> The values of some keys, each with a comma before it; values of a list separated by '|'.
  function cells(group, keys) result(text)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: keys   !! separated by blanks; '-': an empty cell
    character(len=:), allocatable :: text
    integer :: begin, i, next

    text = ''
    begin = 1
    do while (begin <= len(keys))
      next = begin + index(keys(begin:) // ' ', ' ') - 1
      text = text // ','
      if (keys(begin:next - 1) /= '-') then
        associate (value => group%values(group%key_position(keys(begin:next - 1))))
          do i = 1, value%count()
            if (i > 1) text = text // ' | '
            text = text // to_text(value%number_at(i))
          end do
        end associate
      end if
      begin = next + 1
    end do
  end function cells

  !> Speeds of all stations by the one of the first station to which couplings, shafts and gears connect them.
  pure subroutine find_ratios(connections, stations, ratios)
    type(connection_t), intent(in) :: connections(:)
    integer, intent(in) :: stations
    real(wp), allocatable, intent(out) :: ratios(:)   !! [stations]
    logical :: has_changed, is_known(stations)
    integer :: c, start

    allocate (ratios(stations), source=1.0_wp)
    is_known = .false.
    do start = 1, stations
      if (is_known(start)) cycle
      is_known(start) = .true.
      has_changed = .true.
      do while (has_changed)
        has_changed = .false.
        do c = 1, size(connections)
          associate (first => connections(c)%ends(1), last => connections(c)%ends(2), step => connections(c)%step)
            if (first == 0 .or. last == 0) cycle
            if (is_known(first) .eqv. is_known(last)) cycle
            has_changed = .true.
            if (is_known(first)) then
              ratios(last) = ratios(first) * step
            else
              ratios(first) = ratios(last) / step
            end if
            is_known([first, last]) = .true.
          end associate
        end do
      end do
    end do
  end subroutine find_ratios

  !> Speed of the second body by the one of the first.
  real(wp) function ratio_of(group)
    type(group_t), intent(in) :: group
    integer :: key

    ratio_of = 1.0_wp
    if (group%kind /= 'gear') return
    key = group%key_position('radii')
    if (.not. group%values(key)%has_any()) key = group%key_position('teeth')
    ratio_of = -group%values(key)%number_at(1) / group%values(key)%number_at(2)
    if (group%flag('internal')) ratio_of = -ratio_of
  end function ratio_of

  !> A name as a cell: in quotes where a sheet would take it for a comment.
  pure function cell(name) result(text)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: text

    text = name
    if (scan(name, '#!') > 0) text = '"' // name // '"'
  end function cell

end module nocdyn_mass_elastic_sheet
