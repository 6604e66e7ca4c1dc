!> The program nocdyn-sweep, which nocdyn executes for the commands sweep and merge, and for runs and responses that write NetCDF.
!> Only this program loads the libraries of NetCDF, which take milliseconds to load.
program nocdyn_sweep_program
  use nocdyn_command_table, only: list_commands
  use nocdyn_commands, only: command_index, command_t, remove_procedures
  use nocdyn_merge_command, only: merge_command
  use nocdyn_optimise_command, only: optimise_command
  use nocdyn_processor_levels, only: become_faster
  use nocdyn_program, only: run_program
  use nocdyn_sweep_command, only: respond_netcdf_command, run_netcdf_command, sweep_command
  implicit none (type, external)

  type(command_t), allocatable :: commands(:)
  integer :: code

  call become_faster()
  call list_commands(commands)
  call remove_procedures(commands)
  commands(command_index(commands, 'run'))%run => run_netcdf_command
  commands(command_index(commands, 'response'))%run => respond_netcdf_command
  commands(command_index(commands, 'sweep'))%run => sweep_command
  commands(command_index(commands, 'merge'))%run => merge_command
  commands(command_index(commands, 'optimise'))%run => optimise_command
  call run_program('nocdyn-sweep', 'sweep', commands, .true., code)
  stop code, quiet=.true.
end program nocdyn_sweep_program
