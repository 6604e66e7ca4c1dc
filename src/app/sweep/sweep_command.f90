!> nocdyn sweep: computes all variants of a machine in one process.
module nocdyn_sweep_command
  use nocdyn_analysis_command, only: analyse
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: report_error
  use nocdyn_errors, only: error_t, exit_done
  use nocdyn_grid_netcdf, only: netcdf_grid_t
  use nocdyn_journal_scheduler, only: initialise_scheduler, journal_scheduler_t
  use nocdyn_posix, only: catch_interrupts
  use nocdyn_run_command, only: run_inputs
  use nocdyn_sweep, only: compute_variants
  use nocdyn_sweep_code, only: new_sweep_code, sweep_code_t
  use nocdyn_sweep_job, only: finish_job, print_code_note, start_job, sweep_job_t
  use nocdyn_sweep_threads, only: usable_threads, refuse_ranks, print_thread_note
  use nocdyn_trajectory_netcdf, only: netcdf_trajectory_t
  use omp_lib, only: omp_get_max_threads
  implicit none (type, external)
  private

  public :: respond_netcdf_command, run_netcdf_command, sweep_command

contains

  !> Computes the missing variants of a sweep and writes its results.
  subroutine sweep_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(sweep_job_t), target :: job
    type(journal_scheduler_t) :: scheduler
    type(sweep_code_t) :: program_code
    type(error_t), allocatable :: error
    integer :: threads

    code = exit_done
    call catch_interrupts()
    call refuse_ranks(arguments, error)
    if (.not. allocated(error)) call start_job(arguments, job, error)
    if (allocated(error)) then
      call report_error(error, code)
      return
    end if
    if (job%is_done) return
    threads = usable_threads(thread_count(arguments))
    if (.not. arguments%is_given('--quiet')) call print_thread_note(job%plan%input%shown_file(), thread_count(arguments))
    call initialise_scheduler(scheduler, job%journals(1), threads, job%setup%lanes)
    call scheduler%begin(job%variants, job%counts, job%progress)
    program_code = new_sweep_code(arguments%value('--compile'), int(job%variants%left))
    call compute_variants(job%plan, job%setup, threads, scheduler, program_code)
    call print_code_note(job, program_code)
    call finish_job(job, scheduler, threads, 1, code)
  end subroutine sweep_command

  !> The number of threads: of --threads, else of OMP_NUM_THREADS, else the number of cores that the process may use.
  integer function thread_count(arguments)
    type(arguments_t), intent(in) :: arguments

    thread_count = arguments%threads
    if (thread_count == 0) thread_count = omp_get_max_threads()
  end function thread_count

  !> Computes the forced responses of all files.
  subroutine respond_netcdf_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse(arguments, code, netcdf_grid_t())
  end subroutine respond_netcdf_command

  !> Runs all files.
  subroutine run_netcdf_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call run_inputs(arguments, code, netcdf_trajectory_t())
  end subroutine run_netcdf_command

end module nocdyn_sweep_command
