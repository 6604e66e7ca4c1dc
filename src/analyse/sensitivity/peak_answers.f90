!> Peaks of a run, the largest magnitudes of the signals that a &limit judges in it, with their derivatives by numbers.
!>
!> A peak inside of the run moves in time while a number changes, which does not change it to first order: the derivative is that
!> of the signal at the time of the peak. At an end of the run it is the same, because that time stays.
module nocdyn_peak_answers
  use nocdyn_answers, only: answer_t
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: limited_signal
  use nocdyn_machine, only: machine_t
  use nocdyn_measured_runs, only: merged_times
  use nocdyn_reduced, only: reduced_t
  use nocdyn_run_verdict, only: peak_keys
  use nocdyn_sampler, only: sampler, sampler_t
  use nocdyn_signal_values, only: new_signal_values, signal_values_t
  use nocdyn_signals, only: list_signals, signal_t
  use nocdyn_solver_status, only: failure_message, integration_done, solver_status_t
  use nocdyn_statistics, only: statistic_max, statistic_min, statistic_t, statistic_time_of_max, statistic_time_of_min
  use nocdyn_statistics_observer, only: new_statistics_observer, statistics_observer_t
  use nocdyn_text, only: append, joined, rounded_text, string_t
  use nocdyn_transient, only: build_formulation
  use nocdyn_varied_keys, only: run_points, set_key, varied_key_t
  use nocdyn_varied_motions, only: changed_pair_t, varied_motion_t
  implicit none (type, external)
  private

  public :: find_peak_answers

  integer, parameter :: kinds(4) = [statistic_min, statistic_time_of_min, statistic_max, statistic_time_of_max]
  integer, parameter :: lanes = 16             ! of changed machines that are evaluated together
  real(wp), parameter :: fine = 1.0e-10_wp     ! relative tolerance of the run whose peaks are sought
  real(wp), parameter :: usual = 2.0e-9_wp     ! of the derivatives

  !> A peak of a run.
  type :: run_peak_t
    type(signal_t) :: signal
    real(wp) :: value = 0.0_wp   !! with its sign
    real(wp) :: time = 0.0_wp    !! [s]
  end type run_peak_t

