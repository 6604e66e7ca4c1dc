!> nocdyn-mpi sweep: computes the variants of a machine on all ranks of an MPI job.
module nocdyn_mpi_command
  use mpi_f08, only: mpi_abort, mpi_comm_rank, mpi_comm_size, mpi_comm_world, mpi_query_thread, mpi_thread_serialized
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input_text
  use nocdyn_input_sources, only: pack_sources, unpack_sources
  use nocdyn_input_text, only: input_text
  use nocdyn_mpi_messages, only: root, broadcast_text
  use nocdyn_mpi_root, only: mpi_root_t
  use nocdyn_mpi_worker, only: mpi_worker_t
  use nocdyn_posix, only: catch_interrupts
  use nocdyn_sweep_code, only: new_sweep_code, sweep_code_t
  use nocdyn_sweep_job, only: print_code_note, start_job, finish_job, sweep_job_t
  use nocdyn_journal_scheduler, only: initialise_scheduler
  use nocdyn_sweep_header, only: sweep_header_t
  use nocdyn_sweep_journal, only: continue_journal, journal_name, rank_journal_name, sweep_journal_t
  use nocdyn_sweep_plan, only: make_plan, new_sweep_header, sweep_plan_t
  use nocdyn_sweep, only: compute_variants, prepare_sweep, sweep_setup_t
  use nocdyn_sweep_threads, only: usable_threads, print_thread_note
  use nocdyn_text, only: shown_path, strings, to_text
  implicit none (type, external)
  private

  public :: mpi_command

contains

  !> Called by all ranks; only rank 0 reads, writes and prints.
  subroutine mpi_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! 0 on all ranks but the root
    type(error_t), allocatable :: error
    integer :: provided, rank

    code = exit_done
    call catch_interrupts()
    call mpi_comm_rank(mpi_comm_world, rank)
    ! refuses --shard, and threads that the MPI library does not support
    call mpi_query_thread(provided)
    if (arguments%shards > 0) then
      call raise(error, exit_input, '--shard is an option of nocdyn sweep; nocdyn-mpi distributes the variants itself')
    else if (arguments%threads > 1 .and. provided < mpi_thread_serialized) then
      call raise(error, exit_input, '--threads above 1 needs an MPI library with MPI_THREAD_SERIALIZED')
    end if
    if (allocated(error)) then
      if (rank == root) call report_error(error, code)
    else if (rank == root) then
      call run_root(arguments, usable_threads(max(1, arguments%threads)), code)
    else
      call run_worker(rank, usable_threads(max(1, arguments%threads)), arguments%value('--compile'), code)
    end if
  end subroutine mpi_command

  !> Rank 0: reads the input, hands out the variants, computes like the other ranks, and makes the results of all journals.
  subroutine run_root(arguments, threads, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: threads   !! of each rank
    integer, intent(out) :: code
    type(sweep_job_t), target :: job
    type(mpi_root_t) :: scheduler
    type(sweep_code_t) :: program_code
    type(error_t), allocatable :: error
    character(len=:), allocatable :: file, sources, text
    integer :: ranks

    code = exit_done
    call start_job(arguments, job, error)
    text = ''
    if (.not. allocated(error) .and. .not. job%is_done) text = input_text(job%plan%input)
    call broadcast_text(text)
    if (allocated(error)) call report_error(error, code)
    if (text == '') return
    file = job%plan%input%file
    if (.not. arguments%is_given('--quiet')) call print_thread_note(job%plan%input%shown_file(), max(1, arguments%threads))
    call pack_sources(job%plan%input, sources)
    call broadcast_text(file)
    call broadcast_text(sources)
    call broadcast_text(job%plan%list_checksum)
    call broadcast_text(job%folder)
    call mpi_comm_size(mpi_comm_world, ranks)
    scheduler%other_ranks = ranks - 1
    call initialise_scheduler(scheduler, job%journals(1), threads, job%setup%lanes)
    call scheduler%begin(job%variants, job%counts, job%progress)
    program_code = new_sweep_code(arguments%value('--compile'), int(job%variants%left))
    call compute_variants(job%plan, job%setup, threads, scheduler, program_code)
    call print_code_note(job, program_code)
    call finish_job(job, scheduler, threads, ranks, code)
  end subroutine run_root

  !> Other ranks: they compute with the input that rank 0 broadcasts and keep journals of their own. The file of a list they read
  !> themselves.
  subroutine run_worker(rank, threads, compile_choice, code)
    integer, intent(in) :: rank, threads
    character(len=*), intent(in) :: compile_choice   !! of --compile
    integer, intent(out) :: code
    type(sweep_code_t) :: program_code
    type(input_t) :: input
    type(sweep_plan_t) :: plan
    type(sweep_setup_t) :: setup
    type(sweep_journal_t), target :: journal
    type(mpi_worker_t) :: worker
    type(error_t), allocatable :: error
    character(len=:), allocatable :: checksum, file, folder, sources, text

    code = exit_done
    call broadcast_text(text)
    if (text == '') return
    call broadcast_text(file)
    call broadcast_text(sources)
    call broadcast_text(checksum)
    call broadcast_text(folder)
    call read_input_text(text, file, strings([character(len=1) ::]), input, error)
    if (.not. allocated(error)) then
      call unpack_sources(sources, input)
      call make_plan(input, plan, error)
    end if
    if (.not. allocated(error)) call prepare_sweep(plan, setup, error)
    if (.not. allocated(error) .and. plan%list_checksum /= checksum) then
      call raise(error, exit_input, file // ': the file of &sweep with the variants differs from that of rank 0')
    end if
    if (allocated(error)) then
      call report_error(error, code)
      call mpi_abort(mpi_comm_world, code)
    end if
    call open_rank_journal(rank, folder, new_sweep_header(plan, 1, 1), journal, worker%error)
    if (allocated(worker%error)) then
      worker%journal => journal
      call worker%finalise()
    else
      call initialise_scheduler(worker, journal, threads, setup%lanes)
      program_code = new_sweep_code(compile_choice, plan%design%variants)
      call compute_variants(plan, setup, threads, worker, program_code)
    end if
  end subroutine run_worker

  !> The journal of a rank above 0, beside the one of rank 0.
  subroutine open_rank_journal(rank, folder, header, journal, error)
    integer, intent(in) :: rank
    character(len=*), intent(in) :: folder
    type(sweep_header_t), intent(in) :: header
    type(sweep_journal_t), intent(out) :: journal
    type(error_t), allocatable, intent(out) :: error
    logical :: is_there

    journal%header = header
    inquire (file=folder // '/' // journal_name(1, 1), exist=is_there)
    if (is_there) then
      call continue_journal(folder, rank_journal_name(rank), header, journal, error)
    else
      call raise(error, exit_file, shown_path(folder) // ': rank ' // to_text(rank) // ' does not find the ' // &
                 journal_name(1, 1) // ' of rank 0 there; the folder must be on a file system that all ranks share')
    end if
  end subroutine open_rank_journal

end module nocdyn_mpi_command
