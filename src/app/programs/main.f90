!> The program nocdyn, dynamics of drivetrains from namelist files.
program nocdyn
  use nocdyn_analysis_commands, only: equilibrium_command, modes_command
  use nocdyn_arguments, only: arguments_t, command_line, parse_arguments
  use nocdyn_commands, only: check_command, help_command, matrices_command, new_command, version_command
  use nocdyn_console, only: report_error, output_is_lost
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_posix, only: ignore_file_size_signal
  use nocdyn_run_command, only: run_command
  use nocdyn_companion_programs, only: exec_companion
  implicit none (type, external)

  type(arguments_t) :: arguments
  type(error_t), allocatable :: error
  integer :: code

  call ignore_file_size_signal()
  call parse_arguments(command_line(), arguments, error)
  if (allocated(error)) then
    call report_error(error)
    stop error%code, quiet=.true.
  end if
  select case (arguments%command)
  case ('run')
    call run_command(arguments, code)
  case ('check')
    call check_command(arguments, code)
  case ('equilibrium')
    call equilibrium_command(arguments, code)
  case ('modes')
    call modes_command(arguments, code)
  case ('sweep', 'merge')
    call exec_companion('nocdyn-sweep', error)
    call report_error(error)
    code = error%code
  case ('matrices')
    call matrices_command(arguments, code)
  case ('new')
    call new_command(arguments, code)
  case ('version')
    call version_command(code)
  case default
    call help_command(arguments, code)
  end select
  if (output_is_lost) then
    call raise(error, exit_file, 'standard output cannot be written')
    call report_error(error)
    code = max(code, error%code)
  end if
  stop code, quiet=.true.
end program nocdyn
