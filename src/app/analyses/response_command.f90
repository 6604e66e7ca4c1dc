!> nocdyn response: forced response by orders over the speed.
module nocdyn_response_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_input_files, only: analyse_files
  use nocdyn_machine, only: machine_t
  use nocdyn_output_units, only: output_units
  use nocdyn_response_analysis, only: add_fatigue, analyse_response, response_analysis_t
  use nocdyn_response_files, only: orders_table, put_orders_csv, put_response_csv, response_columns_json, response_json, &
    response_table
  use nocdyn_response_report, only: response_text
  use nocdyn_response_summary, only: response_summary_t, summarise_response
  use nocdyn_result_files, only: result_files_t
  use nocdyn_text, only: shown_path, string_t
  implicit none (type, external)
  private

  public :: response_command

  character(len=*), parameter :: columns_name = 'response_columns.json', report_name = 'response.json'

contains

  !> Computes the response of every file, prints its tables and writes its files.
  subroutine response_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse_files(arguments, analyse_one, code, always_writes=.true.)
  end subroutine response_command

  subroutine analyse_one(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(response_analysis_t) :: analysis
    type(response_summary_t) :: summary

    call analyse_response(input, machine, analysis, error)
    if (.not. allocated(error)) call add_fatigue(input, analysis, error)
    if (allocated(error)) return
    summary = summarise_response(analysis)
    call write_files(input, analysis, summary, folder, error)
    if (allocated(error) .or. arguments%is_given('--quiet')) return
    call print_text(response_text(input%shown_file(), analysis, summary))
    call print_text(input%shown_file() // ': ' // shown_path(folder) // ' has ' // response_table // ', ' // orders_table // &
                    ', ' // columns_name // ' and ' // report_name)
  end subroutine analyse_one

  subroutine write_files(input, analysis, summary, folder, error)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(result_files_t) :: files

    call files%open(folder, [string_t(response_table), string_t(orders_table), string_t(columns_name), string_t(report_name)])
    call put_response_csv(analysis, output_units(input), files%files(1))
    call put_orders_csv(analysis, output_units(input), files%files(2))
    call files%files(3)%put(response_columns_json(analysis, output_units(input)))
    call files%files(4)%put(response_json(input, analysis, summary))
    call files%finish(error)
  end subroutine write_files

end module nocdyn_response_command
