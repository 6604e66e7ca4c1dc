!> Overrides of the command line: PATH=VALUE, where PATH is GROUP.KEY or GROUP.NAME.KEY.
module nocdyn_input_overrides
  use nocdyn_mistakes, only: mistakes_t, no_line
  use nocdyn_namelist, only: assignment_t, item_t, namelist_t
  use nocdyn_namelist_scanner, only: scan_value
  use nocdyn_namelist_values, only: read_subscript
  use nocdyn_schema, only: group_rule_index, group_rules, holds_texts, is_single, key_rule_index, key_rules
  use nocdyn_schema_rules, only: a_name, key_rule_t
  use nocdyn_schema_text, only: group_names, key_names, suggestion
  use nocdyn_text, only: lower_case, string_t
  implicit none (type, external)
  private

  public :: read_overrides

  !> One override; its value is the items of `namelist`.
  type, public :: override_t
    logical :: is_fine = .false.
    logical :: is_used = .false.                !! its group was found
    integer :: group_rule = 0
    integer :: key_rule = 0
    character(len=:), allocatable :: name       !! of the element, '' for single groups
    type(assignment_t) :: assignment
    type(namelist_t) :: namelist
  end type override_t

contains

  !> Takes PATH=VALUE texts apart; what cannot be understood is a mistake and not `is_fine`.
  subroutine read_overrides(texts, overrides, mistakes)
    type(string_t), intent(in) :: texts(:)
    type(override_t), allocatable, intent(out) :: overrides(:)
    type(mistakes_t), intent(inout) :: mistakes
    character(len=:), allocatable :: complaint
    integer :: equals, i

    allocate (overrides(size(texts)))
    do i = 1, size(texts)
      overrides(i)%name = ''
      equals = index(texts(i)%text, '=')
      if (equals == 0) then
        complaint = 'there is no = in it; write PATH=VALUE'
      else
        call read_path(trim(adjustl(texts(i)%text(:equals - 1))), overrides(i), complaint)
        if (complaint == '') call read_value(texts(i)%text(equals + 1:), overrides(i), complaint)
      end if
      overrides(i)%is_fine = complaint == ''
      if (complaint /= '') call mistakes%add(no_line, 0, complaint, i)
    end do
  end subroutine read_overrides

  !> The first dot ends the group and the last one begins the key, so that names may hold dots.
  subroutine read_path(path, override, complaint)
    character(len=*), intent(in) :: path
    type(override_t), intent(inout) :: override
    character(len=:), allocatable, intent(out) :: complaint
    character(len=:), allocatable :: group, key
    integer :: first_dot, last_dot

    first_dot = index(path, '.')
    last_dot = index(path, '.', back=.true.)
    if (path == '') then
      complaint = 'there is nothing before the =; write GROUP.KEY=VALUE or GROUP.NAME.KEY=VALUE'
      return
    else if (first_dot == 0) then
      complaint = 'there is no dot in ' // path // '; write GROUP.KEY=VALUE or GROUP.NAME.KEY=VALUE'
      return
    end if
    group = lower_case(path(:first_dot - 1))
    override%group_rule = group_rule_index(group)
    if (override%group_rule == 0) then
      complaint = "there is no group '" // group // "'" // suggestion(group, group_names())
      return
    end if
    if (last_dot > first_dot) override%name = path(first_dot + 1:last_dot - 1)
    call read_key(path(last_dot + 1:), override, key, complaint)
    if (complaint == '') call check_form(group, key, last_dot > first_dot, is_single(override%group_rule), complaint)
  end subroutine read_path

  subroutine read_key(text, override, key, complaint)
    character(len=*), intent(in) :: text   !! KEY or KEY(SUBSCRIPT)
    type(override_t), intent(inout) :: override
    character(len=:), allocatable, intent(out) :: key
    character(len=:), allocatable, intent(out) :: complaint
    integer :: open

    open = index(text // '(', '(')
    key = lower_case(trim(text(:open - 1)))
    override%assignment%key = key
    override%key_rule = key_rule_index(override%group_rule, key)
    complaint = ''
    if (override%key_rule == 0) then
      complaint = key // ' is not a key of &' // trim(group_rules(override%group_rule)%name) &
        // suggestion(key, key_names(override%group_rule))
    else if (key_rules(override%key_rule)%kind == a_name) then
      complaint = 'a name cannot be overridden: other groups refer to it'
    else if (open <= len(text)) then
      call read_subscript(text(open + 1:max(open, len(text) - 1)), override%assignment)
      if (override%assignment%is_damaged .or. text(len(text):) /= ')') complaint = text(open:) &
        // ' is neither a place such as (3) nor a section such as (1:3)'
    end if
  end subroutine read_key

  !> Single groups are addressed by kind and key, named ones by kind, name and key.
  subroutine check_form(group, key, has_name, is_single_group, complaint)
    character(len=*), intent(in) :: group, key
    logical, intent(in) :: has_name, is_single_group
    character(len=:), allocatable, intent(inout) :: complaint

    if (is_single_group .and. has_name) then
      complaint = '&' // group // ' has no name; write ' // group // '.' // key // '=VALUE'
    else if (has_name .neqv. .not. is_single_group) then
      complaint = '&' // group // ' may occur several times; write ' // group // '.NAME.' // key // '=VALUE'
    end if
  end subroutine check_form

  !> A single text is taken as it stands if it has no quotes: the shell has eaten them.
  subroutine read_value(text, override, complaint)
    character(len=*), intent(in) :: text
    type(override_t), intent(inout) :: override
    character(len=:), allocatable, intent(out) :: complaint
    type(mistakes_t) :: mistakes
    type(key_rule_t) :: rule

    rule = key_rules(override%key_rule)
    if (holds_texts(rule%kind) .and. rule%count == 1 .and. scan(adjustl(text), '''"') /= 1) then
      override%namelist%source = text
      call override%namelist%append_item(item_t(first=1, last=len(text)))
    else
      call scan_value(text, override%namelist, mistakes)
    end if
    override%assignment%last_item = override%namelist%item_count
    complaint = ''
    if (mistakes%count > 0) then
      complaint = mistakes%list(1)%text
    else if (override%namelist%item_count == 0) then
      complaint = 'there is no value after the ='
    end if
  end subroutine read_value

end module nocdyn_input_overrides
