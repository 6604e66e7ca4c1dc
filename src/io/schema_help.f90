!> The schema as people read it: help on the terminal, an annotated example file, a reference page.
module nocdyn_schema_help
  use nocdyn_schema, only: examples, first_key, group_rule_index, group_rules, key_rules, last_key
  use nocdyn_schema_rules, only: a_flag, a_number, a_word, an_integer, body_or_ground, example_t, key_rule_t, required, unset
  use nocdyn_schema_text, only: allowed_text, group_names, kind_text, occurrence_text, suggestion
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_text, only: lower_case
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: input_help, group_help, input_template, input_reference

  integer, parameter :: longest_group = maxval(len_trim(group_rules%name))
  integer, parameter :: column = 36   !! width of type and allowed values

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
      call append_group_help(buffer, rule)
    end do
    call buffer%append_line('Example')
    do rule = 1, size(group_rules)
      call append_examples(buffer, rule, .true.)
    end do
    text = buffer%text()
  end function input_help

  !> One group with its keys and an example.
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
    call append_group_help(buffer, rule)
    call buffer%append_line('Example')
    call append_examples(buffer, rule, .false.)
    text = buffer%text()
  end subroutine group_help

  !> A complete input, the paper's second case, in which every key is explained.
  function input_template() result(text)
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer :: key, rule

    call buffer%append_line("! An input of nocdyn. 'nocdyn check FILE' checks it, 'nocdyn run FILE' computes it.")
    call buffer%append_line('! SI units; texts in quotes; what stands behind an exclamation mark is a comment.')
    do rule = 1, size(group_rules)
      call buffer%append_line('')
      call buffer%append_line('! &' // trim(group_rules(rule)%name) // ', ' &
        // occurrence_text(group_rules(rule)%occurrence) // ': ' // trim(group_rules(rule)%help))
      do key = first_key(rule), last_key(rule)
        call buffer%append_line('!   ' // key_rules(key)%name // short_rule(key_rules(key)))
        call buffer%append_line('!     ' // trim(key_rules(key)%help))
      end do
      call append_examples(buffer, rule, .true.)
    end do
    text = buffer%text()
  end function input_template

  !> A page in Markdown.
  function input_reference() result(text)
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer :: rule

    call buffer%append_line('# Input reference')
    call buffer%append_line('')
    call buffer%append_line('An input file is a Fortran namelist in SI units. Groups stand in any order.')
    do rule = 1, size(group_rules)
      call append_reference(buffer, rule)
    end do
    text = buffer%text()
  end function input_reference

  subroutine append_reference(buffer, rule)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule
    integer :: key

    call buffer%append_line('')
    call buffer%append_line('## `&' // trim(group_rules(rule)%name) // '`')
    call buffer%append_line('')
    call buffer%append_line(trim(group_rules(rule)%help) // ' Given ' // occurrence_text(group_rules(rule)%occurrence) // '.')
    call buffer%append_line('')
    call buffer%append_line('| key | type | default | allowed | meaning |')
    call buffer%append_line('| --- | --- | --- | --- | --- |')
    do key = first_key(rule), last_key(rule)
      call buffer%append_line('| `' // trim(key_rules(key)%name) // '` | ' // kind_text(key_rules(key)) // ' | ' &
        // default_text(key_rules(key)) // ' | ' // allowed_text(key_rules(key)) // ' | ' // trim(key_rules(key)%help) // ' |')
    end do
    call buffer%append_line('')
    call buffer%append_line('```')
    call append_examples(buffer, rule, .false.)
    call buffer%append_line('```')
  end subroutine append_reference

  subroutine append_group_help(buffer, rule)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule
    integer :: key

    call buffer%append_line('&' // trim(group_rules(rule)%name) // ', ' // occurrence_text(group_rules(rule)%occurrence))
    call buffer%append_line('  ' // trim(group_rules(rule)%help))
    do key = first_key(rule), last_key(rule)
      call buffer%append_line('    ' // key_rules(key)%name // short_rule(key_rules(key)))
      call buffer%append_line('        ' // trim(key_rules(key)%help))
    end do
    call buffer%append_line('')
  end subroutine append_group_help

  !> Type, allowed values and default in one line, the default in a column of its own.
  function short_rule(rule) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text
    character(len=column) :: values

    select case (rule%kind)
    case (a_number, an_integer)
      values = kind_text(rule) // ', ' // allowed_text(rule)
    case (a_word, a_flag)
      values = allowed_text(rule)
    case (body_or_ground)
      values = kind_text(rule) // " or 'ground'"
    case default
      values = kind_text(rule)
    end select
    text = ' ' // values // ' ' // default_text(rule)
  end function short_rule

  !> "required", "default 0", "or teeth" ...
  function default_text(rule) result(text)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text

    if (rule%default == required) then
      text = 'required'
    else if (rule%default /= unset) then
      text = 'default ' // trim(rule%default)
    else
      text = 'optional'
    end if
  end function default_text

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
