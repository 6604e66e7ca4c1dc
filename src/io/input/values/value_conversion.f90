!> From the texts of a key to typed values, with the checks that need no other key.
module nocdyn_value_conversion
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_input, only: value_t
  use nocdyn_key_path, only: key_path_t, read_path
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_malformed, literal_ok, literal_too_large, number_problem, read_integer, &
    read_logical, read_real
  use nocdyn_raw_group, only: new_raw_key, raw_group_t, raw_key_t, raw_value_t
  use nocdyn_schema, only: holds_texts, key_rules, words_of
  use nocdyn_schema_rules, only: a_body, a_document, a_file, a_flag, a_folder, a_line_file, a_name, a_number, a_selector, &
    a_word, an_integer, ground, is_out_of_range, key_rule_t, longest_name, size_limit, unset
  use nocdyn_schema_text, only: allowed_text, needed_text
  use nocdyn_schema_units, only: name_in_unit, path_key, takes_units, unit_name
  use nocdyn_near_words, only: nearest_word
  use nocdyn_text, only: counted, is_too_long, joined, longest_file_name, longest_path, lower_case, quoted, &
    shortened, string_t, to_text
  use nocdyn_unit_expressions, only: find_conversion, number_last, unit_conversion_t
  use nocdyn_units, only: in_si
  implicit none (type, external)
  private

  public :: convert_key, convert_number, default_value

