!> Paths of keys: GROUP.KEY in a group that occurs once, GROUP.NAME.KEY in a named group, GROUP(NUMBER).KEY in others. A subscript
!> after the key selects values of a list.
module nocdyn_key_path
  use nocdyn_literals, only: literal_ok, read_integer
  use nocdyn_namelist, only: assignment_t
  use nocdyn_namelist_values, only: read_subscript
  use nocdyn_schema, only: group_rule_index, group_rules, is_single
  use nocdyn_schema_text, only: suggest_group, suggest_key
  use nocdyn_schema_units, only: find_key
  use nocdyn_text, only: lower_case, quoted, shortened
  implicit none (type, external)
  private

  public :: read_path

  !> A path taken apart.
  type, public :: key_path_t
    integer :: group_rule = 0               !! row of `group_rules`, 0: there is no such group
    integer :: key_rule = 0                 !! row of `key_rules`, 0: there is no such key
    integer :: unit = 0                     !! of its numbers: index of `units`, 0: the one of the schema
    character(len=:), allocatable :: name   !! of the element, '' for groups without names
    integer :: number = 0                   !! of a group without name among the ones of its kind, 0: the path has none
    type(assignment_t) :: target            !! key and subscript
    logical :: is_out_of_range = .false.    !! the subscript is a whole number that is not an index of any list
    character(len=:), allocatable :: hint   !! on the group or key that may have been meant, perhaps ''
    logical :: is_near = .false.            !! it names one
  end type key_path_t

contains

  !> Takes a path apart. The first dot ends the group and the last dot begins the key; names may hold dots.
  subroutine read_path(text, ending, path, message)
    character(len=*), intent(in) :: text     !! the path
    character(len=*), intent(in) :: ending   !! text after the path in messages: '=VALUE' or ''
    type(key_path_t), intent(out) :: path
    character(len=:), allocatable, intent(out) :: message   !! what is wrong, '' if nothing is; without the hint of the path
    character(len=:), allocatable :: key
    integer :: first_dot, last_dot

    path%name = ''
    path%hint = ''
    first_dot = index(text, '.')
    last_dot = index(text, '.', back=.true.)
    if (first_dot == 0) then
      message = 'there is no dot in ' // shortened(text)
      path%hint = '; write GROUP.KEY' // ending // ' or GROUP.NAME.KEY' // ending
      return
    end if
    call read_group(text(:first_dot - 1), path, message)
    if (message /= '') return
    if (last_dot > first_dot) path%name = text(first_dot + 1:last_dot - 1)
    call read_key(text(last_dot + 1:), path, key, message)
    if (message == '') call check_form(path, key // ending, last_dot > first_dot, message)
  end subroutine read_path

  !> Reads GROUP or GROUP(NUMBER).
  subroutine read_group(text, path, message)
    character(len=*), intent(in) :: text   !! GROUP or GROUP(NUMBER)
    type(key_path_t), intent(inout) :: path
    character(len=:), allocatable, intent(out) :: message
    character(len=:), allocatable :: group
    type(assignment_t) :: subscript
    integer :: open

    open = index(text // '(', '(')
    group = lower_case(trim(text(:open - 1)))
    path%group_rule = group_rule_index(group)
    message = ''
    if (path%group_rule == 0) then
      message = 'there is no group ' // quoted(shortened(group))
      call suggest_group(group, path%hint, path%is_near)
    else if (open <= len(text)) then
      call read_subscript(text(open + 1:max(open, len(text) - 1)), subscript)
      path%number = subscript%first
      if (subscript%is_malformed .or. subscript%last /= subscript%first .or. text(len(text):) /= ')') message = text(open:) // &
        ' is not the number of a group, such as (3)'
    end if
  end subroutine read_group

  !> Reads KEY or KEY(SUBSCRIPT).
  subroutine read_key(text, path, key, message)
    character(len=*), intent(in) :: text   !! KEY or KEY(SUBSCRIPT)
    type(key_path_t), intent(inout) :: path
    character(len=:), allocatable, intent(out) :: key
    character(len=:), allocatable, intent(out) :: message
    integer :: number, open, status

    open = index(text // '(', '(')
    key = lower_case(trim(text(:open - 1)))
    path%target%key = key
    call find_key(path%group_rule, key, path%key_rule, path%unit)
    message = ''
    if (path%key_rule == 0) then
      message = shortened(key) // ' is not a key of &' // trim(group_rules(path%group_rule)%name)
      call suggest_key(path%group_rule, key, path%hint, path%is_near)
    else if (open <= len(text)) then
      call read_subscript(text(open + 1:max(open, len(text) - 1)), path%target)
      if (path%target%is_malformed) then
        call read_integer(trim(adjustl(text(open + 1:max(open, len(text) - 1)))), number, status)
        path%is_out_of_range = status == literal_ok
      end if
      if ((path%target%is_malformed .and. .not. path%is_out_of_range) .or. text(len(text):) /= ')') message = text(open:) &
        // ' is neither an index such as (3) nor a section such as (1:3)'
    end if
  end subroutine read_key

  !> Checks that the path has a name or a number if and only if its group needs one.
  subroutine check_form(path, ending, has_name, message)
    type(key_path_t), intent(in) :: path
    character(len=*), intent(in) :: ending   !! of the path: key and text after it, for the message
    logical, intent(in) :: has_name   !! the path has a text between group and key
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
      message = '&' // group // ' has a name; write ' // group // '.NAME.' // ending
    else if (.not. has_name) then
      message = '&' // group // ' may occur several times; write ' // group // '.NAME.' // ending
    end if
  end subroutine check_form

end module nocdyn_key_path
