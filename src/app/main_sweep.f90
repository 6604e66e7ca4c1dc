!> nocdyn-sweep: what nocdyn becomes for the commands sweep and merge. It links NetCDF, whose libraries nocdyn would
!> have to load for every other command.
program nocdyn_sweep_program
  use nocdyn_arguments, only: arguments_t, command_line, parse_arguments
  use nocdyn_console, only: complain, output_is_lost
  use nocdyn_errors, only: error_t, exit_file, exit_input, raise
  use nocdyn_merge_command, only: merge_command
  use nocdyn_posix, only: survive_size_limit
  use nocdyn_sweep_command, only: sweep_command
  implicit none (type, external)

  type(arguments_t) :: arguments
  type(error_t), allocatable :: error
  integer :: code

  call survive_size_limit()
  call parse_arguments(command_line(), arguments, error)
  if (.not. allocated(error) .and. arguments%command /= 'sweep' .and. arguments%command /= 'merge') then
    call raise(error, exit_input, "nocdyn-sweep knows 'sweep' and 'merge' only; everything else is asked of nocdyn")
  end if
  if (allocated(error)) then
    call complain(error)
    stop error%code, quiet=.true.
  end if
  if (arguments%command == 'sweep') then
    call sweep_command(arguments, code)
  else
    call merge_command(arguments, code)
  end if
  if (output_is_lost) then
    call raise(error, exit_file, 'standard output cannot be written')
    call complain(error)
    code = max(code, error%code)
  end if
  stop code, quiet=.true.
end program nocdyn_sweep_program
