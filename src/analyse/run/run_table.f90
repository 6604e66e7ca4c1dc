!> The printed table of a run: what one looks for first, on one screen.
module nocdyn_run_table
  use nocdyn_comparisons, only: write_comparisons
  use nocdyn_energy_balance, only: append_energy_balance
  use nocdyn_fatigue_report, only: fatigue_text
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_quantities, only: rank_force, rank_loss, rank_moment, rank_reaction, rank_speed, rank_stress, rank_torque
  use nocdyn_run_summary, only: run_summary_t
  use nocdyn_table_text, only: append_table, clear_rounding
  use nocdyn_text, only: counted, rounded_text, selected, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: columns_to_show, summary_table

  integer, parameter :: most_lines = 25   ! of columns and of the energy balance
  integer, parameter :: fewest_columns = 6
  integer, parameter :: sorts = 5         ! of columns, see `sort_of`

contains

  !> The title; last value and extremes with their times of the columns that one looks for, marked where they lie in the transient
  !> of the start; then the energy balance.
  function summary_table(input, summary) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=:), allocatable :: lives, text
    type(text_buffer_t) :: report, energies, verdict
    integer :: left   ! lines

    if (allocated(summary%energy_balance)) call append_energy_balance(energies, summary%energy_balance)
    text = energies%text()
    call summary%verdict%write_table(verdict)
    lives = ''
    if (allocated(summary%fatigue%items)) lives = fatigue_text(summary%fatigue)
    left = max(fewest_columns, most_lines - line_count(text) - line_count(verdict%text()) - line_count(lives))
    if (input%title() /= '') call report%append_line(input%title())
    call report%append(verdict%text())
    call append_columns(report, summary, left)
    call report%append(text)
    call report%append(lives)
    if (allocated(summary%comparisons)) call write_comparisons(summary%comparisons, report)
    text = report%text()
  end function summary_table

  pure integer function line_count(text)
    character(len=*), intent(in) :: text

    line_count = count(transfer(text, 'a', len(text)) == new_line('a'))
  end function line_count

  subroutine append_columns(report, summary, most)
    type(text_buffer_t), intent(inout) :: report
    type(run_summary_t), intent(in) :: summary
    integer, intent(in) :: most   !! columns
    character(len=64) :: headings(0:5)
    character(len=:), allocatable :: until
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: ranks(:), shown(:)
    real(wp), allocatable :: values(:, :), times(:, :)
    logical, allocatable :: marks(:, :)

    headings(0) = 'quantity (' // counted(summary%extremes%rows, 'row', 'rows') // ')'
    headings(1:) = [character(len=8) :: 'the last', 'smallest', 'at t [s]', 'largest', 'at t [s]']
    if (summary%extremes%are_continuous) headings(0) = 'quantity'
    associate (extremes => summary%extremes)
      if (extremes%from > summary%t_start) headings(0) = trim(headings(0)) // ' from t = ' // to_text(extremes%from) // ' s'
      ranks = summary%signals%rank
      allocate (shown, source=columns_to_show(ranks, summary%chosen(2:), max(abs(extremes%lowest), abs(extremes%highest)), most))
      allocate (values, source=reshape([extremes%last(shown), extremes%lowest(shown), extremes%highest(shown)], [size(shown), 3]))
      allocate (times, source=reshape([extremes%lowest_time(shown), extremes%highest_time(shown)], [size(shown), 2]))
    end associate
    allocate (marks(size(shown), 5), source=.false.)
    marks(:, 3) = summary%transient%has_lowest(shown)
    marks(:, 5) = summary%transient%has_highest(shown)
    allocate (labels, source=selected(summary%labels, shown))
    call clear_rounding(labels, values)
    call append_table(report, labels, reshape([values(:, 1:2), times(:, 1), values(:, 3), times(:, 2)], [size(shown), 5]), &
                      headings, 0, '', marks=marks)
    if (size(shown) < size(summary%chosen) - 1) then
      call report%append_line('(' // counted(size(summary%chosen) - 1 - size(shown), 'more column', 'more columns') // &
                              ": summary.json has all; &output columns = 'omega_*', for instance, chooses)")
    end if
    if (.not. any(marks)) return
    until = rounded_text(summary%transient%until, 3)
    call report%append_line('* in the first fast transient of a start out of balance, up to t = ' // until // &
                            ' s; &output extremes_from = ' // until // &
                            " leaves it out, &run start = 'equilibrium' begins in balance")
  end subroutine append_columns

  !> The columns to print, by sorts and within each in the order of the table: of every sort its share of the lines at least, and
  !> of many columns those with the largest values.
  function columns_to_show(ranks, columns, sizes, most) result(shown)
    integer, intent(in) :: ranks(:)           !! rank_... of all columns
    integer, intent(in) :: columns(:)         !! that may be shown
    real(wp), intent(in) :: sizes(:)          !! largest magnitudes of all columns
    integer, intent(in) :: most               !! to show
    integer, allocatable :: shown(:)
    integer :: available(sorts), lines(sorts), sort, sort_of_column(size(columns))
    integer :: i
    logical :: is_shown(size(columns))

    sort_of_column = sort_of(ranks(columns))
    available = [(count(sort_of_column == sort), sort=1, sorts)]
    lines = min(available, [(most / (sorts - 1), i=2, sorts), 0])
    do sort = 1, sorts
      lines(sort) = min(available(sort), lines(sort) + most - sum(lines))
    end do
    allocate (shown(0))
    do sort = 1, sorts
      is_shown = .false.
      do i = 1, lines(sort)
        is_shown(maxloc(sizes(columns), dim=1, mask=sort_of_column == sort .and. .not. is_shown)) = .true.
      end do
      shown = [shown, pack(columns, is_shown)]
    end do
  end function columns_to_show

  !> Moments in couplings 1; reactions, forces and stresses 2; torques 3; speeds 4; all others, among them the parts of a moment
  !> that has a column in whole, 5.
  elemental integer function sort_of(rank) result(sort)
    integer, intent(in) :: rank   !! rank_...

    select case (rank)
    case (rank_moment)
      sort = 1
    case (rank_reaction, rank_force, rank_stress)
      sort = 2
    case (rank_torque, rank_loss)
      sort = 3
    case (rank_speed)
      sort = 4
    case default
      sort = 5
    end select
  end function sort_of

end module nocdyn_run_table
