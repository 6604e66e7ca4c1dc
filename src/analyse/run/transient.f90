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
  use nocdyn_outcome, only: failure_sentence, integration_done, integration_interrupted, outcome_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_times, only: check_output_times, output_times
  use nocdyn_posix, only: is_interrupted, remove_file
  use nocdyn_run_settings, only: settings_of
  use nocdyn_run_summary, only: audit_energy, run_summary_t, start_extremes, summary_json, update_extremes, widen_extremes
  use nocdyn_size_limits, only: check_size, choose_method
  use nocdyn_system, only: observer_t, ranges_t
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
  type, extends(observer_t) :: recorder_t
    type(trajectory_table_t) :: table
    type(output_file_t) :: file
    type(run_summary_t) :: summary
    real(wp), allocatable :: row(:)
    real(wp) :: last_time = 0.0_wp         !! of the rows
    real(wp), allocatable :: last_state(:)
    real(wp) :: t_start, t_end
    logical :: follows = .false.   !! whether the columns have been followed between the rows
    class(progress_t), pointer :: progress => null()
  contains
    procedure :: record
    procedure :: stops
    procedure :: tracked_values
    procedure :: take_ranges
  end type recorder_t

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
    type(recorder_t) :: recorder
    type(group_t) :: run
    type(outcome_t) :: outcome
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
    call start_recorder(recorder, formulation, times, folder, progress)
    recorder%summary%method = method
    recorder%summary%notes = [recorder%summary%notes, notes]
    call solve(formulation, settings_of(input, method), times, recorder, outcome, error)
    if (.not. allocated(outcome%status)) then   ! a setting was refused
      call recorder%file%discard()
      return
    end if
    call conclude(outcome, error, recorder)
    call write_results(input, machine, recorder, folder, write_error)
    if (allocated(write_error)) call move_alloc(write_error, error)
    summary = recorder%summary
  end subroutine run_transient

  subroutine start_recorder(recorder, formulation, times, folder, progress)
    type(recorder_t), intent(inout) :: recorder
    class(formulation_t), intent(in) :: formulation
    real(wp), intent(in) :: times(:)
    character(len=*), intent(in) :: folder
    class(progress_t), target, intent(inout) :: progress

    recorder%table = new_trajectory_table(formulation, times(1))
    recorder%t_start = times(1)
    recorder%t_end = times(size(times))
    recorder%progress => progress
    recorder%summary%labels = recorder%table%labels
    recorder%summary%notes = machine_notes(formulation%machine)
    allocate (recorder%row(size(recorder%table%labels)))
    allocate (recorder%last_state(formulation%states + formulation%quadratures), source=0.0_wp)
    recorder%tracked = size(recorder%row)
    call start_extremes(recorder%summary%extremes, size(recorder%row))
    call recorder%file%open(folder, trajectory_file)
    call write_header(recorder%file, recorder%table%labels)
  end subroutine start_recorder

  !> Integrates; an integration that does not reach the end is an error that says why.
  subroutine solve(formulation, settings, times, recorder, outcome, error)
    class(formulation_t), intent(inout) :: formulation
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)
    type(recorder_t), intent(inout) :: recorder
    type(outcome_t), intent(out) :: outcome
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: y(:, :)
    integer(int64) :: began, ended, rate

    y = formulation%start()
    call system_clock(began, rate)
    call integrate(formulation, settings, times, y, recorder, outcome, error)
    call system_clock(ended)
    if (allocated(error)) return
    recorder%summary%wall_time = real(ended - began, wp) / real(rate, wp)
    if (outcome%status(1) /= integration_done) then
      call raise(error, exit_failed, failure_sentence(outcome, 1, formulation, settings%rtol, settings%atol))
    end if
  end subroutine solve

  !> What the summary tells of the whole run.
  subroutine conclude(outcome, error, recorder)
    type(outcome_t), intent(in) :: outcome
    type(error_t), allocatable, intent(in) :: error
    type(recorder_t), intent(inout) :: recorder

    associate (summary => recorder%summary)
      summary%outcome = outcome
      call audit_energy(summary%extremes, summary%notes)
      if (summary%extremes%rows > 0) then
        allocate (summary%account)
        call recorder%table%account(recorder%last_time, recorder%last_state, summary%account)
      end if
      if (.not. allocated(error)) return
      summary%message = error%message
      summary%status = 'failed'
      if (outcome%status(1) == integration_interrupted) summary%status = 'interrupted'
    end associate
  end subroutine conclude

  !> Gives the three files their names once all are written: a full disk leaves the results of an earlier run alone.
  !> The other trajectory file of an earlier run is removed.
  subroutine write_results(input, machine, recorder, folder, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(recorder_t), intent(inout) :: recorder
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(output_file_t) :: input_copy, summary

    call input_copy%open(folder, input_file)
    call input_copy%put(input_text(input))
    call summary%open(folder, summary_file)
    call summary%put(summary_json(input, machine, recorder%summary))
    call recorder%file%complete(trajectory_file, error)
    if (.not. allocated(error)) call input_copy%complete(input_file, error)
    if (.not. allocated(error)) call summary%complete(summary_file, error)
    if (.not. allocated(error)) call name_results(recorder, folder, input_copy, summary, error)
    if (.not. allocated(error)) return
    call recorder%file%discard()
    call input_copy%discard()
    call summary%discard()
  end subroutine write_results

  !> Files that have their names stay if a later one cannot take its own; without a summary.json they are no results.
  subroutine name_results(recorder, folder, input_copy, summary, error)
    type(recorder_t), intent(inout) :: recorder
    character(len=*), intent(in) :: folder
    type(output_file_t), intent(inout) :: input_copy, summary
    type(error_t), allocatable, intent(out) :: error

    call remove_file(folder // '/' // summary_file)
    if (recorder%summary%status == 'done') then
      call remove_file(folder // '/' // partial_file)
      call recorder%file%finish(trajectory_file, error)
    else
      call remove_file(folder // '/' // trajectory_file)
      call recorder%file%finish(partial_file, error)
    end if
    if (.not. allocated(error)) call input_copy%finish(input_file, error)
    if (.not. allocated(error)) call summary%finish(summary_file, error)
  end subroutine name_results

  !> One requested time: a row of the table.
  subroutine record(self, lane, t, y)
    class(recorder_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (lane /= 1) error stop 'nocdyn_transient: a run is one lane'
    call self%table%fill(t, y, self%row)
    call update_extremes(self%summary%extremes, self%row)
    call write_row(self%file, self%row)
    self%last_time = t
    self%last_state(:) = y
  end subroutine record

  !> The columns of the table between its rows.
  subroutine tracked_values(self, lane, t, y, values)
    class(recorder_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: values(:)

    if (lane /= 1) error stop 'nocdyn_transient: a run is one lane'
    call self%table%fill(t, y, values)
    self%follows = .true.
  end subroutine tracked_values

  !> The extremes of the motion; a run that fails at its start has none.
  subroutine take_ranges(self, lane, ranges)
    class(recorder_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(ranges_t), intent(in) :: ranges

    if (lane /= 1) error stop 'nocdyn_transient: a run is one lane'
    if (self%follows) call widen_extremes(self%summary%extremes, ranges)
  end subroutine take_ranges

  !> Stops on Ctrl-C and when the file cannot be written.
  function stops(self, t)
    class(recorder_t), intent(inout) :: self
    real(wp), intent(in) :: t
    logical :: stops

    call self%progress%update((t - self%t_start) / (self%t_end - self%t_start))
    stops = is_interrupted() .or. self%file%has_failed
  end function stops

end module nocdyn_transient
