!> A sweep from its command line to its results: the steps that nocdyn-sweep and nocdyn-mpi have in common.
module nocdyn_sweep_job
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: report_error, new_status_line, print_text, status_line_t
  use nocdyn_errors, only: error_t, exit_done, exit_failed, exit_file, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_kinds, only: wp
  use nocdyn_result_folders, only: result_folder
  use nocdyn_run_files, only: check_variants
  use nocdyn_sweep, only: prepare_sweep, sweep_setup_t
  use nocdyn_sweep_header, only: sweep_netcdf_name, sweep_header_t
  use nocdyn_sweep_journal, only: create_journal, journal_name, open_journal, sweep_journal_t
  use nocdyn_journal_scheduler, only: journal_scheduler_t
  use nocdyn_scheduler, only: sweep_counts_t, sweep_progress_t
  use nocdyn_sweep_plan, only: add_plan_diagnostics, make_plan, new_sweep_header, sweep_plan_t
  use nocdyn_sweep_resumption, only: check_journal, check_results, refuse_other_journals
  use nocdyn_sweep_results, only: print_results, write_results
  use nocdyn_sweep_summary, only: sweep_effort_t, sweep_summary_t
  use nocdyn_sweep_csv, only: sweep_csv_name
  use nocdyn_text, only: rounded_text, shown_path, to_text
  implicit none (type, external)
  private

  public :: start_job, finish_job

  !> "tolerance.nml: 51200 of 100000 variants, 31000 per second, 2 s left, 3 failed"
  type, extends(sweep_progress_t), public :: console_sweep_progress_t
    type(status_line_t) :: line
    character(len=:), allocatable :: title
  contains
    procedure :: update
  end type console_sweep_progress_t

  type, public :: sweep_job_t
    type(arguments_t) :: arguments
    type(sweep_plan_t) :: plan
    character(len=:), allocatable :: folder
    type(sweep_setup_t) :: setup
    type(sweep_journal_t) :: journals(1)
    type(console_sweep_progress_t) :: progress
    logical :: is_done = .false.   !! whether there is nothing to compute or write
  end type sweep_job_t

