!> The commands that analyse machines without running them: equilibrium, modes.
module nocdyn_analysis_commands
  use nocdyn_arguments, only: arguments_t
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_console, only: report_error, print_text
  use nocdyn_equilibrium, only: equilibrium_t, find_equilibria, find_stability
  use nocdyn_equilibrium_report, only: equilibrium_json, equilibrium_report_t, equilibrium_text, new_equilibrium_report
  use nocdyn_errors, only: error_t, exit_done, exit_failed
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_machine, only: machine_t
  use nocdyn_modes_files, only: modes_csv, modes_json
  use nocdyn_modes_report, only: modes_report_t, modes_text, new_modes_report
  use nocdyn_operating_point, only: find_operating_point, operating_point_t
  use nocdyn_output_file, only: write_file
  use nocdyn_output_times, only: check_output_times
  use nocdyn_result_folders, only: normalised_path, refuse_shared_folders, stem
  use nocdyn_size_limits, only: check_dense_size
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: equilibrium_command, modes_command

contains

  !> The steady states of every file; the exit code is the worst of all.
  subroutine equilibrium_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(string_t), allocatable :: folders(:)
    type(error_t), allocatable :: error
    integer :: i

    code = exit_done
    call result_folders(arguments, folders, error)
    if (allocated(error)) call report_failure(error, code)
    if (code /= exit_done) return
    do i = 1, size(folders)
      call analyse_equilibrium(arguments, i, folders(i)%text, error)
      if (allocated(error)) call report_failure(error, code)
    end do
  end subroutine equilibrium_command

  !> The modes of every file; the exit code is the worst of all.
  subroutine modes_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(string_t), allocatable :: folders(:)
    type(error_t), allocatable :: error
    integer :: i

    code = exit_done
    call result_folders(arguments, folders, error)
    if (allocated(error)) call report_failure(error, code)
    if (code /= exit_done) return
    do i = 1, size(folders)
      call analyse_modes(arguments, i, folders(i)%text, error)
      if (allocated(error)) call report_failure(error, code)
    end do
  end subroutine modes_command

  subroutine report_failure(error, code)
    type(error_t), intent(in) :: error
    integer, intent(inout) :: code

    call report_error(error)
    code = max(code, error%code)
  end subroutine report_failure

  !> --out, in which each of several files gets a folder of its own; empty texts without --out.
  subroutine result_folders(arguments, folders, error)
    type(arguments_t), intent(in) :: arguments
    type(string_t), allocatable, intent(out) :: folders(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    allocate (folders(size(arguments%operands)))
    do i = 1, size(folders)
      folders(i)%text = ''
      if (.not. allocated(arguments%out)) cycle
      folders(i)%text = normalised_path(arguments%out)
      if (size(folders) > 1) folders(i)%text = folders(i)%text // '/' // stem(arguments%operands(i)%text)
    end do
    if (allocated(arguments%out)) call refuse_shared_folders(arguments%operands, folders, [(.true., i=1, size(folders))], error)
  end subroutine result_folders

  subroutine read_machine(arguments, number, input, machine, error)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number   !! of the file
    type(input_t), intent(out) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error

    call read_input(arguments%operands(number)%text, arguments%overrides, input, error)
    if (.not. allocated(error)) call check_output_times(input, error)
    if (.not. allocated(error)) call assemble_machine(input, machine, error)
  end subroutine read_machine

  subroutine analyse_equilibrium(arguments, number, folder, error)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number
    character(len=*), intent(in) :: folder   !! '' if nothing is to be written
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: input
    type(machine_t) :: machine
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(equilibrium_report_t) :: report
    type(string_t), allocatable :: notes(:)

    call read_machine(arguments, number, input, machine, error)
    if (allocated(error)) return
    call find_equilibria(machine, formulation, equilibria, notes, error)
    if (allocated(error)) then
      error%message = input%file // ': ' // error%message
      return
    end if
    call find_stability(formulation, equilibria)
    report = new_equilibrium_report(formulation, equilibria, notes)
    call print_text(equilibrium_text(input%file, report))
    if (folder /= '') call write_file(folder, 'equilibrium.json', equilibrium_json(input, report), error)
  end subroutine analyse_equilibrium

  subroutine analyse_modes(arguments, number, folder, error)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number
    character(len=*), intent(in) :: folder   !! '' if nothing is to be written
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: input
    type(machine_t) :: machine
    type(operating_point_t) :: point
    type(modes_report_t) :: report

    call read_machine(arguments, number, input, machine, error)
    if (.not. allocated(error)) call check_dense_size(input, machine, error)
    if (allocated(error)) return
    if (allocated(arguments%at)) then
      call find_operating_point(input, machine, arguments%at, point, error)
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
