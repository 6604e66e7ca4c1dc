!> The program nocdyn-sweep, which nocdyn executes for the commands sweep and merge. Only this program loads the libraries of
!> NetCDF, which take milliseconds to load.
program nocdyn_sweep_program
  use nocdyn_arguments, only: arguments_t, command_line, parse_arguments
  use nocdyn_commands, only: help_command, version_command
  use nocdyn_console, only: report_error, output_is_lost
  use nocdyn_errors, only: error_t, exit_file, exit_input, raise
  use nocdyn_merge_command, only: merge_command
  use nocdyn_posix, only: ignore_file_size_signal
  use nocdyn_sweep_command, only: sweep_command
  use nocdyn_text, only: append
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
  case ('sweep')
    call sweep_command(arguments, code)
  case ('merge')
    call merge_command(arguments, code)
  case ('help')
    if (size(arguments%operands) == 0) call append(arguments%operands, 'sweep')
    call help_command(arguments, code)
  case ('version')
    call version_command(code)
  case default
    call raise(error, exit_input, "nocdyn-sweep knows 'sweep' and 'merge' only; everything else is asked of nocdyn")
    call report_error(error)
    stop error%code, quiet=.true.
  end select
  if (output_is_lost) then
    call raise(error, exit_file, 'standard output cannot be written')
    call report_error(error)
    code = max(code, error%code)
  end if
  stop code, quiet=.true.
end program nocdyn_sweep_program
