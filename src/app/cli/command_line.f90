!> Parses the command line by the tables of commands and options.
module nocdyn_command_line
  use nocdyn_arguments, only: arguments_t, option_index, option_t, options
  use nocdyn_commands, only: command_index, command_names, command_t, commands_with_option, passed_on
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_ok, read_real
  use nocdyn_near_words, only: nearest_word
  use nocdyn_text, only: append, is_too_long, joined, longest_file_name, longest_path, &
    quoted, shortened, string_t, to_text
  implicit none (type, external)
  private

  public :: command_line, parse_command_line

  integer, parameter :: max_threads = 4096, max_shards = 1000000
  real(wp), parameter :: highest_hz = 1.0e12_wp

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

  !> Wrong usage is an error with exit code 2. --help makes any command a call of `help`; --version is the command 'version'.
  subroutine parse_command_line(words, commands, arguments, error)
    type(string_t), intent(in) :: words(:)
    type(command_t), intent(in) :: commands(:)
    type(arguments_t), intent(out) :: arguments
    type(error_t), allocatable, intent(out) :: error
    integer :: i
    logical :: takes_options

    allocate (arguments%operands(0), arguments%overrides(0), arguments%names(0), arguments%values(0))
    call parse_command(words, commands, arguments, error)
    takes_options = .true.
    i = 2
    if (.not. allocated(error) .and. leaves_words(commands, arguments%command)) return
    do while (i <= size(words) .and. .not. allocated(error))
      if (words(i)%text == '--') then
        takes_options = .false.
      else if (takes_options .and. index(words(i)%text, '-') == 1 .and. len(words(i)%text) > 1) then
        call parse_option(words, commands, i, arguments, error)
      else
        call append(arguments%operands, words(i)%text)
      end if
      i = i + 1
    end do
    if (.not. allocated(error)) call check_options(commands, arguments, error)
    if (.not. allocated(error)) call check_operands(commands, arguments, error)
  end subroutine parse_command_line

  !> Whether another program reads the words after a command.
  pure logical function leaves_words(commands, command)
    type(command_t), intent(in) :: commands(:)
    character(len=*), intent(in) :: command
    integer :: row

    leaves_words = .false.
    row = command_index(commands, command)
    if (row > 0) leaves_words = commands(row)%options == passed_on
  end function leaves_words

  subroutine parse_command(words, commands, arguments, error)
    type(string_t), intent(in) :: words(:)
    type(command_t), intent(in) :: commands(:)
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)

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
      if (command_index(commands, arguments%command) > 0) return
      allocate (names, source=command_names(commands))
      if (index(arguments%command, '-') == 1) then
        call append(names, '--help')
        call append(names, '--version')
      end if
      call raise(error, exit_input, unknown_word(arguments%command, 'a command', names))
    end select
  end subroutine parse_command

  !> The option at word `i`, with its value in the same word after '=' or in the next one.
  subroutine parse_option(words, commands, i, arguments, error)
    type(string_t), intent(in) :: words(:)
    type(command_t), intent(in) :: commands(:)
    integer, intent(inout) :: i   !! moved to the value if that is the next word
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: name, value
    integer :: equals, row

    equals = index(words(i)%text // '=', '=')
    name = words(i)%text(:equals - 1)
    value = words(i)%text(equals + 1:)
    row = option_index(name)
    if (row == 0) then
      call raise(error, exit_input, unknown_word(name, 'an option of nocdyn ' // words(1)%text, &
                                                option_names(commands, words(1)%text)))
    else if (options(row)%value == '') then
      if (equals <= len(words(i)%text)) call raise(error, exit_input, trim(options(row)%name) // ' takes no value')
    else if (equals > len(words(i)%text) .and. i < size(words)) then
      i = i + 1
      value = words(i)%text
    end if
    if (.not. allocated(error)) call add_option(options(row), value, arguments, error)
  end subroutine parse_option

  !> The long names of the options of a command.
  function option_names(commands, command) result(names)
    type(command_t), intent(in) :: commands(:)
    character(len=*), intent(in) :: command   !! may be unknown: --help is allowed then
    type(string_t), allocatable :: names(:)
    integer :: i, row

    allocate (names(0))
    row = command_index(commands, command)
    do i = 1, merge(size(options), 0, row > 0)
      if (commands(row)%takes(trim(options(i)%name))) call append(names, trim(options(i)%name))
    end do
    if (row == 0) call append(names, '--help')
  end function option_names

  !> Adds an option to those given. Of --help a command is made.
  subroutine add_option(option, value, arguments, error)
    type(option_t), intent(in) :: option
    character(len=*), intent(in) :: value
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error

    if (option%value /= '' .and. value == '') then
      call raise(error, exit_input, trim(option%name) // ' needs a value: ' // trim(option%name) // ' ' // trim(option%value))
    else if (.not. option%may_repeat .and. arguments%is_given(trim(option%name))) then
      call raise(error, exit_input, trim(option%name) // ' is given twice')
    end if
    if (allocated(error)) return
    select case (option%name)
    case ('--help')
      deallocate (arguments%operands)
      allocate (arguments%operands(1))   ! gfortran 12 loses the text in an array constructor here
      call move_alloc(arguments%command, arguments%operands(1)%text)
      arguments%command = 'help'
      return
    case ('--set')
      call append(arguments%overrides, value)
    case ('--threads')
      if (digits_value(value) < 1 .or. digits_value(value) > max_threads) then
        call raise(error, exit_input, '--threads ' // value // ': allowed: a number from 1 to ' // to_text(max_threads))
      else
        arguments%threads = digits_value(value)
      end if
    case ('--out')
      if (is_too_long(value)) call raise(error, exit_input, '--out ' // shortened(value) // ' is too long for a folder; ' // &
        'allowed: ' // to_text(longest_path) // ' bytes, ' // to_text(longest_file_name) // ' from slash to slash')
    case ('--starts')
      arguments%starts = digits_value(value)
      if (arguments%starts < 1) call raise(error, exit_input, '--starts ' // value // ': allowed: a number from 1 on')
    case ('--modes')
      arguments%modes = digits_value(value)
      if (arguments%modes < 1) call raise(error, exit_input, '--modes ' // value // ': allowed: a number from 1 on')
    case ('--compile')
      if (index('|' // trim(option%value) // '|', '|' // value // '|') == 0) then
        call raise(error, exit_input, '--compile ' // value // ': allowed: ' // trim(option%value))
      end if
    case ('--range_hz')
      call parse_range(value, arguments%range_hz, error)
    case ('--shard')
      call parse_shard(value, arguments%shard, arguments%shards, error)
    case default
      ! read by `is_given` and `value`
    end select
    call append(arguments%names, trim(option%name))
    call append(arguments%values, value)
  end subroutine add_option

  !> LOW,HIGH: a range of frequencies.
  subroutine parse_range(value, range_hz, error)
    character(len=*), intent(in) :: value
    real(wp), intent(inout) :: range_hz(2)   !! [Hz]
    type(error_t), allocatable, intent(out) :: error
    integer :: comma, status(2)

    comma = index(value, ',')
    status = literal_ok - 1
    if (comma > 0) then
      call read_real(value(:comma - 1), range_hz(1), status(1))
      call read_real(value(comma + 1:), range_hz(2), status(2))
    end if
    if (all(status == literal_ok)) then
      if (range_hz(1) >= 0 .and. range_hz(2) > range_hz(1) .and. range_hz(2) <= highest_hz) return
    end if
    call raise(error, exit_input, '--range_hz ' // value // ': allowed: LOW,HIGH with 0 <= LOW < HIGH <= 1e12, frequencies in Hz')
  end subroutine parse_range

  !> K/N: part K of N equal parts.
  subroutine parse_shard(value, shard, shards, error)
    character(len=*), intent(in) :: value
    integer, intent(inout) :: shard, shards
    type(error_t), allocatable, intent(out) :: error
    integer :: part, parts, slash

    slash = index(value, '/')
    part = digits_value(value(:slash - 1))
    parts = digits_value(value(slash + 1:))
    if (slash == 0 .or. part < 1 .or. parts < 1 .or. part > parts .or. parts > max_shards) then
      call raise(error, exit_input, '--shard ' // value // &
                 ': allowed: K/N, the part K of N, with K from 1 to N and N at most ' // to_text(max_shards))
    else
      shard = part
      shards = parts
    end if
  end subroutine parse_shard

  !> The value of a text of digits, -1 if there are other characters or too many.
  pure integer function digits_value(text)
    character(len=*), intent(in) :: text
    integer, parameter :: max_digits = 9
    integer :: i

    digits_value = -1
    if (len(text) == 0 .or. len(text) > max_digits .or. verify(text, '0123456789') > 0) return
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

    message = quoted(shortened(word)) // ' is not ' // what // ';'
    nearest = nearest_word(word, known)
    if (nearest > 0) message = message // ' did you mean ' // quoted(known(nearest)%text) // '?'
    message = message // ' allowed: ' // joined(known, ', ')
  end function unknown_word

  !> Refuses options that the command does not take, and two that exclude each other.
  subroutine check_options(commands, arguments, error)
    type(command_t), intent(in) :: commands(:)
    type(arguments_t), intent(in) :: arguments
    type(error_t), allocatable, intent(out) :: error
    integer :: i, row

    row = command_index(commands, arguments%command)
    do i = 1, size(arguments%names)
      associate (name => arguments%names(i)%text)
        if (row > 0) then
          if (commands(row)%takes(name)) cycle
        end if
        call raise(error, exit_input, name // ' is an option of nocdyn ' // commands_with_option(commands, name))
        return
      end associate
    end do
    if (arguments%is_given('--modes') .and. arguments%is_given('--range_hz')) then
      call raise(error, exit_input, '--modes and --range_hz exclude each other')
    else if (arguments%is_given('--variant') .and. size(arguments%operands) > 1) then
      call raise(error, exit_input, '--variant is of one input; allowed: at most one FILE')
    end if
  end subroutine check_options

  !> Refuses a wrong number of operands.
  subroutine check_operands(commands, arguments, error)
    type(command_t), intent(in) :: commands(:)
    type(arguments_t), intent(in) :: arguments
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: usage
    integer :: row

    row = command_index(commands, arguments%command)
    if (row == 0) then
      if (size(arguments%operands) > 0) call raise(error, exit_input, '--version takes no arguments')
      return
    end if
    if (arguments%is_given('--variant') .and. size(arguments%operands) == 0) return   ! the folder of the sweep has an input
    usage = 'nocdyn ' // arguments%command // ' ' // commands(row)%operands
    select case (commands(row)%operands)
    case ('FILE...')
      if (size(arguments%operands) == 0) call raise(error, exit_input, 'an input file is missing: ' // usage)
    case ('FILE')
      if (size(arguments%operands) /= 1) call raise(error, exit_input, 'exactly one file is needed: ' // usage)
    case ('DIR')
      if (size(arguments%operands) /= 1) call raise(error, exit_input, 'exactly one folder is needed: ' // usage)
    case default
      ! optional ones: their command checks them
    end select
  end subroutine check_operands

end module nocdyn_command_line
