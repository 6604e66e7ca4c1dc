!> The relations between the keys of a group as sentences for help and reference.
module nocdyn_schema_sentences
  use nocdyn_schema, only: group_rules, has_word, key_rule_index, key_rules, relation_rules, words_in
  use nocdyn_schema_rules, only: at_most_one, columns, equal_lengths, exactly_one, key_rule_t, less_than, &
    records, relation_rule_t, required, requires, unset
  use nocdyn_schema_units, only: name_in_unit, other_unit, unit_name
  use nocdyn_text, only: append, listed, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: default_text, sentences_on, unit_sentence

contains

  !> "required", "default 0", "optional", "required by 'uniform'", "this or teeth".
  pure function default_text(rule) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text
    integer :: i

    if (rule%default == required) then
      text = 'required'
    else if (rule%default /= unset) then
      text = 'default ' // trim(rule%default)
    else
      text = 'optional'
    end if
    if (rule%required_if /= '') text = 'required by ' // quoted(trim(rule%required_if))
    do i = 1, size(relation_rules)
      associate (relation => relation_rules(i))
        if (relation%group /= rule%group .or. relation%form /= exactly_one) cycle
        if (has_word(relation%first, rule%name)) text = others(rule, relation%second, relation%first)
        if (has_word(relation%second, rule%name)) text = others(rule, relation%first, relation%second)
      end associate
    end do
  end function default_text

  !> "this, teeth or ratio": what may stand in place of a key: keys of the other set, and the ones of its own that exclude it.
  pure function others(rule, other_set, own_set) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=*), intent(in) :: other_set, own_set   !! keys, separated by blanks
    character(len=:), allocatable :: text
    type(string_t), allocatable :: keys(:), own(:)
    integer :: i

    allocate (keys, source=words_in(other_set))
    if (.not. are_alternatives(rule%group, keys)) keys = keys(:1)
    allocate (own, source=words_in(own_set))
    if (are_alternatives(rule%group, own)) then
      do i = 1, size(own)
        if (own(i)%text /= rule%name) call append(keys, own(i)%text)
      end do
    end if
    text = 'this or ' // listed(keys, ' or ')
    if (size(keys) > 1) text = 'this, ' // listed(keys, ' or ')
  end function others

  !> Whether the first keys of a set exclude each other.
  pure logical function are_alternatives(group, keys)
    character(len=*), intent(in) :: group
    type(string_t), intent(in) :: keys(:)

    are_alternatives = size(keys) > 1
    if (are_alternatives) are_alternatives = any(relation_rules%group == group .and. relation_rules%form == at_most_one .and. &
                                                 relation_rules%first == keys(1)%text .and. &
                                                 relation_rules%second == keys(2)%text)
  end function are_alternatives

  !> "or speed_rpm [rpm]", '' if the key has no other unit.
  pure function unit_sentence(rule) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text

    text = ''
    associate (unit => other_unit(rule))
      if (unit > 0) text = 'or ' // name_in_unit(rule, unit) // ' [' // unit_name(rule, unit) // ']'
    end associate
  end function unit_sentence

  !> One sentence for each relation between the keys of a group.
  pure function sentences_on(group_rule) result(sentences)
    integer, intent(in) :: group_rule   !! row of `group_rules`
    type(string_t), allocatable :: sentences(:)
    integer :: i

    allocate (sentences(0))
    do i = 1, size(relation_rules)
      if (relation_rules(i)%group /= group_rules(group_rule)%name) cycle
      call append(sentences, sentence(group_rule, relation_rules(i)) // '.')
    end do
  end function sentences_on

  pure function sentence(group_rule, relation) result(text)
    integer, intent(in) :: group_rule
    type(relation_rule_t), intent(in) :: relation
    character(len=:), allocatable :: text
    type(string_t), allocatable :: first(:), second(:)

    allocate (first, source=words_in(relation%first))
    allocate (second, source=words_in(relation%second))
    select case (relation%form)
    case (exactly_one)
      text = 'Either ' // listed(first, conjunction(group_rule, first)) // ' or ' // &
             listed(second, conjunction(group_rule, second))
    case (at_most_one)
      text = 'No ' // listed(second, ' or ') // ' beside ' // listed(first, ' or ')
    case (requires)
      text = listed(first, ' and ') // trim(merge(' need ', ' needs', size(first) > 1)) // ' ' // listed(second, ' or ')
      if (relation%word /= '') text = text // ' = ' // quoted(trim(relation%word))
    case (less_than)
      text = first(1)%text // ' is less than ' // second(1)%text
      if (relation%equal_if_one /= '') text = text // '; with ' // trim(relation%equal_if_one) // ' = 1 they may be equal'
    case (records)
      text = listed(first, ' and ') // ' have the same number of values; ' // second(1)%text // ' has them as columns'
    case (columns)
      text = listed([first, second(2:)], ' and ') // ' have the same number of values'
    case (equal_lengths)
      associate (rule => key_rules(key_rule_index(group_rule, first(1)%text)))
        text = listed(first, ' and ') // ' have the same number of values'
        if (rule%fewest > 1) text = text // ', ' // to_text(rule%fewest) // ' at least'
        if (rule%ascends) text = text // '; ' // first(1)%text // ' ascends'
      end associate
    case default
      error stop 'nocdyn_schema_sentences: a relation has no sentence'
    end select
  end function sentence

  !> What joins the keys of a set.
  pure function conjunction(group_rule, keys) result(word)
    integer, intent(in) :: group_rule
    type(string_t), intent(in) :: keys(:)
    character(len=:), allocatable :: word

    word = ' and '
    if (are_alternatives(group_rules(group_rule)%name, keys)) word = ' or '
  end function conjunction

end module nocdyn_schema_sentences
