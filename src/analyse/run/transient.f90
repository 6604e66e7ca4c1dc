!> The motion of a machine over time: integrates an input, hands out the rows of its trajectory, and makes a summary.
module nocdyn_transient
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_assembly, only: allocate_formulation, assemble_machine
  use nocdyn_column_names, only: choose_columns
  use nocdyn_equilibrium, only: mean_formulation, t_infinity
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_joint_events, only: describe_shared_joints, list_joint_events
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t, linearise
  use nocdyn_signal_checks, only: check_signals
  use nocdyn_machine, only: machine_t
  use nocdyn_measured_runs, only: find_delays, merged_times, new_run_samples, run_samples_t
  use nocdyn_measurements, only: measured_peak, measured_series, measurement_t, read_measurements
  use nocdyn_missed_states, only: note_missed_state
  use nocdyn_output_times, only: check_output_times, output_note, output_times
  use nocdyn_output_units, only: output_units
  use nocdyn_power_notes, only: note_power_signs
  use nocdyn_row_intervals, only: choose_row_count, note_sparse_rows
  use nocdyn_run_verdict, only: add_damage, add_end, add_run_limits, column_extreme_t
  use nocdyn_run_peaks, only: compare_peaks, list_peak_statistics
  use nocdyn_run_settings, only: check_size, choose_settings
  use nocdyn_run_statistics, only: find_extremes, list_statistics, take_fatigue
  use nocdyn_run_summary, only: check_energy_balance, check_extremes, describe_machine, run_summary_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_statistics_observer, only: new_statistics_observer, statistics_observer_t
  use nocdyn_signals, only: list_signals, signal_t
  use nocdyn_solver_status, only: failure_message, integration_done, integration_interrupted, integration_not_finite, &
    solver_status_t
  use nocdyn_start_transient, only: find_start_transient
  use nocdyn_text, only: append, selected, string_t, to_text
  use nocdyn_damping_notes, only: has_stand_ins, note_stand_ins
  use nocdyn_trajectory_table, only: at_last_row, new_trajectory_table, trajectory_table_t
  use nocdyn_vibration_energy, only: new_vibration, vibration_t
  implicit none (type, external)
  private

  public :: build_formulation, run_transient

  real(wp), parameter :: rest = 1.0e-9_wp   ! a machine that turns less than this stands still, however loose the tolerance [rad]

  !> What a run needs of its caller while it is integrated: somewhere to write the rows, and whether to stop.
  type, abstract, public :: run_output_t
    logical :: shows_motion = .true.   !! whether the rows are to show the vibration
  contains
    procedure(start_interface), deferred :: start
    procedure(write_row_interface), deferred :: write_row
    procedure(wants_stop_interface), deferred :: wants_stop
  end type run_output_t

  abstract interface

    !> Called once, before the first row.
    subroutine start_interface(self, labels, rows, error)
      import :: error_t, run_output_t, string_t
      class(run_output_t), intent(inout) :: self
      type(string_t), intent(in) :: labels(:)   !! of the columns
      integer, intent(in) :: rows               !! their number
      type(error_t), allocatable, intent(out) :: error   !! nothing can be written
    end subroutine start_interface

    !> Called at every output time.
    subroutine write_row_interface(self, row)
      import :: run_output_t, wp
      class(run_output_t), intent(inout) :: self
      real(wp), intent(in) :: row(:)   !! [columns]
    end subroutine write_row_interface

    !> Called after every step: shows the progress, and answers whether the integration is to end here.
    function wants_stop_interface(self, fraction) result(wants_stop)
      import :: run_output_t, wp
      class(run_output_t), intent(inout) :: self
      real(wp), intent(in) :: fraction   !! of the time span, 0 to 1
      logical :: wants_stop
    end function wants_stop_interface

  end interface

  !> Hands out the rows, and keeps the statistics of their columns.
  type, extends(statistics_observer_t) :: run_observer_t
    type(trajectory_table_t) :: table
    real(wp), allocatable :: row(:)          !! [columns]
    integer :: rows = 0
    real(wp), allocatable :: row_times(:)    !! of all rows [s]
    type(run_samples_t) :: samples           !! at measured times
    type(measurement_t), allocatable :: peaks(:)
    integer :: before_peaks = 0              !! number of statistics before the ones of the peaks
    integer, allocatable :: chosen(:)        !! columns that are written
    real(wp), allocatable :: written(:)      !! their values in the row
    type(vibration_t) :: vibration           !! its energy in the rows
    real(wp) :: largest_moment = 0.0_wp      !! of the elements in the rows [N m]
    real(wp) :: atol = 0.0_wp                !! absolute tolerance, at most `rest` [rad]
    real(wp) :: last_time = 0.0_wp           !! of the rows [s]
    real(wp), allocatable :: last_speeds(:)  !! of the bodies at that time [rad/s]
    real(wp), allocatable :: lowest(:), highest(:)   !! speeds of the bodies in the rows [rad/s]
    real(wp) :: first_time, end_time         !! [s]
    integer :: not_finite = 0                !! column of the first row with a number that is not finite, which ends the run
    real(wp) :: failure_time = 0.0_wp        !! of that row [s]
    class(run_output_t), pointer :: output => null()
  contains
    procedure :: on_output, wants_stop
  end type run_observer_t

