!> nocdyn merge: combines the parts of a sweep.
module nocdyn_merge_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, exit_input, raise
  use nocdyn_input_reader, only: read_input_text
  use nocdyn_journal_chunks, only: check_sweep
  use nocdyn_posix, only: catch_interrupts
  use nocdyn_result_folders, only: normalised_path
  use nocdyn_sweep_design, only: find_planned_numbers
  use nocdyn_sweep_journal, only: journal_names, open_journal, sweep_journal_t
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_recorded_quantities, only: wanted_trajectories
  use nocdyn_sweep_results, only: print_results, write_results
  use nocdyn_sweep_summary, only: sweep_summary_t
  use nocdyn_text, only: shown_path, string_t, strings
  implicit none (type, external)
  private

  public :: merge_command

contains

  !> Merges the folder that is the operand.
  subroutine merge_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(error_t), allocatable :: error

    code = exit_done
    call catch_interrupts()
    call merge_folder(normalised_path(arguments%operands(1)%text), arguments, code, error)
    if (.not. allocated(error)) return
    call report_error(error, code)
  end subroutine merge_command

  !> Writes and prints the results of all journals of a folder.
  subroutine merge_folder(folder, arguments, code, error)
    character(len=*), intent(in) :: folder
    type(arguments_t), intent(in) :: arguments
    integer, intent(inout) :: code
    type(error_t), allocatable, intent(out) :: error
    type(sweep_journal_t), allocatable :: journals(:)
    type(sweep_plan_t) :: plan   ! without a design, which the results do not need
    type(string_t), allocatable :: labels(:)
    type(sweep_summary_t) :: summary
    integer :: i

    call open_journals(folder, journals, error)
    if (.not. allocated(error)) call check_sweep(journals, error)
    if (allocated(error)) return
    associate (header => journals(1)%header)
      call read_input_text(header%input_text, header%input_file, strings([character(len=1) ::]), plan%input, error)
      if (allocated(error)) return
      allocate (labels(size(header%parameters)))
      do i = 1, size(labels)
        labels(i)%text = header%parameters(i)%label
      end do
      call find_planned_numbers(plan%input, labels, plan%numbers)
    end associate
    allocate (plan%trajectories, source=wanted_trajectories(plan%input))
    call write_results(plan, folder, journals, arguments, summary, error)
    if (.not. allocated(error)) call print_results(plan, folder, journals(1)%header, arguments, summary, code)
  end subroutine merge_folder

  !> Opens all journals of a folder.
  subroutine open_journals(folder, journals, error)
    character(len=*), intent(in) :: folder
    type(sweep_journal_t), allocatable, intent(out) :: journals(:)
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    integer :: i
    logical :: is_folder, is_there

    inquire (file=folder, exist=is_there)
    inquire (file=folder // '/.', exist=is_folder)
    allocate (names, source=journal_names(folder))
    if (.not. is_there) then
      call raise(error, exit_file, shown_path(folder) // ': there is no such folder')
    else if (.not. is_folder) then
      call raise(error, exit_file, shown_path(folder) // ': is not a folder; nocdyn merge needs the folder of the journals')
    else if (size(names) == 0) then
      call raise(error, exit_input, shown_path(folder) // ': the folder holds no journal of a sweep; ' // &
                 'nocdyn sweep FILE --shard K/N writes them')
    end if
    if (allocated(error)) return
    allocate (journals(size(names)))
    do i = 1, size(names)
      call open_journal(folder, names(i)%text, journals(i), error)
      if (allocated(error)) return
      call journals(i)%file%close()
    end do
  end subroutine open_journals

end module nocdyn_merge_command
