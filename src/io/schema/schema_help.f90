!> The schema as people read it on the terminal: help, and an annotated example file.
module nocdyn_schema_help
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_schema, only: examples, first_key, group_rule_index, group_rules, has_word, key_rules, kind_name, kind_rule_index, &
    kind_rules, last_key
  use nocdyn_schema_rules, only: a_flag, a_kind, a_number, a_word, an_integer, body_or_ground, example_t, key_rule_t
  use nocdyn_schema_sentences, only: default_text, sentences_on
  use nocdyn_schema_text, only: allowed_text, group_names, kind_text, listed, occurrence_text, suggestion
  use nocdyn_text, only: append, lower_case, quoted, string_t
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: input_help, group_help, input_template, append_examples

  integer, parameter :: longest_group = maxval(len_trim(group_rules%name))
  integer, parameter :: column = 38       !! width of type and allowed values
  integer, parameter :: longest = 54      !! that the default may follow in the same line
  integer, parameter :: line_width = 96   !! of sentences
  character(len=*), parameter :: comment = '! '

contains

  !> All groups with their keys, and an example.
  function input_help() result(text)
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer :: rule

    call buffer%append_line('An input file is a Fortran namelist: groups &NAME KEY = VALUE ... / in any order, texts in quotes,')
    call buffer%append_line('lists with commas or blanks, SI units, upper and lower case alike in groups and keys; ! begins a')
    call buffer%append_line("comment. 'nocdyn new FILE' writes the example below with these explanations.")
    call buffer%append_line('')
    do rule = 1, size(group_rules)
      call append_group(buffer, rule, '')
      call buffer%append_line('')
    end do
    call buffer%append_line('Example')
    do rule = 1, size(group_rules)
      call append_examples(buffer, rule, .true.)
    end do
    text = buffer%text()
  end function input_help

  !> One group with its keys and examples.
  subroutine group_help(group, text, error)
    character(len=*), intent(in) :: group   !! with or without &
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error   !! there is no such group
    type(text_buffer_t) :: buffer
    character(len=:), allocatable :: name
    integer :: rule

    name = lower_case(group(verify(group // ' ', '&'):))
    rule = group_rule_index(name)
    if (rule == 0) then
      call raise(error, exit_input, "there is no group '" // name // "'" // suggestion(name, group_names()))
      return
    end if
    call append_group(buffer, rule, '')
    call buffer%append_line('')
    call buffer%append_line(trim(merge('Examples', 'Example ', count(examples%group == group_rules(rule)%name) > 1)))
    call append_examples(buffer, rule, .false.)
    text = buffer%text()
  end subroutine group_help

  !> A complete input, the paper's second case, in which every key is explained.
  function input_template() result(text)
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer :: rule

    call buffer%append_line("! An input of nocdyn. 'nocdyn check FILE' checks it, 'nocdyn run FILE' computes it.")
    call buffer%append_line('! SI units; texts in quotes; what stands behind an exclamation mark is a comment.')
    do rule = 1, size(group_rules)
      call buffer%append_line('')
      call append_group(buffer, rule, comment)
      call append_examples(buffer, rule, .true.)
    end do
    text = buffer%text()
  end function input_template

  !> A group's keys: those before its kind and the kind itself, those of each kind, those behind.
  subroutine append_group(buffer, rule, indicator)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule
    character(len=*), intent(in) :: indicator   !! at the begin of each line
    integer :: k, key, kind_key

    call buffer%append_line(indicator // '&' // trim(group_rules(rule)%name) // ', ' // &
                            occurrence_text(group_rules(rule)%occurrence))
    call buffer%append_line(indicator // '  ' // trim(group_rules(rule)%help))
    kind_key = kind_rule_index(rule)
    if (kind_key == 0) kind_key = last_key(rule)
    do key = first_key(rule), kind_key
      call append_key(buffer, key_rules(key), indicator)
    end do
    do k = 1, size(kind_rules)
      if (kind_rules(k)%group == group_rules(rule)%name) call append_kind(buffer, k, rule, indicator)
    end do
    if (any(key_rules(kind_key + 1:last_key(rule))%kinds == '')) then
      call buffer%append_line(indicator // '  of every ' // kind_name(rule))
    end if
    do key = kind_key + 1, last_key(rule)
      if (key_rules(key)%kinds == '') call append_key(buffer, key_rules(key), indicator)
    end do
    call append_sentences(buffer, rule, indicator)
  end subroutine append_group

  !> The law of a kind and its keys; those that an earlier kind has too are only named.
  subroutine append_kind(buffer, kind, rule, indicator)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: kind, rule
    character(len=*), intent(in) :: indicator
    type(string_t), allocatable :: known(:)
    integer :: key

    call buffer%append_line(indicator // '  ' // kind_name(rule) // ' = ' // quoted(trim(kind_rules(kind)%word)) // ': ' // &
                            trim(kind_rules(kind)%help))
    allocate (known(0))
    do key = first_key(rule), last_key(rule)
      if (.not. has_word(key_rules(key)%kinds, kind_rules(kind)%word)) cycle
      if (index(key_rules(key)%kinds, trim(kind_rules(kind)%word) // ' ') == 1) then
        call append_key(buffer, key_rules(key), indicator)
      else
        call append(known, trim(key_rules(key)%name))
      end if
    end do
    if (size(known) > 0) call buffer%append_line(indicator // '    ' // listed(known, ' and ') // ' as above')
  end subroutine append_kind

  subroutine append_key(buffer, rule, indicator)
    type(text_buffer_t), intent(inout) :: buffer
    type(key_rule_t), intent(in) :: rule
    character(len=*), intent(in) :: indicator

    call buffer%append_line(indicator // '    ' // rule%name // short_rule(rule, indicator))
    call buffer%append_line(indicator // '      ' // trim(rule%help))
  end subroutine append_key

  !> Type, allowed values and default in one line, the default in a column of its own; in a line of its own after long ones.
  function short_rule(rule, indicator) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=*), intent(in) :: indicator   !! of the lines
    character(len=:), allocatable :: text

    select case (rule%kind)
    case (a_number, an_integer)
      text = kind_text(rule) // ', ' // allowed_text(rule)
    case (a_word, a_flag)
      text = allowed_text(rule)
    case (a_kind)
      text = trim(merge('one of those below        ', 'one or more of those below', rule%count == 1))
    case (body_or_ground)
      text = kind_text(rule) // " or 'ground'"
    case default
      text = kind_text(rule)
    end select
    text = ' ' // text
    if (len(text) > longest) then
      text = text // new_line('a') // indicator // repeat(' ', 5 + len(rule%name) + column)
    else
      text = text // repeat(' ', max(0, column + 1 - len(text)))
    end if
    text = text // ' ' // default_text(rule)
  end function short_rule

  subroutine append_sentences(buffer, rule, indicator)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule
    character(len=*), intent(in) :: indicator
    type(string_t), allocatable :: sentences(:)
    integer :: i

    allocate (sentences, source=sentences_on(rule))
    do i = 1, size(sentences)
      call append_wrapped(buffer, sentences(i)%text, indicator // '  ')
    end do
  end subroutine append_sentences

  !> A sentence on as many lines as it needs.
  subroutine append_wrapped(buffer, text, indicator)
    type(text_buffer_t), intent(inout) :: buffer
    character(len=*), intent(in) :: text, indicator
    integer :: first, last

    first = 1
    do
      last = len(text)
      if (len(text) - first >= line_width) last = first - 1 + index(text(first:first + line_width - 1), ' ', back=.true.)
      call buffer%append_line(indicator // repeat('  ', merge(0, 1, first == 1)) // trim(text(first:last)))
      first = last + 1
      if (first > len(text)) exit
    end do
  end subroutine append_wrapped

  !> The example groups of one rule.
  subroutine append_examples(buffer, rule, only_template)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule
    logical, intent(in) :: only_template   !! without the further examples
    integer :: i

    do i = 1, size(examples)
      if (examples(i)%group /= group_rules(rule)%name .or. (only_template .and. .not. examples(i)%is_in_template)) cycle
      call buffer%append_line(example_text(examples(i)))
    end do
  end subroutine append_examples

  !> A whole group.
  pure function example_text(example) result(text)
    type(example_t), intent(in) :: example
    character(len=:), allocatable :: text
    integer :: bar, first

    text = '&' // example%group(:longest_group) // ' '
    first = 1
    do
      bar = index(example%text(first:), '|')
      if (bar == 0) exit
      text = text // example%text(first:first + bar - 2) // new_line('a') // repeat(' ', longest_group + 2)
      first = first + bar
    end do
    text = text // trim(example%text(first:)) // ' /'
  end function example_text

end module nocdyn_schema_help
