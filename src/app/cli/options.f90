!> The options of the command line. Which commands take them is said in the table of commands.
module nocdyn_options
  implicit none (type, external)
  private

  public :: option_index

  type, public :: option_t
    character(len=9) :: name
    character(len=2) :: short = ''         !! another name, blank if there is none
    character(len=26) :: value = ''        !! what follows the name, blank if the option has no value
    logical :: may_repeat = .false.        !! whether it may be given more than once
  end type option_t

  type(option_t), parameter, public :: options(*) = [ &
    option_t('--out', value='DIR'), &
    option_t('--set', value='PATH=VALUE', may_repeat=.true.), &
    option_t('--at', value='equilibrium|rest|TIME'), &
    option_t('--threads', value='NUMBER'), &
    option_t('--shard', value='K/N'), &
    option_t('--resume', may_repeat=.true.), &
    option_t('--csv', may_repeat=.true.), &
    option_t('--quiet', short='-q', may_repeat=.true.), &
    option_t('--help', short='-h', may_repeat=.true.)]

contains

  !> The position of an option in `options`, 0 if none has this name.
  pure integer function option_index(name)
    character(len=*), intent(in) :: name

    do option_index = size(options), 1, -1
      if (options(option_index)%name == name) return
      if (name /= '' .and. options(option_index)%short == name) return
    end do
  end function option_index

end module nocdyn_options
