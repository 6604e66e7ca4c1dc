!> Units of the field beside SI: the only place that converts one into the other.
module nocdyn_units
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: in_si, from_si, unit_index, unit_for

  !> A unit and the SI unit of the same quantity.
  type, public :: unit_t
    character(len=3) :: name   !! as in headers
    character(len=5) :: si     !! as in headers
    real(wp) :: factor         !! one of this unit in the SI unit
  end type unit_t

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]

  !> The unit with the index 0 is the SI unit of the quantity. Of two units of one quantity the first is preferred for speeds.
  type(unit_t), parameter, public :: units(*) = [unit_t('rpm', 'rad/s', turn / 60.0_wp), unit_t('Hz', 'rad/s', turn), &
                                                 unit_t('deg', 'rad', turn / 360.0_wp)]
  integer, parameter, public :: unit_rpm = 1, unit_hz = 2, unit_deg = 3   !! indices of `units`

  real(wp), parameter :: factors(0:size(units)) = [1.0_wp, units%factor]

contains

  !> A number in its SI unit; unchanged to the last bit if it is in that.
  elemental real(wp) function in_si(value, unit)
    real(wp), intent(in) :: value   !! in `unit`
    integer, intent(in) :: unit     !! index of `units`, 0: SI

    in_si = value * factors(unit)
  end function in_si

  !> A number of SI in another unit; unchanged to the last bit if that is the SI unit.
  elemental real(wp) function from_si(value, unit)
    real(wp), intent(in) :: value   !! in the SI unit
    integer, intent(in) :: unit     !! index of `units`, 0: SI

    from_si = value / factors(unit)
  end function from_si

  !> Index of the unit with a name, 0 if there is none.
  pure integer function unit_index(name)
    character(len=*), intent(in) :: name   !! as in headers

    do unit_index = size(units), 1, -1
      if (units(unit_index)%name == name) return
    end do
  end function unit_index

  !> The first of some units that fits an SI unit, 0 if none does.
  pure integer function unit_for(si, wanted)
    character(len=*), intent(in) :: si    !! as in headers
    integer, intent(in) :: wanted(:)      !! indices of `units`

    do unit_for = 1, size(units)
      if (units(unit_for)%si == si .and. any(wanted == unit_for)) return
    end do
    unit_for = 0
  end function unit_for

end module nocdyn_units
