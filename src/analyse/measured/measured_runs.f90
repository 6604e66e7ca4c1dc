!> Measurements over the time beside a run: its signals at the measured times, by the dense output of the integration.
module nocdyn_measured_runs
  use nocdyn_band_filters, only: filter_band
  use nocdyn_clock_alignment, only: add_drift, find_drift, find_shift
  use nocdyn_comparisons, only: comparison_t, new_comparison
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_measurements, only: measurement_t
  use nocdyn_observer, only: observer_t
  use nocdyn_resampling, only: sampled_at
  use nocdyn_signal_values, only: new_signal_values, signal_values_t
  use nocdyn_signals, only: list_signals, signal_source_t, signal_t
  use nocdyn_solver_status, only: failure_message, integration_done, solver_status_t
  implicit none (type, external)
  private

  public :: find_delays, merged_times, new_run_samples, sample_run

  integer, parameter :: most_of_alignment = 20000   ! values that are correlated

  !> The values of one measurement, and the times of the run at which they are compared.
  type :: wanted_t
    real(wp), allocatable :: times(:)      !! of the run [s], ascending
    real(wp), allocatable :: measured(:)   !! there
    real(wp), allocatable :: computed(:)   !! there
    integer :: next = 1                    !! index of the next time
    integer :: outside = 0                 !! measured values beyond the run
  end type wanted_t

  !> Takes the signals that were measured, at the measured times, from the output of a run.
  type, public :: run_samples_t
    type(measurement_t), allocatable :: list(:)
    real(wp), allocatable :: times(:)              !! of all measurements [s], ascending, each once
    type(wanted_t), allocatable, private :: wanted(:)
    type(signal_values_t), private :: signals
    real(wp), allocatable, private :: row(:)       !! [measurements]
    real(wp), private :: t(1) = 0.0_wp
    real(wp), allocatable, private :: y(:, :)      !! [1, states + quadratures]
    integer, private :: next = 1
  contains
    procedure :: attach, take, compare
  end type run_samples_t

  !> An observer that only takes samples.
  type, extends(observer_t) :: sampling_observer_t
    type(run_samples_t), pointer :: samples => null()
  contains
    procedure :: on_output => take_output
  end type sampling_observer_t

