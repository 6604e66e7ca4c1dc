!> Steady states, as an analysis: equilibrium.json.
module nocdyn_equilibrium_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_equilibrium, only: equilibrium_t, find_equilibria, find_stability, t_infinity
  use nocdyn_equilibrium_report, only: put_equilibrium, equilibrium_report_t, equilibrium_text, new_equilibrium_report
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_machine, only: machine_t
  use nocdyn_output_units, only: output_units
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, extends(analysis_t), public :: equilibrium_results_t
    type(equilibrium_report_t), private :: report
  contains
    procedure :: solve, put_report, text => printed
  end type equilibrium_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(equilibrium_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(string_t), allocatable :: notes(:)

    call find_equilibria(machine, t_infinity, formulation, equilibria, notes, error)
    if (.not. allocated(error)) then
      call find_stability(formulation, t_infinity, equilibria)
      call new_equilibrium_report(formulation, equilibria, notes, output_units(input), self%report, error)
    end if
    if (allocated(error)) error%message = input%shown_case() // ': ' // error%message
  end subroutine solve

  subroutine put_report(self, input, json)
    class(equilibrium_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_equilibrium(json, input, self%report)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(equilibrium_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = equilibrium_text(input%shown_case(), self%report)
  end subroutine printed

end module nocdyn_equilibrium_results
