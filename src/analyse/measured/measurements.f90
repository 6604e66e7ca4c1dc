!> The measurements of an input, &measurement, in SI units: what was measured, where, and how exactly.
module nocdyn_measurements
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_measured_signals, only: drives_only, find_measured_signal
  use nocdyn_order_tracking, only: track_order, turning_t
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: to_text
  use nocdyn_unit_expressions, only: unit_conversion_t
  implicit none (type, external)
  private

  public :: read_measurements

  integer, parameter, public :: measured_series = 1, measured_order = 2, measured_frequency = 3, measured_peak = 4
  character(len=9), parameter, public :: measured_kinds(4) = [character(len=9) :: 'series', 'order', 'frequency', 'peak']

  integer, parameter, public :: peak_half_range = 1, peak_largest = 2, peak_smallest = 3, peak_mean = 4
  character(len=10), parameter, public :: peak_names(4) = [character(len=10) :: 'half_range', 'largest', 'smallest', 'mean']

  !> One measurement. Series and orders have values at abscissae; a peak has one value and none.
  type, public :: measurement_t
    character(len=:), allocatable :: name
    integer :: group = 0                     !! of the input
    integer :: kind = measured_series
    integer :: signal = 0                    !! of the machine: index in `list_signals`; 0 of frequencies
    character(len=:), allocatable :: signal_name, unit, caption   !! of the signal, in SI
    real(wp), allocatable :: abscissa(:)     !! times of the recorder [s], or speeds of the body of &response [rad/s]
    real(wp), allocatable :: values(:)       !! in the unit of the signal; frequencies [rad/s]
    real(wp) :: deviation = 0.0_wp           !! standard deviation of the values, of frequencies as a share; 0: unknown
    integer :: gaps = 0                      !! values that the file does not have
    real(wp) :: delay = 0.0_wp               !! added to the times [s]
    logical :: finds_delay = .false.         !! whether the delay is corrected by cross-correlation
    real(wp) :: largest_shift = 0.0_wp       !! of this correction [s]
    logical :: drifts = .false.              !! whether the clock drifts against the run, in pieces
    real(wp) :: largest_drift = 0.0_wp, drift_interval = 0.0_wp   !! of a piece [s]
    real(wp) :: drift(2) = 0.0_wp            !! smallest and largest one that was found, in `abscissa` already [s]
    real(wp) :: band(2) = 0.0_wp             !! frequencies that are compared [rad/s]; both 0: all
    real(wp) :: from = -huge(1.0_wp), until = huge(1.0_wp)   !! times of the run [s], or speeds [rad/s]
    real(wp) :: order = 0.0_wp               !! oscillations per turn of the body of &response
    real(wp), allocatable :: damping(:)      !! damping ratios of the frequencies; may be empty
    real(wp) :: damping_deviation = 0.0_wp   !! standard deviation of these; 0: unknown
    integer, allocatable :: modes(:)         !! numbers of their modes; may be empty
    integer :: statistic = peak_half_range   !! of a peak
    real(wp) :: speed = 0.0_wp               !! at which a peak was measured [rad/s]; 0: anywhere
  contains
    procedure :: damping_weight, weight
  end type measurement_t

