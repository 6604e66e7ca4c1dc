!> nocdyn run: integrates machines and writes their results. Files with errors do not stop the others.
module nocdyn_run_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_companion_command, only: become_companion
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_failed, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_posix, only: is_interrupted, catch_interrupts
  use nocdyn_result_folders, only: refuse_shared_folders, refuse_sweep_folder, result_folder
  use nocdyn_run_files, only: partial_file, run_to_files, wants_netcdf
  use nocdyn_run_summary, only: method_line, run_summary_t, summary_line
  use nocdyn_run_table, only: summary_table
  use nocdyn_text, only: shown_path, string_t, to_text
  use nocdyn_trajectory_file, only: trajectory_file_t
  implicit none (type, external)
  private

  public :: run_command, run_inputs

  !> An input that was read, or why it is refused.
  type :: reading_t
    type(input_t) :: input
    character(len=:), allocatable :: folder   !! of the results
    type(error_t), allocatable :: error
  end type reading_t

contains

  !> Reads all files, then runs those without errors one after the other. If one of them asks for NetCDF, the companion does it.
  subroutine run_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call run_inputs(arguments, code)
  end subroutine run_command

  !> The same, in a program that can write NetCDF if `netcdf` is present.
  subroutine run_inputs(arguments, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    class(trajectory_file_t), intent(in), optional :: netcdf   !! not open
    type(reading_t), allocatable :: readings(:)
    type(string_t), allocatable :: folders(:)
    type(error_t), allocatable :: error
    integer :: i

    code = exit_done
    allocate (readings(size(arguments%operands)), folders(size(arguments%operands)))
    do i = 1, size(readings)
      call read_one(arguments, i, present(netcdf), readings(i))
    end do
    if (.not. present(netcdf)) then
      if (any([(needs_companion(readings(i)), i=1, size(readings))])) then
        call become_companion("format = 'netcdf'", code)
        return
      end if
    end if
    do i = 1, size(readings)
      folders(i)%text = readings(i)%folder
      if (allocated(readings(i)%error)) call report_error(readings(i)%error, code)
    end do
    call refuse_shared_folders(arguments%operands, folders, error)
    if (allocated(error)) then
      call report_error(error, code)
    else
      call run_all(arguments, readings, code, netcdf)
    end if
  end subroutine run_inputs

  subroutine run_all(arguments, readings, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    type(reading_t), intent(in) :: readings(:)
    integer, intent(inout) :: code
    class(trajectory_file_t), intent(in), optional :: netcdf   !! as in `run_inputs`
    type(error_t), allocatable :: error
    integer :: i, left

    call catch_interrupts()
    left = count([(readings(i)%folder /= '', i=1, size(readings))])
    do i = 1, size(readings)
      if (readings(i)%folder == '') cycle
      call run_file(arguments, readings(i)%input, readings(i)%folder, code, netcdf)
      left = left - 1
      if (is_interrupted()) exit
    end do
    if (left == 0) return
    call raise(error, exit_failed, 'files not run after the interruption: ' // to_text(left))
    call report_error(error, code)
  end subroutine run_all

  subroutine read_one(arguments, number, has_netcdf, reading)
    type(arguments_t), intent(in) :: arguments
    integer, intent(in) :: number        !! of the file
    logical, intent(in) :: has_netcdf    !! whether this program can write NetCDF
    type(reading_t), intent(inout) :: reading
    character(len=:), allocatable :: folder
    integer :: bytes

    reading%folder = ''
    associate (file => arguments%operands(number)%text)
      call read_input(file, arguments%overrides, reading%input, reading%error)
      if (allocated(reading%error)) return
      folder = result_folder(arguments, reading%input)
      call refuse_sweep_folder(reading%input%file, folder, reading%error)
      if (allocated(reading%error)) return
      reading%folder = folder
      if (has_netcdf .or. .not. wants_netcdf(reading%input)) return
      inquire (file=file, size=bytes)
      if (bytes > 0) return
      reading%folder = ''
      call raise(reading%error, exit_input, reading%input%shown_file() // &
                 ": format = 'netcdf' needs an input that can be read twice, not a pipe")
    end associate
  end subroutine read_one

  !> Whether an input is to be run, but not by a program that cannot write NetCDF.
  logical function needs_companion(reading)
    type(reading_t), intent(in) :: reading

    needs_companion = reading%folder /= ''
    if (needs_companion) needs_companion = wants_netcdf(reading%input)
  end function needs_companion

  subroutine run_file(arguments, input, folder, code, netcdf)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    integer, intent(inout) :: code
    class(trajectory_file_t), intent(in), optional :: netcdf   !! as in `run_inputs`
    type(run_summary_t) :: summary
    type(error_t), allocatable :: error
    character(len=:), allocatable :: reached
    integer :: i

    call run_to_files(input, folder, input%shown_file(), arguments%is_given('--quiet'), summary, error, netcdf)
    if (allocated(error)) then
      reached = 'there'
      if (summary%extremes%rows > 0) reached = 't = ' // to_text(summary%extremes%last(1)) // ' s'
      if (error%code == exit_failed .and. summary%has_run) then
        error%message = input%shown_file() // ': ' // error%message // '; the rows up to ' // reached // ' are in ' // &
                        shown_path(folder // '/' // partial_file(input))
      end if
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
