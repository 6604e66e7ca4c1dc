!> Prints a manual page in roff, of the tables of commands or of groups and keys: nocdyn_manual 1 | 5.
program nocdyn_manual
  use, intrinsic :: iso_fortran_env, only: output_unit
  use nocdyn_command_table, only: list_commands
  use nocdyn_commands, only: command_t
  use nocdyn_help_command, only: usage
  use nocdyn_schema, only: first_key, group_rules, key_rules, last_key
  use nocdyn_schema_help, only: append_examples
  use nocdyn_schema_rules, only: key_rule_t, occurrence_texts, topics
  use nocdyn_schema_sentences, only: default_text, sentences_on, unit_sentence
  use nocdyn_schema_text, only: allowed_text, type_text
  use nocdyn_text, only: string_t
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_version, only: version
  implicit none (type, external)

  character(len=*), parameter :: nl = new_line('a')
  character(len=1) :: section

  call get_command_argument(1, section)
  if (section == '5') then
    call write_input_page()
  else
    call write_commands_page()
  end if

contains

  !> nocdyn(1): what 'nocdyn help COMMAND' says of all commands.
  subroutine write_commands_page()
    type(command_t), allocatable :: commands(:)
    integer :: i

    call list_commands(commands)
    call put('.TH NOCDYN 1 "" "nocdyn ' // version // '"')
    call head('NAME', 'nocdyn \- dynamics of drivetrains: rotating bodies, nonlinear elastic couplings, gears')
    call head('SYNOPSIS', '\fBnocdyn\fR \fICOMMAND\fR \fR[\fIFILE\fR | \fIDIR\fR]... [\fIOPTION\fR]...')
    call head('DESCRIPTION', 'Integrates and analyses drivetrains that Fortran namelists describe, in SI units: nocdyn-input(5).')
    call put('.SH COMMANDS')
    do i = 1, size(commands)
      call put('.SS ' // commands(i)%name)
      call put(plain(commands(i)%summary) // '.')
      call put_lines(usage(commands(i)) // nl // nl // commands(i)%help)
    end do
    call head('ENVIRONMENT', '\fBNOCDYN_PYTHON\fR: the Python of the commands plot, report, fmu and verify. ' // &
              '\fBOMP_NUM_THREADS\fR: the number of threads of a sweep.')
    call head('EXIT STATUS', '0 done, 1 a computation failed, 2 wrong usage or input, 3 a file cannot be read or written.')
    call head('SEE ALSO', 'nocdyn-input(5)')
  end subroutine write_commands_page

  !> nocdyn-input(5): the groups of an input file and their keys.
  subroutine write_input_page()
    integer :: rule, topic

    call put('.TH NOCDYN-INPUT 5 "" "nocdyn ' // version // '"')
    call head('NAME', 'nocdyn-input \- groups and keys of the input files of nocdyn')
    call head('DESCRIPTION', 'An input file is a Fortran namelist in SI units. Groups may be in any order.')
    do topic = 1, size(topics)
      call head(trim(topics(topic)%name), plain(trim(topics(topic)%help)))
      do rule = 1, size(group_rules)
        if (group_rules(rule)%topic == topic) call put_group(rule)
      end do
    end do
    call head('SEE ALSO', 'nocdyn(1)')
  end subroutine write_input_page

  subroutine put_group(rule)
    integer, intent(in) :: rule   !! row of `group_rules`
    type(text_buffer_t) :: examples
    type(string_t), allocatable :: sentences(:)
    integer :: k

    call put('.SS &' // trim(group_rules(rule)%name))
    call put(plain(trim(group_rules(rule)%help) // ' Given ' // trim(occurrence_texts(group_rules(rule)%occurrence)) // '.'))
    do k = first_key(rule), last_key(rule)
      call put_key(key_rules(k))
    end do
    allocate (sentences, source=sentences_on(rule))
    if (size(sentences) > 0) call put('.P')
    do k = 1, size(sentences)
      call put(plain(sentences(k)%text))
    end do
    call append_examples(examples, rule, .false.)
    call put_lines(examples%text())
  end subroutine put_group

  subroutine put_key(rule)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: text

    text = type_text(rule)
    if (default_text(rule) /= '') text = text // ', ' // default_text(rule)
    if (allowed_text(rule) /= '') text = text // ', ' // allowed_text(rule)
    if (rule%only_if /= '') text = text // '; only of ' // trim(rule%only_if)
    call put('.TP')
    call put('\fB' // plain(trim(rule%name)) // '\fR (' // plain(text) // ')')
    text = trim(rule%help)
    if (unit_sentence(rule) /= '') text = text // '; ' // unit_sentence(rule)
    call put(plain(text) // '.')
  end subroutine put_key

  !> A heading with a paragraph of roff.
  subroutine head(title, text)
    character(len=*), intent(in) :: title, text

    call put('.SH ' // title)
    call put(text)
  end subroutine head

  !> Lines that stay as they are.
  subroutine put_lines(text)
    character(len=*), intent(in) :: text

    call put('.P' // nl // '.RS' // nl // '.nf')
    call put(plain(text))
    call put('.fi' // nl // '.RE')
  end subroutine put_lines

  !> Text without meaning to roff: no escapes, and no line that begins as a request.
  pure function plain(text) result(roff)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: roff
    integer :: i

    roff = ''
    do i = 1, len(text)
      select case (text(i:i))
      case ('\')
        roff = roff // '\e'
      case ('-')
        roff = roff // '\-'
      case ("'")
        roff = roff // '\(aq'
      case ('.')
        if (is_first(text, i)) roff = roff // '\&'
        roff = roff // '.'
      case default
        roff = roff // text(i:i)
      end select
    end do
  end function plain

  !> Whether a character is the first one of its line.
  pure logical function is_first(text, i)
    character(len=*), intent(in) :: text
    integer, intent(in) :: i

    is_first = i == 1
    if (i > 1) is_first = text(i - 1:i - 1) == nl
  end function is_first

  subroutine put(line)
    character(len=*), intent(in) :: line

    write (output_unit, '(a)') line
  end subroutine put

end program nocdyn_manual
