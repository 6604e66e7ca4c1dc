!> The commands that analyse machines without a run: one driver reads the files, solves, prints and writes.
module nocdyn_analysis_command
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_arguments, only: arguments_t
  use nocdyn_case_choice, only: find_wanted, wanted_case
  use nocdyn_case_results, only: case_result_t, combine_verdicts, put_cases, same_refusal, status_failed, status_refused
  use nocdyn_command_analyses, only: new_command_analysis
  use nocdyn_companion_command, only: become_companion
  use nocdyn_console, only: print_text, report_error
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: add_error, error_t, exit_done, exit_failed, exit_input, raise
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_json, only: json_t
  use nocdyn_signal_checks, only: check_signals
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_parts, only: check_input, refuse_mistakes
  use nocdyn_named_analyses, only: assemble_analysed
  use nocdyn_posix, only: catch_interrupts, is_interrupted, remove_file, stop_at_interrupts
  use nocdyn_result_files, only: result_files_t
  use nocdyn_result_folders, only: out_folder, refuse_shared_folders, result_folder
  use nocdyn_strictness, only: be_strict
  use nocdyn_sweep_plan, only: add_plan_diagnostics, has_sweep, make_plan, sweep_plan_t
  use nocdyn_text, only: append, counted, listed, shown_path, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_variant_choice, only: leave_sweep
  use nocdyn_verdicts, only: verdict_t
  implicit none (type, external)
  private

  public :: analysis_command, analyse

  !> A machine to analyse.
  type :: job_t
    integer :: load_case = 0                  !! which one of the file, 0: the machine itself
    character(len=:), allocatable :: folder   !! of its results, '': nothing is written
    logical :: is_alone = .false.             !! whether it is the only one of its file
  end type job_t

  !> An input file that has been read.
  type :: reading_t
    type(input_t) :: machine                      !! with the load cases of the file
    type(input_t), allocatable :: load_cases(:)
    type(job_t), allocatable :: jobs(:)           !! the machine itself, or load cases
    character(len=:), allocatable :: folder       !! of the file
    type(error_t), allocatable :: error
  end type reading_t

