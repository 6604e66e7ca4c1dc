!> Numbers as texts that read back as the same value, lists of texts, phrases, near matches of names.
module nocdyn_text
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_size_t
  use nocdyn_kinds, only: wp
  use nocdyn_printable, only: utf_8_length
  implicit none (type, external)
  private

  public :: to_text, rounded_text, write_number, lower_case, quoted, in_quotes, joined, listed, counted, shortened, &
    shown_path, nearest_word, strings, append, selected, is_too_long

  integer, parameter :: longest_word = 256   ! that is compared with others
  integer, parameter, public :: longest_path = 4000, longest_file_name = 255   !! bytes, as Linux allows, less names of files
  integer, parameter, public :: number_width = 32   !! no number of `write_number` is longer

  !> A text of any length, for arrays of texts. gfortran 12 never frees the texts of an array constructor with `string_t(...)`,
  !> nor those of an argument with a vector subscript; `strings`, `append` and `selected` avoid both.
  !>
  !> gfortran 12 keeps the length of an allocatable text that a function returns in static memory of the caller, which all threads
  !> share. Threads of a sweep therefore call them in `nocdyn_serial_work` only.
  type, public :: string_t
    character(len=:), allocatable :: text
  end type string_t

  !> The shortest text that reads back as the same value.
  interface to_text
    module procedure integer_to_text
    module procedure real_to_text
  end interface to_text

  interface
    !> Writes the shortest decimal that reads back as `value`, by std::to_chars (number_text.cpp); returns its length.
    function shortest_decimal(value, buffer, capacity) result(length) bind(c, name='nocdyn_shortest_decimal')
      import :: c_char, c_double, c_int, c_size_t
      real(c_double), value, intent(in) :: value
      character(kind=c_char), intent(out) :: buffer(*)
      integer(c_size_t), value, intent(in) :: capacity
      integer(c_int) :: length
    end function shortest_decimal

    !> The same without an exponent, or always with one.
    function shortest_form(value, has_exponent, buffer, capacity) result(length) bind(c, name='nocdyn_shortest_form')
      import :: c_char, c_double, c_int, c_size_t
      real(c_double), value, intent(in) :: value
      integer(c_int), value, intent(in) :: has_exponent   !! 0 or 1
      character(kind=c_char), intent(out) :: buffer(*)
      integer(c_size_t), value, intent(in) :: capacity
      integer(c_int) :: length
    end function shortest_form
  end interface

