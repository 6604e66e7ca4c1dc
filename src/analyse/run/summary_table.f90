!> The printed summary of a run.
module nocdyn_summary_table
  use nocdyn_energy_balance, only: append_energy_balance
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_run_summary, only: run_summary_t
  use nocdyn_table_text, only: append_table, cell_digits
  use nocdyn_text, only: rounded_text, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: summary_line, summary_table, method_line

contains

  !> One line with the counts of the integration and the folder of the results.
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

  !> One line on the switches of the method 'auto'; empty if there are none.
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

  !> The title; for every column the last value and the extremes with their times; then the energy balance.
  function summary_table(input, summary) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    character(len=*), parameter :: headings(*) = [character(len=8) :: 'the last', 'smallest', 'at t [s]', 'largest', 'at t [s]']
    type(text_buffer_t) :: report
    character(len=:), allocatable :: heading

    if (input%title() /= '') call report%append_line(input%title())
    heading = 'of ' // to_text(summary%extremes%rows) // ' rows:'
    if (summary%extremes%are_continuous) heading = 'of the motion:'
    associate (extremes => summary%extremes, n => size(summary%labels))
      call append_table(report, summary%labels(2:), reshape([extremes%last(2:), extremes%lowest(2:), extremes%lowest_time(2:), &
                                                             extremes%highest(2:), extremes%highest_time(2:)], [n - 1, 5]), &
                        heading, headings, 0, 'more columns in summary.json')
    end associate
    if (allocated(summary%energy_balance)) call append_energy_balance(report, summary%energy_balance)
    text = report%text()
  end function summary_table

end module nocdyn_summary_table
