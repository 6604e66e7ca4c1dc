!> Numbers of an input that a sweep varies: found by their path, checked as the reader of the input checks them.
module nocdyn_targets
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use nocdyn_group_checks, only: ascending_message, less_than_message
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_key_path, only: key_path_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_schema_relations, only: relation_t, relations_of, relations_t
  use nocdyn_schema_rules, only: allowed_t, an_integer, at_most_one, exactly_one, is_out_of_range, less_than, &
    required, requires, unset
  use nocdyn_schema_text, only: allowed_text, needed_text
  use nocdyn_schema_units, only: name_in_unit, unit_name
  use nocdyn_target_search, only: search_target
  use nocdyn_text, only: to_text
  use nocdyn_value_conversion, only: convert_number, default_value
  implicit none (type, external)
  private

  public :: find_target, set_targets, target_path

  !> One number of an input.
  type, public :: target_t
    character(len=:), allocatable :: path        !! as written
    integer :: group = 0                         !! index in the input
    integer :: key = 0                           !! index in the group's values
    integer :: position = 1                      !! in the list of the key
    character(len=:), allocatable :: unit        !! of its values, '' if it has none
    integer :: in_unit = 0                       !! this unit as index of `units`, 0: the one of the schema
    character(len=:), allocatable :: long_name   !! "viscous of &load 'work': torque per speed"
    logical :: is_integer = .false.              !! values are rounded to the nearest integer
    integer, private :: rule = 0                 !! row of `key_rules`
    type(relation_t), allocatable, private :: less_than   !! that the number and another one must fulfil, if any
    type(allowed_t), private :: allowed
  end type target_t

