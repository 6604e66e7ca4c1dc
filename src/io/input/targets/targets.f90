!> Numbers of an input that a sweep varies: found by their path, checked as reading checks them.
module nocdyn_targets
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_input_draft, only: draft_t
  use nocdyn_ordering_rules, only: applies, ascending_message, find_order_keys, ordering_message, teeth_message
  use nocdyn_input_values, only: convert
  use nocdyn_kinds, only: wp
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_schema, only: first_key, key_rules, orders
  use nocdyn_schema_relations, only: relations_of, relations_t
  use nocdyn_schema_rules, only: allowed_t, an_integer, is_outside, required, unset
  use nocdyn_schema_text, only: allowed_text
  use nocdyn_target_search, only: found_t, search_target
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: find_target, set_target, set_targets

  !> What else must hold in the group when the number has changed.
  integer, parameter :: nothing_else = 0, an_order = 1, an_ascent = 2, room_for_planets = 3

  type, public :: target_t
    character(len=:), allocatable :: path   !! as written
    integer :: group = 0                    !! index in the input
    integer :: key = 0                      !! index in the group's values
    integer :: position = 1                    !! in the list of the key
    character(len=:), allocatable :: unit   !! '' if it has none
    character(len=:), allocatable :: long_name   !! for people: "viscous of &load 'work': torque per speed"
    logical :: is_integer = .false.           !! values are rounded to the nearest whole number
    integer, private :: rule = 0            !! row of `key_rules`
    integer, private :: relation = nothing_else
    type(allowed_t), private :: allowed
  end type target_t