contains

  !> Converts the values of one key, the missing ones by their default.
  subroutine convert_key(group, position, value, diagnostics)
    type(raw_group_t), intent(inout) :: group
    integer, intent(in) :: position             !! of the key
    type(value_t), intent(inout) :: value       !! unset if the key has no value or an error
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, parameter :: few = 80   ! values in a message; more are not shown anyhow
    character(len=:), allocatable :: found, message
    integer :: given, i, known

    associate (key => group%keys(position), rule => key_rules(group%keys(position)%rule))
      given = key%count_given()
      value%is_given = given > 0
      value%line = key%line
      value%override = key%override
      value%unit = key%unit
      if (key%is_malformed .or. (given == 0 .and. (key%may_be_missing .or. key%is_excluded))) return
      if (given == 0 .and. rule%default == unset .and. .not. key%is_required) return

      call key%fill_defaults()
      known = key%count_given()
      if (known == 0 .and. .not. key%is_required) return
      if (known == 0) then
        message = trim(merge(' has no value', ' is missing  ', key%is_written)) // '; needed: ' // allowed_text(rule, key%unit)
      else if (known < size(key%values)) then
        found = ''
        do i = 1, min(size(key%values), few)
          if (allocated(key%values(i)%written)) found = found // ', ' // key%values(i)%written
        end do
        message = ' has ' // counted(given, 'value', 'values') // ' (' // shortened(found(3:)) // '); needed: ' // &
                  to_text(size(key%values))
      else if (known < rule%fewest) then
        message = ' has ' // counted(known, 'value', 'values') // '; needed: at least ' // to_text(rule%fewest)
      else
        call convert_values(key, group%index, unit_of_numbers(group, rule), value, diagnostics)
        return
      end if
      call group%report([position], key%name() // message, diagnostics)
    end associate
  end subroutine convert_key

  !> The default of a key.
  function default_value(rule) result(value)
    integer, intent(in) :: rule   !! row of `key_rules` that has a default
    type(value_t) :: value
    type(raw_key_t) :: key
    type(diagnostics_t) :: none

    key = new_raw_key(rule)
    call key%fill_defaults()
    call convert_values(key, 0, '', value, none)
  end function default_value

  !> Converts all values of a key.
  subroutine convert_values(key, group, unit, value, diagnostics)
    type(raw_key_t), intent(in) :: key     !! with all values given
    integer, intent(in) :: group           !! index of the group, for the diagnostics
    character(len=*), intent(in) :: unit   !! of numbers, to which texts with a unit are converted
    type(value_t), intent(inout) :: value
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: element, message
    integer :: i
    logical :: has_error

    has_error = .false.
    associate (rule => key_rules(key%rule))
      select case (rule%value_type)
      case (a_number)
        allocate (value%numbers(size(key%values)), source=0.0_wp)
      case (an_integer)
        allocate (value%whole_numbers(size(key%values)), source=0)
      case (a_flag)
        allocate (value%flags(size(key%values)), source=.false.)
      case default
        allocate (value%texts(size(key%values)))
      end select
      do i = 1, size(key%values)
        if (rule%value_type == a_number .and. has_unit(key%values(i), key%override > 0)) then
          call convert_quantity(key%values(i), rule, power_unit(unit, i), value%numbers(i), message)
        else
          call convert_value(key%values(i), rule, key%override > 0, i, value, message)
        end if
        if (message == '') cycle
        has_error = .true.
        element = name_in_unit(rule, key%values(i)%unit)
        if (rule%count /= 1) element = element // '(' // to_text(i) // ')'
        call diagnostics%add(max(key%line, key%values(i)%line), group, &
                             element // ' = ' // shortened(key%values(i)%written) // message, key%override)
      end do
    end associate
    if (has_error) value = value_t(value%is_given, value%line, value%override)
  end subroutine convert_values

  !> Converts one value and checks it.
  subroutine convert_value(raw, rule, may_be_bare, i, value, message)
    type(raw_value_t), intent(in) :: raw
    type(key_rule_t), intent(in) :: rule
    logical, intent(in) :: may_be_bare                      !! texts need no quotes: the shell has removed them
    integer, intent(in) :: i                                !! index of the value
    type(value_t), intent(inout) :: value
    character(len=:), allocatable, intent(out) :: message   !! text after 'KEY = VALUE'; '': the value is valid
    integer :: status

    message = ''
    if (holds_texts(rule%value_type)) then
      value%texts(i)%text = raw%text
      if (.not. (raw%is_quoted .or. may_be_bare)) then
        message = ' is not a text; texts are written in quotes: ' // quoted(shortened(raw%text))
      else
        call check_text(rule, value%texts(i), message)
      end if
    else if (raw%is_quoted) then
      message = ' is a text; needed without quotes: ' // allowed_text(rule, raw%unit)
    else
      select case (rule%value_type)
      case (a_number)
        call read_real(raw%text, value%numbers(i), status)
        message = number_problem(status)
        if (status == literal_malformed .and. number_last(raw%text) > 0 .and. takes_units(rule, raw%unit)) then
          message = message // '; a number with its unit stands in quotes'
        else if (message == '') then
          call convert_number(rule, raw%unit, value%numbers(i), message)
          return
        end if
      case (an_integer)
        call read_integer(raw%text, value%whole_numbers(i), status)
        select case (status)
        case (literal_ok)
          if (is_out_of_range(real(value%whole_numbers(i), wp), rule%allowed)) message = ' is out of range'
        case (literal_too_large)
          message = ' is too large; at most ' // to_text(huge(0))
        case default
          message = ' is not a whole number'
        end select
      case default
        call read_logical(raw%text, value%flags(i), status)
        if (status /= literal_ok) message = ' is neither true nor false'
      end select
      if (message /= '') message = message // '; allowed: ' // needed_text(rule, raw%unit)
    end if
  end subroutine convert_value

  !> The unit in which the numbers of a key are: the one of the schema, or of the number that a path names.
  function unit_of_numbers(group, rule) result(unit)
    type(raw_group_t), intent(in) :: group
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: unit, message, owner
    type(key_path_t) :: path
    integer :: i

    unit = trim(rule%unit)
    owner = path_key(rule)
    if (owner == '') return
    do i = 1, size(group%keys)
      associate (key => group%keys(i))
        if (key%count_given() /= 1) cycle
        if (key_rules(key%rule)%name == 'scale' .and. lower_case(key%values(1)%text) == 'relative') unit = ''   ! behind the path
        if (key_rules(key%rule)%name /= owner) cycle
        call read_path(trim(adjustl(key%values(1)%text)), '', path, message)
        if (path%key_rule > 0) unit = unit_name(key_rules(path%key_rule), path%unit)
      end associate
    end do
  end function unit_of_numbers

  !> The unit of one value of a list: k of N m/rad^k is its index.
  pure function power_unit(unit, i) result(text)
    character(len=*), intent(in) :: unit
    integer, intent(in) :: i
    character(len=:), allocatable :: text

    text = unit
    if (index(text, '^k') > 0) text = text(:index(text, '^k')) // to_text(i)
  end function power_unit

  !> Whether a value is a number with its unit: '12 kN m'. Without quotes it stands on the command line only.
  pure logical function has_unit(raw, may_be_bare)
    type(raw_value_t), intent(in) :: raw
    logical, intent(in) :: may_be_bare   !! texts need no quotes: the shell has removed them
    integer :: last

    last = number_last(raw%text)
    has_unit = (raw%is_quoted .or. may_be_bare) .and. last > 0 .and. last < len_trim(raw%text)
  end function has_unit

  !> Converts a number with its unit and checks it.
  subroutine convert_quantity(raw, rule, unit, number, message)
    type(raw_value_t), intent(in) :: raw
    type(key_rule_t), intent(in) :: rule
    character(len=*), intent(in) :: unit   !! in which the number is needed
    real(wp), intent(out) :: number        !! in this unit, unless it is wrong
    character(len=:), allocatable, intent(out) :: message   !! text after 'KEY = VALUE'; '': the value is valid
    type(unit_conversion_t) :: conversion
    integer :: last, status

    last = number_last(raw%text)
    call read_real(trim(adjustl(raw%text(:last))), number, status)
    if (raw%unit > 0) then
      message = ' has a unit as ' // name_in_unit(rule, raw%unit) // ' has; allowed: a number, or ' // &
                name_in_unit(rule, 0) // ' = ' // quoted(shortened(trim(raw%text)))
    else if (number_problem(status) /= '') then
      message = number_problem(status) // '; allowed: ' // needed_text(rule)
    else
      call find_conversion(adjustl(raw%text(last + 1:)), unit, conversion, message)
      if (message /= '') then
        message = ': ' // message
      else if (size_limit(number, rule%allowed, rule%ascends) /= '') then   ! which bounds products too
        message = ' is out of range; allowed: ' // allowed_text(rule) // size_limit(number, rule%allowed, rule%ascends)
      else
        number = conversion%convert(number)
        call convert_number(rule, 0, number, message)
      end if
    end if
  end subroutine convert_quantity

  !> Converts a number to the unit of the schema and checks it.
  subroutine convert_number(rule, unit, number, message)
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit        !! in which it is given: index of `units`, 0: the one of the schema
    real(wp), intent(inout) :: number  !! then in the unit of the schema, unless it is wrong
    character(len=:), allocatable, intent(out) :: message   !! text after 'KEY = VALUE'; '': the number is valid
    character(len=:), allocatable :: limit

    message = ''
    limit = size_limit(number, rule%allowed, rule%ascends)
    if (limit == '') then
      number = in_si(number, unit)
      if (unit > 0) limit = size_limit(number, rule%allowed, rule%ascends)
      if (limit == '' .and. .not. is_out_of_range(number, rule%allowed)) return
    end if
    message = ' is out of range; allowed: ' // allowed_text(rule, unit) // limit
  end subroutine convert_number

  !> Checks the text of a name, a body, a word, a file or a folder.
  subroutine check_text(rule, value, message)
    type(key_rule_t), intent(in) :: rule
    type(string_t), intent(inout) :: value   !! a word, in any case, becomes the one of the schema
    character(len=:), allocatable, intent(inout) :: message
    type(string_t), allocatable :: words(:)
    integer :: i

    select case (rule%value_type)
    case (a_name)
      message = name_message(value%text)
    case (a_body)
      if (value%text == ground) message = ': the ground is not allowed here; allowed: ' // allowed_text(rule)
    case (a_word, a_selector)
      allocate (words, source=words_of(rule))
      do i = 1, size(words)
        if (lower_case(value%text) /= lower_case(words(i)%text)) cycle
        value%text = words(i)%text
        return
      end do
      message = ' is not known; allowed: ' // joined(words, ', ')
      i = nearest_word(value%text, words)
      if (i > 0) message = message // "; did you mean '" // words(i)%text // "'?"
    case (a_file, a_document, a_line_file)
      if (value%text == '') message = ' is not the name of a file'
    case (a_folder)
      if (is_too_long(value%text)) message = ' is too long for a folder; allowed: ' // to_text(longest_path) // &
        ' bytes, ' // to_text(longest_file_name) // ' from slash to slash'
    case default   ! any text
    end select
  end subroutine check_text

  !> What is wrong with the name of an element, '' if nothing is. Names become parts of columns and of paths on the command line.
  pure function name_message(name) result(message)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: message
    character(len=*), parameter :: forbidden = ',;=''"'
    integer :: i

    message = ''
    if (len_trim(name) == 0) then
      message = ' is an empty name'
    else if (name == ground) then
      message = ' is not allowed as a name: it is the body that does not turn'
    else if (len(name) > longest_name) then
      message = ' is too long for a name; allowed: ' // to_text(longest_name) // ' bytes'
    else if (name(1:1) == ' ' .or. name(len(name):) == ' ') then
      message = ' is a name with a blank at its beginning or end'
    else if (scan(name, forbidden) > 0 .or. any([(iachar(name(i:i)) < 32, i=1, len(name))])) then
      message = ' is a name with a comma, semicolon, equals sign, quote or tab, which is not allowed'
    end if
  end function name_message

end module nocdyn_value_conversion
