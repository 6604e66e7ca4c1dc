!> Groups with their keys as text on the terminal, and an example file with these explanations.
module nocdyn_schema_help
  use nocdyn_schema, only: examples, first_key, group_rules, has_word, key_rules, kind_rules, last_key, selector_name, &
    selector_rule
  use nocdyn_schema_rules, only: a_flag, a_number, a_selector, a_word, an_integer, body_or_ground, key_rule_t, occurrence_texts
  use nocdyn_schema_sentences, only: default_text, sentences_on, unit_sentence
  use nocdyn_schema_text, only: allowed_text, type_text
  use nocdyn_text, only: append, listed, quoted, string_t
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: input_template, append_group, append_examples

  integer, parameter :: longest_group = maxval(len_trim(group_rules%name))
  integer, parameter :: column = 38       !! width of type and allowed values
  integer, parameter :: longest = 54      !! type and allowed values that leave room for the default in the same line
  integer, parameter :: line_width = 94   !! of sentences
  character(len=*), parameter :: comment = '! '

contains

  !> A complete input, the paper's second case, in which every key is explained.
  function input_template() result(text)
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer :: rule

    call buffer%append_line("! An input of nocdyn. 'nocdyn check FILE' checks it, 'nocdyn run FILE' computes it.")
    call buffer%append_line('! SI units; texts in quotes; an exclamation mark begins a comment.')
    do rule = 1, size(group_rules)
      call buffer%append_line('')
      call append_group(buffer, rule, comment)
      call append_examples(buffer, rule, .true.)
    end do
    text = buffer%text()
  end function input_template

  !> A group with its keys: those up to the selector key, the ones of each kind, the ones of every kind.
  subroutine append_group(buffer, rule, prefix)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule              !! row of `group_rules`
    character(len=*), intent(in) :: prefix   !! of each line
    type(string_t), allocatable :: sentences(:)
    integer :: k, key, selector

    call buffer%append_line(prefix // '&' // trim(group_rules(rule)%name) // ', ' // &
                            trim(occurrence_texts(group_rules(rule)%occurrence)))
    call buffer%append_line(prefix // '  ' // trim(group_rules(rule)%help))
    selector = selector_rule(rule)
    if (selector == 0) selector = last_key(rule)
    do key = first_key(rule), selector
      call append_key(buffer, key_rules(key), prefix)
    end do
    do k = 1, size(kind_rules)
      if (kind_rules(k)%group == group_rules(rule)%name) call append_kind(buffer, k, rule, prefix)
    end do
    if (any(key_rules(selector + 1:last_key(rule))%only_if == '')) then
      call buffer%append_line(prefix // '  of every ' // selector_name(rule))
    end if
    do key = selector + 1, last_key(rule)
      if (key_rules(key)%only_if == '') call append_key(buffer, key_rules(key), prefix)
    end do
    allocate (sentences, source=sentences_on(rule))
    do k = 1, size(sentences)
      call append_wrapped(buffer, sentences(k)%text, prefix // '  ')
    end do
  end subroutine append_group

  !> A kind with its keys; of keys that an earlier kind has too only the names.
  subroutine append_kind(buffer, kind, rule, prefix)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: kind, rule   !! rows of `kind_rules` and `group_rules`
    character(len=*), intent(in) :: prefix
    type(string_t), allocatable :: known(:)
    integer :: key

    call buffer%append_line(prefix // '  ' // selector_name(rule) // ' = ' // quoted(trim(kind_rules(kind)%word)) // ': ' // &
                            trim(kind_rules(kind)%help))
    allocate (known(0))
    do key = first_key(rule), last_key(rule)
      if (.not. has_word(key_rules(key)%only_if, kind_rules(kind)%word)) cycle
      if (index(key_rules(key)%only_if, trim(kind_rules(kind)%word) // ' ') == 1) then
        call append_key(buffer, key_rules(key), prefix)
      else
        call append(known, trim(key_rules(key)%name))
      end if
    end do
    if (size(known) > 0) call append_wrapped(buffer, listed(known, ' and ') // ' as above', prefix // '    ')
  end subroutine append_kind

  subroutine append_key(buffer, rule, prefix)
    type(text_buffer_t), intent(inout) :: buffer
    type(key_rule_t), intent(in) :: rule
    character(len=*), intent(in) :: prefix

    call buffer%append_line(prefix // '    ' // rule%name // short_rule(rule, prefix))
    call buffer%append_line(prefix // '      ' // trim(rule%help))
    if (unit_sentence(rule) /= '') call buffer%append_line(prefix // '      ' // unit_sentence(rule))
  end subroutine append_key

  !> Type, allowed values and default in one line; the default is in a column of its own, after long texts in a line of its own.
  function short_rule(rule, prefix) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=*), intent(in) :: prefix   !! of the lines
    character(len=:), allocatable :: text
    integer, parameter :: widest = 70        ! of a terminal's 100 columns, beside the name and a prefix
    integer :: cut

    select case (rule%value_type)
    case (a_number, an_integer)
      text = type_text(rule) // ', ' // allowed_text(rule)
    case (a_word, a_flag)
      text = allowed_text(rule)
      if (rule%count /= 1) text = 'any of ' // text
    case (a_selector)
      text = trim(merge('one of those below        ', 'one or more of those below', rule%count == 1))
    case (body_or_ground)
      text = type_text(rule) // " or 'ground'"
    case default
      text = type_text(rule)
    end select
    text = ' ' // text
    if (len(text) > widest) then   ! a long list of words goes on in a line of its own
      cut = index(text(:widest), ' ', back=.true.)
      text = text(:cut - 1) // new_line('a') // prefix // repeat(' ', 5 + len(rule%name)) // text(cut + 1:)
    end if
    if (len(text) > longest) then
      text = text // new_line('a') // prefix // repeat(' ', 5 + len(rule%name) + column)
    else
      text = text // repeat(' ', max(0, column + 1 - len(text)))
    end if
    text = text // ' ' // default_text(rule)
  end function short_rule

  !> A sentence on as many lines as it needs.
  subroutine append_wrapped(buffer, text, prefix)
    type(text_buffer_t), intent(inout) :: buffer
    character(len=*), intent(in) :: text, prefix
    integer :: first, last

    first = 1
    do
      last = len(text)
      if (len(text) - first >= line_width) last = first - 1 + index(text(first:first + line_width - 1), ' ', back=.true.)
      call buffer%append_line(prefix // repeat('  ', merge(0, 1, first == 1)) // trim(text(first:last)))
      first = last + 1
      if (first > len(text)) exit
    end do
  end subroutine append_wrapped

  !> The examples of a group, each with & and /.
  subroutine append_examples(buffer, rule, only_template)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule            !! row of `group_rules`
    logical, intent(in) :: only_template   !! only the ones of the template
    integer :: bar, first, i

    do i = 1, size(examples)
      associate (example => examples(i))
        if (example%group /= group_rules(rule)%name .or. (only_template .and. .not. example%is_in_template)) cycle
        call buffer%append('&' // example%group(:longest_group) // ' ')
        first = 1
        do
          bar = index(example%text(first:), '|')
          if (bar == 0) exit
          call buffer%append_line(example%text(first:first + bar - 2))
          call buffer%append(repeat(' ', longest_group + 2))
          first = first + bar
        end do
        call buffer%append_line(trim(example%text(first:)) // ' /')
      end associate
    end do
  end subroutine append_examples

end module nocdyn_schema_help
