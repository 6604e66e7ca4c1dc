!> Help on an input: an overview of its groups by topics, then one topic, one group, or everything.
module nocdyn_schema_topics
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_schema, only: examples, group_rule_index, group_rules
  use nocdyn_schema_help, only: append_examples, append_group
  use nocdyn_schema_rules, only: at_least_once, exactly_once, occurrence_texts, topics
  use nocdyn_schema_text, only: group_names, suggestion
  use nocdyn_text, only: append, lower_case, listed, quoted, shortened, string_t
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: input_overview, input_help, topic_index

  character(len=*), parameter :: everything = 'all'   !! the word for all topics

contains

  !> The topics with their groups, one line each, and how to see more.
  function input_overview() result(text)
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    type(string_t), allocatable :: needed(:)   ! groups that no input is without
    integer :: rule, topic

    allocate (needed(0))
    do rule = 1, size(group_rules)
      if (all(group_rules(rule)%occurrence /= [exactly_once, at_least_once])) cycle
      call append(needed, '&' // trim(group_rules(rule)%name) // ' ' // trim(occurrence_texts(group_rules(rule)%occurrence)))
    end do
    call append_syntax(buffer)
    call buffer%append_line('An input has ' // listed(needed, ' and ') // '; all other groups are optional.')
    do topic = 1, size(topics)
      call buffer%append_line('')
      call buffer%append_line(topic_title(topic))
      do rule = 1, size(group_rules)
        if (group_rules(rule)%topic /= topic) cycle
        call buffer%append_line('  &' // group_rules(rule)%name // ' ' // trim(group_rules(rule)%help))
      end do
    end do
    call buffer%append_line('')
    call buffer%append_line('nocdyn help input TOPIC  a topic, for instance machine: its groups with their keys and examples')
    call buffer%append_line('nocdyn help input GROUP  a group, for instance coupling: its keys and examples')
    call buffer%append_line('nocdyn help input ' // everything // '    all groups with their keys, and an example')
    call buffer%append_line('nocdyn new FILE          writes an input with all of these explanations, to start from')
    text = buffer%text()
  end function input_overview

  !> A topic, a group, or everything, each with its groups, their keys and examples.
  subroutine input_help(word, text, error)
    character(len=*), intent(in) :: word   !! name of a topic, of a group with or without &, or 'all'
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error   !! there is no such topic or group
    character(len=:), allocatable :: name
    type(text_buffer_t) :: buffer
    integer :: group, rule, topic
    logical :: has_several, is_shown(size(group_rules))

    name = lower_case(word(verify(word // ' ', '&'):))
    group = group_rule_index(name)
    topic = topic_index(name)
    is_shown = [(rule == group .or. group_rules(rule)%topic == topic .or. name == everything, rule=1, size(group_rules))]
    if (.not. any(is_shown)) then
      call raise(error, exit_input, 'there is no topic or group ' // quoted(shortened(name)) // hint(name))
      return
    end if
    if (name == everything) then
      call append_syntax(buffer)
      call buffer%append_line("'nocdyn new FILE' writes the example below with these explanations.")
      call buffer%append_line('')
    else if (topic > 0) then
      call buffer%append_line(topic_title(topic))
      call buffer%append_line('')
    end if
    do rule = 1, size(group_rules)
      if (.not. is_shown(rule)) cycle
      call append_group(buffer, rule, '')
      call buffer%append_line('')
    end do
    has_several = topic > 0 .or. (group > 0 .and. count(examples%group == name) > 1)
    call buffer%append_line(trim(merge('Examples', 'Example ', has_several)))
    do rule = 1, size(group_rules)
      if (is_shown(rule)) call append_examples(buffer, rule, only_template=name == everything)
    end do
    text = buffer%text()
  end subroutine input_help

  !> Row of `topics`, 0 if there is no such topic.
  pure integer function topic_index(name) result(topic)
    character(len=*), intent(in) :: name   !! in lower case

    topic = findloc(topics%name == name, .true., dim=1)
  end function topic_index

  !> "; did you mean 'gear'?", or where the topics and groups are listed.
  function hint(name) result(text)
    character(len=*), intent(in) :: name   !! of no topic or group
    character(len=:), allocatable :: text
    type(string_t), allocatable :: names(:)
    integer :: topic

    allocate (names, source=group_names())
    do topic = 1, size(topics)
      call append(names, trim(topics(topic)%name))
    end do
    call append(names, everything)
    text = suggestion(name, names)
    if (text == '') text = "; 'nocdyn help input' lists them"
  end function hint

  subroutine append_syntax(buffer)
    type(text_buffer_t), intent(inout) :: buffer

    call buffer%append_line('An input file is a Fortran namelist: groups &NAME KEY = VALUE ... / in any order, texts in quotes,')
    call buffer%append_line('lists with commas or blanks, upper and lower case alike in groups and keys; ! begins a comment.')
    call buffer%append_line("SI units, the unit at the end of a key (speed_rpm, phase_deg), or a text with a unit: '12 kN m'.")
  end subroutine append_syntax

  !> "machine: bodies and what connects them".
  pure function topic_title(topic) result(text)
    integer, intent(in) :: topic   !! row of `topics`
    character(len=:), allocatable :: text

    text = trim(topics(topic)%name) // ': ' // trim(topics(topic)%help)
  end function topic_title

end module nocdyn_schema_topics
