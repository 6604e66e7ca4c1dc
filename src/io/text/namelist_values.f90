!> The right-hand side of a namelist assignment, and the subscript of its left-hand side.
module nocdyn_namelist_values
  use nocdyn_literals, only: digits_end, literal_ok, read_integer
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_namelist, only: assignment_t, item_t, namelist_t
  use nocdyn_namelist_cursor, only: cursor_t
  use nocdyn_text, only: shortened, to_text
  implicit none (type, external)
  private

  public :: scan_items, read_subscript

  integer, parameter, public :: longest_list = 1000000   !! largest number of values of a key
  integer, parameter :: most_values = 5000000           !! of all keys of a file: a repeat count writes many with few characters
  character(len=*), parameter :: separators = ' ,/!' // achar(9) // achar(10)

contains

  !> Appends the values at the cursor up to the next key or the end of the group.
  subroutine scan_items(cursor, namelist, diagnostics, is_malformed)
    type(cursor_t), intent(inout) :: cursor
    type(namelist_t), intent(inout) :: namelist
    type(diagnostics_t), intent(inout) :: diagnostics   !! errors are added
    logical, intent(out) :: is_malformed   !! some values cannot be read, which is reported
    logical :: is_valid, is_after_value
    integer :: first_item

    first_item = namelist%item_count + 1
    is_malformed = .false.
    is_after_value = .false.
    do
      call cursor%skip_blanks()
      if (cursor%at_end() .or. cursor%group_ends() > 0 .or. cursor%group_begins()) exit
      if (cursor%next() == ',') then
        if (.not. is_after_value) call namelist%append_item(item_t(line=cursor%line, is_null=.true.))
        is_after_value = .false.
        call cursor%move_to(cursor%at + 1)
      else if (cursor%key_follows()) then
        exit
      else
        call scan_item(cursor, namelist, first_item, diagnostics, is_valid)
        is_malformed = is_malformed .or. .not. is_valid
        is_after_value = .true.
      end if
    end do
    if (is_malformed .and. namelist%group_count > 0) namelist%groups(namelist%group_count)%is_malformed = .true.
  end subroutine scan_items

  !> Scans one value, or several given by a repeat count such as 3*0.5.
  subroutine scan_item(cursor, namelist, first_item, diagnostics, is_valid)
    type(cursor_t), intent(inout) :: cursor
    type(namelist_t), intent(inout) :: namelist
    integer, intent(in) :: first_item   !! index of the first value of this key
    type(diagnostics_t), intent(inout) :: diagnostics
    logical, intent(out) :: is_valid    !! .false. if the value cannot be read, which is reported
    type(item_t) :: item
    integer :: i, repeats, room, start

    start = cursor%at
    call scan_repeat_count(cursor, repeats)
    item%line = cursor%line
    is_valid = repeats >= 1 .and. repeats <= longest_list
    if (.not. is_valid) call diagnostics%add(cursor%line, namelist%group_count, cursor%key // 'the repeat count of ' // &
      shortened(cursor%text(start:cursor%value_end())) // ' must be from 1 to ' // to_text(longest_list))
    if (scan(cursor%next(), '''"') == 1) then
      call scan_quoted(cursor, namelist%group_count, diagnostics, item, is_valid)
    else
      call scan_bare(cursor, namelist%group_count, diagnostics, item, is_valid)
    end if
    if (.not. is_valid) return
    room = min(first_item - 1 + longest_list, most_values) - namelist%item_count
    do i = 1, min(repeats, room + 1)   ! the one that is too many shows that it is reported
      call namelist%append_item(item)
    end do
    is_valid = repeats <= room
    if (is_valid .or. room < 0) return
    if (namelist%item_count > most_values) then
      call diagnostics%add(cursor%line, namelist%group_count, cursor%key // 'too many values; allowed: at most ' // &
                           to_text(most_values) // ' in a file')
    else
      call diagnostics%add(cursor%line, namelist%group_count, cursor%key // 'too many values; allowed: at most ' // &
                           to_text(longest_list) // ' for a key')
    end if
  end subroutine scan_item

  !> Reads and skips a repeat count such as "3*".
  subroutine scan_repeat_count(cursor, repeats)
    type(cursor_t), intent(inout) :: cursor
    integer, intent(out) :: repeats   !! 1 if there is none; the largest integer if the count is too large
    integer :: last, status

    repeats = 1
    last = digits_end(cursor%text, cursor%at - 1)
    if (last < cursor%at) return
    if (cursor%text(last + 1:last + 1) /= '*') return
    call read_integer(cursor%text(cursor%at:last), repeats, status)
    if (status /= literal_ok) repeats = huge(repeats)
    call cursor%move_to(last + 2)
  end subroutine scan_repeat_count

  !> Scans a text in quotes.
  subroutine scan_quoted(cursor, group, diagnostics, item, is_valid)
    type(cursor_t), intent(inout) :: cursor
    integer, intent(in) :: group   !! index of the group, for the diagnostics
    type(diagnostics_t), intent(inout) :: diagnostics
    type(item_t), intent(inout) :: item
    logical, intent(inout) :: is_valid   !! becomes false if the text cannot be read
    integer :: last

    last = cursor%quote_end()
    if (last == 0) then
      call diagnostics%add(cursor%line, group, cursor%key // 'a quote is missing: the text ' // cursor%excerpt() // &
                           ' is not closed on its line')
      call skip_broken_line(cursor)
    else if (is_separated(cursor, last + 1)) then
      item%first = cursor%at
      item%last = last
      item%is_quoted = .true.
      call cursor%move_to(last + 1)
      return
    else
      call diagnostics%add(cursor%line, group, cursor%key // 'a quote or a comma is missing: ' // &
                           shortened(cursor%text(cursor%at:last)) // ' is followed directly by ' // &
                           cursor%text(last + 1:last + 1))
      call skip_broken_line(cursor)
    end if
    is_valid = .false.
  end subroutine scan_quoted

  !> Scans a bare word.
  subroutine scan_bare(cursor, group, diagnostics, item, is_valid)
    type(cursor_t), intent(inout) :: cursor
    integer, intent(in) :: group   !! index of the group, for the diagnostics
    type(diagnostics_t), intent(inout) :: diagnostics
    type(item_t), intent(inout) :: item
    logical, intent(inout) :: is_valid   !! becomes false if the word cannot be read
    integer :: last

    last = cursor%value_end()
    item%first = cursor%at
    item%last = last
    item%is_null = last < cursor%at
    call cursor%move_to(last + 1)
    if (is_separated(cursor, cursor%at)) return

    if (cursor%next() == '=') then
      call diagnostics%add(cursor%line, group, cursor%key // "'=' without a key before it: " // cursor%excerpt())
      call cursor%move_to(cursor%at + 1)
    else
      call diagnostics%add(cursor%line, group, cursor%key // 'there is a quote inside ' // &
                           shortened(cursor%text(item%first:last + 1)) // '; a text begins and ends with a quote')
      call skip_broken_line(cursor)
    end if
    is_valid = .false.
  end subroutine scan_bare

  !> Whether a value may end before a position.
  pure logical function is_separated(cursor, position)
    type(cursor_t), intent(in) :: cursor
    integer, intent(in) :: position

    is_separated = position > len(cursor%text)
    if (.not. is_separated) is_separated = scan(cursor%text(position:position), separators) == 1
  end function is_separated

  !> Skips the rest of a line whose quotes do not match, up to a slash at its end, which still ends the group.
  subroutine skip_broken_line(cursor)
    type(cursor_t), intent(inout) :: cursor
    character(len=:), allocatable :: rest
    integer :: slash

    rest = cursor%text(cursor%at:cursor%line_end() - 1)
    slash = index(rest, '/', back=.true.)
    if (slash > 0) then
      if (index(adjustl(rest(slash + 1:)) // '!', '!') == 1 .or. len_trim(rest(slash + 1:)) == 0) then
        call cursor%move_to(cursor%at + slash - 1)
        return
      end if
    end if
    call cursor%move_to(cursor%line_end())
  end subroutine skip_broken_line

  !> `(first)` or `(first:last:stride)` with any part of a section left out.
  subroutine read_subscript(text, assignment)
    character(len=*), intent(in) :: text   !! the subscript without its parentheses
    type(assignment_t), intent(inout) :: assignment   !! `is_malformed` if the text is neither
    character(len=:), allocatable :: rest
    integer :: bounds(3), colon, part, status
    logical :: is_valid

    assignment%is_whole = .false.
    bounds = [1, 0, 1]
    is_valid = len_trim(text) > 0
    rest = text
    do part = 1, 3
      colon = index(rest // ':', ':')
      if (len_trim(rest(:colon - 1)) /= 0) then
        call read_integer(trim(adjustl(rest(:colon - 1))), bounds(part), status)
        is_valid = is_valid .and. status == literal_ok .and. bounds(part) >= 1 .and. bounds(part) <= longest_list
      end if
      if (colon > len(rest)) exit
      rest = rest(colon + 1:)
    end do
    if (part == 1) bounds(2) = bounds(1)

    assignment%first = bounds(1)
    assignment%last = bounds(2)
    assignment%stride = bounds(3)
    assignment%is_malformed = part > 3 .or. .not. is_valid .or. (bounds(2) > 0 .and. bounds(2) < bounds(1))
  end subroutine read_subscript

end module nocdyn_namelist_values
