!> Writes the files of a finished sweep, and prints its summary.
module nocdyn_sweep_results
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_arguments, only: arguments_t
  use nocdyn_column_lists, only: columns_file
  use nocdyn_console, only: print_text, report_error
  use nocdyn_errors, only: error_t, exit_done, exit_failed, exit_file, exit_input, raise
  use nocdyn_grid_netcdf, only: netcdf_grid_t
  use nocdyn_posix_files, only: folder_names, remove_empty_folder
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_journal_chunks, only: chunk_cursor_t
  use nocdyn_kinds, only: wp
  use nocdyn_nominal_curves, only: find_nominal_curves, nominal_curves_t
  use nocdyn_order_statistics, only: find_order_statistics
  use nocdyn_output_file, only: write_file
  use nocdyn_posix, only: is_interrupted, remove_file
  use nocdyn_run_files, only: input_file, remove_run, run_to_files, summary_file
  use nocdyn_run_summary, only: run_summary_t
  use nocdyn_sweep_bands, only: bands_file, new_bands
  use nocdyn_sweep_chunk, only: chunk_t, status_refused
  use nocdyn_sweep_netcdf, only: write_sweep_netcdf
  use nocdyn_sweep_header, only: sweep_netcdf_name, sweep_header_t
  use nocdyn_sweep_journal, only: sweep_journal_t
  use nocdyn_sweep_plan, only: sweep_plan_t, without_sweep
  use nocdyn_sweep_summary, only: sweep_columns_json, sweep_json, sweep_line, sweep_note, sweep_summary_t, sweep_table
  use nocdyn_sweep_csv, only: sweep_csv_name, write_sweep_csv
  use nocdyn_targets, only: set_targets
  use nocdyn_text, only: shown_path, string_t, to_text
  use nocdyn_varied_numbers, only: varied_numbers_t
  implicit none (type, external)
  private

  public :: write_results, print_results

  character(len=*), parameter :: variant_folder = 'variant-'

