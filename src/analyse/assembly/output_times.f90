!> The times of the rows in the table of results.
module nocdyn_output_times
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: check_output_times, output_note, output_times, row_count, table_bytes

  integer, parameter :: most_rows = 10000000   ! some gigabytes of text

  real(wp), parameter :: sliver = 1.0e-9_wp   ! of an interval: a last row closer to t_end than this or rounding is moved there

contains

  !> Refuses more than `most_rows` rows, intervals that are so short that rounding makes their times equal, and extremes from a
  !> time that is not in the run.
  subroutine check_output_times(input, diagnostics)
    type(input_t), intent(in) :: input   !! checked
    type(diagnostics_t), intent(inout) :: diagnostics
    type(group_t) :: output, run
    real(wp) :: rounding, span, step
    character(len=:), allocatable :: message, key

    output = input%single('output')
    run = input%single('run')
    span = run%number('t_end') - run%number('t_start')
    call check_extremes_from(input, diagnostics)
    rounding = spacing(max(abs(run%number('t_start')), abs(run%number('t_end'))))
    if (output%has_value('interval')) then
      key = 'interval'
      step = output%number(key)
      message = key // ' = ' // to_text(step)
    else
      key = 'points'
      step = span / (output%whole_number(key) - 1)
      message = key // ' = ' // to_text(output%whole_number(key))
    end if
    if (step < span / most_rows) then
      message = message // ' asks for too many rows; allowed: at most ' // to_text(most_rows) // &
                  ', an interval of ' // rounded_text(span / most_rows, 3) // ' s'
    else if (step <= rounding) then
      message = message // ' asks for times that rounding makes equal; allowed: an interval above ' // &
                  rounded_text(rounding, 3) // ' s, the spacing of numbers at t_start and t_end'
    else
      return
    end if
    call input%report(input%position('output'), key, message, diagnostics)
  end subroutine check_output_times

  !> Refuses extremes from a time before the start, or from the end on.
  subroutine check_extremes_from(input, diagnostics)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(inout) :: diagnostics
    type(group_t) :: output, run
    character(len=:), allocatable :: allowed

    output = input%single('output')
    run = input%single('run')
    if (.not. output%has_value('extremes_from')) return
    associate (from => output%number('extremes_from'), t_start => run%number('t_start'), t_end => run%number('t_end'))
      if (from >= t_start .and. from < t_end) return
      allowed = '< t_end = ' // to_text(t_end)
      if (from < t_start) allowed = '>= t_start = ' // to_text(t_start)
      call input%report(input%position('output'), 'extremes_from', 'extremes_from = ' // to_text(from) // &
                        ' is out of range; allowed: ' // allowed, diagnostics)
    end associate
  end subroutine check_extremes_from

  !> What a person may not have meant: an interval that is longer than the run; '' if there is nothing to tell.
  function output_note(input) result(text)
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: text
    type(group_t) :: output, run

    output = input%single('output')
    run = input%single('run')
    text = ''
    if (.not. output%has_value('interval')) return
    associate (interval => output%number('interval'), span => run%number('t_end') - run%number('t_start'))
      if (interval > span) text = 'interval = ' // to_text(interval) // ' s is longer than the run of ' // &
                                  rounded_text(span, 6) // ' s: there are rows at t_start and t_end only'
    end associate
  end function output_note

  !> The number of the requested times.
  pure integer function row_count(input)
    type(input_t), intent(in) :: input   !! that `check_output_times` accepts
    type(group_t) :: output, run
    real(wp) :: rounding   ! of the times [s]

    output = input%single('output')
    run = input%single('run')
    if (output%has_value('interval')) then
      associate (t_start => run%number('t_start'), t_end => run%number('t_end'), interval => output%number('interval'))
        rounding = spacing(max(abs(t_start), abs(t_end)))
        row_count = 1 + max(1, ceiling((t_end - t_start) / interval - max(sliver, rounding / interval)))
      end associate
    else
      row_count = output%whole_number('points')
    end if
  end function row_count

  !> About the size of a table of numbers as text [bytes].
  pure real(wp) function table_bytes(rows, columns)
    integer, intent(in) :: rows, columns
    real(wp), parameter :: of_number = 19.0_wp   ! 17 digits, point and comma; signs and exponents make up for shorter numbers

    table_bytes = of_number * rows * columns
  end function table_bytes

  !> The requested times: a row at t_start, one every `interval`, and one at t_end; or `points` rows evenly spaced.
  pure function output_times(input, rows) result(times)
    type(input_t), intent(in) :: input         !! that `check_output_times` accepts
    integer, intent(in) :: rows                !! their number; an interval of the input has its own, the one of `row_count`
    real(wp), allocatable :: times(:)
    type(group_t) :: output, run
    integer :: i

    output = input%single('output')
    run = input%single('run')
    associate (t_start => run%number('t_start'), t_end => run%number('t_end'))
      if (output%has_value('interval')) then
        associate (interval => output%number('interval'))
          times = [(t_start + i * interval, i=0, rows - 1)]
        end associate
      else
        times = [(t_start + (t_end - t_start) * i / (rows - 1), i=0, rows - 1)]
      end if
      times(size(times)) = t_end
    end associate
  end function output_times

end module nocdyn_output_times
