!> Where a number or a text of the input stands: GROUP.KEY for groups that occur once, GROUP.NAME.KEY for named ones,
!> GROUP(NUMBER).KEY for others, with a subscript behind the key where it is a list.
module nocdyn_key_path
  use nocdyn_literals, only: literal_fine, read_integer
  use nocdyn_namelist, only: assignment_t
  use nocdyn_namelist_values, only: read_subscript
  use nocdyn_schema, only: group_rule_index, group_rules, is_single, key_rule_index
  use nocdyn_schema_text, only: group_names, key_suggestion, suggestion
  use nocdyn_text, only: lower_case
  implicit none (type, external)
  private

  public :: read_path

  type, public :: key_path_t
    integer :: group_rule = 0
    integer :: key_rule = 0
    character(len=:), allocatable :: name       !! of the element, '' for groups without names
    integer :: number = 0                       !! among the groups without names of its kind, 0: the path has none
    type(assignment_t) :: place                 !! key and subscript
    logical :: is_out_of_range = .false.             !! the subscript is a whole number that no list has as a place
  end type key_path_t

contains

  !> Takes a path apart. The first dot ends the group and the last one begins the key, so that names may hold dots.
  subroutine read_path(text, ending, path, message)
    character(len=*), intent(in) :: text
    character(len=*), intent(in) :: ending   !! what follows a path here, for messages: '=VALUE' or ''
    type(key_path_t), intent(out) :: path
    character(len=:), allocatable, intent(out) :: message   !! '' if all is well
    character(len=:), allocatable :: key
    integer :: first_dot, last_dot

    path%name = ''
    first_dot = index(text, '.')
    last_dot = index(text, '.', back=.true.)
    if (first_dot == 0) then
      message = 'there is no dot in ' // text // '; write GROUP.KEY' // ending // ' or GROUP.NAME.KEY' // ending
      return
    end if
    call read_group(text(:first_dot - 1), path, message)
    if (message /= '') return
    if (last_dot > first_dot) path%name = text(first_dot + 1:last_dot - 1)
    call read_key(text(last_dot + 1:), path, key, message)
    if (message == '') call check_form(path, key // ending, last_dot > first_dot, message)
  end subroutine read_path

  subroutine read_group(text, path, message)
    character(len=*), intent(in) :: text   !! GROUP or GROUP(NUMBER)
    type(key_path_t), intent(inout) :: path
    character(len=:), allocatable, intent(out) :: message
    character(len=:), allocatable :: group
    type(assignment_t) :: place
    integer :: open

    open = index(text // '(', '(')
    group = lower_case(trim(text(:open - 1)))
    path%group_rule = group_rule_index(group)
    message = ''
    if (path%group_rule == 0) then
      message = "there is no group '" // group // "'" // suggestion(group, group_names())
    else if (open <= len(text)) then
      call read_subscript(text(open + 1:max(open, len(text) - 1)), place)
      path%number = place%first
      if (place%is_malformed .or. place%last /= place%first .or. text(len(text):) /= ')') message = text(open:) &
        // ' is no number of a group such as (3)'
    end if
  end subroutine read_group

  subroutine read_key(text, path, key, message)
    character(len=*), intent(in) :: text   !! KEY or KEY(SUBSCRIPT)
    type(key_path_t), intent(inout) :: path
    character(len=:), allocatable, intent(out) :: key
    character(len=:), allocatable, intent(out) :: message
    integer :: open

    open = index(text // '(', '(')
    key = lower_case(trim(text(:open - 1)))
    path%place%key = key
    path%key_rule = key_rule_index(path%group_rule, key)
    message = ''
    if (path%key_rule == 0) then
      message = key // ' is not a key of &' // trim(group_rules(path%group_rule)%name) &
        // key_suggestion(path%group_rule, key)
    else if (open <= len(text)) then
      call read_subscript(text(open + 1:max(open, len(text) - 1)), path%place)
      if (path%place%is_malformed) path%is_out_of_range = is_whole_number(text(open + 1:max(open, len(text) - 1)))
      if ((path%place%is_malformed .and. .not. path%is_out_of_range) .or. text(len(text):) /= ')') message = text(open:) &
        // ' is neither a place such as (3) nor a section such as (1:3)'
    end if
  end subroutine read_key

  logical function is_whole_number(text)
    character(len=*), intent(in) :: text
    integer :: number, status

    call read_integer(trim(adjustl(text)), number, status)
    is_whole_number = status == literal_fine
  end function is_whole_number

  !> Single groups are addressed by kind and key, named ones by kind, name and key, others by kind, number and key.
  subroutine check_form(path, ending, has_name, message)
    type(key_path_t), intent(in) :: path
    character(len=*), intent(in) :: ending   !! of the path, for the message
    logical, intent(in) :: has_name
    character(len=:), allocatable, intent(inout) :: message
    character(len=:), allocatable :: group

    group = trim(group_rules(path%group_rule)%name)
    if (is_single(path%group_rule)) then
      if (has_name) message = '&' // group // ' has no name; write ' // group // '.' // ending
      if (path%number > 0) message = '&' // group // ' occurs once only; write ' // group // '.' // ending
    else if (group_rules(path%group_rule)%name_space == '') then
      if (has_name .or. path%number == 0) message = '&' // group // ' has no name; write ' // group // '(1).' // ending // &
        ' for the first one in the file'
    else if (path%number > 0) then
      message = '&' // group // ' is found by its name; write ' // group // '.NAME.' // ending
    else if (.not. has_name) then
      message = '&' // group // ' may occur several times; write ' // group // '.NAME.' // ending
    end if
  end subroutine check_form

end module nocdyn_key_path