contains

  !> Reads the input, plans the sweep, and creates the journal or opens one to resume.
  subroutine start_job(arguments, job, error)
    type(arguments_t), intent(in) :: arguments
    type(sweep_job_t), intent(out) :: job
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: input
    type(diagnostics_t) :: diagnostics
    type(sweep_header_t) :: header

    if (arguments%shards > 1 .and. arguments%is_given('--csv')) then
      call raise(error, exit_input, '--csv and --shard: a part of a sweep has no table; ' // &
                 'nocdyn merge DIR --csv writes that of all parts')
      return
    end if
    job%arguments = arguments
    call read_input(arguments%operands(1)%text, arguments%overrides, input, error, diagnostics)
    if (allocated(error)) call add_plan_diagnostics(input, diagnostics, error)
    if (.not. allocated(error)) call make_plan(input, job%plan, error)
    if (.not. allocated(error)) call prepare_sweep(job%plan, job%setup, error)
    if (allocated(error)) return
    job%folder = result_folder(arguments, input)
    if (arguments%shards > job%plan%design%variants) then
      call raise(error, exit_input, '--shard ' // to_text(arguments%shard) // '/' // to_text(arguments%shards) // &
                 ': the sweep has ' // to_text(job%plan%design%variants) // ' variants; allowed: at most as many parts')
      return
    end if
    header = new_sweep_header(job%plan, max(1, arguments%shard), max(1, arguments%shards))
    call prepare_journal(job, header, error)
    if (allocated(error) .or. job%is_done) return
    job%progress%title = job%plan%input%shown_file()
    job%progress%line = new_status_line(arguments%is_given('--quiet'), shows_in_logs=.true.)
  end subroutine start_job

  !> Opens the journal of the folder if there is one; else creates it, unless the sweep is done already.
  subroutine prepare_journal(job, header, error)
    type(sweep_job_t), intent(inout) :: job
    type(sweep_header_t), intent(in) :: header
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: name
    integer(int64) :: bytes
    logical :: is_there

    name = journal_name(max(1, job%arguments%shard), max(1, job%arguments%shards))
    inquire (file=job%folder // '/' // name, exist=is_there, size=bytes)
    call check_variants(job%plan, header%last - header%first + 1, job%arguments%is_given('--csv'), job%folder, &
                        merge(real(bytes, wp), 0.0_wp, is_there), error)
    if (allocated(error)) return
    if (is_there .and. bytes > 0) then
      call open_journal(job%folder, name, job%journals(1), error)
      if (.not. allocated(error)) call check_journal(job%journals(1), header, job%arguments%is_given('--resume'), error)
      if (.not. allocated(error)) call print_journal_state(job)
    else
      if (job%arguments%is_given('--resume')) call check_finished_results(job, header, error)
      if (allocated(error) .or. job%is_done) return
      call refuse_other_journals(job%folder, job%arguments%shards, error)
      if (allocated(error)) return
      if (job%arguments%is_given('--resume') .and. .not. job%arguments%is_given('--quiet')) then
        call print_text(job%plan%input%shown_file() // ': ' // shown_path(job%folder) // ' holds nothing to resume; ' // &
                        'the sweep starts from the beginning')
      end if
      call create_journal(job%folder, name, header, job%journals(1), error)
    end if
  end subroutine prepare_journal

  !> Without a journal to resume: sets `is_done` if the folder holds the results of this sweep.
  subroutine check_finished_results(job, header, error)
    type(sweep_job_t), intent(inout) :: job
    type(sweep_header_t), intent(in) :: header
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: message
    logical :: has_table

    inquire (file=job%folder // '/' // sweep_netcdf_name, exist=job%is_done)
    job%is_done = job%is_done .and. job%arguments%shards <= 1
    if (.not. job%is_done) return
    call check_results(job%folder, header, error)
    if (allocated(error)) return
    message = job%plan%input%shown_file() // ': all ' // to_text(header%variants) // &
              ' variants are done already; results in ' // shown_path(job%folder)
    inquire (file=job%folder // '/' // sweep_csv_name, exist=has_table)
    if (job%arguments%is_given('--csv') .and. .not. has_table) then
      call raise(error, exit_input, message // ', without ' // sweep_csv_name // '; run without --resume to write it')
    else if (.not. job%arguments%is_given('--quiet')) then
      call print_text(message)
    end if
  end subroutine check_finished_results

  !> Prints how many variants of a resumed journal are reused. Those of an entry that was not completely written, or is
  !> damaged, are computed again.
  subroutine print_journal_state(job)
    type(sweep_job_t), intent(in) :: job
    character(len=:), allocatable :: file

    if (job%arguments%is_given('--quiet')) return
    file = job%plan%input%shown_file()
    associate (journal => job%journals(1))
      if (journal%damaged_bytes > 0) then
        call print_text(file // ': note: ' // shown_path(journal%file%path) // &
                        ' has damaged entries; their variants are computed again')
      end if
      call print_text(file // ': reusing ' // to_text(journal%done + journal%refused + journal%failed) // ' of ' // &
                      to_text(journal%header%last - journal%header%first + 1) // &
                      ' variants from ' // shown_path(journal%file%path))
    end associate
  end subroutine print_journal_state

  !> Writes and prints the results, or says why there are none.
  subroutine finish_job(job, scheduler, threads, ranks, code)
    type(sweep_job_t), intent(inout) :: job
    class(journal_scheduler_t), intent(in) :: scheduler
    integer, intent(in) :: threads   !! of each rank
    integer, intent(in) :: ranks     !! processes
    integer, intent(out) :: code
    type(sweep_summary_t) :: summary
    type(error_t), allocatable :: error

    code = exit_done
    summary%effort = sweep_effort_t(scheduler%counts%new, threads, ranks, job%setup%lanes, job%progress%line%elapsed())
    call job%progress%line%clear()
    if (allocated(scheduler%error)) then
      allocate (error, source=scheduler%error)
    else if (.not. scheduler%is_complete()) then
      associate (counts => scheduler%counts)
        call raise(error, exit_failed, job%plan%input%shown_file() // ': interrupted with ' // &
                   to_text(counts%done + counts%refused + counts%failed) // ' of ' // to_text(counts%total) // &
                   ' variants done; repeat the command with --resume to continue')
      end associate
    else if (job%arguments%shards > 1) then
      if (.not. job%arguments%is_given('--quiet')) call print_text(job%plan%input%shown_file() // ': part ' // &
        to_text(job%arguments%shard) // ' of ' // to_text(job%arguments%shards) // ' done, ' // &
        to_text(scheduler%counts%total) // ' variants; when all parts are done: nocdyn merge ' // job%folder)
    else
      call write_results(job%plan, job%folder, job%journals, job%arguments, summary, error)
      if (.not. allocated(error)) then
        call job%journals(1)%file%remove()   ! before printing: if the reader of the output is gone, printing ends the program
        call print_results(job%plan, job%folder, job%journals(1)%header, job%arguments, summary, code)
      end if
    end if
    call job%journals(1)%file%close()
    if (.not. allocated(error)) return
    if (error%code == exit_file) error%message = error%message // '; when it can be written, repeat the ' // &
                                                 'command with --resume to continue'
    call report_error(error, code)
  end subroutine finish_job

  !> Shows the line if it is due.
  subroutine update(self, counts)
    class(console_sweep_progress_t), intent(inout) :: self
    type(sweep_counts_t), intent(in) :: counts
    real(wp) :: rate
    integer :: failures, left
    character(len=:), allocatable :: text

    if (.not. self%line%is_due()) return
    rate = counts%new / self%line%elapsed()
    failures = counts%refused + counts%failed
    left = counts%total - counts%done - failures
    text = self%title // ': ' // to_text(counts%total - left) // ' of ' // to_text(counts%total) // ' variants'
    if (counts%new > 0) then
      text = text // ', ' // rounded_text(rate, 3) // ' per second, ' // to_text(int(min(left / rate, 1.0e8_wp)) + 1) // ' s left'
    end if
    if (failures > 0) text = text // ', ' // to_text(failures) // ' failed'
    call self%line%show(text)
  end subroutine update

end module nocdyn_sweep_job
