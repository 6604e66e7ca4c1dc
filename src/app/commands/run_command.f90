!> nocdyn run: integrates every file, goes on past a bad one, and tells what came out.
module nocdyn_run_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: report_error, console_progress_t, new_console_progress, print_text
  use nocdyn_errors, only: error_t, exit_done, exit_failed, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_posix, only: is_interrupted, catch_interrupts
  use nocdyn_result_folders, only: normalised_path, refuse_shared_folders, refuse_sweep_folder, result_folder, stem
  use nocdyn_run_summary, only: run_summary_t
  use nocdyn_summary_table, only: method_line, summary_line, summary_table
  use nocdyn_text, only: string_t, to_text
  use nocdyn_transient, only: partial_file, run_transient
  implicit none (type, external)
  private

  public :: run_command

contains

  !> Reads all files, then runs those without mistakes one after the other.
  subroutine run_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the worst of all files
    type(input_t), allocatable :: inputs(:)
    type(string_t), allocatable :: folders(:)
    type(error_t), allocatable :: error
    logical :: is_valid(size(arguments%operands))
    integer :: i

    code = exit_done
    allocate (inputs(size(arguments%operands)), folders(size(arguments%operands)))
    do i = 1, size(inputs)
      call read_input(arguments%operands(i)%text, arguments%overrides, inputs(i), error)
      is_valid(i) = .not. allocated(error)
      folders(i)%text = ''
      if (is_valid(i)) then
        folders(i)%text = folder_of(arguments, inputs(i))
        call refuse_sweep_folder(inputs(i)%file, folders(i)%text, error)
        is_valid(i) = .not. allocated(error)
      end if
      if (.not. is_valid(i)) call report_failure(error, code)
    end do
    call refuse_shared_folders(arguments%operands, folders, is_valid, error)
    if (allocated(error)) then
      call report_failure(error, code)
      return
    end if
    call catch_interrupts()
    do i = 1, size(inputs)
      if (is_valid(i)) call run_file(arguments, inputs(i), folders(i)%text, code)
      if (is_interrupted()) exit
    end do
    if (any(is_valid(i + 1:))) then
      call raise(error, exit_failed, 'files not run after the interruption: ' // to_text(count(is_valid(i + 1:))))
      call report_failure(error, code)
    end if
  end subroutine run_command

  subroutine report_failure(error, code)
    type(error_t), intent(in) :: error
    integer, intent(inout) :: code

    call report_error(error)
    code = max(code, error%code)
  end subroutine report_failure

  subroutine run_file(arguments, input, folder, code)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    integer, intent(inout) :: code
    type(console_progress_t) :: progress
    type(run_summary_t) :: summary
    type(error_t), allocatable :: error
    integer :: i

    progress = new_console_progress(input%file, arguments%is_quiet)
    call run_transient(input, folder, progress, summary, error)
    call progress%clear()
    if (allocated(error)) then
      if (error%code == exit_failed) error%message = input%file // ': ' // error%message // '; the rows up to there are in ' // &
                                                     folder // '/' // partial_file
      call report_failure(error, code)
    else if (.not. arguments%is_quiet) then
      do i = 1, size(summary%notes)
        call print_text(input%file // ': note: ' // summary%notes(i)%text)
      end do
      if (size(arguments%operands) == 1) call print_text(summary_table(input, summary))
      if (len(method_line(input, summary)) > 0) call print_text(method_line(input, summary))
      call print_text(summary_line(input, summary, folder))
    end if
  end subroutine run_file

  !> --out, in which each of several files gets a folder of its own; else that of the file.
  function folder_of(arguments, input) result(folder)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: folder

    if (.not. allocated(arguments%out)) then
      folder = result_folder(input)
    else
      folder = normalised_path(arguments%out)
      if (size(arguments%operands) > 1) folder = folder // '/' // stem(input%file)
    end if
  end function folder_of

end module nocdyn_run_command
