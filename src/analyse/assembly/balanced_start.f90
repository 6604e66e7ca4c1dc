!> A start in equilibrium at a speed that the input gives: a number of the input is found with which all torques balance there, or
!> a constant torque that is added to the machine.
!>
!> A torque on the body with the speed holds it there at any value of the number. The value at which that torque vanishes is found
!> by the secant method: where torques are in proportion to the number, as for a load, the first step is exact.
module nocdyn_balanced_start
  use nocdyn_element_groups, only: bodies_of, body_index_t, new_body_index
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_held_speeds, only: held_speeds_t, held_state_t, new_held_speeds
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_joint_simplifications, only: has_joint_that_locks, has_joint_that_moves
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_parts, only: build_machine
  use nocdyn_schema, only: first_key, group_rule_index, key_rules, last_key
  use nocdyn_schema_rules, only: is_out_of_range
  use nocdyn_steady_views, only: steady_view_t
  use nocdyn_text, only: quoted, rounded_text, string_t
  use nocdyn_written_values, only: speed_text, unit_of
  implicit none (type, external)
  private

  public :: find_balanced_start, has_balanced_start

  integer, parameter :: digits = 7   ! in messages and notes

  !> The machine in balance.
  type, public :: balanced_start_t
    type(input_t) :: input                      !! with the value that was found
    real(wp), allocatable :: omega(:), phi(:)   !! [rad/s], [rad], [bodies]
    real(wp), allocatable :: internal(:)        !! states of the elements
    character(len=:), allocatable :: note
    integer, private :: group = 0, key = 0      !! of the number that is found
    real(wp), private :: speed = 0.0_wp         !! [rad/s]
    real(wp), private :: torque = 0.0_wp        !! that is missing on the body [N m]
    real(wp), private :: scale = 0.0_wp         !! the largest moment of an element [N m]
  contains
    procedure :: set => set_start
  end type balanced_start_t

