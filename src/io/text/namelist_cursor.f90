!> A position in the text of a namelist file, and tests for the elements of its syntax there.
module nocdyn_namelist_cursor
  use nocdyn_text, only: lower_case, shortened
  implicit none (type, external)
  private

  character(len=1), parameter :: tab = achar(9), line_feed = achar(10), carriage_return = achar(13)
  character(len=*), parameter :: blanks = ' ' // tab // carriage_return // line_feed
  character(len=*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'
  character(len=*), parameter :: letters_and_digits = letters // '0123456789_'
  character(len=*), parameter :: value_delimiters = ',/!=''"'
  integer, parameter :: longest_excerpt = 40      !! characters of the file in a message
  integer, parameter :: longest_subscript = 100   !! characters; what is longer is no subscript

  type, public :: cursor_t
    character(len=:), allocatable :: text   !! ends with a line feed
    integer :: at = 1                       !! position of the next character, len(text) + 1 at the end
    integer :: line = 1
    integer, private :: line_start = 1      !! position of the first character of the line
    integer, private :: line_last = 0       !! position of its line feed; each is searched once, also in a long line
    logical :: is_override = .false.        !! the text is the value of an override: '/', '!', '&' and '=' have no meaning
    character(len=:), allocatable :: key    !! whose values are read, with ': ' for messages; '': none
  contains
    procedure :: begin, next => next_character
    procedure :: move_to, skip_blanks
    procedure :: line_end, token_end, value_end, key_end, quote_end, subscript_end
    procedure :: at_end, key_follows, group_begins, group_ends, is_first_of_line
    procedure :: excerpt
  end type cursor_t

contains

  !> Starts at the beginning of `text`.
  pure subroutine begin(self)
    class(cursor_t), intent(inout) :: self

    self%line_last = index(self%text, line_feed)
  end subroutine begin

  pure logical function at_end(self)
    class(cursor_t), intent(in) :: self

    at_end = self%at > len(self%text)
  end function at_end

  !> The character at the cursor, a line feed at the end.
  pure character(len=1) function next_character(self) result(next)
    class(cursor_t), intent(in) :: self

    next = line_feed
    if (self%at <= len(self%text)) next = self%text(self%at:self%at)
  end function next_character

  !> Moves forward to a position and counts the lines.
  pure subroutine move_to(self, position)
    class(cursor_t), intent(inout) :: self
    integer, intent(in) :: position   !! at or after the cursor
    integer :: i

    do i = self%at, min(position - 1, len(self%text))
      if (self%text(i:i) /= line_feed) cycle
      self%line = self%line + 1
      self%line_start = i + 1
      self%line_last = i + index(self%text(i + 1:), line_feed)
    end do
    self%at = position
  end subroutine move_to

  !> Skips blanks, tabs, line ends and comments.
  pure subroutine skip_blanks(self)
    class(cursor_t), intent(inout) :: self

    do while (.not. self%at_end())
      if (scan(self%next(), blanks) == 1) then
        call self%move_to(self%at + 1)
      else if (self%next() == '!' .and. .not. self%is_override) then
        call self%move_to(self%line_end())
      else
        exit
      end if
    end do
  end subroutine skip_blanks

  !> Position of the line feed at the end of the line.
  pure integer function line_end(self)
    class(cursor_t), intent(in) :: self

    line_end = self%line_last
  end function line_end

  !> Last position of the bare word at the cursor; the position before the cursor if there is none.
  pure integer function token_end(self, delimiters)
    class(cursor_t), intent(in) :: self
    character(len=*), intent(in) :: delimiters   !! besides blanks

    token_end = self%at - 2 + scan(self%text(self%at:), blanks // delimiters)
    if (token_end < self%at - 1) token_end = len(self%text)
  end function token_end

  !> Last position of the bare value at the cursor.
  pure integer function value_end(self)
    class(cursor_t), intent(in) :: self

    value_end = self%token_end(value_delimiters)
    if (self%is_override) value_end = self%token_end(',')
  end function value_end

  !> Last position of the key at the cursor.
  pure integer function key_end(self)
    class(cursor_t), intent(in) :: self

    key_end = self%token_end(value_delimiters // '(')
  end function key_end

  !> Position of the quote that closes the text at the cursor, which begins with a quote; 0 if it is not closed on its line.
  pure integer function quote_end(self)
    class(cursor_t), intent(in) :: self
    character(len=1) :: quote
    integer :: last

    quote = self%next()
    last = self%line_end()
    quote_end = self%at + 1
    do while (quote_end < last)
      if (self%text(quote_end:quote_end) == quote) then
        if (self%text(quote_end + 1:quote_end + 1) /= quote) return
        quote_end = quote_end + 1
      end if
      quote_end = quote_end + 1
    end do
    quote_end = 0
  end function quote_end

  !> Whether there is a key at the cursor: a word, perhaps with a subscript, before an equals sign.
  pure logical function key_follows(self)
    class(cursor_t), intent(in) :: self
    integer :: i

    key_follows = .false.
    if (self%is_override) return
    i = self%key_end() + 1
    if (i == self%at) return
    i = self%subscript_end(i)
    if (i > 0) i = position_after_blanks(self%text, i)
    if (i > 0) key_follows = self%text(i:i) == '='
  end function key_follows

  !> Position after a subscript at `start` or after blanks there; `start` if there is no subscript, 0 if it is not closed on
  !> its line.
  pure integer function subscript_end(self, start)
    class(cursor_t), intent(in) :: self
    integer, intent(in) :: start   !! position after the key
    integer :: open, length

    subscript_end = start
    open = position_after_blanks(self%text, start)
    if (open == 0) return
    if (self%text(open:open) /= '(') return
    length = scan(self%text(open:min(open + longest_subscript, len(self%text))), ')' // line_feed)
    subscript_end = 0
    if (length > 0) subscript_end = merge(open + length, 0, self%text(open + length - 1:open + length - 1) == ')')
  end function subscript_end

  !> Position of the first character from `start` on that is not blank, 0 if there is none.
  pure integer function position_after_blanks(text, start) result(position)
    character(len=*), intent(in) :: text
    integer, intent(in) :: start

    position = verify(text(start:), blanks)
    if (position > 0) position = position + start - 1
  end function position_after_blanks

  !> Whether a group begins at the cursor: & or $ and the first letter of a name.
  pure logical function group_begins(self)
    class(cursor_t), intent(in) :: self

    group_begins = .false.
    if (self%is_override .or. self%at >= len(self%text)) return
    group_begins = scan(self%next(), '&$') == 1 .and. scan(self%text(self%at + 1:self%at + 1), letters) == 1 &
      .and. self%group_ends() == 0
  end function group_begins

  !> Length of the end mark at the cursor: 1 for a slash, 4 for &end or $end, otherwise 0.
  pure integer function group_ends(self)
    class(cursor_t), intent(in) :: self

    group_ends = 0
    if (self%is_override) return
    if (self%next() == '/') group_ends = 1
    if (self%at + 4 > len(self%text) .or. scan(self%next(), '&$') == 0) return
    if (lower_case(self%text(self%at + 1:self%at + 3)) /= 'end') return
    if (scan(self%text(self%at + 4:self%at + 4), letters_and_digits) == 0) group_ends = 4
  end function group_ends

  !> Whether there are only blanks before the cursor on its line.
  pure logical function is_first_of_line(self)
    class(cursor_t), intent(in) :: self

    is_first_of_line = verify(self%text(self%line_start:self%at - 1), blanks) == 0
  end function is_first_of_line

  !> The rest of the line between angle brackets, shortened for a message.
  pure function excerpt(self) result(text)
    class(cursor_t), intent(in) :: self
    character(len=:), allocatable :: text

    text = self%text(self%at:min(self%line_end() - 1, self%at + 4 * longest_excerpt + 4))   ! 4 bytes for a character at most
    text = text(:verify(text, blanks, back=.true.))
    text = '<' // shortened(text, longest_excerpt) // '>'
  end function excerpt

end module nocdyn_namelist_cursor
