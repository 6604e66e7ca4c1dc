!> The way from a path to one number of an input, with what to say where there is none.
module nocdyn_target_search
  use nocdyn_input, only: group_t, input_t
  use nocdyn_name_checks, only: collect_names
  use nocdyn_key_path, only: key_path_t, read_path
  use nocdyn_schema, only: first_key, group_rules, has_word, key_rules, selector_name, selector_rule, last_key
  use nocdyn_schema_rules, only: a_number, an_integer, key_rule_t
  use nocdyn_schema_text, only: type_text, only_if_text, listed, suggestion
  use nocdyn_text, only: append, lower_case, nearest_word, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: search_target

  !> Groups without numbers that belong to the motion.
  character(len=*), parameter :: fixed_groups = 'case output sweep vary record'

  type, public :: found_t
    integer :: group = 0   !! index in the input
    integer :: rule = 0    !! row of `key_rules`
    integer :: position = 1   !! in the list of the key
  end type found_t

contains

  subroutine search_target(input, text, found, message)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: text   !! a path
    type(found_t), intent(out) :: found
    character(len=:), allocatable, intent(out) :: message   !! '' if fine, else what is wrong and allowed
    type(key_path_t) :: path

    call read_path(text, '', path, message)
    if (path%key_rule == 0) call suggest_path(input, text, path%group_rule > 0, message)
    if (path%group_rule > 0) then
      if (has_word(fixed_groups, group_rules(path%group_rule)%name)) message = 'the keys of &' // &
        trim(group_rules(path%group_rule)%name) // ' cannot vary; allowed: bodies, couplings, joints, torques and &run'
    end if
    if (message == '') call check_kind_of_key(path, message)
    if (message /= '') return
    found%rule = path%key_rule
    call find_group(input, path, found%group, message)
    if (message /= '') call suggest_path(input, text, .true., message)
    if (message == '') call check_law(input%groups(found%group), key_rules(found%rule), message)
    if (message == '') call find_place(input%groups(found%group), text, path, found%position, message)
  end subroutine search_target

  !> Puts a path of the input in place of what a complaint suggests, if the text is one whose group is missing or another one.
  subroutine suggest_path(input, text, has_group, message)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: text     !! the path
    logical, intent(in) :: has_group         !! there are groups of its kind; then the rest must be right
    character(len=:), allocatable, intent(inout) :: message
    type(string_t), allocatable :: tails(:)
    integer, allocatable :: owners(:)
    character(len=:), allocatable :: tail
    integer :: near, place

    if (index(message, '; did you mean') > 0) return   ! of the group or the key
    call list_tails(input, tails, owners)
    place = index(text // '(', '(')
    tail = lower_case(text(:place - 1))
    if (has_group) tail = tail(index(tail, '.') + 1:)
    near = nearest_word(tail, tails)
    if (near == 0) return
    if (has_group .and. tail /= lower_case(tails(near)%text)) return
    message = message(:index(message // ';', ';') - 1) // "; did you mean '" // input%groups(owners(near))%kind // '.' // &
                tails(near)%text // text(place:) // "'?"
  end subroutine suggest_path

  !> The paths without their groups of all keys that can vary.
  subroutine list_tails(input, tails, owners)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(out) :: tails(:)
    integer, allocatable, intent(out) :: owners(:)   !! indices of the groups, [tails]
    integer :: found, g, key

    found = 0
    do g = 1, size(input%groups)
      if (can_vary(input%groups(g))) found = found + &
        count(is_numeric(key_rules(first_key(input%groups(g)%rule):last_key(input%groups(g)%rule))))
    end do
    allocate (tails(found), owners(found))
    found = 0
    do g = 1, size(input%groups)
      if (.not. can_vary(input%groups(g))) cycle
      do key = first_key(input%groups(g)%rule), last_key(input%groups(g)%rule)
        if (.not. is_numeric(key_rules(key))) cycle
        found = found + 1
        owners(found) = g
        tails(found)%text = trim(key_rules(key)%name)
        if (input%groups(g)%name /= '') tails(found)%text = input%groups(g)%name // '.' // tails(found)%text
      end do
    end do
  end subroutine list_tails

  pure logical function can_vary(group)
    type(group_t), intent(in) :: group

    can_vary = .not. has_word(fixed_groups, group%kind)
  end function can_vary

  !> Only numbers vary.
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
    message = trim(key_rules(path%key_rule)%name) // ' is no number (' // type_text(key_rules(path%key_rule)) // ')'
    if (size(names) > 0) message = message // '; allowed: ' // listed(names, ', ')
  end subroutine check_kind_of_key

  elemental logical function is_numeric(rule)
    type(key_rule_t), intent(in) :: rule

    is_numeric = rule%value_type == a_number .or. rule%value_type == an_integer
  end function is_numeric

  subroutine find_group(input, path, group, message)
    type(input_t), intent(in) :: input
    type(key_path_t), intent(in) :: path
    integer, intent(out) :: group
    character(len=:), allocatable, intent(inout) :: message
    type(string_t), allocatable :: names(:)

    do group = 1, size(input%groups)
      if (input%groups(group)%rule /= path%group_rule) cycle
      if (input%groups(group)%name == path%name) return
    end do
    call collect_names(input%groups, input%groups_named(trim(group_rules(path%group_rule)%name)), names)
    message = 'there is no &' // trim(group_rules(path%group_rule)%name) // ' ' // quoted(path%name) // &
                suggestion(path%name, names)
  end subroutine find_group

  !> The key must be one of the law that the group follows.
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

  !> A list needs a place, a single value has none.
  subroutine find_place(group, text, path, place, message)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: text   !! the path
    type(key_path_t), intent(in) :: path
    integer, intent(out) :: place
    character(len=:), allocatable, intent(inout) :: message
    integer :: count

    place = path%place%first
    count = group%values(path%key_rule - first_key(path%group_rule) + 1)%count()
    associate (rule => key_rules(path%key_rule))
      if (rule%count == 1) then
        if (.not. path%place%is_whole) message = trim(rule%name) // ' is a single value and takes no subscript'
      else if (count == 0) then
        message = trim(rule%name) // ' has no values in the input, which one of them could vary'
      else if (path%place%is_whole) then
        message = trim(rule%name) // ' is a list; allowed: one of its places, ' // places(text, count)
      else if (path%place%last /= place) then
        message = 'several places of ' // trim(rule%name) // '; allowed: one, ' // &
                    places(text(:index(text, '(', back=.true.) - 1), count)
      else if (place < 1 .or. place > count) then
        message = 'the subscript of ' // trim(rule%name) // ' is out of range; allowed: 1 to ' // to_text(count)
      end if
    end associate
  end subroutine find_place

  !> "gear.reducer.radii(1) or gear.reducer.radii(2)", "... to ...".
  pure function places(path, count) result(text)
    character(len=*), intent(in) :: path   !! without subscript
    integer, intent(in) :: count           !! of the values
    character(len=:), allocatable :: text

    text = path // '(1)'
    if (count == 2) text = text // ' or ' // path // '(2)'
    if (count > 2) text = text // ' to ' // path // '(' // to_text(count) // ')'
  end function places

end module nocdyn_target_search
