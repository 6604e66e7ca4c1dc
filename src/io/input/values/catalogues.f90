!> Catalogues of couplings: a file with a row for each size. The first line has the headings, with units in brackets: `size`, and
!> keys of the group, such as `stiffness [kN m/rad]` or `power_loss [W]`. Without a unit a column is in the one of its key.
module nocdyn_catalogues
  use nocdyn_data_table, only: data_table_t, headings_first, read_data_table, split_unit
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_input_group, only: group_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_raw_group, only: raw_group_t
  use nocdyn_schema, only: first_key, has_word, key_name, key_rule_index, key_rules, last_key
  use nocdyn_schema_rules, only: a_number, is_out_of_range, key_rule_t, size_limit
  use nocdyn_schema_text, only: allowed_text, suggestion
  use nocdyn_text, only: append, lower_case, quoted, shortened, shown_path, string_t, to_text
  use nocdyn_unit_expressions, only: find_conversion, unit_conversion_t
  implicit none (type, external)
  private

  public :: list_sizes, read_catalogue, take_catalogue

  character(len=*), parameter :: size_column = 'size', remarks = 'maker type price mass speed_limit remark'

  !> The rows of a catalogue.
  type, public :: catalogue_t
    type(string_t), allocatable :: sizes(:)      !! [rows]
    integer, allocatable :: keys(:)              !! rows of `key_rules`, [columns]
    real(wp), allocatable :: values(:, :)        !! in the units of the keys, [columns, rows]
    logical, allocatable :: has_value(:, :)      !! cells may be empty
  contains
    procedure :: row => row_of
  end type catalogue_t

