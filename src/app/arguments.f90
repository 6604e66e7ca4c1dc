!> The command line: command, files and options.
module nocdyn_arguments
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_text, only: append, joined, nearest_word, quoted, string_t, strings
  implicit none (type, external)
  private

  public :: command_line, parse_arguments, command_names

  type, public :: arguments_t
    character(len=:), allocatable :: command
    type(string_t), allocatable :: operands(:)    !! files, or the topic of `help`
    character(len=:), allocatable :: out          !! --out, not allocated if absent
    type(string_t), allocatable :: overrides(:)   !! PATH=VALUE of every --set
    character(len=:), allocatable :: at           !! --at, not allocated if absent
    logical :: is_quiet = .false.
  end type arguments_t

contains

  !> The words after the program's name.
  function command_line() result(words)
    type(string_t), allocatable :: words(:)
    integer :: i, length

    allocate (words(command_argument_count()))
    do i = 1, size(words)
      call get_command_argument(i, length=length)
      allocate (character(len=length) :: words(i)%text)
      if (length > 0) call get_command_argument(i, words(i)%text)
    end do
  end function command_line

  !> The commands that a command line can begin with.
  function command_names() result(names)
    type(string_t), allocatable :: names(:)

    allocate (names, source=strings([character(len=11) :: 'run', 'check', 'equilibrium', 'modes', 'matrices', 'new', &
                                                          'help']))
  end function command_names

  !> Takes the words apart; wrong usage is an error with exit code 2.
  subroutine parse_arguments(words, arguments, error)
    type(string_t), intent(in) :: words(:)
    type(arguments_t), intent(out) :: arguments
    type(error_t), allocatable, intent(out) :: error
    integer :: i
    logical :: takes_options

    allocate (arguments%operands(0), arguments%overrides(0))
    call find_command(words, arguments, error)
    takes_options = .true.
    i = 2
    do while (i <= size(words) .and. .not. allocated(error))
      if (words(i)%text == '--') then
        takes_options = .false.
      else if (takes_options .and. index(words(i)%text, '-') == 1 .and. len(words(i)%text) > 1) then
        call take_option(words, i, arguments, error)
      else
        call append(arguments%operands, words(i)%text)
      end if
      i = i + 1
    end do
    if (.not. allocated(error)) call check_usage(arguments, error)
  end subroutine parse_arguments

  subroutine find_command(words, arguments, error)
    type(string_t), intent(in) :: words(:)
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    integer :: i

    arguments%command = ''
    if (size(words) == 0) then
      call raise(error, exit_input, "a command is missing: nocdyn run FILE..., or 'nocdyn help' for all of them")
      return
    end if
    arguments%command = words(1)%text
    select case (arguments%command)
    case ('--help', '-h')
      arguments%command = 'help'
    case ('--version', '-V')
      arguments%command = 'version'
    case default
      allocate (names, source=command_names())
      if (index(arguments%command, '-') == 1) then
        call append(names, '--help')
        call append(names, '--version')
      end if
      if (any([(names(i)%text == arguments%command, i=1, size(names))])) return
      call raise(error, exit_input, unknown_word(arguments%command, 'a command', names))
    end select
  end subroutine find_command

  !> The option at word `i`, with its value in the same word after '=' or in the next one.
  subroutine take_option(words, i, arguments, error)
    type(string_t), intent(in) :: words(:)
    integer, intent(inout) :: i
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: name, value
    integer :: equals

    equals = index(words(i)%text // '=', '=')
    name = words(i)%text(:equals - 1)
    select case (name)
    case ('--quiet', '-q')
      arguments%is_quiet = .true.
      if (equals <= len(words(i)%text)) call raise(error, exit_input, '--quiet takes no value')
    case ('--out', '--set', '--at')
      if (equals <= len(words(i)%text)) then
        value = words(i)%text(equals + 1:)
      else if (i < size(words)) then
        i = i + 1
        value = words(i)%text
      else
        value = ''
      end if
      call take_value(name, value, arguments, error)
    case ('--help', '-h')
      deallocate (arguments%operands)
      allocate (arguments%operands(1))   ! gfortran 12 loses the text in an array constructor here
      call move_alloc(arguments%command, arguments%operands(1)%text)
      arguments%command = 'help'
    case default
      call raise(error, exit_input, unknown_word(name, 'an option', &
                                                 strings([character(len=7) :: '--out', '--set', '--at', '--quiet', '--help'])))
    end select
  end subroutine take_option

  subroutine take_value(name, value, arguments, error)
    character(len=*), intent(in) :: name, value
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error

    if (value == '') then
      call raise(error, exit_input, name // ' needs a value: ' // option_form(name))
    else if (name == '--set') then
      call append(arguments%overrides, value)
    else if (name == '--out') then
      if (allocated(arguments%out)) call raise(error, exit_input, '--out is given twice')
      arguments%out = value
    else
      if (allocated(arguments%at)) call raise(error, exit_input, '--at is given twice')
      arguments%at = value
    end if
  end subroutine take_value

  !> How an option is written.
  pure function option_form(name) result(form)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: form

    select case (name)
    case ('--out')
      form = '--out DIR'
    case ('--set')
      form = '--set PATH=VALUE'
    case default
      form = '--at equilibrium, --at rest or --at TIME'
    end select
  end function option_form

  !> "'rnu' is not a command; did you mean 'run'? allowed: 'run', ..."
  function unknown_word(word, what, known) result(message)
    character(len=*), intent(in) :: word, what
    type(string_t), intent(in) :: known(:)
    character(len=:), allocatable :: message
    integer :: nearest

    message = quoted(word) // ' is not ' // what // ';'
    nearest = nearest_word(word, known)
    if (nearest > 0) message = message // ' did you mean ' // quoted(known(nearest)%text) // '?'
    message = message // ' allowed: ' // joined(known, ', ')
  end function unknown_word

  !> Options and numbers of operands that a command does not take.
  subroutine check_usage(arguments, error)
    type(arguments_t), intent(in) :: arguments
    type(error_t), allocatable, intent(out) :: error
    integer :: operands

    operands = size(arguments%operands)
    if (allocated(arguments%out) .and. .not. is_one_of('run equilibrium modes')) then
      call raise(error, exit_input, '--out is an option of nocdyn run, equilibrium and modes')
    else if (arguments%is_quiet .and. .not. is_one_of('run')) then
      call raise(error, exit_input, '--quiet is an option of nocdyn run')
    else if (allocated(arguments%at) .and. .not. is_one_of('modes')) then
      call raise(error, exit_input, '--at is an option of nocdyn modes')
    else if (size(arguments%overrides) > 0 .and. .not. is_one_of('run check equilibrium modes matrices')) then
      call raise(error, exit_input, '--set is an option of nocdyn run, check, equilibrium, modes and matrices')
    else if (is_one_of('run check equilibrium modes') .and. operands == 0) then
      call raise(error, exit_input, 'an input file is missing: nocdyn ' // arguments%command // ' FILE...')
    else if (is_one_of('matrices new') .and. operands /= 1) then
      call raise(error, exit_input, 'exactly one file is needed: nocdyn ' // arguments%command // ' FILE')
    else if (is_one_of('version') .and. operands > 0) then
      call raise(error, exit_input, '--version takes no arguments')
    end if

  contains

    pure logical function is_one_of(commands)
      character(len=*), intent(in) :: commands   !! separated by blanks

      is_one_of = index(' ' // commands // ' ', ' ' // arguments%command // ' ') > 0
    end function is_one_of

  end subroutine check_usage

end module nocdyn_arguments
