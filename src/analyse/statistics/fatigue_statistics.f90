!> The statistics of groups &fatigue, of runs and of sweeps.
module nocdyn_fatigue_statistics
  use nocdyn_fatigue_groups, only: element_kind, quantity_moment, quantity_of, quantity_stress
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
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
    character(len=:), allocatable :: element, quantity
    real(wp) :: from

    from = input%groups(input%position('output'))%number('extremes_from', absent=t_start)
    associate (group => input%groups(fatigue))
      element = group%text(trim(element_kind(group)))
      quantity = ''
      select case (quantity_of(group))
      case (quantity_stress)
        quantity = 'stress_' // element // ' [Pa]'
      case (quantity_moment)
        quantity = 'shaft_' // element // ' [N m]'
      case default
        quantity = trim(merge('reaction', 'force   ', element_kind(group) == 'gear')) // '_' // element // ' [N]'
      end select
      statistic = new_fatigue_statistic(group%name, fatigue, quantity, kind, from)
      if (element_kind(group) /= 'shaft') return
      statistic%quantity = ''
      statistic%shaft = element
      statistic%is_stress = quantity_of(group) == quantity_stress
    end associate
  end function fatigue_statistic

end module nocdyn_fatigue_statistics
