!> Passages of ranges of speeds in a run: how long they take, what moments and stresses reach in them, and their damage.
!>
!> A first run gives the mean speed, and with it the passages. Each passage is run once more up to its end, with extremes in
!> continuous time and cycles from its begin on: those of all turns whose mean speed is in the range.
module nocdyn_transit_analysis
  use nocdyn_energy_balance, only: energy_balance_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_mean_speeds, only: find_visits, find_windows, speed_at, visit_t, turn_window_t
  use nocdyn_moment_forms, only: list_moment_forms, moment_form_t
  use nocdyn_passage_runs, only: kept_rows_t, run_part
  use nocdyn_response_limits, only: no_limit, read_limits, response_limit_t
  use nocdyn_row_intervals, only: fastest_rate
  use nocdyn_run_fatigue, only: run_fatigue_t
  use nocdyn_run_summary, only: column_extremes_t, run_summary_t
  use nocdyn_signals, only: find_signal, list_signals, signal_speed, signal_t
  use nocdyn_speed_ramps, only: add_ramp
  use nocdyn_text, only: append, string_t
  use nocdyn_transit_settings, only: read_transit_settings, transit_settings_t
  implicit none (type, external)
  private

  public :: analyse_transit

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter :: rows_of_turn = 64      ! from which the mean speed is taken
  integer, parameter :: rows_of_period = 40    ! of the fastest excitation: its crests are met within 0.3 %
  integer, parameter :: windows_of_turn = 16   ! whose half ranges are compared
  integer, parameter :: most_rows = 4000000    ! of a run, so that they fit into memory
  real(wp), parameter :: beyond = 1.2_wp       ! speeds in a passage, as a multiple of the end of its range

  !> The largest values of a limited quantity in a passage.
  type, public :: passage_peak_t
    integer :: limit = 0                      !! in the list of limits
    type(signal_t) :: signal
    real(wp) :: largest = 0.0_wp              !! magnitude
    real(wp) :: largest_time = 0.0_wp         !! [s]
    real(wp) :: largest_speed = 0.0_wp        !! mean speed there [rad/s]
    real(wp) :: half_range = 0.0_wp           !! in one window, where it is nearest to its limit
    real(wp) :: half_range_time = 0.0_wp, half_range_speed = 0.0_wp   !! [s], [rad/s]
    real(wp) :: allowed = no_limit            !! half range there, while the range is passed
  end type passage_peak_t

  type, public :: passage_t
    type(visit_t) :: visit
    integer :: range = 0
    real(wp) :: turns = 0.0_wp                !! in the range
    type(passage_peak_t), allocatable :: peaks(:)
    type(column_extremes_t) :: extremes       !! of the columns of the run
    type(run_fatigue_t) :: fatigue
    real(wp), allocatable :: rows(:, :)       !! time, mean speed, speed and the limited quantities, [columns, rows]
  end type passage_t

  type, public :: transit_analysis_t
    type(transit_settings_t) :: settings
    character(len=:), allocatable :: body_name     !! of the body whose speed counts
    type(response_limit_t), allocatable :: limits(:)
    type(signal_t), allocatable :: quantities(:)   !! to which these refer
    type(signal_t), allocatable :: signals(:)      !! columns of the run
    type(turn_window_t), allocatable :: windows(:)      !! of the whole run
    type(string_t), allocatable :: names(:)        !! of the angle and the speed of the body, then of the limited quantities
    type(passage_t), allocatable :: passages(:)
    real(wp) :: lowest = 0.0_wp, highest = 0.0_wp  !! mean speeds of the run [rad/s]
    type(energy_balance_t), allocatable :: energy_balance
    type(string_t), allocatable :: notes(:)
  end type transit_analysis_t