contains

  !> Finds the number with a path: GROUP.NAME.KEY, run.KEY, or KEY(3) for one value of a list.
  subroutine find_target(input, path, target, message)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: path
    type(target_t), intent(out) :: target
    character(len=:), allocatable, intent(out) :: message   !! what is wrong and allowed, '' if nothing is wrong
    type(relations_t) :: relations
    type(key_path_t) :: parts
    integer :: group, i

    target%path = trim(adjustl(path))
    target%unit = ''
    target%long_name = ''
    call search_target(input, target%path, group, parts, target%position, message)
    if (message /= '') return
    target%group = group
    target%rule = parts%key_rule
    target%in_unit = parts%unit
    target%key = target%rule - first_key(input%groups(group)%rule) + 1
    associate (rule => key_rules(target%rule))
      target%unit = unit_name(rule, parts%unit)
      target%long_name = name_in_unit(rule, parts%unit) // ' of ' // input%label(group) // ': ' // trim(rule%help)
      target%is_integer = rule%value_type == an_integer
      target%allowed = rule%allowed
    end associate
    if (target%is_integer) target%allowed%high = min(target%allowed%high, real(huge(0), wp))
    relations = relations_of(input%groups(group)%rule)
    do i = 1, size(relations%list)
      if (relations%list(i)%form /= less_than) cycle
      if (any([relations%list(i)%first, relations%list(i)%second] == target%key)) target%less_than = relations%list(i)
    end do
  end subroutine find_target

  !> The path of one number, without a pattern, in the unit of its values: 'gear.reducer.radii(2)'.
  function target_path(input, target) result(path)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target
    character(len=:), allocatable :: path

    associate (rule => key_rules(target%rule), group => input%groups(target%group))
      path = group%kind // '.'
      if (group%name /= '') path = path // group%name // '.'
      path = path // name_in_unit(rule, target%in_unit)
      if (rule%count /= 1) path = path // '(' // to_text(target%position) // ')'
    end associate
  end function target_path

  !> Sets numbers and checks them, then the relations to the other numbers of their groups. If one is wrong, some are set.
  subroutine set_targets(input, targets, values, message)
    type(input_t), intent(inout) :: input
    type(target_t), intent(in) :: targets(:)
    real(wp), intent(in) :: values(:)   !! [targets], in the units of the targets; rounded if a key has integers
    character(len=:), allocatable, intent(out) :: message   !! on the first number that is wrong, '' if none is
    integer :: i

    message = ''
    do i = 1, size(targets)
      call set_value(input%groups(targets(i)%group), targets(i), values(i), message)
      if (message /= '') return
    end do
    do i = 1, size(targets)
      call check_relation(input%groups(targets(i)%group), targets(i), message)
      if (message /= '') return
    end do
  end subroutine set_targets

  !> Sets one number if it is in its range.
  subroutine set_value(group, target, value, message)
    type(group_t), intent(inout) :: group
    type(target_t), intent(in) :: target
    real(wp), intent(in) :: value   !! in the unit of the target; rounded if the key has integers
    character(len=:), allocatable, intent(out) :: message
    character(len=:), allocatable :: written
    real(wp) :: number

    number = value
    if (target%is_integer) number = anint(value)
    if (.not. ieee_is_finite(number)) then
      message = target%path // ' is not a finite number; allowed: ' // needed_text(key_rules(target%rule), target%in_unit)
      return
    end if
    written = to_text(number)
    message = ''
    if (.not. target%is_integer) then
      call convert_number(key_rules(target%rule), target%in_unit, number, message)
    else if (is_out_of_range(number, target%allowed)) then
      message = ' is out of range; allowed: ' // allowed_text(key_rules(target%rule))
    end if
    if (message /= '') message = target%path // ' = ' // written // message
    if (message /= '') return
    if (.not. group%values(target%key)%has_any()) call give_value(group, target)
    associate (stored => group%values(target%key))
      stored%is_given = .true.
      if (target%is_integer) then
        stored%whole_numbers(target%position) = int(number)
      else
        stored%numbers(target%position) = number
      end if
    end associate
  end subroutine set_value

  !> Gives a value to a key that has none. Keys that exclude it lose theirs; keys that require it get their defaults.
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
    do i = 1, size(relations%list)
      associate (relation => relations%list(i))
        select case (relation%form)
        case (exactly_one, at_most_one)
          if (any(relation%first == target%key)) call remove_values(group, relation%second)
          if (any(relation%second == target%key)) call remove_values(group, relation%first)
        case (requires)
          if (any(relation%second == target%key)) call give_defaults(group, relation%first)
        case default   ! lengths and values do not decide which keys have a value
        end select
      end associate
    end do
  end subroutine give_value

  subroutine remove_values(group, keys)
    type(group_t), intent(inout) :: group
    integer, intent(in) :: keys(:)   !! indices of values
    integer :: i

    do i = 1, size(keys)
      group%values(keys(i)) = value_t()
    end do
  end subroutine remove_values

  !> Gives their defaults to keys without a value.
  subroutine give_defaults(group, keys)
    type(group_t), intent(inout) :: group
    integer, intent(in) :: keys(:)   !! indices of values
    integer :: i

    do i = 1, size(keys)
      associate (rule => first_key(group%rule) + keys(i) - 1)
        if (group%values(keys(i))%has_any()) cycle
        if (key_rules(rule)%default == required .or. key_rules(rule)%default == unset) cycle
        group%values(keys(i)) = default_value(rule)
      end associate
    end do
  end subroutine give_defaults

  !> Whether a number fits the others of its group.
  subroutine check_relation(group, target, message)
    type(group_t), intent(in) :: group
    type(target_t), intent(in) :: target
    character(len=:), allocatable, intent(inout) :: message   !! '' on entry; on exit what is wrong, if anything
    integer :: i

    if (key_rules(target%rule)%ascends) then
      do i = max(2, target%position), min(target%position + 1, group%values(target%key)%count())
        if (message == '') message = ascending_message(group, target%key, i, target%in_unit)
      end do
    else if (allocated(target%less_than)) then
      message = less_than_message(group, target%less_than)
    end if
    if (message /= '') message = target%path // ': ' // message
  end subroutine check_relation

end module nocdyn_targets