contains

  !> Analyses the machines of all files of the command line.
  subroutine analysis_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse(arguments, code)
  end subroutine analysis_command

  !> Does so in a program that can write NetCDF, if `netcdf` is present, or that has an analysis of its own.
  subroutine analyse(arguments, code, netcdf, kind)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files
    class(grid_file_t), intent(in), optional :: netcdf   !! not open
    class(analysis_t), intent(in), optional :: kind      !! the analysis, before its solution; absent: that of the command
    class(analysis_t), allocatable :: own

    if (present(kind)) then
      call analyse_files(arguments, kind, code, netcdf)
    else
      call new_command_analysis(arguments%command, own)
      call analyse_files(arguments, own, code, netcdf)
    end if
  end subroutine analyse

  !> Analyses every file. Files with errors do not stop the others.
  subroutine analyse_files(arguments, kind, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    class(analysis_t), intent(in) :: kind   !! the analysis, before its solution
    integer, intent(out) :: code
    class(grid_file_t), intent(in), optional :: netcdf   !! as in `analyse`
    type(reading_t), allocatable :: readings(:)
    type(string_t), allocatable :: files(:), folders(:)
    type(error_t), allocatable :: error
    integer :: i, k

    code = exit_done
    allocate (readings(size(arguments%operands)), files(0), folders(0))
    do i = 1, size(readings)
      call read_one(arguments, i, kind%always_writes, readings(i))
      if (allocated(readings(i)%error)) cycle
      do k = 1, size(readings(i)%jobs)
        call append(files, arguments%operands(i)%text)
        call append(folders, readings(i)%jobs(k)%folder)
      end do
    end do
    if (.not. present(netcdf)) then
      call refuse_pipes(arguments, kind, readings)
      if (any([(needs_companion(kind, readings(i)), i=1, size(readings))])) then
        call become_companion("format = 'netcdf'", code)
        return
      end if
    end if
    call refuse_shared_folders(files, folders, error)
    if (allocated(error)) then
      call report_error(error, code)
      return
    end if
    do i = 1, size(readings)
      call analyse_file(arguments, i, kind, readings(i), code, netcdf)
      if (is_interrupted()) exit
    end do
    if (i >= size(readings)) return
    call raise(error, exit_failed, 'files left out after the interruption: ' // to_text(size(readings) - i))
    call report_error(error, code)
  end subroutine analyse_files

  !> Analyses the machine of a file, or its load cases. Cases that fail do not stop the others.
  subroutine analyse_file(arguments, number, kind, reading, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number                       !! of the file
    class(analysis_t), intent(in) :: kind               !! the analysis, before its solution
    type(reading_t), intent(inout) :: reading
    integer, intent(inout) :: code
    class(grid_file_t), intent(in), optional :: netcdf  !! as in `analyse`
    type(case_result_t), allocatable :: results(:)
    character(len=:), allocatable :: words
    integer :: k

    words = shown_path(arguments%operands(number)%text) // ': interrupted, without results'
    if (kind%keeps_journal) then
      call catch_interrupts()
    else
      call stop_at_interrupts('nocdyn: ' // words // new_line('a'))
    end if
    if (allocated(reading%error)) then
      if (arguments%command == 'check') call check_load_cases(kind, reading)
      call report_error(reading%error, code)
      return
    end if
    allocate (results(size(reading%jobs)))
    do k = 1, size(results)
      associate (c => reading%jobs(k)%load_case)
        if (c > 0) results(k)%load_case = reading%load_cases(c)%load_case
      end associate
      if (is_interrupted()) then
        results(k)%status = 'not run'
        cycle
      end if
      associate (job => reading%jobs(k))
        if (job%load_case == 0) then
          call analyse_job(arguments, kind, job, reading%machine, results(k), reading%error, netcdf)
          if (arguments%command == 'check') call check_load_cases(kind, reading)
        else
          call analyse_job(arguments, kind, job, reading%load_cases(job%load_case), results(k), reading%error, netcdf)
        end if
      end associate
      if (is_interrupted() .and. allocated(reading%error) .and. .not. kind%keeps_journal) reading%error%message = words
      if (.not. allocated(reading%error)) cycle
      if (k == 1 .or. .not. same_refusal(results(:k))) call report_error(reading%error, code)
      deallocate (reading%error)
    end do
    if (size(results) > 1 .and. same_refusal(results)) return   ! of the file, which has no results
    call conclude(arguments, reading, results, code)
  end subroutine analyse_file

  !> Analyses one machine.
  subroutine analyse_job(arguments, kind, job, input, result, error, netcdf)
    type(arguments_t), intent(in) :: arguments
    class(analysis_t), intent(in) :: kind
    type(job_t), intent(in) :: job
    type(input_t), intent(in) :: input   !! of the job
    type(case_result_t), intent(inout) :: result
    type(error_t), allocatable, intent(out) :: error
    class(grid_file_t), intent(in), optional :: netcdf     !! as in `analyse`
    type(machine_t) :: machine

    call assemble_analysed(arguments%command, kind, input, machine, error)
    if (.not. allocated(error)) call check_signals(input, machine, error)
    if (.not. allocated(error)) call analyse_one(arguments, kind, job, input, machine, result%verdict, error, netcdf)
    if (.not. allocated(error)) return
    result%status = status_refused
    if (error%code == exit_failed) result%status = status_failed
    result%message = error%message
  end subroutine analyse_job

  !> The verdict of all load cases of a file, printed and written.
  subroutine conclude(arguments, reading, results, code)
    type(arguments_t), intent(in) :: arguments
    type(reading_t), intent(in) :: reading
    type(case_result_t), intent(in) :: results(:)   !! of its inputs
    integer, intent(inout) :: code
    type(verdict_t) :: verdict
    type(text_buffer_t) :: report
    type(error_t), allocatable :: error
    type(result_files_t) :: files
    type(json_t) :: json
    character(len=:), allocatable :: name

    if (size(results) == 1) then
      call be_strict(arguments, reading%machine%shown_file(), results(1)%verdict, code)
      if (reading%jobs(1)%load_case == 0 .or. arguments%is_given('--case')) return
    end if
    call combine_verdicts(arguments%command, results, verdict)
    name = arguments%command // '_cases.json'
    if (reading%folder /= '') then
      call json%open_report(reading%machine%file, reading%machine%title())
      call verdict%put(json)
      call put_cases(json, results)
      call json%close()
      call files%open(reading%folder, [string_t(name)])
      call files%files(1)%put(json%text())
      call files%finish(error)
      if (allocated(error)) call report_error(error, code)
    end if
    if (.not. arguments%is_given('--quiet')) then
      if (size(results) > 1) call verdict%write_table(report)
      if (reading%folder /= '' .and. .not. allocated(error)) then
        call report%append_line(reading%machine%shown_file() // ': ' // counted(size(results), 'load case', 'load cases') // &
                                '; ' // name // ' is in ' // shown_path(reading%folder) // &
                                trim(merge('; --case NAME prints more of one', repeat(' ', 32), size(results) > 1)))
      end if
      call print_text(report%text())
    end if
    if (size(results) > 1) call be_strict(arguments, reading%machine%shown_file(), verdict, code)
  end subroutine conclude

  !> Whether an input is to be analysed, but not by a program that cannot write NetCDF.
  pure logical function needs_companion(kind, reading)
    class(analysis_t), intent(in) :: kind
    type(reading_t), intent(in) :: reading
    integer :: k

    needs_companion = .false.
    if (allocated(reading%error)) return
    do k = 1, size(reading%jobs)
      associate (c => reading%jobs(k)%load_case)
        if (c == 0) needs_companion = kind%grid_name(reading%machine) /= ''
        if (c > 0) needs_companion = kind%grid_name(reading%load_cases(c)) /= ''
      end associate
      if (needs_companion) return
    end do
  end function needs_companion

  !> Refuses inputs that another program would have to read again and cannot.
  subroutine refuse_pipes(arguments, kind, readings)
    type(arguments_t), intent(in) :: arguments
    class(analysis_t), intent(in) :: kind
    type(reading_t), intent(inout) :: readings(:)
    integer :: bytes, i

    do i = 1, size(readings)
      if (.not. needs_companion(kind, readings(i))) cycle
      inquire (file=arguments%operands(i)%text, size=bytes)
      if (bytes <= 0) call raise(readings(i)%error, exit_input, readings(i)%machine%shown_file() // &
                                 ": format = 'netcdf' needs an input that can be read twice, not a pipe")
    end do
  end subroutine refuse_pipes

  !> Analyses one machine, prints the report, and writes the files.
  subroutine analyse_one(arguments, kind, job, input, machine, verdict, error, netcdf)
    type(arguments_t), intent(in) :: arguments
    class(analysis_t), intent(in) :: kind
    type(job_t), intent(in) :: job
    type(input_t), intent(in) :: input   !! of the job
    type(machine_t), intent(in) :: machine
    type(verdict_t), intent(inout) :: verdict
    type(error_t), allocatable, intent(out) :: error
    class(grid_file_t), intent(in), optional :: netcdf   !! as in `analyse`
    class(analysis_t), allocatable :: analysis
    type(analysis_options_t) :: options
    type(string_t), allocatable :: names(:)
    type(text_buffer_t) :: report
    character(len=:), allocatable :: text

    options%at = ''
    if (arguments%is_given('--at')) options%at = arguments%value('--at')
    options%modes = arguments%modes
    options%starts = arguments%starts
    options%has_range = arguments%is_given('--range_hz')
    options%range_hz = arguments%range_hz
    options%has_code = arguments%is_given('--code')
    options%has_peaks = arguments%is_given('--peaks')
    options%has_holzer = arguments%is_given('--holzer')
    options%writes_files = job%folder /= ''
    options%folder = result_folder(arguments, input)
    options%resumes = arguments%is_given('--resume')
    if (kind%keeps_journal) options%journal = job%folder
    allocate (analysis, source=kind)
    call analysis%solve(input, machine, options, error)
    if (allocated(error)) return
    if (allocated(analysis%refusal)) then
      call analysis%text(input, text)
      call print_text(text)
      error = analysis%refusal
      return
    end if
    if (analysis%is_unfinished) then
      call write_unfinished(analysis, input, job%folder, error)
      return
    end if
    call analysis%judge(input)
    if (job%folder /= '' .and. analysis%has_report) then
      call write_files(arguments%command, analysis, input, job%folder, names, error, netcdf)
      if (allocated(error)) return
    end if
    verdict = analysis%verdict
    if (arguments%is_given('--quiet')) return
    if (job%is_alone .or. .not. analysis%always_writes) then   ! tables of one machine, or that are written nowhere
      call verdict%write_table(report)
      call analysis%text(input, text)
      call print_text(report%text() // text)
    end if
    if (analysis%always_writes) call print_text(input%shown_case() // ': ' // shown_path(job%folder) // ' has ' // &
                                                listed(names, ' and '))
  end subroutine analyse_one

  !> Writes the tables of an interrupted analysis in place of those of an earlier one.
  subroutine write_unfinished(analysis, input, folder, error)
    class(analysis_t), intent(in) :: analysis
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(result_files_t), target :: files
    type(string_t), allocatable :: former(:), names(:)
    integer :: i

    call analysis%list_tables(names)
    call files%open(folder, names)
    do i = 1, size(names)
      call analysis%put_table(input, names(i)%text, files%files(i))
    end do
    call files%finish(error)
    if (allocated(error)) return
    allocate (former, source=analysis%other_names(input))
    do i = 1, size(former)
      call remove_file(folder // '/' // former(i)%text)
    end do
    call raise(error, exit_failed, input%shown_case() // ': interrupted; ' // shown_path(folder) // ' has ' // &
               listed(names, ' and ') // '; repeat the command with --resume to continue')
  end subroutine write_unfinished

  !> Writes the tables and the report; removes tables of an earlier analysis that are in another form.
  subroutine write_files(command, analysis, input, folder, names, error, netcdf)
    character(len=*), intent(in) :: command
    class(analysis_t), intent(in) :: analysis   !! solved
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    type(string_t), allocatable, intent(out) :: names(:)   !! of the files
    type(error_t), allocatable, intent(out) :: error
    class(grid_file_t), intent(in), optional :: netcdf     !! as in `analyse`
    class(grid_file_t), allocatable :: grid
    type(result_files_t), target :: files
    type(string_t), allocatable :: former(:)
    type(json_t) :: json
    character(len=:), allocatable :: name
    integer :: i

    call analysis%list_tables(names)
    call append(names, command // '.json')
    call files%open(folder, names)
    do i = 1, size(names) - 1
      call analysis%put_table(input, names(i)%text, files%files(i))
    end do
    call json%write_to(files%files(size(names)))
    call analysis%put_report(input, json)
    name = analysis%grid_name(input)
    if (name /= '') then
      if (.not. present(netcdf)) error stop 'nocdyn_analysis_command: this program does not write NetCDF'
      allocate (grid, source=netcdf)
      call analysis%put_grid(input, folder, grid)
      call grid%complete(name, error)
      if (.not. allocated(error)) call files%complete(error)
      if (.not. allocated(error)) call remove_file(folder // '/' // names(size(names))%text)   ! it comes last
      if (.not. allocated(error)) call grid%finish(name, error)
    end if
    if (.not. allocated(error)) call files%finish(error)
    if (allocated(error)) then
      call files%discard()
      if (allocated(grid)) call grid%discard()
      return
    end if
    allocate (former, source=analysis%other_names(input))
    do i = 1, size(former)
      call remove_file(folder // '/' // former(i)%text)
    end do
    if (name /= '') names = [string_t(name), names]
  end subroutine write_files

  !> Checks the load cases that can be read; if there is no mistake so far, builds their machines.
  subroutine check_load_cases(kind, reading)
    class(analysis_t), intent(in) :: kind
    type(reading_t), intent(inout) :: reading   !! gets the mistakes of all of them
    type(machine_t) :: machine
    type(diagnostics_t) :: known   ! of the machine itself
    type(error_t), allocatable :: own
    integer :: c
    logical :: is_right

    if (.not. allocated(reading%load_cases)) return
    is_right = .not. allocated(reading%error)
    call check_input(reading%machine, known)
    do c = 1, size(reading%load_cases)
      if (.not. allocated(reading%load_cases(c)%groups)) cycle
      call refuse_mistakes(reading%load_cases(c), own, known)
      if (is_right .and. .not. allocated(own)) call assemble_analysed('check', kind, reading%load_cases(c), machine, own)
      call add_error(reading%error, own)
    end do
    if (.not. allocated(reading%error)) call check_sweep(reading)
  end subroutine check_load_cases

  !> Refuses a sweep that neither the machine nor one of its load cases can make.
  subroutine check_sweep(reading)
    type(reading_t), intent(inout) :: reading
    type(error_t), allocatable :: error
    type(sweep_plan_t) :: plan
    integer :: c

    if (.not. has_sweep(reading%machine)) return
    call make_plan(reading%machine, plan, reading%error)
    do c = 1, size(reading%load_cases)
      if (.not. allocated(reading%error)) return
      call make_plan(reading%load_cases(c), plan, error)
      if (.not. allocated(error)) deallocate (reading%error)
    end do
  end subroutine check_sweep

  !> Reads and checks a file, and finds what is analysed and the folders of the results.
  subroutine read_one(arguments, number, always_writes, reading)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number         !! of the file
    logical, intent(in) :: always_writes  !! as of `analysis_t`
    type(reading_t), intent(inout) :: reading
    type(diagnostics_t) :: diagnostics
    type(input_t), allocatable :: load_cases(:)
    type(error_t), allocatable :: own
    integer, allocatable :: wanted(:)
    integer :: k

    reading%folder = out_folder(arguments, arguments%operands(number)%text)
    call read_input(arguments%operands(number)%text, arguments%overrides, reading%machine, reading%error, &
                    diagnostics, load_cases, wanted_case(arguments))
    if (allocated(reading%error)) call add_plan_diagnostics(reading%machine, diagnostics, reading%error)
    if (.not. allocated(reading%error)) call leave_sweep(arguments, reading%machine, load_cases)
    if (.not. allocated(reading%error)) call find_inputs(arguments, reading%machine, wanted, reading%error)
    if (allocated(reading%error)) then
      if (arguments%command == 'check' .and. allocated(load_cases)) then   ! the machine itself can be read
        call refuse_mistakes(reading%machine, reading%error)
        call move_alloc(load_cases, reading%load_cases)
      end if
      return
    end if
    if (always_writes) reading%folder = result_folder(arguments, reading%machine)
    allocate (reading%jobs(max(1, size(wanted))))
    reading%jobs%is_alone = size(reading%jobs) == 1
    call move_alloc(load_cases, reading%load_cases)
    if (size(wanted) == 0) then
      reading%jobs(1)%folder = reading%folder
      call refuse_mistakes(reading%machine, reading%error)
    end if
    do k = 1, size(wanted)
      reading%jobs(k)%load_case = wanted(k)
      associate (input => reading%load_cases(wanted(k)))
        reading%jobs(k)%folder = case_folder(reading%folder, input)
        call refuse_mistakes(input, own)
      end associate
      call add_error(reading%error, own)
    end do
  end subroutine read_one

  !> Which load cases are analysed; `check` and `matrices` look at the machine itself.
  subroutine find_inputs(arguments, machine, wanted, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: machine
    integer, allocatable, intent(out) :: wanted(:)
    type(error_t), allocatable, intent(out) :: error

    if (any(arguments%command == ['check   ', 'matrices']) .and. .not. arguments%is_given('--case')) then
      allocate (wanted(0))
    else
      call find_wanted(arguments, machine, wanted, error)
    end if
  end subroutine find_inputs

  !> The folder of a load case in the one of its file; '' if nothing is written.
  pure function case_folder(folder, input) result(own)
    character(len=*), intent(in) :: folder
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: own

    own = ''
    if (folder /= '') own = folder // '/' // input%load_case%name
  end function case_folder

end module nocdyn_analysis_command
