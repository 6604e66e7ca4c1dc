!> nocdyn equilibrium: steady states of machines.
module nocdyn_equilibrium_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text
  use nocdyn_equilibrium, only: equilibrium_t, find_equilibria, find_stability, t_infinity
  use nocdyn_equilibrium_report, only: equilibrium_json, equilibrium_report_t, equilibrium_text, new_equilibrium_report
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_input_files, only: analyse_files
  use nocdyn_machine, only: machine_t
  use nocdyn_output_file, only: write_file
  use nocdyn_output_units, only: output_units
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: equilibrium_command

contains

  !> Prints the steady states of every file; with --out, writes equilibrium.json.
  subroutine equilibrium_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse_files(arguments, analyse_equilibria, code)
  end subroutine equilibrium_command

  subroutine analyse_equilibria(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder   !! '': nothing is written
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(equilibrium_report_t) :: report
    type(string_t), allocatable :: notes(:)

    call find_equilibria(machine, t_infinity, formulation, equilibria, notes, error)
    if (.not. allocated(error)) then
      call find_stability(formulation, t_infinity, equilibria)
      call new_equilibrium_report(formulation, equilibria, notes, output_units(input), report, error)
    end if
    if (allocated(error)) then
      error%message = input%shown_file() // ': ' // error%message
      return
    end if
    call print_text(equilibrium_text(input%shown_file(), report))
    if (folder /= '') call write_file(folder, 'equilibrium.json', equilibrium_json(input, report), error)
  end subroutine analyse_equilibria

end module nocdyn_equilibrium_command
