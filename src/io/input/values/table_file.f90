!> Tables in files that an input names: the table of an element has two columns, of which the first ascends; a list of variants
!> begins with the names of its columns. How columns are separated: `nocdyn_table_dialect`.
module nocdyn_table_file
  use nocdyn_data_table, only: data_table_t, headings_above, headings_first, read_data_table
  use nocdyn_errors, only: error_t, exit_file, exit_input
  use nocdyn_kinds, only: wp
  use nocdyn_line_messages, only: line_messages_t
  use nocdyn_schema_rules, only: anything, size_limit
  use nocdyn_text, only: append, counted, quoted, shortened, string_t, to_text
  use nocdyn_text_file, only: read_text_file
  implicit none (type, external)
  private

  public :: read_table_file, read_table_text, read_list_text

  integer, parameter :: most_columns = 10000   !! of a list

contains

  !> Reads the file of a table: two columns, of which the first ascends, and two rows at least.
  subroutine read_table_file(file, first, second, messages, code)
    character(len=*), intent(in) :: file                      !! path
    real(wp), allocatable, intent(out) :: first(:), second(:)   !! the columns, [rows]
    type(string_t), allocatable, intent(out) :: messages(:)   !! sentences that begin with file and line; empty: the file is valid
    integer, intent(out) :: code                              !! exit code of the messages
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text

    code = exit_input
    call read_text_file(file, text, error)
    if (.not. allocated(error)) then
      call read_table_text(text, file, first, second, messages)
      return
    end if
    code = exit_file
    allocate (messages(0), first(0), second(0))
    call append(messages, error%message)
  end subroutine read_table_file

  !> Reads the text of a table: two columns, of which the first ascends, and two rows at least.
  subroutine read_table_text(text, file, first, second, messages)
    character(len=*), intent(in) :: text
    character(len=*), intent(in) :: file   !! its name in messages
    real(wp), allocatable, intent(out) :: first(:), second(:)   !! the columns, [rows]
    type(string_t), allocatable, intent(out) :: messages(:)     !! empty if the text is valid
    type(data_table_t) :: table
    type(line_messages_t) :: reading
    real(wp), allocatable :: values(:, :)
    integer :: rows

    reading%file = file
    call read_data_table(text, headings_above, 2, table)
    call read_rows(table, .false., reading, values, rows)
    call check_whole(text, rows, 2, reading, messages)
    allocate (first(rows), second(rows))
    first = values(1, :rows)
    second = values(2, :rows)
  end subroutine read_table_text

  !> Reads the text of a list: a line with the names of the columns, then rows of as many numbers, one at least.
  subroutine read_list_text(text, file, names, line, values, messages)
    character(len=*), intent(in) :: text
    character(len=*), intent(in) :: file   !! its name in messages
    type(string_t), allocatable, intent(out) :: names(:)
    integer, intent(out) :: line                              !! of the names
    real(wp), allocatable, intent(out) :: values(:, :)        !! [names, rows]
    type(string_t), allocatable, intent(out) :: messages(:)   !! sentences that begin with file and line; empty: the file is valid
    type(data_table_t) :: table
    type(line_messages_t) :: reading
    real(wp), allocatable :: lines(:, :)
    integer :: rows

    reading%file = file
    call read_data_table(text, headings_first, 0, table, are_full=.true.)
    line = table%heading_line
    call move_alloc(table%headings, names)
    rows = 0
    call check_names(line, names, reading)
    if (reading%errors == 0) call read_rows(table, .true., reading, lines, rows)
    call check_whole(text, rows, 1, reading, messages)
    allocate (values(size(names), rows))
    if (rows > 0) values = lines(:, :rows)
  end subroutine read_list_text

  !> Refuses names of a file with another format; then there are none.
  subroutine check_names(line, names, reading)
    integer, intent(in) :: line   !! of the names
    type(string_t), allocatable, intent(inout) :: names(:)
    type(line_messages_t), intent(inout) :: reading
    character(len=:), allocatable :: message
    integer :: i

    message = ''
    if (size(names) > most_columns) message = to_text(size(names)) // ' columns; allowed: at most ' // to_text(most_columns)
    do i = 1, size(names)
      if (message /= '') exit
      if (names(i)%text == 'variant') then
        message = "'variant' is a column of a sweep.csv; needed: only columns of numbers that vary"
      else if (names(i)%text == '') then
        message = 'column ' // to_text(i) // ' has no name; needed: the path of a number'
        if (i == 1) message = message // ', without numbers of rows (pandas: to_csv(FILE, index=False))'
      end if
    end do
    if (message == '') return
    call reading%add(line, message)
    names = [string_t ::]
  end subroutine check_names

  !> Reads the rows, in which nothing may be missing.
  subroutine read_rows(table, is_list, reading, values, rows)
    type(data_table_t), intent(in) :: table
    logical, intent(in) :: is_list                       !! else the table of an element
    type(line_messages_t), intent(inout) :: reading
    real(wp), allocatable, intent(out) :: values(:, :)   !! [columns, at least rows], the first `rows` are valid
    integer, intent(out) :: rows
    character(len=:), allocatable :: limit, message
    integer :: column, last_line, r
    logical :: is_missing

    allocate (values(table%columns, table%rows))
    rows = 0
    last_line = 0
    do r = 1, table%rows
      message = table%row_problem(r)
      do column = 1, table%columns
        if (message /= '') exit
        call table%read_cell(column, r, values(column, rows + 1), is_missing, message)
        if (message /= '' .or. is_list) cycle   ! a number of a list is checked as a value of its variant
        limit = size_limit(values(column, rows + 1), anything, ascends=column == 1)
        if (limit /= '') message = 'column ' // to_text(column) // ', ' // quoted(shortened(table%cell(column, r), 40)) // &
                                   ', is out of range; allowed: ' // limit(3:)
      end do
      if (message == '' .and. .not. is_list .and. rows > 0) then
        if (values(1, rows + 1) <= values(1, rows)) message = 'column 1, ' // to_text(values(1, rows + 1)) // &
          ', must be greater than ' // to_text(values(1, rows)) // ' on line ' // to_text(last_line)
      end if
      if (message /= '') then
        call reading%add(table%lines(r), message)
      else
        rows = rows + 1
        last_line = table%lines(r)
      end if
    end do
  end subroutine read_rows

  !> Adds the messages on the file as a whole.
  subroutine check_whole(text, rows, least, reading, messages)
    character(len=*), intent(in) :: text
    integer, intent(in) :: rows
    integer, intent(in) :: least   !! number of rows needed
    type(line_messages_t), intent(inout) :: reading
    type(string_t), allocatable, intent(out) :: messages(:)

    if (index(text, achar(0)) > 0) then
      reading%errors = 0
      if (allocated(reading%messages)) deallocate (reading%messages)
      call reading%add(0, 'not a text file')
    else if (reading%errors == 0 .and. rows < least) then
      call reading%add(0, counted(rows, 'row', 'rows') // '; needed: at least ' // to_text(least))
    end if
    call reading%close(messages)
  end subroutine check_whole

end module nocdyn_table_file
