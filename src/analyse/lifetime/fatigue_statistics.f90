!> The statistics of groups &fatigue, of runs and of sweeps.
module nocdyn_fatigue_statistics
  use nocdyn_fatigue_groups, only: element_kind, fatigue_symbol, quantity_of, quantity_units
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_signals, only: signal_t
  use nocdyn_statistics, only: new_fatigue_statistic, statistic_t
  implicit none (type, external)
  private

  public :: fatigue_statistic

contains

  !> A statistic of a &fatigue. It begins where its cycles are counted in a run.
  type(statistic_t) function fatigue_statistic(input, fatigue, kind, t_start) result(statistic)
    type(input_t), intent(in) :: input
    integer, intent(in) :: fatigue, kind   !! index of the &fatigue; statistic_...
    real(wp), intent(in) :: t_start        !! [s]
    type(signal_t) :: signal
    real(wp) :: from

    from = input%groups(input%position('output'))%number('extremes_from', absent=t_start)
    associate (group => input%groups(fatigue))
      signal%element_kind = trim(element_kind(group))
      signal%element = group%text(signal%element_kind)
      signal%symbol = trim(fatigue_symbol(group))
      signal%point = ''
      signal%caption = 'signal whose cycles are counted'
      signal%positive = ''
      signal%name = signal%symbol // '_' // signal%element
      signal%unit = trim(quantity_units(quantity_of(group)))
      statistic = new_fatigue_statistic(group%name, fatigue, signal, kind, from)
      if (element_kind(group) /= 'shaft') return
      statistic%shaft = signal%element
      statistic%is_stress = signal%symbol == 'stress'
    end associate
  end function fatigue_statistic

end module nocdyn_fatigue_statistics
