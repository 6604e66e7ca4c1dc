!> How numbers and texts stand in the lines of a table: what separates its columns, and whether commas are the ones of decimals.
!> Columns are separated by semicolons, tabs, commas or blanks; # and ! begin comments outside of quotes. The lines that begin
!> with a number decide.
module nocdyn_table_dialect
  use nocdyn_text, only: lower_case
  use nocdyn_text_file, only: first_position
  implicit none (type, external)
  private

  public :: find_cells, find_content, find_dialect, find_lines

  character(len=*), parameter, public :: tab = achar(9), blanks = ' ' // tab   !! what stands beside cells
  character(len=*), parameter :: line_end = achar(10), carriage_return = achar(13), quotes = '"' // "'"

  ! Codes of characters: gfortran compares characters, but not their codes, by calls of its library.
  integer, parameter :: c_line_end = 10, c_blank = 32, c_tab = 9, c_return = 13, c_quote = 34, c_apostrophe = 39
  integer, parameter :: c_comma = 44, c_semicolon = 59, c_hash = 35, c_exclamation = 33
  integer, parameter :: c_zero = 48, c_nine = 57, c_plus = 43, c_minus = 45, c_point = 46
  integer, parameter :: c_d = 100, c_e = 101, c_large_d = 68, c_large_e = 69

  !> How a text separates its columns.
  type, public :: dialect_t
    character :: separator = ' '             !! ';', ',', a tab, or a blank: blanks and tabs
    logical :: takes_blanks = .true.         !! blanks and tabs separate columns as well
    logical :: has_decimal_commas = .false.  !! commas in cells are the ones of decimals
  end type dialect_t

  !> What one line has outside of quotes, or what some lines have.
  type :: tally_t
    integer :: lines = 0
    integer :: semicolons = 0, commas = 0          !! numbers of them
    integer :: tabbed = 0                          !! lines with tabs
    integer :: most_tabs = 0, filled_tabs = 0      !! in a line, and in one that has something in all cells between them
    integer :: fewest_words = huge(1), most_words = 0   !! between blanks and tabs
    logical :: has_comma_at_blank = .false.        !! or at an end of a line
    logical :: has_commas_in_word = .false.        !! two or more
    logical :: has_quoted_comma = .false.
    logical :: exceeds_commas = .false., exceeds_tabs = .false.   !! a line of numbers has more of them than these separate
  end type tally_t

