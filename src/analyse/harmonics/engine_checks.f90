!> Mistakes in the values of &engine, and of &excitation with orders, that the schema does not know.
module nocdyn_engine_checks
  use nocdyn_cylinder_torques, only: cycle_of
  use nocdyn_harmonic_tables, only: distinct, find_table_obstacle
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_shared_loads, only: find_shared_load
  use nocdyn_text, only: counted, quoted, to_text
  use nocdyn_written_values, only: unit_of, written_element, written_key, written_number
  implicit none (type, external)
  private

  public :: check_engine, check_order_torques, check_reach, check_stroke, check_crank_angles

  real(wp), parameter :: pi = acos(-1.0_wp)
  real(wp), parameter :: rounding = 1.0e-9_wp   ! relative, of angles and orders
  integer, parameter :: most_cylinders = 100

contains

  !> Refuses engines of which something does not fit: firing angles, orders, pressures, loads, numbers of cylinders.
  subroutine check_engine(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: key, text

    associate (group => input%groups(index))
      call check_cylinders(group, key, text)
      if (text == '') call check_cycle(group, key, text)   ! of a known stroke
      if (text == '' .and. group%has_value('crank_angles')) call check_crank_angles(group, key, text)
      call note()
      if (group%has_value('orders')) call find_table_obstacle(group, key, text)
      call note()
      if (group%has_value('crank_radius')) call check_reach(group, key, text)
      call note()
      call check_loads(group, key, text)
      call note()
      call check_names(input, group, key, text)
      call note()
    end associate

  contains

    !> Takes up what is wrong with a key.
    subroutine note()
      if (text /= '') call input%report(index, key, text, diagnostics)
      text = ''
    end subroutine note

  end subroutine check_engine

  !> Lists and numbers of cylinders, and whether there is a torque.
  subroutine check_cylinders(group, key, text)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing
    integer :: cylinders

    text = ''
    cylinders = size(group%texts('cylinders'))
    key = 'cylinders'
    if (cylinders > most_cylinders) then
      text = to_text(cylinders) // ' cylinders; allowed: at most ' // to_text(most_cylinders)
      return
    end if
    call check_stroke(group, key, text)
    if (text /= '') return
    key = 'misfire'
    if (group%whole_number('misfire') > cylinders) then
      text = 'misfire = ' // to_text(group%whole_number('misfire')) // '; allowed: 0 to ' // to_text(cylinders) // &
             ', the number of a cylinder'
      return
    end if
    key = 'cylinder_scatter'
    associate (values => size(group%numbers('cylinder_scatter')))
      if (all(values /= [0, 1, cylinders])) then
        text = 'cylinder_scatter has ' // counted(values, 'value', 'values') // '; needed: 1 or ' // to_text(cylinders)
        return
      end if
    end associate
    key = 'name'
    if (group%has_value('orders') .or. group%has_value('crank_angles') .or. group%has_value('reciprocating_mass')) return
    if (abs(group%number('mean_torque', absent=0.0_wp)) > 0) return
    text = 'it has no torque; needed: orders, table_file, pressures, pressure_file, torques, torque_file, ' // &
           'reciprocating_mass or mean_torque'
  end subroutine check_cylinders

  !> The rod reaches the piston at all angles of the crank.
  subroutine check_reach(group, key, text)
    type(group_t), intent(in) :: group                        !! &engine or &crank
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing

    text = ''
    key = 'offset'
    if (group%number('crank_radius') >= group%number('rod_length')) return   ! the schema refuses it
    if (group%number('crank_radius') + abs(group%number('offset')) < group%number('rod_length')) return
    text = 'offset = ' // to_text(group%number('offset')) // ' m: the rod of ' // to_text(group%number('rod_length')) // &
           ' m does not reach the piston at all angles; allowed: crank_radius + |offset| below rod_length'
  end subroutine check_reach

  !> The stroke is one of those that there are.
  subroutine check_stroke(group, key, text)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing

    text = ''
    key = 'stroke'
    if (all(group%whole_number('stroke') /= [2, 4])) text = 'stroke = ' // to_text(group%whole_number('stroke')) // &
      '; allowed: 2 or 4'
  end subroutine check_stroke

  !> Firing angles and orders fit the cycle.
  subroutine check_cycle(group, key, text)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing
    real(wp), allocatable :: firing(:), orders(:)
    integer :: i

    text = ''
    key = 'firing'
    allocate (firing, source=group%numbers('firing'))
    do i = 1, size(firing)
      if (firing(i) <= cycle_of(group) * (1.0_wp + rounding)) cycle
      text = written_element(group, 'firing', i) // ' is out of range; allowed: 0 to ' // &
             written_number(group, 'firing', cycle_of(group)) // ' with stroke = ' // to_text(group%whole_number('stroke'))
      return
    end do
    key = 'orders'
    allocate (orders, source=group%numbers('orders'))
    do i = 1, size(orders)
      associate (cycles => orders(i) * cycle_of(group) / (2.0_wp * pi))
        if (abs(cycles - anint(cycles)) <= rounding * cycles) cycle
      end associate
      text = 'orders(' // to_text(i) // ') = ' // to_text(orders(i)) // ' is no order of its cycle; allowed: multiples of ' // &
             to_text(2.0_wp * pi / cycle_of(group)) // ' with stroke = ' // to_text(group%whole_number('stroke'))
      return
    end do
    key = 'mean_torque'
    if (group%is_given('mean_torque') .and. any(.not. orders > 0)) text = &
      'mean_torque and the order 0 are both given; allowed: one of them'
  end subroutine check_cycle

  !> `load_share` is among the loads.
  subroutine check_loads(group, key, text)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing
    real(wp), allocatable :: loads(:)
    character(len=:), allocatable :: range

    text = ''
    key = 'load_share'
    allocate (loads, source=distinct(group%numbers('loads')))
    if (size(loads) > 0) range = to_text(loads(1)) // ' to ' // to_text(loads(size(loads))) // ', the loads of the rows'
    if (size(loads) == 0) then
      if (group%has_value('load_share')) text = 'load_share needs loads, or a column load in the file'
    else if (.not. group%has_value('load_share')) then
      key = 'loads'
      if (size(loads) > 1) text = 'load_share is missing; needed: the load of the engine, ' // range
    else if (group%number('load_share') < loads(1) .or. group%number('load_share') > loads(size(loads))) then
      text = 'load_share = ' // to_text(group%number('load_share')) // ' is out of range; allowed: ' // range
    end if
  end subroutine check_loads

  !> The crank angles are the ones of one cycle.
  subroutine check_crank_angles(group, key, text)
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing
    real(wp), allocatable :: angle(:)
    real(wp) :: step

    text = ''
    key = 'crank_angles'
    allocate (angle, source=group%numbers('crank_angles'))
    associate (n => size(angle), cycle => cycle_of(group))
      step = maxval(angle(2:) - angle(:n - 1))
      associate (span => angle(n) - angle(1))
        if (span <= cycle * (1.0_wp + rounding) .and. span + step >= cycle * (1.0_wp - rounding)) return
        text = written_key(group, key) // ' from ' // written_number(group, key, angle(1)) // ' to ' // &
               written_number(group, key, angle(n)) // ' are not those of one cycle; needed: a range of ' // &
               written_number(group, key, cycle) // merge(' [rad]', '      ', unit_of(group, key) == 0)
        text = trim(text) // ' with stroke = ' // to_text(group%whole_number('stroke'))
        if (unit_of(group, key) == 0) text = text // '; in degrees they are ' // key // '_deg'
      end associate
    end associate
  end subroutine check_crank_angles

  !> No torque has the name of a cylinder.
  subroutine check_names(input, group, key, text)
    type(input_t), intent(in) :: input
    type(group_t), intent(in) :: group
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing
    integer :: c, g

    text = ''
    key = 'name'
    do g = 1, size(input%groups)
      associate (other => input%groups(g))
        if (all(other%kind /= [character(len=10) :: 'motor', 'load', 'excitation', 'engine'])) cycle
        if (index(other%name, group%name // '_') /= 1) cycle
        do c = 1, size(group%texts('cylinders'))
          if (other%name == group%name // '_' // to_text(c) .or. &
              other%name == group%name // '_damping_' // to_text(c)) text = 'the name ' // quoted(other%name) // &
            ' of its cylinder ' // to_text(c) // ' is taken by &' // other%kind
        end do
      end associate
    end do
  end subroutine check_names

  !> Refuses orders of &excitation with rows that do not fit together, or without their load.
  subroutine check_order_torques(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: key, text
    integer :: load

    associate (group => input%groups(index))
      text = ''
      if (group%has_value('speeds')) call find_table_obstacle(group, key, text)
      if (text /= '') call input%report(index, key, text, diagnostics)
      if (.not. group%has_value('share_of_load')) return
      call find_shared_load(input, index, load, text)
      if (text /= '') call input%report(index, 'share_of_load', text, diagnostics)
    end associate
  end subroutine check_order_torques

end module nocdyn_engine_checks
