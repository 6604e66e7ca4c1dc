!> What another program beside this one does: the commands sweep and merge, and runs and responses that write NetCDF.
module nocdyn_companion_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_command_line, only: command_line
  use nocdyn_console, only: report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, raise
  use nocdyn_posix_programs, only: exec_program, program_file, program_folder
  use nocdyn_processor_levels, only: level_of
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: become_companion, companion_command

contains

  !> A command of the companion.
  subroutine companion_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code

    call become_companion('nocdyn ' // arguments%command, code)
  end subroutine companion_command

  !> Replaces this program by nocdyn-sweep with the same command line. Returns only if that fails.
  subroutine become_companion(purpose, code)
    character(len=*), intent(in) :: purpose   !! what the program is for, for the message
    integer, intent(out) :: code
    type(error_t), allocatable :: error
    character(len=:), allocatable :: failure, path
    logical :: exists

    path = program_folder() // 'nocdyn-sweep' // level_of(program_file())
    inquire (file=path, exist=exists)
    if (exists) then
      call exec_program(path, command_line(), failure)
      call raise(error, exit_file, quoted(path) // ' cannot be started: ' // failure)
    else
      call raise(error, exit_file, quoted(path) // ', the program for ' // purpose // ', does not exist; ' // &
                 'cmake --build --preset release builds it beside nocdyn, unless -DNOCDYN_SWEEP=OFF is set')
    end if
    code = exit_done
    call report_error(error, code)
  end subroutine become_companion

end module nocdyn_companion_command
