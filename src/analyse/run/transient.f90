!> What does the machine do over time: integrates an input and writes its results.
module nocdyn_transient
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_notes
  use nocdyn_solver_status, only: failure_message, integration_done, integration_interrupted, solver_status_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_times, only: check_output_times, output_times
  use nocdyn_posix, only: is_interrupted, remove_file
  use nocdyn_run_settings, only: settings_of
  use nocdyn_run_summary, only: check_energy_balance, run_summary_t, start_extremes, summary_json, update_extremes, widen_extremes
  use nocdyn_size_limits, only: check_size, choose_method
  use nocdyn_observer, only: observer_t, ranges_t
  use nocdyn_text, only: string_t
  use nocdyn_trajectory_table, only: new_trajectory_table, trajectory_table_t
  implicit none (type, external)
  private

  public :: run_transient

  character(len=*), parameter, public :: trajectory_file = 'trajectory.csv', partial_file = 'trajectory.partial.csv'
  character(len=*), parameter, public :: summary_file = 'summary.json', input_file = 'input.nml'

  !> Told how far a run has come, after every step.
  type, abstract, public :: progress_t
  contains
    procedure(update_interface), deferred :: update
  end type progress_t

  abstract interface
    subroutine update_interface(self, fraction)
      import :: progress_t, wp
      class(progress_t), intent(inout) :: self
      real(wp), intent(in) :: fraction   !! of the time span, 0 to 1
    end subroutine update_interface
  end interface

  !> Writes the rows and keeps the extremes of their columns.
  type, extends(observer_t) :: run_observer_t
    type(trajectory_table_t) :: table
    type(output_file_t) :: file
    type(run_summary_t) :: summary
    real(wp), allocatable :: row(:)
    real(wp) :: last_time = 0.0_wp         !! of the rows
    real(wp), allocatable :: last_state(:)
    real(wp) :: t_start, t_end
    logical :: has_ranges = .false.   !! whether the columns have been followed between the rows
    class(progress_t), pointer :: progress => null()
  contains
    procedure :: on_output
    procedure :: wants_stop
    procedure :: tracked_values
    procedure :: on_extremes
  end type run_observer_t

