!> The program nocdyn, dynamics of drivetrains from namelist files.
program nocdyn
  use nocdyn_command_table, only: list_commands
  use nocdyn_commands, only: command_t
  use nocdyn_processor_levels, only: become_faster
  use nocdyn_program, only: run_program
  implicit none (type, external)

  type(command_t), allocatable :: commands(:)
  integer :: code

  call become_faster()
  call list_commands(commands)
  call run_program('nocdyn', '', commands, .true., code)
  stop code, quiet=.true.
end program nocdyn
