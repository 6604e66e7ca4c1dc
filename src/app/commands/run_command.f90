!> nocdyn run: integrates machines and writes their results. Files with errors do not stop the others.
module nocdyn_run_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_failed, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_posix, only: is_interrupted, catch_interrupts
  use nocdyn_result_folders, only: refuse_shared_folders, refuse_sweep_folder, result_folder
  use nocdyn_run_files, only: partial_file, run_to_files
  use nocdyn_run_summary, only: method_line, run_summary_t, summary_line
  use nocdyn_run_table, only: summary_table
  use nocdyn_text, only: shown_path, string_t, to_text
  implicit none (type, external)
  private

  public :: run_command

contains

  !> Reads all files, then runs those without errors one after the other.
  subroutine run_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files
    type(input_t), allocatable :: inputs(:)
    type(string_t), allocatable :: folders(:)
    type(error_t), allocatable :: error
    integer :: i, left

    code = exit_done
    allocate (inputs(size(arguments%operands)), folders(size(arguments%operands)))
    do i = 1, size(inputs)
      folders(i)%text = ''
      call read_input(arguments%operands(i)%text, arguments%overrides, inputs(i), error)
      if (.not. allocated(error)) call refuse_sweep_folder(inputs(i)%file, result_folder(arguments, inputs(i)), error)
      if (allocated(error)) then
        call report_error(error, code)
      else
        folders(i)%text = result_folder(arguments, inputs(i))
      end if
    end do
    call refuse_shared_folders(arguments%operands, folders, error)
    if (allocated(error)) then
      call report_error(error, code)
      return
    end if
    call catch_interrupts()
    left = count([(folders(i)%text /= '', i=1, size(folders))])
    do i = 1, size(inputs)
      if (folders(i)%text == '') cycle
      call run_file(arguments, inputs(i), folders(i)%text, code)
      left = left - 1
      if (is_interrupted()) exit
    end do
    if (left == 0) return
    call raise(error, exit_failed, 'files not run after the interruption: ' // to_text(left))
    call report_error(error, code)
  end subroutine run_command

  subroutine run_file(arguments, input, folder, code)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    integer, intent(inout) :: code
    type(run_summary_t) :: summary
    type(error_t), allocatable :: error
    character(len=:), allocatable :: reached
    integer :: i

    call run_to_files(input, folder, input%shown_file(), arguments%is_given('--quiet'), summary, error)
    if (allocated(error)) then
      reached = 'there'
      if (summary%extremes%rows > 0) reached = 't = ' // to_text(summary%extremes%last(1)) // ' s'
      if (error%code == exit_failed) error%message = input%shown_file() // ': ' // error%message // '; the rows up to ' // &
                                                     reached // ' are in ' // shown_path(folder // '/' // partial_file)
      call report_error(error, code)
    else if (.not. arguments%is_given('--quiet')) then
      do i = 1, size(summary%notes)
        call print_text(input%shown_file() // ': note: ' // summary%notes(i)%text)
      end do
      if (size(arguments%operands) == 1) call print_text(summary_table(input, summary))
      if (len(method_line(input, summary)) > 0) call print_text(method_line(input, summary))
      call print_text(summary_line(input, summary, folder))
    end if
  end subroutine run_file

end module nocdyn_run_command
