!> The files that a run leaves: trajectory.csv or trajectory.nc, columns.json, summary.json, input.nml, and cycles.csv with
!> &fatigue. A run that fails leaves trajectory.partial.csv and cycles.partial.csv.
module nocdyn_run_files
  use nocdyn_column_lists, only: columns_file
  use nocdyn_comparisons, only: append_comparison_files, measured_files, put_comparison_table
  use nocdyn_console, only: new_status_line, status_line_t
  use nocdyn_csv_grid, only: csv_grid_t
  use nocdyn_disk_room, only: check_room
  use nocdyn_errors, only: error_t
  use nocdyn_fatigue_report, only: put_cycles_csv
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_kinds, only: wp
  use nocdyn_posix, only: is_interrupted, remove_file
  use nocdyn_posix_files, only: free_bytes
  use nocdyn_output_times, only: table_bytes
  use nocdyn_result_files, only: result_files_t
  use nocdyn_run_summary, only: columns_json, run_summary_t, summary_json
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_text, only: append, counted, string_t, to_text
  use nocdyn_transient, only: run_output_t, run_transient
  implicit none (type, external)
  private

  public :: check_rows, check_variants, partial_file, remove_run, run_to_files, trajectory_bytes, &
    wants_netcdf

  !> Names of the rows: of a run that is done, of one that is not; as CSV, as NetCDF.
  character(len=22), parameter :: trajectory_names(2, 2) = reshape([character(len=22) :: 'trajectory.csv', &
    'trajectory.partial.csv', 'trajectory.nc', 'trajectory.partial.nc'], [2, 2])
  character(len=*), parameter, public :: summary_file = 'summary.json', input_file = 'input.nml'
  character(len=18), parameter :: cycles_names(2) = [character(len=18) :: 'cycles.csv', 'cycles.partial.csv']   !! likewise

  !> Writes the rows and shows the progress while the run is integrated.
  type, extends(run_output_t) :: trajectory_writer_t
    character(len=:), allocatable :: folder
    class(grid_file_t), allocatable :: file
    character(len=:), allocatable :: input_title, input_text   !! for the file
    integer :: form = 1                      !! column of `trajectory_names`
    character(len=:), allocatable :: title   !! of the progress line
    character(len=:), allocatable :: place   !! of &output in the input, for messages
    type(status_line_t) :: line
    logical :: has_started = .false.         !! whether there is a file
  contains
    procedure :: start
    procedure :: write_row => write_trajectory_row
    procedure :: wants_stop
  end type trajectory_writer_t

