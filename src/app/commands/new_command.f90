!> nocdyn new: writes a commented input.
module nocdyn_new_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, raise
  use nocdyn_output_file, only: write_file
  use nocdyn_schema_help, only: input_template
  use nocdyn_text, only: quoted, shown_path
  implicit none (type, external)
  private

  public :: new_command

contains

  !> Writes the template of the input; refuses to overwrite a file.
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
        call raise(error, exit_file, quoted(shown_path(path)) // ' exists and was not changed')
      else if (slash == 0) then
        call write_file('.', path, input_template(), error)
      else
        call write_file(path(:max(1, slash - 1)), path(slash + 1:), input_template(), error)
      end if
      if (allocated(error)) then
        call report_error(error, code)
      else
        call print_text(shown_path(path) // ': a commented input; try: nocdyn run ' // shown_path(path))
      end if
    end associate
  end subroutine new_command

end module nocdyn_new_command