contains

  !> What is compared of the measurements in a run from one time to another.
  type(run_samples_t) function new_run_samples(list, span) result(self)
    type(measurement_t), intent(in) :: list(:)   !! series
    real(wp), intent(in) :: span(2)              !! of the run [s]
    real(wp), allocatable :: longer(:)
    logical, allocatable :: is_inside(:)
    integer :: i

    allocate (self%list, source=list)
    allocate (self%wanted(size(list)), self%row(size(list)), self%times(0))
    self%row = 0.0_wp
    do i = 1, size(list)
      associate (m => list(i), one => self%wanted(i))
        allocate (is_inside(size(m%abscissa)))
        is_inside = m%abscissa + m%delay >= max(span(1), m%from) .and. m%abscissa + m%delay <= min(span(2), m%until)
        allocate (one%times, source=pack(m%abscissa + m%delay, is_inside))
        allocate (one%measured, source=pack(m%values, is_inside))
        one%outside = count(.not. is_inside)
        if (m%band(2) > 0.0_wp .and. size(one%times) > 1) call make_even(one%times, one%measured)
        allocate (one%computed(size(one%times)))
        longer = merged_times(self%times, one%times)
        call move_alloc(longer, self%times)
        deallocate (is_inside)
      end associate
    end do
  end function new_run_samples

  !> The same number of values at equal intervals, for a filter.
  subroutine make_even(times, values)
    real(wp), allocatable, intent(inout) :: times(:), values(:)
    real(wp), allocatable :: even(:)
    integer :: i, n

    n = size(times)
    allocate (even(n))
    do i = 1, n
      even(i) = times(1) + (times(n) - times(1)) * (i - 1) / (n - 1)
    end do
    even(n) = times(n)
    values = sampled_at(times, values, even)
    call move_alloc(even, times)
  end subroutine make_even

  !> Two ascending lists as one, with each time once.
  pure function merged_times(first, second) result(all)
    real(wp), intent(in) :: first(:), second(:)
    real(wp), allocatable :: all(:)
    real(wp) :: both(size(first) + size(second)), next
    integer :: i, k, n

    i = 1
    k = 1
    n = 0
    do while (i <= size(first) .or. k <= size(second))
      next = huge(next)
      if (i <= size(first)) next = first(i)
      if (k <= size(second)) next = min(next, second(k))
      if (i <= size(first)) i = i + merge(1, 0, first(i) <= next)
      if (k <= size(second)) k = k + merge(1, 0, second(k) <= next)
      n = n + 1
      both(n) = next
    end do
    all = both(:n)
  end function merged_times

  !> Prepares for the run of a formulation, at its start.
  subroutine attach(self, formulation, t_start)
    class(run_samples_t), intent(inout) :: self
    class(formulation_t), target, intent(inout) :: formulation   !! of one lane
    real(wp), intent(in) :: t_start                              !! [s]
    type(signal_t), allocatable :: signals(:)
    type(signal_source_t), allocatable :: sources(:)
    integer :: i

    call list_signals(formulation%machine, signals)
    allocate (sources(size(self%list)))
    do i = 1, size(sources)
      sources(i) = signals(self%list(i)%signal)%source
    end do
    self%signals = new_signal_values(formulation, sources)
    self%t(1) = t_start
    self%y = formulation%start()
    call self%signals%observe(self%t, self%y)
    call self%signals%start_lane(1)
    self%signals%in_motion = .true.
    self%next = 1
  end subroutine attach

  !> Takes an output of the run, if something was measured at its time.
  subroutine take(self, t, y)
    class(run_samples_t), intent(inout) :: self
    real(wp), intent(in) :: t                  !! [s], ascending from call to call
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    integer :: i

    do while (self%next <= size(self%times))
      if (self%times(self%next) >= t) exit
      self%next = self%next + 1
    end do
    if (self%next > size(self%times)) return
    if (self%times(self%next) > t) return
    self%t(1) = t
    self%y(1, :) = y
    call self%signals%observe(self%t, self%y)
    call self%signals%fill_row(1, t, y, self%row)
    do i = 1, size(self%wanted)
      associate (one => self%wanted(i))
        if (one%next > size(one%times)) cycle
        if (one%times(one%next) > t) cycle
        one%computed(one%next) = self%row(i)
        one%next = one%next + 1
      end associate
    end do
  end subroutine take

  !> The measurements beside the run, up to where it came.
  subroutine compare(self, comparisons)
    class(run_samples_t), intent(inout) :: self
    type(comparison_t), allocatable, intent(out) :: comparisons(:)
    real(wp) :: interval
    integer :: i

    allocate (comparisons(size(self%list)))
    do i = 1, size(comparisons)
      associate (one => self%wanted(i), m => self%list(i))
        associate (n => one%next - 1)
          if (m%band(2) > 0.0_wp .and. n > 1) then
            interval = (one%times(n) - one%times(1)) / (n - 1)
            call filter_band(one%measured(:n), interval, m%band)
            call filter_band(one%computed(:n), interval, m%band)
          end if
          comparisons(i) = new_comparison(m, one%times(:n), one%measured(:n), one%computed(:n))
          comparisons(i)%outside = one%outside + size(one%times) - n
          comparisons(i)%delay = m%delay
        end associate
      end associate
    end do
  end subroutine compare

  !> Runs a machine only for the values at the measured times.
  subroutine sample_run(formulation, settings, span, samples, error)
    class(formulation_t), target, intent(inout) :: formulation   !! of one lane, at its start
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: span(2)                              !! start and end [s]
    type(run_samples_t), target, intent(inout) :: samples
    type(error_t), allocatable, intent(out) :: error             !! the integration failed
    type(sampling_observer_t) :: observer
    type(solver_status_t) :: status
    real(wp), allocatable :: y(:, :)

    call samples%attach(formulation, span(1))
    observer%samples => samples
    observer%takes_shifts = .true.   ! the samples evaluate the formulation, which has them
    allocate (y, source=formulation%start())
    call integrate(formulation, settings, merged_times(span, samples%times), y, observer, status, error)
    if (allocated(error)) return
    if (status%code(1) /= integration_done) then
      call raise(error, exit_failed, failure_message(status, 1, formulation, settings%rtol, settings%atol))
    end if
  end subroutine sample_run

  subroutine take_output(self, lane, t, y)
    class(sampling_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    call self%samples%take(t, y)
  end subroutine take_output

  !> Corrects the delays that are to be found: a run gives the signals over the whole time, and their correlations with the
  !> records say by how much the clocks differ.
  subroutine find_delays(formulation, settings, span, list, correlations, error)
    class(formulation_t), target, intent(inout) :: formulation   !! of one lane, at its start; it is used up
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: span(2)                              !! start and end of the run [s]
    type(measurement_t), intent(inout) :: list(:)
    real(wp), intent(out) :: correlations(:)                     !! of those whose delays are found, [measurements]
    type(error_t), allocatable, intent(out) :: error
    type(run_samples_t), target :: samples
    type(measurement_t), allocatable :: even(:)
    real(wp) :: interval(size(list)), shift
    real(wp), allocatable :: filtered(:), measured(:), middles(:), shifts(:)
    integer :: first, i, k, last, n

    correlations = 0.0_wp
    allocate (even, source=list)
    do i = 1, size(list)   ! the signal over the run, at intervals of the record
      associate (m => list(i))
        interval(i) = (m%abscissa(size(m%abscissa)) - m%abscissa(1)) / (size(m%abscissa) - 1)
        n = 1 + nint(min((span(2) - span(1)) / interval(i), real(most_of_alignment, wp)))
        interval(i) = (span(2) - span(1)) / (n - 1)
        even(i)%abscissa = [(span(1) + interval(i) * k, k=0, n - 2), span(2)]
        even(i)%values = 0.0_wp * even(i)%abscissa
        even(i)%delay = 0.0_wp
        even(i)%band = 0.0_wp
        even(i)%from = span(1)
        even(i)%until = span(2)
      end associate
    end do
    samples = new_run_samples(even, span)
    call sample_run(formulation, settings, span, samples, error)
    if (allocated(error)) return
    do i = 1, size(list)
      if (.not. list(i)%finds_delay) cycle
      associate (m => list(i), one => samples%wanted(i))
        first = count(one%times < m%abscissa(1) + m%delay) + 1
        last = count(one%times <= m%abscissa(size(m%abscissa)) + m%delay)
        if (last - first < 2) cycle   ! the record is not of this time
        filtered = one%computed
        if (m%band(2) > 0.0_wp) call filter_band(filtered, interval(i), m%band)
        call sample_record(m, one%times(first:last), interval(i), measured)
        call find_shift(measured, filtered, first - 1, min(size(filtered) / 2, max(1, ceiling(m%largest_shift / interval(i)))), &
                        shift, correlations(i))
        m%delay = m%delay + shift * interval(i)
        if (.not. m%drifts) cycle
        call sample_record(m, one%times(first:last), interval(i), measured)
        call find_drift(measured, filtered, first - 1, max(2, nint(m%drift_interval / interval(i))), &
                        max(1, ceiling(m%largest_drift / interval(i))), middles, shifts)
        shifts = shifts * interval(i)
        m%drift = [minval(shifts), maxval(shifts)]
        call add_drift(one%times(first) + interval(i) * (middles - 1.0_wp) - m%delay, shifts, m%abscissa)
      end associate
    end do
  end subroutine find_delays

  !> A record at even times of the run, in its band.
  subroutine sample_record(m, times, interval, values)
    type(measurement_t), intent(in) :: m
    real(wp), intent(in) :: times(:)                  !! [s]
    real(wp), intent(in) :: interval                  !! from time to time [s]
    real(wp), allocatable, intent(out) :: values(:)   !! there

    values = sampled_at(m%abscissa + m%delay, m%values, times)
    if (m%band(2) > 0.0_wp) call filter_band(values, interval, m%band)
  end subroutine sample_record

end module nocdyn_measured_runs
