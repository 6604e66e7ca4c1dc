!> Checks that need all groups: duplicate names, and references to bodies.
module nocdyn_name_checks
  use nocdyn_input, only: group_t
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_schema, only: first_key, group_rules, key_rules
  use nocdyn_schema_rules, only: a_body, body_or_ground, ground, key_rule_t
  use nocdyn_schema_text, only: suggestion
  use nocdyn_text, only: quoted, shortened, string_t, to_text
  use nocdyn_text_sort, only: argsort, sorted_position
  implicit none (type, external)
  private

  public :: check_duplicate_names, check_references, collect_names

  integer, parameter :: most_suggestions = 20   !! each is a search through all bodies

contains

  !> Refuses two elements of one name space with the same name.
  subroutine check_duplicate_names(groups, diagnostics)
    type(group_t), intent(in) :: groups(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, allocatable :: members(:), order(:)
    type(string_t), allocatable :: names(:)
    character(len=len(group_rules%name_space)) :: name_space
    integer :: first, i, rule

    do rule = 1, size(group_rules)
      name_space = group_rules(rule)%name_space
      if (name_space == '' .or. any(group_rules(:rule - 1)%name_space == name_space)) cycle
      members = pack([(i, i=1, size(groups))], [(is_member(groups(i), name_space), i=1, size(groups))])
      call collect_names(groups, members, names)
      call argsort(names, order)
      members = members(order)
      first = 1
      do i = 2, size(members)
        associate (earlier => groups(members(first)), later => groups(members(i)))
          if (earlier%name == later%name) then
            call diagnostics%add(later%line, members(i), 'the name ' // quoted(later%name) // ' is taken by &' // &
                                 earlier%kind // ' on line ' // to_text(earlier%line))
          else
            first = i
          end if
        end associate
      end do
    end do
  end subroutine check_duplicate_names

  !> Whether a group has a name in a name space.
  pure logical function is_member(group, name_space)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: name_space

    is_member = .false.
    if (group%rule > 0) is_member = group_rules(group%rule)%name_space == name_space .and. group%name /= ''
  end function is_member

  !> Names of the groups `members`.
  subroutine collect_names(groups, members, names)
    type(group_t), intent(in) :: groups(:)
    integer, intent(in) :: members(:)   !! indices of groups
    type(string_t), allocatable, intent(out) :: names(:)
    integer :: i

    allocate (names(size(members)))
    do i = 1, size(members)
      names(i)%text = groups(members(i))%name
    end do
  end subroutine collect_names

  !> Refuses keys with names of bodies that do not exist.
  subroutine check_references(groups, bodies_are_known, diagnostics)
    type(group_t), intent(in) :: groups(:)
    logical, intent(in) :: bodies_are_known   !! .false. if the name of a &body could not be read
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: bodies(:)
    integer, allocatable :: members(:), order(:)
    character(len=:), allocatable :: hint
    type(key_rule_t) :: rule
    integer :: g, i, key, missing

    if (.not. bodies_are_known) return
    members = pack([(i, i=1, size(groups))], [(is_member(groups(i), 'body'), i=1, size(groups))])
    call collect_names(groups, members, bodies)
    call argsort(bodies, order)
    missing = 0
    do g = 1, size(groups)
      if (groups(g)%rule == 0) cycle
      do key = 1, size(groups(g)%values)
        rule = key_rules(first_key(groups(g)%rule) + key - 1)
        if (rule%value_type /= a_body .and. rule%value_type /= body_or_ground) cycle
        if (.not. allocated(groups(g)%values(key)%texts)) cycle
        associate (value => groups(g)%values(key))
          do i = 1, size(value%texts)
            if (value%texts(i)%text == ground) cycle
            if (sorted_position(value%texts(i)%text, bodies, order) > 0) cycle
            missing = missing + 1
            hint = ''
            if (missing <= most_suggestions) hint = suggestion(value%texts(i)%text, bodies)
            call diagnostics%add(value%line, g, trim(rule%name) // ': there is no &body ' // &
                                 quoted(shortened(value%texts(i)%text)) // hint, value%override)
          end do
        end associate
      end do
    end do
  end subroutine check_references

end module nocdyn_name_checks