contains

  !> The weight of differences in a fit: one over the standard deviation, 1 if that is unknown.
  pure real(wp) function weight(self)
    class(measurement_t), intent(in) :: self

    weight = 1.0_wp
    if (self%deviation > 0.0_wp) weight = 1.0_wp / self%deviation
  end function weight

  !> The weight of differences of damping ratios. If their deviation is not given it is the relative one of the frequencies: a
  !> decaying oscillation in noise tells the real and the imaginary part of its eigenvalue equally well, for the derivatives of
  !> exp(lambda t) by both are t exp(lambda t) and i t exp(lambda t); over the frequency these are damping ratio and frequency.
  pure real(wp) function damping_weight(self) result(weight)
    class(measurement_t), intent(in) :: self

    weight = self%weight()
    if (self%damping_deviation > 0.0_wp) weight = 1.0_wp / self%damping_deviation
  end function damping_weight

  !> Reads the measurements of some kinds, but for series without a signal.
  subroutine read_measurements(input, kinds, signals, list, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: kinds(:)            !! `measured_series` ...
    type(signal_t), intent(in) :: signals(:)   !! of the machine, in SI
    type(measurement_t), allocatable, intent(out) :: list(:)
    type(error_t), allocatable, intent(out) :: error   !! names file, line, group and key
    type(diagnostics_t) :: diagnostics
    integer, allocatable :: groups(:)
    integer, allocatable :: kind(:)
    integer :: i, n

    allocate (groups, source=input%groups_named('measurement'))
    allocate (kind(size(groups)), source=0)
    do i = 1, size(groups)
      if (.not. drives_only(input%groups(groups(i)))) then
        kind(i) = findloc(measured_kinds == input%groups(groups(i))%text('kind'), .true., dim=1)
      end if
    end do
    allocate (list(count([(any(kinds == kind(i)), i=1, size(groups))])))
    n = 0
    do i = 1, size(groups)
      if (all(kinds /= kind(i))) cycle
      n = n + 1
      call read_one(input, groups(i), kind(i), signals, list(n), diagnostics)
    end do
    call input%refuse(diagnostics, error)
  end subroutine read_measurements

  !> Reads one measurement.
  subroutine read_one(input, g, kind, signals, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g, kind   !! the group; `measured_series` ...
    type(signal_t), intent(in) :: signals(:)
    type(measurement_t), intent(out) :: self
    type(diagnostics_t), intent(inout) :: diagnostics
    type(unit_conversion_t) :: conversion

    self%group = g
    self%kind = kind
    associate (group => input%groups(g))
      self%name = group%name
      self%deviation = group%number('deviation', absent=0.0_wp)
      if (kind == measured_frequency) then
        call read_frequencies(input, g, self, diagnostics)
        return
      end if
      call find_measured_signal(input, g, signals, self%signal, conversion, diagnostics)
      if (self%signal == 0) return
      self%signal_name = signals(self%signal)%name
      self%unit = signals(self%signal)%unit
      self%caption = signals(self%signal)%caption
      if (.not. group%has_value('values')) then
        call input%report(g, 'name', 'values is missing; needed: measured values' // trim(merge(' or file', '        ', &
                                     kind /= measured_peak)), diagnostics)
        return
      end if
      self%values = conversion%convert(group%number('scale') * group%numbers('values') + group%number('offset'))
      self%deviation = abs(conversion%convert(self%deviation) - conversion%convert(0.0_wp))
    end associate
    select case (kind)
    case (measured_series)
      call read_series(input, g, self, diagnostics)
    case (measured_order)
      call read_order(input, g, self, diagnostics)
    case default
      call read_peak(input, g, self, diagnostics)
    end select
  end subroutine read_one

  !> Times, clock and band of values over the time.
  subroutine read_series(input, g, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g
    type(measurement_t), intent(inout) :: self   !! with its values
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (group => input%groups(g))
      self%abscissa = group%numbers('times')
      if (group%has_value('gaps')) self%gaps = group%whole_number('gaps')
      self%delay = group%number('delay')
      self%finds_delay = group%text('alignment') /= 'given'
      self%drifts = group%text('alignment') == 'drifting'
      self%largest_drift = group%number('largest_drift', absent=0.05_wp)
      self%drift_interval = group%number('drift_interval', absent=1.0_wp)
      if (2 * self%largest_drift >= self%drift_interval) then
        call input%report(g, 'largest_drift', 'largest_drift must be less than half of drift_interval, ' // &
                          to_text(self%drift_interval) // ' s', diagnostics)
      end if
      self%largest_shift = group%number('largest_shift', &
                                        absent=0.1_wp * (self%abscissa(size(self%abscissa)) - self%abscissa(1)))
      self%from = group%number('from', absent=self%from)
      self%until = group%number('until', absent=self%until)
      if (.not. group%has_value('frequency_band')) return
      self%band = group%numbers('frequency_band')
      if (self%band(2) > self%band(1)) return
      call input%report(g, 'frequency_band', 'frequency_band: the second frequency must be greater than the first', diagnostics)
    end associate
  end subroutine read_series

  !> Amplitudes over speeds, given or found from a record over the time.
  subroutine read_order(input, g, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g
    type(measurement_t), intent(inout) :: self   !! with its values
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    real(wp), allocatable :: range(:)

    associate (group => input%groups(g))
      self%order = group%number('order')
      if (group%has_value('gaps')) self%gaps = group%whole_number('gaps')
      message = ''
      if (group%has_value('times')) then
        call track_record(group, self, message)
      else if (group%has_value('speeds')) then
        self%abscissa = group%numbers('speeds')
      else
        message = 'speeds is missing; needed: one for each amplitude'
      end if
      if (message /= '') then
        call input%report(g, 'name', message, diagnostics)
        return
      end if
      if (.not. group%has_value('speed_range')) return
      range = group%numbers('speed_range')
      self%from = minval(range)
      self%until = maxval(range)
    end associate
  end subroutine read_order

  !> Replaces the values of a record over the time by the amplitudes of the order over the speed.
  subroutine track_record(group, self, message)
    type(group_t), intent(in) :: group
    type(measurement_t), intent(inout) :: self   !! with its values and its order
    character(len=:), allocatable, intent(out) :: message   !! '' if nothing is wrong
    type(turning_t) :: turning
    real(wp), allocatable :: amplitudes(:), speeds(:)

    if (.not. (group%has_value('speeds') .or. group%has_value('pulses'))) then
      message = 'speeds or pulses is missing beside times; needed to find the turns'
      return
    end if
    if (group%has_value('pulses') .and. .not. group%has_value('pulses_per_turn')) then
      message = 'pulses_per_turn is missing beside pulses'
      return
    end if
    turning%speeds = group%numbers('speeds')
    turning%pulses = group%numbers('pulses')
    turning%pulses_per_turn = group%number('pulses_per_turn', absent=1.0_wp)
    call track_order(group%numbers('times'), turning, self%values, self%order, group%whole_number('turns'), speeds, &
                     amplitudes, message)
    if (message /= '') return
    call move_alloc(amplitudes, self%values)
    call move_alloc(speeds, self%abscissa)
  end subroutine track_record

  !> What a peak is of, and where.
  subroutine read_peak(input, g, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g
    type(measurement_t), intent(inout) :: self   !! with its values
    type(diagnostics_t), intent(inout) :: diagnostics

    allocate (self%abscissa(0))
    associate (group => input%groups(g))
      self%statistic = findloc(peak_names == group%text('statistic'), .true., dim=1)
      self%speed = group%number('speed', absent=0.0_wp)
      self%from = group%number('from', absent=self%from)
    end associate
    if (size(self%values) /= 1) call input%report(g, 'values', 'values: ' // to_text(size(self%values)) // &
                                                  ' numbers; needed: one, the peak', diagnostics)
  end subroutine read_peak

  !> Natural frequencies with their damping ratios and the numbers of their modes.
  subroutine read_frequencies(input, g, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g
    type(measurement_t), intent(inout) :: self
    type(diagnostics_t), intent(inout) :: diagnostics

    self%signal_name = ''
    self%unit = 'rad/s'
    self%caption = 'natural frequency'
    allocate (self%abscissa(0))
    associate (group => input%groups(g))
      self%values = group%numbers('frequency')
      self%damping = group%numbers('relative_damping')
      self%damping_deviation = group%number('damping_deviation', absent=0.0_wp)
      self%modes = group%whole_numbers('modes')
    end associate
    call check_count(input, g, 'relative_damping', size(self%damping), size(self%values), diagnostics)
    call check_count(input, g, 'modes', size(self%modes), size(self%values), diagnostics)
  end subroutine read_frequencies

  !> Refuses a list that has some values, but not one for each frequency.
  subroutine check_count(input, g, key, count, frequencies, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g
    character(len=*), intent(in) :: key
    integer, intent(in) :: count, frequencies   !! numbers of values
    type(diagnostics_t), intent(inout) :: diagnostics

    if (count == 0 .or. count == frequencies) return
    call input%report(g, key, key // ' has ' // to_text(count) // ' values and frequency has ' // to_text(frequencies) // &
                      '; needed: as many of each', diagnostics)
  end subroutine check_count

end module nocdyn_measurements
