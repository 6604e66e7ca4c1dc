!> Help on the program and on its commands, made of the tables of commands and options.
module nocdyn_help_command
  use nocdyn_arguments, only: arguments_t, options
  use nocdyn_commands, only: command_index, command_names, command_t, passed_on
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_input, raise
  use nocdyn_input_schema, only: input_schema
  use nocdyn_schema, only: group_rule_index
  use nocdyn_schema_topics, only: input_help, input_overview, topic_index
  use nocdyn_text, only: joined, lower_case, quoted, string_t
  implicit none (type, external)
  private

  public :: help_command, usage

  character(len=*), parameter :: nl = new_line('a')
  integer, parameter :: max_width = 112   ! of a line of usage

contains

  !> help, help COMMAND, help input, help input --json, help input TOPIC, help input GROUP, help input all.
  subroutine help_command(commands, arguments, code)
    type(command_t), intent(in) :: commands(:)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text, word
    integer :: row

    word = ''
    if (size(arguments%operands) > 0) word = arguments%operands(1)%text
    row = 0
    if (size(arguments%operands) == 1) row = command_index(commands, word)
    if (arguments%is_given('--json')) then
      if (word == 'input' .and. size(arguments%operands) == 1) text = input_schema()
      if (.not. allocated(text)) call raise(error, exit_input, '--json is for nocdyn help input')
    else if (size(arguments%operands) == 0) then
      text = overview(commands)
    else if (word == 'input') then
      call help_on_input(arguments%operands(2:), text, error)
    else if (row > 0) then
      text = usage(commands(row))
      if (commands(row)%help /= '') text = text // nl // nl // commands(row)%help
    else if (group_rule_index(lower_case(word)) > 0) then
      call raise(error, exit_input, quoted(word) // ' is a group of the input: nocdyn help input ' // word)
    else if (topic_index(lower_case(word)) > 0) then
      call raise(error, exit_input, quoted(word) // ' is a topic of the input: nocdyn help input ' // word)
    else
      call raise(error, exit_input, 'there is no help on ' // joined(arguments%operands, ' ') // '; try ' // &
                 joined(command_names(commands), ', ') // " or 'input'")
    end if
    code = exit_done
    if (allocated(error)) then
      call report_error(error, code)
    else
      call print_text(text)
    end if
  end subroutine help_command

  !> The overview of the groups, or what a word asks for.
  subroutine help_on_input(words, text, error)
    type(string_t), intent(in) :: words(:)   !! after 'help input'
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error

    if (size(words) == 0) then
      text = input_overview()
    else if (size(words) == 1) then
      call input_help(words(1)%text, text, error)
    else
      call raise(error, exit_input, "'nocdyn help input' takes one topic or group; here " // joined(words, ', '))
    end if
  end subroutine help_on_input

  !> "nocdyn run FILE... [--out DIR] [--set PATH=VALUE]... [--quiet]", on as many lines as it needs.
  pure function usage(command) result(text)
    type(command_t), intent(in) :: command
    character(len=:), allocatable :: text, part
    integer :: i, start

    text = 'nocdyn ' // command%name // ' ' // command%operands
    if (command%options == passed_on) text = text // ' [OPTION]...'
    start = 0
    do i = 1, size(options)
      if (options(i)%name == '--help' .or. .not. command%takes(trim(options(i)%name))) cycle
      part = ' [' // trim(trim(options(i)%name) // ' ' // options(i)%value) // ']'
      if (options(i)%may_repeat .and. options(i)%value /= '') part = part // '...'
      if (len(text) - start + len(part) > max_width) then
        start = len(text) + 1
        text = text // nl // repeat(' ', len('nocdyn ' // command%name))
      end if
      text = text // part
    end do
  end function usage

  !> All commands with one line each.
  pure function overview(commands) result(text)
    type(command_t), intent(in) :: commands(:)
    character(len=:), allocatable :: text
    character(len=27) :: call
    integer :: i

    text = 'nocdyn: dynamics of drivetrains: rotating bodies, nonlinear elastic couplings, gears.' // nl
    do i = 1, size(commands)
      call = 'nocdyn ' // commands(i)%name // ' ' // commands(i)%operands
      text = text // nl // '  ' // call // commands(i)%summary
    end do
    text = text // nl // '  nocdyn help input          the groups of an input file by topics' // nl // '  nocdyn --version' // &
           nl // nl // &
           'Exit codes: 0 done, 1 a computation failed, 2 wrong usage or input, 3 a file cannot be read or written.'
  end function overview

end module nocdyn_help_command
