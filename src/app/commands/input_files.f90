!> The loop over the input files that the commands without a run have in common.
module nocdyn_input_files
  use nocdyn_arguments, only: arguments_t
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_console, only: report_error
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t, exit_done
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_machine, only: machine_t
  use nocdyn_output_times, only: check_output_times
  use nocdyn_result_folders, only: out_folder, refuse_shared_folders
  use nocdyn_sweep_plan, only: add_plan_diagnostics
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: analyse_files

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
  subroutine analyse_files(arguments, analyse, code)
    type(arguments_t), intent(in) :: arguments
    procedure(analysis_interface) :: analyse
    integer, intent(out) :: code   !! the highest exit code of all files
    type(input_t) :: input
    type(machine_t) :: machine
    type(diagnostics_t) :: diagnostics
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
      call read_input(arguments%operands(i)%text, arguments%overrides, input, error, diagnostics)
      if (allocated(error)) call add_plan_diagnostics(input, diagnostics, error)   ! with those of the machine
      if (.not. allocated(error)) call check_output_times(input, error)
      if (.not. allocated(error)) call assemble_machine(input, machine, error)
      if (.not. allocated(error)) call analyse(arguments, input, machine, folders(i)%text, error)
      if (allocated(error)) call report_error(error, code)
    end do
  end subroutine analyse_files

end module nocdyn_input_files
