!> Formulas of rules: numbers, symbols, + - * / ^, parentheses, min, max, sqrt, abs, and if(a < b, then, else).
!>
!> A formula is read once into operations of a stack machine. Only the chosen part of an `if` is computed, so that the other one
!> may be undefined there.
module nocdyn_rule_expressions
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_ok, read_real
  use nocdyn_text, only: quoted, to_text
  implicit none (type, external)
  private

  public :: parse_expression

  integer, parameter, public :: name_length = 24   !! of a symbol, at most

  enum, bind(c)
    enumerator :: push_number, push_symbol, add, subtract, multiply, divide, raise_to, negate, square_root, magnitude, &
      least, greatest, is_less, is_at_most, is_more, is_at_least, go_on_at, go_on_unless
  end enum
  character(len=*), parameter :: functions(*) = [character(len=4) :: 'sqrt', 'abs', 'min', 'max', 'if']
  character(len=*), parameter :: comparisons(*) = [character(len=2) :: '<=', '>=', '<', '>']
  integer, parameter :: operation_of(*) = [is_at_most, is_at_least, is_less, is_more]
  integer, parameter :: longest = 1000       ! formula [characters], which bounds how deep its parts are nested
  integer, parameter :: largest_power = 64   ! that is computed by products

  type, public :: formula_t
    integer, allocatable, private :: codes(:)
    real(wp), allocatable, private :: operands(:)   ! the number, the symbol, or the operation to go on at
  contains
    procedure :: is_given, uses, evaluate
  end type formula_t

  !> A formula while it is read.
  type :: reader_t
    character(len=:), allocatable :: text
    integer :: next = 1   ! character
    character(len=name_length), allocatable :: names(:)
    character(len=:), allocatable :: problem   ! '': none so far
    type(formula_t) :: result
  end type reader_t

