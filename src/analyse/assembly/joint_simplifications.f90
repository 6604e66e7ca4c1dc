!> What analyses about a steady state make of joints: those that they refuse, those for which means over a turn stand, and those
!> that are locked.
module nocdyn_joint_simplifications
  use nocdyn_constraint_assembly, only: is_open_joint
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_loss_assembly, only: has_losses
  use nocdyn_motion_assembly, only: has_steady_speed, steady_speed
  use nocdyn_steady_views, only: steady_view_t
  use nocdyn_text, only: append, quoted, string_t
  implicit none (type, external)
  private

  public :: refuse_joints, list_simplifications, has_joint_that_locks, has_joint_that_moves

contains

  !> Refuses joints where it is not known which of them are locked, or where they are.
  subroutine refuse_joints(input, is_steady, what, error, knows_locks, sets_speed)
    type(input_t), intent(in) :: input
    logical, intent(in) :: is_steady       !! whether joints that means stand for, and locks of a steady state, are allowed
    character(len=*), intent(in) :: what   !! does not know it, e.g. 'nocdyn modes'
    type(error_t), allocatable, intent(out) :: error
    logical, intent(in), optional :: knows_locks   !! whether it knows which joints are locked; absent: as `is_steady`
    logical, intent(in), optional :: sets_speed    !! whether it sets the speed in place of a drive; absent: no
    character(len=:), allocatable :: reason
    integer :: i
    logical :: allows_locks, is_set

    allows_locks = is_steady
    if (present(knows_locks)) allows_locks = knows_locks
    is_set = .false.
    if (present(sets_speed)) is_set = sets_speed
    do i = 1, size(input%groups)
      call find_refusal(input%groups(i), is_steady, allows_locks, is_set, reason)
      if (reason == '') cycle
      call raise(error, exit_input, input%location(i) // ': ' // what // ' ' // reason)
      return
    end do
  end subroutine refuse_joints

  !> Why a group is refused, and what is allowed; '' if it is not.
  subroutine find_refusal(group, is_steady, allows_locks, sets_speed, text)
    type(group_t), intent(in) :: group
    logical, intent(in) :: is_steady, allows_locks, sets_speed   !! as in `refuse_joints`, the second as `knows_locks`
    character(len=:), allocatable, intent(out) :: text

    text = ''
    select case (group%kind)
    case ('body')
      if (allows_locks) return
      if (group%number('bearing_friction') > 0) text = 'does not know whether bearings slip; allowed: bearing_friction = 0'
    case ('clutch', 'freewheel')
      if (.not. allows_locks) text = 'does not know which joints are locked; allowed: no clutches and freewheels'
    case ('drive')
      if (is_steady .and. has_steady_speed(group, sets_speed)) return
      if (allows_locks .and. has_steady_speed(group, .false.) .and. .not. group%has_value('table_time')) return
      text = 'is for machines whose ratios are constant; allowed: no cardans, cranks, relations, drives'
      if (.not. allows_locks) return
      text = 'is about a steady state, and the speed of this drive changes; allowed: a constant speed'
      if (.not. has_steady_speed(group, .true.) .or. sets_speed) return
      text = text // '; nocdyn response and nocdyn campbell set speeds in its place'
    case ('cardan', 'crank', 'relation')
      if (is_steady .and. has_mean(group)) return
      text = 'is for machines whose ratios are constant; allowed: no cardans, cranks, relations, drives'
      if (is_steady) text = 'is for machines whose ratios are constant; allowed: no cams and no levers'
    case default
      text = ''
    end select
  end subroutine find_refusal

  !> What an analysis about a steady state replaces, and which joints are locked there for good.
  subroutine list_simplifications(input, view, notes)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(string_t), allocatable, intent(out) :: notes(:)
    character(len=:), allocatable :: driven, locked, means, open
    integer :: i

    allocate (notes(0))
    if (.not. view%is_steady) return
    means = ''
    locked = ''
    open = ''
    driven = ''
    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        if (group%kind == 'clutch' .or. group%kind == 'freewheel') then
          if (.not. view%locks_joints) cycle
          if (is_open_joint(input, view, i)) then
            call add_to(open, group)
          else
            call add_to(locked, group)
          end if
        else if (has_steady_speed(group, view%sets_speed)) then
          if (abs(steady_speed(group)) > 0) call add_to(driven, group)
          if (.not. abs(steady_speed(group)) > 0) call add_to(locked, group)
        else if (has_mean(group)) then
          call add_to(means, group)
        end if
      end associate
    end do
    if (locked /= '') call append(notes, 'locked in this state: ' // locked)
    if (open /= '') call append(notes, 'open in this state: ' // open)
    if (driven /= '') call append(notes, 'turned at a given speed, without oscillations there: ' // driven)
    if (means /= '') call append(notes, 'means over a turn stand for the ratios, inertias and torques of ' // means)
  end subroutine list_simplifications

  !> Adds "clutch 'dry'" to a list.
  subroutine add_to(list, group)
    character(len=:), allocatable, intent(inout) :: list
    type(group_t), intent(in) :: group

    if (list /= '') list = list // ', '
    list = list // group%kind // ' ' // quoted(group%name)
  end subroutine add_to

  !> Whether there are joints, bearings or teeth that may lock.
  pure logical function has_joint_that_locks(input)
    type(input_t), intent(in) :: input
    integer :: i

    has_joint_that_locks = .false.
    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        select case (group%kind)
        case ('clutch', 'freewheel')
          has_joint_that_locks = .true.
        case ('body')
          has_joint_that_locks = group%number('bearing_friction') > 0
        case default
          has_joint_that_locks = has_losses(group)
        end select
        if (has_joint_that_locks) return
      end associate
    end do
  end function has_joint_that_locks

  !> Whether there are joints whose ratio depends on the position, or drives.
  pure logical function has_joint_that_moves(input)
    type(input_t), intent(in) :: input
    integer :: i

    has_joint_that_moves = .false.
    do i = 1, size(input%groups)
      has_joint_that_moves = has_joint_that_moves .or. any(input%groups(i)%kind == [character(len=8) :: 'cardan', 'crank', &
                                                                                    'relation', 'drive'])
    end do
  end function has_joint_that_moves

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

end module nocdyn_joint_simplifications
