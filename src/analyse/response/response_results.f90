!> The forced response by orders over the speed, as an analysis: response.csv, response_orders.csv and response.json.
module nocdyn_response_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_comparisons, only: append_comparison_files, measured_files, put_comparison_table, put_comparisons
  use nocdyn_errors, only: error_t
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_machine, only: machine_t
  use nocdyn_measured_responses, only: compare_responses
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units
  use nocdyn_response_analysis, only: add_fatigue, analyse_response, response_analysis_t, wants_grid
  use nocdyn_response_files, only: orders_table, put_orders_csv, put_response, put_response_csv, put_response_grid, &
    response_columns_json, response_grid, response_table
  use nocdyn_response_report, only: response_text
  use nocdyn_response_summary, only: response_summary_t, summarise_response
  use nocdyn_response_verdict, only: find_response_verdict
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  character(len=*), parameter :: columns_name = 'response_columns.json'

  type, extends(analysis_t), public :: response_results_t
    type(response_analysis_t) :: analysis
    type(response_summary_t), private :: summary
  contains
    procedure :: solve, list_tables, put_table, grid_name, other_names, put_grid, judge, put_report, text => printed
  end type response_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(response_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error

    call analyse_response(input, machine, self%analysis, error)
    if (.not. allocated(error)) call add_fatigue(input, self%analysis, error)
    if (.not. allocated(error) .and. options%compares .and. self%analysis%settings%shaker == 0) then
      call compare_responses(input, machine, self%analysis%settings%body, self%analysis%comparisons, error)
    end if
    if (.not. allocated(error)) self%summary = summarise_response(self%analysis)
  end subroutine solve

  subroutine list_tables(self, names)
    class(response_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    names = [string_t(columns_name)]
    if (.not. self%analysis%writes_grid) names = [string_t(response_table), string_t(orders_table), string_t(columns_name)]
    if (allocated(self%analysis%comparisons)) call append_comparison_files(self%analysis%comparisons, measured_files, names)
  end subroutine list_tables

  pure function grid_name(self, input) result(name)
    class(response_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: name

    name = ''
    if (wants_grid(input)) name = response_grid
  end function grid_name

  function other_names(self, input) result(names)
    class(response_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(string_t), allocatable :: names(:)

    names = [string_t(response_grid)]
    if (wants_grid(input)) names = [string_t(response_table), string_t(orders_table)]
  end function other_names

  subroutine put_grid(self, input, folder, file)
    class(response_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    class(grid_file_t), intent(inout) :: file

    call put_response_grid(self%analysis, input, output_units(input), folder, file)
  end subroutine put_grid

  subroutine put_table(self, input, name, file)
    class(response_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    select case (name)
    case (response_table)
      call put_response_csv(self%analysis, output_units(input), file)
    case (orders_table)
      call put_orders_csv(self%analysis, output_units(input), file)
    case (columns_name)
      call file%put(response_columns_json(self%analysis, output_units(input)))
    case default
      call put_comparison_table(self%analysis%comparisons, name, file)
    end select
  end subroutine put_table

  subroutine judge(self, input)
    class(response_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input

    call find_response_verdict(input, self%analysis, self%summary, self%verdict)
  end subroutine judge

  subroutine put_report(self, input, json)
    class(response_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_response(json, input, self%analysis, self%summary, self%verdict)
    if (allocated(self%analysis%comparisons)) call put_comparisons(json, self%analysis%comparisons)
    call json%close()
  end subroutine put_report

  subroutine printed(self, input, text)
    class(response_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = response_text(input%shown_case(), self%analysis, self%summary)
  end subroutine printed

end module nocdyn_response_results
