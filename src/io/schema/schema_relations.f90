!> The relations between the keys of one group as positions of keys, found once for all groups of a kind.
module nocdyn_schema_relations
  use nocdyn_schema, only: first_key, group_rules, key_rule_index, relation_rules, selector_rule, words_in
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: relations_of

  !> One relation. Positions count the keys of a group in the order of the schema.
  type, public :: relation_t
    integer :: form = 0                       !! `exactly_one` ... `less_than` of nocdyn_schema_rules
    integer, allocatable :: first(:), second(:)
    integer :: equal_if_one = 0               !! position of that key, 0: none
    character(len=18) :: word = ''            !! `requires`: the word of `second` that is needed, '': any value
  end type relation_t

  type, public :: relations_t
    integer :: selector = 0                   !! position of the selector key, 0: none
    type(relation_t), allocatable :: list(:)
  end type relations_t

contains

  !> The relations between the keys of a group.
  pure function relations_of(group_rule) result(relations)
    integer, intent(in) :: group_rule   !! row of `group_rules`
    type(relations_t) :: relations
    integer :: i, n

    relations%selector = max(0, selector_rule(group_rule) - first_key(group_rule) + 1)
    allocate (relations%list(count(relation_rules%group == group_rules(group_rule)%name)))
    n = 0
    do i = 1, size(relation_rules)
      if (relation_rules(i)%group /= group_rules(group_rule)%name) cycle
      n = n + 1
      relations%list(n)%form = relation_rules(i)%form
      allocate (relations%list(n)%first, source=positions(group_rule, relation_rules(i)%first))
      allocate (relations%list(n)%second, source=positions(group_rule, relation_rules(i)%second))
      relations%list(n)%word = relation_rules(i)%word
      relations%list(n)%equal_if_one = sum(positions(group_rule, relation_rules(i)%equal_if_one))
    end do
  end function relations_of

  !> Positions of keys in their group.
  pure function positions(group_rule, keys)
    integer, intent(in) :: group_rule   !! row of `group_rules`
    character(len=*), intent(in) :: keys   !! separated by blanks
    integer, allocatable :: positions(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names, source=words_in(keys))
    allocate (positions(size(names)))
    do i = 1, size(names)
      positions(i) = key_rule_index(group_rule, names(i)%text) - first_key(group_rule) + 1
    end do
  end function positions

end module nocdyn_schema_relations
