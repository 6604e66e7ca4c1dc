!> Units as texts, 'kN m/rad', 'lbm ft2', 'lbf-ft/rad': their dimensions and factors, and the conversion of numbers.
!>
!> Factors of a product are separated by a blank, '*', '.', a middle dot or a hyphen; a quotient has one '/', and more than one
!> factor behind it stands in parentheses; powers are 'm2', 'm^2', 'm**2' or 's-1'.
module nocdyn_unit_expressions
  use nocdyn_kinds, only: wp
  use nocdyn_near_words, only: near_match
  use nocdyn_printable, only: utf_8_length
  use nocdyn_text, only: append, quoted, shortened, string_t, to_text
  use nocdyn_units, only: ambiguous_units, base_units, quantity_names, unit_prefixes, unit_spellings, unit_symbols, usual_units
  implicit none (type, external)
  private

  public :: read_unit, find_conversion, number_last

  integer, parameter :: largest_power = 9   ! of a symbol
  integer, parameter :: most_powers = 12    ! their sum, so that factors stay far from the largest number
  character(len=*), parameter :: digits = '0123456789'
  character(len=*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ%'

  !> A unit. A number in it is (number + offset) numerator / denominator in base units.
  type, public :: unit_expression_t
    integer :: dimension(size(base_units)) = 0   !! exponents of `base_units`
    real(wp) :: numerator = 1.0_wp, denominator = 1.0_wp
    real(wp) :: offset = 0.0_wp                  !! of degC and degF
  end type unit_expression_t

  !> From numbers in one unit to another of the same dimension.
  type, public :: unit_conversion_t
    real(wp) :: numerator = 1.0_wp, denominator = 1.0_wp
    real(wp) :: before = 0.0_wp, after = 0.0_wp   !! added before and after the factor, for temperatures
  contains
    procedure :: convert
  end type unit_conversion_t

  type :: unit_reader_t
    character(len=:), allocatable :: text
    character(len=:), allocatable :: message   !! '': no error so far
    integer :: at = 1                          !! position of the next character
    integer :: powers = 0                      !! sum of the sizes of all powers so far
    logical :: has_power = .false.             !! some symbol has another power than 1
  end type unit_reader_t

contains

  !> A number in the other unit; unchanged to the last bit if the units are equal.
  elemental real(wp) function convert(self, number)
    class(unit_conversion_t), intent(in) :: self
    real(wp), intent(in) :: number

    convert = (number + self%before) * self%numerator / self%denominator + self%after
  end function convert

  !> Last position of the number at the beginning of a quantity such as '4.39e6 lbf ft/rad' or '120mm', 0 if there is none.
  pure integer function number_last(text) result(last)
    character(len=*), intent(in) :: text
    integer :: begin, next

    last = 0
    begin = verify(text, ' ')
    if (begin == 0) return
    if (scan(text(begin:begin), '+-') > 0) begin = begin + 1
    next = begin - 1 + verify(text(begin:) // ' ', digits // '.')
    if (scan(text(begin:next - 1), digits) == 0) return
    last = next - 1
    if (scan(text(next:), 'eEdDqQ') /= 1) return
    next = next + 1
    if (scan(text(next:), '+-') == 1) next = next + 1
    if (scan(text(next:), digits) == 1) last = next - 2 + verify(text(next:) // ' ', digits)
  end function number_last

  !> Reads a unit: 'N m/rad'. An empty text and '1' are the unit of ratios.
  subroutine read_unit(text, unit, message)
    character(len=*), intent(in) :: text
    type(unit_expression_t), intent(out) :: unit
    character(len=:), allocatable, intent(out) :: message   !! what is wrong, for the user; '': the unit is valid
    type(unit_reader_t) :: reader

    reader%text = plain_text(trim(text))
    reader%message = ''
    call read_product(reader, unit)
    if (reader%message == '' .and. reader%at <= len(reader%text)) reader%message = 'a parenthesis is missing'
    if (reader%message == '' .and. abs(unit%offset) > 0.0_wp .and. (reader%powers > 1 .or. reader%has_power)) then
      reader%message = 'a degree of temperature in a product; allowed there: K'
    end if
    call move_alloc(reader%message, message)
    if (message == '') return
    if (message(1:1) /= "'") message = quoted(shortened(trim(text))) // ': ' // message   ! else it names the symbol
  end subroutine read_unit

  !> Finds the conversion from a unit that the user writes to one of the program.
  subroutine find_conversion(text, target, conversion, message)
    character(len=*), intent(in) :: text     !! 'kN m/deg'
    character(len=*), intent(in) :: target   !! 'N m/rad'; '': ratios
    type(unit_conversion_t), intent(out) :: conversion
    character(len=:), allocatable, intent(out) :: message   !! what is wrong, for the user; '': the unit fits
    type(unit_expression_t) :: given, wanted

    call read_unit(text, given, message)
    if (message /= '') return
    call read_unit(target, wanted, message)
    if (message /= '') then
      message = quoted(trim(text)) // ': texts with units are not possible here; allowed: plain numbers in ' // trim(target)
    else if (any(given%dimension /= wanted%dimension)) then
      message = dimension_message(trim(text), given, trim(target), wanted)
    else if (abs(given%numerator * wanted%denominator - given%denominator * wanted%numerator) > 0.0_wp .or. &
             abs(given%offset - wanted%offset) > 0.0_wp) then
      conversion%numerator = given%numerator * wanted%denominator
      conversion%denominator = given%denominator * wanted%numerator
      conversion%before = given%offset
      conversion%after = -wanted%offset
    end if
  end subroutine find_conversion

  !> Says which dimension a unit has and which one is needed.
  function dimension_message(text, given, target, wanted) result(message)
    character(len=*), intent(in) :: text, target
    type(unit_expression_t), intent(in) :: given, wanted
    character(len=:), allocatable :: message
    integer, parameter :: rad = 5   ! in `base_units`
    integer :: difference(size(base_units))

    if (named_quantity(given) > 0) then
      message = quoted(shortened(text)) // ' is a unit of ' // quantity_of(given) // '; needed: one of ' // quantity_of(wanted)
    else
      message = quoted(shortened(text)) // ' is no unit of ' // quantity_of(wanted) // '; needed: one of that'
    end if
    if (target /= '') message = message // ', such as ' // target
    difference = wanted%dimension - given%dimension
    if (any(difference /= 0 .and. [1, 2, 3, 4, rad, 6] /= rad)) return
    if (difference(rad) == 1 .and. target == 'rad/s') then
      message = message // '; turns per minute are rpm, turns per second Hz'
    else if (difference(rad) == -1 .and. index(text, '/') == 0) then
      message = message // '; the angle counts: ' // quoted(text // '/rad') // ' or ' // quoted(text // '/deg')
    end if
  end function dimension_message

  !> The quantity of `quantity_names` that has a unit, 0: none of them.
  integer function named_quantity(unit) result(i)
    type(unit_expression_t), intent(in) :: unit
    type(unit_expression_t) :: named
    character(len=:), allocatable :: message

    do i = size(quantity_names), 1, -1
      call read_unit(quantity_names(i)%unit, named, message)
      if (all(named%dimension == unit%dimension)) return
    end do
  end function named_quantity

  !> 'torsional stiffness', or the dimension in base units.
  function quantity_of(unit) result(text)
    type(unit_expression_t), intent(in) :: unit
    character(len=:), allocatable :: text
    integer :: i

    i = named_quantity(unit)
    if (i > 0) then
      text = trim(quantity_names(i)%name)
      return
    end if
    text = ''
    do i = 1, size(base_units)
      if (unit%dimension(i) == 0) cycle
      text = text // ' ' // trim(base_units(i))
      if (unit%dimension(i) /= 1) text = text // to_text(unit%dimension(i))
    end do
    text = text(2:)
  end function quantity_of

  !> The text with ASCII in place of the signs for powers, products, degrees, micro and ohm, in UTF-8.
  pure function plain_text(text) result(plain)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: plain
    character(len=3), parameter :: signs(10) = [character(len=3) :: char(194) // char(178), char(194) // char(179), &
      char(194) // char(183), char(226) // char(139) // char(133), char(195) // char(151), char(194) // char(176), &
      char(194) // char(181), char(206) // char(188), char(206) // char(169), char(226) // char(132) // char(166)]
    character(len=3), parameter :: meanings(10) = [character(len=3) :: '2', '3', '*', '*', '*', 'deg', 'u', 'u', 'Ohm', 'Ohm']
    integer :: i, k

    plain = text
    do i = 1, size(signs)
      do
        k = index(plain, trim(signs(i)))
        if (k == 0) exit
        plain = plain(:k - 1) // trim(meanings(i)) // plain(k + len_trim(signs(i)):)
      end do
    end do
  end function plain_text

  !> Reads a product or quotient up to the end of the text or a closing parenthesis.
  recursive subroutine read_product(reader, unit)
    type(unit_reader_t), intent(inout) :: reader
    type(unit_expression_t), intent(out) :: unit
    integer :: divided, sign   ! number of factors behind the slash; of the powers
    logical :: is_open         ! an operator needs a factor behind it

    divided = 0
    sign = 1
    is_open = .false.
    do while (reader%message == '' .and. reader%at <= len(reader%text))
      select case (reader%text(reader%at:reader%at))
      case (' ')
        reader%at = reader%at + 1
      case (')')
        exit
      case ('*', '.', '-')
        if (is_open) exit
        is_open = .true.
        reader%at = reader%at + 1
      case ('/')
        if (sign < 0) reader%message = "more than one '/'; allowed: one, with parentheses, as in N m/(rad/s)"
        if (is_open) exit
        is_open = .true.
        sign = -1
        reader%at = reader%at + 1
      case default
        if (sign < 0) divided = divided + 1
        if (divided > 1) then
          reader%message = "several factors behind '/'; allowed: in parentheses, as in kN m/(rad s)"
        else
          call read_factor(reader, sign, unit)
        end if
        is_open = .false.
      end select
    end do
    if (is_open .and. reader%message == '') reader%message = 'a unit is missing beside an operator'
  end subroutine read_product

  !> Reads a symbol or an expression in parentheses, and its power, into a product.
  recursive subroutine read_factor(reader, sign, unit)
    type(unit_reader_t), intent(inout) :: reader
    integer, intent(in) :: sign   !! 1, or -1 for a factor to be divided by
    type(unit_expression_t), intent(inout) :: unit
    type(unit_expression_t) :: factor, first
    integer :: last, power, powers

    powers = reader%powers
    last = reader%at - 2 + verify(reader%text(reader%at:) // ' ', letters)
    if (reader%text(reader%at:reader%at) == '(') then
      reader%at = reader%at + 1
      call read_product(reader, factor)
      if (reader%message /= '') return
      if (reader%at > len(reader%text)) then
        reader%message = 'a parenthesis is missing'
        return
      end if
      reader%at = reader%at + 1
    else if (last >= reader%at) then
      call find_word(reader%text(reader%at:last), first, factor, reader%message)
      reader%at = last + 1
      if (reader%message == '' .and. powers < most_powers) call multiply(unit, first, sign)
    else if (scan(reader%text(reader%at:), digits) == 1) then
      last = reader%at - 2 + verify(reader%text(reader%at:) // ' ', digits // '.')
      if (reader%text(reader%at:last) /= '1') reader%message = 'a number, ' // quoted(reader%text(reader%at:last)) // &
        ', in a unit; allowed: symbols of units'
      reader%at = last + 1
    else
      last = reader%at - 1 + max(1, utf_8_length(reader%text, reader%at))
      reader%message = quoted(reader%text(reader%at:last)) // ' is no part of a unit'
    end if
    if (reader%message /= '') return
    call read_power(reader, power)
    reader%powers = powers + max(1, reader%powers - powers) * abs(power)
    reader%has_power = reader%has_power .or. power /= 1 .or. sign < 0
    if (reader%message == '' .and. reader%powers > most_powers) reader%message = &
      'too many factors; allowed: ' // to_text(most_powers) // ', powers counted as so many'
    if (reader%message == '') call multiply(unit, factor, sign * power)
  end subroutine read_factor

  !> Reads the power of a symbol: '2', '^2', '**2', '-1'; 1 if there is none.
  subroutine read_power(reader, power)
    type(unit_reader_t), intent(inout) :: reader
    integer, intent(out) :: power
    integer :: begin, last, sign

    power = 1
    begin = reader%at
    if (index(reader%text(begin:), '**') == 1) then
      begin = begin + 2
    else if (index(reader%text(begin:), '^') == 1) then
      begin = begin + 1
    end if
    sign = begin
    if (scan(reader%text(begin:), '+-') == 1) begin = begin + 1
    last = begin - 2 + verify(reader%text(begin:) // ' ', digits)
    if (last < begin) then
      if (sign > reader%at) reader%message = "a whole number is missing behind '" // reader%text(reader%at:sign - 1) // "'"
      return
    end if
    power = largest_power + 1
    if (last == begin) power = index(digits, reader%text(begin:last)) - 1
    if (power > largest_power .or. power == 0) reader%message = 'the power ' // reader%text(begin:last) // &
      ' is out of range; allowed: 1 to ' // to_text(largest_power)
    if (reader%text(sign:sign) == '-') power = -power
    reader%at = last + 1
  end subroutine read_power

  !> Multiplies a unit by a power of another one.
  pure subroutine multiply(unit, factor, power)
    type(unit_expression_t), intent(inout) :: unit
    type(unit_expression_t), intent(in) :: factor
    integer, intent(in) :: power

    unit%dimension = unit%dimension + power * factor%dimension
    if (power > 0) then
      unit%numerator = unit%numerator * factor%numerator**power
      unit%denominator = unit%denominator * factor%denominator**power
    else
      unit%numerator = unit%numerator * factor%denominator**(-power)
      unit%denominator = unit%denominator * factor%numerator**(-power)
    end if
    if (abs(factor%offset) > 0.0_wp) unit%offset = factor%offset
  end subroutine multiply

  !> The unit of a word: a symbol, one with a prefix, or another spelling of a product.
  recursive subroutine find_word(word, first, last, message)
    character(len=*), intent(in) :: word
    type(unit_expression_t), intent(out) :: first   !! all factors of a product but the last one
    type(unit_expression_t), intent(out) :: last    !! the factor to which a power belongs
    character(len=:), allocatable, intent(inout) :: message   !! what is wrong with it, if something is
    integer :: i, k

    do i = 1, size(unit_symbols)
      associate (symbol => unit_symbols(i))
        k = prefix_of(word, trim(symbol%name), symbol%takes_prefix)
        if (k < 0) cycle
        last = unit_expression_t(symbol%dimension, symbol%numerator, symbol%denominator, symbol%offset)
        call apply_prefix(k, last)
        return
      end associate
    end do
    do i = 1, size(unit_spellings)
      associate (spelling => unit_spellings(i))
        k = prefix_of(word, trim(spelling%name), spelling%takes_prefix)
        if (k < 0) cycle
        call find_meaning(trim(spelling%meaning), first, last, message)
        call apply_prefix(k, first)
        return
      end associate
    end do
    do i = 1, size(ambiguous_units)
      if (word /= ambiguous_units(i)%name) cycle
      message = quoted(word) // ' ' // trim(ambiguous_units(i)%reason)
      return
    end do
    message = unknown_message(word)
  end subroutine find_word

  !> The units of a spelling: symbols, perhaps with prefixes, separated by a blank or a slash.
  recursive subroutine find_meaning(meaning, first, last, message)
    character(len=*), intent(in) :: meaning
    type(unit_expression_t), intent(out) :: first, last   !! as of `find_word`
    character(len=:), allocatable, intent(inout) :: message
    type(unit_expression_t) :: factor, none
    integer :: begin, next, sign

    begin = 1
    sign = 1
    do
      next = begin - 1 + scan(meaning(begin:), ' /')
      if (next < begin) exit
      call find_word(meaning(begin:next - 1), none, factor, message)
      call multiply(first, factor, sign)
      sign = merge(-1, 1, meaning(next:next) == '/')
      begin = next + 1
    end do
    call find_word(meaning(begin:), none, factor, message)
    call multiply(last, factor, sign)
  end subroutine find_meaning

  !> Index of the prefix with which a word is a symbol, 0: none; -1 if it is not this symbol.
  pure integer function prefix_of(word, name, takes_prefix) result(prefix)
    character(len=*), intent(in) :: word, name
    logical, intent(in) :: takes_prefix

    if (word == name) then
      prefix = 0
      return
    end if
    if (takes_prefix .and. len(word) == len(name) + 1 .and. word(min(2, len(word)):) == name) then
      do prefix = 1, size(unit_prefixes)
        if (unit_prefixes(prefix)%name == word(1:1) .and. .not. is_symbol(word)) return
      end do
    end if
    prefix = -1
  end function prefix_of

  !> Whether a word is a symbol or a spelling as it stands, such as min, which is no thousandth of an inch.
  pure logical function is_symbol(word)
    character(len=*), intent(in) :: word

    is_symbol = any(unit_symbols%name == word) .or. any(unit_spellings%name == word)
  end function is_symbol

  pure subroutine apply_prefix(prefix, unit)
    integer, intent(in) :: prefix   !! index of `unit_prefixes`, 0: none
    type(unit_expression_t), intent(inout) :: unit

    if (prefix == 0) return
    unit%numerator = unit%numerator * unit_prefixes(prefix)%numerator
    unit%denominator = unit%denominator * unit_prefixes(prefix)%denominator
  end subroutine apply_prefix

  !> "'kNn' is no unit; did you mean 'kN'?"
  function unknown_message(word) result(message)
    character(len=*), intent(in) :: word
    character(len=:), allocatable :: message
    type(string_t), allocatable :: known(:)
    integer :: i

    allocate (known(0))
    do i = 1, size(usual_units)
      call append(known, trim(usual_units(i)))
    end do
    do i = 1, size(unit_symbols)
      call append(known, trim(unit_symbols(i)%name))
    end do
    do i = 1, size(unit_spellings)
      call append(known, trim(unit_spellings(i)%name))
    end do
    message = quoted(shortened(word)) // ' is no unit'
    message = message // near_match(word, known)
  end function unknown_message

end module nocdyn_unit_expressions
