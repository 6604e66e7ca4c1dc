!> What a command line says: the command, its operands and its options.
module nocdyn_arguments
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, public :: given_option_t
    character(len=:), allocatable :: name    !! long name
    character(len=:), allocatable :: value   !! '' if the option takes none
  end type given_option_t

  type, public :: arguments_t
    character(len=:), allocatable :: command
    type(string_t), allocatable :: operands(:)       !! files, or the topics of `help`
    type(string_t), allocatable :: overrides(:)      !! PATH=VALUE of every --set
    integer :: threads = 0                           !! of --threads, 0 without it
    integer :: shard = 0, shards = 0                 !! of --shard, 0 without it
    type(given_option_t), allocatable :: given(:)    !! every option, in the order of the command line
  contains
    procedure :: is_given
    procedure :: value
  end type arguments_t

contains

  !> Whether an option is on the command line.
  pure logical function is_given(self, name)
    class(arguments_t), intent(in) :: self
    character(len=*), intent(in) :: name   !! long name, e.g. '--quiet'
    integer :: i

    is_given = .false.
    do i = 1, size(self%given)
      if (self%given(i)%name == name) is_given = .true.
    end do
  end function is_given

  !> The value of an option, '' if the option is not on the command line.
  pure function value(self, name)
    class(arguments_t), intent(in) :: self
    character(len=*), intent(in) :: name   !! long name, e.g. '--out'
    character(len=:), allocatable :: value
    integer :: i

    value = ''
    do i = 1, size(self%given)
      if (self%given(i)%name == name) value = self%given(i)%value
    end do
  end function value

end module nocdyn_arguments
