!> Files of recorders: the columns that a group names become its lists. Rows with missing values are left out and counted.
module nocdyn_record_reader
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use nocdyn_data_table, only: data_table_t, headings_after_preamble, read_data_table, split_unit
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t, exit_file, exit_input
  use nocdyn_input, only: group_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_line_messages, only: line_messages_t
  use nocdyn_near_words, only: near_match
  use nocdyn_raw_group, only: raw_group_t
  use nocdyn_schema_rules, only: anything, size_limit
  use nocdyn_text, only: append, joined, quoted, shortened, shown_path, string_t, to_text
  use nocdyn_text_file, only: path_in, read_text_file
  use nocdyn_unit_expressions, only: find_conversion, unit_conversion_t
  implicit none (type, external)
  private

  public :: read_record

  !> A column that is wanted.
  type :: wanted_column_t
    character(len=6) :: list      !! key of the list
    character(len=12) :: key      !! that says which column it is
    character(len=10) :: unit     !! key of its unit; '': numbers of any unit
    character(len=5) :: si        !! unit of the list; '': numbers stay as they are
  end type wanted_column_t

  type(wanted_column_t), parameter :: wanted(4) = [ &
    wanted_column_t('times', 'time_column', 'time_unit', 's'), &
    wanted_column_t('speeds', 'speed_column', 'speed_unit', 'rad/s'), &
    wanted_column_t('pulses', 'pulse_column', '', ''), &
    wanted_column_t('values', 'column', 'unit', '')]
  integer, parameter :: time = 1, speed = 2, pulse = 3, value = 4   ! indices of `wanted`

  !> A record on its way into a group.
  type :: record_t
    integer :: index                             !! of the group, among all of the file
    character(len=:), allocatable :: path        !! of the record
    type(value_t) :: source                      !! of the key `file`
    type(data_table_t) :: table
    integer :: columns(size(wanted)) = 0         !! of the table; 0: not wanted
  contains
    procedure :: check_rows, find_column, find_columns, find_unit, report, take_columns
  end type record_t