contains

  !> Runs an input, and differentiates the peaks. Numbers that change the structure have zeros, and a note.
  subroutine find_peak_answers(input, keys, answers, notes, error)
    type(input_t), intent(in) :: input
    type(varied_key_t), intent(in) :: keys(:)
    type(answer_t), allocatable, intent(out) :: answers(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable, target :: formulation
    type(integration_settings_t) :: settings
    type(string_t), allocatable :: run_notes(:)
    type(run_peak_t), allocatable :: peaks(:)
    type(varied_motion_t) :: motion
    type(machine_t) :: wide
    integer, allocatable :: numbers(:)
    real(wp), allocatable :: slopes(:, :)
    real(wp) :: from, span(2)
    integer :: i

    call build_formulation(input, formulation, settings, run_notes, error)
    if (allocated(error)) return
    if (formulation%joints%count > 0) then
      call raise(error, exit_input, input%shown_case() // ': --peaks: the peaks of a machine with joints that lock or move ' // &
                 'have no derivatives here; allowed: couplings, gears and loads without clutches, freewheels, cranks and ' // &
                 'teeth with losses')
      return
    end if
    associate (run => input%groups(input%position('run')), output => input%groups(input%position('output')))
      span = [run%number('t_start'), run%number('t_end')]
      from = output%number('extremes_from', absent=span(1))
    end associate
    call formulate(formulation%machine, motion%machine)
    settings%rtol = min(settings%rtol, fine)
    settings%atol = min(settings%atol, 0.01_wp * fine)
    call find_peaks(input, formulation, settings, span, from, peaks, error)
    if (.not. allocated(error)) call change_machines(input, keys, motion, numbers, notes, error)
    if (.not. allocated(error)) call assemble_machine(input, wide, error, lanes)
    if (.not. allocated(error)) then
      call motion%prepare(wide)
      settings%method = 'rk853'
      settings%rtol = usual
      call differentiate_peaks(motion, settings, span(1), peaks, slopes, error)
    end if
    if (allocated(error)) then
      error%message = input%shown_case() // ': --peaks: ' // error%message
      return
    end if
    allocate (answers(size(peaks)))
    do i = 1, size(peaks)
      associate (peak => peaks(i))
        call answers(i)%set('peak of a run', peak%signal%name // ' at ' // rounded_text(peak%time, 6) // ' s', peak%signal%unit, &
                            abs(peak%value))
        allocate (answers(i)%derivative(size(keys)), source=0.0_wp)
        answers(i)%derivative(numbers) = sign(1.0_wp, peak%value) * slopes(i, :)
        if (peak%time > from .and. peak%time < span(2)) cycle
        call append(notes, 'the peak of ' // peak%signal%name // ' is at an end of the time in which it is sought: its ' // &
                    'derivatives are those of the value at that time')
      end associate
    end do
  end subroutine find_peak_answers

  !> The peaks of a run of all limited signals, each once.
  subroutine find_peaks(input, formulation, settings, span, from, peaks, error)
    type(input_t), intent(in) :: input
    class(formulation_t), target, intent(inout) :: formulation   !! at its start
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: span(2), from    !! of the run, and start of the time in which peaks are sought [s]
    type(run_peak_t), allocatable, intent(out) :: peaks(:)
    type(error_t), allocatable, intent(out) :: error
    type(signal_t), allocatable :: signals(:)
    type(solver_status_t) :: status
    type(statistic_t), allocatable :: statistics(:)
    type(statistics_observer_t) :: observer
    integer, allocatable :: columns(:)
    real(wp), allocatable :: y(:, :)
    real(wp) :: found(size(kinds))
    integer :: i, k

    call list_signals(formulation%machine, signals)
    call list_limited(input, signals, columns)
    if (size(columns) == 0) then
      call raise(error, exit_input, 'there is no &limit of a run; required: one with moment, force or largest')
      return
    end if
    allocate (statistics(size(kinds) * size(columns)), peaks(size(columns)))
    statistics%column = [(spread(columns(i), 1, size(kinds)), i=1, size(columns))]
    statistics%kind = [(kinds, i=1, size(columns))]
    statistics%from = from
    observer = new_statistics_observer(formulation, statistics, span(1), span(2), may_bend=.false., is_run=.true.)
    allocate (y, source=formulation%start())
    call integrate(formulation, settings, span, y, observer, status, error)
    if (allocated(error)) return
    if (status%code(1) /= integration_done) then
      call raise(error, exit_failed, failure_message(status, 1, formulation, settings%rtol, settings%atol))
      return
    end if
    do i = 1, size(peaks)
      do k = 1, size(kinds)
        found(k) = observer%value_of(size(kinds) * (i - 1) + k, 1)
      end do
      k = merge(3, 1, abs(found(3)) > abs(found(1)))
      peaks(i) = run_peak_t(signals(columns(i)), found(k), found(k + 1))
    end do
  end subroutine find_peaks

  !> The signals that limits compare with in a run.
  subroutine list_limited(input, signals, columns)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)
    integer, allocatable, intent(out) :: columns(:)
    integer, allocatable :: groups(:)
    logical :: is_limited(size(signals))
    integer :: column, i, k

    is_limited = .false.
    allocate (groups, source=input%groups_named('limit'))
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)))
        if (.not. any([(group%has_value(trim(peak_keys(k))), k=1, size(peak_keys))])) cycle
        column = limited_signal(group, signals)
        if (column > 0) is_limited(column) = .true.
      end associate
    end do
    allocate (columns, source=pack([(i, i=1, size(signals))], is_limited))
  end subroutine list_limited

  !> The machines beside the machine of an input.
  subroutine change_machines(given, keys, motion, numbers, notes, error)
    type(input_t), intent(in) :: given
    type(varied_key_t), intent(in) :: keys(:)
    type(varied_motion_t), intent(inout) :: motion
    integer, allocatable, intent(out) :: numbers(:)   !! the keys of `motion%changed`
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error   !! no number can be changed
    type(error_t), allocatable :: own
    type(input_t) :: input
    type(string_t), allocatable :: failed(:)
    integer :: k
    logical :: is_possible(size(keys))
    character(len=:), allocatable :: reason

    input = given
    allocate (motion%changed(size(keys)), failed(0))
    do k = 1, size(keys)
      call change_machine(input, keys(k), motion%machine, motion%changed(motion%numbers + 1), own)
      call set_key(input, keys(k), 0.0_wp)
      is_possible(k) = .not. allocated(own)
      if (is_possible(k)) then
        motion%numbers = motion%numbers + 1
      else
        call append(failed, keys(k)%target%path)
        reason = own%message
      end if
    end do
    allocate (numbers, source=pack([(k, k=1, size(keys))], is_possible))
    if (motion%numbers == 0) then
      call raise(error, exit_failed, 'no number can be changed: ' // reason)
    else if (size(failed) > 0) then
      call append(notes, 'without derivatives of peaks of a run by ' // joined(failed, ', ', 4) // &
                  ': ' // reason)
    end if
  end subroutine change_machines

  !> The machines beside a number, and how the start changes.
  subroutine change_machine(input, key, machine, changed, error)
    type(input_t), intent(inout) :: input   !! has another number afterwards
    type(varied_key_t), intent(in) :: key
    class(reduced_t), intent(in) :: machine       !! of the input
    type(changed_pair_t), intent(out) :: changed
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: start(1, machine%states), starts(1, machine%states)
    integer :: k

    changed%key = key
    changed%scale = abs(key%value)
    start = machine%start()
    allocate (changed%start(machine%states), source=key%run_weight_here * start(1, :))
    do k = 1, run_points
      call assemble_like(input, key, key%run(k), machine, changed%near(k)%its, error)
      if (allocated(error)) return
      starts = changed%near(k)%its%start()
      changed%start = changed%start + key%run_weight(k) * starts(1, :)
    end do
    changed%start = changed%scale * changed%start
  end subroutine change_machine

  !> The equations of a machine, without an energy balance, laid out as those of lanes.
  subroutine formulate(machine, formulation)
    type(machine_t), intent(in) :: machine
    class(reduced_t), allocatable, intent(out) :: formulation

    allocate (reduced_t :: formulation)
    formulation%machine = machine
    formulation%is_block = .true.
    call formulation%formulate(.false.)
  end subroutine formulate

  !> A machine with a changed number that has the states and signals of another one.
  subroutine assemble_like(input, key, change, machine, changed, error)
    type(input_t), intent(inout) :: input
    type(varied_key_t), intent(in) :: key
    real(wp), intent(in) :: change
    class(reduced_t), intent(in) :: machine
    class(reduced_t), allocatable, intent(out) :: changed
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: assembled
    logical :: is_alike

    call set_key(input, key, change)
    call assemble_machine(input, assembled, error)
    if (allocated(error)) return
    call formulate(assembled, changed)
    is_alike = changed%states == machine%states .and. changed%switches == machine%switches .and. &
               changed%joints%count == 0 .and. size(changed%moving) == size(machine%moving) .and. &
               changed%machine%elements%count == machine%machine%elements%count
    if (is_alike) is_alike = all(changed%moving == machine%moving)
    if (.not. is_alike) call raise(error, exit_failed, 'the states of the machine are others')
  end subroutine assemble_like

  !> The derivatives of the values of signals at the times of the peaks.
  subroutine differentiate_peaks(motion, settings, t_start, peaks, slopes, error)
    type(varied_motion_t), target, intent(inout) :: motion
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: t_start   !! [s]
    type(run_peak_t), intent(in) :: peaks(:)
    real(wp), allocatable, intent(out) :: slopes(:, :)   !! [peaks, numbers]
    type(error_t), allocatable, intent(out) :: error
    type(solver_status_t) :: status
    type(sampler_t) :: observer
    real(wp), allocatable :: times(:), y(:, :)
    integer :: i, j

    allocate (slopes(size(peaks), motion%numbers), source=0.0_wp)
    times = [t_start]
    do i = 1, size(peaks)
      times = merged_times(times, [peaks(i)%time])
    end do
    allocate (y, source=motion%start())
    observer = sampler(1, size(y), size(times))
    observer%y(:, 1, 1) = y(1, :)
    if (size(times) > 1) then
      call integrate(motion, settings, times, y, observer, status, error)
      if (allocated(error)) return
      if (status%code(1) /= integration_done) then
        call raise(error, exit_failed, failure_message(status, 1, motion, settings%rtol, settings%atol))
        return
      end if
    end if
    do j = 1, motion%numbers
      do i = 1, size(peaks)
        call differentiate_signal(motion, j, peaks(i), observer%y(:, findloc(times, peaks(i)%time, dim=1), 1), slopes(i, j))
      end do
    end do
  end subroutine differentiate_peaks

  !> The derivative of a signal by a number at the time of its peak.
  subroutine differentiate_signal(motion, j, peak, y, slope)
    type(varied_motion_t), target, intent(inout) :: motion
    integer, intent(in) :: j   !! of the number
    type(run_peak_t), intent(in) :: peak
    real(wp), intent(in) :: y(:)   !! at that time, [states]
    real(wp), intent(out) :: slope
    real(wp), parameter :: share = 1.0e-3_wp   ! of the state, by which it is changed
    real(wp) :: near(run_points), step
    integer :: k

    associate (own => y(:motion%own), s => y(motion%of_number(j) + 1:motion%of_number(j) + motion%own))
      do k = 1, run_points
        near(k) = value_at(motion%changed(j)%near(k)%its, peak, own)
      end do
      step = share / max(1.0_wp, motion%relative_size(own, s))
      slope = (8.0_wp * (value_at(motion%machine, peak, own + step * s) - value_at(motion%machine, peak, own - step * s)) - &
               (value_at(motion%machine, peak, own + 2.0_wp * step * s) - &
                value_at(motion%machine, peak, own - 2.0_wp * step * s))) / (12.0_wp * step)
      slope = (slope + motion%by_number(j, near, value_at(motion%machine, peak, own))) / motion%changed(j)%scale
    end associate
  end subroutine differentiate_signal

  !> The signal of a peak at its time and a state.
  real(wp) function value_at(formulation, peak, state) result(value)
    class(formulation_t), target, intent(inout) :: formulation
    type(run_peak_t), intent(in) :: peak
    real(wp), intent(in) :: state(:)   !! of the formulation
    type(signal_values_t) :: values
    real(wp) :: row(1), y(1, size(state))

    y(1, :) = state
    values = new_signal_values(formulation, [peak%signal%source])
    values%in_motion = .true.
    call values%observe([peak%time], y)
    call values%fill_row(1, peak%time, state, row)
    value = row(1)
  end function value_at

end module nocdyn_peak_answers
