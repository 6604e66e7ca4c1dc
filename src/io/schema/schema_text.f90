!> Rows of the schema as texts for messages and help.
module nocdyn_schema_text
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: aliases, first_key, group_aliases, group_rules, has_word, key_rule_index, key_rules, last_key, &
    words_in, words_of
  use nocdyn_schema_rules, only: a_body, a_document, a_file, a_flag, a_folder, a_line_file, a_name, a_number, a_selector, &
    a_word, allowed_t, an_integer, any_number, body_or_ground, key_rule_t, type_nouns
  use nocdyn_schema_units, only: name_in_unit, other_unit, unit_name
  use nocdyn_near_words, only: nearest_word
  use nocdyn_text, only: append, joined, listed, quoted, rounded_text, selected, string_t, strings, to_text
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: allowed_text, needed_text, number_text, type_text, only_if_text, listed_keys, group_names, key_names, similar_keys
  public :: suggest, suggest_group, suggest_key, suggestion

  integer, parameter :: kept_digits = 14   ! of a number that is converted

contains

  !> "> 0 [kg m2]", "'rk45', 'rosenbrock'", ".true., .false." ...; never empty.
  function allowed_text(rule, unit) result(text)
    type(key_rule_t), intent(in) :: rule
    integer, intent(in), optional :: unit   !! of the numbers: index of `units`; the one of the schema if absent or 0
    character(len=:), allocatable :: text
    integer :: number_unit

    number_unit = 0
    if (present(unit)) number_unit = unit

    select case (rule%value_type)
    case (a_number, an_integer)
      text = range_text(rule%allowed, number_unit)
      if (text == '') text = 'any value'
      if (rule%unit /= '') text = text // ' [' // unit_name(rule, number_unit) // ']'
    case (a_word, a_selector)
      text = joined(words_of(rule), ', ')
    case (a_flag)
      text = '.true., .false.'
    case (a_body)
      text = 'name of a &body'
    case (body_or_ground)
      text = "name of a &body, or 'ground'"
    case (a_file, a_document, a_line_file)
      text = 'path of a file'
    case (a_folder)
      text = 'path of a folder'
    case (a_name)
      text = 'a name of its own'
    case default
      text = 'any text'
    end select
  end function allowed_text

  !> The same, of a value that is no number or not a finite one.
  function needed_text(rule, unit) result(text)
    type(key_rule_t), intent(in) :: rule
    integer, intent(in), optional :: unit   !! as in `allowed_text`
    character(len=:), allocatable :: text
    character(len=*), parameter :: anything = 'any value'

    text = allowed_text(rule, unit)
    if (index(text, anything) == 1) text = 'a finite number' // text(len(anything) + 1:)
  end function needed_text

  !> "> 0", ">= 2", "1e-14 to 0.1", '' if all is allowed.
  function range_text(allowed, unit) result(text)
    type(allowed_t), intent(in) :: allowed
    integer, intent(in) :: unit   !! index of `units`
    character(len=:), allocatable :: text

    text = ''
    if (allowed%high < huge(1.0_wp)) then
      text = number_text(allowed%low, unit) // ' to ' // number_text(allowed%high, unit)
      if (allowed%excludes_low) text = '> ' // number_text(allowed%low, unit) // ' to ' // number_text(allowed%high, unit)
    else if (allowed%low > -huge(1.0_wp)) then
      text = '>= ' // number_text(allowed%low, unit)
      if (allowed%excludes_low) text = '> ' // number_text(allowed%low, unit)
    else if (allowed%excludes_zero) then
      text = 'not 0'
    end if
  end function range_text

  !> A number of SI in a unit; all its digits, but for those that the conversion rounds.
  pure function number_text(value, unit) result(text)
    real(wp), intent(in) :: value   !! in the SI unit
    integer, intent(in) :: unit     !! index of `units`, 0: SI
    character(len=number_length(value, unit)) :: text

    if (unit == 0) then
      text = to_text(value)
    else
      text = rounded_text(from_si(value, unit), kept_digits)
    end if
  end function number_text

  pure integer function number_length(value, unit) result(length)
    real(wp), intent(in) :: value
    integer, intent(in) :: unit

    if (unit == 0) then
      length = len(to_text(value))
    else
      length = len(rounded_text(from_si(value, unit), kept_digits))
    end if
  end function number_length

  !> "number", "2 bodies", "list of bodies" ...
  pure function type_text(rule) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text

    text = trim(type_nouns(rule%value_type))
    if (rule%count == 1) return
    if (text == 'body') text = 'bodie'
    text = text // 's'
    if (rule%count == any_number) then
      text = 'list of ' // text
    else
      text = to_text(rule%count) // ' ' // text
    end if
  end function type_text

  !> The kinds that have a key: "'ramp' or 'pulse'".
  pure function only_if_text(rule) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text

    text = quoted_list(words_in(rule%only_if))
  end function only_if_text

  !> "'ramp' or 'pulse'".
  pure function quoted_list(words) result(text)
    type(string_t), intent(in) :: words(:)   !! one at least
    character(len=:), allocatable :: text
    type(string_t) :: in_quotes(size(words))
    integer :: i

    do i = 1, size(words)
      in_quotes(i)%text = quoted(words(i)%text)
    end do
    text = listed(in_quotes, ' or ')
  end function quoted_list

  !> Names of keys of a group: "a, b or c".
  pure function listed_keys(group_rule, positions, conjunction) result(text)
    integer, intent(in) :: group_rule             !! row of `group_rules`
    integer, intent(in) :: positions(:)           !! of the keys among the keys of the group
    character(len=*), intent(in) :: conjunction   !! ' or ', ' and '
    character(len=:), allocatable :: text

    text = listed(selected(key_names(group_rule), positions), conjunction)
  end function listed_keys

  !> The names of all groups.
  pure function group_names() result(names)
    type(string_t), allocatable :: names(:)

    allocate (names, source=strings([group_rules%name]))
  end function group_names

  !> The names of the keys of a group.
  pure function key_names(group_rule) result(names)
    integer, intent(in) :: group_rule   !! row of `group_rules`
    type(string_t), allocatable :: names(:)

    allocate (names, source=strings([key_rules(first_key(group_rule):last_key(group_rule))%name]))
  end function key_names

  !> The names of the keys of a group, those in other units included.
  pure function all_names(group_rule) result(names)
    integer, intent(in) :: group_rule   !! row of `group_rules`
    type(string_t), allocatable :: names(:)
    integer :: key, unit

    allocate (names, source=key_names(group_rule))
    do key = first_key(group_rule), last_key(group_rule)
      unit = other_unit(key_rules(key))
      if (unit > 0) call append(names, name_in_unit(key_rules(key), unit))
    end do
  end function all_names

  !> The keys that the user may have meant by a word that is not a key of the group, perhaps in their other units.
  pure function similar_keys(group_rule, word) result(keys)
    integer, intent(in) :: group_rule      !! row of `group_rules`
    character(len=*), intent(in) :: word   !! in lower case
    type(string_t), allocatable :: keys(:)
    type(string_t), allocatable :: names(:)
    integer :: i, key, nearest

    allocate (keys(0))
    do i = 1, size(aliases)
      if (aliases(i)%group /= group_rules(group_rule)%name .or. .not. has_word(aliases(i)%words, word)) cycle
      keys = words_in(aliases(i)%keys)
      return
    end do
    key = key_rule_index(group_rule, word(:index(word, '_', back=.true.) - 1))
    if (key > 0) then
      if (other_unit(key_rules(key)) > 0) then   ! the key with the ending of another unit
        call append(keys, name_in_unit(key_rules(key), other_unit(key_rules(key))))
        return
      end if
    end if
    allocate (names, source=all_names(group_rule))
    nearest = nearest_word(word, names)
    if (nearest > 0) call append(keys, names(nearest)%text)
  end function similar_keys

  !> "; did you mean 'low'?", or all keys of the group if none is similar and they are few.
  pure subroutine suggest_key(group_rule, word, hint, is_near)
    integer, intent(in) :: group_rule      !! row of `group_rules`
    character(len=*), intent(in) :: word   !! in lower case
    character(len=:), allocatable, intent(out) :: hint
    logical, intent(out), optional :: is_near   !! whether one key is similar
    type(string_t), allocatable :: keys(:)

    allocate (keys, source=similar_keys(group_rule, word))
    if (size(keys) > 0) then
      hint = '; did you mean ' // quoted_list(keys) // '?'
      if (present(is_near)) is_near = .true.
    else
      call suggest(word, key_names(group_rule), hint, is_near)
    end if
  end subroutine suggest_key

  !> "; did you mean 'gear'?", or the group for which a word stands in the field.
  pure subroutine suggest_group(word, hint, is_near)
    character(len=*), intent(in) :: word   !! in lower case
    character(len=:), allocatable, intent(out) :: hint
    logical, intent(out), optional :: is_near   !! whether a group is similar, or meant by the word
    integer :: i

    do i = 1, size(group_aliases)
      if (.not. has_word(group_aliases(i)%words, word)) cycle
      hint = "; did you mean '" // trim(group_aliases(i)%group) // "'"
      if (group_aliases(i)%addition /= '') hint = hint // ' with ' // trim(group_aliases(i)%addition)
      hint = hint // '?'
      if (present(is_near)) is_near = .true.
      return
    end do
    call suggest(word, group_names(), hint, is_near)
  end subroutine suggest_group

  !> "; did you mean 'stiffness'?", or all candidates if none is similar and they are few.
  pure function suggestion(word, candidates) result(text)
    character(len=*), intent(in) :: word
    type(string_t), intent(in) :: candidates(:)
    character(len=:), allocatable :: text

    call suggest(word, candidates, text)
  end function suggestion

  !> As `suggestion`, for threads: gfortran keeps lengths of functions' texts in static memory.
  pure subroutine suggest(word, candidates, hint, is_near)
    character(len=*), intent(in) :: word
    type(string_t), intent(in) :: candidates(:)
    character(len=:), allocatable, intent(out) :: hint
    logical, intent(out), optional :: is_near   !! whether a candidate is similar
    integer, parameter :: few = 16
    integer :: nearest

    nearest = nearest_word(word, candidates)
    if (present(is_near)) is_near = nearest > 0
    hint = ''
    if (nearest > 0) then
      hint = "; did you mean '" // candidates(nearest)%text // "'?"
    else if (size(candidates) > 0 .and. size(candidates) <= few) then
      hint = '; allowed: ' // joined(candidates, ', ')
    end if
  end subroutine suggest

end module nocdyn_schema_text
