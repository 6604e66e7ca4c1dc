!> Finds the number of an input with a given path, or says what is wrong with the path.
module nocdyn_target_search
  use nocdyn_input, only: group_t, input_t
  use nocdyn_key_path, only: key_path_t, read_path
  use nocdyn_name_checks, only: collect_names
  use nocdyn_schema, only: first_key, group_rules, has_word, key_rules, last_key, selector_name, selector_rule
  use nocdyn_schema_rules, only: a_number, an_integer, key_rule_t
  use nocdyn_schema_text, only: only_if_text, suggest, type_text
  use nocdyn_schema_units, only: name_in_unit, other_unit
  use nocdyn_near_words, only: nearest_word
  use nocdyn_text, only: append, listed, lower_case, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: search_target

  !> Groups whose keys cannot vary.
  character(len=*), parameter :: fixed_groups = 'case output sweep vary record unknown objective design'

contains

  !> Finds a number by its path.
  subroutine search_target(input, text, group, path, position, message)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: text   !! a path
    integer, intent(out) :: group      !! index in the input, 0: not found
    type(key_path_t), intent(out) :: path
    integer, intent(out) :: position   !! in the list of the key
    character(len=:), allocatable, intent(out) :: message   !! what is wrong and allowed, '' if nothing is wrong
    type(string_t), allocatable :: names(:)
    integer :: count

    group = 0
    position = 1
    call read_path(text, '', path, message)
    if (path%key_rule == 0 .and. .not. path%is_near) call suggest_path(input, text, path%group_rule > 0, path%hint)
    message = message // path%hint
    if (path%group_rule > 0) then
      if (has_word(fixed_groups, group_rules(path%group_rule)%name)) message = 'the keys of &' // &
        trim(group_rules(path%group_rule)%name) // ' cannot vary; allowed: bodies, couplings, joints, torques and &run'
    end if
    if (message == '') call check_kind_of_key(path, message)
    if (message /= '') return
    call find_group(input, path, group)
    if (group == 0) then
      associate (groups => input%groups_named(trim(group_rules(path%group_rule)%name)))
        call collect_names(input%groups, pack(groups, input%groups(groups)%made_from == 0), names)
      end associate
      call suggest(path%name, names, path%hint, path%is_near)
      if (.not. path%is_near) call suggest_path(input, text, .true., path%hint)
      message = 'there is no &' // trim(group_rules(path%group_rule)%name) // ' ' // quoted(path%name) // path%hint
      return
    end if
    call check_law(input%groups(group), key_rules(path%key_rule), message)
    if (message == '') then
      ! Index of the value in the list of the key. Only a list has a subscript; a list of one value needs none.
      position = path%target%first
      count = input%groups(group)%values(path%key_rule - first_key(path%group_rule) + 1)%count()
      associate (rule => key_rules(path%key_rule))
        if (rule%count == 1) then
          if (.not. path%target%is_whole) message = path%target%key // ' is a single value and takes no subscript'
        else if (count == 0) then
          message = path%target%key // ' has no values in the input'
        else if (path%target%is_whole .and. count == 1) then
          position = 1
        else if (path%target%is_whole) then
          message = path%target%key // ' is a list; allowed: one of its values, ' // value_paths(text, count)
        else if (path%target%last /= position) then
          message = 'several values of ' // path%target%key // '; allowed: one, ' // &
                    value_paths(text(:index(text, '(', back=.true.) - 1), count)
        else if (position < 1 .or. position > count) then
          message = 'the subscript of ' // path%target%key // ' is out of range; allowed: 1 to ' // to_text(count)
        end if
      end associate
    end if
  end subroutine search_target

  !> Replaces a hint by a path of the input, if only the group of the text is missing or wrong.
  subroutine suggest_path(input, text, has_group, hint)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: text     !! the path
    logical, intent(in) :: has_group         !! the text begins with a group; then its rest must be a path
    character(len=:), allocatable, intent(inout) :: hint
    type(string_t), allocatable :: tails(:)
    integer, allocatable :: owners(:)
    character(len=:), allocatable :: tail
    integer :: near, subscript

    call list_tails(input, tails, owners)
    subscript = index(text // '(', '(')
    tail = lower_case(text(:subscript - 1))
    if (has_group) tail = tail(index(tail, '.') + 1:)
    near = nearest_word(tail, tails)
    if (near == 0) return
    if (has_group .and. tail /= lower_case(tails(near)%text)) return
    hint = "; did you mean '" // input%groups(owners(near))%kind // '.' // tails(near)%text // text(subscript:) // "'?"
  end subroutine suggest_path

  !> The paths of all keys that can vary, also in their other units, without their groups.
  subroutine list_tails(input, tails, owners)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(out) :: tails(:)
    integer, allocatable, intent(out) :: owners(:)   !! indices of the groups, [tails]
    integer :: found, g, key

    found = 0
    do g = 1, size(input%groups)
      if (.not. can_vary(input%groups(g))) cycle
      associate (rules => key_rules(first_key(input%groups(g)%rule):last_key(input%groups(g)%rule)))
        found = found + count(is_numeric(rules)) + count(other_unit(rules) > 0)
      end associate
    end do
    allocate (tails(found), owners(found))
    found = 0
    do g = 1, size(input%groups)
      if (.not. can_vary(input%groups(g))) cycle
      do key = first_key(input%groups(g)%rule), last_key(input%groups(g)%rule)
        if (.not. is_numeric(key_rules(key))) cycle
        call add_tail(g, name_in_unit(key_rules(key), 0))
        if (other_unit(key_rules(key)) > 0) call add_tail(g, name_in_unit(key_rules(key), other_unit(key_rules(key))))
      end do
    end do

  contains

    subroutine add_tail(owner, key_name)
      integer, intent(in) :: owner   !! index of the group
      character(len=*), intent(in) :: key_name

      found = found + 1
      owners(found) = owner
      tails(found)%text = key_name
      if (input%groups(owner)%name /= '') tails(found)%text = input%groups(owner)%name // '.' // key_name
    end subroutine add_tail

  end subroutine list_tails

  !> Whether keys of a group can vary.
  pure logical function can_vary(group)
    type(group_t), intent(in) :: group

    can_vary = .not. (has_word(fixed_groups, group%kind) .or. group%made_from > 0)
  end function can_vary

  !> Refuses keys that are not numbers.
  subroutine check_kind_of_key(path, message)
    type(key_path_t), intent(in) :: path
    character(len=:), allocatable, intent(inout) :: message
    type(string_t), allocatable :: names(:)
    integer :: key

    if (is_numeric(key_rules(path%key_rule))) return
    allocate (names(0))
    do key = first_key(path%group_rule), last_key(path%group_rule)
      if (is_numeric(key_rules(key))) call append(names, trim(key_rules(key)%name))
    end do
    message = trim(key_rules(path%key_rule)%name) // ' is not a number (' // type_text(key_rules(path%key_rule)) // ')'
    if (size(names) > 0) message = message // '; allowed: ' // listed(names, ', ')
  end subroutine check_kind_of_key

  elemental logical function is_numeric(rule)
    type(key_rule_t), intent(in) :: rule

    is_numeric = rule%value_type == a_number .or. rule%value_type == an_integer
  end function is_numeric

  !> The group with the name of the path.
  subroutine find_group(input, path, group)
    type(input_t), intent(in) :: input
    type(key_path_t), intent(in) :: path
    integer, intent(out) :: group   !! index in the input, 0: there is none

    do group = 1, size(input%groups)
      if (input%groups(group)%rule /= path%group_rule .or. input%groups(group)%made_from > 0) cycle
      if (input%groups(group)%name == path%name) return
    end do
    group = 0
  end subroutine find_group

  !> Refuses a key that the kind of the group does not have.
  subroutine check_law(group, rule, message)
    type(group_t), intent(in) :: group
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable, intent(inout) :: message
    character(len=:), allocatable :: law

    if (rule%only_if == '' .or. selector_rule(group%rule) == 0) return
    law = group%text(selector_name(group%rule))
    if (.not. has_word(rule%only_if, law)) message = trim(rule%name) // ' belongs to ' // selector_name(group%rule) // ' = ' // &
      only_if_text(rule) // '; here ' // selector_name(group%rule) // ' = ' // quoted(law)
  end subroutine check_law

  !> "gear.reducer.radii(1) or gear.reducer.radii(2)", "... to ...".
  pure function value_paths(path, count) result(text)
    character(len=*), intent(in) :: path   !! without subscript
    integer, intent(in) :: count           !! of the values
    character(len=:), allocatable :: text

    text = path // '(1)'
    if (count == 2) text = text // ' or ' // path // '(2)'
    if (count > 2) text = text // ' to ' // path // '(' // to_text(count) // ')'
  end function value_paths

end module nocdyn_target_search
