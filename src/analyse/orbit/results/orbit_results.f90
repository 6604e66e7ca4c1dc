!> Periodic motions over a number of the input, as an analysis: orbit.csv, orbit.json, and chosen motions.
module nocdyn_orbit_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_log, only: journal_name, orbit_log_t
  use nocdyn_orbit_measures, only: measure_orbits, measured_orbits_t
  use nocdyn_orbit_records, only: find_orbit_number
  use nocdyn_orbit_report, only: motion_name, put_orbit
  use nocdyn_orbit_tables, only: orbit_columns_json, orbit_table, put_harmonics_csv, put_motion_csv, put_motion_harmonics_csv, &
    put_orbit_csv
  use nocdyn_orbit_verdict, only: find_orbit_verdict
  use nocdyn_orbit_words, only: orbit_text
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  character(len=*), parameter :: columns_name = 'orbit_columns.json', harmonics_table = 'orbit_harmonics.csv', &
    motion_harmonics = 'motion_harmonics.csv', partial = 'orbit.partial.csv'
  integer, parameter :: most_motions = 999   ! of an earlier analysis whose files are removed

  type, extends(analysis_t), public :: orbit_results_t
    type(measured_orbits_t), private :: analysis
    type(orbit_log_t), pointer, private :: log => null()   !! its journal
  contains
    procedure :: solve, list_tables, other_names, put_table, judge, put_report, find_recorded, text => printed
  end type orbit_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(orbit_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error

    if (.not. allocated(options%journal)) then
      call measure_orbits(input, machine, self%analysis, error)
      return
    end if
    allocate (self%log)
    call self%log%open(input, options%journal, options%resumes, error)
    if (allocated(error)) return
    call measure_orbits(input, machine, self%analysis, error, self%log)
    if (allocated(error)) call self%log%remove()
    if (.not. allocated(error)) self%is_unfinished = self%analysis%is_unfinished
  end subroutine solve

  subroutine list_tables(self, names)
    class(orbit_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)
    integer :: i

    names = [string_t(partial)]
    if (self%is_unfinished) return
    names = [string_t(orbit_table), string_t(columns_name)]
    if (self%analysis%settings%has_spectrum) call append(names, harmonics_table)
    do i = 1, size(self%analysis%motions)
      call append(names, motion_name(i))
    end do
    if (size(self%analysis%motions) > 0) call append(names, motion_harmonics)
  end subroutine list_tables

  !> What an earlier or an interrupted analysis has left; of one that is interrupted, all of an earlier one.
  function other_names(self, input) result(names)
    class(orbit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(string_t), allocatable :: names(:)
    integer :: i, kept

    names = [string_t(partial), string_t(journal_name)]
    if (self%is_unfinished) names = [string_t('orbit.json'), string_t(orbit_table), string_t(columns_name)]
    if (self%is_unfinished .or. .not. self%analysis%settings%has_spectrum) call append(names, harmonics_table)
    kept = 0
    if (.not. self%is_unfinished) kept = size(self%analysis%motions)
    if (kept == 0) call append(names, motion_harmonics)
    do i = kept + 1, most_motions
      call append(names, motion_name(i))
    end do
  end function other_names

  subroutine put_table(self, input, name, file)
    class(orbit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file
    integer :: i

    associate (analysis => self%analysis, wanted => output_units(input))
      select case (name)
      case (orbit_table, partial)
        call put_orbit_csv(analysis, wanted, file)
      case (columns_name)
        call file%put(orbit_columns_json(analysis, wanted))
      case (harmonics_table)
        call put_harmonics_csv(analysis, wanted, file)
      case (motion_harmonics)
        call put_motion_harmonics_csv(analysis, wanted, file)
      case default
        do i = 1, size(analysis%motions)
          if (name == motion_name(i)) call put_motion_csv(analysis, analysis%motions(i), wanted, file)
        end do
      end select
    end associate
  end subroutine put_table

  subroutine judge(self, input)
    class(orbit_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input

    call find_orbit_verdict(input, self%analysis, self%verdict)
  end subroutine judge

  subroutine put_report(self, input, json)
    class(orbit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_orbit(json, input, self%analysis, self%verdict)
  end subroutine put_report

  subroutine find_recorded(self, quantity, statistic, number, value, obstacle)
    class(orbit_results_t), intent(in) :: self
    character(len=*), intent(in) :: quantity, statistic
    integer, intent(in) :: number
    real(wp), intent(out) :: value
    character(len=:), allocatable, intent(out) :: obstacle

    call find_orbit_number(self%analysis, quantity, statistic, number, value, obstacle)
  end subroutine find_recorded

  subroutine printed(self, input, text)
    class(orbit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = orbit_text(input, self%analysis)
  end subroutine printed

end module nocdyn_orbit_results