contains

  !> Positions of the lines of a text that are not empty without their comments.
  pure subroutine find_lines(text, firsts, lasts, numbers)
    character(len=*), intent(in) :: text
    integer, allocatable, intent(out) :: firsts(:), lasts(:)   !! of their contents
    integer, allocatable, intent(out) :: numbers(:)            !! of the lines, from 1
    integer, allocatable :: found(:, :), more(:, :)
    integer :: count, first, last, line, next, start

    allocate (found(3, 64))
    count = 0
    line = 0
    start = first_position(text)
    do while (start <= len(text))
      line = line + 1
      call find_content(text, start, first, last, next)
      start = next
      if (last < first) cycle
      if (count == size(found, 2)) then
        allocate (more(3, 2 * count))
        more(:, :count) = found
        call move_alloc(more, found)
      end if
      count = count + 1
      found(:, count) = [first, last, line]
    end do
    allocate (firsts(count), lasts(count), numbers(count))
    firsts = found(1, :count)
    lasts = found(2, :count)
    numbers = found(3, :count)
  end subroutine find_lines

  !> The content of the line that begins at `start`: without its comment and the blanks behind. Excel's 'sep=;' is a comment.
  pure subroutine find_content(text, start, first, last, next)
    character(len=*), intent(in) :: text
    integer, intent(in) :: start         !! position
    integer, intent(out) :: first, last  !! positions; last < first: the line is empty
    integer, intent(out) :: next         !! position of the next line
    integer :: closing, i

    first = start
    last = start - 1
    i = start
    do while (i <= len(text))
      select case (iachar(text(i:i)))
      case (c_line_end, c_hash, c_exclamation)
        exit
      case (c_blank, c_tab, c_return)
      case (c_quote, c_apostrophe)
        closing = closing_quote(text(:line_last(text, i)), i, start)
        if (closing > 0) i = closing
        last = i
      case default
        last = i
      end select
      i = i + 1
    end do
    next = line_last(text, i) + 2
    if (last < start + 3 .or. last > start + 4) return
    if (lower_case(text(start:start + 3)) == 'sep=') last = start - 1
  end subroutine find_content

  !> Last position of the line that has a position.
  pure integer function line_last(text, position)
    character(len=*), intent(in) :: text
    integer, intent(in) :: position

    line_last = position - 2 + index(text(position:), line_end)
    if (line_last < position - 1) line_last = len(text)
  end function line_last

  !> Position of the quote that closes the one that begins a cell, 0 if this one is a part of a text.
  pure integer function closing_quote(text, open, start) result(closing)
    character(len=*), intent(in) :: text   !! up to the end of the line
    integer, intent(in) :: open            !! position of the first quote
    integer, intent(in) :: start           !! of the line
    integer :: i

    closing = 0
    do i = open - 1, start, -1
      if (scan(text(i:i), ' ' // tab // ',;') > 0) exit
      return
    end do
    closing = open
    do
      i = index(text(closing + 1:), text(open:open))
      if (i == 0) exit
      closing = closing + i
      if (closing == len(text)) return
      if (text(closing + 1:closing + 1) /= text(open:open)) then   ! a doubled quote is one in the text
        if (scan(text(closing + 1:closing + 1), ' ' // tab // ',;#!' // carriage_return) > 0) return
        exit
      end if
      closing = closing + 1
    end do
    closing = 0
  end function closing_quote

  !> Finds how the columns of some lines are separated.
  pure subroutine find_dialect(text, firsts, lasts, dialect)
    character(len=*), intent(in) :: text
    integer, intent(in) :: firsts(:), lasts(:)   !! positions of the lines
    type(dialect_t), intent(out) :: dialect
    type(tally_t) :: other, rows
    integer :: i

    do i = 1, size(firsts)
      if (begins_with_number(text(firsts(i):lasts(i)))) then
        call add_line(text(firsts(i):lasts(i)), rows)
      else
        call add_line(text(firsts(i):lasts(i)), other)
      end if
    end do
    if (rows%lines == 0) rows = other
    if (rows%semicolons > 0) then
      dialect = dialect_t(';', .false., .true.)
    else if (rows%commas > 0 .and. (rows%tabbed == rows%lines .or. has_tabs(rows) .and. .not. rows%has_commas_in_word) .and. &
             .not. rows%has_comma_at_blank) then
      dialect = dialect_t(tab, .false., .true.)
    else if (rows%commas > 0 .and. has_blanks_with_decimal_commas(rows, other)) then
      dialect = dialect_t(' ', .true., .true.)
    else if (rows%commas > 0) then
      dialect = dialect_t(',', rows%exceeds_commas, rows%has_quoted_comma)
    else if (has_tabs(rows)) then
      dialect = dialect_t(tab, .false., rows%has_quoted_comma)
    else
      dialect%has_decimal_commas = rows%has_quoted_comma
    end if
  end subroutine find_dialect

  !> Whether tabs separate columns, also empty ones: a line with most of them is filled, and no line has more numbers.
  pure logical function has_tabs(rows) result(has)
    type(tally_t), intent(in) :: rows

    has = rows%most_tabs > 0 .and. rows%filled_tabs == rows%most_tabs .and. .not. rows%exceeds_tabs
  end function has_tabs

  !> Whether blanks separate numbers with decimal commas: as many words in each line, no list, no names separated by commas.
  pure logical function has_blanks_with_decimal_commas(rows, other) result(has)
    type(tally_t), intent(in) :: rows, other   !! lines that begin with a number, and others

    has = rows%fewest_words > 1 .and. rows%fewest_words == rows%most_words .and. other%commas == 0
    has = has .and. .not. (rows%has_comma_at_blank .or. rows%has_commas_in_word)
  end function has_blanks_with_decimal_commas

  !> Whether the first cell of a line that has something begins as a number does.
  pure logical function begins_with_number(content) result(begins)
    character(len=*), intent(in) :: content
    integer :: first

    first = verify(content, blanks // quotes // ',;')
    begins = first > 0
    if (.not. begins) return
    begins = scan(content(first:first), '0123456789+-.') > 0
    if (first + 2 <= len(content)) begins = begins .or. lower_case(content(first:first + 2)) == 'nan'
  end function begins_with_number

  !> Adds what a line has.
  pure subroutine add_line(content, tally)
    character(len=*), intent(in) :: content   !! without blanks at its end
    type(tally_t), intent(inout) :: tally
    integer :: closing, commas, commas_in_word, i, parts, tabs, words
    logical :: fills, is_in_word, is_plain

    commas = 0
    commas_in_word = 0
    parts = 1
    tabs = 0
    words = 0
    fills = .true.        ! no tab stands beside another or at an end
    is_in_word = .false.
    is_plain = .true.     ! only numbers
    i = 1
    do while (i <= len(content))
      select case (iachar(content(i:i)))
      case (c_blank)
        is_in_word = .false.
      case (c_tab)
        tabs = tabs + 1
        if (.not. is_in_word) fills = fills .and. words > 0 .and. content(max(1, i - 1):max(1, i - 1)) /= tab
        is_in_word = .false.
      case default
        if (.not. is_in_word) then
          words = words + 1
          commas_in_word = 0
        end if
        is_in_word = .true.
        select case (iachar(content(i:i)))
        case (c_semicolon)
          tally%semicolons = tally%semicolons + 1
        case (c_comma)
          commas = commas + 1
          commas_in_word = commas_in_word + 1
          if (commas_in_word > 1) tally%has_commas_in_word = .true.
          if (i == 1 .or. i == len(content)) then
            tally%has_comma_at_blank = .true.
          else if (is_blank(content(i - 1:i - 1)) .or. is_blank(content(i + 1:i + 1))) then
            tally%has_comma_at_blank = .true.
          end if
        case (c_quote, c_apostrophe)
          closing = closing_quote(content, i, 1)
          if (closing > 0) then
            tally%has_quoted_comma = tally%has_quoted_comma .or. index(content(i:closing), ',') > 0
            i = closing
          end if
        case (c_zero:c_nine, c_plus, c_minus, c_point, c_d, c_e, c_large_d, c_large_e)
        case default
          is_plain = .false.
        end select
      end select
      i = i + 1
    end do
    tally%lines = tally%lines + 1
    tally%commas = tally%commas + commas
    if (tabs > 0) tally%tabbed = tally%tabbed + 1
    tally%most_tabs = max(tally%most_tabs, tabs)
    tally%fewest_words = min(tally%fewest_words, words)
    tally%most_words = max(tally%most_words, words)
    if (fills) tally%filled_tabs = max(tally%filled_tabs, tabs)
    if (.not. is_plain .or. words < 2) return
    call count_cells(content, dialect_t(','), parts)
    tally%exceeds_commas = tally%exceeds_commas .or. parts > commas + 1
    tally%exceeds_tabs = tally%exceeds_tabs .or. words > tabs + 1
  end subroutine add_line

  pure logical function is_blank(letter)
    character(len=1), intent(in) :: letter

    is_blank = iachar(letter) == c_blank .or. iachar(letter) == c_tab
  end function is_blank

  !> The number of cells of a line.
  pure subroutine count_cells(content, dialect, found)
    character(len=*), intent(in) :: content
    type(dialect_t), intent(in) :: dialect
    integer, intent(out) :: found
    integer :: begins(0), ends(0)

    call find_cells(content, dialect, begins, ends, found)
  end subroutine count_cells

  !> Positions of the cells of a line, without blanks and quotes around them, and their number. Where blanks separate too, a comma
  !> without a value before it counts as a cell.
  pure subroutine find_cells(content, dialect, begins, ends, found)
    character(len=*), intent(in) :: content      !! without blanks at its end
    type(dialect_t), intent(in) :: dialect
    integer, intent(out) :: begins(:), ends(:)   !! positions of the first cells, as many as fit
    integer, intent(out) :: found                !! number of cells, also beyond these
    integer :: first, last

    found = 0
    first = 1
    if (dialect%takes_blanks) call skip_blanks(content, first)
    if (first > len(content)) return
    do
      last = cell_end(content, first, dialect)
      found = found + 1
      if (found <= size(begins)) then
        begins(found) = first
        ends(found) = last
        call trim_cell(content, begins(found), ends(found))
      end if
      first = last + 1
      if (dialect%takes_blanks) call skip_blanks(content, first)
      if (first > len(content)) return
      if (dialect%takes_blanks .and. content(first:first) /= dialect%separator) cycle
      first = first + 1
      if (dialect%takes_blanks) call skip_blanks(content, first)
      if (first <= len(content)) cycle
      found = found + 1   ! an empty cell after the last separator
      if (found > size(begins)) return
      begins(found) = 1
      ends(found) = 0
      return
    end do
  end subroutine find_cells

  !> Last position of the cell that begins at `first`.
  pure integer function cell_end(content, first, dialect) result(last)
    character(len=*), intent(in) :: content
    integer, intent(in) :: first
    type(dialect_t), intent(in) :: dialect
    integer :: closing, i, separator

    separator = iachar(dialect%separator)
    last = first - 1
    do i = first, len(content)
      if (iachar(content(i:i)) == separator .or. .not. is_blank(content(i:i))) exit
    end do
    if (i <= len(content)) then
      if (iachar(content(i:i)) == c_quote .or. iachar(content(i:i)) == c_apostrophe) then
        closing = closing_quote(content, i, first)
        if (closing > 0) last = closing
      end if
    end if
    do while (last < len(content))
      if (iachar(content(last + 1:last + 1)) == separator) return
      if (dialect%takes_blanks .and. is_blank(content(last + 1:last + 1))) return
      last = last + 1
    end do
  end function cell_end

  !> Leaves out blanks and a pair of quotes around a cell.
  pure subroutine trim_cell(content, first, last)
    character(len=*), intent(in) :: content
    integer, intent(inout) :: first, last
    integer :: round

    do round = 1, 2
      do while (first <= last)
        if (.not. is_blank(content(first:first))) exit
        first = first + 1
      end do
      do while (last >= first)
        if (.not. is_blank(content(last:last))) exit
        last = last - 1
      end do
      if (round == 2 .or. last <= first) return
      if (all(iachar(content(first:first)) /= [c_quote, c_apostrophe])) return
      if (content(first:first) /= content(last:last)) return
      first = first + 1
      last = last - 1
    end do
  end subroutine trim_cell

  !> Moves forward to the next character that is not blank, or behind the end.
  pure subroutine skip_blanks(text, position)
    character(len=*), intent(in) :: text
    integer, intent(inout) :: position

    do while (position <= len(text))
      if (.not. is_blank(text(position:position))) return
      position = position + 1
    end do
  end subroutine skip_blanks

end module nocdyn_table_dialect