contains

  !> Reads a catalogue of a group.
  subroutine read_catalogue(text, file, group_rule, catalogue, messages)
    character(len=*), intent(in) :: text, file      !! the file, and its name in messages
    integer, intent(in) :: group_rule               !! row of `group_rules`
    type(catalogue_t), intent(out) :: catalogue
    type(string_t), allocatable, intent(out) :: messages(:)   !! what is wrong
    type(data_table_t) :: table
    type(unit_conversion_t), allocatable :: conversions(:)
    integer, allocatable :: column(:)   ! of each key
    integer :: r, size_at

    allocate (messages(0))
    call read_data_table(text, headings_first, 0, table)
    call find_columns(table, file, group_rule, size_at, column, catalogue%keys, conversions, messages)
    if (size(messages) > 0) return
    allocate (catalogue%sizes(table%rows))
    allocate (catalogue%values(size(column), table%rows), source=0.0_wp)
    allocate (catalogue%has_value(size(column), table%rows), source=.false.)
    do r = 1, table%rows
      if (table%row_problem(r) /= '') then
        call append(messages, place(file, table%lines(r)) // table%row_problem(r))
        cycle
      end if
      catalogue%sizes(r)%text = table%cell(size_at, r)
      if (catalogue%sizes(r)%text == '') call append(messages, place(file, table%lines(r)) // 'a row without a size')
      if (catalogue%row(catalogue%sizes(r)%text) < r) call append(messages, place(file, table%lines(r)) // 'the size ' // &
        quoted(shortened(catalogue%sizes(r)%text)) // ' is given twice')
      call read_row(table, r, file, column, conversions, catalogue, messages)
    end do
    if (table%rows == 0) call append(messages, file // ': no row; needed: one for each size')
  end subroutine read_catalogue

  !> Finds what the columns are.
  subroutine find_columns(table, file, group_rule, size_at, column, keys, conversions, messages)
    type(data_table_t), intent(in) :: table
    character(len=*), intent(in) :: file
    integer, intent(in) :: group_rule
    integer, intent(out) :: size_at                !! column of the sizes
    integer, allocatable, intent(out) :: column(:), keys(:)   !! the others that are keys, and these
    type(unit_conversion_t), allocatable, intent(out) :: conversions(:)
    type(string_t), allocatable, intent(inout) :: messages(:)
    type(unit_conversion_t) :: conversion
    character(len=:), allocatable :: message, name, unit
    integer :: c, key

    size_at = 0
    allocate (column(0), keys(0), conversions(0))
    do c = 1, table%columns
      call split_unit(table%headings(c)%text, name, unit)
      name = as_key(name)
      if (name == size_column) then
        if (size_at == 0) size_at = c
        cycle
      end if
      if (has_word(remarks, name)) cycle
      key = key_rule_index(group_rule, name)
      if (key > 0) then
        if (.not. is_data(key_rules(key))) key = 0
      end if
      if (key == 0) then
        call append(messages, place(file, table%heading_line) // quoted(shortened(name)) // ' is no column of a catalogue' // &
                              suggestion(name, data_names(group_rule)))
        cycle
      end if
      if (any(keys == key)) call append(messages, place(file, table%heading_line) // 'the column ' // quoted(name) // &
                                                  ' is given twice')
      message = ''
      conversion = unit_conversion_t()
      if (unit /= '' .and. unit /= '-' .and. unit /= '1') then
        call find_conversion(unit, trim(key_rules(key)%unit), conversion, message)
      end if
      if (message /= '') call append(messages, place(file, table%heading_line) // name // ': ' // message)
      column = [column, c]
      keys = [keys, key]
      conversions = [conversions, conversion]
    end do
    if (size_at == 0) call append(messages, place(file, table%heading_line) // "there is no column 'size'")
  end subroutine find_columns

  !> Reads the numbers of one size.
  subroutine read_row(table, r, file, column, conversions, catalogue, messages)
    type(data_table_t), intent(in) :: table
    integer, intent(in) :: r
    character(len=*), intent(in) :: file
    integer, intent(in) :: column(:)                          !! of the keys
    type(unit_conversion_t), intent(in) :: conversions(:)
    type(catalogue_t), intent(inout) :: catalogue
    type(string_t), allocatable, intent(inout) :: messages(:)
    character(len=:), allocatable :: message
    integer :: c
    logical :: is_missing
    real(wp) :: value

    do c = 1, size(column)
      associate (rule => key_rules(catalogue%keys(c)))
        call table%read_cell(column(c), r, value, is_missing, message)
        if (is_missing) cycle
        value = conversions(c)%convert(value)
        if (message == '') then
          if (is_out_of_range(value, rule%allowed)) message = trim(rule%name) // ' = ' // to_text(value) // &
                                                              ' is out of range; allowed: ' // allowed_text(rule)
        end if
        if (message == '' .and. size_limit(value, rule%allowed, .false.) /= '') message = trim(rule%name) // ' = ' // &
          to_text(value) // size_limit(value, rule%allowed, .false.)
        if (message /= '') call append(messages, place(file, table%lines(r)) // message)
        catalogue%values(c, r) = value
        catalogue%has_value(c, r) = .true.
      end associate
    end do
  end subroutine read_row

  !> The row of a size, 0 if there is none.
  pure integer function row_of(self, name) result(row)
    class(catalogue_t), intent(in) :: self
    character(len=*), intent(in) :: name

    do row = 1, size(self%sizes)
      if (.not. allocated(self%sizes(row)%text)) exit   ! still to be read
      if (self%sizes(row)%text == name) return
    end do
    row = 0
  end function row_of

  !> The catalogue of a group that has one.
  subroutine read_lines(group, file, catalogue, messages)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: file   !! as in `read_catalogue`
    type(catalogue_t), intent(out) :: catalogue
    type(string_t), allocatable, intent(out) :: messages(:)
    character(len=:), allocatable :: text
    type(string_t), allocatable :: lines(:)
    integer :: i

    file = 'catalogue_lines'
    if (group%has_value('catalogue_file')) file = shown_path(group%text('catalogue_file'))
    allocate (lines, source=group%texts('catalogue_lines'))
    text = ''
    do i = 1, size(lines)
      text = text // lines(i)%text // new_line('a')
    end do
    call read_catalogue(text, file, group%rule, catalogue, messages)
  end subroutine read_lines

  !> The sizes in the catalogue of a group of an input without mistakes; none without a catalogue.
  subroutine list_sizes(group, sizes)
    type(group_t), intent(in) :: group   !! &coupling
    type(string_t), allocatable, intent(out) :: sizes(:)
    type(catalogue_t) :: catalogue
    type(string_t), allocatable :: messages(:)
    character(len=:), allocatable :: file

    if (group%has_value('catalogue_lines') .and. group%has_value('size')) then
      call read_lines(group, file, catalogue, messages)
      call move_alloc(catalogue%sizes, sizes)
    else
      allocate (sizes(0))
    end if
  end subroutine list_sizes

  !> Gives a group the values of its size that it has not itself. They are not written: they follow from the catalogue, which is.
  subroutine take_catalogue(raw, group, diagnostics)
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(inout) :: group   !! with the lines of its file
    type(diagnostics_t), intent(inout) :: diagnostics
    type(catalogue_t) :: catalogue
    type(string_t), allocatable :: messages(:)
    character(len=:), allocatable :: file
    integer :: c, i, row

    if (group%kind /= 'coupling') return
    if (.not. (group%has_value('catalogue_lines') .and. group%has_value('size'))) return
    call read_lines(group, file, catalogue, messages)
    associate (source => group%values(group%key_position('catalogue_lines')), chosen => group%values(group%key_position('size')))
      do i = 1, size(messages)
        call diagnostics%add(max(source%line, group%line), raw%index, messages(i)%text, source%override)
      end do
      if (size(messages) > 0) return
      row = catalogue%row(chosen%texts(1)%text)
      if (row == 0) then
        call diagnostics%add(max(chosen%line, group%line), raw%index, 'size: there is no size ' // &
                             quoted(shortened(chosen%texts(1)%text)) // ' in ' // file // &
                             suggestion(chosen%texts(1)%text, catalogue%sizes), chosen%override)
        return
      end if
      do c = 1, size(catalogue%keys)
        associate (value => group%values(catalogue%keys(c) - first_key(group%rule) + 1))
          if (value%is_given .or. .not. catalogue%has_value(c, row)) cycle
          value = value_t(line=source%line, is_derived=.true.)
          value%numbers = [catalogue%values(c, row)]
        end associate
      end do
      if (.not. group%has_value('kind')) return
      if (group%text('kind') /= 'rubber' .or. group%values(group%key_position('stiffness'))%is_given) return
      if (group%number('stiffness', absent=0.0_wp) > 0) return
      call diagnostics%add(max(chosen%line, group%line), raw%index, 'size: ' // quoted(shortened(chosen%texts(1)%text)) // &
                           ' has no stiffness in ' // file // "; kind = 'rubber' needs one", chosen%override)
    end associate
  end subroutine take_catalogue

  !> Whether a key is a number of a data sheet.
  elemental logical function is_data(rule)
    type(key_rule_t), intent(in) :: rule

    is_data = rule%value_type == a_number .and. rule%count == 1 .and. (rule%only_if == '' .or. has_word(rule%only_if, 'rubber'))
  end function is_data

  !> The names of these keys.
  pure function data_names(group_rule) result(names)
    integer, intent(in) :: group_rule
    type(string_t), allocatable :: names(:)
    integer :: k

    allocate (names(0))
    do k = first_key(group_rule), last_key(group_rule)
      if (is_data(key_rules(k))) call append(names, key_name(group_rule, k - first_key(group_rule) + 1))
    end do
  end function data_names

  !> "Dynamic stiffness" as 'dynamic_stiffness'.
  pure function as_key(name) result(key)
    character(len=*), intent(in) :: name
    character(len=len_trim(adjustl(name))) :: key
    integer :: i

    key = lower_case(trim(adjustl(name)))
    do i = 1, len(key)
      if (key(i:i) == ' ') key(i:i) = '_'
    end do
  end function as_key

  !> "couplings.csv:3: "
  pure function place(file, line) result(text)
    character(len=*), intent(in) :: file
    integer, intent(in) :: line
    character(len=:), allocatable :: text

    text = file // ':' // to_text(line) // ': '
  end function place

end module nocdyn_catalogues
