!> nocdyn run: integrates machines, or their load cases, and writes the results. Files with errors do not stop the others.
module nocdyn_run_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_case_choice, only: find_wanted, wanted_case
  use nocdyn_companion_command, only: become_companion
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: add_error, error_t, exit_done, exit_failed, exit_input, raise
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_load_case_peaks, only: case_run_t
  use nocdyn_load_case_report, only: find_cases_verdict, load_cases_json, load_cases_text, put_load_cases_csv
  use nocdyn_machine_parts, only: refuse_mistakes
  use nocdyn_posix, only: catch_interrupts, is_interrupted, remove_file
  use nocdyn_result_files, only: result_files_t
  use nocdyn_result_folders, only: refuse_shared_folders, refuse_sweep_folder, result_folder
  use nocdyn_run_files, only: partial_file, run_to_files, wants_netcdf
  use nocdyn_run_summary, only: method_line, run_summary_t, summary_line
  use nocdyn_run_table, only: summary_table
  use nocdyn_strictness, only: be_strict
  use nocdyn_text, only: append, counted, quoted, shown_path, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_variant_choice, only: leave_sweep
  use nocdyn_verdicts, only: verdict_t
  implicit none (type, external)
  private

  public :: run_command, run_inputs

  !> What is to be run of a file, or why it is refused.
  type :: file_runs_t
    type(input_t), allocatable :: inputs(:)    !! the machine itself, or its load cases
    type(string_t), allocatable :: folders(:)  !! of their results
    character(len=:), allocatable :: folder    !! of the file
    type(error_t), allocatable :: error
  end type file_runs_t

  character(len=*), parameter :: json_file = 'cases.json', csv_file = 'cases.csv'

