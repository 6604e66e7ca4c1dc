!> What may be printed: every text that leaves the program for a terminal or a log passes `printable`.
module nocdyn_printable
  implicit none (type, external)
  private

  public :: printable, as_utf_8, in_quotes, utf_8_length

contains

  !> The text without anything that acts on a terminal or misleads a reader: control characters but line feeds, bytes that are not
  !> UTF-8, characters that turn the direction of writing and separators of lines become \xNN for each byte, tabs become blanks.
  pure function printable(text) result(clean)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: clean
    integer :: escapes, i, last, length

    escapes = 0
    i = 1
    do while (i <= len(text))
      length = max(1, utf_8_length(text, i))
      if (acts(text, i)) escapes = escapes + length
      i = i + length
    end do
    allocate (character(len=len(text) + 3 * escapes) :: clean)
    last = 0
    i = 1
    do while (i <= len(text))
      length = max(1, utf_8_length(text, i))
      if (acts(text, i)) then
        clean(last + 1:last + 4 * length) = escaped(text(i:i + length - 1))
        last = last + 4 * length
      else
        clean(last + 1:last + length) = text(i:i + length - 1)
        if (text(i:i) == achar(9)) clean(last + 1:last + 1) = ' '
        last = last + length
      end if
      i = i + length
    end do
  end function printable

  !> Whether the character at position `i`, or the byte there that begins none, is not to be printed.
  pure logical function acts(text, i)
    character(len=*), intent(in) :: text
    integer, intent(in) :: i
    integer :: code

    code = iachar(text(i:i))
    select case (utf_8_length(text, i))
    case (0)
      acts = .true.
    case (1)
      acts = (code < 32 .and. code /= 9 .and. code /= 10) .or. code == 127
    case (2)   ! C1 control characters, U+061C
      code = 64 * iand(code, 31) + iand(iachar(text(i + 1:i + 1)), 63)
      acts = code < 160 .or. code == int(z'061C')
    case (3)   ! marks, embeddings, overrides and isolates of direction, line and paragraph separators, byte-order mark
      code = 4096 * iand(code, 15) + 64 * iand(iachar(text(i + 1:i + 1)), 63) + iand(iachar(text(i + 2:i + 2)), 63)
      acts = (code >= int(z'200E') .and. code <= int(z'200F')) .or. (code >= int(z'2028') .and. code <= int(z'202E')) .or. &
             (code >= int(z'2066') .and. code <= int(z'2069')) .or. code == int(z'FEFF')
    case default
      acts = .false.
    end select
  end function acts

  !> \xNN for each byte.
  pure function escaped(bytes) result(text)
    character(len=*), intent(in) :: bytes
    character(len=4 * len(bytes)) :: text
    character(len=*), parameter :: digits = '0123456789ABCDEF'
    integer :: code, i

    do i = 1, len(bytes)
      code = iachar(bytes(i:i))
      text(4 * i - 3:4 * i) = '\x' // digits(code / 16 + 1:code / 16 + 1) // digits(mod(code, 16) + 1:mod(code, 16) + 1)
    end do
  end function escaped

  !> The text in UTF-8: bytes that are none of it are read as Latin-1.
  pure function as_utf_8(text) result(utf_8)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: utf_8, wide
    integer :: code, i, last, length

    allocate (character(len=2 * len(text)) :: wide)
    last = 0
    i = 1
    do while (i <= len(text))
      length = utf_8_length(text, i)
      code = iachar(text(i:i))
      wide(last + 1:last + max(2, length)) = char(192 + code / 64) // char(128 + mod(code, 64))
      if (length > 0) wide(last + 1:last + length) = text(i:i + length - 1)
      last = last + merge(length, 2, length > 0)
      i = i + max(1, length)
    end do
    utf_8 = wide(:last)
  end function as_utf_8

  !> Number of bytes of the UTF-8 character at position `first`, 0 if there is none.
  pure integer function utf_8_length(text, first) result(length)
    character(len=*), intent(in) :: text
    integer, intent(in) :: first
    integer :: head, i, second

    head = iachar(text(first:first))
    length = 1
    if (head < 128) return
    length = count(head >= [194, 194, 224, 240])
    if (head > 244 .or. first + max(2, length) - 1 > len(text)) length = 0
    do i = first + 1, first + length - 1
      if (iachar(text(i:i)) < 128 .or. iachar(text(i:i)) > 191) length = 0
    end do
    if (length < 3) return
    second = iachar(text(first + 1:first + 1))   ! overlong forms, surrogates, beyond the last character
    if ((head == 224 .and. second < 160) .or. (head == 237 .and. second > 159) .or. (head == 240 .and. second < 144) &
        .or. (head == 244 .and. second > 143)) length = 0
  end function utf_8_length

  !> The text between quotes, of which those inside it are doubled.
  pure function in_quotes(text, quote)
    character(len=*), intent(in) :: text
    character(len=1), intent(in) :: quote
    character(len=:), allocatable :: in_quotes
    integer :: i, last

    last = 2
    do i = 1, len(text)
      last = last + merge(2, 1, text(i:i) == quote)
    end do
    allocate (character(len=last) :: in_quotes)
    in_quotes(1:1) = quote
    last = 1
    do i = 1, len(text)
      last = last + 1
      in_quotes(last:last) = text(i:i)
      if (text(i:i) /= quote) cycle
      last = last + 1
      in_quotes(last:last) = quote
    end do
    in_quotes(last + 1:) = quote
  end function in_quotes

end module nocdyn_printable
