!> How the keys of a group go together, in sentences for help and reference.
module nocdyn_schema_sentences
  use nocdyn_schema, only: alternatives, columns, group_rules, has_word, key_rule_index, key_rules, needs, words_in
  use nocdyn_schema_rules, only: alternative_t, columns_t, key_rule_t, required, unset
  use nocdyn_schema_text, only: listed
  use nocdyn_text, only: append, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: default_text, sentences_on

contains

  !> "required", "default 0", "optional", "required by 'uniform'", "this or teeth".
  pure function default_text(rule) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text
    type(string_t), allocatable :: others(:)
    integer :: i

    if (rule%default == required) then
      text = 'required'
    else if (rule%default /= unset) then
      text = 'default ' // trim(rule%default)
    else
      text = 'optional'
    end if
    if (rule%needed_by /= '') text = 'required by ' // quoted(trim(rule%needed_by))
    do i = 1, size(alternatives)
      if (alternatives(i)%group /= rule%group .or. .not. alternatives(i)%is_needed) cycle
      if (has_word(alternatives(i)%first, rule%name)) then
        others = words_in(alternatives(i)%second)
        text = 'this or ' // others(1)%text
      else if (has_word(alternatives(i)%second, rule%name)) then
        others = words_in(alternatives(i)%first)
        text = 'this or ' // others(1)%text
      end if
    end do
  end function default_text

  !> What a group's keys ask of each other, one sentence each.
  pure function sentences_on(group_rule) result(sentences)
    integer, intent(in) :: group_rule
    type(string_t), allocatable :: sentences(:)
    integer :: i

    allocate (sentences(0))
    do i = 1, size(alternatives)
      if (alternatives(i)%group == group_rules(group_rule)%name) call append(sentences, sentence_on(alternatives(i)))
    end do
    do i = 1, size(needs)
      if (needs(i)%group /= group_rules(group_rule)%name) cycle
      call append(sentences, listed(words_in(needs(i)%keys), ' and ') // &
                  trim(merge(' need ', ' needs', index(trim(needs(i)%keys), ' ') > 0)) // ' ' // &
                  listed(words_in(needs(i)%needed), ' or ') // '.')
    end do
    do i = 1, size(columns)
      if (columns(i)%group == group_rules(group_rule)%name) call append(sentences, sentence_on_columns(group_rule, columns(i)))
    end do
  end function sentences_on

  !> "Either radii or teeth." if one of them is needed, else "No points beside interval.".
  pure function sentence_on(alternative) result(text)
    type(alternative_t), intent(in) :: alternative
    character(len=:), allocatable :: text

    if (alternative%is_needed) then
      text = 'Either ' // listed(words_in(alternative%first), ' and ') // ' or ' // &
             listed(words_in(alternative%second), ' and ') // '.'
    else
      text = 'No ' // listed(words_in(alternative%second), ' or ') // ' beside ' // &
             listed(words_in(alternative%first), ' or ') // '.'
    end if
  end function sentence_on

  pure function sentence_on_columns(group_rule, rule) result(text)
    integer, intent(in) :: group_rule
    type(columns_t), intent(in) :: rule
    character(len=:), allocatable :: text
    type(string_t), allocatable :: lists(:)
    integer :: least

    allocate (lists, source=words_in(rule%keys))
    least = key_rules(key_rule_index(group_rule, lists(1)%text))%least
    text = listed(lists, ' and ') // ' have the same number of values'
    if (least > 1) text = text // ', ' // to_text(least) // ' at least'
    if (rule%file /= '') text = text // '; ' // lists(1)%text // ' ascends'
    text = text // '.'
  end function sentence_on_columns

end module nocdyn_schema_sentences
