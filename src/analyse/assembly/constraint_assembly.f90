!> From the rigid joints of an input (gears, planetary sets, differentials, constraints) to constraint rows.
module nocdyn_constraint_assembly
  use nocdyn_constraints, only: constraints_t, member_torques_t, new_constraints
  use nocdyn_element_groups, only: bodies_of, body_index_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_joint_assembly, only: engagement_at, find_rest_range
  use nocdyn_kinds, only: wp
  use nocdyn_motion_assembly, only: has_steady_speed, steady_speed
  use nocdyn_steady_views, only: steady_view_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: assemble_constraints, constraint_groups, is_open_joint

  !> One constraint row, with the ground still in it.
  type :: joint_t
    integer, allocatable :: bodies(:)             !! 0 is the ground
    real(wp), allocatable :: coefficients(:)      !! of their speeds
    character(len=3) :: unit = 'N m'              !! of the multiplier
    character(len=7), allocatable :: members(:)   !! name of each body's torque column in the results, '' if it has none
  end type joint_t

contains

  !> Indices of the groups that are constraint rows, in the order of the file.
  function constraint_groups(input, view) result(indices)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    integer, allocatable :: indices(:)
    integer :: i

    indices = pack([(i, i=1, size(input%groups))], [(is_row(input, view, i), i=1, size(input%groups))])
  end function constraint_groups

  !> Whether a group is a constraint row. In a steady state joints are, but those that are open.
  logical function is_row(input, view, index)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    integer, intent(in) :: index   !! of the group

    associate (group => input%groups(index))
      select case (group%kind)
      case ('gear', 'planetary', 'differential', 'constraint')
        is_row = .true.
      case ('cardan', 'relation')
        is_row = view%is_steady
      case ('clutch', 'freewheel')
        is_row = view%is_steady .and. view%locks_joints
        if (is_row) is_row = .not. is_open_joint(input, view, index)
      case ('drive')
        is_row = view%is_steady .and. has_steady_speed(group, view%sets_speed)
      case default
        is_row = .false.
      end select
    end associate
  end function is_row

  !> Whether a clutch or a freewheel is open in the steady state.
  logical function is_open_joint(input, view, index)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    integer, intent(in) :: index   !! of the group

    is_open_joint = .false.
    if (allocated(view%overruns)) is_open_joint = view%overruns(index)
    if (input%groups(index)%kind == 'clutch') is_open_joint = .not. engagement_at(input%groups(index), view%at) > 0
  end function is_open_joint

  !> All rows in the order of the file. Two columns of the results with the same name are an error.
  subroutine assemble_constraints(input, view, body_index, lanes, constraints, error)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(body_index_t), intent(in) :: body_index
    integer, intent(in) :: lanes
    type(constraints_t), intent(out) :: constraints
    type(error_t), allocatable, intent(out) :: error
    type(joint_t), allocatable :: joints(:)
    integer, allocatable :: indices(:)
    integer :: i

    allocate (indices, source=constraint_groups(input, view))
    allocate (joints(size(indices)))
    do i = 1, size(indices)
      call read_joint(input%groups(indices(i)), body_index, joints(i))
    end do
    call form_rows(input, view, indices, joints, size(body_index%names), lanes, constraints)
  end subroutine assemble_constraints

  !> The row of one group.
  subroutine read_joint(group, body_index, joint)
    type(group_t), intent(in) :: group
    type(body_index_t), intent(in) :: body_index
    type(joint_t), intent(out) :: joint

    select case (group%kind)
    case ('gear')
      ! Eq. (8): R1 omega_1 + R2 omega_2 = 0, a minus for an internal gear.
      !
      ! With radii the multiplier is the tooth force [N]. With teeth the row is scaled so that the multiplier is the torque on the
      ! first body [N m].
      joint%bodies = bodies_of(group, 'bodies', body_index)
      if (group%has_value('radii')) then
        joint%coefficients = group%numbers('radii')
        joint%unit = 'N'
      else
        joint%coefficients = real(group%whole_numbers('teeth'), wp)
        joint%coefficients = joint%coefficients / joint%coefficients(1)
      end if
      if (group%flag('internal')) joint%coefficients(2) = -joint%coefficients(2)
      joint%members = [character(len=7) :: '', '']
    case ('planetary')
      ! willis' equation z_s omega_s + z_r omega_r - (z_s + z_r) omega_c = 0, scaled so that the multiplier is the torque on the
      ! sun
      joint%bodies = [bodies_of(group, 'sun', body_index), bodies_of(group, 'ring', body_index), &
                      bodies_of(group, 'carrier', body_index)]
      associate (teeth => real(group%whole_numbers('teeth'), wp))
        joint%coefficients = [1.0_wp, teeth(2) / teeth(1), -(teeth(1) + teeth(2)) / teeth(1)]
      end associate
      joint%members = [character(len=7) :: '', 'ring', 'carrier']
    case ('differential')
      joint%bodies = [bodies_of(group, 'sides', body_index), bodies_of(group, 'case', body_index)]
      joint%coefficients = [1.0_wp, 1.0_wp, -2.0_wp]
      joint%members = [character(len=7) :: '', '', 'case']
    case ('cardan', 'relation', 'clutch', 'freewheel')
      joint%bodies = bodies_of(group, 'bodies', body_index)
      joint%coefficients = [-mean_ratio(group), 1.0_wp]
      joint%members = [character(len=7) :: '', '']
    case ('drive')
      joint%bodies = bodies_of(group, 'body', body_index)
      joint%coefficients = [1.0_wp]
      joint%members = [character(len=7) :: '']
    case ('constraint')
      joint%bodies = bodies_of(group, 'bodies', body_index)
      joint%coefficients = group%numbers('coefficients')
      allocate (joint%members(size(joint%bodies)))
      joint%members(:) = ''
    case default
      error stop 'nocdyn_constraint_assembly: this group is no constraint'
    end select
  end subroutine read_joint

  !> The mean over a turn of the ratio of a joint.
  pure real(wp) function mean_ratio(group)
    type(group_t), intent(in) :: group

    mean_ratio = 1.0_wp
    if (group%kind /= 'relation') return
    associate (x => group%numbers('table_angle'), y => group%numbers('table_driven'))
      mean_ratio = (y(size(y)) - y(1)) / (x(size(x)) - x(1))
    end associate
  end function mean_ratio

  !> Drops the ground, which has no speed, from the rows. Its torque may still have a column.
  subroutine form_rows(input, view, indices, joints, bodies, lanes, constraints)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    integer, intent(in) :: indices(:)   !! groups of the rows
    type(joint_t), intent(in) :: joints(:)
    integer, intent(in) :: bodies, lanes
    type(constraints_t), intent(out) :: constraints
    type(string_t), allocatable :: kinds(:), names(:), units(:)
    integer, allocatable :: body(:), first(:)
    real(wp), allocatable :: coefficient(:, :)
    integer :: i, k, m, next
    type(member_torques_t) :: members

    associate (entries => sum([(count(joints(i)%bodies > 0), i=1, size(joints))]))
      allocate (body(entries), coefficient(lanes, entries), first(size(joints) + 1))
    end associate
    allocate (kinds(size(joints)), names(size(joints)), units(size(joints)))
    next = 1
    do i = 1, size(joints)
      kinds(i)%text = input%groups(indices(i))%kind
      names(i)%text = input%groups(indices(i))%name
      units(i)%text = trim(joints(i)%unit)
      first(i) = next
      do k = 1, size(joints(i)%bodies)
        if (joints(i)%bodies(k) == 0) cycle
        body(next) = joints(i)%bodies(k)
        coefficient(:, next) = joints(i)%coefficients(k)
        next = next + 1
      end do
    end do
    first(size(first)) = next
    ! the torques of members that have columns of their own
    associate (columns => sum([(count(joints(i)%members /= ''), i=1, size(joints))]))
      allocate (members%names(columns), members%row(columns), members%factor(lanes, columns))
    end associate
    m = 0
    do i = 1, size(joints)
      do k = 1, size(joints(i)%members)
        if (joints(i)%members(k) == '') cycle
        m = m + 1
        members%names(m)%text = trim(joints(i)%members(k))
        members%row(m) = i
        members%factor(:, m) = joints(i)%coefficients(k)
      end do
    end do
    constraints = new_constraints(bodies, names, units, first, body, coefficient, kinds, members)
    do i = 1, size(indices)
      call limit_of_lock(input%groups(indices(i)), view%at, constraints%least(i), constraints%most(i))
      if (input%groups(indices(i))%kind == 'drive') constraints%demand(i) = steady_speed(input%groups(indices(i)))
    end do
    constraints%may_stop = [(any(kinds(i)%text == [character(len=9) :: 'clutch', 'freewheel', 'drive']), i=1, size(kinds))]
  end subroutine form_rows

  !> The torques on its second body that a locked joint holds [N m].
  subroutine limit_of_lock(group, t, least, most)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: t   !! [s]
    real(wp), intent(inout) :: least, most   !! unchanged for other rows, which have no limits

    if (all(group%kind /= [character(len=9) :: 'clutch', 'freewheel'])) return
    call find_rest_range(group, least, most)
    if (group%kind /= 'clutch' .or. most >= huge(most)) return
    most = engagement_at(group, t) * most
    least = -most
  end subroutine limit_of_lock

end module nocdyn_constraint_assembly
