!> The banks of the joints of an input whose ratio depends on the position, and of its prescribed motions.
module nocdyn_motion_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_cardan_rows, only: new_cardan_rows
  use nocdyn_curves, only: curve_t, extrapolation_constant, extrapolation_linear, interpolation_cubic, interpolation_dwells, &
    interpolation_linear, interpolation_spline, new_curve
  use nocdyn_drives, only: new_drives
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_phases, only: new_phases
  use nocdyn_relation_rows, only: new_relation_rows
  use nocdyn_splines, only: new_spline, spline_dwells, spline_monotone, spline_smooth, spline_t
  use nocdyn_text, only: to_text
  use nocdyn_written_values, only: written_element, written_key, written_number
  implicit none (type, external)
  private

  public :: check_drive, check_relation, add_cardans, add_relations, drive_form, add_drive_form, &
    has_steady_speed, steady_speed, spline_shape, drive_interpolation

  integer, parameter :: by_formula = 1, by_table = 2
  integer, parameter :: forms_of_speed = 2   ! as many follow of angles

contains

  !> Refuses tables that are no motion over a turn.
  subroutine check_relation(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: text

    call find_table_mistake(input%groups(index), text)
    if (text /= '') call input%report(index, 'table_driven', text, diagnostics)
  end subroutine check_relation

  !> Refuses drives whose motion jumps.
  subroutine check_drive(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: text
    logical :: is

    associate (group => input%groups(index))
      is = group%text('kind') == 'angle' .and. group%has_value('interpolation')
      if (is) is = group%text('interpolation') == 'linear'
      if (is) then
        call input%report(index, 'interpolation', "interpolation = 'linear' with kind = " // &
                   "'angle': the speed would jump at the points, which needs an infinite torque; " // &
                   'allowed: spline, dwells, cubic', diagnostics)
        return
      end if
      call find_jump(group, text)
      if (text /= '') call input%report(index, 'table_time', 'table_time' // text, diagnostics)
    end associate
  end subroutine check_drive

  !> What is wrong with the times of a drive, '' if nothing is.
  pure subroutine find_jump(group, text)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: text
    real(wp), allocatable :: times(:)
    integer :: i

    text = ''
    allocate (times, source=group%numbers('table_time'))
    do i = 2, size(times)
      if (times(i) > times(i - 1)) cycle
      text = '(' // to_text(i) // ') = ' // to_text(times(i)) // ' must be greater than table_time(' // to_text(i - 1) // ') = ' &
             // to_text(times(i - 1)) // ' s'
      if (times(i) >= times(i - 1)) text = text // ': a jump needs an infinite torque; allowed: a ramp'
      return
    end do
  end subroutine find_jump

  !> What is wrong with the table of a relation, '' if nothing is.
  subroutine find_table_mistake(group, text)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: text
    integer, parameter :: looks = 20   ! at the slope of each segment
    real(wp), allocatable :: x(:), y(:)
    real(wp) :: slope(0:3), way
    type(spline_t) :: spline
    integer :: i

    text = ''
    allocate (x, source=group%numbers('table_angle'))
    allocate (y, source=group%numbers('table_driven'))
    way = y(size(y)) - y(1)
    select case (group%text('kind'))
    case ('cam')
      if (abs(way) > 1.0e-12_wp * maxval(abs(y))) text = written_element(group, 'table_driven', size(y)) // &
        ': a cam returns: the last value must be the first, ' // written_number(group, 'table_driven', y(1)) // &
        "; kind = 'gear' advances from turn to turn, kind = 'lever' does not repeat"
    case ('gear')
      spline = new_spline(x, y, .true., spline_shape(group%text('interpolation')))
      do i = 0, looks * (size(x) - 1) - 1
        slope = spline%derivatives(x(1 + i / looks) + modulo(i, looks) * (x(2 + i / looks) - x(1 + i / looks)) / looks)
        if (slope(1) * way > 0) cycle
        text = written_key(group, 'table_driven') // ': non-circular gears turn in one direction, but the spline through ' // &
               'the points turns back near ' // written_element(group, 'table_angle', 1 + i / looks) // &
               "; kind = 'cam' may go to and fro"
        return
      end do
    case default   ! a lever may be anything
    end select
  end subroutine find_table_mistake

  !> Whether a group is a drive whose body has a constant speed, or comes to rest in the end. Where an analysis sets the speed
  !> instead, it may change.
  pure logical function has_steady_speed(group, is_replaced)
    type(group_t), intent(in) :: group
    logical, intent(in) :: is_replaced   !! whether an analysis may set another speed
    real(wp), allocatable :: speeds(:)

    has_steady_speed = .false.
    if (group%kind /= 'drive') return
    if (group%has_value('speed_amplitude') .or. group%has_value('angle_amplitude')) return
    has_steady_speed = is_replaced .and. group%text('kind') == 'speed' .or. .not. group%has_value('table_time')
    if (has_steady_speed .or. group%text('kind') == 'angle') return
    allocate (speeds, source=group%numbers('table_speed'))
    has_steady_speed = all(abs(speeds - speeds(1)) <= 0) .or. .not. abs(steady_speed(group)) > 0
  end function has_steady_speed

  !> The speed of the body of a drive in the end [rad/s].
  pure real(wp) function steady_speed(group)
    type(group_t), intent(in) :: group   !! with `has_steady_speed`
    real(wp), allocatable :: speeds(:)

    steady_speed = 0.0_wp
    if (group%text('kind') == 'angle') return
    allocate (speeds, source=[0.0_wp, group%numbers('table_speed')])
    steady_speed = group%number('speed') + speeds(size(speeds))
  end function steady_speed

  !> Adds the bank of the relations and the one of their drivers.
  subroutine add_relations(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer :: i, shape(size(groups%indices))
    logical :: repeats(size(groups%indices))

    if (size(groups%indices) == 0) return
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        repeats(i) = group%text('kind') /= 'lever'
        shape(i) = spline_shape(group%text('interpolation'))
      end associate
    end do
    call append_bank(banks, new_relation_rows(groups, repeats, shape))
    call append_bank(banks, new_phases(groups%lanes, groups%names, groups%bodies('bodies', 1)))
  end subroutine add_relations

  !> Adds the bank of the cardan joints and the one of their drivers.
  subroutine add_cardans(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)

    if (size(groups%indices) == 0) return
    call append_bank(banks, new_cardan_rows(groups))
    call append_bank(banks, new_phases(groups%lanes, groups%names, groups%bodies('bodies', 1)))
  end subroutine add_cardans

  !> Form of the motion of a group &drive.
  pure integer function drive_form(group)
    type(group_t), intent(in) :: group

    drive_form = merge(by_table, by_formula, group%has_value('table_time'))
    if (group%text('kind') == 'angle') drive_form = drive_form + forms_of_speed
  end function drive_form

  !> Adds the bank of the drives of one form.
  subroutine add_drive_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    logical :: are_angles
    type(curve_t), allocatable :: tables(:, :)   ! not allocated: absent

    if (size(groups%indices) == 0) return
    are_angles = form > forms_of_speed
    if (modulo(form, forms_of_speed) /= by_formula) tables = drive_tables(groups, are_angles)
    call append_bank(banks, new_drives(groups, are_angles, tables))
  end subroutine add_drive_form

  !> The tables of drives. A table of angles has no kinks, also at its ends.
  function drive_tables(groups, are_angles) result(tables)
    type(element_groups_t), intent(in) :: groups
    logical, intent(in) :: are_angles
    type(curve_t), allocatable :: tables(:, :)
    character(len=:), allocatable :: key
    integer :: beyond, i, lane

    key = 'table_speed'
    beyond = extrapolation_constant
    if (are_angles) then
      key = 'table_angle'
      beyond = extrapolation_linear
    end if
    allocate (tables(groups%lanes, size(groups%indices)))
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        tables(1, i) = new_curve(group%numbers('table_time'), group%numbers(key), drive_interpolation(group), beyond)
      end associate
      do lane = 2, groups%lanes
        tables(lane, i) = tables(1, i)
      end do
    end do
  end function drive_tables

  !> Interpolation of the table of a drive: what it asks for, else lines between speeds, a spline through angles.
  pure integer function drive_interpolation(group) result(interpolation)
    type(group_t), intent(in) :: group

    interpolation = merge(interpolation_spline, interpolation_linear, group%text('kind') == 'angle')
    if (.not. group%has_value('interpolation')) return
    select case (group%text('interpolation'))
    case ('linear')
      interpolation = interpolation_linear
    case ('cubic')
      interpolation = interpolation_cubic
    case ('dwells')
      interpolation = interpolation_dwells
    case default
      interpolation = interpolation_spline
    end select
  end function drive_interpolation

  !> Shape of a spline by the word of its interpolation.
  pure integer function spline_shape(word) result(shape)
    character(len=*), intent(in) :: word

    shape = spline_smooth
    if (word == 'dwells') shape = spline_dwells
    if (word == 'cubic') shape = spline_monotone
  end function spline_shape

end module nocdyn_motion_assembly
