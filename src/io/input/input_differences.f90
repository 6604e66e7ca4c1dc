!> The differences between two inputs as sentences. Both inputs are texts of `input_text`, in which every key has its value.
!>
!> The directory of the results is ignored. The title is compared, because the files of a sweep contain it. The order of named
!> groups is compared too: sums are formed in it, and their last bits depend on it.
module nocdyn_input_differences
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_namelist, only: assignment_t, namelist_t
  use nocdyn_namelist_scanner, only: scan_namelist
  use nocdyn_schema, only: group_rule_index, group_rules, is_single
  use nocdyn_text, only: append, quoted, string_t, to_text
  use nocdyn_text_sort, only: argsort, sorted_position
  implicit none (type, external)
  private

  public :: find_differences

  integer, parameter :: longest_shown = 5   !! values of a list in a sentence

  !> An input taken apart.
  type :: parts_t
    logical :: is_readable = .true.            !! else the text is none of `input_text`, and there are no parts
    type(namelist_t) :: namelist
    type(string_t), allocatable :: labels(:)   !! of the groups: "&load 'work'", "&run", "&vary 2"
    integer, allocatable :: order(:)           !! of the labels, sorted
    integer, allocatable :: name_space(:)      !! first row of `group_rules` with the same name space, 0: groups without names
  end type parts_t