contains

  !> Writes all files of a sweep whose variants are all in the journals. Once sweep.nc is written, files of an earlier sweep or
  !> run in the folder are removed.
  subroutine write_results(plan, folder, journals, arguments, summary, error)
    type(sweep_plan_t), intent(in) :: plan
    character(len=*), intent(in) :: folder
    type(sweep_journal_t), intent(inout) :: journals(:)
    type(arguments_t), intent(in) :: arguments
    type(sweep_summary_t), intent(inout) :: summary   !! with the effort, but for a merge
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: began, now, rate
    type(string_t), allocatable :: names(:)
    integer :: i
    logical :: is_of_variant

    call system_clock(began, rate)
    summary%done = sum(journals%done)
    summary%refused = sum(journals%refused)
    summary%failed = sum(journals%failed)
    call find_order_statistics(journals, summary%statistics, error)
    if (.not. allocated(error)) call write_sweep_netcdf(folder, journals, error)
    if (.not. allocated(error)) then
      ! Removes results of an earlier sweep or run. Other files stay, and so do the folders with other files.
      call remove_run(folder, '')
      if (.not. arguments%is_given('--csv')) call remove_file(folder // '/' // sweep_csv_name)
      allocate (names, source=folder_names(folder))
      do i = 1, size(names)
        associate (name => names(i)%text)
          is_of_variant = index(name, variant_folder) == 1 .and. len(name) > len(variant_folder)
          if (is_of_variant) is_of_variant = verify(name(len(variant_folder) + 1:), '0123456789') == 0
          if (.not. is_of_variant) cycle
          call remove_run(folder // '/' // name, '')
          call remove_file(folder // '/' // name // '/' // input_file)
          call remove_empty_folder(folder // '/' // name)
        end associate
      end do
    end if
    if (.not. allocated(error)) call write_bands(plan%input, folder, journals(1)%header, summary, error)
    if (.not. allocated(error) .and. arguments%is_given('--csv')) call write_sweep_csv(folder, journals, error)
    if (.not. allocated(error)) call write_trajectories(plan, folder, journals, arguments, summary%without_trajectory, error)
    if (.not. allocated(error)) call write_file(folder, input_file, input_text(plan%input), error)
    if (.not. allocated(error)) call write_file(folder, columns_file, sweep_columns_json(journals(1)%header, summary), &
                                              error)
    call system_clock(now)
    if (allocated(summary%effort)) summary%effort%writing_time = real(now - began, wp) / real(rate, wp)
    if (.not. allocated(error)) call write_file(folder, summary_file, sweep_json(plan%input, journals(1)%header, summary), error)
    if (summary%done == 0 .and. .not. allocated(error)) call find_first_reason(journals, summary%first_reason, error)
  end subroutine write_results

  !> Writes the bands of curves, or removes those of an earlier sweep.
  subroutine write_bands(input, folder, header, summary, error)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    type(sweep_header_t), intent(in) :: header
    type(sweep_summary_t), intent(inout) :: summary   !! with the order statistics
    type(error_t), allocatable, intent(out) :: error
    type(nominal_curves_t) :: nominal

    if (header%axis%points_in_use() == 0 .or. summary%done == 0) then
      call remove_file(folder // '/' // bands_file)
      return
    end if
    call find_nominal_curves(input, nominal, error)
    if (allocated(error)) return
    allocate (summary%bands)
    call new_bands(header, nominal, summary%statistics, summary%bands)
    call summary%bands%write_table(folder, error)
  end subroutine write_bands

  !> Prints the summary. A sweep without any variant done is a failure.
  subroutine print_results(plan, folder, header, arguments, summary, code)
    type(sweep_plan_t), intent(in) :: plan
    character(len=*), intent(in) :: folder
    type(sweep_header_t), intent(in) :: header
    type(arguments_t), intent(in) :: arguments
    type(sweep_summary_t), intent(in) :: summary   !! from `write_results`
    integer, intent(out) :: code                   !! 1 if no variant is done
    type(error_t), allocatable :: error
    character(len=:), allocatable :: note

    code = exit_done
    if (.not. arguments%is_given('--quiet')) then
      if (summary%done > 0) call print_text(sweep_table(header, summary))
      note = sweep_note(plan%input, summary)
      if (note /= '') call print_text(note)
      call print_text(sweep_line(plan%input, summary, folder))
    end if
    if (summary%done > 0) return
    call raise(error, exit_failed, plan%input%shown_file() // ': no variant can be computed; reason of the first one: ' // &
               summary%first_reason // '; all reasons are in ' // shown_path(folder // '/' // sweep_netcdf_name))
    call report_error(error, code)
  end subroutine print_results

  !> The reason why the first variant of a sweep is not done.
  subroutine find_first_reason(journals, reason, error)
    type(sweep_journal_t), intent(inout) :: journals(:)
    character(len=:), allocatable, intent(out) :: reason
    type(error_t), allocatable, intent(out) :: error
    type(chunk_cursor_t) :: cursor
    type(chunk_t) :: chunk
    logical :: is_there

    call cursor%rewind_to_start(journals)
    call cursor%next_chunk(journals, chunk, is_there, error)
    if (.not. allocated(error)) reason = chunk%reasons(1)%text
  end subroutine find_first_reason

  !> Runs the chosen variants again as `nocdyn run` does, with the values from the journals. A variant that fails leaves a partial
  !> trajectory; a refused one leaves none.
  subroutine write_trajectories(plan, folder, journals, arguments, refused, error)
    type(sweep_plan_t), intent(in) :: plan
    character(len=*), intent(in) :: folder
    type(sweep_journal_t), intent(inout) :: journals(:)
    type(arguments_t), intent(in) :: arguments
    integer, allocatable, intent(out) :: refused(:)   !! variants without a trajectory
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: input
    type(run_summary_t) :: summary
    type(netcdf_grid_t) :: netcdf
    real(wp) :: values(size(plan%numbers%targets))
    character(len=:), allocatable :: message
    integer :: i, status

    allocate (refused(0))
    do i = 1, size(plan%trajectories)
      associate (variant => plan%trajectories(i))
        input = plan%input
        call find_values(journals, variant, plan%numbers, values, status, error)
        if (allocated(error)) return
        call set_targets(input, plan%numbers%targets, values, message)
        if (status == status_refused .or. message /= '') then
          refused = [refused, variant]
          cycle
        end if
        call run_to_files(without_sweep(input), folder // '/' // variant_folder // to_text(variant), &
                          folder // '/' // variant_folder // to_text(variant), arguments%is_given('--quiet'), summary, error, &
                          netcdf)
      end associate
      if (is_interrupted()) then
        call raise(error, exit_failed, plan%input%shown_file() // ': interrupted while trajectories were written; ' // &
                   'repeat the command with --resume to continue')
      else if (allocated(error)) then
        if (error%code == exit_input) refused = [refused, plan%trajectories(i)]   ! its output times, which the sweep ignores
        if (error%code /= exit_file) deallocate (error)   ! the reason of a failure is in sweep.nc
      end if
      if (allocated(error)) return
    end do
  end subroutine write_trajectories

  !> The values of the targets in one variant, and its status.
  subroutine find_values(journals, variant, numbers, values, status, error)
    type(sweep_journal_t), intent(inout) :: journals(:)   !! of which one holds the variant
    integer, intent(in) :: variant
    type(varied_numbers_t), intent(in) :: numbers
    real(wp), intent(out) :: values(:)   !! [targets]
    integer, intent(out) :: status       !! status_...
    type(error_t), allocatable, intent(out) :: error
    type(chunk_t) :: chunk
    integer :: i, k

    values = 0.0_wp
    status = status_refused
    do k = 1, size(journals)
      i = journals(k)%entry_of(variant)
      if (i == 0) cycle
      call journals(k)%read_entry(i, chunk, error)
      if (allocated(error)) return
      call numbers%target_values(chunk%parameters(:, variant - chunk%first + 1), values)
      status = chunk%status(variant - chunk%first + 1)
      return
    end do
    error stop 'nocdyn_sweep_results: the trajectory of a variant is asked for that no journal holds'
  end subroutine find_values

end module nocdyn_sweep_results
