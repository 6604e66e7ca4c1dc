!> The elements and the signals that groups &limit are of.
module nocdyn_limit_groups
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_schema_text, only: suggestion
  use nocdyn_signals, only: find_signal, signal_t
  use nocdyn_text, only: quoted, string_t
  implicit none (type, external)
  private

  public :: check_limit, limited_kind, limited_signal

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

  !> Refuses limits of elements that there are not.
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

  !> Whether a group of a kind has a name.
  pure logical function has_name(input, kind, name)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind, name
    integer :: i

    has_name = any([(input%groups(i)%kind == kind .and. input%groups(i)%name == name, i=1, size(input%groups))])
  end function has_name

end module nocdyn_limit_groups
