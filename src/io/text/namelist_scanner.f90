!> Scanner for namelist files: the syntax of namelist input, without the meaning of groups and keys.
!>
!> Two forms that Fortran accepts are errors here, because they hide typing errors: a text in quotes that continues on the next
!> line, and text after the end of a group.
module nocdyn_namelist_scanner
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_namelist, only: assignment_t, namelist_t
  use nocdyn_namelist_cursor, only: cursor_t
  use nocdyn_namelist_values, only: longest_list, read_subscript, scan_items
  use nocdyn_text, only: lower_case, shortened, to_text
  use nocdyn_text_file, only: first_position
  implicit none (type, external)
  private

  public :: blank_control_characters, scan_namelist, scan_value

contains

  !> Scans the text of a file.
  subroutine scan_namelist(text, namelist, diagnostics)
    character(len=*), intent(in) :: text
    type(namelist_t), intent(out) :: namelist
    type(diagnostics_t), intent(inout) :: diagnostics   !! errors are added
    type(cursor_t) :: cursor

    call begin(text, namelist, cursor, diagnostics)
    call cursor%skip_blanks()
    do while (.not. cursor%at_end())
      if (cursor%group_begins()) then
        call scan_group(cursor, namelist, diagnostics)
      else
        ! adds one error for all text between two groups, and skips it
        if (cursor%is_first_of_line() .or. namelist%group_count == 0) then
          call diagnostics%add(cursor%line, 0, 'text outside groups: ' // cursor%excerpt() // '; a group is written &NAME ... /')
        else
          call diagnostics%add(cursor%line, namelist%group_count, &
            'text after the end of the group: ' // cursor%excerpt() // "; a value that holds '/' needs quotes")
        end if

        do while (.not. (cursor%at_end() .or. cursor%group_begins()))
          call cursor%move_to(cursor%token_end('!') + 1)
          call cursor%skip_blanks()
        end do
      end if
      call cursor%skip_blanks()
    end do
  end subroutine scan_namelist

  !> Scans the VALUE of an override into the items of `namelist`. Bare words may hold characters that end a group in a file.
  subroutine scan_value(text, namelist, diagnostics)
    character(len=*), intent(in) :: text
    type(namelist_t), intent(out) :: namelist
    type(diagnostics_t), intent(inout) :: diagnostics
    type(cursor_t) :: cursor
    logical :: is_malformed

    call begin(text, namelist, cursor, diagnostics)
    cursor%is_override = .true.
    call scan_items(cursor, namelist, diagnostics, is_malformed)
  end subroutine scan_value

  !> Starts at the beginning of a text, without its byte-order mark, with a final line end and with control characters refused.
  subroutine begin(text, namelist, cursor, diagnostics)
    character(len=*), intent(in) :: text
    type(namelist_t), intent(inout) :: namelist
    type(cursor_t), intent(out) :: cursor
    type(diagnostics_t), intent(inout) :: diagnostics

    cursor%text = text(first_position(text):) // new_line('a')
    cursor%key = ''
    call blank_control_characters(cursor%text, diagnostics)
    call cursor%begin()
    namelist%source = cursor%text
  end subroutine begin

  !> Replaces control characters by blanks; the first on each line is an error.
  subroutine blank_control_characters(text, diagnostics)
    character(len=:), allocatable, intent(inout) :: text
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: code, i, line, refused_line

    line = 1
    refused_line = 0
    do i = 1, len(text)
      code = iachar(text(i:i))
      if (code == 10) line = line + 1
      if ((code >= 32 .and. code /= 127) .or. code == 9 .or. code == 10) cycle
      text(i:i) = ' '
      if (line == refused_line .or. (code == 13 .and. text(i + 1:i + 1) == new_line('a'))) cycle
      refused_line = line
      call diagnostics%add(line, 0, 'a control character (code ' // to_text(code) // ') does not belong in an input file')
    end do
  end subroutine blank_control_characters

  !> Scans a group from & or $ to its end mark, or to where the end mark is missing.
  subroutine scan_group(cursor, namelist, diagnostics)
    type(cursor_t), intent(inout) :: cursor
    type(namelist_t), intent(inout) :: namelist
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: place
    integer :: last

    call cursor%move_to(cursor%at + 1)
    last = cursor%value_end()
    call namelist%append_group(cursor%text(cursor%at:last), cursor%line)
    call cursor%move_to(last + 1)

    do
      call cursor%skip_blanks()
      if (cursor%group_ends() > 0 .or. cursor%group_begins() .or. cursor%at_end()) exit
      if (cursor%key_follows()) then
        call scan_assignment(cursor, namelist, diagnostics)
      else
        call refuse_text_without_key(cursor, namelist, diagnostics)
      end if
    end do

    if (cursor%group_ends() > 0) then
      call cursor%move_to(cursor%at + cursor%group_ends())
    else
      associate (group => namelist%groups(namelist%group_count))
        if (group%is_malformed) return   ! the end mark may be in the part that cannot be read
        place = 'the end of the file'
        if (.not. cursor%at_end()) place = 'the next group on line ' // to_text(cursor%line)
        call diagnostics%add(group%line, namelist%group_count, "not closed: '/' is missing before " // place)
      end associate
    end if
  end subroutine scan_group

  !> Adds an error for values without a key, and skips them.
  subroutine refuse_text_without_key(cursor, namelist, diagnostics)
    type(cursor_t), intent(inout) :: cursor
    type(namelist_t), intent(inout) :: namelist
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: item_count, line, diagnostic_count
    character(len=:), allocatable :: found
    logical :: is_malformed

    line = cursor%line
    found = cursor%excerpt()
    item_count = namelist%item_count
    diagnostic_count = diagnostics%count
    if (cursor%next() == '=') call cursor%move_to(cursor%at + 1)
    call scan_items(cursor, namelist, diagnostics, is_malformed)
    namelist%item_count = item_count
    namelist%groups(namelist%group_count)%is_malformed = .true.
    if (diagnostics%count > diagnostic_count) return
    call diagnostics%add(line, namelist%group_count, 'KEY = VALUE was expected, but found is ' // found)
  end subroutine refuse_text_without_key

  !> Scans `KEY = VALUES`.
  subroutine scan_assignment(cursor, namelist, diagnostics)
    type(cursor_t), intent(inout) :: cursor
    type(namelist_t), intent(inout) :: namelist
    type(diagnostics_t), intent(inout) :: diagnostics
    type(assignment_t) :: assignment
    character(len=:), allocatable :: subscript
    logical :: is_malformed
    integer :: after, last

    last = cursor%key_end()
    after = cursor%subscript_end(last + 1)
    assignment%key = lower_case(cursor%text(cursor%at:last))
    assignment%line = cursor%line
    if (after > last + 1) then
      subscript = trim(adjustl(cursor%text(last + 1:after - 1)))
      call read_subscript(subscript(2:len(subscript) - 1), assignment)
      if (assignment%is_malformed) call diagnostics%add(cursor%line, namelist%group_count, shortened(assignment%key) // &
        shortened(subscript) // ': the subscript is neither an index such as (3) nor a section such as (1:3), from 1 to ' // &
        to_text(longest_list))
    end if
    call cursor%move_to(after)
    call cursor%move_to(cursor%at + index(cursor%text(cursor%at:), '='))

    assignment%first_item = namelist%item_count + 1
    cursor%key = shortened(assignment%key) // ': '
    call scan_items(cursor, namelist, diagnostics, is_malformed)
    cursor%key = ''
    assignment%last_item = namelist%item_count
    if (assignment%is_malformed) namelist%groups(namelist%group_count)%is_malformed = .true.
    assignment%is_malformed = assignment%is_malformed .or. is_malformed
    call namelist%append_assignment(assignment)
  end subroutine scan_assignment

end module nocdyn_namelist_scanner