contains

  !> Whether the rows of a run are to be written as NetCDF.
  pure logical function wants_netcdf(input)
    type(input_t), intent(in) :: input

    wants_netcdf = input%groups(input%position('output'))%text('format') == 'netcdf'
  end function wants_netcdf

  !> The name of the file with the rows of a run that is not done.
  pure function partial_file(input) result(name)
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: name

    name = trim(trajectory_names(2, merge(2, 1, wants_netcdf(input))))
  end function partial_file

  !> Runs an input and writes its results to `folder`. A run that fails leaves its rows under the name of a partial trajectory.
  subroutine run_to_files(input, folder, title, is_quiet, summary, error, netcdf)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: title         !! of the progress line
    logical, intent(in) :: is_quiet               !! whether there is no progress line
    type(run_summary_t), intent(out) :: summary
    type(error_t), allocatable, intent(out) :: error
    class(grid_file_t), intent(in), optional :: netcdf   !! not open; of programs that can write NetCDF
    type(trajectory_writer_t), target :: writer
    type(error_t), allocatable :: write_error

    if (.not. wants_netcdf(input)) then
      allocate (csv_grid_t :: writer%file)
    else if (present(netcdf)) then
      allocate (writer%file, source=netcdf)
      writer%form = 2
    else
      error stop 'nocdyn_run_files: this program does not write NetCDF'
    end if
    writer%folder = folder
    writer%input_title = input%title()
    writer%input_text = input_text(input)
    writer%title = title
    writer%place = input%location(input%position('output'))
    writer%line = new_status_line(is_quiet, shows_in_logs=.false.)
    call run_transient(input, writer, summary, error)
    if (summary%has_run) then
      call write_results(input, summary, writer, write_error)
      if (allocated(write_error)) call move_alloc(write_error, error)
    else if (writer%has_started) then
      call writer%file%discard()
    end if
    call writer%line%clear()
  end subroutine run_to_files

  !> Gives the files their names once all are written: if the disk is full, the results of an earlier run stay.
  subroutine write_results(input, summary, writer, error)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    type(trajectory_writer_t), intent(inout) :: writer
    type(error_t), allocatable, intent(out) :: error
    type(result_files_t) :: files   ! but for the rows
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: name
    integer :: first, i

    allocate (names, source=[string_t(input_file)])
    call append(names, columns_file)
    if (size(summary%fatigue%items) > 0) call append(names, trim(cycles_names(state_of(summary))))
    first = size(names)
    call append_comparison_files(summary%comparisons, measured_files, names)
    call append(names, summary_file)
    call files%open(writer%folder, names)
    call files%files(1)%put(input_text(input))
    call files%files(2)%put(columns_json(summary, trim(trajectory_names(state_of(summary), writer%form))))
    if (size(summary%fatigue%items) > 0) call put_cycles_csv(summary%fatigue, files%files(3))
    do i = first + 1, size(names) - 1
      call put_comparison_table(summary%comparisons, names(i)%text, files%files(i))
    end do
    call files%files(size(names))%put(summary_json(input, summary))
    call writer%file%complete(trim(trajectory_names(1, writer%form)), error)
    if (.not. allocated(error)) call files%complete(error)
    if (.not. allocated(error)) then
      ! Removes the trajectories of an earlier run under other names. summary.json goes first and comes last: without it there are
      ! no results, if a file in between cannot take its name.
      name = trim(trajectory_names(state_of(summary), writer%form))
      call remove_run(writer%folder, name)
      call writer%file%finish(name, error)
      if (.not. allocated(error)) call files%finish(error)
    end if
    if (.not. allocated(error)) return
    call writer%file%discard()
    call files%discard()
  end subroutine write_results

  !> Row of `trajectory_names` and `cycles_names`.
  pure integer function state_of(summary) result(state)
    type(run_summary_t), intent(in) :: summary

    state = merge(1, 2, summary%status == 'done')
  end function state_of

  !> Removes the results of a run in a folder, but for input.nml.
  subroutine remove_run(folder, kept)
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: kept   !! name of a trajectory that stays, '': none
    integer :: i, k

    call remove_file(folder // '/' // summary_file)
    call remove_file(folder // '/' // columns_file)
    do i = 1, size(cycles_names)
      call remove_file(folder // '/' // trim(cycles_names(i)))
    end do
    do k = 1, size(trajectory_names, 2)
      do i = 1, size(trajectory_names, 1)
        if (trajectory_names(i, k) /= kept) call remove_file(folder // '/' // trim(trajectory_names(i, k)))
      end do
    end do
  end subroutine remove_run

  !> Opens the file and writes its header.
  subroutine start(self, labels, rows, error)
    class(trajectory_writer_t), intent(inout) :: self
    type(string_t), intent(in) :: labels(:)   !! of the columns
    integer, intent(in) :: rows               !! their number
    type(error_t), allocatable, intent(out) :: error   !! there is no room for them

    call check_rows(self%place, rows, size(labels), self%form == 2, self%folder, error)
    if (allocated(error)) return
    call self%file%open(self%folder, trim(trajectory_names(1, self%form)), [string_t('t')], [rows], self%input_title, &
                        self%input_text)
    call self%file%begin_table(labels, 1)
    self%has_started = .true.
  end subroutine start

  !> Refuses more rows than there is room for.
  subroutine check_rows(place, rows, columns, is_netcdf, folder, error)
    character(len=*), intent(in) :: place    !! of &output in the input
    integer, intent(in) :: rows, columns     !! their numbers
    logical, intent(in) :: is_netcdf         !! whether they are written as NetCDF
    character(len=*), intent(in) :: folder   !! of the results
    type(error_t), allocatable, intent(out) :: error

    call check_room(place // ': ' // to_text(rows) // ' rows of ' // to_text(columns) // ' columns', &
                    trajectory_bytes(rows, columns, is_netcdf), free_bytes(folder), folder, &
                    'ask for fewer rows by points or interval, or for some columns', error)
  end subroutine check_rows

  !> About the size of the file with the rows of a run [bytes].
  pure real(wp) function trajectory_bytes(rows, columns, is_netcdf)
    integer, intent(in) :: rows, columns
    logical, intent(in) :: is_netcdf
    real(wp), parameter :: of_number = 8.0_wp, of_variable = 9.0e3_wp   ! its name, its units, its reference to the time

    trajectory_bytes = table_bytes(rows, columns)
    if (is_netcdf) trajectory_bytes = columns * (of_number * rows + of_variable)
  end function trajectory_bytes

  !> Refuses more variants than there is room for.
  subroutine check_variants(plan, variants, has_table, folder, held, error)
    type(sweep_plan_t), intent(in) :: plan
    integer, intent(in) :: variants          !! of the journal
    logical, intent(in) :: has_table         !! whether there is a sweep.csv
    character(len=*), intent(in) :: folder   !! of the results
    real(wp), intent(in) :: held             !! what a journal to resume has taken already [bytes]
    type(error_t), allocatable, intent(out) :: error

    call check_room(plan%input%location(plan%input%position('sweep')) // ': the files of ' // &
                    counted(variants, 'variant', 'variants'), plan%file_bytes(variants, has_table) - held, &
                    free_bytes(folder), folder, 'ask for fewer variants, results or trajectories', error)
  end subroutine check_variants

  !> Writes a row.
  subroutine write_trajectory_row(self, row)
    class(trajectory_writer_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)   !! [columns]

    call self%file%put_row(row)
  end subroutine write_trajectory_row

  !> Shows the progress. The run stops after Ctrl-C, and if the file cannot be written.
  function wants_stop(self, fraction)
    class(trajectory_writer_t), intent(inout) :: self
    real(wp), intent(in) :: fraction   !! of the time span, 0 to 1
    logical :: wants_stop
    real(wp) :: left   ! [s]

    if (self%line%is_due()) then
      left = self%line%elapsed() * (1.0_wp - fraction) / max(fraction, epsilon(fraction))
      call self%line%show(self%title // ': ' // to_text(int(100.0_wp * fraction)) // ' %, ' // &
                          to_text(int(min(left, 1.0e8_wp)) + 1) // ' s left')
    end if
    wants_stop = is_interrupted() .or. self%file%has_failed()
  end function wants_stop

end module nocdyn_run_files
