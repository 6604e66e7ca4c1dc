!> Numbers that are fitted to measurements, as an analysis: fit.csv, fit.json, and fitted.nml, the input with what was
!> found; fit_NAME.csv with the values of each measurement before and after.
module nocdyn_fit_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_comparisons, only: append_comparison_files, fit_files, put_comparison_table
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_fit_problem, only: fit_problem_t, new_fit_problem
  use nocdyn_fit_report, only: fit_csv, machine_fit_t, fit_text, put_fit
  use nocdyn_free_numbers, only: note_starts, set_free_numbers
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_least_squares, only: solution_t, solve_least_squares
  use nocdyn_machine, only: machine_t
  use nocdyn_measurements, only: measured_frequency, measured_order, measured_peak, measured_series, measurement_t, &
    read_measurements
  use nocdyn_output_file, only: output_file_t
  use nocdyn_signals, only: list_signals, signal_t
  use nocdyn_sobol_points, only: sobol_points, sobol_points_t
  use nocdyn_text, only: append, string_t
  use nocdyn_unknowns, only: read_unknowns, unknown_t
  implicit none (type, external)
  private

  character(len=*), parameter :: table_name = 'fit.csv', input_name = 'fitted.nml'

  type, extends(analysis_t), public :: fit_results_t
    type(machine_fit_t), private :: fit
    type(input_t), private :: fitted
  contains
    procedure :: solve, list_tables, put_table, put_report, text => printed
  end type fit_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(fit_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(measurement_t), allocatable :: measurements(:)
    type(fit_problem_t) :: problem
    type(signal_t), allocatable :: signals(:)
    character(len=:), allocatable :: message

    call read_unknowns(input, self%fit%unknowns, error)
    if (allocated(error)) return
    if (size(self%fit%unknowns) == 0) then
      call raise(error, exit_input, input%shown_file() // ': there is no group &unknown; required: for instance ' // &
                 "&unknown target = 'coupling.rubber.stiffness' low = 1e4 high = 4e4 /")
      return
    end if
    call list_signals(machine, signals)
    call read_measurements(input, [measured_series, measured_order, measured_frequency, measured_peak], signals, &
                           measurements, error)
    if (allocated(error)) return
    if (size(measurements) == 0) then
      call raise(error, exit_input, input%shown_file() // ': there is no group &measurement; required: what the unknowns ' // &
                 'are fitted to')
      return
    end if
    call new_fit_problem(input, self%fit%unknowns, measurements, problem, error)
    if (allocated(error)) return
    self%fit%before = problem%comparisons
    call note_starts(input, self%fit%unknowns, self%fit%notes)
    call solve_from_starts(problem, max(1, options%starts), self%fit, error)
    if (allocated(error)) then
      call input%name_case(error)
      return
    end if
    call problem%evaluate(self%fit%solution%x, self%fit%solution%residuals, error)
    if (allocated(error)) return
    self%fit%after = problem%comparisons
    self%fitted = input
    call set_free_numbers(self%fitted, self%fit%unknowns, self%fit%solution%x, message)
    call self%fit%conclude()
  end subroutine solve

  !> Fits from the start and from points of Sobol between the bounds; the best solution counts.
  subroutine solve_from_starts(problem, starts, fit, error)
    type(fit_problem_t), intent(inout) :: problem
    integer, intent(in) :: starts
    type(machine_fit_t), intent(inout) :: fit
    type(error_t), allocatable, intent(out) :: error    !! from all of them
    type(error_t), allocatable :: own
    type(sobol_points_t) :: points
    type(solution_t) :: solution
    real(wp), dimension(size(fit%unknowns)) :: high, low, scale, start
    integer :: i, k

    low = fit%unknowns%low
    high = fit%unknowns%high
    points = sobol_points(size(low), 0)
    fit%starts = starts
    do i = 1, starts
      start = fit%unknowns%start
      if (i > 1) start = low + (high - low) * [(points%coordinate(i, k), k=1, size(low))]
      scale = merge(abs(start), high - low, abs(start) > 0)
      call solve_least_squares(problem, start, low, high, scale, solution, own)
      if (allocated(own)) then
        if (i == 1) error = own
        cycle
      end if
      if (allocated(error)) deallocate (error)
      fit%evaluations = fit%evaluations + solution%evaluations
      if (solution%cost >= fit%solution%cost) cycle
      fit%best_start = i
      fit%solution = solution
    end do
  end subroutine solve_from_starts

  subroutine list_tables(self, names)
    class(fit_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    allocate (names(0))
    call append(names, input_name)
    call append(names, table_name)
    call append_comparison_files(self%fit%after, fit_files, names)
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(fit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    if (name == input_name) then
      call file%put(input_text(self%fitted))
    else if (name == table_name) then
      call fit_csv(self%fit, file)
    else
      call put_comparison_table(self%fit%after, name, file, self%fit%before)
    end if
  end subroutine put_table

  subroutine put_report(self, input, json)
    class(fit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_fit(json, input, self%fit)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(fit_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = fit_text(input%shown_case(), self%fit)
  end subroutine printed

end module nocdyn_fit_results
