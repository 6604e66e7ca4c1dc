!> A sweep from its command line to its results: the steps that nocdyn-sweep and nocdyn-mpi have in common.
module nocdyn_sweep_job
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_arguments, only: arguments_t
  use nocdyn_case_choice, only: choose_case, wanted_case
  use nocdyn_console, only: report_error, new_status_line, print_text, status_line_t
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t, exit_done, exit_failed, exit_file, exit_input, raise
  use nocdyn_hand_out, only: hand_out_t
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_journal_scheduler, only: journal_scheduler_t, schedule_missing
  use nocdyn_kinds, only: wp
  use nocdyn_number_ranges, only: range_t
  use nocdyn_result_folders, only: result_folder
  use nocdyn_run_files, only: check_variants
  use nocdyn_scheduler, only: sweep_counts_t, sweep_progress_t
  use nocdyn_sweep, only: prepare_sweep, sweep_setup_t
  use nocdyn_sweep_code, only: sweep_code_t
  use nocdyn_sweep_csv, only: sweep_csv_name
  use nocdyn_sweep_differences, only: header_difference
  use nocdyn_sweep_header, only: sweep_header_t, sweep_netcdf_name
  use nocdyn_sweep_journal, only: continue_journal, create_journal, is_of_rank, journal_name, journal_names, missing_variants, &
    open_journal, sweep_journal_t
  use nocdyn_sweep_plan, only: add_plan_diagnostics, make_plan, new_sweep_header, sweep_plan_t
  use nocdyn_sweep_provenance, only: read_provenance
  use nocdyn_sweep_results, only: print_results, write_results
  use nocdyn_sweep_summary, only: sweep_effort_t, sweep_summary_t
  use nocdyn_text, only: append, joined, rounded_text, shown_path, string_t, strings, to_text
  implicit none (type, external)
  private

  public :: start_job, finish_job, print_code_note

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
    type(sweep_journal_t), allocatable :: journals(:)   !! the first one is the one of this process, the others are of ranks
    type(hand_out_t) :: variants                        !! that no journal holds
    type(sweep_counts_t) :: counts                      !! of the journals
    type(console_sweep_progress_t) :: progress
    logical :: is_done = .false.   !! whether there is nothing to compute or write
  end type sweep_job_t

  integer, parameter :: max_listed = 3   ! names