contains

  !> Runs an input. If the integration fails there is an error and a summary of the rows up to there; if the input is refused
  !> there is no summary: `has_run` is false.
  subroutine run_transient(input, output, summary, error)
    type(input_t), intent(in) :: input
    class(run_output_t), target, intent(inout) :: output   !! receives the rows
    type(run_summary_t), intent(out) :: summary
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable, target :: formulation
    type(run_observer_t), target :: observer
    type(integration_settings_t) :: settings
    type(diagnostics_t) :: diagnostics
    type(string_t), allocatable :: notes(:)
    type(measurement_t), allocatable :: series(:)
    real(wp), allocatable :: correlations(:), times(:)
    integer :: i, rows

    call check_output_times(input, diagnostics)
    call input%refuse(diagnostics, error)
    if (.not. allocated(error)) call build_formulation(input, formulation, settings, notes, error)
    if (allocated(error)) return
    call choose_row_count(input, formulation%machine, rows, notes)
    times = output_times(input, rows)
    call prepare_measurements(input, formulation%machine, times([1, size(times)]), series, observer%peaks, correlations, error)
    if (allocated(error)) return
    observer%samples = new_run_samples(series, times([1, size(times)]))
    summary%method = trim(settings%method)
    call describe_machine(formulation%machine, summary)
    if (output_note(input) /= '') call append(notes, output_note(input))
    call note_damping(formulation%machine, notes)
    do i = 1, size(notes)
      call append(summary%notes, notes(i)%text)
    end do
    call start_observer(observer, input, formulation, times, summary%notes, error)
    if (allocated(error)) return
    observer%output => output
    observer%atol = min(settings%atol, rest)
    observer%table%columns%in_motion = .true.
    call output%start(selected(observer%table%labels, observer%chosen), size(times), error)
    if (allocated(error)) return
    allocate (summary%signals, source=observer%table%signals)
    allocate (summary%labels, source=observer%table%labels)
    allocate (summary%chosen, source=observer%chosen)
    summary%t_start = times(1)
    call observer%samples%attach(formulation, times(1))
    call solve(formulation, settings, merged_times(times, observer%samples%times), observer, summary, error)
    if (summary%has_run) call complete_summary(input, observer, correlations, error, summary)
    if (summary%has_run .and. .not. allocated(error) .and. output%shows_motion) then
      call note_sparse_rows(formulation%machine, observer%lowest, observer%highest, times(2) - times(1), summary%notes)
    end if
    if (.not. summary%has_run .or. allocated(error) .or. allocated(formulation%machine%steady_internal)) return
    if (formulation%joints%count > 0) return   ! which of them a steady state has locked is not known
    call note_missed_state(formulation%machine, observer%last_time, observer%last_speeds, summary%notes)
  end subroutine run_transient

  !> Reads what was measured over the time, and finds the delays of clocks that are to be found, by a run of its own.
  subroutine prepare_measurements(input, machine, span, series, peaks, correlations, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! of the run
    real(wp), intent(in) :: span(2)   !! start and end of the run [s]
    type(measurement_t), allocatable, intent(out) :: series(:), peaks(:)
    real(wp), allocatable, intent(out) :: correlations(:)   !! by which delays were found, [series]
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable, target :: formulation
    type(integration_settings_t) :: settings
    type(string_t), allocatable :: notes(:)
    type(signal_t), allocatable :: signals(:)
    integer :: i

    if (size(input%groups_named('measurement')) > 0) then
      call list_signals(machine, signals)
    else
      allocate (signals(0))
    end if
    call read_measurements(input, [measured_series], signals, series, error)
    if (.not. allocated(error)) call read_measurements(input, [measured_peak], signals, peaks, error)
    if (.not. allocated(error)) then
      do i = 1, size(peaks)
        if (peaks(i)%from >= span(2)) call raise(error, exit_input, input%location(peaks(i)%group, 'from') // ': from = ' // &
                                                 to_text(peaks(i)%from) // ' is not before the end of the run, ' // &
                                                 to_text(span(2)) // ' s')
      end do
    end if
    if (allocated(error)) return
    allocate (correlations(size(series)), source=0.0_wp)
    if (.not. any(series%finds_delay)) return
    call build_formulation(input, formulation, settings, notes, error)
    if (.not. allocated(error)) call find_delays(formulation, settings, span, series, correlations, error)
  end subroutine prepare_measurements

  !> Notes on the damping of the modes about the start angles.
  subroutine note_damping(machine, notes)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, parameter :: most_bodies = 100   ! of a machine whose modes take no time
    class(formulation_t), allocatable :: still
    type(linearisation_t) :: linear
    type(error_t), allocatable :: error
    real(wp), allocatable :: y(:, :)

    if (machine%bodies > most_bodies .or. .not. has_stand_ins(machine)) return
    call mean_formulation(machine, still)
    y = still%start()
    y(1, :machine%coordinates%freedoms) = 0.0_wp
    call linearise(still, t_infinity, y, linear, error)
    if (.not. allocated(error)) call note_stand_ins(machine, linear, notes)
  end subroutine note_damping

  !> The equations of motion of an input, whose machine is made in them.
  subroutine build_formulation(input, formulation, settings, notes, error)
    type(input_t), intent(in) :: input
    class(formulation_t), allocatable, intent(out) :: formulation
    type(integration_settings_t), intent(out) :: settings
    type(string_t), allocatable, intent(out) :: notes(:)   !! on the method
    type(error_t), allocatable, intent(out) :: error

    call allocate_formulation(input%groups(input%position('run'))%text('formulation'), formulation)
    call assemble_machine(input, formulation%machine, error)
    if (.not. allocated(error)) call check_size(input, formulation%machine, error)
    if (.not. allocated(error)) call check_signals(input, formulation%machine, error)
    if (allocated(error)) return
    call formulation%formulate(.true.)
    call choose_settings(input, formulation, settings, notes, error)
  end subroutine build_formulation

  subroutine start_observer(observer, input, formulation, times, notes, error)
    type(run_observer_t), intent(inout) :: observer
    type(input_t), intent(in) :: input
    class(formulation_t), target, intent(inout) :: formulation
    real(wp), intent(in) :: times(:)   !! of the rows [s]
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error   !! columns are asked for that there are not
    type(statistic_t), allocatable :: statistics(:)

    observer%first_time = times(1)
    allocate (observer%row_times, source=times)
    observer%end_time = times(size(times))
    call list_statistics(input, formulation%machine, times(1), statistics)
    observer%before_peaks = size(statistics)
    call list_peak_statistics(observer%peaks, times(1), statistics)
    observer%statistics_observer_t = new_statistics_observer(formulation, statistics, times(1), times(size(times)), &
                                                             may_bend=.false., is_run=.true.)
    observer%table = new_trajectory_table(formulation, times(1), output_units(input))
    observer%vibration = new_vibration(formulation%machine)
    allocate (observer%row(size(observer%table%signals)), source=0.0_wp)
    allocate (observer%lowest(formulation%machine%bodies), source=huge(0.0_wp))
    allocate (observer%highest, source=-observer%lowest)
    allocate (observer%last_speeds, source=0.0_wp * observer%lowest)
    call choose_columns(input, observer%table%signals, observer%chosen, notes, error)
    if (.not. allocated(error)) allocate (observer%written(size(observer%chosen)))
  end subroutine start_observer

  !> Integrates. An integration that does not reach the end is an error that says why.
  subroutine solve(formulation, settings, times, observer, summary, error)
    class(formulation_t), intent(inout) :: formulation
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)   !! [s]
    type(run_observer_t), intent(inout) :: observer
    type(run_summary_t), intent(inout) :: summary
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: shared
    real(wp), allocatable :: y(:, :)
    integer(int64) :: began, ended, rate

    allocate (y, source=formulation%start())
    call system_clock(began, rate)
    call integrate(formulation, settings, times, y, observer, summary%solver_status, error)
    call system_clock(ended)
    if (allocated(error)) return   ! a setting was refused
    summary%has_run = .true.
    if (formulation%joints%count > 0) then
      call list_joint_events(formulation, summary%events)
      call describe_shared_joints(formulation, shared)
      if (shared /= '') call append(summary%notes, shared // ' are redundant where they are locked together; their torques ' // &
                                    'are not unique, the smallest-norm share is reported')
    end if
    summary%wall_time = real(ended - began, wp) / real(rate, wp)
    if (observer%not_finite > 0 .and. any(summary%solver_status%code(1) == [integration_done, integration_interrupted])) then
      summary%solver_status%code(1) = integration_not_finite
      call raise(error, exit_failed, observer%table%labels(observer%not_finite)%text // ' is not a finite number at t = ' // &
                 to_text(observer%failure_time) // ' s')
    else if (summary%solver_status%code(1) /= integration_done) then
      call raise(error, exit_failed, failure_message(summary%solver_status, 1, formulation, settings%rtol, settings%atol))
    end if
  end subroutine solve

  subroutine complete_summary(input, observer, correlations, error, summary)
    type(input_t), intent(in) :: input
    type(run_observer_t), intent(inout) :: observer
    real(wp), intent(in) :: correlations(:)   !! by which delays of series were found
    type(error_t), allocatable, intent(inout) :: error   !! of the integration, or that a number of the summary is not finite
    type(run_summary_t), intent(inout) :: summary
    real(wp), allocatable :: works(:, :)   ! [elements, 1]

    associate (table => observer%table)
      call find_extremes(observer, input, table%unit, observer%row, observer%rows, summary%extremes)
      call take_fatigue(observer, input, table%columns%formulation%machine, size(table%labels), summary%fatigue)
    end associate
    call observer%samples%compare(summary%comparisons)
    summary%comparisons%clock_correlation = correlations
    if (observer%has_begun(1)) call compare_peaks(observer, observer%before_peaks, observer%peaks, summary%comparisons)
    if (.not. allocated(error)) call check_extremes(summary%extremes, summary%labels, error)
    call check_energy_balance(summary%extremes, observer%vibration%largest, &
                              observer%atol * observer%largest_moment, summary%notes)
    if (summary%extremes%rows > 0) then
      allocate (summary%energy_balance)
      call observer%table%find_energy_balance(summary%energy_balance)
      works = reshape(observer%table%works(), [size(observer%table%columns%formulation%machine%with_work), 1])
      call note_power_signs(observer%table%columns%formulation%machine, works, 'J', '', summary%notes)
    end if
    if (.not. allocated(error)) then
      associate (extremes => summary%extremes)
        call find_start_transient(observer%table%columns%formulation%machine, [observer%first_time, observer%end_time], &
                                  summary%signals, max(abs(extremes%lowest), abs(extremes%highest)), &
                                  extremes%lowest_time, extremes%highest_time, summary%transient)
      end associate
    else
      summary%message = error%message
      summary%status = 'failed'
      if (summary%solver_status%code(1) == integration_interrupted) summary%status = 'interrupted'
    end if
    call find_verdict(input, summary)
  end subroutine complete_summary

  !> Compares the extremes and the damage with the limits of the input.
  subroutine find_verdict(input, summary)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(inout) :: summary
    type(column_extreme_t) :: extremes(size(summary%signals))
    integer :: i
    logical :: is_high

    do i = 1, size(extremes)
      is_high = abs(summary%extremes%highest(i)) > abs(summary%extremes%lowest(i))
      extremes(i)%size = max(abs(summary%extremes%lowest(i)), abs(summary%extremes%highest(i)))
      extremes(i)%time = merge(summary%extremes%highest_time(i), summary%extremes%lowest_time(i), is_high)
      if (.not. allocated(summary%transient%has_highest)) cycle
      extremes(i)%is_of_start = merge(summary%transient%has_highest(i), summary%transient%has_lowest(i), is_high)
    end do
    if (summary%extremes%have_begun) call add_run_limits(input, summary%signals, extremes, summary%verdict)
    if (.not. allocated(input%load_case)) call add_damage(summary%fatigue, summary%verdict)   ! that of all cases together counts
    if (summary%status /= 'done') call add_end(input, summary%message, summary%verdict)
  end subroutine find_verdict

  !> One output time: a row of the table.
  subroutine on_output(self, lane, t, y)
    class(run_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp) :: fastest, moments

    if (lane /= 1) error stop 'nocdyn_transient: a run is one lane'
    if (self%not_finite > 0) return
    call self%samples%take(t, y)
    if (abs(self%row_times(self%rows + 1) - t) > 0.0_wp) return   ! something was measured then
    call self%table%fill(t, y, self%row)
    self%not_finite = findloc(is_finite(self%row), .false., dim=1)
    self%failure_time = t
    if (self%not_finite > 0) return
    self%rows = self%rows + 1
    call self%table%columns%find_pace(1, fastest, moments)
    self%largest_moment = max(self%largest_moment, moments)
    associate (formulation => self%table%columns%formulation)
      call self%vibration%include_energy(formulation%machine, formulation%state%elements%stored(1, :), formulation%omega(1, 1:))
      self%lowest(:) = min(self%lowest, formulation%omega(1, 1:))
      self%highest(:) = max(self%highest, formulation%omega(1, 1:))
      self%last_speeds(:) = formulation%omega(1, 1:)
    end associate
    self%written(:) = self%row(self%chosen)
    call self%output%write_row(self%written)
    self%last_time = t
    call self%table%keep_energies(at_last_row, y)
  end subroutine on_output

  !> Whether the caller wants the run to end.
  logical function wants_stop(self, t)
    class(run_observer_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! time reached [s]

    wants_stop = self%output%wants_stop((t - self%first_time) / (self%end_time - self%first_time)) .or. self%not_finite > 0
  end function wants_stop

end module nocdyn_transient