contains

  !> Reads all files, then runs those without errors one after the other. If one of them asks for NetCDF, the companion does it.
  subroutine run_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call run_inputs(arguments, code)
  end subroutine run_command

  !> `nocdyn run` in a program that can write NetCDF if `netcdf` is present.
  subroutine run_inputs(arguments, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    class(grid_file_t), intent(in), optional :: netcdf   !! not open
    type(file_runs_t), allocatable :: readings(:)
    type(error_t), allocatable :: error
    integer :: i, k
    type(string_t), allocatable :: files(:), folders(:)

    code = exit_done
    allocate (readings(size(arguments%operands)))
    do i = 1, size(readings)
      call read_one(arguments, i, present(netcdf), readings(i))
    end do
    if (.not. present(netcdf)) then
      if (any([(needs_companion(readings(i)), i=1, size(readings))])) then
        call become_companion("format = 'netcdf'", code)
        return
      end if
    end if
    do i = 1, size(readings)
      if (allocated(readings(i)%error)) call report_error(readings(i)%error, code)
    end do
    ! refuses folders of results that two files or load cases would share
    allocate (files(0), folders(0))
    do i = 1, size(readings)
      do k = 1, size(readings(i)%inputs)
        call append(files, arguments%operands(i)%text)
        call append(folders, readings(i)%folders(k)%text)
      end do
    end do
    call refuse_shared_folders(files, folders, error)
    if (allocated(error)) then
      call report_error(error, code)
    else
      call run_all(arguments, readings, code, netcdf)
    end if
  end subroutine run_inputs

  subroutine run_all(arguments, readings, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    type(file_runs_t), intent(in) :: readings(:)
    integer, intent(inout) :: code
    class(grid_file_t), intent(in), optional :: netcdf   !! as in `run_inputs`
    type(run_summary_t) :: summary
    type(error_t), allocatable :: error
    integer :: i, left

    call catch_interrupts()
    left = count([(size(readings(i)%inputs) > 0, i=1, size(readings))])
    do i = 1, size(readings)
      if (size(readings(i)%inputs) == 0) cycle
      call remove_file(readings(i)%folder // '/' // json_file)
      call remove_file(readings(i)%folder // '/' // csv_file)
      if (allocated(readings(i)%inputs(1)%load_case)) then
        call run_load_cases(arguments, readings(i), code, netcdf)
      else
        call run_input(arguments, readings(i)%inputs(1), readings(i)%folder, code, summary, netcdf)
        call be_strict(arguments, readings(i)%inputs(1)%shown_file(), summary%verdict, code)
      end if
      left = left - 1
      if (is_interrupted()) exit
    end do
    if (left == 0) return
    call raise(error, exit_failed, 'files not run after the interruption: ' // to_text(left))
    call report_error(error, code)
  end subroutine run_all

  !> Runs the load cases of a file, then writes and prints what they say together. Cases that fail do not stop the others.
  subroutine run_load_cases(arguments, reading, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    type(file_runs_t), intent(in) :: reading
    integer, intent(inout) :: code
    class(grid_file_t), intent(in), optional :: netcdf   !! as in `run_inputs`
    type(case_run_t), allocatable :: runs(:)
    type(verdict_t) :: verdict
    type(error_t), allocatable :: error
    character(len=:), allocatable :: left
    integer :: c

    allocate (runs(size(reading%inputs)))
    left = ''
    do c = 1, size(runs)
      runs(c)%load_case = reading%inputs(c)%load_case
      if (is_interrupted()) then
        runs(c)%status = 'not run'
        left = left // ', ' // quoted(runs(c)%load_case%name)
      else
        call run_input(arguments, reading%inputs(c), reading%folders(c)%text, code, runs(c)%summary, netcdf)
        runs(c)%status = runs(c)%summary%status
        if (allocated(runs(c)%summary%message)) runs(c)%message = runs(c)%summary%message
        runs(c)%verdict = runs(c)%summary%verdict
      end if
    end do
    if (left /= '') then
      call raise(error, exit_failed, reading%inputs(1)%shown_file() // ': load cases not run after the interruption: ' // &
                 left(3:))
      call report_error(error, code)
      deallocate (error)
    end if
    call find_cases_verdict(runs, verdict)
    call write_cases_files(reading%inputs(1), runs, verdict, reading%folder, error)
    if (allocated(error)) then
      call report_error(error, code)
    else if (.not. arguments%is_given('--quiet')) then
      if (.not. arguments%is_given('--case')) call print_text(load_cases_text(runs, verdict))
      call print_text(reading%inputs(1)%shown_file() // ': ' // &
                      counted(size(runs), 'load case', 'load cases') // '; cases.json and cases.csv are in ' // &
                      shown_path(reading%folder))
    end if
    call be_strict(arguments, reading%inputs(1)%shown_file(), verdict, code)
  end subroutine run_load_cases

  subroutine read_one(arguments, number, has_netcdf, reading)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number        !! of the file
    logical, intent(in) :: has_netcdf    !! whether this program can write NetCDF
    type(file_runs_t), intent(inout) :: reading
    type(input_t) :: machine
    type(input_t), allocatable :: load_cases(:)
    integer :: bytes, c, k
    integer, allocatable :: wanted(:)
    type(error_t), allocatable :: own

    allocate (reading%inputs(0), reading%folders(0))
    associate (file => arguments%operands(number)%text)
      call read_input(file, arguments%overrides, machine, reading%error, load_cases=load_cases, &
                      only_case=wanted_case(arguments))
      if (.not. allocated(reading%error)) call leave_sweep(arguments, machine, load_cases)
      if (.not. allocated(reading%error)) call find_wanted(arguments, machine, wanted, reading%error)
      if (.not. allocated(reading%error)) then
        reading%folder = result_folder(arguments, machine)
        call refuse_sweep_folder(machine%file, reading%folder, reading%error)
      end if
      if (allocated(reading%error)) return
      if (.not. has_netcdf .and. wants_netcdf(machine)) then
        inquire (file=file, size=bytes)
        if (bytes <= 0) then
          call raise(reading%error, exit_input, machine%shown_file() // &
                     ": format = 'netcdf' needs an input that can be read twice, not a pipe")
          return
        end if
      end if
    end associate
    ! takes what is to be run, each with the folder of its results
    deallocate (reading%inputs)
    allocate (reading%inputs(max(1, size(wanted))))
    if (size(load_cases) == 0) reading%inputs(1) = machine
    if (size(load_cases) == 0) call append(reading%folders, reading%folder)
    do k = 1, size(wanted)
      reading%inputs(k) = load_cases(wanted(k))
      call append(reading%folders, reading%folder // '/' // load_cases(wanted(k))%load_case%name)
    end do
    ! Refuses a file with mistakes in the machine or any of the load cases that are wanted, and load cases whose folders hold
    ! other results.
    do c = 1, size(reading%inputs)
      call refuse_mistakes(reading%inputs(c), own)
      if (allocated(reading%inputs(c)%load_case) .and. .not. allocated(own)) then
        call refuse_sweep_folder(reading%inputs(c)%shown_case(), reading%folders(c)%text, own)
      end if
      call add_error(reading%error, own)
    end do
    if (.not. allocated(reading%error)) return
    deallocate (reading%inputs)
    allocate (reading%inputs(0))
  end subroutine read_one

  !> Whether an input is to be run, but not by a program that cannot write NetCDF.
  logical function needs_companion(reading)
    type(file_runs_t), intent(in) :: reading

    integer :: i

    needs_companion = any([(wants_netcdf(reading%inputs(i)), i=1, size(reading%inputs))])
  end function needs_companion

  !> Runs the machine itself or one of its load cases.
  subroutine run_input(arguments, input, folder, code, summary, netcdf)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    integer, intent(inout) :: code
    type(run_summary_t), intent(out) :: summary
    class(grid_file_t), intent(in), optional :: netcdf   !! as in `run_inputs`
    type(error_t), allocatable :: error
    type(text_buffer_t) :: report
    character(len=:), allocatable :: reached
    integer :: i

    call run_to_files(input, folder, input%shown_case(), arguments%is_given('--quiet'), summary, error, netcdf)
    if (allocated(error)) then
      if (.not. summary%has_run) summary%status = 'refused'
      if (summary%status == 'done') summary%status = 'failed'   ! its files were not written
      if (.not. allocated(summary%message)) summary%message = error%message
      reached = 'there'
      if (summary%extremes%rows > 0) reached = 't = ' // to_text(summary%extremes%last(1)) // ' s'
      if (error%code == exit_failed .and. summary%has_run) then
        error%message = input%shown_case() // ': ' // error%message // '; the rows up to ' // reached // ' are in ' // &
                        shown_path(folder // '/' // partial_file(input))
      end if
      call report_error(error, code)
    else if (.not. arguments%is_given('--quiet')) then
      do i = 1, size(summary%notes)
        call print_text(input%shown_case() // ': note: ' // summary%notes(i)%text)
      end do
      if (shows_table(arguments, input)) then
        call print_text(summary_table(input, summary))
      else if (.not. allocated(input%load_case)) then
        call summary%verdict%write_table(report)
        call print_text(report%text())
      end if
      if (len(method_line(input, summary)) > 0) call print_text(method_line(input, summary))
      call print_text(summary_line(input, summary, folder))
    end if
  end subroutine run_input

  !> Whether the table of a run is printed: of the only run of a call.
  logical function shows_table(arguments, input)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input

    shows_table = size(arguments%operands) == 1 .and. (arguments%is_given('--case') .or. .not. allocated(input%load_case))
  end function shows_table

  !> Writes both; cases.json comes last.
  subroutine write_cases_files(input, runs, verdict, folder, error)
    type(input_t), intent(in) :: input   !! of one of the cases
    type(case_run_t), intent(in) :: runs(:)
    type(verdict_t), intent(in) :: verdict   !! of all of them
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(result_files_t) :: files

    call files%open(folder, [string_t(csv_file), string_t(json_file)])
    call put_load_cases_csv(runs, files%files(1))
    call files%files(2)%put(load_cases_json(input, runs, verdict))
    call files%finish(error)
  end subroutine write_cases_files

end module nocdyn_run_command