contains

  !> The number that a path leads to: GROUP.NAME.KEY, run.KEY, KEY(3) for one place of a list.
  subroutine find_target(input, path, target, message)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: path
    type(target_t), intent(out) :: target
    character(len=:), allocatable, intent(out) :: message   !! '' if fine, else what is wrong and allowed
    type(found_t) :: found

    target%path = trim(adjustl(path))
    target%unit = ''
    target%long_name = ''
    call search_target(input, target%path, found, message)
    if (message /= '') return
    target%group = found%group
    target%key = found%rule - first_key(input%groups(found%group)%rule) + 1
    target%position = found%position
    target%rule = found%rule
    target%unit = trim(key_rules(found%rule)%unit)
    target%long_name = trim(key_rules(found%rule)%name) // ' of ' // input%label(found%group) // ': ' // &
                       trim(key_rules(found%rule)%help)
    target%is_integer = key_rules(found%rule)%kind == an_integer
    target%allowed = key_rules(found%rule)%allowed
    if (target%is_integer) target%allowed%high = min(target%allowed%high, real(huge(0), wp))
    target%relation = relation_of(input%groups(found%group), target%key)
  end subroutine find_target

  integer function relation_of(group, key) result(relation)
    type(group_t), intent(in) :: group
    integer, intent(in) :: key
    type(relations_t) :: relations
    integer :: c, lower, o, upper

    relation = nothing_else
    do o = 1, size(orders)
      if (.not. applies(o, group)) cycle
      call find_order_keys(o, group, lower, upper)
      if (key == lower .or. key == upper) relation = an_order
    end do
    relations = relations_of(group%rule)
    do c = 1, size(relations%columns)
      associate (columns => relations%columns(c))
        if (size(columns%second) == 1 .and. columns%first(1) == key) relation = an_ascent
      end associate
    end do
    if (group%kind == 'planetary') relation = room_for_planets
  end function relation_of

  !> Sets one number, if it is allowed and fits the other numbers of its group as they are.
  subroutine set_target(input, target, value, message)
    type(input_t), intent(inout) :: input
    type(target_t), intent(in) :: target
    real(wp), intent(in) :: value
    character(len=:), allocatable, intent(out) :: message   !! '' if fine, else what is wrong and allowed

    call put_value(input%groups(target%group), target, value, message)
    if (message == '') call check_relation(input%groups(target%group), target, message)
  end subroutine set_target

  !> Sets the numbers of a variant, and then judges how they go together. After a complaint some of them are set.
  subroutine set_targets(input, targets, values, message)
    type(input_t), intent(inout) :: input
    type(target_t), intent(in) :: targets(:)
    real(wp), intent(in) :: values(:)   !! [targets]
    character(len=:), allocatable, intent(out) :: message   !! on the first one that is wrong, '' if none is
    integer :: i

    message = ''
    do i = 1, size(targets)
      call put_value(input%groups(targets(i)%group), targets(i), values(i), message)
      if (message /= '') return
    end do
    do i = 1, size(targets)
      call check_relation(input%groups(targets(i)%group), targets(i), message)
      if (message /= '') return
    end do
  end subroutine set_targets

  subroutine put_value(group, target, value, message)
    type(group_t), intent(inout) :: group
    type(target_t), intent(in) :: target
    real(wp), intent(in) :: value
    character(len=:), allocatable, intent(out) :: message
    real(wp) :: number

    number = value
    if (target%is_integer) number = anint(value)
    if (.not. ieee_is_finite(number)) then
      message = target%path // ' is not a finite number; allowed: ' // allowed_text(key_rules(target%rule))
      return
    else if (is_outside(number, target%allowed)) then
      message = target%path // ' = ' // to_text(number) // ' is out of range; allowed: ' // allowed_text(key_rules(target%rule))
      return
    end if
    message = ''
    if (.not. group%values(target%key)%has_any()) call give_value(group, target)
    associate (place => group%values(target%key))
      place%is_given = .true.
      if (target%is_integer) then
        place%whole_numbers(target%position) = int(number)
      else
        place%numbers(target%position) = number
      end if
    end associate
  end subroutine put_value

  !> A key that was unset takes the place of its alternatives, and keys that have defaults beside it get them.
  subroutine give_value(group, target)
    type(group_t), intent(inout) :: group
    type(target_t), intent(in) :: target
    type(relations_t) :: relations
    integer :: i

    if (target%is_integer) then
      allocate (group%values(target%key)%whole_numbers(1), source=0)
    else
      allocate (group%values(target%key)%numbers(1), source=0.0_wp)
    end if
    relations = relations_of(group%rule)
    do i = 1, size(relations%alternatives)
      associate (sets => relations%alternatives(i))
        if (any(sets%first == target%key)) call take_values(group, sets%second)
        if (any(sets%second == target%key)) call take_values(group, sets%first)
      end associate
    end do
    do i = 1, size(relations%needs)
      if (any(relations%needs(i)%second == target%key)) call give_defaults(group, relations%needs(i)%first)
    end do
  end subroutine give_value

  subroutine take_values(group, keys)
    type(group_t), intent(inout) :: group
    integer, intent(in) :: keys(:)
    integer :: i

    do i = 1, size(keys)
      group%values(keys(i)) = value_t()
    end do
  end subroutine take_values

  !> Gives the keys that are unset and have a default that default.
  subroutine give_defaults(group, keys)
    type(group_t), intent(inout) :: group
    integer, intent(in) :: keys(:)
    type(draft_t) :: draft
    type(diagnostics_t) :: none
    integer :: i

    do i = 1, size(keys)
      associate (rule => key_rules(first_key(group%rule) + keys(i) - 1))
        if (group%values(keys(i))%has_any() .or. rule%default == required .or. rule%default == unset) cycle
        draft = draft_t()
        call draft%fill_default(rule, rule%count)
        call convert(draft, rule, 0, group%values(keys(i)), none)
      end associate
    end do
  end subroutine give_defaults

  subroutine check_relation(group, target, message)
    type(group_t), intent(in) :: group
    type(target_t), intent(in) :: target
    character(len=:), allocatable, intent(inout) :: message   !! '' on entry
    integer :: i, o

    select case (target%relation)
    case (an_order)
      do o = 1, size(orders)
        if (applies(o, group) .and. message == '') message = ordering_message(o, group)
      end do
    case (an_ascent)
      associate (numbers => group%values(target%key)%numbers)
        do i = max(2, target%position), min(target%position + 1, size(numbers))
          if (message == '') message = ascending_message(trim(key_rules(target%rule)%name), numbers, i)
        end do
      end associate
    case (room_for_planets)
      message = teeth_message(group)
    case default   ! nothing else in the group depends on it
      return
    end select
    if (message /= '') message = target%path // ': ' // message
  end subroutine check_relation

end module nocdyn_targets
