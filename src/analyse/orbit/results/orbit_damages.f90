!> The damage that a periodic motion does per hour, by &fatigue: the cycles of its period by rainflow counting.
module nocdyn_orbit_damages
  use nocdyn_damage_counters, only: damage_counter_t
  use nocdyn_fatigue_groups, only: element_kind, fatigue_symbol, read_curve
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_signal_columns, only: signal_columns_t
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signals, only: find_signal, signal_t
  use nocdyn_sn_curves, only: sn_curve_t
  implicit none (type, external)
  private

  public :: read_damages

  real(wp), parameter :: hour = 3600.0_wp   ! [s]

  !> What one group &fatigue asks for.
  type, public :: orbit_damage_t
    character(len=:), allocatable :: name, kind, element   !! of the group; 'coupling', 'shaft'; its name
    integer :: group = 0                                   !! of the input
    integer :: signal = 0                                  !! whose cycles are counted
    type(sn_curve_t) :: curve
  contains
    procedure :: rate
  end type orbit_damage_t

contains

  !> Reads all groups &fatigue.
  subroutine read_damages(input, signals, damages)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)
    type(orbit_damage_t), allocatable, intent(out) :: damages(:)
    integer, allocatable :: groups(:)
    integer :: i

    allocate (groups, source=input%groups_named('fatigue'))
    allocate (damages(size(groups)))
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)), one => damages(i))
        one%group = groups(i)
        one%name = group%name
        one%kind = trim(element_kind(group))
        one%element = group%text(one%kind)
        one%curve = read_curve(group)
        one%signal = find_signal(signals, one%kind, one%element, trim(fatigue_symbol(group)))
        if (one%signal == 0) one%signal = find_signal(signals, one%kind, one%element, trim(fatigue_symbol(group)), 'max')
        if (one%signal == 0) error stop 'nocdyn_orbit_damages: a checked group has a signal'
      end associate
    end do
  end subroutine read_damages

  !> The damage per hour of a motion [1/h], of a shaft at its worst point.
  subroutine rate(self, columns, samples, period, damage, exceeds_strength)
    class(orbit_damage_t), intent(in) :: self
    type(signal_columns_t), intent(in) :: columns
    type(signal_samples_t), intent(in) :: samples
    real(wp), intent(in) :: period                 !! [s]
    real(wp), intent(out) :: damage
    logical, intent(out) :: exceeds_strength       !! whether a mean leaves no strength for an amplitude
    type(damage_counter_t) :: counter
    real(wp), allocatable :: turning(:)
    integer :: i, k

    damage = 0.0_wp
    exceeds_strength = .false.
    counter%curve = self%curve
    do k = columns%first(self%signal), columns%first(self%signal + 1) - 1
      call samples%list_turning_values(k, turning)
      call counter%start()
      do i = 1, size(turning)
        call counter%add(turning(i))
      end do
      call counter%finish()
      damage = max(damage, counter%damage * (hour / period))
      exceeds_strength = exceeds_strength .or. counter%has_failed
    end do
  end subroutine rate

end module nocdyn_orbit_damages
