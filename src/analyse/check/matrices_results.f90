!> The matrices of the paper for one machine, or its equations as a program in C, as an analysis without files.
module nocdyn_matrices_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_code_text, only: code_text_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_matrix_report, only: matrix_report
  use nocdyn_reduced, only: new_reduced, reduced_t
  use nocdyn_text, only: to_text
  use nocdyn_version, only: version
  implicit none (type, external)
  private

  type, extends(analysis_t), public :: matrices_results_t
    character(len=:), allocatable, private :: report
  contains
    procedure :: solve, text => printed
  end type matrices_results_t

  integer, parameter :: code_order = 8   ! of the series in a program
  integer, parameter :: code_lanes = 8   ! of the block that it is written from

contains

  subroutine solve(self, input, machine, options, error)
    class(matrices_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run

    run = input%single('run')
    if (options%has_code) then
      call write_code(input, run%number('t_start'), self%report, error)
    else
      call matrix_report(machine, run%number('t_start'), self%report, error)
    end if
    if (allocated(error)) error%message = input%shown_file() // ': ' // error%message
  end subroutine solve

  !> Writes the equations of motion as a program.
  subroutine write_code(input, t_start, text, error)
    type(input_t), intent(in) :: input
    real(wp), intent(in) :: t_start   !! [s]
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: block
    type(reduced_t) :: formulation
    type(code_text_t) :: code
    character(len=:), allocatable :: obstacle

    call assemble_machine(input, block, error, code_lanes)
    if (allocated(error)) return
    formulation = new_reduced(block, .false.)
    call formulation%prepare_series(code_order)
    call code%line('/* Equations of motion of @, written by nocdyn @.', a=input%shown_file(), b=version)
    call code%line('')
    call code%line('   machine_derivative(t, y, rate) sets the derivatives of the state y at the time t [s];')
    call code%line('   machine_step(t, h, y) moves it by h [s] with a Taylor series of order $.', [code_order])
    call code%line('   machine_states names the states, machine_start has their values at t = @ s.', a=to_text(t_start))
    call code%line('   cc -O2 -ffp-contract=off -DMACHINE_MAIN FILE.c -lm makes a program with the arguments STEPS and H. */')
    call formulation%write_program(t_start, code, obstacle)
    if (obstacle /= '') call raise(error, exit_input, obstacle)
    text = code%text()
  end subroutine write_code

  subroutine printed(self, input, text)
    class(matrices_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = self%report
  end subroutine printed

end module nocdyn_matrices_results
