!> nocdyn new: a commented input to start from, of all groups or of a kind of machine.
module nocdyn_new_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_built_in_texts, only: find_built_in
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, exit_input, raise
  use nocdyn_output_file, only: write_file
  use nocdyn_schema_help, only: input_template
  use nocdyn_schema_text, only: suggest
  use nocdyn_text, only: joined, quoted, shortened, shown_path, string_t
  implicit none (type, external)
  private

  public :: new_command

contains

  !> Writes the template of the input; refuses to overwrite a file.
  subroutine new_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    character(len=:), allocatable :: text
    type(error_t), allocatable :: error
    integer :: slash
    logical :: exists

    code = exit_done
    call find_text(arguments, text, error)
    associate (path => arguments%operands(1)%text)
      inquire (file=path, exist=exists)
      slash = index(path, '/', back=.true.)
      if (allocated(error)) then
        continue
      else if (exists) then
        call raise(error, exit_file, quoted(shown_path(path)) // ' exists and was not changed')
      else if (slash == 0) then
        call write_file('.', path, text, error)
      else
        call write_file(path(:max(1, slash - 1)), path(slash + 1:), text, error)
      end if
      if (allocated(error)) then
        call report_error(error, code)
      else
        call print_text(shown_path(path) // ': a commented input; try: nocdyn run ' // shown_path(path))
      end if
    end associate
  end subroutine new_command

  !> The text that is written: of --kind, else the one of all groups.
  subroutine find_text(arguments, text, error)
    type(arguments_t), intent(in) :: arguments
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error   !! there is no such kind
    character(len=:), allocatable :: hint
    logical :: is_near
    type(string_t), allocatable :: kinds(:)

    if (.not. arguments%is_given('--kind')) then
      text = input_template()
      return
    end if
    call find_built_in('template', arguments%value('--kind'), text, kinds)
    if (allocated(text)) return
    call suggest(arguments%value('--kind'), kinds, hint, is_near)
    if (is_near) hint = hint // '; allowed: ' // joined(kinds, ', ')
    call raise(error, exit_input, '--kind: ' // quoted(shortened(arguments%value('--kind'))) // ' is no kind of machine' // hint)
  end subroutine find_text

end module nocdyn_new_command
