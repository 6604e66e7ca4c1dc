!> Tables in text files: headings, cells and numbers, in any dialect of spreadsheets and recorders.
module nocdyn_data_table
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_kinds, only: wp
  use nocdyn_line_messages, only: line_messages_t
  use nocdyn_literals, only: literal_malformed, literal_not_finite, literal_ok, number_problem, read_real
  use nocdyn_table_dialect, only: blanks, dialect_t, find_cells, find_dialect, find_lines, tab
  use nocdyn_text, only: append, counted, lower_case, quoted, shortened, string_t, to_text
  use nocdyn_text_file, only: first_position
  implicit none (type, external)
  private

  public :: read_data_table, split_unit

  ! Where the headings of a table are.
  integer, parameter, public :: headings_first = 1   !! the first line that is not empty
  integer, parameter, public :: headings_above = 2   !! the line above the first row, if it has no number; it may begin with #
  integer, parameter, public :: headings_after_preamble = 3   !! the same, below lines that are unlike the last ones

  !> A table in a text. Rows with another number of cells than columns are among its rows: `row_problem` says so.
  type, public :: data_table_t
    character(len=:), allocatable :: text
    type(dialect_t) :: dialect
    integer :: columns = 0
    integer :: rows = 0
    integer :: heading_line = 0                  !! line of the headings, 0 if there are none
    character(len=:), allocatable :: doubt       !! why a line is none that looks like headings, e.g. "line 2 looks like ..."
    type(string_t), allocatable :: headings(:)   !! [columns], '' where there is none; with their units
    integer, allocatable :: lines(:)             !! number of the line of each row
    integer, allocatable, private :: firsts(:), lasts(:)        !! positions of the rows in the text
    integer, allocatable, private :: counts(:)                  !! cells of each row
    integer, allocatable, private :: begins(:, :), ends(:, :)   !! positions in the row, [columns, rows]
  contains
    procedure :: cell
    procedure :: row_text
    procedure :: row_problem
    procedure :: find_column
    procedure :: read_cell
    procedure :: read_columns
  end type data_table_t

