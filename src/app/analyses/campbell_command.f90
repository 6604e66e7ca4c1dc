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
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units
  use nocdyn_text, only: shown_path
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
    type(output_file_t) :: report, table

    call analyse_campbell(input, machine, campbell, error)
    if (allocated(error)) return
    associate (body => machine%names(campbell%settings%body)%text)
      call table%open(folder, table_name)
      call put_campbell_csv(campbell, body, output_units(input), table)
      call report%open(folder, report_name)
      call report%put(campbell_json(input, body, campbell))
      call table%complete(table_name, error)
      if (.not. allocated(error)) call report%complete(report_name, error)
      if (.not. allocated(error)) call table%finish(table_name, error)
      if (.not. allocated(error)) call report%finish(report_name, error)
      if (allocated(error)) then
        call table%discard()
        call report%discard()
        return
      end if
      if (arguments%is_given('--quiet')) return
      call print_text(campbell_text(input%shown_file(), body, campbell))
      call print_text(input%shown_file() // ': ' // shown_path(folder) // ' has ' // table_name // ' and ' // report_name)
    end associate
  end subroutine analyse_one

end module nocdyn_campbell_command
