!> Checks of the rigid joints that need several of their keys: members that are different, numbers that fit.
module nocdyn_joint_checks
  use nocdyn_input, only: group_t
  use nocdyn_ordering_rules, only: teeth_message
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_schema_rules, only: body_or_ground
  use nocdyn_text, only: quoted, to_text
  implicit none (type, external)
  private

  public :: check_joints

contains

  !> What the groups of rigid joints ask of their own keys: different members, teeth with room for planets, lists of equal length.
  subroutine check_joints(groups, diagnostics)
    type(group_t), intent(in) :: groups(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: g

    do g = 1, size(groups)
      select case (groups(g)%kind)
      case ('planetary')
        call check_members(groups(g), g, diagnostics)
        call check_teeth(groups(g), g, diagnostics)
      case ('differential')
        call check_members(groups(g), g, diagnostics)
      case ('constraint')
        call check_coefficients(groups(g), g, diagnostics)
      case default   ! no joint, or a gear, which the schema alone describes
      end select
    end do
  end subroutine check_joints

  !> No two keys of a group may name the same body, or both the ground.
  subroutine check_members(group, index, diagnostics)
    type(group_t), intent(in) :: group
    integer, intent(in) :: index
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: earlier, i, key

    do key = 2, size(group%values)
      if (key_rules(first_key(group%rule) + key - 1)%kind /= body_or_ground) cycle
      if (.not. allocated(group%values(key)%texts)) cycle
      do i = 1, size(group%values(key)%texts)
        associate (name => group%values(key)%texts(i)%text)
          earlier = key_with(group, key - 1, name)
          if (earlier == 0) cycle
          call diagnostics%add(max(group%values(key)%line, group%values(earlier)%line), index, &
                            key_name(group, key) // ' is ' // quoted(name) // ', as is ' // key_name(group, earlier) // &
                            '; allowed: different members', &
                            max(group%values(key)%override, group%values(earlier)%override))
        end associate
      end do
    end do
  end subroutine check_members

  !> The first of the keys up to `last` that names a member so, 0 if none does.
  pure integer function key_with(group, last, name) result(key)
    type(group_t), intent(in) :: group
    integer, intent(in) :: last
    character(len=*), intent(in) :: name
    integer :: i

    do key = 1, last
      if (key_rules(first_key(group%rule) + key - 1)%kind /= body_or_ground) cycle
      if (.not. allocated(group%values(key)%texts)) cycle
      do i = 1, size(group%values(key)%texts)
        if (group%values(key)%texts(i)%text == name) return
      end do
    end do
    key = 0
  end function key_with

  pure function key_name(group, key) result(name)
    type(group_t), intent(in) :: group
    integer, intent(in) :: key
    character(len=:), allocatable :: name

    name = trim(key_rules(first_key(group%rule) + key - 1)%name)
  end function key_name

  subroutine check_teeth(group, index, diagnostics)
    type(group_t), intent(in) :: group
    integer, intent(in) :: index
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message

    message = teeth_message(group)
    if (message == '') return
    associate (value => group%values(group%key_position('teeth')))
      call diagnostics%add(value%line, index, message, value%override)
    end associate
  end subroutine check_teeth

  subroutine check_coefficients(group, index, diagnostics)
    type(group_t), intent(in) :: group
    integer, intent(in) :: index
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (bodies => group%values(group%key_position('bodies')), numbers => group%values(group%key_position('coefficients')))
      if (.not. (allocated(bodies%texts) .and. allocated(numbers%numbers))) return
      if (size(bodies%texts) == size(numbers%numbers)) return
      call diagnostics%add(max(bodies%line, numbers%line), index, &
                           'bodies and coefficients have ' // to_text(size(bodies%texts)) // &
                        ' and ' // to_text(size(numbers%numbers)) // ' values; allowed: as many of each', &
                        max(bodies%override, numbers%override))
    end associate
  end subroutine check_coefficients

end module nocdyn_joint_checks