contains

  !> One sentence for each difference, in the order of the old input; none if both describe the same computation.
  subroutine find_differences(old, new, sentences)
    character(len=*), intent(in) :: old, new   !! texts of `input_text`; what others have changed differs, in one sentence
    type(string_t), allocatable, intent(out) :: sentences(:)
    type(parts_t) :: before, after
    integer, allocatable :: partner(:)   ! in the new input, 0: none
    integer :: g
    integer :: last(size(group_rules))   ! old group seen last in each name space

    allocate (sentences(0))
    call take_apart(old, before)
    call take_apart(new, after)
    if (.not. (before%is_readable .and. after%is_readable)) then
      call append(sentences, 'it is not as this program has written it')
      return
    end if
    allocate (partner(before%namelist%group_count))
    do g = 1, size(partner)
      partner(g) = sorted_position(before%labels(g)%text, after%labels, after%order)
      if (partner(g) > 0) then
        call compare_groups(before, g, after, partner(g), sentences)
      else
        call append(sentences, 'the new input has no ' // before%labels(g)%text)
      end if
    end do
    do g = 1, after%namelist%group_count
      if (any(partner == g)) cycle
      call append(sentences, 'the new input has ' // after%labels(g)%text)
    end do
    ! compares the order of the groups of each name space
    last = 0
    do g = 1, size(partner)
      if (partner(g) == 0 .or. before%name_space(g) == 0) cycle
      associate (earlier => last(before%name_space(g)))
        if (earlier > 0) then
          if (partner(earlier) > partner(g)) call append(sentences, before%labels(g)%text // ' was after ' // &
                                                         before%labels(earlier)%text // ', is before it')
        end if
        earlier = g
      end associate
    end do
  end subroutine find_differences

  !> Scans an input and labels its groups.
  subroutine take_apart(text, parts)
    character(len=*), intent(in) :: text
    type(parts_t), intent(out) :: parts
    type(diagnostics_t) :: diagnostics
    character(len=:), allocatable :: label   ! the same in both inputs
    integer :: count(size(group_rules))
    integer :: g, name, rule

    call scan_namelist(text, parts%namelist, diagnostics)
    parts%is_readable = diagnostics%count == 0
    if (.not. parts%is_readable) return
    allocate (parts%labels(parts%namelist%group_count), parts%name_space(parts%namelist%group_count))
    count = 0
    do g = 1, parts%namelist%group_count
      rule = group_rule_index(parts%namelist%groups(g)%name)
      parts%is_readable = rule > 0
      if (.not. parts%is_readable) return
      count(rule) = count(rule) + 1
      label = '&' // trim(group_rules(rule)%name)
      parts%name_space(g) = 0
      if (group_rules(rule)%name_space /= '') then
        name = find_assignment(parts%namelist, g, 'name')
        parts%is_readable = name > 0
        if (name > 0) parts%is_readable = parts%namelist%assignments(name)%last_item >= &
                                          parts%namelist%assignments(name)%first_item
        if (.not. parts%is_readable) return
        associate (item => parts%namelist%items(parts%namelist%assignments(name)%first_item))
          label = label // ' ' // quoted(parts%namelist%item_text(item))
        end associate
        parts%name_space(g) = findloc(group_rules%name_space == group_rules(rule)%name_space, .true., dim=1)
      else if (.not. is_single(rule)) then
        label = label // ' ' // to_text(count(rule))
      end if
      parts%labels(g)%text = label
    end do
    call argsort(parts%labels, parts%order)
  end subroutine take_apart

  !> The assignment to a key of a group, 0 if there is none.
  pure integer function find_assignment(namelist, g, key) result(a)
    type(namelist_t), intent(in) :: namelist
    integer, intent(in) :: g   !! index of the group
    character(len=*), intent(in) :: key

    do a = namelist%groups(g)%first_assignment, namelist%groups(g)%last_assignment
      if (namelist%assignments(a)%key == key) return
    end do
    a = 0
  end function find_assignment

  !> Compares two groups: keys that only one of them has, and keys with different values.
  subroutine compare_groups(before, old, after, new, sentences)
    type(parts_t), intent(in) :: before, after
    integer, intent(in) :: old, new   !! the groups
    type(string_t), allocatable, intent(inout) :: sentences(:)
    character(len=:), allocatable :: start   ! of the sentences
    integer :: a, other

    start = before%labels(old)%text // ': '
    associate (left => before%namelist, right => after%namelist)
      do a = left%groups(old)%first_assignment, left%groups(old)%last_assignment
        if (before%labels(old)%text == '&output' .and. left%assignments(a)%key == 'directory') cycle
        other = find_assignment(right, new, left%assignments(a)%key)
        if (other == 0) then
          call append(sentences, start // left%assignments(a)%key // ' was ' // values_of(left, left%assignments(a)) // &
                      ', is not there')
        else
          call compare_values(start // left%assignments(a)%key, left, left%assignments(a), right, right%assignments(other), &
                              sentences)
        end if
      end do
      do a = right%groups(new)%first_assignment, right%groups(new)%last_assignment
        if (find_assignment(left, old, right%assignments(a)%key) > 0) cycle
        call append(sentences, start // right%assignments(a)%key // ' was not there, is ' // &
                    values_of(right, right%assignments(a)))
      end do
    end associate
  end subroutine compare_groups

  !> Compares the values of a key: of lists of equal length the first difference, of others their values or lengths.
  subroutine compare_values(start, left, old, right, new, sentences)
    character(len=*), intent(in) :: start   !! of the sentence: group and key
    type(namelist_t), intent(in) :: left, right
    type(assignment_t), intent(in) :: old, new
    type(string_t), allocatable, intent(inout) :: sentences(:)
    character(len=:), allocatable :: index_text, new_value, old_value
    integer :: count, i

    count = old%last_item - old%first_item + 1
    if (count /= new%last_item - new%first_item + 1) then
      call append(sentences, start // ' was ' // values_of(left, old) // ', is ' // values_of(right, new))
      return
    end if
    do i = 1, count
      old_value = left%as_written(left%items(old%first_item + i - 1))
      new_value = right%as_written(right%items(new%first_item + i - 1))
      if (old_value == new_value) cycle
      index_text = ''
      if (count > 1) index_text = '(' // to_text(i) // ')'
      call append(sentences, start // index_text // ' was ' // old_value // ', is ' // new_value)
      return
    end do
  end subroutine compare_values

  !> The values of a key as they are written; of long lists only their number.
  pure function values_of(namelist, assignment) result(text)
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    character(len=:), allocatable :: text
    integer :: i

    if (assignment%last_item - assignment%first_item >= longest_shown) then
      text = to_text(assignment%last_item - assignment%first_item + 1) // ' values'
      return
    end if
    text = ''
    do i = assignment%first_item, assignment%last_item
      if (i > assignment%first_item) text = text // ', '
      text = text // namelist%as_written(namelist%items(i))
    end do
  end function values_of

end module nocdyn_input_differences
