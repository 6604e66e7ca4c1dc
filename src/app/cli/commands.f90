!> A command as a row of a table: name, operands, options, help and procedure.
module nocdyn_commands
  use nocdyn_arguments, only: arguments_t
  use nocdyn_text, only: append, listed, string_t
  implicit none (type, external)
  private

  public :: add_command, remove_procedures, command_index, command_names, commands_with_option

  !> Options of a command whose words another program reads.
  character(len=*), parameter, public :: passed_on = '...'

  type, public :: command_t
    character(len=:), allocatable :: name
    character(len=:), allocatable :: operands   !! 'FILE...': at least one; 'FILE', 'DIR': exactly one; else in brackets
    character(len=:), allocatable :: options    !! long names, separated by blanks, or `passed_on`; every command has --help
    character(len=:), allocatable :: summary    !! one line
    character(len=:), allocatable :: help       !! lines after the usage
    procedure(command_interface), pointer, nopass :: run => null()   !! not associated: this program does not run it
  contains
    procedure :: takes
  end type command_t

  abstract interface

    !> Runs a command and reports its errors.
    subroutine command_interface(arguments, code)
      import :: arguments_t
      type(arguments_t), intent(in) :: arguments
      integer, intent(out) :: code   !! exit code
    end subroutine command_interface

  end interface

contains

  !> Appends a row.
  subroutine add_command(commands, name, operands, options, summary, help, run)
    type(command_t), allocatable, intent(inout) :: commands(:)
    character(len=*), intent(in) :: name, operands, options, summary, help   !! as in `command_t`
    procedure(command_interface), optional :: run   !! without it, the program itself does the command
    type(command_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(commands)) allocate (commands(0))
    allocate (longer(size(commands) + 1))
    do i = 1, size(commands)
      longer(i) = commands(i)
    end do
    associate (row => longer(size(longer)))
      row%name = name
      row%operands = operands
      row%options = options
      row%summary = summary
      row%help = help
      if (present(run)) row%run => run
    end associate
    call move_alloc(longer, commands)
  end subroutine add_command

  !> Leaves the rows of the table for help, without anything to run.
  subroutine remove_procedures(commands)
    type(command_t), intent(inout) :: commands(:)
    integer :: i

    do i = 1, size(commands)
      commands(i)%run => null()
    end do
  end subroutine remove_procedures

  !> The row of a command, 0 if there is none of this name.
  pure integer function command_index(commands, name)
    type(command_t), intent(in) :: commands(:)
    character(len=*), intent(in) :: name

    do command_index = size(commands), 1, -1
      if (commands(command_index)%name == name) return
    end do
  end function command_index

  !> The names of all commands.
  pure function command_names(commands) result(names)
    type(command_t), intent(in) :: commands(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, size(commands)
      call append(names, commands(i)%name)
    end do
  end function command_names

  !> Whether a command takes an option.
  pure logical function takes(self, option)
    class(command_t), intent(in) :: self
    character(len=*), intent(in) :: option   !! long name

    takes = option == '--help' .or. index(' ' // self%options // ' ', ' ' // option // ' ') > 0
  end function takes

  !> "run, equilibrium and modes", the commands that take an option.
  pure function commands_with_option(commands, option) result(text)
    type(command_t), intent(in) :: commands(:)
    character(len=*), intent(in) :: option   !! long name of an option that one of them takes
    character(len=:), allocatable :: text
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, size(commands)
      if (commands(i)%takes(option)) call append(names, commands(i)%name)
    end do
    text = listed(names, ' and ')
  end function commands_with_option

end module nocdyn_commands
