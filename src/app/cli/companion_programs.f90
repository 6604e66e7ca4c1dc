!> Programs that stand beside this one.
module nocdyn_companion_programs
  use nocdyn_arguments, only: command_line
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_posix_programs, only: program_folder, exec_program
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: exec_companion

contains

  !> Goes on as another program with the same words on its command line. Returns only if that cannot be done.
  subroutine exec_companion(name, error)
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: failure, path
    logical :: is_there

    path = program_folder() // name
    inquire (file=path, exist=is_there)
    if (is_there) then
      call exec_program(path, command_line(), failure)
      call raise(error, exit_file, quoted(path) // ' cannot be started: ' // failure)
    else
      call raise(error, exit_file, quoted(path) // ' is not there: this program for sweeps is built beside nocdyn by ' // &
                 'cmake --build --preset release, unless -DNOCDYN_SWEEP=OFF leaves it out')
    end if
  end subroutine exec_companion

end module nocdyn_companion_programs
