!> One group of the input: what file and overrides say, completed by defaults and checked by itself.
module nocdyn_input_group
  use nocdyn_input, only: group_t, value_t
  use nocdyn_input_columns, only: complete_columns
  use nocdyn_ordering_rules, only: applies, find_order_keys, ordering_message
  use nocdyn_input_overrides, only: override_t
  use nocdyn_key_relations, only: relate_keys
  use nocdyn_input_values, only: convert
  use nocdyn_input_work, only: new_work, work_t
  use nocdyn_diagnostics, only: diagnostics_t, no_line
  use nocdyn_namelist, only: assignment_t, namelist_group_t, namelist_t
  use nocdyn_schema, only: group_rules, is_single, key_rule_index, key_rules, orders
  use nocdyn_schema_relations, only: relations_t
  use nocdyn_schema_rules, only: a_name, key_rule_t, unset
  use nocdyn_schema_text, only: allowed_text, key_suggestion, meant_keys
  use nocdyn_text, only: lower_case, string_t, to_text
  implicit none (type, external)
  private

  public :: read_group

contains

  !> Reads the group `index` of the input; `source` is empty for a single group that the file lacks.
  subroutine read_group(namelist, source, index, overrides, folder, relations, group, diagnostics)
    type(namelist_t), intent(in) :: namelist
    type(namelist_group_t), intent(in) :: source
    integer, intent(in) :: index
    type(override_t), intent(inout) :: overrides(:)
    character(len=*), intent(in) :: folder  !! of the input file, with a slash at its end, or ''
    type(relations_t), intent(in) :: relations   !! of the keys of this kind of group
    type(group_t), intent(inout) :: group   !! `rule`, `kind` and `line` are known
    type(diagnostics_t), intent(inout) :: diagnostics
    type(work_t), allocatable :: work
    integer :: i

    allocate (work, source=new_work(index, group%rule, group%line, source%is_damaged))
    allocate (group%values(size(work%drafts)))
    call take_assignments(namelist, source, work, diagnostics)
    group%name = name_of(work)
    call take_overrides(group%name, number_of(namelist, index, group%rule), overrides, work, diagnostics)
    call relate_keys(work, relations, diagnostics)
    do i = 1, size(work%drafts)
      call complete(work, i, group%values(i), diagnostics)
    end do
    call complete_columns(work, relations%columns, folder, group, diagnostics)
    call check_orders(group, index, diagnostics)
  end subroutine read_group

  subroutine take_assignments(namelist, source, work, diagnostics)
    type(namelist_t), intent(in) :: namelist
    type(namelist_group_t), intent(in) :: source
    type(work_t), intent(inout) :: work
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    integer :: i, key

    do i = source%first_assignment, source%last_assignment
      associate (assignment => namelist%assignments(i))
        key = key_rule_index(work%rule, assignment%key)
        if (key == 0) then
          call refuse_key(assignment, work, diagnostics)
          cycle
        end if
        call work%drafts(key - work%first + 1)%assign(namelist, assignment, key_rules(key), message)
        if (message == '') cycle
        key = key_without_equals(namelist, assignment, work%rule)
        if (key > 0) then
          message = message // "; is '=' missing behind " // trim(key_rules(key)%name) // '?'
          work%may_miss(key - work%first + 1) = .true.
        end if
        call diagnostics%add(assignment%line, work%index, message)
      end associate
    end do
  end subroutine take_assignments

  !> The keys that were probably meant are not missed in addition.
  subroutine refuse_key(assignment, work, diagnostics)
    type(assignment_t), intent(in) :: assignment
    type(work_t), intent(inout) :: work
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: meant(:)
    integer :: i

    allocate (meant, source=meant_keys(work%rule, assignment%key))
    do i = 1, size(meant)
      work%may_miss(key_rule_index(work%rule, meant(i)%text) - work%first + 1) = .true.
    end do
    call diagnostics%add(assignment%line, work%index, assignment%key // ' is not a key of &' &
      // trim(group_rules(work%rule)%name) // key_suggestion(work%rule, assignment%key))
  end subroutine refuse_key

  !> Row of a key that stands among the values, 0 if none does: its equals sign was probably forgotten.
  pure integer function key_without_equals(namelist, assignment, rule) result(key)
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    integer, intent(in) :: rule
    integer :: i

    key = 0
    do i = assignment%first_item, assignment%last_item
      if (namelist%items(i)%is_quoted .or. namelist%items(i)%is_null) cycle
      key = key_rule_index(rule, lower_case(namelist%item_text(namelist%items(i))))
      if (key > 0) return
    end do
  end function key_without_equals

  !> The name that the file gives, '' if none.
  pure function name_of(work) result(name)
    type(work_t), intent(in) :: work
    character(len=:), allocatable :: name
    integer :: i

    name = ''
    do i = 1, size(work%drafts)
      if (key_rules(work%first + i - 1)%kind /= a_name .or. work%drafts(i)%values_said() /= 1) cycle
      name = work%drafts(i)%slots(1)%text
    end do
  end function name_of

  !> The number of a group without name among those of its kind, 0 of other groups.
  pure integer function number_of(namelist, index, rule) result(number)
    type(namelist_t), intent(in) :: namelist
    integer, intent(in) :: index, rule

    number = 0
    if (is_single(rule) .or. group_rules(rule)%name_space /= '') return
    number = count(is_of(namelist%groups(:index), trim(group_rules(rule)%name)))
  end function number_of

  elemental logical function is_of(group, kind)
    type(namelist_group_t), intent(in) :: group
    character(len=*), intent(in) :: kind

    is_of = group%name == kind
  end function is_of

  subroutine take_overrides(name, number, overrides, work, diagnostics)
    character(len=*), intent(in) :: name
    integer, intent(in) :: number   !! among the groups without names
    type(override_t), intent(inout) :: overrides(:)
    type(work_t), intent(inout) :: work
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    integer :: i, key

    do i = 1, size(overrides)
      if (.not. overrides(i)%is_fine .or. overrides(i)%group_rule /= work%rule) cycle
      if (overrides(i)%name /= name .or. overrides(i)%number /= number) cycle
      overrides(i)%is_used = .true.
      key = overrides(i)%key_rule
      call work%drafts(key - work%first + 1)%replace(overrides(i)%namelist, overrides(i)%assignment, key_rules(key), i, &
        message)
      if (message /= '') call diagnostics%add(no_line, 0, message, i)
    end do
  end subroutine take_overrides

  !> Fills defaults in and converts.
  subroutine complete(work, i, value, diagnostics)
    type(work_t), intent(inout) :: work
    integer, intent(in) :: i
    type(value_t), intent(inout) :: value
    type(diagnostics_t), intent(inout) :: diagnostics
    type(key_rule_t) :: rule
    character(len=:), allocatable :: message
    integer :: known, said

    rule = work%key(i)
    associate (draft => work%drafts(i))
      said = draft%values_said()
      value%is_given = said > 0
      value%line = draft%line
      value%override = draft%override
      if (draft%is_damaged .or. (said == 0 .and. (work%may_miss(i) .or. work%is_out(i)))) return
      if (said == 0 .and. rule%default == unset .and. .not. work%is_needed(i)) return

      call draft%fill_default(rule, work%length(i))
      known = draft%values_said()
      if (known == 0 .and. .not. work%is_needed(i)) return
      if (known == 0) then
        message = trim(merge(' has no value', ' is missing  ', draft%is_written)) // '; needed: ' // allowed_text(rule)
      else if (known < size(draft%slots)) then
        message = ' has ' // counted(said) // '; needed: ' // to_text(size(draft%slots))
      else if (known < rule%least) then
        message = ' has ' // counted(known) // '; needed: at least ' // to_text(rule%least)
      else
        call convert(draft, rule, work%index, value, diagnostics)
        return
      end if
      call diagnostics%add(merge(draft%line, work%line, draft%line > 0), work%index, trim(rule%name) // message, draft%override)
    end associate
  end subroutine complete

  pure function counted(values) result(text)
    integer, intent(in) :: values
    character(len=:), allocatable :: text

    text = to_text(values) // trim(merge(' value ', ' values', values == 1))
  end function counted

  subroutine check_orders(group, index, diagnostics)
    type(group_t), intent(in) :: group
    integer, intent(in) :: index
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    integer :: o, lower, upper

    do o = 1, size(orders)
      if (.not. applies(o, group)) cycle
      message = ordering_message(o, group)
      if (message == '') cycle
      call find_order_keys(o, group, lower, upper)
      associate (low => group%values(lower), high => group%values(upper))
        call diagnostics%add(max(low%line, high%line), index, message, max(low%override, high%override))
      end associate
    end do
  end subroutine check_orders

end module nocdyn_input_group
