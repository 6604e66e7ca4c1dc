!> The elements and the signals that groups &limit are of.
module nocdyn_limit_groups
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema_text, only: suggestion
  use nocdyn_signals, only: find_signal, signal_t
  use nocdyn_text, only: quoted, rounded_text, string_t
  implicit none (type, external)
  private

  public :: check_limit, derating, limited_kind, limited_signal

contains

  !> 'coupling', 'shaft' or 'mesh'.
  pure function limited_kind(group) result(kind)
    type(group_t), intent(in) :: group   !! &limit
    character(len=8) :: kind

    kind = 'coupling'
    if (group%has_value('shaft')) kind = 'shaft'
    if (group%has_value('mesh')) kind = 'mesh'
  end function limited_kind

  !> The signal that a group compares with its limits, 0 if there is none: its `quantity`, else the moment of a coupling, the
  !> largest one along a shaft, or the force of a mesh.
  integer function limited_signal(group, signals) result(found)
    type(group_t), intent(in) :: group   !! &limit
    type(signal_t), intent(in) :: signals(:)
    character(len=:), allocatable :: kind

    kind = trim(limited_kind(group))
    if (group%has_value('quantity')) then
      found = find_signal(signals, kind, group%text(kind), group%text('quantity'))
    else if (kind == 'mesh') then
      found = find_signal(signals, kind, group%text(kind), 'force')
    else if (kind == 'shaft') then
      found = find_signal(signals, kind, group%text(kind), 'total_moment', 'max')
    else
      found = find_signal(signals, kind, group%text(kind), 'total_moment')
    end if
  end function limited_signal

  !> The factor of the limits of moments at the temperature of a coupling; below the lowest temperature the one there.
  pure real(wp) function derating(group) result(factor)
    type(group_t), intent(in) :: group   !! &limit
    integer :: i

    factor = 1.0_wp
    if (.not. group%has_value('temperature')) return
    associate (x => group%numbers('derating_temperatures'), y => group%numbers('derating_factors'), &
               temperature => group%number('temperature'))
      i = min(max(count(x <= temperature), 1), size(x) - 1)
      factor = y(i) + (y(i + 1) - y(i)) * min(max((temperature - x(i)) / (x(i + 1) - x(i)), 0.0_wp), 1.0_wp)
    end associate
  end function derating

  !> Refuses temperatures above the ones whose factors are known.
  subroutine check_temperature(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    real(wp) :: highest

    if (.not. input%groups(index)%has_value('temperature')) return
    highest = maxval(input%groups(index)%numbers('derating_temperatures'))
    if (input%groups(index)%number('temperature') <= highest) return
    call input%report(index, 'temperature', 'temperature: there is no factor of it; allowed: up to ' // &
                      rounded_text(highest, 6) // ' degC, the highest one of derating_temperatures', diagnostics)
  end subroutine check_temperature

  !> Refuses limits of elements that there are not, and at temperatures that are too high.
  subroutine check_limit(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=*), parameter :: kinds(*) = [character(len=8) :: 'coupling', 'shaft', 'mesh']
    character(len=8) :: kind
    character(len=:), allocatable :: name
    type(string_t), allocatable :: names(:)
    integer, allocatable :: groups(:)
    integer :: i

    call check_temperature(input, index, diagnostics)
    if (input%groups(index)%has_value('damper')) then   ! its coupling is derived
      call check_damper_name(input, index, diagnostics)
      return
    end if
    kind = limited_kind(input%groups(index))
    allocate (groups, source=input%groups_named(trim(kind)))
    allocate (names(size(groups)))
    do i = 1, size(groups)
      names(i)%text = input%groups(groups(i))%name
      if (names(i)%text == input%groups(index)%text(trim(kind))) return
    end do
    do i = 1, size(kinds)
      if (kinds(i) == kind .or. .not. has_name(input, trim(kinds(i)), input%groups(index)%text(trim(kind)))) cycle
      call input%report(index, trim(kind), quoted(input%groups(index)%text(trim(kind))) // ' is a ' // trim(kinds(i)) // &
                 '; needed: ' // trim(kinds(i)) // ' in place of ' // trim(kind), diagnostics)
      return
    end do
    name = input%groups(index)%text(trim(kind))
    call input%report(index, trim(kind), 'there is no ' // trim(kind) // ' ' // quoted(name), diagnostics, &
                      hint=suggestion(name, names))
  end subroutine check_limit

  !> Refuses limits of dampers that there are not.
  subroutine check_damper_name(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: name
    integer, allocatable :: groups(:)
    integer :: i

    allocate (groups, source=input%groups_named('damper'))
    allocate (names(size(groups)))
    do i = 1, size(groups)
      names(i)%text = input%groups(groups(i))%name
    end do
    name = input%groups(index)%text('damper')
    if (any([(names(i)%text == name, i=1, size(names))])) return
    call input%report(index, 'damper', 'there is no damper ' // quoted(name), diagnostics, hint=suggestion(name, names))
  end subroutine check_damper_name

  !> Whether a group of a kind has a name.
  pure logical function has_name(input, kind, name)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind, name
    integer :: i

    has_name = any([(input%groups(i)%kind == kind .and. input%groups(i)%name == name, i=1, size(input%groups))])
  end function has_name

end module nocdyn_limit_groups
