!> nocdyn check: reads and analyses machines, integrates nothing.
module nocdyn_check_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text
  use nocdyn_disk_room, only: bytes_text
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_input_files, only: analyse_files
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_report
  use nocdyn_output_times, only: row_count
  use nocdyn_result_folders, only: result_folder
  use nocdyn_run_files, only: check_rows, check_variants
  use nocdyn_run_settings, only: check_method
  use nocdyn_sweep_plan, only: has_sweep, make_plan, sweep_plan_t
  use nocdyn_trajectory_columns, only: column_count, table_bytes
  implicit none (type, external)
  private

  public :: check_command

  real(wp), parameter :: large = 100.0e6_wp   ! files from this size on are told [bytes]

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
    character(len=:), allocatable :: sizes
    real(wp) :: bytes

    call check_method(input, machine, error)
    if (allocated(error)) return
    sizes = ''
    if (has_sweep(input)) then
      call make_plan(input, plan, error)
      if (allocated(error)) return
      bytes = plan%file_bytes(plan%design%variants, has_table=.false.)
      sizes = new_line('a') // '  sweep: ' // plan%summary()
      if (bytes >= large) sizes = sizes // new_line('a') // '  files: about ' // bytes_text(bytes)
      call check_variants(plan, plan%design%variants, .false., result_folder(arguments, input), 0.0_wp, error)
    else
      bytes = table_bytes(row_count(input), column_count(machine))
      if (bytes >= large) sizes = new_line('a') // '  trajectory.csv: about ' // bytes_text(bytes)
      call check_rows(input%location(input%position('output')), row_count(input), column_count(machine), &
                      result_folder(arguments, input), error)
    end if
    call print_text(machine_report(input%shown_file(), machine) // sizes)
  end subroutine check

end module nocdyn_check_command
