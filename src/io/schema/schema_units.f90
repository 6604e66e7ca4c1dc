!> Keys written in units of the field: a key of an angle, a speed or a frequency has a second name that ends in its unit, such as
!> speed_rpm beside speed.
module nocdyn_schema_units
  use nocdyn_schema, only: has_word, key_rule_index, key_rules
  use nocdyn_schema_rules, only: a_number, key_rule_t
  use nocdyn_text, only: lower_case
  use nocdyn_units, only: unit_deg, unit_hz, unit_rpm, units
  implicit none (type, external)
  private

  public :: find_key, name_in_unit, other_unit, path_key, takes_units, unit_name

  !> Keys whose numbers have the unit of the number that another key of their group names by its path.
  type :: path_unit_t
    character(len=7) :: group
    character(len=32) :: keys   !! separated by blanks
    character(len=6) :: path    !! the key with the path
  end type path_unit_t

  type(path_unit_t), parameter :: path_units(*) = [path_unit_t('vary', 'low high mean deviation median', 'target'), &
                                                   path_unit_t('unknown', 'low high start prior deviation', 'target'), &
                                                   path_unit_t('design', 'low high start step values', 'target'), &
                                                   path_unit_t('orbit', 'range', 'over')]

contains

  !> The unit beside the one of SI in which a key may be written: index of `units`, 0 if there is none.
  elemental integer function other_unit(rule) result(unit)
    type(key_rule_t), intent(in) :: rule

    select case (rule%unit)
    case ('rad/s')
      unit = merge(unit_hz, unit_rpm, index(rule%name, 'frequency') > 0)
    case ('rad')
      unit = unit_deg
    case default
      unit = 0
    end select
  end function other_unit

  !> The key of the same group with the path of the number in whose unit the numbers of a key are, '' if it has a unit of its own.
  pure function path_key(rule) result(name)
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable :: name
    integer :: i

    name = ''
    do i = 1, size(path_units)
      if (path_units(i)%group == rule%group .and. has_word(path_units(i)%keys, rule%name)) name = trim(path_units(i)%path)
    end do
  end function path_key

  !> Whether a number of a key may be a text with its unit, '12 kN m'.
  pure logical function takes_units(rule, unit)
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit   !! in which it is written: index of `units`, 0: as the schema says

    takes_units = rule%value_type == a_number .and. unit == 0
  end function takes_units

  !> Finds a key by its name or by that in its other unit.
  pure subroutine find_key(group_rule, name, key, unit)
    integer, intent(in) :: group_rule      !! row of `group_rules`
    character(len=*), intent(in) :: name   !! in lower case
    integer, intent(out) :: key            !! row of `key_rules`, 0 if the group has no such key
    integer, intent(out) :: unit           !! in which its values are: index of `units`, 0: as the schema says
    integer :: bar

    unit = 0
    key = key_rule_index(group_rule, name)
    bar = index(name, '_', back=.true.)
    if (key > 0 .or. bar == 0) return
    key = key_rule_index(group_rule, name(:bar - 1))
    if (key == 0) return
    unit = other_unit(key_rules(key))
    if (unit > 0) then
      if (name == name_in_unit(key_rules(key), unit)) return
    end if
    key = 0
    unit = 0
  end subroutine find_key

  !> Name of a key in a unit: "speed_rpm", "speed".
  pure function name_in_unit(rule, unit) result(name)
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit   !! index of `units`, 0: as the schema says
    character(len=:), allocatable :: name

    name = trim(rule%name)
    if (unit > 0) name = name // '_' // trim(lower_case(units(unit)%name))
  end function name_in_unit

  !> "rpm", "rad/s"; '' if the key has no unit.
  pure function unit_name(rule, unit) result(name)
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit   !! index of `units`, 0: as the schema says
    character(len=:), allocatable :: name

    name = trim(rule%unit)
    if (unit > 0) name = trim(units(unit)%name)
  end function unit_name

end module nocdyn_schema_units
