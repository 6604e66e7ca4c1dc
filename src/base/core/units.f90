!> The units in which keys and columns are written beside SI, and the symbols of which users make others, with their dimensions
!> and with factors that are exact by definition. `nocdyn_unit_expressions` reads units made of symbols.
!>
!> The factors are the ones of NIST Special Publication 811, Guide for the Use of the International System of Units (2008),
!> appendix B.8: the international pound is 0.45359237 kg and the foot 0.3048 m; the pound-force, kilogram-force, psi, slug and
!> horsepower (550 ft lbf/s) follow from these and the standard gravity, 9.80665 m/s2; the metric horsepower is 75 kgf m/s.
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

  !> The base units of dimensions, in the order in which they are written. A radian is one: torsional stiffness in N m/deg.
  character(len=3), parameter, public :: base_units(6) = [character(len=3) :: 'kg', 'm', 's', 'A', 'rad', 'K']

  !> A symbol. A number in it is (number + offset) numerator / denominator in base units. Numerator and denominator are whole
  !> numbers where a unit is a decimal of a base unit, so that 0.5 mm is 0.5 / 1000 m, rounded once.
  type, public :: unit_symbol_t
    character(len=6) :: name
    integer :: dimension(6)                !! exponents of `base_units`
    real(wp) :: numerator = 1.0_wp, denominator = 1.0_wp
    logical :: takes_prefix = .false.
    real(wp) :: offset = 0.0_wp            !! of temperatures that are not counted from absolute zero
  end type unit_symbol_t

  !> Decimal multiple of a unit.
  type, public :: unit_prefix_t
    character :: name
    real(wp) :: numerator, denominator
  end type unit_prefix_t

  !> Another way to write a symbol or a product, as data sheets have it: 'kNm', 'sec', and what it means. A power belongs to the
  !> last factor ('kgm2').
  type, public :: unit_spelling_t
    character(len=6) :: name
    character(len=8) :: meaning
    logical :: takes_prefix = .false.
  end type unit_spelling_t

  !> A word that has several meanings, and what is to be written.
  type, public :: ambiguous_unit_t
    character(len=4) :: name
    character(len=96) :: reason
  end type ambiguous_unit_t

  !> What a quantity is called, by its unit.
  type, public :: quantity_name_t
    character(len=10) :: unit
    character(len=24) :: name
  end type quantity_name_t

  real(wp), parameter :: pound = 45359237.0_wp, pounds = 1.0e8_wp       ! `pound` / `pounds` kg
  real(wp), parameter :: gravity = 980665.0_wp, gravities = 1.0e5_wp    ! `gravity` / `gravities` m/s2
  real(wp), parameter :: foot = 3048.0_wp, feet = 1.0e4_wp              ! `foot` / `feet` m
  real(wp), parameter :: inch = 254.0_wp, inches = 1.0e4_wp             ! `inch` / `inches` m
  real(wp), parameter :: absolute_zero = 273.15_wp                      ! below 0 degC [K]
  real(wp), parameter :: fahrenheit_zero = 459.67_wp                    ! below 0 degF [degF]

  integer, parameter :: none(6) = 0, mass(6) = [1, 0, 0, 0, 0, 0], length(6) = [0, 1, 0, 0, 0, 0], time(6) = [0, 0, 1, 0, 0, 0], &
    current(6) = [0, 0, 0, 1, 0, 0], angle(6) = [0, 0, 0, 0, 1, 0], temperature(6) = [0, 0, 0, 0, 0, 1]
  integer, parameter :: speed(6) = angle - time, force(6) = mass + length - 2 * time, pressure(6) = force - 2 * length, &
    energy(6) = force + length, power(6) = energy - time, voltage(6) = power - current

  type(unit_symbol_t), parameter, public :: unit_symbols(*) = [ &
    unit_symbol_t('kg', mass), &
    unit_symbol_t('g', mass, 1.0_wp, 1000.0_wp, takes_prefix=.true.), &
    unit_symbol_t('t', mass, 1000.0_wp), &
    unit_symbol_t('lbm', mass, pound, pounds), &
    unit_symbol_t('ozm', mass, pound, 16.0_wp * pounds), &
    unit_symbol_t('slug', mass, pound * gravity, pounds * gravities / feet * foot), &
    unit_symbol_t('m', length, takes_prefix=.true.), &
    unit_symbol_t('in', length, inch, inches), &
    unit_symbol_t('ft', length, foot, feet), &
    unit_symbol_t('yd', length, 3.0_wp * foot, feet), &
    unit_symbol_t('mil', length, inch, 1000.0_wp * inches), &
    unit_symbol_t('l', 3 * length, 1.0_wp, 1000.0_wp, takes_prefix=.true.), &
    unit_symbol_t('L', 3 * length, 1.0_wp, 1000.0_wp, takes_prefix=.true.), &
    unit_symbol_t('s', time, takes_prefix=.true.), &
    unit_symbol_t('min', time, 60.0_wp), &
    unit_symbol_t('h', time, 3600.0_wp), &
    unit_symbol_t('d', time, 86400.0_wp), &
    unit_symbol_t('rad', angle, takes_prefix=.true.), &
    unit_symbol_t('deg', angle, units(unit_deg)%factor), &
    unit_symbol_t('gon', angle, turn, 400.0_wp), &
    unit_symbol_t('rev', angle, turn), &
    unit_symbol_t('rpm', speed, units(unit_rpm)%factor), &
    unit_symbol_t('Hz', speed, units(unit_hz)%factor, takes_prefix=.true.), &
    unit_symbol_t('N', force, takes_prefix=.true.), &
    unit_symbol_t('kgf', force, gravity, gravities), &
    unit_symbol_t('lbf', force, pound * gravity, pounds * gravities), &
    unit_symbol_t('ozf', force, pound * gravity, 16.0_wp * pounds * gravities), &
    unit_symbol_t('kip', force, pound * gravity, pounds * gravities / 1000.0_wp), &
    unit_symbol_t('Pa', pressure, takes_prefix=.true.), &
    unit_symbol_t('bar', pressure, 1.0e5_wp, takes_prefix=.true.), &
    unit_symbol_t('psi', pressure, pound * gravity, pounds * gravities / inches**2 * inch**2), &
    unit_symbol_t('ksi', pressure, pound * gravity, pounds * gravities / inches**2 * inch**2 / 1000.0_wp), &
    unit_symbol_t('atm', pressure, 101325.0_wp), &
    unit_symbol_t('J', energy, takes_prefix=.true.), &
    unit_symbol_t('W', power, takes_prefix=.true.), &
    unit_symbol_t('hp', power, 550.0_wp * foot * (pound * gravity / 1000.0_wp), feet * pounds * gravities / 1000.0_wp), &
    unit_symbol_t('PS', power, 75.0_wp * gravity, gravities), &
    unit_symbol_t('A', current, takes_prefix=.true.), &
    unit_symbol_t('V', voltage, takes_prefix=.true.), &
    unit_symbol_t('Ohm', voltage - current, takes_prefix=.true.), &
    unit_symbol_t('H', voltage - current + time, takes_prefix=.true.), &
    unit_symbol_t('K', temperature), &
    unit_symbol_t('degC', temperature, offset=absolute_zero), &
    unit_symbol_t('degF', temperature, 5.0_wp, 9.0_wp, offset=fahrenheit_zero), &
    unit_symbol_t('%', none, 1.0_wp, 100.0_wp)]

  type(unit_prefix_t), parameter, public :: unit_prefixes(*) = [ &
    unit_prefix_t('T', 1.0e12_wp, 1.0_wp), unit_prefix_t('G', 1.0e9_wp, 1.0_wp), unit_prefix_t('M', 1.0e6_wp, 1.0_wp), &
    unit_prefix_t('k', 1.0e3_wp, 1.0_wp), unit_prefix_t('h', 100.0_wp, 1.0_wp), &
    unit_prefix_t('d', 1.0_wp, 10.0_wp), unit_prefix_t('c', 1.0_wp, 100.0_wp), &
    unit_prefix_t('m', 1.0_wp, 1.0e3_wp), unit_prefix_t('u', 1.0_wp, 1.0e6_wp), unit_prefix_t('n', 1.0_wp, 1.0e9_wp)]

  type(unit_spelling_t), parameter, public :: unit_spellings(*) = [ &
    unit_spelling_t('Nm', 'N m', takes_prefix=.true.), unit_spelling_t('Nms', 'N m s', takes_prefix=.true.), &
    unit_spelling_t('Nmm', 'N mm', takes_prefix=.true.), unit_spelling_t('Ncm', 'N cm', takes_prefix=.true.), &
    unit_spelling_t('Ws', 'W s', takes_prefix=.true.), unit_spelling_t('Wh', 'W h', takes_prefix=.true.), &
    unit_spelling_t('kgm', 'kg m'), unit_spelling_t('kgcm', 'kg cm'), unit_spelling_t('kgmm', 'kg mm'), &
    unit_spelling_t('gcm', 'g cm'), unit_spelling_t('gmm', 'g mm'), unit_spelling_t('tm', 't m'), &
    unit_spelling_t('kgfm', 'kgf m'), unit_spelling_t('kgfcm', 'kgf cm'), unit_spelling_t('kp', 'kgf'), &
    unit_spelling_t('kpm', 'kgf m'), unit_spelling_t('kpcm', 'kgf cm'), &
    unit_spelling_t('lbfft', 'lbf ft'), unit_spelling_t('lbfin', 'lbf in'), unit_spelling_t('ftlbf', 'ft lbf'), &
    unit_spelling_t('inlbf', 'in lbf'), unit_spelling_t('lbmft', 'lbm ft'), unit_spelling_t('lbmin', 'lbm in'), &
    unit_spelling_t('kips', 'kip'), unit_spelling_t('inch', 'in'), unit_spelling_t('thou', 'mil'), &
    unit_spelling_t('sec', 's'), unit_spelling_t('hr', 'h'), unit_spelling_t('r', 'rev'), unit_spelling_t('turn', 'rev'), &
    unit_spelling_t('rps', 'rev/s'), unit_spelling_t('ohm', 'Ohm')]

  type(ambiguous_unit_t), parameter, public :: ambiguous_units(*) = [ &
    ambiguous_unit_t('lb', 'is a mass or a force; allowed: lbm (0.45359237 kg), lbf (4.4482216152605 N)'), &
    ambiguous_unit_t('lbs', 'is a mass or a force; allowed: lbm (0.45359237 kg), lbf (4.4482216152605 N)'), &
    ambiguous_unit_t('ftlb', 'has a pound that is a mass or a force; allowed: ft lbf'), &
    ambiguous_unit_t('inlb', 'has a pound that is a mass or a force; allowed: in lbf'), &
    ambiguous_unit_t('lbft', 'has a pound that is a mass or a force; allowed: lbf ft, lbm ft2'), &
    ambiguous_unit_t('lbin', 'has a pound that is a mass or a force; allowed: lbf in, lbm in2'), &
    ambiguous_unit_t('oz', 'is a mass or a force; allowed: ozm (a 16th of lbm), ozf (a 16th of lbf)'), &
    ambiguous_unit_t('ton', 'has several meanings; allowed: t (1000 kg), lbm, kip (1000 lbf)'), &
    ambiguous_unit_t('tonf', 'has several meanings; allowed: kN, kip (1000 lbf)')]

  !> In words of the field. Units of the keys of inputs, and those that they are taken for.
  type(quantity_name_t), parameter, public :: quantity_names(*) = [ &
    quantity_name_t('kg m2', 'moment of inertia'), quantity_name_t('N m', 'torque'), &
    quantity_name_t('N m/rad', 'torsional stiffness'), quantity_name_t('N m s/rad', 'torsional damping'), &
    quantity_name_t('rad', 'angle'), quantity_name_t('rad/s', 'speed'), quantity_name_t('1/s', 'rate without an angle'), &
    quantity_name_t('s', 'time'), quantity_name_t('m', 'length'), quantity_name_t('m2', 'area'), &
    quantity_name_t('m3', 'volume'), quantity_name_t('m/s', 'velocity'), quantity_name_t('kg', 'mass'), &
    quantity_name_t('kg/m3', 'density'), quantity_name_t('N', 'force'), quantity_name_t('N/m', 'linear stiffness'), &
    quantity_name_t('N s/m', 'linear damping'), quantity_name_t('Pa', 'pressure or stress'), quantity_name_t('W', 'power'), &
    quantity_name_t('V', 'voltage'), quantity_name_t('Ohm', 'resistance'), quantity_name_t('H', 'inductance'), &
    quantity_name_t('K', 'temperature'), quantity_name_t('%', 'ratio')]

  !> With prefixes, for near matches of misspelt symbols.
  character(len=4), parameter, public :: usual_units(*) = [character(len=4) :: 'kN', 'MN', 'mm', 'cm', 'km', 'um', 'kPa', 'MPa', &
    'GPa', 'mbar', 'kW', 'MW', 'kNm', 'MNm', 'mg', 'ms', 'kJ', 'mH', 'mOhm', 'kV', 'mrad', 'kHz']

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
