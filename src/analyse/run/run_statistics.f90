!> The statistics of a run: the extremes of its columns, and the cycles of its groups &fatigue.
module nocdyn_run_statistics
  use nocdyn_fatigue_groups, only: read_curve
  use nocdyn_fatigue_statistics, only: fatigue_statistic
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_run_fatigue, only: new_run_fatigue, run_fatigue_t
  use nocdyn_run_summary, only: column_extremes_t
  use nocdyn_statistics, only: statistic_damage, statistic_max, statistic_min, statistic_t, &
    statistic_time_of_max, statistic_time_of_min
  use nocdyn_statistics_observer, only: statistics_observer_t
  use nocdyn_signals, only: list_signals, signal_t
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: list_statistics, find_extremes, take_fatigue

  integer, parameter :: kinds(4) = [statistic_min, statistic_time_of_min, statistic_max, statistic_time_of_max]

contains

  !> The extremes of each column of the table, one after the other, and a damage of each &fatigue.
  subroutine list_statistics(input, machine, t_start, statistics)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t_start   !! [s]
    type(statistic_t), allocatable, intent(out) :: statistics(:)
    type(signal_t), allocatable :: signals(:)
    integer, allocatable :: groups(:)
    real(wp) :: from
    integer :: c, i, k

    call list_signals(machine, signals)
    allocate (groups, source=input%groups_named('fatigue'))
    allocate (statistics(size(kinds) * size(signals) + size(groups)))
    from = input%groups(input%position('output'))%number('extremes_from', absent=t_start)
    i = 0
    do c = 1, size(signals)
      do k = 1, size(kinds)
        i = i + 1
        statistics(i)%column = c
        statistics(i)%kind = kinds(k)
        statistics(i)%from = from
      end do
    end do
    do k = 1, size(groups)
      statistics(i + k) = fatigue_statistic(input, groups(k), statistic_damage, t_start)
      statistics(i + k)%curve = read_curve(input%groups(groups(k)))
      statistics(i + k)%keeps_classes = .true.
    end do
  end subroutine list_statistics

  !> The extremes of the columns after a run. Before the first step they are the values of the only row.
  subroutine find_extremes(observer, input, units, row, rows, extremes)
    class(statistics_observer_t), intent(in) :: observer
    type(input_t), intent(in) :: input
    integer, intent(in) :: units(:)    !! of the columns of the table
    real(wp), intent(in) :: row(:)     !! the last one
    integer, intent(in) :: rows        !! their number
    type(column_extremes_t), intent(out) :: extremes
    real(wp) :: values(size(kinds))
    integer :: c, k

    extremes%rows = rows
    extremes%last = row(:size(units))
    extremes%lowest = extremes%last
    extremes%highest = extremes%last
    allocate (extremes%lowest_time(size(units)), extremes%highest_time(size(units)), source=row(1))
    associate (output => input%groups(input%position('output')))
      if (output%has_value('extremes_from')) extremes%from = output%number('extremes_from')
    end associate
    extremes%have_begun = rows > 0 .and. row(1) >= extremes%from
    if (.not. observer%has_begun(1)) return
    extremes%are_continuous = .true.
    extremes%have_begun = .true.
    do c = 1, size(units)
      do k = 1, size(kinds)
        values(k) = observer%value_of(size(kinds) * (c - 1) + k, 1)
      end do
      extremes%lowest(c) = from_si(values(1), units(c))
      extremes%lowest_time(c) = values(2)
      extremes%highest(c) = from_si(values(3), units(c))
      extremes%highest_time(c) = values(4)
    end do
  end subroutine find_extremes

  !> The cycles of the groups &fatigue after a run.
  subroutine take_fatigue(observer, input, machine, columns, fatigue)
    class(statistics_observer_t), intent(in) :: observer
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: columns   !! of the table
    type(run_fatigue_t), intent(out) :: fatigue
    integer :: i

    call new_run_fatigue(input, machine, fatigue)
    do i = 1, size(fatigue%items)
      associate (item => fatigue%items(i))
        call observer%take_counters(size(kinds) * columns + i, 1, fatigue%counters(item%first:item%last))
      end associate
    end do
  end subroutine take_fatigue

end module nocdyn_run_statistics
