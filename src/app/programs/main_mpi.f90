!> The program nocdyn-mpi, sweeps on all ranks of an MPI job.
program nocdyn_mpi_program
  use mpi_f08, only: mpi_comm_rank, mpi_comm_world, mpi_finalize, mpi_init_thread, mpi_thread_serialized
  use nocdyn_arguments, only: arguments_t, command_line, parse_arguments
  use nocdyn_commands, only: help_command, version_command
  use nocdyn_console, only: report_error, output_is_lost
  use nocdyn_errors, only: error_t, exit_file, exit_input, raise
  use nocdyn_mpi_command, only: mpi_command
  use nocdyn_mpi_messages, only: root
  use nocdyn_posix, only: ignore_file_size_signal
  use nocdyn_text, only: append
  implicit none (type, external)

  type(arguments_t) :: arguments
  type(error_t), allocatable :: error
  integer :: code, provided, rank

  call mpi_init_thread(mpi_thread_serialized, provided)
  call mpi_comm_rank(mpi_comm_world, rank)
  call ignore_file_size_signal()
  call parse_arguments(command_line(), arguments, error)
  if (.not. allocated(error)) then
    if (.not. any(arguments%command == ['sweep  ', 'help   ', 'version'])) then
      call raise(error, exit_input, "nocdyn-mpi knows the command 'sweep' only; everything else is asked of nocdyn")
    else if (arguments%shards > 0) then
      call raise(error, exit_input, '--shard is an option of nocdyn sweep; nocdyn-mpi hands out the variants itself')
    else if (arguments%threads > 1 .and. provided < mpi_thread_serialized) then
      call raise(error, exit_input, '--threads above 1 needs an MPI that threads may call in turn')
    end if
  end if
  code = 0
  if (.not. allocated(error)) then
    select case (arguments%command)
    case ('help')
      if (size(arguments%operands) == 0) call append(arguments%operands, 'sweep')
      if (rank == root) call help_command(arguments, code)
    case ('version')
      if (rank == root) call version_command(code)
    case default
      call mpi_command(arguments, code)
    end select
  else if (rank == root) then
    call report_error(error)
    code = error%code
  end if
  if (output_is_lost) then
    call raise(error, exit_file, 'standard output cannot be written')
    call report_error(error)
    code = max(code, error%code)
  end if
  call mpi_finalize()
  stop code, quiet=.true.
end program nocdyn_mpi_program
