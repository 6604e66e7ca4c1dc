!> The command line: command, files and options.
module nocdyn_arguments
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_options, only: option_index, option_names, option_t, options, accepted_by_text, accepts_option
  use nocdyn_text, only: append, joined, nearest_word, quoted, string_t, strings, to_text
  implicit none (type, external)
  private

  public :: command_line, parse_arguments, command_names

  integer, parameter :: most_threads = 4096, most_shards = 1000000

  type, public :: arguments_t
    character(len=:), allocatable :: command
    type(string_t), allocatable :: operands(:)    !! files, or the topic of `help`
    character(len=:), allocatable :: out          !! --out, not allocated if absent
    type(string_t), allocatable :: overrides(:)   !! PATH=VALUE of every --set
    character(len=:), allocatable :: at           !! --at, not allocated if absent
    integer :: threads = 0                        !! --threads, 0 if absent
    integer :: shard = 0, shards = 0              !! --shard, 0 if absent
    logical :: resumes = .false.                  !! --resume
    logical :: wants_csv = .false.                !! --csv
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

    allocate (names, source=strings([character(len=11) :: 'run', 'check', 'equilibrium', 'modes', 'matrices', &
                                                          'sweep', 'merge', 'new', 'help']))
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
        call parse_option(words, i, arguments, error)
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
  subroutine parse_option(words, i, arguments, error)
    type(string_t), intent(in) :: words(:)
    integer, intent(inout) :: i
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: name, value
    integer :: equals, number

    equals = index(words(i)%text // '=', '=')
    name = words(i)%text(:equals - 1)
    number = option_index(name)
    if (number == 0) then
      call raise(error, exit_input, unknown_word(name, 'an option of nocdyn ' // words(1)%text, &
                                                option_names(words(1)%text)))
    else if (options(number)%value == '') then
      call set_flag(trim(options(number)%name), arguments)
      if (equals <= len(words(i)%text)) call raise(error, exit_input, trim(options(number)%name) // ' takes no value')
    else
      if (equals <= len(words(i)%text)) then
        value = words(i)%text(equals + 1:)
      else if (i < size(words)) then
        i = i + 1
        value = words(i)%text
      else
        value = ''
      end if
      call set_value(options(number), value, arguments, error)
    end if
  end subroutine parse_option

  subroutine set_flag(name, arguments)
    character(len=*), intent(in) :: name
    type(arguments_t), intent(inout) :: arguments

    select case (name)
    case ('--quiet')
      arguments%is_quiet = .true.
    case ('--resume')
      arguments%resumes = .true.
    case ('--csv')
      arguments%wants_csv = .true.
    case ('--help')
      deallocate (arguments%operands)
      allocate (arguments%operands(1))   ! gfortran 12 loses the text in an array constructor here
      call move_alloc(arguments%command, arguments%operands(1)%text)
      arguments%command = 'help'
    case default
      error stop 'nocdyn_arguments: an option without a value that nothing is made of'
    end select
  end subroutine set_flag

  subroutine set_value(option, value, arguments, error)
    type(option_t), intent(in) :: option
    character(len=*), intent(in) :: value
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error

    if (value == '') then
      call raise(error, exit_input, trim(option%name) // ' needs a value: ' // trim(option%value))
      return
    end if
    select case (option%name)
    case ('--set')
      call append(arguments%overrides, value)
    case ('--out')
      if (allocated(arguments%out)) call raise(error, exit_input, '--out is given twice')
      arguments%out = value
    case ('--at')
      if (allocated(arguments%at)) call raise(error, exit_input, '--at is given twice')
      arguments%at = value
    case ('--threads')
      if (arguments%threads > 0) call raise(error, exit_input, '--threads is given twice')
      if (.not. allocated(error)) call parse_threads(value, arguments%threads, error)
    case ('--shard')
      if (arguments%shards > 0) call raise(error, exit_input, '--shard is given twice')
      if (.not. allocated(error)) call parse_shard(value, arguments%shard, arguments%shards, error)
    case default
      error stop 'nocdyn_arguments: an option with a value that nothing is made of'
    end select
  end subroutine set_value

  subroutine parse_threads(value, threads, error)
    character(len=*), intent(in) :: value
    integer, intent(inout) :: threads
    type(error_t), allocatable, intent(out) :: error

    if (digits_value(value) < 1 .or. digits_value(value) > most_threads) then
      call raise(error, exit_input, '--threads ' // value // ': allowed: a number from 1 to ' // to_text(most_threads))
    else
      threads = digits_value(value)
    end if
  end subroutine parse_threads

  !> K/N: part K of N equal parts.
  subroutine parse_shard(value, shard, shards, error)
    character(len=*), intent(in) :: value
    integer, intent(inout) :: shard, shards
    type(error_t), allocatable, intent(out) :: error
    integer :: part, parts, slash

    slash = index(value, '/')
    part = digits_value(value(:slash - 1))
    parts = digits_value(value(slash + 1:))
    if (slash == 0 .or. part < 1 .or. parts < 1 .or. part > parts .or. parts > most_shards) then
      call raise(error, exit_input, '--shard ' // value // &
                 ': allowed: K/N, the part K of N, with K from 1 to N and N at most ' // to_text(most_shards))
    else
      shard = part
      shards = parts
    end if
  end subroutine parse_shard

  !> The value of a text of digits, -1 if it is none or too long.
  pure integer function digits_value(text)
    character(len=*), intent(in) :: text
    integer, parameter :: most_digits = 9
    integer :: i

    digits_value = -1
    if (len(text) == 0 .or. len(text) > most_digits .or. verify(text, '0123456789') > 0) return
    digits_value = 0
    do i = 1, len(text)
      digits_value = 10 * digits_value + iachar(text(i:i)) - iachar('0')
    end do
  end function digits_value

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
    integer :: i, operands

    do i = 1, size(options)
      if (.not. is_given(arguments, options(i)%name) .or. accepts_option(arguments%command, options(i))) cycle
      call raise(error, exit_input, accepted_by_text(options(i)))
      return
    end do
    if (arguments%shards > 1 .and. arguments%wants_csv) then
      call raise(error, exit_input, '--csv and --shard: a part of a sweep has no table; ' // &
                 'nocdyn merge DIR --csv writes that of all')
      return
    end if
    operands = size(arguments%operands)
    select case (arguments%command)
    case ('run', 'check', 'equilibrium', 'modes')
      if (operands == 0) call raise(error, exit_input, 'an input file is missing: nocdyn ' // arguments%command // ' FILE...')
    case ('matrices', 'new', 'sweep')
      if (operands /= 1) call raise(error, exit_input, 'exactly one file is needed: nocdyn ' // arguments%command // ' FILE')
    case ('merge')
      if (operands /= 1) call raise(error, exit_input, 'exactly one folder is needed: nocdyn merge DIR')
    case ('version')
      if (operands > 0) call raise(error, exit_input, '--version takes no arguments')
    case default
      ! help takes what there is
    end select
  end subroutine check_usage

  !> Whether an option is on the command line. Of --help a command has been made.
  pure logical function is_given(arguments, name)
    type(arguments_t), intent(in) :: arguments
    character(len=*), intent(in) :: name

    select case (name)
    case ('--out')
      is_given = allocated(arguments%out)
    case ('--set')
      is_given = size(arguments%overrides) > 0
    case ('--at')
      is_given = allocated(arguments%at)
    case ('--threads')
      is_given = arguments%threads > 0
    case ('--shard')
      is_given = arguments%shards > 0
    case ('--resume')
      is_given = arguments%resumes
    case ('--csv')
      is_given = arguments%wants_csv
    case ('--quiet')
      is_given = arguments%is_quiet
    case default
      is_given = .false.
    end select
  end function is_given

end module nocdyn_arguments
