!> How the keys of a group go together, as positions of keys: found once for all groups of one name.
module nocdyn_schema_relations
  use nocdyn_schema, only: alternatives, columns, first_key, group_rules, key_rule_index, kind_rule_index, needs, words_in
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: relations_of

  !> Two sets of keys. Positions count the keys of a group in the order of the schema.
  type, public :: key_sets_t
    integer, allocatable :: first(:), second(:)
    logical :: is_needed = .false.
  end type key_sets_t

  type, public :: relations_t
    integer :: kind = 0                                !! position of the key of the kind `a_kind`, 0 if there is none
    type(key_sets_t), allocatable :: alternatives(:)   !! one of two sets
    type(key_sets_t), allocatable :: needs(:)          !! keys, and what each of them needs one of
    type(key_sets_t), allocatable :: columns(:)        !! lists, and the key of the file that may hold them, if any
  end type relations_t

contains

  !> The relations between keys of one group, by the places of the keys in it.
  pure function relations_of(group_rule) result(relations)
    integer, intent(in) :: group_rule
    type(relations_t) :: relations
    integer :: i, n

    relations%kind = max(0, kind_rule_index(group_rule) - first_key(group_rule) + 1)

    allocate (relations%alternatives(count(alternatives%group == group_rules(group_rule)%name)))
    n = 0
    do i = 1, size(alternatives)
      if (alternatives(i)%group /= group_rules(group_rule)%name) cycle
      n = n + 1
      relations%alternatives(n) = key_sets(group_rule, alternatives(i)%first, alternatives(i)%second)
      relations%alternatives(n)%is_needed = alternatives(i)%is_needed
    end do

    allocate (relations%needs(count(needs%group == group_rules(group_rule)%name)))
    n = 0
    do i = 1, size(needs)
      if (needs(i)%group /= group_rules(group_rule)%name) cycle
      n = n + 1
      relations%needs(n) = key_sets(group_rule, needs(i)%keys, needs(i)%needed)
    end do

    allocate (relations%columns(count(columns%group == group_rules(group_rule)%name)))
    n = 0
    do i = 1, size(columns)
      if (columns(i)%group /= group_rules(group_rule)%name) cycle
      n = n + 1
      relations%columns(n) = key_sets(group_rule, columns(i)%keys, columns(i)%file)
    end do
  end function relations_of

  pure type(key_sets_t) function key_sets(group_rule, first, second)
    integer, intent(in) :: group_rule
    character(len=*), intent(in) :: first, second   !! keys separated by blanks

    allocate (key_sets%first, source=positions(group_rule, first))
    allocate (key_sets%second, source=positions(group_rule, second))
  end function key_sets

  pure function positions(group_rule, keys)
    integer, intent(in) :: group_rule
    character(len=*), intent(in) :: keys
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
