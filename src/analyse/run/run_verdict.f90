!> What a run says of limits: the largest magnitudes of its columns against those of &limit, and its damage.
!>
!> Limits of half ranges and rules are the ones of a steady oscillation; `nocdyn response` compares with them.
module nocdyn_run_verdict
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: derating, limited_kind, limited_signal
  use nocdyn_run_fatigue, only: run_fatigue_t
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: quoted, rounded_text
  use nocdyn_verdicts, only: in_words, is_not_assessed, new_damage_line, new_verdict_line, verdict_line_t, verdict_t
  implicit none (type, external)
  private

  public :: add_damage, add_end, add_peaks, add_run_limits

  character(len=*), parameter, public :: peak_keys(*) = [character(len=7) :: 'moment', 'force', 'largest']   !! of magnitudes
  character(len=*), parameter :: steady_keys(*) = [character(len=19) :: 'vibratory_moment', 'vibratory_frequency', &
    'vibratory_force', 'vibratory', 'stress', 'stress_transient', 'rule', 'rule_file', 'heat', &
    'largest_temperature']

  !> An extreme of a column.
  type, public :: column_extreme_t
    real(wp) :: size = 0.0_wp             !! its magnitude [unit of the column]
    real(wp) :: time = 0.0_wp             !! [s]
    logical :: is_of_start = .false.      !! whether it lies in the first transient of a start out of balance
  end type column_extreme_t

contains

  !> Compares the columns of a run with the limits of its input.
  subroutine add_run_limits(input, signals, extremes, verdict)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)              !! of the columns
    type(column_extreme_t), intent(in) :: extremes(:)     !! theirs of largest magnitude
    type(verdict_t), intent(inout) :: verdict
    integer, allocatable :: groups(:)
    integer :: i, k
    logical :: is_steady   ! whether the machine oscillates steadily too: not a load case that only runs

    call add_peaks(input, 'run', signals, extremes, verdict)
    is_steady = .true.
    if (allocated(input%load_case)) is_steady = input%load_case%is_for('response')
    if (.not. is_steady) return
    allocate (groups, source=input%groups_named('limit'))
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)))
        do k = 1, size(steady_keys)
          if (group%has_value(trim(steady_keys(k)))) call add_steady(input, groups(i), trim(steady_keys(k)), verdict)
        end do
      end associate
    end do
  end subroutine add_run_limits

  !> Compares the extremes of columns with the limits of largest magnitudes.
  subroutine add_peaks(input, analysis, signals, extremes, verdict)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: analysis              !! of the lines
    type(signal_t), intent(in) :: signals(:)              !! of the columns
    type(column_extreme_t), intent(in) :: extremes(:)     !! theirs of largest magnitude
    type(verdict_t), intent(inout) :: verdict
    integer, allocatable :: groups(:)
    integer :: i, k

    allocate (groups, source=input%groups_named('limit'))
    do i = 1, size(groups)
      do k = 1, size(peak_keys)
        if (.not. input%groups(groups(i))%has_value(trim(peak_keys(k)))) cycle
        call add_peak(input, analysis, groups(i), trim(peak_keys(k)), signals, extremes, verdict)
      end do
    end do
  end subroutine add_peaks

  subroutine add_peak(input, analysis, index, key, signals, extremes, verdict)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: analysis
    integer, intent(in) :: index           !! of the group
    character(len=*), intent(in) :: key    !! of the limit
    type(signal_t), intent(in) :: signals(:)
    type(column_extreme_t), intent(in) :: extremes(:)
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    integer :: column

    call start_line(input, analysis, index, key, line)
    column = limited_signal(input%groups(index), signals)
    if (column == 0) then
      line%finding = is_not_assessed
      line%reason = 'the run has no such quantity'
    else
      line%quantity = signals(column)%name
      call line%compare(extremes(column)%size, derating(input%groups(index)) * input%groups(index)%number(key), &
                        signals(column)%unit)
      line%has_time = .true.
      line%time = extremes(column)%time
      if (extremes(column)%is_of_start) line%detail = 'in the first transient of the start'
    end if
    call verdict%add(line)
  end subroutine add_peak

  !> A limit that a run compares with nothing.
  subroutine add_steady(input, index, key, verdict)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index           !! of the group
    character(len=*), intent(in) :: key    !! of the limit
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line

    call start_line(input, 'run', index, key, line)
    if (key == 'rule') line%rule = input%groups(index)%text('rule')
    line%finding = is_not_assessed
    line%reason = 'for steady oscillations: nocdyn response compares with it'
    call verdict%add(line)
  end subroutine add_steady

  subroutine start_line(input, analysis, index, key, line)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: analysis
    integer, intent(in) :: index           !! of the group
    character(len=*), intent(in) :: key    !! of the limit
    type(verdict_line_t), intent(out) :: line
    character(len=:), allocatable :: criterion, kind

    kind = trim(limited_kind(input%groups(index)))
    associate (group => input%groups(index))
      criterion = in_words(key)
      if (any(key == ['largest  ', 'vibratory'])) criterion = in_words(group%text('quantity'))
      if (any(key == ['rule     ', 'rule_file'])) criterion = 'stress'
      line = new_verdict_line(analysis, kind // ' ' // quoted(group%text(kind)), '', &
                              criterion // trim(merge(', steady ', ', largest', any(key == steady_keys))), input%place(index, ''))
    end associate
  end subroutine start_line

  !> The damage of all repeats of a run.
  subroutine add_damage(fatigue, verdict)
    type(run_fatigue_t), intent(in) :: fatigue
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    integer :: i, k

    if (.not. allocated(fatigue%items)) return
    do i = 1, size(fatigue%items)
      k = fatigue%worst(i)
      associate (item => fatigue%items(i), counter => fatigue%counters(k))
        line = new_damage_line('run', item%kind, item%element, item%name, counter%has_failed, item%repeats * counter%damage)
        if (abs(item%repeats - 1.0_wp) > 0) line%detail = rounded_text(item%repeats, 6) // ' such runs'
        call verdict%add(line)
      end associate
    end do
  end subroutine add_damage

  !> A run that has not come to its end, of an input with limits.
  subroutine add_end(input, message, verdict)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: message   !! why
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line

    if (size(input%groups_named('limit')) + size(input%groups_named('fatigue')) == 0) return
    line = new_verdict_line('run', 'machine', '', 'the whole run', '')
    line%finding = is_not_assessed
    line%reason = message
    call verdict%add(line)
  end subroutine add_end

end module nocdyn_run_verdict
