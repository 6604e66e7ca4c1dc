!> From texts to typed values, with the checks that one value can fail by itself.
module nocdyn_input_values
  use nocdyn_input, only: value_t
  use nocdyn_input_draft, only: draft_t, slot_t
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_fine, literal_not_finite, literal_too_large, read_integer, read_logical, read_real
  use nocdyn_schema, only: holds_texts, words_of
  use nocdyn_schema_rules, only: a_body, a_file, a_flag, a_kind, a_name, a_number, a_word, an_integer, &
    ground, is_outside, key_rule_t, longest_name
  use nocdyn_schema_text, only: allowed_text
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_text, only: joined, lower_case, nearest_word, string_t, to_text
  implicit none (type, external)
  private

  public :: convert

contains

  !> Fills `value` from a draft in which every value is said; a value with a mistake is left unset.
  subroutine convert(draft, rule, group, value, diagnostics)
    type(draft_t), intent(in) :: draft
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: group   !! index of the group, for the mistakes
    type(value_t), intent(inout) :: value
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    integer :: i
    logical :: is_fine

    is_fine = .true.
    call allocate_values(rule%kind, size(draft%slots), value)
    do i = 1, size(draft%slots)
      call convert_slot(draft%slots(i), rule, draft%override > 0, i, value, message)
      if (message == '') cycle
      is_fine = .false.
      call diagnostics%add(max(draft%line, draft%slots(i)%line), group, &
        element(rule, i) // ' = ' // draft%slots(i)%written // message, draft%override)
    end do
    if (.not. is_fine) value = value_t(value%is_given, value%line, value%override)
  end subroutine convert

  subroutine allocate_values(kind, count, value)
    integer, intent(in) :: kind, count
    type(value_t), intent(inout) :: value

    select case (kind)
    case (a_number)
      allocate (value%numbers(count), source=0.0_wp)
    case (an_integer)
      allocate (value%whole_numbers(count), source=0)
    case (a_flag)
      allocate (value%flags(count), source=.false.)
    case default
      allocate (value%texts(count))
    end select
  end subroutine allocate_values

  !> "inertia" or "radii(2)".
  pure function element(rule, i) result(text)
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: i
    character(len=:), allocatable :: text

    text = trim(rule%name)
    if (rule%count /= 1) text = text // '(' // to_text(i) // ')'
  end function element

  subroutine convert_slot(slot, rule, may_be_bare, i, value, message)
    type(slot_t), intent(in) :: slot
    type(key_rule_t), intent(in) :: rule
    logical, intent(in) :: may_be_bare   !! texts need no quotes, which the shell has eaten
    integer, intent(in) :: i
    type(value_t), intent(inout) :: value
    character(len=:), allocatable, intent(out) :: message   !! '' if all is well

    message = ''
    if (holds_texts(rule%kind)) then
      value%texts(i)%text = slot%text
      if (.not. (slot%is_quoted .or. may_be_bare)) then
        message = " is not a text; texts are written in quotes: '" // slot%text // "'"
      else
        call check_text(rule, value%texts(i), message)
      end if
    else if (slot%is_quoted) then
      message = ' is a text; needed without quotes: ' // allowed_text(rule)
    else if (rule%kind == a_number) then
      call convert_number(slot%text, rule, value%numbers(i), message)
    else if (rule%kind == an_integer) then
      call convert_integer(slot%text, rule, value%whole_numbers(i), message)
    else
      call convert_flag(slot%text, value%flags(i), message)
    end if
  end subroutine convert_slot

  subroutine convert_number(text, rule, value, message)
    character(len=*), intent(in) :: text
    type(key_rule_t), intent(in) :: rule
    real(wp), intent(out) :: value
    character(len=:), allocatable, intent(inout) :: message
    integer :: status

    call read_real(text, value, status)
    select case (status)
    case (literal_fine)
      if (is_outside(value, rule%allowed)) message = ' is out of range; allowed: ' // allowed_text(rule)
    case (literal_not_finite)
      message = ' is not a finite number; allowed: ' // allowed_text(rule)
    case (literal_too_large)
      message = ' is too large for a number; allowed: ' // allowed_text(rule)
    case default
      message = ' is not a number; allowed: ' // allowed_text(rule)
    end select
  end subroutine convert_number

  subroutine convert_integer(text, rule, value, message)
    character(len=*), intent(in) :: text
    type(key_rule_t), intent(in) :: rule
    integer, intent(out) :: value
    character(len=:), allocatable, intent(inout) :: message
    integer :: status

    call read_integer(text, value, status)
    select case (status)
    case (literal_fine)
      if (is_outside(real(value, wp), rule%allowed)) message = ' is out of range; allowed: ' // allowed_text(rule)
    case (literal_too_large)
      message = ' is too large; at most ' // to_text(huge(value)) // '; allowed: ' // allowed_text(rule)
    case default
      message = ' is not a whole number; allowed: ' // allowed_text(rule)
    end select
  end subroutine convert_integer

  subroutine convert_flag(text, value, message)
    character(len=*), intent(in) :: text
    logical, intent(out) :: value
    character(len=:), allocatable, intent(inout) :: message
    integer :: status

    call read_logical(text, value, status)
    if (status /= literal_fine) message = ' is neither true nor false; allowed: .true., .false.'
  end subroutine convert_flag

  subroutine check_text(rule, value, message)
    type(key_rule_t), intent(in) :: rule
    type(string_t), intent(inout) :: value
    character(len=:), allocatable, intent(inout) :: message

    select case (rule%kind)
    case (a_name)
      message = name_message(value%text)
    case (a_body)
      if (value%text == ground) message = ': the ground is not allowed here; allowed: name of a &body'
    case (a_word, a_kind)
      call check_word(words_of(rule), value, message)
    case (a_file)
      if (value%text == '') message = ' is not the name of a file'
    case default
      message = ''
    end select
  end subroutine check_text

  subroutine check_word(words, value, message)
    type(string_t), intent(in) :: words(:)
    type(string_t), intent(inout) :: value   !! in any case; becomes the word of the schema
    character(len=:), allocatable, intent(inout) :: message
    integer :: i

    do i = 1, size(words)
      if (lower_case(value%text) /= words(i)%text) cycle
      value%text = words(i)%text
      return
    end do
    message = ' is not known; allowed: ' // joined(words, ', ')
    i = nearest_word(value%text, words)
    if (i > 0) message = message // "; did you mean '" // words(i)%text // "'?"
  end subroutine check_word

  !> Names become parts of column names and of paths on the command line.
  pure function name_message(name) result(message)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: message
    character(len=*), parameter :: forbidden = ',;=''"'
    integer :: i

    message = ''
    if (len_trim(name) == 0) then
      message = ' is an empty name'
    else if (name == ground) then
      message = ' is not allowed as a name: it stands for what does not turn'
    else if (len(name) > longest_name) then
      message = ' is too long for a name; allowed: ' // to_text(longest_name) // ' bytes'
    else if (name(1:1) == ' ' .or. name(len(name):) == ' ') then
      message = ' is a name with a blank at its begin or end'
    else if (scan(name, forbidden) > 0 .or. any([(iachar(name(i:i)) < 32, i=1, len(name))])) then
      message = ' is a name with a comma, semicolon, equals sign, quote or tab, which is not allowed'
    end if
  end function name_message

end module nocdyn_input_values
