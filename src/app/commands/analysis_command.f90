!> The commands that analyse machines without a run: one driver reads the files, solves, prints and writes.
module nocdyn_analysis_command
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_arguments, only: arguments_t
  use nocdyn_case_choice, only: choose_case, wanted_case
  use nocdyn_check_results, only: check_results_t
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
  use nocdyn_matrices_results, only: matrices_results_t
  use nocdyn_named_analyses, only: assemble_analysed, new_analysis
  use nocdyn_posix, only: is_interrupted, remove_file, stop_at_interrupts
  use nocdyn_result_files, only: result_files_t
  use nocdyn_result_folders, only: out_folder, refuse_shared_folders, result_folder
  use nocdyn_sweep_plan, only: add_plan_diagnostics, has_sweep, make_plan, sweep_plan_t
  use nocdyn_text, only: append, listed, shown_path, string_t, to_text
  implicit none (type, external)
  private

  public :: analysis_command, analyse

  !> An input file that has been read.
  type :: reading_t
    type(input_t) :: input
    type(input_t), allocatable :: load_cases(:)   !! of `check`
    type(error_t), allocatable :: error
  end type reading_t

contains

  !> Analyses the machines of all files of the command line.
  subroutine analysis_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse(arguments, code)
  end subroutine analysis_command

  !> Does so in a program that can write NetCDF, if `netcdf` is present.
  subroutine analyse(arguments, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files
    class(grid_file_t), intent(in), optional :: netcdf   !! not open
    class(analysis_t), allocatable :: kind

    select case (arguments%command)
    case ('check')
      call analyse_files(arguments, check_results_t(is_steady=.false., locks_joints=.false.), code)
    case ('matrices')
      call analyse_files(arguments, matrices_results_t(is_steady=.false., locks_joints=.false., has_report=.false.), code)
    case default
      call new_analysis(arguments%command, kind)
      call analyse_files(arguments, kind, code, netcdf)
    end select
  end subroutine analyse

  !> Analyses every file. Files with errors do not stop the others.
  subroutine analyse_files(arguments, kind, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    class(analysis_t), intent(in) :: kind   !! the analysis, before its solution
    integer, intent(out) :: code
    class(grid_file_t), intent(in), optional :: netcdf   !! as in `analyse`
    type(reading_t), allocatable :: readings(:)
    type(string_t), allocatable :: folders(:)
    type(machine_t) :: machine
    type(error_t), allocatable :: error
    character(len=:), allocatable :: words
    integer :: i

    code = exit_done
    allocate (readings(size(arguments%operands)), folders(size(arguments%operands)))
    do i = 1, size(readings)
      call read_one(arguments, i, kind%always_writes, readings(i), folders(i)%text)
    end do
    if (.not. present(netcdf)) then
      call refuse_pipes(arguments, kind, readings)
      if (any([(needs_companion(kind, readings(i)), i=1, size(readings))])) then
        call become_companion("format = 'netcdf'", code)
        return
      end if
    end if
    call refuse_shared_folders(arguments%operands, folders, error)
    if (allocated(error)) then
      call report_error(error, code)
      return
    end if
    do i = 1, size(readings)
      associate (reading => readings(i))
        words = shown_path(arguments%operands(i)%text) // ': interrupted, without results'
        call stop_at_interrupts('nocdyn: ' // words // new_line('a'))
        if (.not. allocated(reading%error)) call assemble_analysed(arguments%command, kind, reading%input, machine, &
                                                                     reading%error)
        if (.not. allocated(reading%error)) call check_signals(reading%input, machine, reading%error)
        if (.not. allocated(reading%error)) call analyse_one(arguments, kind, reading%input, machine, folders(i)%text, &
                                                             reading%error, netcdf)
        if (arguments%command == 'check') call check_load_cases(kind, reading)
        if (is_interrupted() .and. allocated(reading%error)) reading%error%message = words
        if (allocated(reading%error)) call report_error(reading%error, code)
      end associate
      if (is_interrupted()) exit
    end do
    if (i >= size(readings)) return
    call raise(error, exit_failed, 'files left out after the interruption: ' // to_text(size(readings) - i))
    call report_error(error, code)
  end subroutine analyse_files

  !> Whether an input is to be analysed, but not by a program that cannot write NetCDF.
  pure logical function needs_companion(kind, reading)
    class(analysis_t), intent(in) :: kind
    type(reading_t), intent(in) :: reading

    needs_companion = .not. allocated(reading%error)
    if (needs_companion) needs_companion = kind%grid_name(reading%input) /= ''
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
      if (bytes <= 0) call raise(readings(i)%error, exit_input, readings(i)%input%shown_file() // &
                                 ": format = 'netcdf' needs an input that can be read twice, not a pipe")
    end do
  end subroutine refuse_pipes

  !> Analyses one machine, prints the report, and writes the files.
  subroutine analyse_one(arguments, kind, input, machine, folder, error, netcdf)
    type(arguments_t), intent(in) :: arguments
    class(analysis_t), intent(in) :: kind
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder   !! '': nothing is written
    type(error_t), allocatable, intent(out) :: error
    class(grid_file_t), intent(in), optional :: netcdf   !! as in `analyse`
    class(analysis_t), allocatable :: analysis
    type(analysis_options_t) :: options
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: text

    options%at = ''
    if (arguments%is_given('--at')) options%at = arguments%value('--at')
    options%modes = arguments%modes
    options%has_range = arguments%is_given('--range_hz')
    options%range_hz = arguments%range_hz
    options%has_code = arguments%is_given('--code')
    options%has_holzer = arguments%is_given('--holzer')
    options%writes_files = folder /= ''
    options%folder = result_folder(arguments, input)
    allocate (analysis, source=kind)
    call analysis%solve(input, machine, options, error)
    if (allocated(error)) return
    if (allocated(analysis%refusal)) then
      call analysis%text(input, text)
      call print_text(text)
      error = analysis%refusal
      return
    end if
    if (folder /= '' .and. analysis%has_report) then
      call write_files(arguments%command, analysis, input, folder, names, error, netcdf)
      if (allocated(error)) return
    end if
    if (arguments%is_given('--quiet')) return
    call analysis%text(input, text)
    call print_text(text)
    if (analysis%always_writes) call print_text(input%shown_file() // ': ' // shown_path(folder) // ' has ' // &
                                                listed(names, ' and '))
  end subroutine analyse_one

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
    call check_input(reading%input, known)
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

    if (.not. has_sweep(reading%input)) return
    call make_plan(reading%input, plan, reading%error)
    do c = 1, size(reading%load_cases)
      if (.not. allocated(reading%error)) return
      call make_plan(reading%load_cases(c), plan, error)
      if (.not. allocated(error)) deallocate (reading%error)
    end do
  end subroutine check_sweep

  !> Reads and checks a file, and finds the folder of its results.
  subroutine read_one(arguments, number, always_writes, reading, folder)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number         !! of the file
    logical, intent(in) :: always_writes  !! as of `analysis_t`
    type(reading_t), intent(inout) :: reading
    character(len=:), allocatable, intent(out) :: folder
    type(diagnostics_t) :: diagnostics
    integer :: chosen

    folder = out_folder(arguments, arguments%operands(number)%text)
    call read_input(arguments%operands(number)%text, arguments%overrides, reading%input, reading%error, &
                    diagnostics, reading%load_cases, wanted_case(arguments))
    if (allocated(reading%error)) call add_plan_diagnostics(reading%input, diagnostics, reading%error)
    if (.not. allocated(reading%error)) call choose_case(arguments, reading%input, chosen, reading%error)
    if (allocated(reading%error)) then
      if (arguments%command == 'check' .and. allocated(reading%load_cases)) then   ! the machine itself can be read
        call refuse_mistakes(reading%input, reading%error)
      end if
      return
    end if
    if (always_writes) folder = result_folder(arguments, reading%input)
    if (chosen > 0) then
      if (folder /= '') folder = folder // '/' // reading%load_cases(chosen)%load_case%name
      reading%input = reading%load_cases(chosen)
      deallocate (reading%load_cases)   ! the others are not looked at
      allocate (reading%load_cases(0))
    end if
    call refuse_mistakes(reading%input, reading%error)
  end subroutine read_one

end module nocdyn_analysis_command
