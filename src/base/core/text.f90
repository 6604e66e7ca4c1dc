!> Numbers as texts that read back as the same value, lists of texts, phrases.
module nocdyn_text
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_size_t
  use nocdyn_kinds, only: wp
  use nocdyn_printable, only: utf_8_length
  implicit none (type, external)
  private

  public :: to_text, rounded_text, write_number, lower_case, quoted, joined, listed, counted, shortened, &
    shown_path, split_lines, strings, append, append_new, selected, is_too_long

  integer, parameter :: most_characters = 80   ! of a text in a message
  integer, parameter :: head = 30, tail = 46   ! characters of a path that is cut
  integer, parameter, public :: longest_path = 4000, longest_file_name = 255   !! bytes, as Linux allows, less names of files
  integer, parameter, public :: number_width = 32   !! no number of `write_number` is longer

  !> A text of any length, for arrays of texts. gfortran 12 never frees the texts of an array constructor with `string_t(...)`,
  !> nor of an argument with a vector subscript; `strings`, `append` and `selected` avoid both.
  !>
  !> gfortran 12 keeps the length of an allocatable text that a function returns in static memory of the caller, which all threads
  !> share. Functions that threads of a sweep call therefore return texts of lengths that other functions find before.
  type, public :: string_t
    character(len=:), allocatable :: text
  end type string_t

  !> The shortest text that reads back as the same value.
  interface to_text
    module procedure integer_to_text
    module procedure real_to_text
  end interface to_text

  !> A text for a message, cut if it is long.
  interface shortened
    module procedure shortened_text
    module procedure shortened_to
  end interface shortened

  !> A list of texts in quotes.
  interface joined
    module procedure joined_all
    module procedure joined_some
  end interface joined

  interface
    !> Writes the shortest decimal that reads back as `value`, by std::to_chars (number_text.cpp).
    pure subroutine shortest_decimal(value, buffer, capacity, length) bind(c, name='nocdyn_shortest_decimal')
      import :: c_char, c_double, c_int, c_size_t
      real(c_double), value, intent(in) :: value
      character(kind=c_char), intent(out) :: buffer(*)
      integer(c_size_t), value, intent(in) :: capacity
      integer(c_int), intent(out) :: length
    end subroutine shortest_decimal

    !> Shortest decimal without an exponent, or always with one.
    pure subroutine shortest_form(value, has_exponent, buffer, capacity, length) bind(c, name='nocdyn_shortest_form')
      import :: c_char, c_double, c_int, c_size_t
      real(c_double), value, intent(in) :: value
      integer(c_int), value, intent(in) :: has_exponent   !! 0 or 1
      character(kind=c_char), intent(out) :: buffer(*)
      integer(c_size_t), value, intent(in) :: capacity
      integer(c_int), intent(out) :: length
    end subroutine shortest_form
  end interface

