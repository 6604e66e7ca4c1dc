!> nocdyn new: a commented input to start from, of all groups or of a kind of machine.
module nocdyn_new_command
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_ptr, c_size_t
  use nocdyn_arguments, only: arguments_t
  use nocdyn_c_texts, only: copy_text
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, exit_input, raise
  use nocdyn_output_file, only: write_file
  use nocdyn_schema_help, only: input_template
  use nocdyn_schema_text, only: suggestion
  use nocdyn_text, only: append, joined, quoted, shortened, shown_path, string_t
  implicit none (type, external)
  private

  public :: new_command

  interface
    !> Kind and text number `number`, from 1, of template_texts.cpp; `kind` is null beyond the last one.
    subroutine c_template(number, kind, kind_length, text, length) bind(c, name='nocdyn_template')
      import :: c_int, c_ptr, c_size_t
      integer(c_int), value, intent(in) :: number
      type(c_ptr), intent(out) :: kind, text
      integer(c_size_t), intent(out) :: kind_length, length
    end subroutine c_template
  end interface

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
    character(len=:), allocatable :: name
    type(string_t), allocatable :: kinds(:)
    type(c_ptr) :: kind, content
    integer(c_size_t) :: kind_length, length
    integer(c_int) :: number

    if (.not. arguments%is_given('--kind')) then
      text = input_template()
      return
    end if
    allocate (kinds(0))
    number = 1
    do
      call c_template(number, kind, kind_length, content, length)
      if (.not. c_associated(kind)) exit
      call copy_text(kind, kind_length, name)
      call append(kinds, name)
      if (name == arguments%value('--kind')) call copy_text(content, length, text)
      number = number + 1
    end do
    if (allocated(text)) return
    call raise(error, exit_input, '--kind: ' // quoted(shortened(arguments%value('--kind'))) // ' is no kind of machine' // &
               suggestion(arguments%value('--kind'), kinds) // '; allowed: ' // joined(kinds, ', '))
  end subroutine find_text

end module nocdyn_new_command