contains

  !> Whether an input asks for such a start.
  pure logical function has_balanced_start(input)
    type(input_t), intent(in) :: input

    associate (run => input%groups(input%position('run')))
      has_balanced_start = run%text('start') == 'equilibrium' .and. run%has_value('start_speed')
    end associate
  end function has_balanced_start

  !> Finds the value of the number that is free, and the state of balance.
  subroutine find_balanced_start(input, start, error)
    type(input_t), intent(in) :: input
    type(balanced_start_t), intent(out) :: start
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: given
    character(len=:), allocatable :: where

    where = input%location(input%position('run'), 'start_speed') // ': '
    start%input = input
    if (has_joint_that_locks(input) .or. has_joint_that_moves(input)) then
      call raise(error, exit_input, where // 'start_speed is for machines without clutches, freewheels, friction of ' // &
                 'bearings, losses of teeth, cardans, cranks, relations and drives; allowed: start = ' // &
                 quoted('equilibrium') // ' without start_speed')
      return
    end if
    associate (run => input%groups(input%position('run')))
      start%speed = run%number('start_speed')
      if (run%has_value('free')) then
        call find_number(input, run%text('free'), start%group, start%key)
        if (start%group == 0) then
          call raise(error, exit_input, input%location(input%position('run'), 'free') // ': free = ' // quoted(run%text('free')) &
                     // ' is no number of this machine; allowed: GROUP.NAME.KEY of a single number that has a value, as ' // &
                     'load.water.quadratic')
          return
        end if
      else
        call add_torque(run%text('start_body'), run%number('t_start'), start)
      end if
    end associate
    given = start%input%groups(start%group)%values(start%key)%numbers(1)
    call search(start, error)
    if (allocated(error)) then
      error%message = where // error%message
    else
      call write_note(start, given)
    end if
  end subroutine find_balanced_start

  !> Finds GROUP.NAME.KEY, a single number that has a value; the group is 0 if there is none. Names may hold dots.
  pure subroutine find_number(input, path, group, key)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: path
    integer, intent(out) :: group, key
    integer :: first, g, k, last

    first = index(path, '.')
    last = index(path, '.', back=.true.)
    group = 0
    key = 0
    if (last == first) return
    do g = 1, size(input%groups)
      if (input%groups(g)%kind /= path(:first - 1) .or. input%groups(g)%name /= path(first + 1:last - 1)) cycle
      do k = 1, size(input%groups(g)%values)
        if (key_rules(first_key(input%groups(g)%rule) + k - 1)%name /= path(last + 1:)) cycle
        if (key_rules(first_key(input%groups(g)%rule) + k - 1)%count /= 1) cycle
        if (.not. allocated(input%groups(g)%values(k)%numbers)) cycle
        group = g
        key = k
        return
      end do
    end do
  end subroutine find_number

  !> Adds a constant torque, whose size is the number that is found.
  subroutine add_torque(body, t_start, start)
    character(len=*), intent(in) :: body
    real(wp), intent(in) :: t_start   !! [s]
    type(balanced_start_t), intent(inout) :: start
    type(group_t) :: torque
    integer :: g

    torque%kind = 'excitation'
    torque%name = 'balance'
    torque%rule = group_rule_index(torque%kind)
    do g = 1, size(start%input%groups)   ! a name that no element has
      if (index(start%input%groups(g)%name, torque%name) == 1) torque%name = start%input%groups(g)%name // '_'
    end do
    allocate (torque%values(last_key(torque%rule) - first_key(torque%rule) + 1))
    torque%values(torque%key_position('name')) = value_t(texts=[string_t(torque%name)])
    torque%values(torque%key_position('body')) = value_t(texts=[string_t(body)])
    torque%values(torque%key_position('kind')) = value_t(texts=[string_t('step')])
    torque%values(torque%key_position('time')) = value_t(numbers=[t_start - 1.0_wp])
    start%key = torque%key_position('amplitude')
    torque%values(start%key) = value_t(numbers=[0.0_wp])
    start%input%groups = [start%input%groups, torque]
    start%group = size(start%input%groups)
  end subroutine add_torque

  !> The secant method; a step that leaves the range of the key is halved a few times.
  subroutine search(start, error)
    type(balanced_start_t), intent(inout) :: start
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most_steps = 40, most_halvings = 6
    real(wp), parameter :: balanced = 1.0e-12_wp, first_step = 1.0e-2_wp
    real(wp) :: number, other, other_torque, step
    integer :: i, k

    number = start%input%groups(start%group)%values(start%key)%numbers(1)
    call evaluate(start, number, error)
    if (allocated(error)) return
    step = merge(first_step * abs(number), 1.0_wp, abs(number) > 0)
    if (.not. is_allowed(start, number + step)) step = -step
    do i = 1, most_steps
      if (abs(start%torque) <= balanced * start%scale) return
      do k = 1, most_halvings
        if (.not. is_allowed(start, number + step)) step = 0.5_wp * step
      end do
      if (.not. is_allowed(start, number + step)) exit
      other = number
      other_torque = start%torque
      number = number + step
      call evaluate(start, number, error)
      if (allocated(error)) return
      if (abs(start%torque - other_torque) <= balanced * start%scale) then
        if (abs(start%torque) <= sqrt(balanced) * start%scale) return   ! as near as rounding lets it
        call raise(error, exit_failed, 'the torques balance at that speed at no value of ' // path_of(start) // &
                   ', which does not change them')
        return
      end if
      step = -start%torque * (number - other) / (start%torque - other_torque)
      if (.not. is_finite(step)) exit
    end do
    call raise(error, exit_failed, 'no allowed value of ' // path_of(start) // ' balances the torques at that speed: at ' // &
               rounded_text(number, digits) // ' a torque of ' // rounded_text(start%torque, digits) // ' N m is missing on ' // &
               quoted(start%input%groups(start%input%position('run'))%text('start_body')))
  end subroutine search

  !> Whether the key may have a value.
  pure logical function is_allowed(start, number)
    type(balanced_start_t), intent(in) :: start
    real(wp), intent(in) :: number

    associate (rule => first_key(start%input%groups(start%group)%rule) + start%key - 1)
      is_allowed = .not. is_out_of_range(number, key_rules(rule)%allowed)
    end associate
  end function is_allowed

  !> Sets the number, and finds the torque that holds the speed then.
  subroutine evaluate(start, number, error)
    type(balanced_start_t), intent(inout) :: start
    real(wp), intent(in) :: number
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: machine
    type(held_speeds_t) :: held
    type(held_state_t) :: state
    type(body_index_t) :: bodies
    integer :: reference(1)

    start%input%groups(start%group)%values(start%key)%numbers(1) = number
    call build_machine(start%input, steady_view_t(), machine, error)
    if (allocated(error)) return
    bodies = new_body_index(machine%names)
    associate (run => start%input%groups(start%input%position('run')))
      reference = bodies_of(run, 'start_body', bodies)
      call new_held_speeds(machine, reference(1), held, error, t=run%number('t_start'))
    end associate
    if (.not. allocated(error)) call held%hold(start%speed, state, error)
    if (allocated(error)) return
    start%torque = state%torque
    start%scale = maxval(abs(state%mean))
    start%omega = state%omega
    start%phi = state%phi + state%omega / state%speed * machine%start_angle(1, reference(1))
    start%internal = held%balance%formulation%state%elements%internal%value(1, :)
  end subroutine evaluate

  !> What was found, for the user.
  subroutine write_note(start, given)
    type(balanced_start_t), intent(inout) :: start
    real(wp), intent(in) :: given   !! value of the number in the input

    associate (run => start%input%groups(start%input%position('run')), &
               number => start%input%groups(start%group)%values(start%key)%numbers(1))
      start%note = 'the start is in equilibrium at ' // speed_text(start%speed, unit_of(run, 'start_speed'), digits) // &
                   ' of ' // quoted(run%text('start_body'))
      if (run%has_value('free')) then
        start%note = start%note // ' with ' // path_of(start) // ' = ' // rounded_text(number, digits) // ', not ' // &
                     rounded_text(given, digits)
      else
        start%note = start%note // ' by a constant torque of ' // rounded_text(number, digits) // &
                     ' N m on it, the excitation ' // quoted(start%input%groups(start%group)%name) // &
                     '; free names a number that is found in place of it'
      end if
    end associate
  end subroutine write_note

  !> GROUP.NAME.KEY of the number that is found.
  pure function path_of(start) result(path)
    type(balanced_start_t), intent(in) :: start
    character(len=path_length(start)) :: path

    associate (group => start%input%groups(start%group))
      path = group%kind // '.' // group%name // '.' // trim(key_rules(first_key(group%rule) + start%key - 1)%name)
    end associate
  end function path_of

  pure integer function path_length(start) result(length)
    type(balanced_start_t), intent(in) :: start

    associate (group => start%input%groups(start%group))
      length = len(group%kind) + len(group%name) + 2 + len_trim(key_rules(first_key(group%rule) + start%key - 1)%name)
    end associate
  end function path_length

  !> Starts all lanes of a machine of the input with the value that was found.
  subroutine set_start(self, machine)
    class(balanced_start_t), intent(in) :: self
    type(machine_t), intent(inout) :: machine

    machine%start_speed(:, :) = spread(self%omega, 1, machine%lanes)
    machine%start_angle(:, :) = spread(self%phi, 1, machine%lanes)
    allocate (machine%steady_internal, source=spread(self%internal, 1, machine%lanes))
  end subroutine set_start

end module nocdyn_balanced_start