contains

  !> Whether there is a formula.
  pure logical function is_given(self)
    class(formula_t), intent(in) :: self

    is_given = allocated(self%codes)
  end function is_given

  !> Whether a symbol is in the formula.
  pure logical function uses(self, symbol)
    class(formula_t), intent(in) :: self
    integer, intent(in) :: symbol

    uses = .false.
    if (self%is_given()) uses = any(self%codes == push_symbol .and. nint(self%operands) == symbol)
  end function uses

  !> Reads a formula.
  subroutine parse_expression(text, names, expression, problem)
    character(len=*), intent(in) :: text
    character(len=*), intent(in) :: names(:)   !! of the symbols that it may use; ''; one that it may not
    type(formula_t), intent(out) :: expression
    character(len=:), allocatable, intent(out) :: problem   !! '', or what is wrong, and what is allowed
    type(reader_t) :: reader

    reader%text = trim(text)
    reader%names = names
    reader%problem = ''
    if (len(reader%text) > longest) reader%problem = 'the formula is too long; allowed: ' // to_text(longest) // ' characters'
    allocate (reader%result%codes(0), reader%result%operands(0))
    if (reader%problem == '') call read_sum(reader)
    if (reader%problem == '') then
      if (following(reader) /= '') call fail(reader, 'an operator')
    end if
    problem = reader%problem
    if (problem == '') expression = reader%result
  end subroutine parse_expression

  recursive subroutine read_sum(reader)
    type(reader_t), intent(inout) :: reader
    character(len=1) :: sign

    call read_product(reader)
    do while (reader%problem == '')
      sign = following(reader)
      if (sign /= '+' .and. sign /= '-') exit
      reader%next = reader%next + 1
      call read_product(reader)
      call emit(reader, merge(int(add), int(subtract), sign == '+'))
    end do
  end subroutine read_sum

  recursive subroutine read_product(reader)
    type(reader_t), intent(inout) :: reader
    character(len=1) :: sign

    call read_signed(reader)
    do while (reader%problem == '')
      sign = following(reader)
      if (sign /= '*' .and. sign /= '/') exit
      reader%next = reader%next + 1
      call read_signed(reader)
      call emit(reader, merge(int(multiply), int(divide), sign == '*'))
    end do
  end subroutine read_product

  !> A power with its signs: -x^2 is -(x^2), and 2^-x^y is 2^(-(x^y)).
  recursive subroutine read_signed(reader)
    type(reader_t), intent(inout) :: reader

    if (reader%problem /= '') return
    select case (following(reader))
    case ('+')
      reader%next = reader%next + 1
      call read_signed(reader)
    case ('-')
      reader%next = reader%next + 1
      call read_signed(reader)
      call emit(reader, int(negate))
    case default
      call read_operand(reader)
      if (reader%problem /= '') return
      if (following(reader) /= '^') return
      reader%next = reader%next + 1
      call read_signed(reader)
      call emit(reader, int(raise_to))
    end select
  end subroutine read_signed

  !> A number, a symbol, a function or a part in parentheses.
  recursive subroutine read_operand(reader)
    type(reader_t), intent(inout) :: reader
    character(len=1) :: first

    first = following(reader)
    if (is_digit(first) .or. first == '.') then
      call read_number(reader)
    else if (is_letter(first)) then
      call read_name(reader)
    else if (first == '(') then
      reader%next = reader%next + 1
      call read_sum(reader)
      call expect(reader, ')')
    else
      call fail(reader, 'a number, a symbol, a function or (')
    end if
  end subroutine read_operand

  subroutine read_number(reader)
    type(reader_t), intent(inout) :: reader
    integer :: last, status
    real(wp) :: number

    last = verify(reader%text(reader%next:) // ' ', '0123456789.') + reader%next - 2
    associate (text => reader%text // '   ')
      if (scan(text(last + 1:last + 1), 'eE') == 1) then
        if (scan(text(last + 2:last + 2), '+-') == 1 .and. is_digit(text(last + 3:last + 3))) then
          last = verify(text(last + 3:), '0123456789') + last + 1
        else if (is_digit(text(last + 2:last + 2))) then
          last = verify(text(last + 2:), '0123456789') + last
        end if
      end if
    end associate
    call read_real(reader%text(reader%next:last), number, status)
    if (status /= literal_ok) then
      call fail(reader, 'a number')
      return
    end if
    reader%next = last + 1
    call emit(reader, int(push_number), number)
  end subroutine read_number

  recursive subroutine read_name(reader)
    type(reader_t), intent(inout) :: reader
    character(len=:), allocatable :: name
    integer :: i, last

    last = reader%next
    do while (last < len(reader%text))
      if (.not. (is_letter(reader%text(last + 1:last + 1)) .or. is_digit(reader%text(last + 1:last + 1)))) exit
      last = last + 1
    end do
    name = reader%text(reader%next:last)
    do i = 1, size(reader%names)
      if (reader%names(i) /= name) cycle
      reader%next = last + 1
      call emit(reader, int(push_symbol), real(i, wp))
      return
    end do
    do i = 1, size(functions)
      if (functions(i) /= name) cycle
      reader%next = last + 1
      call read_function(reader, name)
      return
    end do
    reader%problem = 'there is no symbol ' // quoted(name) // ' here; allowed: ' // list_of(reader%names) // list_of(functions)
    reader%problem = reader%problem(:len(reader%problem) - 2)
  end subroutine read_name

  !> The arguments of a function.
  recursive subroutine read_function(reader, name)
    type(reader_t), intent(inout) :: reader
    character(len=*), intent(in) :: name

    call expect(reader, '(')
    if (name == 'if') then
      call read_choice(reader)
    else
      call read_sum(reader)
    end if
    if (name == 'sqrt') call emit(reader, int(square_root))
    if (name == 'abs') call emit(reader, int(magnitude))
    if (name == 'min' .or. name == 'max') then
      call expect(reader, ',')
      do while (reader%problem == '')
        call read_sum(reader)
        call emit(reader, merge(int(least), int(greatest), name == 'min'))
        if (reader%problem /= '') exit
        if (following(reader) /= ',') exit
        reader%next = reader%next + 1
      end do
    end if
    call expect(reader, ')')
  end subroutine read_function

  !> "a < b, then, else"
  recursive subroutine read_choice(reader)
    type(reader_t), intent(inout) :: reader
    character(len=1) :: first
    integer :: i, leap, otherwise

    call read_sum(reader)
    if (reader%problem /= '') return
    first = following(reader)
    do i = 1, size(comparisons)
      if (first == '') cycle
      if (index(reader%text(reader%next:), trim(comparisons(i))) == 1) exit
    end do
    if (i > size(comparisons)) then
      call fail(reader, 'a comparison <, <=, > or >=')
      return
    end if
    reader%next = reader%next + len_trim(comparisons(i))
    call read_sum(reader)
    call emit(reader, operation_of(i))
    call expect(reader, ',')
    call emit(reader, int(go_on_unless))
    otherwise = size(reader%result%codes)
    call read_sum(reader)
    call expect(reader, ',')
    call emit(reader, int(go_on_at))
    leap = size(reader%result%codes)
    if (reader%problem /= '') return
    reader%result%operands(otherwise) = leap + 1
    call read_sum(reader)
    reader%result%operands(leap) = size(reader%result%codes) + 1
  end subroutine read_choice

  !> Goes on to the next character that is not blank; '' at the end.
  character(len=1) function following(reader)
    type(reader_t), intent(inout) :: reader

    following = ''
    do while (reader%next <= len(reader%text))
      following = reader%text(reader%next:reader%next)
      if (following /= '') return
      reader%next = reader%next + 1
    end do
  end function following

  subroutine expect(reader, character)
    type(reader_t), intent(inout) :: reader
    character(len=1), intent(in) :: character

    if (reader%problem /= '') return
    if (following(reader) /= character) then
      call fail(reader, character)
    else
      reader%next = reader%next + 1
    end if
  end subroutine expect

  subroutine fail(reader, expected)
    type(reader_t), intent(inout) :: reader
    character(len=*), intent(in) :: expected

    if (reader%problem /= '') return
    if (following(reader) == '') then
      reader%problem = 'the formula ends too early; required: ' // expected
    else
      reader%problem = 'the formula has ' // quoted(trim(adjustl(reader%text(reader%next:)))) // '; required there: ' // expected
    end if
  end subroutine fail

  !> Adds an operation.
  subroutine emit(reader, code, operand)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: code
    real(wp), intent(in), optional :: operand
    real(wp) :: one

    if (reader%problem /= '') return
    one = 0.0_wp
    if (present(operand)) one = operand
    reader%result%codes = [reader%result%codes, code]
    reader%result%operands = [reader%result%operands, one]
  end subroutine emit

  !> Computes the formula.
  pure subroutine evaluate(self, values, value, is_defined)
    class(formula_t), intent(in) :: self
    real(wp), intent(in) :: values(:)          !! of the symbols
    real(wp), intent(out) :: value             !! 0 if it is not defined
    logical, intent(out) :: is_defined         !! not for a division by 0, nor for roots and powers that are not real
    real(wp) :: stack(size(self%codes) + 1)
    integer :: i, top

    is_defined = .true.
    stack = 0.0_wp
    top = 0
    i = 1
    do while (i <= size(self%codes) .and. is_defined)
      select case (self%codes(i))
      case (push_number)
        top = top + 1
        stack(top) = self%operands(i)
      case (push_symbol)
        top = top + 1
        stack(top) = values(nint(self%operands(i)))
      case (go_on_at)
        i = nint(self%operands(i))
        cycle
      case (go_on_unless)
        top = top - 1
        if (.not. stack(top + 1) > 0) then
          i = nint(self%operands(i))
          cycle
        end if
      case (negate, square_root, magnitude)
        call apply_to_one(self%codes(i), stack(top), is_defined)
      case default
        top = top - 1
        call apply_to_two(self%codes(i), stack(top + 1), stack(top), is_defined)
      end select
      i = i + 1
    end do
    value = 0.0_wp
    if (is_defined) value = stack(1)
  end subroutine evaluate

  pure subroutine apply_to_one(code, x, is_defined)
    integer, intent(in) :: code
    real(wp), intent(inout) :: x
    logical, intent(inout) :: is_defined

    select case (code)
    case (negate)
      x = -x
    case (magnitude)
      x = abs(x)
    case default   ! square_root
      is_defined = x >= 0
      if (is_defined) x = sqrt(x)
    end select
  end subroutine apply_to_one

  pure subroutine apply_to_two(code, y, x, is_defined)
    integer, intent(in) :: code
    real(wp), intent(in) :: y      !! second operand
    real(wp), intent(inout) :: x   !! first one, and the result
    logical, intent(inout) :: is_defined

    select case (code)
    case (add)
      x = x + y
    case (subtract)
      x = x - y
    case (multiply)
      x = x * y
    case (divide)
      is_defined = abs(y) > 0
      if (is_defined) x = x / y
    case (raise_to)
      call take_power(x, y, is_defined)
    case (least)
      x = min(x, y)
    case (greatest)
      x = max(x, y)
    case (is_less)
      x = merge(1.0_wp, 0.0_wp, x < y)
    case (is_at_most)
      x = merge(1.0_wp, 0.0_wp, x <= y)
    case (is_more)
      x = merge(1.0_wp, 0.0_wp, x > y)
    case default   ! is_at_least
      x = merge(1.0_wp, 0.0_wp, x >= y)
    end select
  end subroutine apply_to_two

  pure subroutine take_power(x, exponent, is_defined)
    real(wp), intent(inout) :: x
    real(wp), intent(in) :: exponent
    logical, intent(inout) :: is_defined
    logical :: is_whole

    is_whole = abs(exponent) <= largest_power
    if (is_whole) is_whole = .not. abs(exponent - nint(exponent)) > 0
    is_defined = x > 0 .or. (is_whole .and. (abs(x) > 0 .or. exponent >= 0)) .or. (x >= 0 .and. exponent >= 0)
    if (.not. is_defined) return
    if (is_whole) then
      x = x**nint(exponent)
    else
      x = x**exponent
    end if
  end subroutine take_power

  !> "a, b, " without empty names.
  pure function list_of(names) result(list)
    character(len=*), intent(in) :: names(:)
    character(len=:), allocatable :: list
    integer :: i

    list = ''
    do i = 1, size(names)
      if (names(i) /= '') list = list // trim(names(i)) // ', '
    end do
  end function list_of

  pure logical function is_digit(character)
    character(len=1), intent(in) :: character

    is_digit = character >= '0' .and. character <= '9'
  end function is_digit

  pure logical function is_letter(character)
    character(len=1), intent(in) :: character

    is_letter = (character >= 'a' .and. character <= 'z') .or. (character >= 'A' .and. character <= 'Z') .or. character == '_'
  end function is_letter

end module nocdyn_rule_expressions
