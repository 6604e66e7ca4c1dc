!> The limits of moments, by &limit, in a run: the largest magnitudes of the columns against `moment`.
!>
!> Limits of half ranges and stresses are the ones of a steady oscillation; `nocdyn response` compares with them.
module nocdyn_run_limits
  use nocdyn_input, only: group_t, input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: limited_kind, limited_signal
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: append, rounded_text, string_t
  implicit none (type, external)
  private

  public :: check_run_limits, note_other_limits, put_run_limits, run_limits_text

  character(len=*), parameter :: peak_keys(*) = [character(len=7) :: 'moment', 'force', 'largest']   ! of the largest magnitude

  !> A limit and the largest magnitude of its column.
  type, public :: run_limit_t
    character(len=:), allocatable :: name, column   !! of the coupling or shaft; of the results
    real(wp) :: limit = 0.0_wp, largest = 0.0_wp   !! in the unit of the column
  end type run_limit_t

contains

  !> Compares the columns of a run with the limits of its input.
  subroutine check_run_limits(input, signals, labels, lowest, highest, limits)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)              !! of the columns
    type(string_t), intent(in) :: labels(:)               !! theirs
    real(wp), intent(in) :: lowest(:), highest(:)         !! [columns]
    type(run_limit_t), allocatable, intent(out) :: limits(:)
    integer, allocatable :: groups(:)
    integer :: column, i, k, n

    allocate (groups, source=input%groups_named('limit'))
    allocate (limits(count([(has_peak(input%groups(groups(i))), i=1, size(groups))])))
    n = 0
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)))
        if (.not. has_peak(group)) cycle
        n = n + 1
        limits(n)%name = group%text(trim(limited_kind(group)))
        column = limited_signal(group, signals)
        do k = 1, size(peak_keys)
          if (group%has_value(trim(peak_keys(k)))) limits(n)%limit = group%number(trim(peak_keys(k)))
        end do
        limits(n)%column = ''
        if (column == 0) cycle
        limits(n)%column = labels(column)%text
        limits(n)%largest = max(abs(lowest(column)), abs(highest(column)))
      end associate
    end do
  end subroutine check_run_limits

  !> Adds a note on each limit that a run does not compare with anything.
  subroutine note_other_limits(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=*), parameter :: keys(*) = [character(len=16) :: 'vibratory_moment', 'vibratory_force', 'vibratory', &
                                                                   'stress', 'stress_transient', 'rule']
    character(len=:), allocatable :: ignored
    integer, allocatable :: groups(:)
    integer :: i, k

    allocate (groups, source=input%groups_named('limit'))
    do i = 1, size(groups)
      ignored = ''
      do k = 1, size(keys)
        if (.not. input%groups(groups(i))%has_value(trim(keys(k)))) cycle
        if (ignored /= '') ignored = ignored // ' and '
        ignored = ignored // trim(keys(k))
      end do
      if (ignored == '') cycle
      call append(notes, input%place(groups(i), '') // ': a run compares nothing with ' // ignored // &
                         ', which is for steady oscillations: nocdyn response does')
    end do
  end subroutine note_other_limits

  !> Whether a group limits a peak.
  pure logical function has_peak(group)
    type(group_t), intent(in) :: group
    integer :: k

    has_peak = any([(group%has_value(trim(peak_keys(k))), k=1, size(peak_keys))])
  end function has_peak

  !> Writes whether a limit is exceeded, and all ratios; nothing without limits.
  subroutine put_run_limits(json, limits)
    type(json_t), intent(inout) :: json
    type(run_limit_t), intent(in) :: limits(:)
    integer :: i

    if (size(limits) == 0) return
    call json%put('limits_exceeded', any(limits%largest > limits%limit))
    call json%open_list('limits')
    do i = 1, size(limits)
      call json%open()
      call json%put('name', limits(i)%name)
      call json%put('column', limits(i)%column)
      call json%put('limit', limits(i)%limit)
      call json%put('largest', limits(i)%largest)
      call json%put('ratio', limits(i)%largest / limits(i)%limit)
      call json%close()
    end do
    call json%close_list()
  end subroutine put_run_limits

  !> A line for every limit that is exceeded, each with a line feed; '' if all are kept.
  function run_limits_text(limits, before) result(text)
    type(run_limit_t), intent(in) :: limits(:)
    character(len=*), intent(in) :: before   !! at the beginning of each line
    character(len=:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(limits)
      if (limits(i)%largest <= limits(i)%limit) cycle
      text = text // before // 'limit exceeded: ' // limits(i)%column // ' has reached ' // &
             rounded_text(limits(i)%largest, 6) // ', ' // rounded_text(100.0_wp * limits(i)%largest / limits(i)%limit, 3) // &
             ' % of ' // rounded_text(limits(i)%limit, 6) // new_line('a')
    end do
  end function run_limits_text

end module nocdyn_run_limits
