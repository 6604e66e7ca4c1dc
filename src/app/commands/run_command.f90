!> nocdyn run: integrates every file, goes on past a bad one, and tells what came out.
module nocdyn_run_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: complain, console_progress_t, new_console_progress, say
  use nocdyn_errors, only: error_t, exit_done, exit_failed, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_posix, only: is_interrupted, watch_interrupts
  use nocdyn_result_folders, only: plain_path, refuse_shared_folders, refuse_sweep_folder, result_folder, stem
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
    logical :: is_good(size(arguments%operands))
    integer :: i

    code = exit_done
    allocate (inputs(size(arguments%operands)), folders(size(arguments%operands)))
    do i = 1, size(inputs)
      call read_input(arguments%operands(i)%text, arguments%overrides, inputs(i), error)
      is_good(i) = .not. allocated(error)
      folders(i)%text = ''
      if (is_good(i)) then
        folders(i)%text = folder_of(arguments, inputs(i))
        call refuse_sweep_folder(inputs(i)%file, folders(i)%text, error)
        is_good(i) = .not. allocated(error)
      end if
      if (.not. is_good(i)) call count_failure(error, code)
    end do
    call refuse_shared_folders(arguments%operands, folders, is_good, error)
    if (allocated(error)) then
      call count_failure(error, code)
      return
    end if
    call watch_interrupts()
    do i = 1, size(inputs)
      if (is_good(i)) call run_file(arguments, inputs(i), folders(i)%text, code)
      if (is_interrupted()) exit
    end do
    if (any(is_good(i + 1:))) then
      call raise(error, exit_failed, 'files not run after the interruption: ' // to_text(count(is_good(i + 1:))))
      call count_failure(error, code)
    end if
  end subroutine run_command

  subroutine count_failure(error, code)
    type(error_t), intent(in) :: error
    integer, intent(inout) :: code

    call complain(error)
    code = max(code, error%code)
  end subroutine count_failure

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
      call count_failure(error, code)
    else if (.not. arguments%is_quiet) then
      do i = 1, size(summary%notes)
        call say(input%file // ': note: ' // summary%notes(i)%text)
      end do
      if (size(arguments%operands) == 1) call say(summary_table(input, summary))
      if (len(method_line(input, summary)) > 0) call say(method_line(input, summary))
      call say(summary_line(input, summary, folder))
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
      folder = plain_path(arguments%out)
      if (size(arguments%operands) > 1) folder = folder // '/' // stem(input%file)
    end if
  end function folder_of

end module nocdyn_run_command
