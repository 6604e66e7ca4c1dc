!> The commands that ask a question of the machine of each file: check, equilibrium, modes and matrices.
module nocdyn_analysis_commands
  use nocdyn_arguments, only: arguments_t
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_console, only: print_text, report_error
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_equilibrium, only: equilibrium_t, find_equilibria, find_stability
  use nocdyn_equilibrium_report, only: equilibrium_json, equilibrium_report_t, equilibrium_text, new_equilibrium_report
  use nocdyn_errors, only: error_t, exit_done, exit_failed
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_report
  use nocdyn_matrix_report, only: matrix_report
  use nocdyn_modes_files, only: modes_csv, modes_json
  use nocdyn_modes_report, only: modes_report_t, modes_text, new_modes_report
  use nocdyn_operating_point, only: find_operating_point, operating_point_t
  use nocdyn_output_file, only: write_file
  use nocdyn_output_times, only: check_output_times
  use nocdyn_result_folders, only: out_folder, refuse_shared_folders
  use nocdyn_sweep_plan, only: add_plan_diagnostics, has_sweep, make_plan, sweep_plan_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: analyse_files

contains

  !> Analyses every file of the command line. Files with errors do not stop the others.
  subroutine analyse_files(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files
    type(input_t) :: input
    type(machine_t) :: machine
    type(string_t), allocatable :: folders(:)
    type(error_t), allocatable :: error
    integer :: i

    code = exit_done
    allocate (folders(size(arguments%operands)))
    do i = 1, size(folders)
      folders(i)%text = out_folder(arguments, arguments%operands(i)%text)
    end do
    call refuse_shared_folders(arguments%operands, folders, error)
    if (allocated(error)) then
      call report_error(error, code)
      return
    end if
    do i = 1, size(folders)
      call read_machine(arguments%operands(i)%text, arguments%overrides, input, machine, error)
      if (.not. allocated(error)) call analyse(arguments, input, machine, folders(i)%text, error)
      if (allocated(error)) call report_error(error, code)
    end do
  end subroutine analyse_files

  !> Reads an input and assembles its machine. Errors of the sweep are reported beside those of the machine.
  subroutine read_machine(file, overrides, input, machine, error)
    character(len=*), intent(in) :: file            !! path
    type(string_t), intent(in) :: overrides(:)      !! PATH=VALUE of every --set
    type(input_t), intent(out) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(diagnostics_t) :: diagnostics

    call read_input(file, overrides, input, error, diagnostics)
    if (allocated(error)) call add_plan_diagnostics(input, diagnostics, error)
    if (.not. allocated(error)) call check_output_times(input, error)
    if (.not. allocated(error)) call assemble_machine(input, machine, error)
  end subroutine read_machine

  !> Analyses one machine, prints the report and writes it.
  subroutine analyse(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder   !! '': nothing is written
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run

    select case (arguments%command)
    case ('check')
      call check(input, machine, error)
    case ('equilibrium')
      call analyse_equilibria(input, machine, folder, error)
    case ('modes')
      call analyse_modes(arguments, input, machine, folder, error)
    case ('matrices')
      run = input%single('run')
      call print_text(matrix_report(machine, run%number('t_start')))
    case default
      error stop 'nocdyn_analysis_commands: the command is no analysis'
    end select
  end subroutine analyse

  !> Prints a report on a machine and on the sweep of its input.
  subroutine check(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(sweep_plan_t) :: plan

    if (.not. has_sweep(input)) then
      call print_text(machine_report(input%file, machine))
    else
      call make_plan(input, plan, error)
      if (.not. allocated(error)) then
        call print_text(machine_report(input%file, machine) // new_line('a') // '  sweep: ' // plan%summary())
      end if
    end if
  end subroutine check

  !> Prints the steady states of a machine, and writes equilibrium.json.
  subroutine analyse_equilibria(input, machine, folder, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder   !! '': nothing is written
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(equilibrium_report_t) :: report
    type(string_t), allocatable :: notes(:)

    call find_equilibria(machine, formulation, equilibria, notes, error)
    if (allocated(error)) then
      error%message = input%file // ': ' // error%message
      return
    end if
    call find_stability(formulation, equilibria)
    report = new_equilibrium_report(formulation, equilibria, notes)
    call print_text(equilibrium_text(input%file, report))
    if (folder /= '') call write_file(folder, 'equilibrium.json', equilibrium_json(input, report), error)
  end subroutine analyse_equilibria

  !> Prints the modes of a machine, and writes modes.csv and modes.json.
  subroutine analyse_modes(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder   !! '': nothing is written
    type(error_t), allocatable, intent(out) :: error
    type(operating_point_t) :: point
    type(modes_report_t) :: report

    if (arguments%is_given('--at')) then
      call find_operating_point(input, machine, arguments%value('--at'), point, error)
    else
      call find_operating_point(input, machine, 'equilibrium', point, error)
    end if
    if (.not. allocated(error)) call new_modes_report(point, report, error)
    if (allocated(error)) then
      if (error%code == exit_failed) error%message = input%file // ': ' // error%message
      return
    end if
    call print_text(modes_text(input%file, report))
    if (folder == '') return
    call write_file(folder, 'modes.csv', modes_csv(report), error)
    if (.not. allocated(error)) call write_file(folder, 'modes.json', modes_json(input, report), error)
  end subroutine analyse_modes

end module nocdyn_analysis_commands