contains

  !> Replaces the file of a record by lists. The unit of the values stays, or is the one of their heading.
  subroutine read_record(folder, raw, group, diagnostics)
    character(len=*), intent(in) :: folder   !! of the input file, with a slash at its end, or ''
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(record_t) :: record
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text
    integer :: errors

    if (.not. group%has_value('file')) return
    record%index = raw%index
    record%source = group%values(group%key_position('file'))
    record%path = path_in(folder, record%source%texts(1)%text)
    group%values(group%key_position('file')) = value_t()
    errors = diagnostics%count
    if (.not. group%has_value('kind')) then   ! which is reported
      call leave_out(group, record%source)
      return
    end if
    call read_text_file(record%path, text, error)
    if (allocated(error)) then
      call record%report(group, 'file', error%message, diagnostics, exit_file)
    else if (index(text, achar(0)) > 0) then
      call record%report(group, 'file', shown_path(record%path) // ': not a text file', diagnostics)
    else
      call read_data_table(text, headings_after_preamble, 0, record%table)
      if (record%table%rows == 0) call record%report(group, 'file', shown_path(record%path) // ' has no row of numbers', &
                                                     diagnostics)
      if (diagnostics%count == errors) call record%find_columns(group, diagnostics)
      if (diagnostics%count == errors) call record%take_columns(group, diagnostics)
    end if
    if (diagnostics%count > errors) call leave_out(group, record%source)
  end subroutine read_record

  !> Leaves the values of a record out that is not read: they are not missing.
  subroutine leave_out(group, source)
    type(group_t), intent(inout) :: group
    type(value_t), intent(in) :: source   !! its file
    integer :: i

    do i = 1, size(wanted)
      group%values(group%key_position(trim(wanted(i)%list))) = empty_value(source)
    end do
  end subroutine leave_out

  !> Adds a message on a key.
  subroutine report(self, group, key, message, diagnostics, code)
    class(record_t), intent(in) :: self
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key, message
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, intent(in), optional :: code   !! of the program's exit; absent: `exit_input`
    integer :: exit_code

    exit_code = exit_input
    if (present(code)) exit_code = code
    associate (place => group%values(group%key_position(key)))
      if (place%is_given) then
        call diagnostics%add(place%line, self%index, key // ': ' // message, place%override, exit_code)
      else
        call diagnostics%add(self%source%line, self%index, key // ': ' // message, self%source%override, exit_code)
      end if
    end associate
  end subroutine report

  !> A value at the place of another one.
  pure function empty_value(place) result(value)
    type(value_t), intent(in) :: place
    type(value_t) :: value

    value%is_given = place%is_given
    value%line = place%line
    value%override = place%override
  end function empty_value

  !> Finds the columns that the kind of measurement and the keys want.
  subroutine find_columns(self, group, diagnostics)
    class(record_t), intent(inout) :: self
    type(group_t), intent(in) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    logical :: has_times

    has_times = group%text('kind') == 'series' .or. group%has_value('time_column') .or. group%has_value('pulse_column')
    if (has_times) call self%find_column(group, time, 1, diagnostics)
    if (group%text('kind') == 'order' .and. .not. group%has_value('pulse_column')) then
      call self%find_column(group, speed, merge(2, 1, has_times), diagnostics)
    end if
    if (group%has_value('pulse_column')) call self%find_column(group, pulse, 2, diagnostics)
    call self%find_column(group, value, 1 + maxval(self%columns), diagnostics)
  end subroutine find_columns

  !> Finds one column.
  subroutine find_column(self, group, item, absent, diagnostics)
    class(record_t), intent(inout) :: self
    type(group_t), intent(in) :: group
    integer, intent(in) :: item     !! of `wanted`
    integer, intent(in) :: absent   !! the column if none is named
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: file, key, name

    key = trim(wanted(item)%key)
    self%columns(item) = absent
    name = ''
    if (group%has_value(key)) then
      name = group%text(key)
      self%columns(item) = self%table%find_column(name)
    end if
    if (self%columns(item) > 0 .and. self%columns(item) <= self%table%columns) return
    file = shown_path(self%path)
    if (name == '') then
      call self%report(group, 'file', file // ' has ' // to_text(self%table%columns) // ' columns; needed: ' // &
                       to_text(absent) // ' at least, or ' // key, diagnostics)
    else if (allocated(self%table%doubt)) then
      call self%report(group, key, 'there is no column ' // quoted(shortened(name)) // ' in ' // file // ': ' // &
                       self%table%doubt, diagnostics)
    else if (self%table%heading_line == 0) then
      call self%report(group, key, 'there is no column ' // quoted(shortened(name)) // ' in ' // file // &
                       ', which has no headings; allowed: numbers from 1 to ' // to_text(self%table%columns), diagnostics)
    else
      call self%report(group, key, 'there is no single column ' // quoted(shortened(name)) // ' in ' // file // ':' // &
                       to_text(self%table%heading_line) // '; allowed: ' // joined(self%table%headings, ', ') // &
                       ', or a number' // near_match(name, self%table%headings), diagnostics)
    end if
    self%columns(item) = 1   ! it is reported
  end subroutine find_column

  !> Takes the columns that were found, in SI.
  subroutine take_columns(self, group, diagnostics)
    class(record_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(line_messages_t) :: problems
    type(string_t), allocatable :: messages(:)
    type(unit_conversion_t) :: conversion
    real(wp), allocatable :: numbers(:, :)   ! [rows, columns]
    integer, allocatable :: gaps(:), items(:), rows(:)
    integer :: c, errors, i

    errors = diagnostics%count
    allocate (items, source=pack([(i, i=1, size(wanted))], self%columns > 0))
    allocate (gaps(size(items)))
    problems%file = self%path
    call self%table%read_columns(self%columns(items), numbers, gaps, problems)
    allocate (rows, source=pack([(i, i=1, self%table%rows)], [(.not. any(ieee_is_nan(numbers(i, :))), i=1, self%table%rows)]))
    do c = 1, size(items)
      call self%find_unit(group, items(c), conversion, diagnostics)
      if (wanted(items(c))%si /= '') numbers(:, c) = conversion%convert(numbers(:, c))
    end do
    if (problems%errors == 0) call self%check_rows(self%columns(items), rows, numbers, items(1) == time, problems)
    call problems%close(messages)
    do i = 1, size(messages)
      call self%report(group, 'file', messages(i)%text, diagnostics)
    end do
    if (diagnostics%count == errors) call put_lists(self, items, rows, numbers, group)
  end subroutine take_columns

  !> Gives a group the lists in place of the keys of their columns, and the number of rows that are left out.
  subroutine put_lists(record, items, rows, numbers, group)
    type(record_t), intent(in) :: record
    integer, intent(in) :: items(:)         !! of `wanted`, [columns]
    integer, intent(in) :: rows(:)          !! without gaps
    real(wp), intent(in) :: numbers(:, :)   !! [rows of the table, columns]
    type(group_t), intent(inout) :: group
    integer :: c, i, k

    do c = 1, size(items)
      associate (list => group%values(group%key_position(trim(wanted(items(c))%list))))
        list = empty_value(record%source)
        allocate (list%numbers(size(rows)))
        do k = 1, size(rows)
          list%numbers(k) = numbers(rows(k), c)
        end do
      end associate
    end do
    if (size(rows) < record%table%rows) then
      associate (gaps => group%values(group%key_position('gaps')))
        gaps = empty_value(record%source)
        gaps%whole_numbers = [record%table%rows - size(rows)]
      end associate
    end if
    do i = 1, size(wanted)   ! they are of no use without the file
      group%values(group%key_position(trim(wanted(i)%key))) = value_t()
      if (wanted(i)%unit /= '' .and. wanted(i)%unit /= 'unit') then
        group%values(group%key_position(trim(wanted(i)%unit))) = value_t()
      end if
    end do
  end subroutine put_lists

  !> The unit of a column: of its key, else of its heading. The one of values, which the machine decides on, is kept.
  subroutine find_unit(self, group, item, conversion, diagnostics)
    class(record_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    integer, intent(in) :: item   !! of `wanted`
    type(unit_conversion_t), intent(out) :: conversion
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message, name, unit

    if (wanted(item)%unit == '') return
    call split_unit(self%table%headings(self%columns(item))%text, name, unit)
    associate (given => group%values(group%key_position(trim(wanted(item)%unit))))
      if (given%has_any()) unit = given%texts(1)%text
      if (wanted(item)%si == '') then
        if (given%has_any() .or. unit == '') return
        given = empty_value(self%source)
        allocate (given%texts(0))
        call append(given%texts, unit)
      else if (unit /= '') then
        call find_conversion(unit, trim(wanted(item)%si), conversion, message)
        if (message == '') return
        message = message // '; column ' // to_text(self%columns(item)) // ' of ' // shown_path(self%path)
        call self%report(group, trim(merge(wanted(item)%unit, 'file      ', given%has_any())), message, diagnostics)
      end if
    end associate
  end subroutine find_unit

  !> Refuses numbers beyond the range of an input, times that do not ascend, and too few rows.
  subroutine check_rows(self, columns, rows, numbers, has_times, problems)
    class(record_t), intent(in) :: self
    integer, intent(in) :: columns(:)       !! of the table
    integer, intent(in) :: rows(:)          !! without gaps
    real(wp), intent(in) :: numbers(:, :)   !! [rows of the table, columns]
    logical, intent(in) :: has_times        !! in the first one
    type(line_messages_t), intent(inout) :: problems
    character(len=:), allocatable :: limit
    integer :: before, c, k

    do k = 1, size(rows)
      do c = 1, size(columns)
        limit = size_limit(numbers(rows(k), c), anything, ascends=has_times .and. c == 1)
        if (limit /= '') call problems%add(self%table%lines(rows(k)), 'column ' // to_text(columns(c)) // ', ' // &
                                           to_text(numbers(rows(k), c)) // ', is out of range; allowed: ' // limit(3:))
      end do
      if (k == 1 .or. .not. has_times) cycle
      before = rows(max(1, k - 1))
      if (numbers(rows(k), 1) > numbers(before, 1)) cycle
      call problems%add(self%table%lines(rows(k)), 'the time, column ' // to_text(columns(1)) // ', ' // &
                        to_text(numbers(rows(k), 1)) // ', must be greater than ' // to_text(numbers(before, 1)) // &
                        ' on line ' // to_text(self%table%lines(before)))
    end do
    if (problems%errors == 0 .and. size(rows) < 2) call problems%add(0, to_text(size(rows)) // &
                                                                     ' rows without gaps; needed: 2 at least')
  end subroutine check_rows

end module nocdyn_record_reader
