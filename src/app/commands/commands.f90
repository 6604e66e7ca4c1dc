!> The commands that integrate nothing: check, matrices, new, help, --version.
module nocdyn_commands
  use nocdyn_arguments, only: arguments_t, command_names
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_console, only: report_error, print_text
  use nocdyn_errors, only: error_t, exit_done, exit_file, exit_input, raise
  use nocdyn_help, only: command_help
  use nocdyn_input, only: group_t, input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_report
  use nocdyn_matrix_report, only: matrix_report
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_output_file, only: write_file
  use nocdyn_output_times, only: check_output_times
  use nocdyn_schema, only: group_rule_index
  use nocdyn_schema_help, only: group_help, input_help, input_template
  use nocdyn_sweep_plan, only: add_plan_diagnostics, has_sweep, make_plan, sweep_plan_t
  use nocdyn_text, only: joined, lower_case, quoted
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  public :: check_command, matrices_command, new_command, help_command, version_command

contains

  !> Reads and analyses every file; one report each, and the worst exit code.
  subroutine check_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(input_t) :: input
    type(machine_t) :: machine
    type(error_t), allocatable :: error
    character(len=:), allocatable :: sweep
    integer :: i

    code = exit_done
    do i = 1, size(arguments%operands)
      call read_machine(arguments, i, input, machine, error)
      if (.not. allocated(error)) call check_sweep(input, sweep, error)
      if (allocated(error)) then
        call report_error(error)
        code = max(code, error%code)
      else
        call print_text(machine_report(input%file, machine) // sweep)
      end if
    end do
  end subroutine check_command

  !> The line of a report about the sweep of the machine.
  subroutine check_sweep(input, text, error)
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text   !! '' if there are no groups of a sweep
    type(error_t), allocatable, intent(out) :: error
    type(sweep_plan_t) :: plan

    text = ''
    if (.not. has_sweep(input)) return
    call make_plan(input, plan, error)
    if (.not. allocated(error)) text = new_line('a') // '  sweep: ' // plan%summary()
  end subroutine check_sweep

  subroutine read_machine(arguments, number, input, machine, error)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number   !! of the file
    type(input_t), intent(out) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(diagnostics_t) :: diagnostics

    call read_input(arguments%operands(number)%text, arguments%overrides, input, error, diagnostics)
    if (allocated(error)) call add_plan_diagnostics(input, diagnostics, error)
    if (.not. allocated(error)) call check_output_times(input, error)
    if (.not. allocated(error)) call assemble_machine(input, machine, error)
  end subroutine read_machine

  !> Prints every matrix of one file.
  subroutine matrices_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(input_t) :: input
    type(machine_t) :: machine
    type(group_t) :: run
    type(error_t), allocatable :: error

    code = exit_done
    call read_machine(arguments, 1, input, machine, error)
    if (allocated(error)) then
      call report_error(error)
      code = error%code
      return
    end if
    run = input%single('run')
    call print_text(matrix_report(machine, run%number('t_start')))
  end subroutine matrices_command

  !> Writes a commented input to start from; a file that exists is left alone.
  subroutine new_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(error_t), allocatable :: error
    integer :: slash
    logical :: exists

    code = exit_done
    associate (path => arguments%operands(1)%text)
      inquire (file=path, exist=exists)
      slash = index(path, '/', back=.true.)
      if (exists) then
        call raise(error, exit_file, quoted(path) // ' exists; it was left as it is')
      else if (slash == 0) then
        call write_file('.', path, input_template(), error)
      else
        call write_file(path(:max(1, slash - 1)), path(slash + 1:), input_template(), error)
      end if
      if (allocated(error)) then
        call report_error(error)
        code = error%code
      else
        call print_text(path // ': a commented input; try: nocdyn run ' // path)
      end if
    end associate
  end subroutine new_command

  !> help, help COMMAND, help input, help input GROUP.
  subroutine help_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text

    code = exit_done
    associate (topics => arguments%operands)
      if (size(topics) == 0) then
        call print_text(command_help(''))
      else if (topics(1)%text == 'input' .and. size(topics) <= 2) then
        if (size(topics) == 1) text = input_help()
        if (size(topics) == 2) call group_help(topics(2)%text, text, error)
        if (.not. allocated(error)) call print_text(text)
      else if (size(topics) == 1 .and. len(command_help(topics(1)%text)) > 0) then
        call print_text(command_help(topics(1)%text))
      else if (group_rule_index(lower_case(topics(1)%text)) > 0) then
        call raise(error, exit_input, quoted(topics(1)%text) // ' is a group of the input: nocdyn help input ' // topics(1)%text)
      else
        call raise(error, exit_input, 'there is no help on ' // joined(topics, ' ') // '; try ' // &
                   joined(command_names(), ', ') // " or 'input'")
      end if
    end associate
    if (.not. allocated(error)) return
    call report_error(error)
    code = error%code
  end subroutine help_command

  !> Prints version and compiler.
  subroutine version_command(code)
    integer, intent(out) :: code

    code = exit_done
    call print_text('nocdyn ' // version // ' (' // compiler_text() // ')')
  end subroutine version_command

end module nocdyn_commands
