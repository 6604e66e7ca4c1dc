!> The best choice of numbers and sizes, as an analysis: optimise.csv, optimise.json, and optimised.nml, the input with that.
module nocdyn_optimise_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_design_choices, only: design_number_t, design_size_t, read_choices
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_json, only: json_t
  use nocdyn_machine, only: machine_t
  use nocdyn_optimum_report, only: list_optimum_notes, optimum_csv, optimum_text, put_optimum
  use nocdyn_optimum_search, only: optimum_t, search_optimum
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  character(len=*), parameter :: table_name = 'optimise.csv', input_name = 'optimised.nml'

  type, extends(analysis_t), public :: optimise_results_t
    type(optimum_t), private :: optimum
  contains
    procedure :: solve, list_tables, put_table, put_report, text => printed
  end type optimise_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(optimise_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(design_number_t), allocatable :: numbers(:)
    type(design_size_t), allocatable :: sizes(:)

    call read_choices(input, numbers, sizes, error)
    if (allocated(error)) return
    if (size(numbers) + size(sizes) == 0) then
      call raise(error, exit_input, input%shown_file() // ': there is no group &design; required: for instance ' // &
                 "&design target = 'coupling.rubber.stiffness' low = 1e4 high = 4e4 /")
      return
    end if
    call search_optimum(input, numbers, sizes, options%starts, self%optimum, error)
    if (allocated(error)) return
    call list_optimum_notes(self%optimum)
  end subroutine solve

  subroutine list_tables(self, names)
    class(optimise_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    allocate (names(0))
    call append(names, input_name)
    call append(names, table_name)
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(optimise_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    if (name == input_name) then
      call file%put(input_text(self%optimum%input))
    else
      call optimum_csv(self%optimum, file)
    end if
  end subroutine put_table

  subroutine put_report(self, input, json)
    class(optimise_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_optimum(json, input, self%optimum)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(optimise_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = optimum_text(input%shown_case(), self%optimum)
  end subroutine printed

end module nocdyn_optimise_results
