!> Periodic motions over a number of the input, as an analysis: orbit.csv and orbit.json.
module nocdyn_orbit_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_analysis, only: analyse_orbits, orbit_analysis_t
  use nocdyn_orbit_log, only: journal_name, orbit_log_t
  use nocdyn_orbit_records, only: find_orbit_number
  use nocdyn_orbit_report, only: put_orbit, put_orbit_csv
  use nocdyn_orbit_words, only: orbit_text
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  character(len=*), parameter :: partial = 'orbit.partial.csv'

  type, extends(analysis_t), public :: orbit_results_t
    type(orbit_analysis_t), private :: analysis
    type(orbit_log_t), pointer, private :: log => null()   !! its journal
  contains
    procedure :: solve, list_tables, other_names, put_table, put_report, find_recorded, text => printed
  end type orbit_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(orbit_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error

    if (.not. allocated(options%journal)) then
      call analyse_orbits(input, machine, self%analysis, error)
      return
    end if
    allocate (self%log)
    call self%log%open(input, options%journal, options%resumes, error)
    if (.not. allocated(error)) call analyse_orbits(input, machine, self%analysis, error, self%log)
    if (.not. allocated(error)) self%is_unfinished = self%analysis%is_unfinished
  end subroutine solve

  subroutine list_tables(self, names)
    class(orbit_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    names = [string_t('orbit.csv')]
    if (self%is_unfinished) names = [string_t(partial)]
  end subroutine list_tables

  !> What an interrupted analysis has left; of one that is interrupted, those of an earlier one.
  function other_names(self, input) result(names)
    class(orbit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(string_t), allocatable :: names(:)

    names = [string_t(partial), string_t(journal_name)]
    if (self%is_unfinished) names = [string_t('orbit.json'), string_t('orbit.csv')]
  end function other_names

  subroutine put_table(self, input, name, file)
    class(orbit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    call put_orbit_csv(input, self%analysis, file)
  end subroutine put_table

  subroutine put_report(self, input, json)
    class(orbit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_orbit(json, input, self%analysis)
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
