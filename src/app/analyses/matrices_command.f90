!> nocdyn matrices: prints the matrices of the paper for one machine.
module nocdyn_matrices_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_input_files, only: analyse_files
  use nocdyn_machine, only: machine_t
  use nocdyn_matrix_report, only: matrix_report
  implicit none (type, external)
  private

  public :: matrices_command

contains

  !> Prints every matrix and vector of the machine at its start.
  subroutine matrices_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code

    call analyse_files(arguments, print_matrices, code)
  end subroutine matrices_command

  subroutine print_matrices(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run
    character(len=:), allocatable :: text

    run = input%single('run')
    call matrix_report(machine, run%number('t_start'), text, error)
    if (allocated(error)) then
      error%message = input%shown_file() // ': ' // error%message
    else
      call print_text(text)
    end if
  end subroutine print_matrices

end module nocdyn_matrices_command
