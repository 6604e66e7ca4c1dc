!> Numbers and logical values from their Fortran notation. Every text is checked digit by digit before the run-time library reads
!> it, so that malformed numbers are refused, and overflow without a floating-point exception.
module nocdyn_literals
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_size_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: lower_case
  implicit none (type, external)
  private

  public :: read_real, read_integer, read_logical, number_problem, digits_end

  integer, parameter, public :: literal_ok = 0, literal_malformed = 1, literal_not_finite = 2, literal_too_large = 3

  character(len=*), parameter :: digits = '0123456789'
  !> Digits and decimal exponent of the largest double: 1.7976931348623157e308. Longer texts that begin with these digits
  !> and round down to it are refused too.
  character(len=*), parameter :: largest_digits = '17976931348623157'
  integer, parameter :: largest_exponent = 308
  integer, parameter :: exponent_limit = 99999999   !! larger exponents are cut to it

  interface
    !> Reads a plain decimal number as a whole, by std::from_chars (number_text.cpp); returns 0 for any other text.
    integer(c_int) function number_of(text, length, value) bind(c, name='nocdyn_number_of')
      import :: c_char, c_double, c_int, c_size_t
      character(kind=c_char), intent(in) :: text(*)
      integer(c_size_t), value, intent(in) :: length
      real(c_double), intent(inout) :: value
    end function number_of
  end interface

contains

  !> Reads a number in decimal notation, with an optional exponent after e, d or q.
  subroutine read_real(text, value, status)
    character(len=*), intent(in) :: text
    real(wp), intent(out) :: value   !! 0 if the text is not a number
    integer, intent(out) :: status   !! `literal_ok` ... `literal_too_large`
    character(len=:), allocatable :: word
    logical :: is_not_finite

    value = 0.0_wp
    status = literal_ok
    if (number_of(text, len(text, c_size_t), value) /= 0) return
    value = 0.0_wp
    status = literal_malformed
    word = lower_case(text(sign_end(text) + 1:))
    is_not_finite = word == 'nan' .or. word == 'inf' .or. word == 'infinity'
    if (len(word) > 4) is_not_finite = is_not_finite .or. word(1:4) == 'nan('
    if (is_not_finite) then
      status = literal_not_finite
    else if (is_decimal(text)) then
      status = merge(literal_too_large, literal_ok, overflows(text))
      if (status == literal_ok) read (text, *) value
    end if
  end subroutine read_real

  !> What is wrong with the text of a number: " is not a number"; '' if nothing is.
  pure function number_problem(status) result(text)
    integer, intent(in) :: status   !! of `read_real`
    character(len=:), allocatable :: text

    select case (status)
    case (literal_ok)
      text = ''
    case (literal_not_finite)
      text = ' is not a finite number'
    case (literal_too_large)
      text = ' is too large for a number'
    case default
      text = ' is not a number'
    end select
  end function number_problem

  !> Reads an optional sign and digits.
  subroutine read_integer(text, value, status)
    character(len=*), intent(in) :: text
    integer, intent(out) :: value
    integer, intent(out) :: status   !! `literal_ok`, `literal_malformed` or `literal_too_large`
    integer :: i, digit, sign_length

    value = 0
    status = literal_malformed
    sign_length = sign_end(text)
    if (sign_length == len(text) .or. digits_end(text, sign_length) < len(text)) return

    status = literal_too_large
    do i = sign_length + 1, len(text)
      digit = index(digits, text(i:i)) - 1
      if (value > (huge(value) - digit) / 10) return
      value = 10 * value + digit
    end do
    if (text(1:1) == '-') value = -value
    status = literal_ok
  end subroutine read_integer

  !> Reads .true. or .false., or one of the short forms true, false, .t., .f., t, f.
  pure subroutine read_logical(text, value, status)
    character(len=*), intent(in) :: text
    logical, intent(out) :: value
    integer, intent(out) :: status   !! `literal_ok`, `literal_malformed` or `literal_too_large`

    select case (lower_case(text))
    case ('.true.', '.true', 'true', '.t.', '.t', 't')
      value = .true.
      status = literal_ok
    case ('.false.', '.false', 'false', '.f.', '.f', 'f')
      value = .false.
      status = literal_ok
    case default
      value = .false.
      status = literal_malformed
    end select
  end subroutine read_logical

  !> Last position of the digits that follow position `start`; `start` if there are none.
  pure integer function digits_end(text, start)
    character(len=*), intent(in) :: text
    integer, intent(in) :: start   !! position before the digits
    integer :: length

    length = verify(text(start + 1:), digits) - 1
    if (length < 0) length = len(text) - start
    digits_end = start + length
  end function digits_end

  !> 1 if the text begins with a sign, else 0.
  pure integer function sign_end(text)
    character(len=*), intent(in) :: text

    sign_end = 0
    if (len(text) > 0) sign_end = merge(1, 0, scan(text(1:1), '+-') == 1)
  end function sign_end

  pure logical function is_decimal(text)
    character(len=*), intent(in) :: text
    integer :: start, whole, last

    start = sign_end(text)
    whole = digits_end(text, start)
    last = mantissa_end(text)
    is_decimal = whole > start .or. last > whole + 1
    if (last == len(text) .or. .not. is_decimal) return

    is_decimal = scan(text(last + 1:last + 1), 'eEdDqQ') == 1
    last = last + 1
    last = last + sign_end(text(last + 1:))
    is_decimal = is_decimal .and. last < len(text) .and. digits_end(text, last) == len(text)
  end function is_decimal

  !> Last position of sign, digits, point and digits.
  pure integer function mantissa_end(text) result(last)
    character(len=*), intent(in) :: text

    last = digits_end(text, sign_end(text))
    if (last == len(text)) return
    if (text(last + 1:last + 1) == '.') last = digits_end(text, last + 1)
  end function mantissa_end

  !> Whether a decimal text is beyond the largest double.
  pure logical function overflows(text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: mantissa
    integer :: point, leading, exponent

    mantissa = text(sign_end(text) + 1:mantissa_end(text))
    point = index(mantissa // '.', '.')
    leading = scan(mantissa, '123456789')
    overflows = .false.
    if (leading == 0) return

    exponent = exponent_of(text(mantissa_end(text) + 1:)) + point - leading - merge(1, 0, leading < point)
    if (exponent == largest_exponent) then
      if (point <= len(mantissa)) mantissa = mantissa(:point - 1) // mantissa(point + 1:)
      if (leading > point) leading = leading - 1
      overflows = mantissa(leading:verify(mantissa, '0', back=.true.)) > largest_digits   ! without zeros at the end
    else
      overflows = exponent > largest_exponent
    end if
  end function overflows

  !> The number after the exponent letter, limited to +-`exponent_limit`; 0 without an exponent.
  pure integer function exponent_of(text)
    character(len=*), intent(in) :: text   !! '' or letter, optional sign, digits
    integer :: i

    exponent_of = 0
    do i = 2 + sign_end(text(min(2, len(text) + 1):)), len(text)
      exponent_of = min(exponent_limit, 10 * exponent_of + index(digits, text(i:i)) - 1)
    end do
    if (len(text) > 1) exponent_of = merge(-exponent_of, exponent_of, text(2:2) == '-')
  end function exponent_of

end module nocdyn_literals
