!> The banks of the clutches and freewheels of an input.
module nocdyn_joint_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t, role_clutch, role_freewheel
  use nocdyn_curves, only: curve_t, new_steps
  use nocdyn_element_groups, only: element_groups_t, group_curve
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_friction_joints, only: joint_ranges_t, new_friction_joints
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: quoted, to_text
  implicit none (type, external)
  private

  public :: clutch_form, add_clutch_form, add_freewheels, check_joints, refuse_joints, joints_with_means

  integer, parameter :: engaged = 1, with_engagement = 2
  integer, parameter :: forms_of_friction = 2   ! as many follow of dog clutches

contains

  !> Refuses clutches that hold less than they slip.
  subroutine check_joints(input, error)
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: clutches(:)
    integer :: i

    allocate (clutches, source=input%groups_named('clutch', 'friction'))
    do i = 1, size(clutches)
      associate (group => input%groups(clutches(i)))
        if (.not. group%has_value('static_capacity')) cycle
        if (group%number('static_capacity') >= group%number('capacity')) cycle
        call raise(error, exit_input, input%location(clutches(i), 'static_capacity') // ': static_capacity = ' // &
                   to_text(group%number('static_capacity')) // ' is below capacity = ' // to_text(group%number('capacity')) // &
                   '; allowed: at least that of slip [N m]')
        return
      end associate
    end do
  end subroutine check_joints

  !> Refuses joints where it is not known which of them are locked, or where they are.
  subroutine refuse_joints(input, what, error)
    type(input_t), intent(in) :: input     !! joints that means stand for are allowed
    character(len=*), intent(in) :: what   !! does not know it, e.g. 'nocdyn modes'
    type(error_t), allocatable, intent(out) :: error
    character(len=*), parameter :: moving(*) = [character(len=8) :: 'cardan', 'crank', 'relation', 'drive']
    integer :: i

    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        if (group%kind == 'clutch' .or. group%kind == 'freewheel') then
          call raise(error, exit_input, input%location(i) // ': ' // what // ' does not know which joints are locked; ' // &
                     'allowed: no clutches and freewheels; a locked one is a &gear with teeth = 1, 1 and internal = .true.')
          return
        else if (any(moving == group%kind) .and. .not. (input%takes_means .and. has_mean(group))) then
          call raise(error, exit_input, input%location(i) // ': ' // what // ' is for machines whose ratios are constant; ' // &
                     'allowed: no ' // trim(merge('drives, cams and levers            ', 'cardans, cranks, relations, drives ', &
                                                  input%takes_means)))
          return
        end if
      end associate
    end do
  end subroutine refuse_joints

  !> The joints of an input that means stand for, e.g. "cardan 'front', crank 'piston'"; '' if there are none.
  function joints_with_means(input) result(text)
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, merge(size(input%groups), 0, input%takes_means)
      if (.not. has_mean(input%groups(i))) cycle
      if (text /= '') text = text // ', '
      text = text // input%groups(i)%kind // ' ' // quoted(input%groups(i)%name)
    end do
  end function joints_with_means

  !> Whether the ratio of a joint has a mean that tells how its bodies turn.
  pure logical function has_mean(group)
    type(group_t), intent(in) :: group

    select case (group%kind)
    case ('relation')
      has_mean = group%text('kind') == 'gear'
    case default
      has_mean = group%kind == 'cardan' .or. group%kind == 'crank'
    end select
  end function has_mean

  !> Form of the law of a group &clutch.
  pure integer function clutch_form(group)
    type(group_t), intent(in) :: group

    clutch_form = merge(with_engagement, engaged, group%has_value('times') .or. group%has_value('table_time'))
    if (group%text('kind') == 'dog') clutch_form = clutch_form + forms_of_friction
  end function clutch_form

  !> Adds the bank of the clutches of one form.
  subroutine add_clutch_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(joint_ranges_t) :: ranges
    type(curve_t), allocatable :: engagement(:, :)
    integer :: i, lane

    if (size(groups%indices) == 0) return
    if (form > forms_of_friction) then
      ranges%most = spread(spread(huge(1.0_wp), 1, groups%lanes), 2, size(groups%indices))
      ranges%sliding_most = 0.0_wp * ranges%most
    else
      ranges%sliding_most = groups%values('capacity')
      ranges%most = groups%values('static_capacity', absent=-1.0_wp)
      where (ranges%most < 0) ranges%most = ranges%sliding_most
    end if
    ranges%sliding_least = -ranges%sliding_most
    ranges%least = -ranges%most
    associate (from => groups%bodies('bodies', 1), to => groups%bodies('bodies', 2))
      if (form == engaged .or. form == engaged + forms_of_friction) then
        call append_bank(banks, new_friction_joints(role_clutch, groups%names, from, to, ranges))
        return
      end if
      allocate (engagement(groups%lanes, size(groups%indices)))
      do i = 1, size(groups%indices)
        do lane = 1, groups%lanes
          engagement(lane, i) = engagement_of(groups%input%groups(groups%indices(i)))
        end do
      end do
      call append_bank(banks, new_friction_joints(role_clutch, groups%names, from, to, ranges, engagement))
    end associate
  end subroutine add_clutch_form

  !> The engagement of a clutch over the time.
  type(curve_t) function engagement_of(group) result(curve)
    type(group_t), intent(in) :: group

    if (group%has_value('times')) then
      curve = new_steps(group%numbers('times'), group%numbers('levels'))
    else
      curve = group_curve(group, 'table_time', 'table_level', 'constant')
    end if
  end function engagement_of

  !> Adds the bank of the freewheels: forward, the driven body is pushed, never pulled back.
  subroutine add_freewheels(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(joint_ranges_t) :: ranges
    integer :: i

    if (size(groups%indices) == 0) return
    ranges%most = groups%values('capacity', absent=huge(1.0_wp))
    ranges%least = 0.0_wp * groups%values('capacity')
    ranges%sliding_most = merge(0.0_wp, ranges%most, ranges%most >= huge(1.0_wp))
    ranges%sliding_least = ranges%least
    do i = 1, size(groups%indices)
      if (groups%input%groups(groups%indices(i))%text('direction') == 'forward') cycle
      ranges%least(:, i) = -ranges%most(:, i)
      ranges%sliding_least(:, i) = -ranges%sliding_most(:, i)
      ranges%most(:, i) = 0.0_wp
      ranges%sliding_most(:, i) = 0.0_wp
    end do
    call append_bank(banks, new_friction_joints(role_freewheel, groups%names, groups%bodies('bodies', 1), &
                                                groups%bodies('bodies', 2), ranges))
  end subroutine add_freewheels

end module nocdyn_joint_assembly
