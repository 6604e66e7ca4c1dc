!> The schema as a page of the documentation.
module nocdyn_schema_reference
  use nocdyn_schema, only: first_key, group_rules, has_word, key_rules, kind_rules, last_key, selector_name
  use nocdyn_schema_help, only: append_examples
  use nocdyn_schema_rules, only: key_rule_t, occurrence_texts, topics
  use nocdyn_schema_sentences, only: default_text, sentences_on, unit_sentence
  use nocdyn_schema_text, only: allowed_text, type_text
  use nocdyn_text, only: quoted, string_t
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: input_reference

contains

  !> A page in Markdown.
  function input_reference() result(text)
    character(len=:), allocatable :: heading, text   ! heading: "Machine: bodies and what connects them"
    type(text_buffer_t) :: buffer
    integer :: rule, topic

    call buffer%append_line('# Input reference')
    call buffer%append_line('')
    call buffer%append_line('An input file is a Fortran namelist in SI units. Groups may be in any order. A speed, a ' // &
                            'frequency or an angle may be given in rpm, Hz or degrees instead, by the key that ends in the ' // &
                            "unit, and every number as a text with its unit, such as '12 kN m'.")
    do topic = 1, size(topics)
      call buffer%append_line('')
      heading = trim(topics(topic)%name) // ': ' // trim(topics(topic)%help)
      heading(1:1) = achar(iachar(heading(1:1)) + iachar('A') - iachar('a'))
      call buffer%append_line('## ' // heading)
      do rule = 1, size(group_rules)
        if (group_rules(rule)%topic == topic) call append_group(buffer, rule)
      end do
    end do
    text = buffer%text()
  end function input_reference

  subroutine append_group(buffer, rule)
    type(text_buffer_t), intent(inout) :: buffer
    integer, intent(in) :: rule   !! row of `group_rules`
    type(string_t), allocatable :: sentences(:)
    integer :: k, key

    call buffer%append_line('')
    call buffer%append_line('### `&' // trim(group_rules(rule)%name) // '`')
    call buffer%append_line('')
    call buffer%append_line(trim(group_rules(rule)%help) // ' Given ' // &
                            trim(occurrence_texts(group_rules(rule)%occurrence)) // '.')
    call append_head(buffer)
    do key = first_key(rule), last_key(rule)
      if (key_rules(key)%only_if == '') call append_key(buffer, key_rules(key))
    end do
    do k = 1, size(kind_rules)
      if (kind_rules(k)%group == group_rules(rule)%name) then
        ! A kind with its keys
        call buffer%append_line('')
        call buffer%append_line('`' // selector_name(rule) // ' = ' // quoted(trim(kind_rules(k)%word)) // '`: ' // &
                                trim(kind_rules(k)%help) // '.')
        call append_head(buffer)
        do key = first_key(rule), last_key(rule)
          if (has_word(key_rules(key)%only_if, kind_rules(k)%word)) call append_key(buffer, key_rules(key))
        end do
      end if
    end do
    allocate (sentences, source=sentences_on(rule))
    if (size(sentences) > 0) call buffer%append_line('')
    do k = 1, size(sentences)
      call buffer%append_line('- ' // sentences(k)%text)
    end do
    call buffer%append_line('')
    call buffer%append_line('```')
    call append_examples(buffer, rule, .false.)
    call buffer%append_line('```')
  end subroutine append_group

  subroutine append_head(buffer)
    type(text_buffer_t), intent(inout) :: buffer

    call buffer%append_line('')
    call buffer%append_line('| key | type | default | allowed | meaning |')
    call buffer%append_line('| --- | --- | --- | --- | --- |')
  end subroutine append_head

  subroutine append_key(buffer, rule)
    type(text_buffer_t), intent(inout) :: buffer
    type(key_rule_t), intent(in) :: rule

    character(len=:), allocatable :: meaning

    meaning = trim(rule%help)
    if (unit_sentence(rule) /= '') meaning = meaning // '; ' // unit_sentence(rule)
    call buffer%append_line('| `' // trim(rule%name) // '` | ' // type_text(rule) // ' | ' // default_text(rule) // ' | ' // &
                            allowed_text(rule) // ' | ' // meaning // ' |')
  end subroutine append_key

end module nocdyn_schema_reference
