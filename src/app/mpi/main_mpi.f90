!> The program nocdyn-mpi, sweeps on all ranks of an MPI job.
program nocdyn_mpi_program
  use mpi_f08, only: mpi_comm_rank, mpi_comm_world, mpi_finalize, mpi_init_thread, mpi_thread_serialized
  use nocdyn_command_table, only: list_commands
  use nocdyn_commands, only: command_index, command_t, remove_procedures
  use nocdyn_mpi_command, only: mpi_command
  use nocdyn_mpi_messages, only: root
  use nocdyn_program, only: run_program
  implicit none (type, external)

  type(command_t), allocatable :: commands(:)
  integer :: code, provided, rank

  call mpi_init_thread(mpi_thread_serialized, provided)
  call mpi_comm_rank(mpi_comm_world, rank)
  call list_commands(commands)
  call remove_procedures(commands)
  commands(command_index(commands, 'sweep'))%run => mpi_command
  call run_program('nocdyn-mpi', 'sweep', commands, rank == root, code)
  call mpi_finalize()
  stop code, quiet=.true.
end program nocdyn_mpi_program