contains

  !> Writes `value` to the first `length` characters of `buffer`.
  pure subroutine write_number(value, buffer, length)
    real(wp), intent(in) :: value
    character(len=*), intent(inout) :: buffer   !! at least `number_width` long
    integer, intent(out) :: length

    call shortest_decimal(value, buffer, int(len(buffer), c_size_t), length)
    if (length == 0) error stop 'nocdyn_text: the buffer of write_number is shorter than number_width'
  end subroutine write_number

  pure function real_to_text(value) result(text)
    real(wp), intent(in) :: value
    character(len=decimal_length(value)) :: text
    character(len=number_width) :: buffer
    integer :: length

    call write_number(value, buffer, length)
    text = buffer(:length)
  end function real_to_text

  pure integer function decimal_length(value) result(length)
    real(wp), intent(in) :: value
    character(len=number_width) :: buffer

    call write_number(value, buffer, length)
  end function decimal_length

  !> The value rounded to `digits` significant digits: without an exponent from 0.0001 to below 1e9, with one elsewhere.
  pure function rounded_text(value, digits) result(text)
    real(wp), intent(in) :: value
    integer, intent(in) :: digits   !! 1 to 17
    character(len=rounded_length(value, digits)) :: text
    character(len=number_width) :: buffer
    integer :: length

    call write_rounded(value, digits, buffer, length)
    text = buffer(:length)
  end function rounded_text

  pure integer function rounded_length(value, digits) result(length)
    real(wp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=number_width) :: buffer

    call write_rounded(value, digits, buffer, length)
  end function rounded_length

  !> Writes `rounded_text` to the first `length` characters of `buffer`.
  pure subroutine write_rounded(value, digits, buffer, length)
    real(wp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=number_width), intent(out) :: buffer
    integer, intent(out) :: length
    character(len=12) :: edit
    real(wp), parameter :: smallest = 1.0e-4_wp, largest = 1.0e9_wp   ! without an exponent
    real(wp) :: near
    integer :: status

    length = 1
    buffer = '0'
    if (abs(value) <= 0.0_wp) return   ! most entries of a matrix
    write (edit, '(a, i0, a)') '(es32.', digits - 1, 'e4)'
    write (buffer, edit) value
    read (buffer, *, iostat=status) near
    if (status /= 0) near = value   ! rounded up beyond the largest number
    if (abs(near) <= 0.0_wp) near = 0.0_wp   ! no "-0"
    call shortest_form(near, merge(1_c_int, 0_c_int, abs(near) > 0.0_wp .and. (abs(near) < smallest .or. &
                                                                              .not. abs(near) < largest)), &
                       buffer, int(len(buffer), c_size_t), length)
  end subroutine write_rounded

  pure function integer_to_text(value) result(text)
    integer, intent(in) :: value
    character(len=digits_of(value)) :: text

    write (text, '(i0)') value
  end function integer_to_text

  !> Its digits, and a sign if it is negative.
  pure integer function digits_of(value)
    integer, intent(in) :: value
    character(len=number_width) :: buffer

    write (buffer, '(i0)') value
    digits_of = len_trim(buffer)
  end function digits_of

  !> The text with its ASCII letters in lower case.
  elemental function lower_case(text) result(lower)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: lower
    integer :: i

    lower = text
    do i = 1, len(text)
      if (text(i:i) >= 'A' .and. text(i:i) <= 'Z') lower(i:i) = achar(iachar(text(i:i)) + 32)
    end do
  end function lower_case

  !> The text in single quotes, for messages.
  pure function quoted(text)
    character(len=*), intent(in) :: text
    character(len=len(text) + 2) :: quoted

    quoted = "'" // text // "'"
  end function quoted

  !> A text for a message, of at most 80 characters.
  pure function shortened_text(text) result(short)
    character(len=*), intent(in) :: text
    character(len=shortened_length(text, most_characters)) :: short

    short = shortened_to(text, most_characters)
  end function shortened_text

  !> A text for a message: one of more than `most` characters is cut between two of them and ends with ' ...', before its closing
  !> quote if it is in quotes. Line feeds become blanks.
  pure function shortened_to(text, most) result(short)
    character(len=*), intent(in) :: text
    integer, intent(in) :: most   !! characters; bytes that are not UTF-8 count as one each
    character(len=shortened_length(text, most)) :: short
    integer :: i, last

    call find_cut(text, most, last)
    short = text(:last)
    if (last < len(text)) short(last + 1:) = ' ...' // text(1:1)
    do i = 1, len(short)
      if (short(i:i) == new_line('a')) short(i:i) = ' '
    end do
  end function shortened_to

  pure integer function shortened_length(text, most) result(length)
    character(len=*), intent(in) :: text
    integer, intent(in) :: most

    call find_cut(text, most, length)
    if (length == len(text)) return
    length = length + len(' ...')
    if (scan(text(1:1), '''"') == 1 .and. text(len(text):) == text(1:1)) length = length + 1
  end function shortened_length

  !> The number of bytes of the first `most` characters.
  pure subroutine find_cut(text, most, last)
    character(len=*), intent(in) :: text
    integer, intent(in) :: most
    integer, intent(out) :: last
    integer :: i

    last = 0
    do i = 1, most
      if (last < len(text)) last = last + max(1, utf_8_length(text, last + 1))
    end do
  end subroutine find_cut

  !> A path for a message: one of more than 80 characters is cut in its middle. Line feeds become blanks.
  pure function shown_path(path) result(text)
    character(len=*), intent(in) :: path
    character(len=shown_length(path)) :: text
    integer :: first

    call find_tail(path, first)
    if (first == 1) then
      text = shortened(path)
    else
      text = shortened(path, head) // shortened(path(first:))
    end if
  end function shown_path

  pure integer function shown_length(path)
    character(len=*), intent(in) :: path
    integer :: first

    call find_tail(path, first)
    if (first == 1) then
      shown_length = shortened_length(path, most_characters)
    else
      shown_length = shortened_length(path, head) + shortened_length(path(first:), most_characters)
    end if
  end function shown_length

  !> The first byte of the last `tail` characters of a path that is cut, 1 if it is not cut.
  pure subroutine find_tail(path, first)
    character(len=*), intent(in) :: path
    integer, intent(out) :: first
    logical :: begins(len(path))   ! whether a byte is the first one of a character
    integer :: i

    begins = [(iachar(path(i:i)) < 128 .or. iachar(path(i:i)) > 191, i=1, len(path))]
    first = 1
    if (count(begins) <= most_characters) return
    first = len(path)
    do while (count(begins(first:)) < tail)
      first = first - 1
    end do
  end subroutine find_tail

  !> The texts in quotes, separated by `separator`.
  pure function joined_all(texts, separator) result(joined)
    type(string_t), intent(in) :: texts(:)
    character(len=*), intent(in) :: separator
    character(len=joined_length(texts, separator, size(texts))) :: joined

    joined = joined_some(texts, separator, size(texts))
  end function joined_all

  !> Of more than `most` texts the first `most` "and N more".
  pure function joined_some(texts, separator, most) result(joined)
    type(string_t), intent(in) :: texts(:)
    character(len=*), intent(in) :: separator
    integer, intent(in) :: most
    character(len=joined_length(texts, separator, most)) :: joined
    character(len=:), allocatable :: list

    call join(texts, separator, most, list)
    joined = list
  end function joined_some

  pure integer function joined_length(texts, separator, most)
    type(string_t), intent(in) :: texts(:)
    character(len=*), intent(in) :: separator
    integer, intent(in) :: most
    character(len=:), allocatable :: list

    call join(texts, separator, most, list)
    joined_length = len(list)
  end function joined_length

  pure subroutine join(texts, separator, most, list)
    type(string_t), intent(in) :: texts(:)
    character(len=*), intent(in) :: separator
    integer, intent(in) :: most
    character(len=:), allocatable, intent(out) :: list
    integer :: i

    list = ''
    do i = 1, min(most, size(texts))
      if (i > 1) list = list // separator
      list = list // quoted(texts(i)%text)
    end do
    if (most < size(texts)) list = list // ' and ' // to_text(size(texts) - most) // ' more'
  end subroutine join

  !> "1 gear", "2 gears".
  pure function counted(number, singular, plural) result(text)
    integer, intent(in) :: number
    character(len=*), intent(in) :: singular, plural
    character(len=digits_of(number) + 1 + merge(len(singular), len(plural), number == 1)) :: text

    text = to_text(number) // ' ' // plural
    if (number == 1) text = to_text(number) // ' ' // singular
  end function counted

  !> "a, b or c".
  pure function listed(texts, conjunction) result(text)
    type(string_t), intent(in) :: texts(:)        !! one at least
    character(len=*), intent(in) :: conjunction   !! ' or ', ' and '
    character(len=:), allocatable :: text
    integer :: i

    text = texts(1)%text
    do i = 2, size(texts)
      if (i < size(texts)) then
        text = text // ', ' // texts(i)%text
      else
        text = text // conjunction // texts(i)%text
      end if
    end do
  end function listed

  !> The words without their trailing blanks.
  pure function strings(words) result(list)
    character(len=*), intent(in) :: words(:)
    type(string_t), allocatable :: list(:)
    integer :: i

    allocate (list(size(words)))
    do i = 1, size(words)
      list(i)%text = trim(words(i))
    end do
  end function strings

  !> The texts with these indices, in the order of the indices.
  pure function selected(texts, indices) result(list)
    type(string_t), intent(in) :: texts(:)
    integer, intent(in) :: indices(:)
    type(string_t), allocatable :: list(:)
    integer :: i

    allocate (list(size(indices)))
    do i = 1, size(indices)
      list(i)%text = texts(indices(i))%text
    end do
  end function selected

  !> Appends a text to a list, trailing blanks included.
  pure subroutine append(list, text)
    type(string_t), allocatable, intent(inout) :: list(:)
    character(len=*), intent(in) :: text
    type(string_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(size(list) + 1))
    do i = 1, size(list)
      call move_alloc(list(i)%text, longer(i)%text)
    end do
    longer(size(longer))%text = text
    call move_alloc(longer, list)
  end subroutine append

  !> Appends a text that is not yet in a list.
  pure subroutine append_new(list, text)
    type(string_t), allocatable, intent(inout) :: list(:)
    character(len=*), intent(in) :: text
    integer :: i

    if (.not. any([(list(i)%text == text, i=1, size(list))])) call append(list, text)
  end subroutine append_new

  !> Whether the operating system has no folder with such a path.
  pure logical function is_too_long(path)
    character(len=*), intent(in) :: path
    integer :: i, length

    is_too_long = len(path) > longest_path
    length = 0
    do i = 1, len(path)
      length = merge(0, length + 1, path(i:i) == '/')
      is_too_long = is_too_long .or. length > longest_file_name
    end do
  end function is_too_long

  !> The lines of a text, without blanks at their ends. A line feed at the end of the text begins no line.
  pure subroutine split_lines(text, lines)
    character(len=*), intent(in) :: text
    type(string_t), allocatable, intent(out) :: lines(:)
    integer :: count, first, i, last

    count = 0
    do i = 1, len(text)
      if (text(i:i) == new_line('a') .or. i == len(text)) count = count + 1
    end do
    allocate (lines(count))
    first = 1
    do i = 1, count
      last = index(text(first:), new_line('a')) + first - 2
      if (last < first - 1) last = len(text)
      lines(i)%text = trim(text(first:last))
      first = last + 2
    end do
  end subroutine split_lines

end module nocdyn_text
