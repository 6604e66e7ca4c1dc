!> Passages of ranges of speeds, as an analysis: transit.csv and transit.json.
module nocdyn_transit_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_machine, only: machine_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: string_t
  use nocdyn_transit_analysis, only: analyse_transit, transit_analysis_t
  use nocdyn_transit_report, only: put_transit, put_transit_csv, transit_text
  use nocdyn_transit_verdict, only: find_transit_verdict
  implicit none (type, external)
  private

  type, extends(analysis_t), public :: transit_results_t
    type(transit_analysis_t), private :: analysis
  contains
    procedure :: solve, list_tables, put_table, judge, put_report, text => printed
  end type transit_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(transit_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error

    call analyse_transit(input, machine, self%analysis, error)
  end subroutine solve

  subroutine list_tables(self, names)
    class(transit_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    names = [string_t('transit.csv')]
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(transit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    call put_transit_csv(input, self%analysis, file)
  end subroutine put_table

  subroutine judge(self, input)
    class(transit_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input

    call find_transit_verdict(input, self%analysis, self%verdict)
  end subroutine judge

  subroutine put_report(self, input, json)
    class(transit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_transit(json, input, self%analysis, self%verdict)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(transit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = transit_text(input, self%analysis)
  end subroutine printed

end module nocdyn_transit_results
