!> nocdyn modes: natural frequencies and mode shapes of machines.
module nocdyn_modes_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text
  use nocdyn_errors, only: error_t, exit_failed
  use nocdyn_holzer_report, only: holzer_tables
  use nocdyn_input, only: input_t
  use nocdyn_input_files, only: analyse_files
  use nocdyn_machine, only: machine_t
  use nocdyn_modes_files, only: modes_csv, modes_json
  use nocdyn_modes_report, only: modes_report_t, modes_text, new_modes_report
  use nocdyn_operating_point, only: find_operating_point, operating_point_t
  use nocdyn_output_units, only: output_units
  use nocdyn_result_files, only: result_files_t
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: modes_command

contains

  !> Prints the modes of every file; with --out, writes modes.csv and modes.json.
  subroutine modes_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse_files(arguments, analyse_modes, code)
  end subroutine modes_command

  subroutine analyse_modes(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder   !! '': nothing is written
    type(error_t), allocatable, intent(out) :: error
    type(operating_point_t) :: point
    type(modes_report_t) :: report
    type(result_files_t) :: files
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: csv, printed

    if (arguments%is_given('--at')) then
      call find_operating_point(input, machine, arguments%value('--at'), point, error)
    else
      call find_operating_point(input, machine, 'equilibrium', point, error)
    end if
    if (.not. allocated(error)) call new_modes_report(point, report, error)
    if (allocated(error)) then
      if (error%code == exit_failed) error%message = input%shown_file() // ': ' // error%message
      return
    end if
    if (arguments%is_given('--holzer')) then
      call holzer_tables(report, printed, csv, error)
      if (allocated(error)) then
        error%message = input%shown_file() // ': ' // error%message
        return
      end if
    end if
    call print_text(modes_text(input%shown_file(), report, output_units(input)))
    if (arguments%is_given('--holzer')) call print_text(printed)
    if (folder == '') return
    allocate (names(0))
    if (arguments%is_given('--holzer')) call append(names, 'holzer.csv')
    call append(names, 'modes.csv')
    call append(names, 'modes.json')
    call files%open(folder, names)
    associate (n => size(names))
      if (n > 2) call files%files(1)%put(csv)
      call files%files(n - 1)%put(modes_csv(report))
      call files%files(n)%put(modes_json(input, report))
    end associate
    call files%finish(error)
  end subroutine analyse_modes

end module nocdyn_modes_command