contains

  !> Runs an input and leaves trajectory.csv, summary.json and input.nml in `folder`; a run that fails leaves
  !> trajectory.partial.csv instead of trajectory.csv.
  subroutine run_transient(input, folder, progress, summary, error)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    class(progress_t), target, intent(inout) :: progress
    type(run_summary_t), intent(out) :: summary
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: machine
    class(formulation_t), allocatable :: formulation
    type(run_observer_t) :: observer
    type(group_t) :: run
    type(solver_status_t) :: solver_status
    type(error_t), allocatable :: write_error
    type(string_t), allocatable :: notes(:)
    character(len=:), allocatable :: method
    real(wp), allocatable :: times(:)

    call check_output_times(input, error)
    if (.not. allocated(error)) call assemble_machine(input, machine, error)
    if (.not. allocated(error)) call check_size(input, machine, error)
    if (allocated(error)) return
    run = input%single('run')
    call new_formulation(run%text('formulation'), machine, formulation)
    call choose_method(input, formulation, method, notes, error)
    if (allocated(error)) return
    times = output_times(input)
    call start_recorder(observer, formulation, times, folder, progress)
    observer%summary%method = method
    observer%summary%notes = [observer%summary%notes, notes]
    call solve(formulation, settings_of(input, method), times, observer, solver_status, error)
    if (.not. allocated(solver_status%code)) then   ! a setting was refused
      call observer%file%discard()
      return
    end if
    call complete_summary(solver_status, error, observer)
    call write_results(input, machine, observer, folder, write_error)
    if (allocated(write_error)) call move_alloc(write_error, error)
    summary = observer%summary
  end subroutine run_transient

  subroutine start_recorder(observer, formulation, times, folder, progress)
    type(run_observer_t), intent(inout) :: observer
    class(formulation_t), intent(in) :: formulation
    real(wp), intent(in) :: times(:)
    character(len=*), intent(in) :: folder
    class(progress_t), target, intent(inout) :: progress

    observer%table = new_trajectory_table(formulation, times(1))
    observer%t_start = times(1)
    observer%t_end = times(size(times))
    observer%progress => progress
    observer%summary%labels = observer%table%labels
    observer%summary%notes = machine_notes(formulation%machine)
    allocate (observer%row(size(observer%table%labels)))
    allocate (observer%last_state(formulation%states + formulation%quadratures), source=0.0_wp)
    observer%tracked = size(observer%row)
    call start_extremes(observer%summary%extremes, size(observer%row))
    call observer%file%open(folder, trajectory_file)
    call write_header(observer%file, observer%table%labels)
  end subroutine start_recorder

  !> Integrates; an integration that does not reach the end is an error that says why.
  subroutine solve(formulation, settings, times, observer, solver_status, error)
    class(formulation_t), intent(inout) :: formulation
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)
    type(run_observer_t), intent(inout) :: observer
    type(solver_status_t), intent(out) :: solver_status
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: y(:, :)
    integer(int64) :: began, ended, rate

    y = formulation%start()
    call system_clock(began, rate)
    call integrate(formulation, settings, times, y, observer, solver_status, error)
    call system_clock(ended)
    if (allocated(error)) return
    observer%summary%wall_time = real(ended - began, wp) / real(rate, wp)
    if (solver_status%code(1) /= integration_done) then
      call raise(error, exit_failed, failure_message(solver_status, 1, formulation, settings%rtol, settings%atol))
    end if
  end subroutine solve

  !> What the summary tells of the whole run.
  subroutine complete_summary(solver_status, error, observer)
    type(solver_status_t), intent(in) :: solver_status
    type(error_t), allocatable, intent(in) :: error
    type(run_observer_t), intent(inout) :: observer

    associate (summary => observer%summary)
      summary%solver_status = solver_status
      call check_energy_balance(summary%extremes, summary%notes)
      if (summary%extremes%rows > 0) then
        allocate (summary%energy_balance)
        call observer%table%find_energy_balance(observer%last_time, observer%last_state, summary%energy_balance)
      end if
      if (.not. allocated(error)) return
      summary%message = error%message
      summary%status = 'failed'
      if (solver_status%code(1) == integration_interrupted) summary%status = 'interrupted'
    end associate
  end subroutine complete_summary

  !> Gives the three files their names once all are written: a full disk leaves the results of an earlier run alone.
  !> The other trajectory file of an earlier run is removed.
  subroutine write_results(input, machine, observer, folder, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(run_observer_t), intent(inout) :: observer
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(output_file_t) :: input_copy, summary

    call input_copy%open(folder, input_file)
    call input_copy%put(input_text(input))
    call summary%open(folder, summary_file)
    call summary%put(summary_json(input, machine, observer%summary))
    call observer%file%complete(trajectory_file, error)
    if (.not. allocated(error)) call input_copy%complete(input_file, error)
    if (.not. allocated(error)) call summary%complete(summary_file, error)
    if (.not. allocated(error)) call name_results(observer, folder, input_copy, summary, error)
    if (.not. allocated(error)) return
    call observer%file%discard()
    call input_copy%discard()
    call summary%discard()
  end subroutine write_results

  !> Files that have their names stay if a later one cannot take its own; without a summary.json they are no results.
  subroutine name_results(observer, folder, input_copy, summary, error)
    type(run_observer_t), intent(inout) :: observer
    character(len=*), intent(in) :: folder
    type(output_file_t), intent(inout) :: input_copy, summary
    type(error_t), allocatable, intent(out) :: error

    call remove_file(folder // '/' // summary_file)
    if (observer%summary%status == 'done') then
      call remove_file(folder // '/' // partial_file)
      call observer%file%finish(trajectory_file, error)
    else
      call remove_file(folder // '/' // trajectory_file)
      call observer%file%finish(partial_file, error)
    end if
    if (.not. allocated(error)) call input_copy%finish(input_file, error)
    if (.not. allocated(error)) call summary%finish(summary_file, error)
  end subroutine name_results

  !> One requested time: a row of the table.
  subroutine on_output(self, lane, t, y)
    class(run_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (lane /= 1) error stop 'nocdyn_transient: a run is one lane'
    call self%table%fill(t, y, self%row)
    call update_extremes(self%summary%extremes, self%row)
    call write_row(self%file, self%row)
    self%last_time = t
    self%last_state(:) = y
  end subroutine on_output

  !> The columns of the table between its rows.
  subroutine tracked_values(self, lane, t, y, values)
    class(run_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: values(:)

    if (lane /= 1) error stop 'nocdyn_transient: a run is one lane'
    call self%table%fill(t, y, values)
    self%has_ranges = .true.
  end subroutine tracked_values

  !> The extremes of the motion; a run that fails at its start has none.
  subroutine on_extremes(self, lane, ranges)
    class(run_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(ranges_t), intent(in) :: ranges

    if (lane /= 1) error stop 'nocdyn_transient: a run is one lane'
    if (self%has_ranges) call widen_extremes(self%summary%extremes, ranges)
  end subroutine on_extremes

  !> Stops on Ctrl-C and when the file cannot be written.
  function wants_stop(self, t)
    class(run_observer_t), intent(inout) :: self
    real(wp), intent(in) :: t
    logical :: wants_stop

    call self%progress%update((t - self%t_start) / (self%t_end - self%t_start))
    wants_stop = is_interrupted() .or. self%file%has_failed
  end function wants_stop

end module nocdyn_transient
