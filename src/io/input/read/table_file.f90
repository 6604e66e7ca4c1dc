!> Tables in files: columns of numbers, separated by blanks, tabs or a comma; # and ! begin comments. In a file whose columns are
!> separated by semicolons, or by tabs with commas inside of numbers, these are decimal commas. The table of an element has two
!> columns, of which the first ascends. A list of variants begins with the names of its columns, separated by commas, semicolons
!> or tabs.
module nocdyn_table_file
  use nocdyn_errors, only: error_t, exit_file, exit_input
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: number_problem, read_real
  use nocdyn_schema_rules, only: anything, size_limit
  use nocdyn_text, only: append, counted, lower_case, quoted, shortened, shown_path, string_t, to_text
  use nocdyn_text_file, only: first_position, read_text_file
  implicit none (type, external)
  private

  public :: read_table_file, read_table_text, read_list_text

  integer, parameter :: most_messages = 5      !! a file of another format has as many errors as lines
  integer, parameter :: most_columns = 10000   !! of a list
  character(len=*), parameter :: line_end = achar(10), tab = achar(9), carriage_return = achar(13)
  character(len=*), parameter :: blanks = ' ' // tab, comments = '#!', quotes = '"' // "'"

  !> The state of reading a table line by line.
  type :: table_reader_t
    character(len=:), allocatable :: file        !! its name in messages
    integer :: columns = 2
    logical :: is_list = .false.                 !! a list of variants, else the table of an element
    character :: separator = ','                 !! of columns; ';' or a tab: commas are the ones of decimals
    integer :: line = 0                          !! of the text that is being read
    integer :: last_row_line = 0                 !! line of the last row
    integer :: errors = 0                        !! number of wrong lines
    logical :: has_other_format = .false.        !! which is reported; the rest of the file is not read
    type(string_t), allocatable :: messages(:)   !! at most `most_messages`
  end type table_reader_t

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
    type(table_reader_t) :: reading
    real(wp), allocatable :: values(:, :)
    integer :: rows

    allocate (reading%messages(0))
    reading%file = shown_path(file)
    reading%separator = separator_of(text)
    call read_rows(text, first_position(text), reading, values, rows)
    call check_whole(reading, rows, least=2, is_binary=index(text, achar(0)) > 0)
    first = values(1, :rows)
    second = values(2, :rows)
    call move_alloc(reading%messages, messages)
  end subroutine read_table_text

  !> Reads the text of a list: a line with the names of the columns, then rows of as many numbers, one at least.
  subroutine read_list_text(text, file, names, line, values, messages)
    character(len=*), intent(in) :: text
    character(len=*), intent(in) :: file   !! its name in messages
    type(string_t), allocatable, intent(out) :: names(:)
    integer, intent(out) :: line                              !! of the names
    real(wp), allocatable, intent(out) :: values(:, :)        !! [names, rows]
    type(string_t), allocatable, intent(out) :: messages(:)   !! sentences that begin with file and line; empty: the file is valid
    type(table_reader_t) :: reading
    real(wp), allocatable :: lines(:, :)
    integer :: columns, comma, first, i, last, rows, start
    character :: separator

    allocate (reading%messages(0))
    reading%file = shown_path(file)
    reading%is_list = .true.
    reading%separator = separator_of(text)
    start = first_position(text)
    ! reads the names of the columns of a list, with or without quotes; none if all lines are comments
    last = start - 2
    first = start
    do while (start <= len(text) .and. last < first)
      first = start
      last = line_last(text, first)
      start = last + 2
      reading%line = reading%line + 1
      if (content_end(text, first, last) < first) last = first - 1
    end do
    columns = merge(1, 0, last >= first)
    last = first - 1 + len_trim(text(first:last))
    separator = reading%separator
    if (separator == ',' .and. index(text(first:last), ',') == 0 .and. index(text(first:last), tab) > 0) separator = tab
    if (columns > 0) last = last - merge(1, 0, text(last:last) == separator)   ! nothing after the last one is no column
    do i = first, last
      if (text(i:i) == separator) columns = columns + 1
    end do
    allocate (names(columns))
    do i = 1, size(names)
      comma = first + index(text(first:last), separator) - 1
      if (comma < first) comma = last + 1
      names(i)%text = text(first - 1 + verify(text(first:comma - 1) // '.', blanks // quotes): &
                           first - 1 + verify(text(first:comma - 1), blanks // quotes // carriage_return, back=.true.))
      first = comma + 1
    end do
    line = reading%line
    call check_names(reading, names)
    reading%columns = size(names)
    call read_rows(text, start, reading, lines, rows)
    call check_whole(reading, rows, least=1, is_binary=index(text, achar(0)) > 0)
    allocate (values(size(names), rows))
    values = lines(:, :rows)
    call move_alloc(reading%messages, messages)
  end subroutine read_list_text

  !> The separator of the columns of a text: ';' if there is one in any line; a tab if all lines have one and some of them commas
  !> that do not stand beside a blank or tab; else a comma, beside which blanks and tabs separate as well.
  pure character function separator_of(text) result(separator)
    character(len=*), intent(in) :: text
    integer :: begin, last, lines, start, tabbed
    logical :: has_decimals, has_lists

    separator = ','
    lines = 0
    tabbed = 0
    has_decimals = .false.
    has_lists = .false.
    start = first_position(text)
    do while (start <= len(text))
      last = content_end(text, start, line_last(text, start))
      begin = start
      start = line_last(text, start) + 2
      if (last < begin) cycle
      associate (content => text(begin - 1 + verify(text(begin:last), blanks):last))
        if (index(content, ';') > 0) then
          separator = ';'
          return
        end if
        lines = lines + 1
        if (index(content, tab) > 0) tabbed = tabbed + 1
        has_decimals = has_decimals .or. index(content, ',') > 0
        has_lists = has_lists .or. has_comma_at_blank(content)
      end associate
    end do
    if (has_decimals .and. tabbed == lines .and. .not. has_lists) separator = tab
  end function separator_of

  !> Whether a comma stands beside a blank, or at an end.
  pure logical function has_comma_at_blank(content) result(has)
    character(len=*), intent(in) :: content
    integer :: i

    has = .false.
    do i = 1, len(content)
      if (content(i:i) /= ',') cycle
      has = i == 1 .or. i == len(content)
      if (.not. has) has = scan(content(i - 1:i - 1), blanks) > 0 .or. scan(content(i + 1:i + 1), blanks) > 0
      if (has) return
    end do
  end function has_comma_at_blank

  !> A line with points in its numbers and commas between its columns.
  pure function plain(content, separator)
    character(len=*), intent(in) :: content
    character, intent(in) :: separator   !! of its columns
    character(len=len(content)) :: plain
    integer :: i

    plain = content
    if (separator == ',') return
    do i = 1, len(plain)
      if (plain(i:i) == ',') then
        plain(i:i) = '.'
      else if (plain(i:i) == separator) then
        plain(i:i) = ','
      end if
    end do
  end function plain

  !> Last position of the line that begins at `start`.
  pure integer function line_last(text, start)
    character(len=*), intent(in) :: text
    integer, intent(in) :: start   !! position of its first character

    line_last = start - 2 + index(text(start:), line_end)
    if (line_last < start - 1) line_last = len(text)
  end function line_last

  !> Refuses names of a file with another format; then there are none.
  subroutine check_names(reading, names)
    type(table_reader_t), intent(inout) :: reading
    type(string_t), allocatable, intent(inout) :: names(:)
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
    reading%has_other_format = .true.
    call add_error(reading, ':' // to_text(reading%line) // ': ' // message)
    names = [string_t ::]
  end subroutine check_names

  !> Reads the rows of all lines from position `first` on. The room for them grows with the number of rows, not of lines.
  subroutine read_rows(text, first, reading, values, rows)
    character(len=*), intent(in) :: text
    integer, intent(in) :: first   !! position of the first line
    type(table_reader_t), intent(inout) :: reading
    real(wp), allocatable, intent(out) :: values(:, :)   !! [columns, at least rows], the first `rows` are in use
    integer, intent(out) :: rows
    real(wp), allocatable :: more(:, :)
    integer :: last, start

    allocate (values(reading%columns, 4))
    rows = 0
    start = first
    do while (start <= len(text) .and. .not. reading%has_other_format)
      last = line_last(text, start)
      reading%line = reading%line + 1
      if (rows == size(values, 2)) then
        allocate (more(reading%columns, 2 * rows))
        more(:, :rows) = values
        call move_alloc(more, values)
      end if
      call read_line(text(start:content_end(text, start, last)), reading, values, rows)
      start = last + 2
    end do
  end subroutine read_rows

  !> Last position of a line without its comment, its trailing blanks and carriage returns. Excel's 'sep=;' is a comment.
  pure integer function content_end(text, first, last)
    character(len=*), intent(in) :: text
    integer, intent(in) :: first, last   !! positions of the line
    integer :: comment

    comment = scan(text(first:last), comments)
    content_end = last
    if (comment > 0) content_end = first + comment - 2
    content_end = first - 1 + verify(text(first:content_end), blanks // carriage_return, back=.true.)
    if (content_end > first + 4 .or. content_end < first + 3) return
    if (lower_case(text(first:first + 3)) == 'sep=') content_end = first - 1
  end function content_end

  !> Reads one line as the next row, or adds an error.
  subroutine read_line(content, reading, values, rows)
    character(len=*), intent(in) :: content
    type(table_reader_t), intent(inout) :: reading
    real(wp), intent(inout) :: values(:, :)   !! [columns, lines]
    integer, intent(inout) :: rows   !! number of rows so far
    integer, allocatable :: begins(:), ends(:)
    integer :: column, found
    character(len=:), allocatable :: message

    if (content == '') return
    if (reading%is_list .and. scan(content, quotes) > 0) then
      reading%has_other_format = .true.
      call add_error(reading, ':' // to_text(reading%line) // ': quotes in ' // excerpt(content) // '; needed: plain numbers')
      return
    end if
    allocate (begins(reading%columns), ends(reading%columns))
    call split(plain(content, reading%separator), begins, ends, found)
    if (found /= reading%columns) then
      message = counted(found, 'column', 'columns') // ' in ' // excerpt(content) // '; needed: ' // to_text(reading%columns) // &
                separation(reading%separator, found > reading%columns .and. index(content, ',') > 0)
    else
      message = ''
      do column = 1, found
        if (message == '') call read_column(content(begins(column):ends(column)), column, reading, &
                                            values(column, rows + 1), message)
      end do
    end if
    if (.not. reading%is_list) then
      if (message /= '' .and. rows == 0 .and. reading%errors == 0 .and. scan(content, '0123456789') == 0) then
        message = message // '; a line with names of columns must begin with #'
      end if
      if (message == '' .and. rows > 0) then
        if (values(1, rows + 1) <= values(1, rows)) message = 'column 1, ' // to_text(values(1, rows + 1)) // &
          ', must be greater than ' // to_text(values(1, rows)) // ' on line ' // to_text(reading%last_row_line)
      end if
    end if
    if (message /= '') then
      call add_error(reading, ':' // to_text(reading%line) // ': ' // message)
    else
      rows = rows + 1
      reading%last_row_line = reading%line
    end if
  end subroutine read_line

  !> What columns are separated by.
  pure function separation(separator, has_commas) result(text)
    character, intent(in) :: separator
    logical, intent(in) :: has_commas   !! which may be the ones of decimals
    character(len=:), allocatable :: text

    select case (separator)
    case (';')
      text = ', separated by semicolons as in other lines'
    case (tab)
      text = ', separated by tabs, as the commas are those of decimals'
    case default
      text = ', separated by blanks or a comma'
      if (has_commas) text = text // '; with decimal commas by semicolons or tabs'
    end select
  end function separation

  !> Positions of the columns and their number; a comma without a value before it counts as a column.
  pure subroutine split(content, begins, ends, found)
    character(len=*), intent(in) :: content   !! without blanks at its end
    integer, intent(out) :: begins(:), ends(:)   !! positions of the first columns, [columns]
    integer, intent(out) :: found   !! number of columns
    integer :: first, last

    found = 0
    first = 1
    call skip_blanks(content, first)
    do while (first <= len(content))
      last = first - 2 + scan(content(first:), blanks // ',')
      if (last < first - 1) last = len(content)
      found = found + 1
      if (found <= size(begins)) then
        begins(found) = first
        ends(found) = last
      end if
      first = last + 1
      call skip_blanks(content, first)
      if (first > len(content)) return
      if (content(first:first) /= ',') cycle
      first = first + 1
      call skip_blanks(content, first)
      if (first <= len(content)) cycle
      found = found + 1   ! an empty column after the last comma
      if (found > size(begins)) cycle
      begins(found) = 1
      ends(found) = 0
    end do
  end subroutine split

  !> Moves forward to the next character that is not blank, or behind the end.
  pure subroutine skip_blanks(text, position)
    character(len=*), intent(in) :: text
    integer, intent(inout) :: position
    integer :: length

    length = verify(text(position:), blanks) - 1
    position = merge(position + length, len(text) + 1, length >= 0)
  end subroutine skip_blanks

  !> Reads one number.
  subroutine read_column(text, column, reading, value, message)
    character(len=*), intent(in) :: text
    integer, intent(in) :: column           !! index, for the message
    type(table_reader_t), intent(in) :: reading
    real(wp), intent(out) :: value
    character(len=:), allocatable, intent(out) :: message
    character(len=:), allocatable :: limit
    integer :: status

    call read_real(plain(text, reading%separator), value, status)
    message = number_problem(status)
    limit = size_limit(value, anything, ascends=column == 1)   ! a number of a list is checked as a value of its variant
    if (limit /= '' .and. .not. reading%is_list) message = ' is out of range; allowed: ' // limit(3:)
    if (message /= '') message = 'column ' // to_text(column) // ', ' // excerpt(text) // ',' // message
  end subroutine read_column

  pure function excerpt(text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: excerpt

    excerpt = quoted(shortened(text, 40))
  end function excerpt

  !> Counts an error; the first ones are kept as messages.
  subroutine add_error(reading, text)
    type(table_reader_t), intent(inout) :: reading
    character(len=*), intent(in) :: text

    reading%errors = reading%errors + 1
    if (reading%errors <= most_messages) call append(reading%messages, reading%file // text)
  end subroutine add_error

  !> Adds the messages on the file as a whole.
  subroutine check_whole(reading, rows, least, is_binary)
    type(table_reader_t), intent(inout) :: reading
    integer, intent(in) :: rows
    integer, intent(in) :: least   !! number of rows needed
    logical, intent(in) :: is_binary

    if (is_binary) then
      reading%messages = [string_t ::]
      call append(reading%messages, reading%file // ': not a text file')
    else if (reading%errors > most_messages) then
      call append(reading%messages, reading%file // ': ' // to_text(reading%errors - most_messages) // ' more lines are wrong')
    else if (reading%errors == 0 .and. rows < least) then
      call add_error(reading, ': ' // counted(rows, 'row', 'rows') // '; needed: at least ' // to_text(least))
    end if
  end subroutine check_whole

end module nocdyn_table_file
