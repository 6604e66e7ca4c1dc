!> Natural frequencies over the speed, and where the orders meet them, as an analysis: campbell.csv and campbell.json.
module nocdyn_campbell_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_campbell, only: analyse_campbell, campbell_t
  use nocdyn_campbell_files, only: put_campbell, put_campbell_csv
  use nocdyn_campbell_report, only: campbell_text
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_machine, only: machine_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, extends(analysis_t), public :: campbell_results_t
    type(campbell_t), private :: campbell
    character(len=:), allocatable, private :: body   !! whose speed is held
  contains
    procedure :: solve, list_tables, put_table, put_report, text => printed
  end type campbell_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(campbell_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error

    call analyse_campbell(input, machine, self%campbell, error)
    if (.not. allocated(error)) self%body = machine%names(self%campbell%settings%body)%text
  end subroutine solve

  subroutine list_tables(self, names)
    class(campbell_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    names = [string_t('campbell.csv')]
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(campbell_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    call put_campbell_csv(self%campbell, self%body, output_units(input), file)
  end subroutine put_table

  subroutine put_report(self, input, json)
    class(campbell_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_campbell(json, input, self%body, self%campbell)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(campbell_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = campbell_text(input%shown_file(), self%body, self%campbell)
  end subroutine printed

end module nocdyn_campbell_results