contains

  !> Runs the machine of an input and finds the passages.
  subroutine analyse_transit(input, machine, self, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! one lane
    type(transit_analysis_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(run_summary_t) :: summary
    type(input_t) :: driven   ! what is run
    real(wp) :: range(2)
    integer :: i, k

    allocate (self%notes(0), self%passages(0))
    call read_transit_settings(input, machine, self%settings, self%notes, error)
    if (.not. allocated(error)) call find_columns(input, machine, self, error)
    if (allocated(error)) return
    if (size(self%settings%ranges) == 0) return
    driven = input
    if (input%groups(self%settings%group)%has_value('ramp_times')) call add_ramp(driven, self%body_name, error)
    if (allocated(error)) return
    call run_whole(driven, self, summary, error)
    if (allocated(error)) return
    do i = 1, size(summary%notes)
      call append(self%notes, summary%notes(i)%text)
    end do
    self%signals = summary%signals
    if (allocated(summary%energy_balance)) self%energy_balance = summary%energy_balance
    if (size(self%windows) == 0) return
    self%lowest = minval(self%windows%speed)
    self%highest = maxval(self%windows%speed)
    do i = 1, size(self%settings%ranges)
      range = [self%settings%ranges(i)%low, self%settings%ranges(i)%high]
      call add_passages(self%windows, range, i, self%passages)
    end do
    do k = 1, size(self%passages)
      call run_passage(driven, machine, summary%extremes, self, self%passages(k), error)
      if (allocated(error)) return
    end do
  end subroutine analyse_transit

  !> The columns that are needed: the angle and the speed of the body, and what is limited.
  subroutine find_columns(input, machine, self, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(transit_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(moment_form_t), allocatable :: forms(:)
    type(signal_t), allocatable :: signals(:)
    integer :: i, k

    call list_moment_forms(machine, self%settings%body, forms)
    call read_limits(input, forms, self%limits, error)
    if (allocated(error)) return
    allocate (self%quantities(size(forms)), self%names(0))
    do i = 1, size(forms)
      self%quantities(i) = forms(i)%signal_t
    end do
    call list_signals(machine, signals)
    self%body_name = machine%names(self%settings%body)%text
    associate (name => self%body_name)
      call append(self%names, signals(find_signal(signals, 'body', name, 'phi'))%name)
      call append(self%names, signals(find_signal(signals, 'body', name, 'omega'))%name)
    end associate
    do i = 1, size(self%limits)
      associate (name => self%quantities(self%limits(i)%quantity)%name)
        if (all([(self%names(k)%text /= name, k=1, size(self%names))])) call append(self%names, name)
      end associate
    end do
  end subroutine find_columns

  !> The whole run, for the mean speed.
  subroutine run_whole(input, self, summary, error)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(inout) :: self
    type(run_summary_t), intent(out) :: summary
    type(error_t), allocatable, intent(out) :: error
    type(kept_rows_t) :: kept
    type(turn_window_t), allocatable :: windows(:)
    real(wp) :: span(2), turns

    associate (run => input%groups(input%position('run')))
      span = [run%number('t_start'), run%number('t_end')]
    end associate
    kept%shows_motion = .false.
    turns = (span(2) - span(1)) * maxval(self%settings%ranges%high) / turn
    call run_part(input, self%names(:2), span, intervals_of(rows_of_turn * turns), kept, summary, error)
    if (allocated(error)) then
      error%message = input%shown_case() // ': ' // error%message
    else
      call windows_of(self, kept, windows)
      call move_alloc(windows, self%windows)
    end if
  end subroutine run_whole

  !> A number of intervals that fits into memory.
  pure integer function intervals_of(wanted) result(intervals)
    real(wp), intent(in) :: wanted

    intervals = ceiling(min(max(wanted, real(rows_of_turn, wp)), real(most_rows, wp)))
  end function intervals_of

  !> The windows that end at kept rows.
  subroutine windows_of(self, kept, windows)
    type(transit_analysis_t), intent(in) :: self
    type(kept_rows_t), intent(in) :: kept
    type(turn_window_t), allocatable, intent(out) :: windows(:)
    integer :: angle, speed

    angle = column_of(kept, self%names(1)%text)
    speed = column_of(kept, self%names(2)%text)
    associate (forwards => self%settings%forwards, rows => kept%values(:, :kept%count))
      call find_windows(rows(1, :), forwards * rows(angle, :), forwards * rows(speed, :), self%settings%turns, windows)
    end associate
  end subroutine windows_of

  pure integer function column_of(kept, name) result(column)
    type(kept_rows_t), intent(in) :: kept
    character(len=*), intent(in) :: name

    do column = 1, size(kept%labels)
      if (index(kept%labels(column)%text, name // ' [') == 1) return
    end do
    error stop 'nocdyn_transit_analysis: a column that was asked for is missing'
  end function column_of

  !> Adds the visits of a range.
  subroutine add_passages(windows, range, number, passages)
    type(turn_window_t), intent(in) :: windows(:)
    real(wp), intent(in) :: range(2)   !! [rad/s]
    integer, intent(in) :: number      !! of the range
    type(passage_t), allocatable, intent(inout) :: passages(:)
    type(visit_t), allocatable :: visits(:)
    type(passage_t), allocatable :: longer(:)
    integer :: i

    call find_visits(windows, range(1), range(2), visits)
    allocate (longer(size(passages) + size(visits)))
    do i = 1, size(passages)
      longer(i) = passages(i)
    end do
    do i = 1, size(visits)
      longer(size(passages) + i)%visit = visits(i)
      longer(size(passages) + i)%range = number
    end do
    call move_alloc(longer, passages)
  end subroutine add_passages

  !> Runs up to the end of a passage.
  subroutine run_passage(input, machine, extremes, self, passage, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(column_extremes_t), intent(in) :: extremes   !! of the whole run
    type(transit_analysis_t), intent(in) :: self
    type(passage_t), intent(inout) :: passage
    type(error_t), allocatable, intent(out) :: error
    type(kept_rows_t) :: kept
    type(run_summary_t) :: summary
    type(turn_window_t), allocatable :: windows(:)
    real(wp) :: highest(machine%bodies), lowest(machine%bodies), rate, share, span
    integer :: b, column

    do b = 1, machine%bodies
      column = findloc(self%signals%source%index == b .and. self%signals%source%kind == signal_speed, .true., dim=1)
      lowest(b) = extremes%lowest(column)
      highest(b) = extremes%highest(column)
    end do
    associate (high => self%settings%ranges(passage%range)%high, visit => passage%visit)
      share = min(1.0_wp, beyond * high / self%highest)
      rate = max(rows_of_period * fastest_rate(machine, share * lowest, share * highest), rows_of_turn * high)
      span = visit%end - input%groups(input%position('run'))%number('t_start')
      kept%from = visit%begin - span / intervals_of(span * rate / turn)   ! the row before it too: whole turns begin at a row
      call run_part(input, self%names, [visit%begin, visit%end], intervals_of(span * rate / turn), kept, summary, error)
      if (allocated(error)) then
        error%message = input%shown_case() // ': ' // error%message
        return
      end if
    end associate
    call windows_of(self, kept, windows)
    passage%extremes = summary%extremes
    passage%fatigue = summary%fatigue
    call find_peaks(self, kept, windows, passage)
  end subroutine run_passage

  !> The largest values of what is limited, and the rows of the passage.
  subroutine find_peaks(self, kept, windows, passage)
    type(transit_analysis_t), intent(in) :: self
    type(kept_rows_t), intent(in) :: kept
    type(turn_window_t), intent(in) :: windows(:)
    type(passage_t), intent(inout) :: passage
    integer :: columns(size(self%names)), i, signal

    columns = [(column_of(kept, self%names(i)%text), i=1, size(columns))]
    allocate (passage%rows(size(columns) + 1, kept%count))
    passage%rows(1, :) = kept%values(1, :kept%count)
    passage%rows(2, :) = self%settings%forwards * [(speed_at(self%windows, kept%values(1, i)), i=1, kept%count)]
    passage%rows(3:, :) = kept%values(columns(2:), :kept%count)
    passage%turns = turns_between(self, kept, columns(:2), passage%visit)
    allocate (passage%peaks(size(self%limits)))
    do i = 1, size(self%limits)
      associate (peak => passage%peaks(i), extremes => passage%extremes)
        peak%limit = i
        do signal = 1, size(self%signals)
          if (self%signals(signal)%name == self%quantities(self%limits(i)%quantity)%name) exit
        end do
        peak%signal = self%signals(signal)
        peak%largest = max(abs(extremes%lowest(signal)), abs(extremes%highest(signal)))
        peak%largest_time = merge(extremes%highest_time(signal), extremes%lowest_time(signal), &
                                  abs(extremes%highest(signal)) > abs(extremes%lowest(signal)))
        peak%largest_speed = self%settings%forwards * speed_at(self%windows, peak%largest_time)
        call find_half_range(self, kept%values([1, column_of(kept, peak%signal%name)], :kept%count), windows, peak)
      end associate
    end do
  end subroutine find_peaks

  !> The turns from the entry to the exit, by the angles of the rows.
  pure real(wp) function turns_between(self, kept, columns, visit) result(turns)
    type(transit_analysis_t), intent(in) :: self
    type(kept_rows_t), intent(in) :: kept
    integer, intent(in) :: columns(2)   !! angle and speed
    type(visit_t), intent(in) :: visit

    turns = self%settings%forwards * (angle_at(visit%leaves) - angle_at(visit%enters)) / turn

  contains

    pure real(wp) function angle_at(time) result(angle)
      real(wp), intent(in) :: time
      integer :: i

      i = max(1, count(kept%values(1, :kept%count) <= time))
      angle = kept%values(columns(1), i) + kept%values(columns(2), i) * (time - kept%values(1, i))
    end function angle_at

  end function turns_between

  !> The half range in one window that is nearest to the limit for passing; without one the largest.
  subroutine find_half_range(self, rows, windows, peak)
    type(transit_analysis_t), intent(in) :: self
    real(wp), intent(in) :: rows(:, :)   !! time and quantity, [2, rows]
    type(turn_window_t), intent(in) :: windows(:)
    type(passage_peak_t), intent(inout) :: peak
    real(wp) :: allowed, half_range, next
    integer :: first, k

    first = 1
    next = -huge(next)
    do k = 1, size(windows)
      associate (window => windows(k))
        if (window%end < next .and. k < size(windows)) cycle
        next = window%end + (window%end - window%begin) / (windows_of_turn * self%settings%turns)
        do while (rows(1, first) < window%begin)
          first = first + 1
        end do
        half_range = 0.5_wp * (maxval(rows(2, first:window%row)) - minval(rows(2, first:window%row)))
        allowed = self%limits(peak%limit)%transient_limit(self%settings%forwards * window%speed)
        if (half_range / allowed < peak%half_range / peak%allowed .or. .not. half_range > 0) cycle
        peak%half_range = half_range
        peak%allowed = allowed
        peak%half_range_time = window%time
        peak%half_range_speed = self%settings%forwards * window%speed
      end associate
    end do
  end subroutine find_half_range

end module nocdyn_transit_analysis
