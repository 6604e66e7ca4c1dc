!> What the three main programs have in common: from the command line to the exit code.
module nocdyn_program
  use nocdyn_arguments, only: arguments_t
  use nocdyn_command_line, only: command_line, parse_command_line
  use nocdyn_commands, only: command_index, command_t
  use nocdyn_console, only: output_is_lost, print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, exit_input, raise
  use nocdyn_help_command, only: help_command
  use nocdyn_posix, only: ignore_file_size_signal
  use nocdyn_text, only: append, quoted
  use nocdyn_variant_choice, only: choose_variant
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  public :: run_program

contains

  !> Runs the command that the command line names.
  subroutine run_program(name, topic, commands, prints, code)
    character(len=*), intent(in) :: name         !! of the program
    character(len=*), intent(in) :: topic        !! of `help` without operands, '': all commands
    type(command_t), intent(in) :: commands(:)   !! those without a procedure are refused
    logical, intent(in) :: prints                !! whether this process prints help and errors; one of an MPI job does
    integer, intent(out) :: code                 !! exit code
    type(arguments_t) :: arguments
    type(error_t), allocatable :: error

    code = exit_done
    call ignore_file_size_signal()
    call parse_command_line(command_line(), commands, arguments, error)
    if (.not. allocated(error)) then
      if (arguments%command == 'help') then
        if (size(arguments%operands) == 0 .and. topic /= '') call append(arguments%operands, topic)
        if (prints) call help_command(commands, arguments, code)
      else if (arguments%command == 'version') then
        if (prints) call print_text('nocdyn ' // version // ' (' // compiler_text // ')')
      else
        associate (command => commands(command_index(commands, arguments%command)))
          if (associated(command%run)) then
            call choose_variant(command, arguments, error)
            if (.not. allocated(error)) call command%run(arguments, code)
          else
            call raise(error, exit_input, name // ' has no command ' // quoted(command%name) // '; use nocdyn ' // command%name)
          end if
        end associate
      end if
    end if
    if (allocated(error) .and. prints) call report_error(error, code)
    if (.not. output_is_lost) return
    call raise(error, exit_file, 'standard output cannot be written')
    call report_error(error, code)
  end subroutine run_program

end module nocdyn_program
