!> nocdyn check: reads and analyses machines, integrates nothing.
module nocdyn_check_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_input_files, only: analyse_files
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_report
  use nocdyn_run_settings, only: check_method
  use nocdyn_sweep_plan, only: has_sweep, make_plan, sweep_plan_t
  implicit none (type, external)
  private

  public :: check_command

contains

  !> Prints a report on every file.
  subroutine check_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse_files(arguments, check, code)
  end subroutine check_command

  subroutine check(arguments, input, machine, folder, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(sweep_plan_t) :: plan

    call check_method(input, machine, error)
    if (allocated(error)) return
    if (.not. has_sweep(input)) then
      call print_text(machine_report(input%file, machine))
    else
      call make_plan(input, plan, error)
      if (.not. allocated(error)) then
        call print_text(machine_report(input%file, machine) // new_line('a') // '  sweep: ' // plan%summary())
      end if
    end if
  end subroutine check

end module nocdyn_check_command
