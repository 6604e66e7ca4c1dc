!> The banks of the clutches and freewheels of an input.
module nocdyn_joint_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t, role_bearing, role_clutch, role_freewheel
  use nocdyn_curves, only: curve_t, new_steps
  use nocdyn_element_groups, only: check_from_standstill, element_groups_t, group_curve
  use nocdyn_friction_joints, only: joint_ranges_t, new_friction_joints
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: clutch_form, add_clutch_form, add_freewheels, add_bearings, check_clutch, engagement_at, find_rest_range

  integer, parameter :: engaged = 1, with_engagement = 2
  integer, parameter :: forms_of_friction = 2   ! as many follow of dog clutches, and then of friction by a table

contains

  !> Refuses clutches that hold less than they slip, and tables that do not begin with the slip.
  subroutine check_clutch(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index
    type(diagnostics_t), intent(inout) :: diagnostics

    call check_from_standstill(input, index, 'table_slip', 'slips', diagnostics)
    associate (group => input%groups(index))
      if (.not. group%has_value('static_capacity')) return
      if (group%number('static_capacity') < sliding_capacity(group)) then
        call input%report(index, 'static_capacity', 'static_capacity = ' // to_text(group%number('static_capacity')) // &
                   ' is below capacity = ' // to_text(sliding_capacity(group)) // '; allowed: at least that of slip [N m]', &
                   diagnostics)
      end if
    end associate
  end subroutine check_clutch

  !> Form of the law of a group &clutch.
  pure integer function clutch_form(group)
    type(group_t), intent(in) :: group

    clutch_form = merge(with_engagement, engaged, group%has_value('times') .or. group%has_value('table_time'))
    if (group%text('kind') == 'dog') clutch_form = clutch_form + forms_of_friction
    if (group%has_value('table_slip')) clutch_form = clutch_form + 2 * forms_of_friction
  end function clutch_form

  !> Adds the bank of the clutches of one form; those with a table over the slip have a bank each.
  subroutine add_clutch_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer :: e, i

    if (form <= 2 * forms_of_friction) then
      if (size(groups%indices) > 0) call add_clutches(groups, form, banks)
      return
    end if
    do i = 1, size(groups%indices)
      call add_clutches(groups%some([(e == i, e=1, size(groups%indices))]), form, banks)
    end do
  end subroutine add_clutch_form

  !> Adds a bank of clutches.
  subroutine add_clutches(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(joint_ranges_t) :: ranges
    type(curve_t), allocatable :: engagement(:, :), over_slip   ! not allocated: absent
    integer :: i, lane

    if (form > 2 * forms_of_friction) then
      allocate (over_slip, source=group_curve(groups%input%groups(groups%indices(1)), 'table_slip', 'table_capacity', 'constant'))
    end if
    ! the ranges of the moments of clutches of one form
    ranges = rest_ranges(groups)
    allocate (ranges%sliding_most, source=0.0_wp * ranges%most)
    if (form <= forms_of_friction .or. form > 2 * forms_of_friction) then
      do i = 1, size(groups%indices)
        ranges%sliding_most(:, i) = sliding_capacity(groups%input%groups(groups%indices(i)))
      end do
    end if
    ranges%sliding_least = -ranges%sliding_most
    if (modulo(form - engaged, forms_of_friction) + engaged == with_engagement) then
      allocate (engagement(groups%lanes, size(groups%indices)))
      do i = 1, size(groups%indices)
        do lane = 1, groups%lanes
          engagement(lane, i) = engagement_of(groups%input%groups(groups%indices(i)))
        end do
      end do
    end if
    call append_bank(banks, new_friction_joints(role_clutch, groups%names, groups%bodies('bodies', 1), &
                                                groups%bodies('bodies', 2), ranges, engagement, over_slip))
  end subroutine add_clutches

  !> The ranges at rest of joints of one kind; the ones of slip are not allocated.
  type(joint_ranges_t) function rest_ranges(groups) result(ranges)
    type(element_groups_t), intent(in) :: groups
    real(wp) :: least, most
    integer :: i

    allocate (ranges%least(groups%lanes, size(groups%indices)), ranges%most(groups%lanes, size(groups%indices)))
    do i = 1, size(groups%indices)
      call find_rest_range(groups%input%groups(groups%indices(i)), least, most)
      ranges%least(:, i) = least
      ranges%most(:, i) = most
    end do
  end function rest_ranges

  !> The torques on its second body that a fully engaged clutch or a freewheel holds [N m]. Forward, a freewheel pushes this body
  !> and never pulls it back.
  pure subroutine find_rest_range(group, least, most)
    type(group_t), intent(in) :: group
    real(wp), intent(out) :: least, most   !! huge without a bound

    most = huge(most)
    if (group%kind == 'freewheel') then
      most = group%number('capacity', absent=most)
    else if (group%text('kind') /= 'dog') then
      most = group%number('static_capacity', absent=sliding_capacity(group))
    end if
    least = -most
    if (group%kind /= 'freewheel') return
    if (group%text('direction') == 'forward') then
      least = 0.0_wp
    else
      most = 0.0_wp
    end if
  end subroutine find_rest_range

  !> The friction of a clutch that begins to slip [N m].
  pure real(wp) function sliding_capacity(group)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: table(:)

    if (group%has_value('capacity')) then
      sliding_capacity = group%number('capacity')
    else
      allocate (table, source=group%numbers('table_capacity'))
      sliding_capacity = table(1)
    end if
  end function sliding_capacity

  !> The engagement of a clutch over the time.
  type(curve_t) function engagement_of(group) result(curve)
    type(group_t), intent(in) :: group

    if (group%has_value('times')) then
      curve = new_steps(group%numbers('times'), group%numbers('levels'))
    else
      curve = group_curve(group, 'table_time', 'table_level', 'constant')
    end if
  end function engagement_of

  !> The engagement of a clutch at a time, from 0 to 1.
  real(wp) function engagement_at(group, t) result(level)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: t   !! [s]
    real(wp), allocatable :: times(:)
    type(curve_t) :: curve
    real(wp) :: at, values(0:3)

    level = 1.0_wp
    allocate (times, source=[group%numbers('times'), group%numbers('table_time')])
    if (size(times) == 0) return
    curve = engagement_of(group)
    at = min(t, times(size(times)))   ! later it does not change; the square of a late time may be too large
    values = curve%derivatives(curve%segment(at), at)
    level = values(0)
  end function engagement_at

  !> Adds the bank of the freewheels.
  subroutine add_freewheels(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(joint_ranges_t) :: ranges

    if (size(groups%indices) == 0) return
    ranges = rest_ranges(groups)
    ranges%sliding_most = merge(0.0_wp, ranges%most, ranges%most >= huge(1.0_wp))
    ranges%sliding_least = merge(0.0_wp, ranges%least, ranges%least <= -huge(1.0_wp))
    call append_bank(banks, new_friction_joints(role_freewheel, groups%names, groups%bodies('bodies', 1), &
                                                groups%bodies('bodies', 2), ranges))
  end subroutine add_freewheels

  !> Adds the bank of the bearings with friction.
  subroutine add_bearings(bodies, banks)
    type(element_groups_t), intent(in) :: bodies
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(element_groups_t) :: groups
    type(joint_ranges_t) :: ranges
    integer, allocatable :: body(:)
    integer :: i
    logical :: has_friction(size(bodies%indices))

    has_friction = [(bodies%input%groups(bodies%indices(i))%number('bearing_friction') > 0, i=1, size(bodies%indices))]
    if (.not. any(has_friction)) return
    groups = bodies%some(has_friction)
    body = pack([(i, i=1, size(bodies%indices))], has_friction)
    ranges%most = groups%values('bearing_friction')
    ranges%least = -ranges%most
    ranges%sliding_most = ranges%most
    ranges%sliding_least = ranges%least
    call append_bank(banks, new_friction_joints(role_bearing, groups%names, 0 * body, body, ranges))
  end subroutine add_bearings

end module nocdyn_joint_assembly
