!> The matrices of the paper for one machine, as an analysis without files.
module nocdyn_matrices_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_machine, only: machine_t
  use nocdyn_matrix_report, only: matrix_report
  implicit none (type, external)
  private

  type, extends(analysis_t), public :: matrices_results_t
    character(len=:), allocatable, private :: report
  contains
    procedure :: solve, text => printed
  end type matrices_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(matrices_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run

    run = input%single('run')
    call matrix_report(machine, run%number('t_start'), self%report, error)
    if (allocated(error)) error%message = input%shown_file() // ': ' // error%message
  end subroutine solve

  subroutine printed(self, input, text)
    class(matrices_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = self%report
  end subroutine printed

end module nocdyn_matrices_results