contains

  !> Writes `value` to the first `length` characters of `buffer`.
  subroutine write_number(value, buffer, length)
    real(wp), intent(in) :: value
    character(len=*), intent(inout) :: buffer   !! at least `number_width` long
    integer, intent(out) :: length

    length = int(shortest_decimal(value, buffer, int(len(buffer), c_size_t)))
    if (length == 0) error stop 'nocdyn_text: the buffer of write_number is shorter than number_width'
  end subroutine write_number

  function real_to_text(value) result(text)
    real(wp), intent(in) :: value
    character(len=:), allocatable :: text
    character(len=number_width) :: buffer
    integer :: length

    call write_number(value, buffer, length)
    text = buffer(:length)
  end function real_to_text

  !> The value rounded to `digits` significant digits: without an exponent from 0.0001 to below 1e9, with one elsewhere.
  function rounded_text(value, digits) result(text)
    real(wp), intent(in) :: value
    integer, intent(in) :: digits   !! 1 to 17
    character(len=:), allocatable :: text
    character(len=number_width) :: buffer
    character(len=12) :: edit
    real(wp), parameter :: smallest = 1.0e-4_wp, largest = 1.0e9_wp   ! without an exponent
    real(wp) :: near
    integer :: length, status

    if (abs(value) <= 0.0_wp) then
      text = '0'   ! most entries of a matrix
      return
    end if
    write (edit, '(a, i0, a)') '(es32.', digits - 1, 'e4)'
    write (buffer, edit) value
    read (buffer, *, iostat=status) near
    if (status /= 0) near = value   ! rounded up beyond the largest number
    if (abs(near) <= 0.0_wp) near = 0.0_wp   ! no "-0"
    length = int(shortest_form(near, merge(1_c_int, 0_c_int, abs(near) > 0.0_wp .and. (abs(near) < smallest .or. &
                                                             .not. abs(near) < largest)), buffer, int(len(buffer), c_size_t)))
    text = buffer(:length)
  end function rounded_text

  pure function integer_to_text(value) result(text)
    integer, intent(in) :: value
    character(len=:), allocatable :: text
    character(len=number_width) :: buffer

    write (buffer, '(i0)') value
    text = trim(buffer)
  end function integer_to_text

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
    character(len=:), allocatable :: quoted

    quoted = "'" // text // "'"
  end function quoted

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

  !> A text for a message: one of more than `most` characters is cut between two of them and ends with ' ...', before its closing
  !> quote if it is in quotes. Line feeds become blanks.
  pure function shortened(text, most) result(short)
    character(len=*), intent(in) :: text
    integer, intent(in), optional :: most   !! characters; 80 if absent; bytes that are not UTF-8 count as one each
    character(len=:), allocatable :: short
    integer :: characters, i, last

    characters = 80
    if (present(most)) characters = most
    last = 0
    do i = 1, characters
      if (last < len(text)) last = last + max(1, utf_8_length(text, last + 1))
    end do
    short = text(:last)
    if (last < len(text)) then
      short = short // ' ...'
      if (scan(text(1:1), '''"') == 1 .and. text(len(text):) == text(1:1)) short = short // text(1:1)
    end if
    do i = 1, len(short)
      if (short(i:i) == new_line('a')) short(i:i) = ' '
    end do
  end function shortened

  !> A path for a message: one of more than 80 characters is cut in its middle. Line feeds become blanks.
  pure function shown_path(path) result(text)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: text
    integer, parameter :: most = 80, head = 30, tail = 46   ! characters
    logical :: begins(len(path))                            ! whether a byte is the first one of a character
    integer :: first, i

    begins = [(iachar(path(i:i)) < 128 .or. iachar(path(i:i)) > 191, i=1, len(path))]
    text = shortened(path)
    if (count(begins) <= most) return
    first = len(path)
    do while (count(begins(first:)) < tail)
      first = first - 1
    end do
    text = shortened(path, head) // shortened(path(first:))
  end function shown_path

  !> The texts in quotes, separated by `separator`; of more than `most`, the first `most` "and N more".
  pure function joined(texts, separator, most)
    type(string_t), intent(in) :: texts(:)
    character(len=*), intent(in) :: separator
    integer, intent(in), optional :: most   !! all are written if absent
    character(len=:), allocatable :: joined
    integer :: i, last

    last = size(texts)
    if (present(most)) last = min(most, last)
    joined = ''
    do i = 1, last
      if (i > 1) joined = joined // separator
      joined = joined // quoted(texts(i)%text)
    end do
    if (last < size(texts)) joined = joined // ' and ' // to_text(size(texts) - last) // ' more'
  end function joined

  !> "1 gear", "2 gears".
  pure function counted(number, singular, plural) result(text)
    integer, intent(in) :: number
    character(len=*), intent(in) :: singular, plural
    character(len=:), allocatable :: text

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

  !> Index of the candidate nearest to a misspelt `word`, 0 if none is near.
  pure function nearest_word(word, candidates) result(nearest)
    character(len=*), intent(in) :: word
    type(string_t), intent(in) :: candidates(:)
    integer :: nearest
    integer :: i, distance, smallest

    nearest = 0
    if (len(word) > longest_word) return
    smallest = max(1, len(word) / 3) + 1
    do i = 1, size(candidates)
      if (abs(len(word) - len(candidates(i)%text)) >= smallest) cycle
      distance = edit_distance(lower_case(word), lower_case(candidates(i)%text))
      if (distance < smallest) then
        smallest = distance
        nearest = i
      end if
    end do
  end function nearest_word

  !> Optimal string alignment distance, which counts insertions, deletions, substitutions and swaps of neighbours.
  pure function edit_distance(a, b) result(distance)
    character(len=*), intent(in) :: a, b
    integer :: distance
    integer :: d(0:len(a), 0:len(b))
    integer :: h, i, j, k

    d(:, 0) = [(i, i=0, len(a))]
    d(0, :) = [(j, j=0, len(b))]
    do j = 1, len(b)
      do i = 1, len(a)
        d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, d(i - 1, j - 1) + merge(0, 1, a(i:i) == b(j:j)))
        if (min(i, j) < 2) cycle
        h = i - 1
        k = j - 1
        if (a(i:i) == b(k:k) .and. a(h:h) == b(j:j)) d(i, j) = min(d(i, j), d(h - 1, k - 1) + 1)
      end do
    end do
    distance = d(len(a), len(b))
  end function edit_distance

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

end module nocdyn_text
