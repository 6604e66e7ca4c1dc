!> nocdyn campbell: natural frequencies over the speed, and where the orders meet them.
module nocdyn_campbell_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_campbell, only: analyse_campbell, campbell_t
  use nocdyn_campbell_files, only: campbell_json, put_campbell_csv
  use nocdyn_campbell_report, only: campbell_text
  use nocdyn_console, only: print_text
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_input_files, only: analyse_files
  use nocdyn_machine, only: machine_t
  use nocdyn_output_units, only: output_units
  use nocdyn_result_files, only: result_files_t
  use nocdyn_text, only: shown_path, string_t
  implicit none (type, external)
  private

  public :: campbell_command

  character(len=*), parameter :: table_name = 'campbell.csv', report_name = 'campbell.json'

contains

  !> Follows the modes of every file over the speed, prints tables and writes files.
  subroutine campbell_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse_files(arguments, analyse_one, code, always_writes=.true.)
  end subroutine campbell_command

  subroutine analyse_one(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(campbell_t) :: campbell
    type(result_files_t) :: files

    call analyse_campbell(input, machine, campbell, error)
    if (allocated(error)) return
    associate (body => machine%names(campbell%settings%body)%text)
      call files%open(folder, [string_t(table_name), string_t(report_name)])
      call put_campbell_csv(campbell, body, output_units(input), files%files(1))
      call files%files(2)%put(campbell_json(input, body, campbell))
      call files%finish(error)
      if (allocated(error) .or. arguments%is_given('--quiet')) return
      call print_text(campbell_text(input%shown_file(), body, campbell))
      call print_text(input%shown_file() // ': ' // shown_path(folder) // ' has ' // table_name // ' and ' // report_name)
    end associate
  end subroutine analyse_one

end module nocdyn_campbell_command
