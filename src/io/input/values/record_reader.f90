!> Files of recorders: the columns that a group names become its lists. Rows with missing values are left out and counted.
module nocdyn_record_reader
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use nocdyn_data_table, only: data_table_t, headings_after_preamble, line_messages_t, read_data_table, split_unit
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t, exit_file, exit_input
  use nocdyn_input, only: group_t, value_t
  use nocdyn_kinds, only: wp
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

contains

  !> Replaces the file of a record by lists. The unit of the values stays, or is the one of their heading.
  subroutine read_record(folder, raw, group, diagnostics)
    character(len=*), intent(in) :: folder   !! of the input file, with a slash at its end, or ''
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(data_table_t) :: table
    type(error_t), allocatable :: error
    type(value_t) :: source
    character(len=:), allocatable :: path, text
    integer :: columns(size(wanted)), errors

    if (.not. group%has_value('file')) return
    source = group%values(group%key_position('file'))
    group%values(group%key_position('file')) = value_t()
    path = path_in(folder, source%texts(1)%text)
    errors = diagnostics%count
    call read_text_file(path, text, error)
    if (allocated(error)) then
      call report('file', error%message, exit_file)
    else if (index(text, achar(0)) > 0) then
      call report('file', shown_path(path) // ': not a text file', exit_input)
    else
      call read_data_table(text, headings_after_preamble, 0, table)
      call find_columns()
      if (diagnostics%count == errors) call take_columns()
    end if
    if (diagnostics%count > errors) call mark_lists()

  contains

    !> Adds a message on a key.
    subroutine report(key, message, code)
      character(len=*), intent(in) :: key, message
      integer, intent(in) :: code

      associate (place => group%values(group%key_position(key)))
        if (place%is_given) then
          call diagnostics%add(place%line, raw%index, key // ': ' // message, place%override, code)
        else
          call diagnostics%add(source%line, raw%index, key // ': ' // message, source%override, code)
        end if
      end associate
    end subroutine report

    !> Finds the columns; 0: not wanted.
    subroutine find_columns()
      logical :: has_times

      columns = 0
      has_times = group%text('kind') == 'series' .or. group%has_value('time_column') .or. group%has_value('pulse_column')
      if (has_times) call find(time, 1)
      if (group%text('kind') == 'order' .and. .not. group%has_value('pulse_column')) call find(speed, merge(2, 1, has_times))
      if (group%has_value('pulse_column')) call find(pulse, 2)
      call find(value, 1 + maxval(columns))
    end subroutine find_columns

    !> Finds one column.
    subroutine find(item, absent)
      integer, intent(in) :: item     !! of `wanted`
      integer, intent(in) :: absent   !! the column if none is named
      character(len=:), allocatable :: key, name

      key = trim(wanted(item)%key)
      columns(item) = absent
      name = ''
      if (group%has_value(key)) then
        name = group%text(key)
        columns(item) = table%find_column(name)
      end if
      if (columns(item) > 0 .and. columns(item) <= table%columns) return
      if (name == '') then
        call report('file', shown_path(path) // ' has ' // to_text(table%columns) // ' columns; needed: ' // &
                    to_text(absent) // ' at least, or ' // key, exit_input)
      else if (table%heading_line == 0) then
        call report(key, 'there is no column ' // quoted(shortened(name)) // ' in ' // shown_path(path) // &
                    ', which has no headings; allowed: numbers from 1 to ' // to_text(table%columns), exit_input)
      else
        call report(key, 'there is no single column ' // quoted(shortened(name)) // ' in ' // shown_path(path) // ':' // &
                    to_text(table%heading_line) // '; allowed: ' // joined(table%headings, ', ') // ', or a number' // &
                    near_match(name, table%headings), exit_input)
      end if
      columns(item) = 1   ! it is reported
    end subroutine find

    !> Takes the columns that were found.
    subroutine take_columns()
      type(line_messages_t) :: problems
      type(string_t), allocatable :: messages(:)
      type(unit_conversion_t) :: conversion
      real(wp), allocatable :: numbers(:, :)   ! [rows, columns]
      integer, allocatable :: items(:), rows(:)
      integer :: c, i, k
      integer, allocatable :: gaps(:)

      allocate (items, source=pack([(i, i=1, size(wanted))], columns > 0))
      allocate (gaps(size(items)))
      problems%file = path
      call table%read_columns(columns(items), numbers, gaps, problems)
      allocate (rows, source=pack([(i, i=1, table%rows)], [(.not. any(ieee_is_nan(numbers(i, :))), i=1, table%rows)]))
      do c = 1, size(items)
        call find_unit(wanted(items(c)), columns(items(c)), conversion)
        if (wanted(items(c))%si /= '') numbers(:, c) = conversion%convert(numbers(:, c))
      end do
      if (problems%errors == 0) call check_numbers(table, columns(items), rows, numbers, items(1) == time, problems)
      if (problems%errors == 0 .and. size(rows) < 2) call problems%add(0, to_text(size(rows)) // &
                                                                       ' rows without gaps; needed: 2 at least')
      call problems%close(messages)
      do i = 1, size(messages)
        call report('file', messages(i)%text, exit_input)
      end do
      if (diagnostics%count > errors) return
      do c = 1, size(items)
        associate (list => group%values(group%key_position(trim(wanted(items(c))%list))))
          list = value_t(source%is_given, source%line, source%override)
          allocate (list%numbers(size(rows)))
          do k = 1, size(rows)
            list%numbers(k) = numbers(rows(k), c)
          end do
        end associate
      end do
      if (size(rows) < table%rows) then
        group%values(group%key_position('gaps')) = value_t(source%is_given, source%line, source%override)
        group%values(group%key_position('gaps'))%whole_numbers = [table%rows - size(rows)]
      end if
      do i = 1, size(wanted)   ! they are of no use without the file
        group%values(group%key_position(trim(wanted(i)%key))) = value_t()
        if (wanted(i)%unit /= '' .and. wanted(i)%unit /= 'unit') then
          group%values(group%key_position(trim(wanted(i)%unit))) = value_t()
        end if
      end do
    end subroutine take_columns

    !> The unit of a column: of its key, else of its heading. The one of values, which the machine decides on, is kept.
    subroutine find_unit(item, column, conversion)
      type(wanted_column_t), intent(in) :: item
      integer, intent(in) :: column
      type(unit_conversion_t), intent(out) :: conversion
      character(len=:), allocatable :: message, name, unit

      if (item%unit == '') return
      call split_unit(table%headings(column)%text, name, unit)
      associate (given => group%values(group%key_position(trim(item%unit))))
        if (given%has_any()) unit = given%texts(1)%text
        if (item%si == '') then
          if (given%has_any() .or. unit == '') return
          given = value_t(source%is_given, source%line, source%override)
          allocate (given%texts(0))
          call append(given%texts, unit)
        else if (unit /= '') then
          call find_conversion(unit, trim(item%si), conversion, message)
          if (message == '') return
          message = message // '; column ' // to_text(column) // ' of ' // shown_path(path)
          call report(trim(merge(item%unit, 'file      ', given%has_any())), message, exit_input)
        end if
      end associate
    end subroutine find_unit

    !> Values that are wrong are not looked at.
    subroutine mark_lists()
      integer :: i

      do i = 1, size(wanted)
        group%values(group%key_position(trim(wanted(i)%list))) = value_t(source%is_given, source%line, source%override)
      end do
    end subroutine mark_lists

  end subroutine read_record

  !> Refuses numbers beyond the range of an input, and times that do not ascend.
  subroutine check_numbers(table, columns, rows, numbers, has_times, problems)
    type(data_table_t), intent(in) :: table
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
        if (limit /= '') call problems%add(table%lines(rows(k)), 'column ' // to_text(columns(c)) // ', ' // &
                                           to_text(numbers(rows(k), c)) // ', is out of range; allowed: ' // limit(3:))
      end do
      if (k == 1 .or. .not. has_times) cycle
      before = rows(max(1, k - 1))
      if (numbers(rows(k), 1) > numbers(before, 1)) cycle
      call problems%add(table%lines(rows(k)), 'the time, column ' // to_text(columns(1)) // ', ' // &
                        to_text(numbers(rows(k), 1)) // ', must be greater than ' // to_text(numbers(before, 1)) // &
                        ' on line ' // to_text(table%lines(before)))
    end do
  end subroutine check_numbers

end module nocdyn_record_reader
