!> The loop over the input files that the commands without a run have in common.
module nocdyn_input_files
  use nocdyn_arguments, only: arguments_t
  use nocdyn_assembly, only: assemble_machine, assemble_steady_machine
  use nocdyn_case_choice, only: choose_case, wanted_case
  use nocdyn_console, only: report_error
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_equilibrium, only: t_infinity
  use nocdyn_errors, only: add_error, error_t, exit_done, exit_failed, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_joint_simplifications, only: refuse_joints
  use nocdyn_label_checks, only: refuse_equal_labels
  use nocdyn_load_case_checks, only: check_input, name_load_case
  use nocdyn_machine, only: machine_t
  use nocdyn_posix, only: is_interrupted, stop_at_interrupts
  use nocdyn_result_folders, only: out_folder, refuse_shared_folders, result_folder
  use nocdyn_sweep_plan, only: add_plan_diagnostics, has_sweep, make_plan, sweep_plan_t
  use nocdyn_text, only: shown_path, string_t, to_text
  implicit none (type, external)
  private

  public :: analyse_files

  !> An input file that has been read.
  type :: reading_t
    type(input_t) :: input
    type(input_t), allocatable :: load_cases(:)   !! of `check`
    type(error_t), allocatable :: error
  end type reading_t

  abstract interface

    !> Analyses the machine of one file, prints the report and writes it to a folder.
    subroutine analysis_interface(arguments, input, machine, folder, error)
      import :: arguments_t, error_t, input_t, machine_t
      type(arguments_t), intent(in) :: arguments
      type(input_t), intent(in) :: input
      type(machine_t), intent(in) :: machine
      character(len=*), intent(in) :: folder                  !! '': nothing is written
      type(error_t), allocatable, intent(out) :: error
    end subroutine analysis_interface

  end interface

contains

  !> Analyses every file of the command line. Files with errors do not stop the others.
  subroutine analyse_files(arguments, analyse, code, always_writes)
    type(arguments_t), intent(in) :: arguments
    procedure(analysis_interface) :: analyse
    integer, intent(out) :: code   !! the highest exit code of all files
    logical, intent(in), optional :: always_writes   !! whether there are files without --out too, in the folder of a run
    type(reading_t), allocatable :: readings(:)
    type(string_t), allocatable :: folders(:)
    type(machine_t) :: machine
    type(error_t), allocatable :: error
    character(len=:), allocatable :: words
    integer :: i

    code = exit_done
    allocate (readings(size(arguments%operands)), folders(size(arguments%operands)))
    do i = 1, size(readings)
      call read_one(arguments, i, readings(i), folders(i)%text, always_writes)
    end do
    call refuse_shared_folders(arguments%operands, folders, error)
    if (allocated(error)) then
      call report_error(error, code)
      return
    end if
    do i = 1, size(readings)
      associate (reading => readings(i))
        words = shown_path(arguments%operands(i)%text) // ': interrupted, without results'
        call stop_at_interrupts('nocdyn: ' // words // new_line('a'))
        if (.not. allocated(reading%error)) call assemble_for(arguments%command, reading%input, machine, reading%error)
        if (.not. allocated(reading%error)) call refuse_equal_labels(reading%input, machine, reading%error)
        if (.not. allocated(reading%error)) call analyse(arguments, reading%input, machine, folders(i)%text, reading%error)
        if (arguments%command == 'check') call check_load_cases(reading)
        if (is_interrupted() .and. allocated(reading%error)) reading%error%message = words
        if (allocated(reading%error)) call report_error(reading%error, code)
      end associate
      if (is_interrupted()) exit
    end do
    if (i >= size(readings)) return
    call raise(error, exit_failed, 'files left out after the interruption: ' // to_text(size(readings) - i))
    call report_error(error, code)
  end subroutine analyse_files

  !> Builds the machine as a command looks at it: all but `check` and `matrices` look at a steady state.
  subroutine assemble_for(command, input, machine, error)
    character(len=*), intent(in) :: command
    type(input_t), intent(inout) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error

    input%takes_means = all(command /= [character(len=8) :: 'check', 'matrices'])
    if (command /= 'check') call refuse_joints(input, 'nocdyn ' // command, error)
    if (allocated(error)) return
    if (input%takes_means) then
      call assemble_steady_machine(input, t_infinity, all(command /= [character(len=11) :: 'equilibrium', 'modes']), machine, &
                                   error)
    else
      call assemble_machine(input, machine, error)
    end if
  end subroutine assemble_for

  !> Checks the load cases that can be read; if there is no mistake so far, builds their machines.
  subroutine check_load_cases(reading)
    type(reading_t), intent(inout) :: reading   !! gets the mistakes of all of them
    type(machine_t) :: machine
    type(error_t), allocatable :: own
    integer :: c
    logical :: is_right

    if (.not. allocated(reading%load_cases)) return
    is_right = .not. allocated(reading%error)
    do c = 1, size(reading%load_cases)
      if (.not. allocated(reading%load_cases(c)%groups)) cycle
      call check_input(reading%load_cases(c), own, reading%error)
      if (is_right .and. .not. allocated(own)) then
        call assemble_for('check', reading%load_cases(c), machine, own)
        if (allocated(own)) call name_load_case(reading%load_cases(c), own)
      end if
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
  subroutine read_one(arguments, number, reading, folder, always_writes)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number   !! of the file
    type(reading_t), intent(inout) :: reading
    character(len=:), allocatable, intent(out) :: folder
    logical, intent(in), optional :: always_writes   !! as in `analyse_files`
    type(diagnostics_t) :: diagnostics
    type(error_t), allocatable :: own
    integer :: chosen

    folder = out_folder(arguments, arguments%operands(number)%text)
    call read_input(arguments%operands(number)%text, arguments%overrides, reading%input, reading%error, &
                    diagnostics, reading%load_cases, wanted_case(arguments))
    if (allocated(reading%error)) call add_plan_diagnostics(reading%input, diagnostics, reading%error)
    if (.not. allocated(reading%error)) call choose_case(arguments, reading%input, chosen, reading%error)
    if (allocated(reading%error)) then
      if (arguments%command == 'check' .and. allocated(reading%load_cases)) then   ! the machine itself can be read
        call check_input(reading%input, own)
        call add_error(reading%error, own)
      end if
      return
    end if
    if (present(always_writes)) then
      if (always_writes) folder = result_folder(arguments, reading%input)
    end if
    if (chosen > 0) then
      if (folder /= '') folder = folder // '/' // reading%load_cases(chosen)%load_case%name
      reading%input = reading%load_cases(chosen)
      deallocate (reading%load_cases)   ! the others are not looked at
      allocate (reading%load_cases(0))
    end if
    call check_input(reading%input, reading%error)
  end subroutine read_one

end module nocdyn_input_files