contains

  !> Finds headings and cells of a table. Missing cells at the end of a row that is separated by other than blanks are empty ones
  !> if `columns` is 0, unless all rows are to be full.
  subroutine read_data_table(text, headings, columns, table, are_full)
    character(len=*), intent(in) :: text
    integer, intent(in) :: headings   !! `headings_first` ...
    integer, intent(in) :: columns    !! number of columns needed, 0: as many as headings or the rows have
    type(data_table_t), intent(out) :: table
    logical, intent(in), optional :: are_full   !! no if absent
    integer, allocatable :: firsts(:), lasts(:), numbers(:)
    integer :: first, r, sample
    logical :: is_complete

    table%text = text
    table%columns = columns
    call find_lines(text, firsts, lasts, numbers)
    call find_dialect(text, firsts, lasts, table%dialect)
    select case (headings)
    case (headings_first)
      first = min(1, size(firsts))
      if (first == 1) call take_names(table, whole_line(text, firsts(1)), numbers(1))
      first = 2
    case (headings_above)
      call find_first_row(table, firsts, lasts, numbers, 1, first)
    case default
      call find_sample(table, firsts, lasts, sample)
      call find_first_row(table, firsts, lasts, numbers, sample, first)
      if (.not. allocated(table%headings)) call find_doubt(table, firsts, lasts, numbers, first)
    end select
    if (.not. allocated(table%headings)) call no_headings(table)
    table%rows = max(0, size(firsts) - first + 1)
    allocate (table%lines, source=numbers(min(first, size(firsts) + 1):))
    allocate (table%firsts, source=firsts(min(first, size(firsts) + 1):))
    allocate (table%lasts, source=lasts(min(first, size(firsts) + 1):))
    allocate (table%counts(table%rows), table%begins(table%columns, table%rows), table%ends(table%columns, table%rows))
    do r = 1, table%rows
      call find_cells(text(table%firsts(r):table%lasts(r)), table%dialect, table%begins(:, r), table%ends(:, r), table%counts(r))
      is_complete = columns > 0 .or. table%dialect%takes_blanks .or. table%counts(r) >= table%columns
      if (present(are_full)) is_complete = is_complete .or. are_full
      if (is_complete) cycle
      table%begins(table%counts(r) + 1:, r) = 1
      table%ends(table%counts(r) + 1:, r) = 0
      table%counts(r) = table%columns
    end do
  end subroutine read_data_table

  !> The line that begins at a position, with what may be a comment: '#' may be a part of a name.
  pure function whole_line(text, first) result(line)
    character(len=*), intent(in) :: text
    integer, intent(in) :: first   !! position
    character(len=:), allocatable :: line
    integer :: last

    last = first - 2 + index(text(first:), achar(10))
    if (last < first) last = len(text)
    line = text(first:first - 1 + verify(text(first:last), blanks // achar(13), back=.true.))
  end function whole_line

  !> The headings of a table that has none.
  subroutine no_headings(table)
    type(data_table_t), intent(inout) :: table
    integer :: i

    allocate (table%headings(table%columns))
    do i = 1, table%columns
      table%headings(i)%text = ''
    end do
  end subroutine no_headings

  !> Takes the first line as the names of all columns. Nothing after the last separator is no column.
  subroutine take_names(table, content, line)
    type(data_table_t), intent(inout) :: table
    character(len=*), intent(in) :: content
    integer, intent(in) :: line
    type(dialect_t) :: dialect
    integer :: last

    dialect = table%dialect
    if (dialect%separator == ' ' .and. scan(content, tab) > 0) dialect%separator = tab
    if (dialect%separator == ' ' .or. dialect%separator == ',') dialect%separator = ','   ! names may have blanks
    dialect%takes_blanks = .false.
    last = len(content)
    if (content(last:) == dialect%separator) last = last - 1
    call split_texts(content(:last), dialect, table%headings)
    table%heading_line = line
    table%columns = size(table%headings)
  end subroutine take_names

  !> The cells of a line.
  subroutine split_texts(content, dialect, texts)
    character(len=*), intent(in) :: content
    type(dialect_t), intent(in) :: dialect
    type(string_t), allocatable, intent(out) :: texts(:)
    integer :: begins(len(content) + 1), ends(len(content) + 1), found, i

    call find_cells(content, dialect, begins, ends, found)
    allocate (texts(found))
    do i = 1, found
      texts(i)%text = content(begins(i):ends(i))
    end do
  end subroutine split_texts

  !> Finds a line that is like the rows of the table: of the last three lines the last one with most numbers; then the first line
  !> with numbers, or nothing, where that has numbers.
  subroutine find_sample(table, firsts, lasts, first)
    type(data_table_t), intent(inout) :: table        !! `columns` is set if it is 0
    integer, intent(in) :: firsts(:), lasts(:)
    integer, intent(out) :: first                     !! index of the first row
    type(string_t), allocatable :: cells(:), sample(:)
    integer :: i, k, most, numbers
    logical :: is_row

    first = size(firsts) + 1
    allocate (sample(0))
    most = 0
    do i = max(1, size(firsts) - 2), size(firsts)
      call split_texts(table%text(firsts(i):lasts(i)), table%dialect, cells)
      numbers = count([(is_number(table, cells(k)%text), k=1, size(cells))])
      if (numbers < most) cycle
      most = numbers
      call move_alloc(cells, sample)
    end do
    table%columns = size(sample)
    do first = 1, size(firsts)
      call split_texts(table%text(firsts(first):lasts(first)), table%dialect, cells)
      if (size(cells) > size(sample) .or. (size(cells) < size(sample) .and. table%dialect%takes_blanks)) cycle
      is_row = .false.
      do k = 1, size(cells)
        if (.not. is_number(table, sample(k)%text)) cycle
        is_row = is_number(table, cells(k)%text) .or. is_gap(cells(k)%text)
        if (.not. is_row) exit
      end do
      if (is_row) return
    end do
  end subroutine find_sample

  !> Finds headings above the first row: a line without numbers that has as many cells as there are columns, in the way of the
  !> rows or between commas, semicolons or tabs; or a comment of as many cells.
  subroutine find_first_row(table, firsts, lasts, numbers, from, first)
    type(data_table_t), intent(inout) :: table
    integer, intent(in) :: firsts(:), lasts(:), numbers(:)
    integer, intent(in) :: from     !! index of the first line that may be a row
    integer, intent(out) :: first   !! of the first row
    integer :: line, start, stop

    first = from
    if (from > size(firsts)) return
    line = max(1, from - 1)
    call take_headings(table, whole_line(table%text, firsts(line)), numbers(line))
    if (.not. allocated(table%headings)) call take_headings(table, table%text(firsts(line):lasts(line)), numbers(line))
    if (allocated(table%headings)) then
      first = line + 1
      return
    end if
    stop = firsts(from) - 2   ! the line before it, if that is a comment
    if (stop < 1) return
    start = index(table%text(:stop), achar(10), back=.true.) + 1
    if (start == 1) start = first_position(table%text)
    if (stop <= start) return
    if (scan(table%text(start:start), '#!') == 0) return
    if (table%text(stop:stop) == achar(13)) stop = stop - 1
    start = start + verify(table%text(start:stop), '#! ' // tab) - 1
    stop = start - 1 + len_trim(table%text(start:stop))
    call take_headings(table, table%text(start:stop), numbers(from) - 1)
  end subroutine find_first_row

  !> Finds a line farther above the first row that looks like headings: the line after it is then probably a wrong row.
  subroutine find_doubt(table, firsts, lasts, numbers, first)
    type(data_table_t), intent(inout) :: table
    integer, intent(in) :: firsts(:), lasts(:), numbers(:)
    integer, intent(in) :: first   !! of the first row
    type(string_t), allocatable :: cells(:)
    integer :: i, k

    do i = first - 2, 1, -1
      call take_headings(table, table%text(firsts(i):lasts(i)), numbers(i))
      if (.not. allocated(table%headings)) cycle
      deallocate (table%headings)
      table%heading_line = 0
      table%doubt = 'line ' // to_text(numbers(i)) // ' looks like headings, but line ' // to_text(numbers(i + 1)) // &
                    ' is no row of numbers'
      call split_texts(table%text(firsts(i + 1):lasts(i + 1)), table%dialect, cells)
      do k = 1, size(cells)
        if (is_number(table, cells(k)%text) .or. scan(cells(k)%text, '0123456789') /= 1) cycle
        table%doubt = table%doubt // ': ' // quoted(shortened(cells(k)%text))
        exit
      end do
      return
    end do
  end subroutine find_doubt

  !> Takes a line as headings if it has one for each column and no number.
  subroutine take_headings(table, content, line)
    type(data_table_t), intent(inout) :: table
    character(len=*), intent(in) :: content
    integer, intent(in) :: line
    character(len=*), parameter :: separators = ';' // tab // ','
    type(string_t), allocatable :: texts(:)
    integer :: i, k

    do i = 0, len(separators)
      if (i == 0) then
        call split_texts(content, table%dialect, texts)
        if (table%dialect%separator == ' ') call join_units(texts)
      else
        call split_texts(content, dialect_t(separators(i:i), .false.), texts)
      end if
      if (size(texts) == table%columns) exit
    end do
    if (size(texts) /= table%columns) return
    if (any([(is_number(table, texts(k)%text), k=1, size(texts))])) return
    if (all([(texts(k)%text == '', k=1, size(texts))])) return
    call move_alloc(texts, table%headings)
    table%heading_line = line
  end subroutine take_headings

  !> Joins words in brackets, such as '[kN' and 'm]', with the one before them.
  subroutine join_units(texts)
    type(string_t), allocatable, intent(inout) :: texts(:)
    type(string_t), allocatable :: joined(:)
    integer :: depth, i, k

    allocate (joined(0))
    depth = 0
    do i = 1, size(texts)
      if (size(joined) > 0 .and. (depth > 0 .or. index('[(', texts(i)%text(:1)) > 0)) then
        joined(size(joined))%text = joined(size(joined))%text // ' ' // texts(i)%text
      else
        call append(joined, texts(i)%text)
      end if
      do k = 1, len(texts(i)%text)
        depth = depth + merge(1, 0, scan(texts(i)%text(k:k), '[(') > 0) - merge(1, 0, scan(texts(i)%text(k:k), '])') > 0)
      end do
    end do
    call move_alloc(joined, texts)
  end subroutine join_units

  !> Whether a cell holds a number, also one that is not finite or too large.
  logical function is_number(table, text)
    type(data_table_t), intent(in) :: table
    character(len=*), intent(in) :: text
    real(wp) :: value
    integer :: status

    call read_number(text, table%dialect, value, status)
    is_number = status /= literal_malformed
  end function is_number

  !> Whether a cell says that there is no value.
  pure logical function is_gap(text)
    character(len=*), intent(in) :: text

    is_gap = len(text) == 0
    if (is_gap .or. len(text) > 4) return
    select case (lower_case(text))
    case ('nan', 'na', 'n/a', 'null', '-', '--', '---')
      is_gap = .true.
    case default
      is_gap = .false.
    end select
  end function is_gap

  !> Reads a number with a decimal point or comma.
  subroutine read_number(text, dialect, value, status)
    character(len=*), intent(in) :: text
    type(dialect_t), intent(in) :: dialect
    real(wp), intent(out) :: value
    integer, intent(out) :: status   !! of `read_real`
    character(len=40) :: plain
    integer :: comma

    comma = 0
    if (dialect%has_decimal_commas) comma = index(text, ',')
    if (comma == 0) then
      call read_real(text, value, status)
    else if (len(text) <= len(plain)) then
      plain = text
      plain(comma:comma) = '.'
      call read_real(plain(:len(text)), value, status)
    else
      call read_real(text(:comma - 1) // '.' // text(comma + 1:), value, status)
    end if
  end subroutine read_number

  !> The text of a cell, without quotes around it.
  pure function cell(self, column, row) result(text)
    class(data_table_t), intent(in) :: self
    integer, intent(in) :: column, row
    character(len=max(0, self%ends(column, row) - self%begins(column, row) + 1)) :: text

    associate (start => self%firsts(row) - 1)
      text = self%text(start + self%begins(column, row):start + self%ends(column, row))
    end associate
  end function cell

  !> The text of a row, cut for messages, in quotes.
  pure function row_text(self, row) result(text)
    class(data_table_t), intent(in) :: self
    integer, intent(in) :: row
    character(len=:), allocatable :: text

    text = excerpt(self%text(self%firsts(row):self%lasts(row)))
  end function row_text

  pure function excerpt(text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: excerpt

    excerpt = quoted(shortened(text, 40))
  end function excerpt

  !> What is wrong with the number of cells of a row, '' if nothing is.
  pure function row_problem(self, row) result(message)
    class(data_table_t), intent(in) :: self
    integer, intent(in) :: row
    character(len=:), allocatable :: message

    message = ''
    if (self%counts(row) == self%columns) return
    message = counted(self%counts(row), 'column', 'columns') // ' in ' // self%row_text(row) // '; needed: ' // &
              to_text(self%columns)
    select case (self%dialect%separator)
    case (';')
      message = message // ', separated by semicolons as in other lines'
    case (tab)
      message = message // ', separated by tabs as in other lines'
    case default
      message = message // ', separated by blanks or a comma'
      if (self%counts(row) > self%columns .and. index(self%text(self%firsts(row):self%lasts(row)), ',') > 0) then
        message = message // '; with decimal commas by semicolons or tabs'
      end if
    end select
  end function row_problem

  !> The column with a heading, with or without its unit, in any case of letters; or with a number as text. 0: there is none or,
  !> with the heading, more than one.
  pure integer function find_column(self, key) result(column)
    class(data_table_t), intent(in) :: self
    character(len=*), intent(in) :: key
    character(len=:), allocatable :: name, unit
    integer :: form, i, matches

    do form = 1, 3   ! the whole heading, its name, both in any case of letters
      matches = 0
      do i = 1, self%columns
        associate (heading => self%headings(i)%text)
          call split_unit(heading, name, unit)
          select case (form)
          case (1)
            if (heading /= key) cycle
          case (2)
            if (name /= key) cycle
          case default
            if (lower_case(name) /= lower_case(key) .and. lower_case(heading) /= lower_case(key)) cycle
          end select
        end associate
        matches = matches + 1
        column = i
      end do
      if (matches == 1) return
    end do
    column = 0
    if (matches > 1 .or. len(key) == 0 .or. len(key) > 5 .or. verify(key, '0123456789') > 0) return
    read (key, *) column
    if (column > self%columns) column = 0
  end function find_column

  !> Reads the number of a cell.
  subroutine read_cell(self, column, row, value, is_missing, message)
    class(data_table_t), intent(in) :: self
    integer, intent(in) :: column, row
    real(wp), intent(out) :: value        !! 0 if the cell has none
    logical, intent(out) :: is_missing    !! it is empty or says that there is no value
    character(len=:), allocatable, intent(out) :: message   !! "column 2, 'x', is not a number"; '' if nothing is wrong
    integer :: status

    associate (text => self%text(self%firsts(row) - 1 + self%begins(column, row):self%firsts(row) - 1 + self%ends(column, row)))
      call read_number(text, self%dialect, value, status)
      is_missing = .false.
      if (status /= literal_ok) is_missing = is_gap(text)
      message = ''
      if (status /= literal_ok) message = 'column ' // to_text(column) // ', ' // excerpt(text) // ',' // number_problem(status)
    end associate
  end subroutine read_cell

  !> Reads some columns in which values may be missing: they become NaN.
  subroutine read_columns(self, columns, values, gaps, messages)
    class(data_table_t), intent(in) :: self
    integer, intent(in) :: columns(:)
    real(wp), allocatable, intent(out) :: values(:, :)   !! [rows, columns]
    integer, intent(out) :: gaps(:)                      !! missing values of each column
    type(line_messages_t), intent(inout) :: messages     !! rows with other numbers of cells, cells without a number
    character(len=:), allocatable :: message
    real(wp) :: missing
    logical :: is_missing
    integer :: c, r

    missing = ieee_value(missing, ieee_quiet_nan)
    allocate (values(self%rows, size(columns)))
    gaps = 0
    do r = 1, self%rows
      if (self%counts(r) /= self%columns) then
        call messages%add(self%lines(r), self%row_problem(r))
        cycle
      end if
      do c = 1, size(columns)
        call self%read_cell(columns(c), r, values(r, c), is_missing, message)
        if (is_missing) then
          values(r, c) = missing
          gaps(c) = gaps(c) + 1
        else if (message /= '') then
          call messages%add(self%lines(r), message)
          exit
        end if
      end do
    end do
  end subroutine read_columns

  !> Splits a heading such as 'torque [kN m]' or 'torque (kN m)' into the name of the quantity and its unit.
  pure subroutine split_unit(heading, name, unit)
    character(len=*), intent(in) :: heading
    character(len=:), allocatable, intent(out) :: name, unit   !! `unit` is '' if there is none
    integer :: bracket

    name = heading
    unit = ''
    if (len_trim(heading) == 0) return
    select case (heading(len_trim(heading):len_trim(heading)))
    case (']')
      bracket = index(heading, '[', back=.true.)
    case (')')
      bracket = index(heading, '(', back=.true.)
    case default
      bracket = 0
    end select
    if (bracket < 1) return
    name = trim(heading(:bracket - 1))
    unit = trim(adjustl(heading(bracket + 1:len_trim(heading) - 1)))
  end subroutine split_unit

end module nocdyn_data_table
