!> What a command line says, the command with its operands and options; the table of all options.
module nocdyn_arguments
  use nocdyn_compiled_code, only: compile_choices
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: option_index

  type, public :: option_t
    character(len=10) :: name
    character(len=2) :: short = ''         !! another name, blank if there is none
    character(len=26) :: value = ''        !! what follows the name, blank if the option has no value
    logical :: may_repeat = .false.        !! whether it may be given more than once
  end type option_t

  !> Which commands take them is said in the table of commands.
  type(option_t), parameter, public :: options(*) = [ &
    option_t('--out', value='DIR'), &
    option_t('--set', value='PATH=VALUE', may_repeat=.true.), &
    option_t('--case', value='NAME'), &
    option_t('--variant', value='DIR:NUMBER'), &
    option_t('--at', value='equilibrium|rest|TIME'), &
    option_t('--modes', value='NUMBER'), &
    option_t('--starts', value='NUMBER'), &
    option_t('--range_hz', value='LOW,HIGH'), &
    option_t('--peaks', may_repeat=.true.), &
    option_t('--kind', value='KIND'), &
    option_t('--holzer', may_repeat=.true.), &
    option_t('--code', may_repeat=.true.), &
    option_t('--json', may_repeat=.true.), &
    option_t('--threads', value='NUMBER'), &
    option_t('--compile', value=trim(compile_choices(1)) // '|' // trim(compile_choices(2)) // '|' // trim(compile_choices(3))), &
    option_t('--shard', value='K/N'), &
    option_t('--resume', may_repeat=.true.), &
    option_t('--csv', may_repeat=.true.), &
    option_t('--strict', may_repeat=.true.), &
    option_t('--quiet', short='-q', may_repeat=.true.), &
    option_t('--help', short='-h', may_repeat=.true.)]

  type, public :: arguments_t
    character(len=:), allocatable :: command
    type(string_t), allocatable :: operands(:)       !! files, or the topics of `help`
    type(string_t), allocatable :: overrides(:)      !! PATH=VALUE of every --set
    integer :: threads = 0                           !! of --threads, 0 without it
    integer :: modes = 0                             !! of --modes, 0 without it
    integer :: starts = 0                            !! of --starts, 0 without it
    real(wp) :: range_hz(2) = 0.0_wp                 !! of --range_hz [Hz]
    integer :: shard = 0, shards = 0                 !! of --shard, 0 without it
    type(string_t), allocatable :: names(:)          !! long names of all options, in the order of the command line
    type(string_t), allocatable :: values(:)         !! of these options, '' if an option takes none
  contains
    procedure :: is_given, value
  end type arguments_t

contains

  !> The position of an option in `options`, 0 if none has this name.
  pure integer function option_index(name)
    character(len=*), intent(in) :: name

    do option_index = size(options), 1, -1
      if (options(option_index)%name == name) return
      if (name /= '' .and. options(option_index)%short == name) return
    end do
  end function option_index

  !> Whether an option is on the command line.
  pure logical function is_given(self, name)
    class(arguments_t), intent(in) :: self
    character(len=*), intent(in) :: name   !! long name, e.g. '--quiet'
    integer :: i

    is_given = any([(self%names(i)%text == name, i=1, size(self%names))])
  end function is_given

  !> The value of an option, '' if the option is not on the command line.
  pure function value(self, name)
    class(arguments_t), intent(in) :: self
    character(len=*), intent(in) :: name   !! long name, e.g. '--out'
    character(len=:), allocatable :: value
    integer :: i

    value = ''
    do i = 1, size(self%names)
      if (self%names(i)%text == name) value = self%values(i)%text
    end do
  end function value

end module nocdyn_arguments
