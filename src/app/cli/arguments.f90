!> What a command line says: the command, its operands and its options.
module nocdyn_arguments
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  type, public :: arguments_t
    character(len=:), allocatable :: command
    type(string_t), allocatable :: operands(:)       !! files, or the topics of `help`
    type(string_t), allocatable :: overrides(:)      !! PATH=VALUE of every --set
    integer :: threads = 0                           !! of --threads, 0 without it
    integer :: shard = 0, shards = 0                 !! of --shard, 0 without it
    type(string_t), allocatable :: names(:)          !! long names of all options, in the order of the command line
    type(string_t), allocatable :: values(:)         !! of these options, '' if an option takes none
  contains
    procedure :: add
    procedure :: is_given
    procedure :: value
  end type arguments_t

contains

  !> Adds an option.
  subroutine add(self, name, value)
    class(arguments_t), intent(inout) :: self
    character(len=*), intent(in) :: name    !! long name
    character(len=*), intent(in) :: value   !! '' if the option takes none

    call append(self%names, name)
    call append(self%values, value)
  end subroutine add

  !> Whether an option is on the command line.
  pure logical function is_given(self, name)
    class(arguments_t), intent(in) :: self
    character(len=*), intent(in) :: name   !! long name, e.g. '--quiet'
    integer :: i

    is_given = .false.
    do i = 1, size(self%names)
      if (self%names(i)%text == name) is_given = .true.
    end do
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
