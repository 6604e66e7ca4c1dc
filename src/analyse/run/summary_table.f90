!> The summary of a run as a person reads it.
module nocdyn_summary_table
  use nocdyn_energy_balance, only: energy_balance_text
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_run_summary, only: run_summary_t
  use nocdyn_table_text, only: cell, cell_digits, padded, right
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: summary_line, summary_table, method_line

  integer, parameter :: most_rows = 60    ! a larger machine has its table in summary.json

contains

  !> One line: what was done, and where the results are.
  function summary_line(input, summary, folder) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: text

    text = input%file // ': done at t = ' // to_text(summary%solver_status%t(1)) // ' s, ' // &
           to_text(summary%solver_status%accepted(1)) // ' steps (' // &
           to_text(summary%solver_status%rejected(1)) // ' rejected), '
    if (summary%solver_status%crossings(1) > 0) then
      text = text // to_text(summary%solver_status%crossings(1)) // ' kinks or jumps crossed, '
    end if
    text = text // to_text(summary%extremes%rows) // ' rows, ' // rounded_text(1000.0_wp * summary%wall_time, 3) // &
           ' ms; results in ' // folder
  end function summary_line

  !> One line on what 'auto' did; empty if it never switched.
  function method_line(input, summary) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text

    text = ''
    associate (solver_status => summary%solver_status)
      if (solver_status%switches(1) == 0) return
      text = input%file // ': stiff: implicit steps from t = ' // rounded_text(solver_status%switch_times(1, 1), &
                                                                               cell_digits) // ' s'
      if (solver_status%switches(1) > 1) text = text // ' (' // to_text(solver_status%switches(1)) // ' switches in all)'
      text = text // ', ' // to_text(solver_status%implicit_steps(1)) // ' of ' // to_text(solver_status%accepted(1)) // ' steps'
    end associate
  end function method_line

  !> Title, and last, smallest and largest value of every column with the times of the extremes; then where the
  !> energy came from and went to.
  function summary_table(input, summary) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    type(group_t) :: about
    character(len=:), allocatable :: energy_balance, heading
    integer :: i, label_width, rows

    about = input%single('case')
    text = about%text('title')
    if (len(text) > 0) text = text // new_line('a')
    rows = min(size(summary%labels), most_rows)
    heading = 'of ' // to_text(summary%extremes%rows) // ' rows:'
    if (summary%extremes%are_continuous) heading = 'of the motion:'
    label_width = max(len(heading), maxval([(len(summary%labels(i)%text), i=2, rows)]))
    text = text // padded(heading, label_width) // right('the last') // &
           right('smallest') // right('at t [s]') // right('largest') // right('at t [s]')
    associate (extremes => summary%extremes)
      do i = 2, rows
        text = text // new_line('a') // padded(summary%labels(i)%text, label_width) // cell(extremes%last(i)) // &
               cell(extremes%lowest(i)) // cell(extremes%lowest_time(i)) // cell(extremes%highest(i)) // &
               cell(extremes%highest_time(i))
      end do
    end associate
    if (rows < size(summary%labels)) text = text // new_line('a') // '(' // to_text(size(summary%labels) - rows) // &
                                            ' more columns in summary.json)'
    if (.not. allocated(summary%energy_balance)) return
    energy_balance = energy_balance_text(summary%energy_balance)
    if (len(energy_balance) > 0) text = text // new_line('a') // energy_balance
  end function summary_table

end module nocdyn_summary_table
