!> The report of nocdyn check on a machine, as an analysis: check.json.
module nocdyn_check_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_check_file, only: put_check
  use nocdyn_column_names, only: count_columns
  use nocdyn_damper_report, only: damper_table
  use nocdyn_disk_room, only: bytes_text
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_input_speeds, only: given_speeds, named_speeds_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_report
  use nocdyn_mass_elastic_sheet, only: left_out, put_sheet, sheet_file
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_times, only: output_note
  use nocdyn_row_intervals, only: choose_row_count
  use nocdyn_run_files, only: check_rows, check_variants, trajectory_bytes, wants_netcdf
  use nocdyn_response_settings, only: check_response
  use nocdyn_run_settings, only: check_method, find_lossy_element
  use nocdyn_sweep_plan, only: has_sweep, make_plan, sweep_plan_t
  use nocdyn_table_text, only: append_table
  use nocdyn_text, only: quoted, selected, string_t
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  implicit none (type, external)
  private

  real(wp), parameter :: large = 100.0e6_wp   ! files from this size on are told [bytes]

  type, extends(analysis_t), public :: check_results_t
    type(machine_t), private :: machine
    character(len=:), allocatable, private :: report
  contains
    procedure :: solve, put_report, list_tables, put_table, text => printed
  end type check_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(check_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(sweep_plan_t) :: plan
    character(len=:), allocatable :: note, response, sizes
    type(string_t), allocatable :: notes(:)
    real(wp) :: bytes
    integer :: columns, i, rows
    type(string_t), allocatable :: none(:)

    allocate (notes(0))
    call check_response(input, machine, response, error)
    if (allocated(error)) return
    call find_lossy_element(input, machine, note)
    if (response == '') note = ''   ! check_method refuses what has a meaning for a response only
    if (note == '') call check_method(input, machine, error)
    if (.not. allocated(error)) call count_columns(input, machine, columns, notes, error)
    if (allocated(error)) return
    sizes = response
    if (note /= '') sizes = sizes // new_line('a') // '  note: nocdyn run refuses it: ' // note
    if (output_note(input) /= '') sizes = sizes // new_line('a') // '  note: ' // output_note(input)
    if (.not. allocated(input%load_case)) sizes = sizes // load_cases_line(input)
    if (has_sweep(input)) then
      call make_plan(input, plan, error)
      if (allocated(error) .and. .not. has_load_cases(input)) return
      if (.not. allocated(error)) call move_alloc(plan%notes, notes)   ! those on columns too
      call add_sweep_lines(options%folder, input, plan, sizes, error)
      if (allocated(error)) call move_alloc(error, self%refusal)
    else
      allocate (none(0))
      call choose_row_count(input, machine, rows, none)
      bytes = trajectory_bytes(rows, columns, wants_netcdf(input))
      if (bytes >= large) sizes = sizes // new_line('a') // '  trajectory.' // &
                                  trim(merge('nc ', 'csv', wants_netcdf(input))) // ': about ' // bytes_text(bytes)
      call check_rows(input%location(input%position('output')), rows, columns, wants_netcdf(input), options%folder, &
                      self%refusal)
    end if
    do i = 1, size(notes)
      sizes = sizes // new_line('a') // '  note: ' // notes(i)%text
    end do
    self%report = machine_report(input%shown_file(), machine) // damper_table(input, machine) // &
                  speed_table(input, machine) // sizes
    if (.not. options%writes_files) return
    self%machine = machine
    call left_out(input, notes)
    do i = 1, size(notes)
      self%report = self%report // new_line('a') // '  note: not in ' // sheet_file // ': ' // notes(i)%text
    end do
  end subroutine solve

  subroutine put_report(self, input, json)
    class(check_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_check(json, input, self%machine)
  end subroutine put_report

  !> The mass-elastic sheet.
  subroutine list_tables(self, names)
    class(check_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    allocate (names(1))
    names(1)%text = sheet_file
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(check_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    call put_sheet(input, file)
  end subroutine put_table

  subroutine printed(self, input, text)
    class(check_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = self%report
  end subroutine printed

  !> What the sweep of a machine is. With load cases it may be the one of another one.
  subroutine add_sweep_lines(folder, input, plan, lines, error)
    character(len=*), intent(in) :: folder   !! of the results
    type(input_t), intent(in) :: input
    type(sweep_plan_t), intent(in) :: plan
    character(len=:), allocatable, intent(inout) :: lines
    type(error_t), allocatable, intent(inout) :: error   !! why there is no plan; then why it is too large
    real(wp) :: bytes

    if (allocated(error)) then
      lines = lines // new_line('a') // '  no sweep of this machine: ' // error%message
      deallocate (error)
      return
    end if
    bytes = plan%file_bytes(plan%design%variants, has_table=.false.)
    lines = lines // new_line('a') // '  sweep: ' // plan%summary()
    if (bytes >= large) lines = lines // new_line('a') // '  files: about ' // bytes_text(bytes)
    call check_variants(plan, plan%design%variants, .false., folder, 0.0_wp, error)
  end subroutine add_sweep_lines

  !> Whether a machine has load cases, or is one.
  pure logical function has_load_cases(input)
    type(input_t), intent(in) :: input

    has_load_cases = allocated(input%load_case)
    if (.not. has_load_cases) has_load_cases = size(input%load_cases) > 0
  end function has_load_cases

  !> The names of the load cases, on a line of their own; nothing if there are none.
  function load_cases_line(input) result(text)
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: text
    integer :: c

    text = ''
    do c = 1, size(input%load_cases)
      text = text // ', ' // quoted(input%load_cases(c)%name)
    end do
    if (text /= '') text = new_line('a') // '  load cases: ' // text(3:)
  end function load_cases_line

  !> The start speeds and the other speeds and frequencies of an input, also in rpm and Hz, on lines of their own; zeros are left
  !> out.
  function speed_table(input, machine) result(text)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable :: text
    character(len=*), parameter :: headings(*) = &
      [character(len=36) :: 'speeds at the start, and those given', '[rad/s]', '[rpm]', '[Hz]']
    type(text_buffer_t) :: report
    type(named_speeds_t) :: given
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: moving(:)
    real(wp), allocatable :: speeds(:)   ! [rad/s]
    integer :: b

    allocate (moving, source=pack([(b, b=1, machine%bodies - machine%nodes)], &
                                abs(machine%start_speed(1, :machine%bodies - machine%nodes)) > 0))
    given = given_speeds(input)
    allocate (speeds, source=[machine%start_speed(1, moving), given%speeds])
    allocate (labels(size(speeds)))
    labels(:size(moving)) = selected(machine%names, moving)
    labels(size(moving) + 1:) = given%labels
    text = ''
    if (size(speeds) == 0) return
    call append_table(report, labels, &
                      reshape([speeds, from_si(speeds, unit_rpm), from_si(speeds, unit_hz)], [size(speeds), 3]), &
                      headings, 2, 'more')
    text = report%text()
    text = new_line('a') // text(:len(text) - 1)
  end function speed_table

end module nocdyn_check_results