contains

  !> Reads the input, plans the sweep, and creates the journal or opens one to resume.
  subroutine start_job(arguments, job, error)
    type(arguments_t), intent(in) :: arguments
    type(sweep_job_t), intent(out) :: job
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: input
    type(sweep_header_t) :: header
    integer :: i

    if (arguments%shards > 1 .and. arguments%is_given('--csv')) then
      call raise(error, exit_input, '--csv and --shard: a part of a sweep has no table; ' // &
                 'nocdyn merge DIR --csv writes that of all parts')
      return
    end if
    job%arguments = arguments
    call read_machine(arguments, input, job%folder, error)
    if (.not. allocated(error)) call make_plan(input, job%plan, error)
    if (.not. allocated(error)) call prepare_sweep(job%plan, job%setup, error)
    if (allocated(error)) return
    if (arguments%shards > job%plan%design%variants) then
      call raise(error, exit_input, '--shard ' // to_text(arguments%shard) // '/' // to_text(arguments%shards) // &
                 ': the sweep has ' // to_text(job%plan%design%variants) // ' variants; allowed: at most as many parts')
      return
    end if
    header = new_sweep_header(job%plan, max(1, arguments%shard), max(1, arguments%shards))
    call prepare_journal(job, header, error)
    if (allocated(error) .or. job%is_done) return
    do i = 1, merge(0, size(job%plan%notes), arguments%is_given('--quiet'))
      call print_text(job%plan%input%shown_file() // ': note: ' // job%plan%notes(i)%text)
    end do
    job%progress%title = job%plan%input%shown_file()
    job%progress%line = new_status_line(arguments%is_given('--quiet'), shows_in_logs=.true.)
  end subroutine start_job

  !> Reads the machine of the sweep, or the one of its load case, and finds the folder of the results.
  subroutine read_machine(arguments, input, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(out) :: input
    character(len=:), allocatable, intent(out) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(input_t), allocatable :: load_cases(:)
    type(diagnostics_t) :: diagnostics
    integer :: chosen

    call read_input(arguments%operands(1)%text, arguments%overrides, input, error, diagnostics, load_cases, &
                    wanted_case(arguments))
    if (allocated(error)) call add_plan_diagnostics(input, diagnostics, error)
    if (.not. allocated(error)) call choose_case(arguments, input, chosen, error)
    if (allocated(error)) return
    folder = result_folder(arguments, input)
    if (chosen == 0) return
    folder = folder // '/' // load_cases(chosen)%load_case%name // '/sweep'   ! beside the results of its run
    input = load_cases(chosen)
  end subroutine read_machine

  !> Opens the journal of the folder if there is one; else creates it, unless the sweep is done already.
  subroutine prepare_journal(job, header, error)
    type(sweep_job_t), intent(inout) :: job
    type(sweep_header_t), intent(in) :: header
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    real(wp) :: bytes

    call find_journals(job%folder, journal_name(max(1, job%arguments%shard), max(1, job%arguments%shards)), names, bytes)
    call check_variants(job%plan, header%last - header%first + 1, job%arguments%is_given('--csv'), job%folder, bytes, error)
    if (allocated(error)) return
    if (bytes > 0) then
      call resume_journals(job, names, header, error)
    else
      if (job%arguments%is_given('--resume')) call check_finished_results(job, header, error)
      if (allocated(error) .or. job%is_done) return
      call refuse_other_journals(job%folder, job%arguments%shards, error)
      if (allocated(error)) return
      if (job%arguments%is_given('--resume') .and. .not. job%arguments%is_given('--quiet')) then
        call print_text(job%plan%input%shown_file() // ': ' // shown_path(job%folder) // ' holds nothing to resume; ' // &
                        'the sweep starts from the beginning')
      end if
      allocate (job%journals(1))
      call create_journal(job%folder, names(1)%text, header, job%journals(1), error)
    end if
    if (.not. allocated(error)) call schedule_missing(job%journals, job%variants, job%counts)
  end subroutine prepare_journal

  !> The journals of this sweep, or of this shard, in a folder.
  subroutine find_journals(folder, own, names, bytes)
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: own                    !! journal of this process
    type(string_t), allocatable, intent(out) :: names(:)   !! that one first, though it may not exist, then the ones of ranks
    real(wp), intent(out) :: bytes                         !! of all of them
    type(string_t), allocatable :: others(:)
    integer(int64) :: size_of_file
    integer :: i
    logical :: is_there

    allocate (names, source=strings([own]))
    inquire (file=folder // '/' // own, exist=is_there, size=size_of_file)
    bytes = merge(real(size_of_file, wp), 0.0_wp, is_there)
    if (own /= journal_name(1, 1)) return
    allocate (others, source=journal_names(folder))
    do i = 1, size(others)
      if (.not. is_of_rank(others(i)%text)) cycle
      inquire (file=folder // '/' // others(i)%text, size=size_of_file)
      if (size_of_file == 0) cycle
      call append(names, others(i)%text)
      bytes = bytes + real(size_of_file, wp)
    end do
  end subroutine find_journals

  !> Opens the journals of a sweep to continue it.
  subroutine resume_journals(job, names, header, error)
    type(sweep_job_t), intent(inout) :: job
    type(string_t), intent(in) :: names(:)   !! the one of this process first, which is created if it does not exist
    type(sweep_header_t), intent(in) :: header
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: file
    integer :: i

    allocate (job%journals(size(names)))
    call continue_journal(job%folder, names(1)%text, header, job%journals(1), error)
    if (.not. allocated(error)) call open_rank_journals(job, names, header, error)
    if (allocated(error)) return
    if (.not. job%arguments%is_given('--resume')) then
      call refuse_unfinished(job%journals, error)
    else if (.not. job%arguments%is_given('--quiet')) then
      ! Prints how many variants of a resumed journal are reused. The ones of an entry that was not completely written, or is
      ! damaged, are computed again.
      file = job%plan%input%shown_file()
      associate (journals => job%journals, header => job%journals(1)%header)
        do i = 1, size(journals)
          if (journals(i)%damaged_bytes == 0) cycle
          call print_text(file // ': note: ' // shown_path(journals(i)%file%path) // &
                          ' has damaged entries; their variants are computed again')
        end do
        call print_text(file // ': reusing ' // to_text(sum(journals%done + journals%refused + journals%failed)) // ' of ' // &
                        to_text(header%last - header%first + 1) // ' variants from ' // journals_text(journals))
      end associate
    end if
  end subroutine resume_journals

  !> Opens the journals of ranks, and closes them again: their ranks append to them. The ones of another sweep are an error.
  subroutine open_rank_journals(job, names, header, error)
    type(sweep_job_t), intent(inout) :: job                !! with the journal of this process
    type(string_t), intent(in) :: names(:)                 !! that one first
    type(sweep_header_t), intent(in) :: header             !! of the sweep
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    call check_journal(job%journals(1), header, error)
    do i = 2, size(names)
      if (.not. allocated(error)) call open_journal(job%folder, names(i)%text, job%journals(i), error)
      if (.not. allocated(error)) call check_journal(job%journals(i), header, error)
      if (allocated(error)) return
      call job%journals(i)%file%close()
    end do
  end subroutine open_rank_journals

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

  !> Says why the series have no program, if that was asked for.
  subroutine print_code_note(job, code)
    type(sweep_job_t), intent(inout) :: job
    type(sweep_code_t), intent(in) :: code
    character(len=:), allocatable :: reason

    call code%unmet_wish(reason)
    if (reason == '' .or. job%arguments%is_given('--quiet')) return
    call job%progress%line%clear()
    call print_text(job%plan%input%shown_file() // ': note: no program was compiled for the series: ' // reason)
  end subroutine print_code_note

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
      if (ranks > 1) call gather_journals(job, error)
      if (.not. allocated(error)) call make_results(job, summary, code, error)
    end if
    call job%journals(1)%file%close()
    if (.not. allocated(error)) return
    if (error%code == exit_file) error%message = error%message // '; when it can be written, repeat the ' // &
                                                 'command with --resume to continue'
    call report_error(error, code)
  end subroutine finish_job

  !> Writes the results of all journals, removes these, and prints the results.
  subroutine make_results(job, summary, code, error)
    type(sweep_job_t), intent(inout) :: job
    type(sweep_summary_t), intent(inout) :: summary   !! with the effort
    integer, intent(inout) :: code
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    call write_results(job%plan, job%folder, job%journals, job%arguments, summary, error)
    if (allocated(error)) return
    do i = 1, size(job%journals)
      call job%journals(i)%file%remove()   ! before printing: if the reader of the output is gone, printing ends the program
    end do
    call print_results(job%plan, job%folder, job%journals(1)%header, job%arguments, summary, code)
  end subroutine make_results

  !> Opens the journals that ranks have written. Those that rank 0 does not see are an error.
  subroutine gather_journals(job, error)
    type(sweep_job_t), intent(inout) :: job
    type(error_t), allocatable, intent(out) :: error
    type(sweep_header_t) :: header
    type(string_t), allocatable :: names(:)
    type(range_t), allocatable :: missing(:)
    real(wp) :: bytes

    header = job%journals(1)%header
    call job%journals(1)%file%close()
    deallocate (job%journals)
    call find_journals(job%folder, journal_name(1, 1), names, bytes)
    allocate (job%journals(size(names)))
    call open_journal(job%folder, names(1)%text, job%journals(1), error)
    if (.not. allocated(error)) call open_rank_journals(job, names, header, error)
    if (allocated(error)) return
    call missing_variants(job%journals, header, missing)
    if (size(missing) == 0) return
    call raise(error, exit_file, shown_path(job%folder) // ': not all journals of the ranks are there; it must be on a file ' // &
               'system that all of them share')
  end subroutine gather_journals

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

  !> Refuses a journal of another sweep.
  subroutine check_journal(journal, header, error)
    type(sweep_journal_t), intent(in) :: journal
    type(sweep_header_t), intent(in) :: header            !! of the requested sweep
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: difference

    difference = change(journal%header, header)
    if (difference == '' .and. (journal%header%first /= header%first .or. journal%header%last /= header%last)) then
      difference = 'it holds the variants ' // to_text(journal%header%first) // ' to ' // to_text(journal%header%last) // &
                   ', not ' // to_text(header%first) // ' to ' // to_text(header%last)
    end if
    if (difference /= '') then
      call raise(error, exit_input, shown_path(journal%file%path) // ' belongs to another sweep: ' // difference // &
                 '; remove it, or choose another folder with --out')
    end if
  end subroutine check_journal

  !> Refuses to begin a sweep that journals hold a part of.
  subroutine refuse_unfinished(journals, error)
    type(sweep_journal_t), intent(in) :: journals(:)   !! of the sweep or of the shard
    type(error_t), allocatable, intent(out) :: error
    integer :: held, wanted

    held = sum(journals%done + journals%refused + journals%failed)
    wanted = journals(1)%header%last - journals(1)%header%first + 1
    if (held == wanted .and. wanted < journals(1)%header%variants) then
      call raise(error, exit_input, journals_text(journals) // ' holds all ' // to_text(wanted) // ' variants of this part, ' // &
                 'which nocdyn merge uses; to compute them again, remove it')
    else
      call raise(error, exit_input, journals_text(journals) // trim(merge(' holds ', ' hold  ', size(journals) == 1)) // ' ' // &
                 to_text(held) // ' of ' // to_text(wanted) // ' variants of an unfinished sweep; continue it with ' // &
                 '--resume, or remove ' // trim(merge('it  ', 'them', size(journals) == 1)))
    end if
  end subroutine refuse_unfinished

  !> "out/sweep.journal and 2 of ranks".
  function journals_text(journals) result(text)
    type(sweep_journal_t), intent(in) :: journals(:)
    character(len=:), allocatable :: text

    text = shown_path(journals(1)%file%path)
    if (size(journals) > 1) text = text // ' and ' // to_text(size(journals) - 1) // ' of ranks'
  end function journals_text

  !> The first difference between what a folder holds and the requested sweep; '' if there is none.
  function change(old, new) result(text)
    type(sweep_header_t), intent(in) :: old, new
    character(len=:), allocatable :: text

    text = header_difference(old, new, 'it was started by ' // old%source // ', this is ' // new%source, &
                             'the input has changed: ', 'the file of &sweep with the variants has changed')
  end function change

  !> Refuses journals of a whole sweep and of parts in one folder: `nocdyn merge` would use all of them.
  subroutine refuse_other_journals(folder, shards, error)
    character(len=*), intent(in) :: folder
    integer, intent(in) :: shards                         !! of the requested sweep; at most 1: the whole sweep
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: whole
    integer :: i

    whole = journal_name(1, 1)
    allocate (names, source=journal_names(folder))
    do i = 1, size(names)
      if ((names(i)%text == whole .or. is_of_rank(names(i)%text)) .eqv. shards <= 1) cycle
      if (shards > 1) then
        call raise(error, exit_input, shown_path(folder) // ' holds the journal of a whole sweep, ' // names(i)%text // &
                   '; continue it with --resume and without --shard, remove it, or choose another folder with --out')
      else
        call raise(error, exit_input, shown_path(folder) // ' holds journals of parts of a sweep: ' // &
                   joined(names, ', ', max_listed) // &
                   '; continue them with --shard, remove them, or choose another folder with --out')
      end if
      return
    end do
  end subroutine refuse_other_journals

  !> Refuses results of another sweep in the folder.
  subroutine check_results(folder, header, error)
    character(len=*), intent(in) :: folder
    type(sweep_header_t), intent(in) :: header            !! of the requested sweep
    type(error_t), allocatable, intent(out) :: error
    type(sweep_header_t) :: old
    character(len=:), allocatable :: difference

    call read_provenance(folder, old, error)
    if (allocated(error)) return
    difference = change(old, header)
    if (difference /= '') call raise(error, exit_input, shown_path(folder) // ' holds the results of another sweep: ' // &
                                     difference // '; without --resume they are replaced')
  end subroutine check_results

end module nocdyn_sweep_job
