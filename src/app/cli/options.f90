!> The options of the command line: how they are written, and which commands take them.
module nocdyn_options
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: option_index, option_names, accepted_by_text, accepts_option

  type, public :: option_t
    character(len=9) :: name
    character(len=2) :: short       !! another name, blank if there is none
    character(len=48) :: value      !! how the option is written with its value, blank if it takes none
    character(len=48) :: commands   !! that take it, separated by blanks
  end type option_t

  type(option_t), parameter, public :: options(*) = [ &
    option_t('--out', '', '--out DIR', 'run equilibrium modes sweep'), &
    option_t('--set', '', '--set PATH=VALUE', 'run check equilibrium modes matrices sweep'), &
    option_t('--at', '', '--at equilibrium, --at rest or --at TIME', 'modes'), &
    option_t('--threads', '', '--threads NUMBER', 'sweep'), &
    option_t('--shard', '', '--shard K/N', 'sweep'), &
    option_t('--resume', '', '', 'sweep'), &
    option_t('--csv', '', '', 'sweep merge'), &
    option_t('--quiet', '-q', '', 'run sweep merge'), &
    option_t('--help', '-h', '', '')]

contains

  !> The number of an option, 0 if there is none of this name.
  pure integer function option_index(name)
    character(len=*), intent(in) :: name

    do option_index = size(options), 1, -1
      if (options(option_index)%name == name) return
      if (name /= '' .and. options(option_index)%short == name) return
    end do
  end function option_index

  !> The options of a command by their long names; --help is one of each.
  function option_names(command) result(names)
    character(len=*), intent(in) :: command
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, size(options)
      if (options(i)%commands == '' .or. accepts_option(command, options(i))) call append(names, trim(options(i)%name))
    end do
  end function option_names

  pure logical function accepts_option(command, option)
    character(len=*), intent(in) :: command
    type(option_t), intent(in) :: option

    accepts_option = index(' ' // option%commands // ' ', ' ' // command // ' ') > 0
  end function accepts_option

  !> "--out is an option of nocdyn run, equilibrium and modes"
  function accepted_by_text(option) result(text)
    type(option_t), intent(in) :: option
    character(len=:), allocatable :: text
    integer :: first, last

    text = trim(option%name) // ' is an option of nocdyn '
    first = 1
    do
      last = first + index(option%commands(first:) // ' ', ' ') - 2
      text = text // option%commands(first:last)
      first = last + 2
      if (first > len_trim(option%commands)) exit
      if (index(trim(option%commands(first:)), ' ') > 0) then
        text = text // ', '
      else
        text = text // ' and '
      end if
    end do
  end function accepted_by_text

end module nocdyn_options
