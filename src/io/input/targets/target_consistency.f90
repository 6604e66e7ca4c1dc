!> Several numbers that vary together: each once, none beside an alternative of its key, none without the keys that it needs.
module nocdyn_target_consistency
  use nocdyn_input, only: input_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_schema_relations, only: relations_of, relations_t
  use nocdyn_schema_text, only: listed
  use nocdyn_targets, only: find_target, target_t
  use nocdyn_text, only: append, string_t, to_text
  implicit none (type, external)
  private

  public :: find_targets, target_at, check_consistency

contains

  !> The targets of several paths, and what is wrong with each of them.
  subroutine find_targets(input, paths, targets, messages)
    type(input_t), intent(in) :: input
    type(string_t), intent(in) :: paths(:)
    type(target_t), allocatable, intent(out) :: targets(:)        !! [paths]; those with a complaint are of no use
    type(string_t), allocatable, intent(out) :: messages(:)     !! [paths], '' if fine
    integer :: earlier, i

    allocate (targets(size(paths)), messages(size(paths)))
    do i = 1, size(paths)
      call find_target(input, paths(i)%text, targets(i), messages(i)%text)
    end do
    do i = 1, size(paths)
      if (targets(i)%group == 0) cycle
      call check_consistency(input, targets, i, messages(i)%text)
      earlier = same_target(targets(:i - 1), targets(i))
      if (earlier > 0) messages(i)%text = 'varies already, as number ' // to_text(earlier) // '; allowed: once'
    end do
  end subroutine find_targets

  !> Which of several targets a path leads to, 0 if none.
  integer function target_at(input, targets, path)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    character(len=*), intent(in) :: path
    type(target_t) :: target
    character(len=:), allocatable :: message

    call find_target(input, path, target, message)
    target_at = 0
    if (message == '') target_at = same_target(targets, target)
  end function target_at

  !> The first of the targets that is the same number as `target`, 0 if none is.
  pure integer function same_target(targets, target) result(same)
    type(target_t), intent(in) :: targets(:), target

    do same = 1, size(targets)
      if (targets(same)%group == target%group .and. targets(same)%key == target%key .and. &
          targets(same)%position == target%position) return
    end do
    same = 0
  end function same_target

  !> Whether no alternative of a target's key is given, and one of the keys that it needs is.
  subroutine check_consistency(input, targets, which, message)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)   !! all that vary; those with group 0 were not found
    integer, intent(in) :: which               !! the target to check, which was found
    character(len=:), allocatable, intent(out) :: message   !! '' if fine
    type(relations_t) :: relations
    logical, allocatable :: is_given(:)   !! [keys of the group]
    integer :: i

    message = ''
    call find_given(input, targets, targets(which)%group, is_given)
    relations = relations_of(input%groups(targets(which)%group)%rule)
    associate (key => targets(which)%key, first => first_key(input%groups(targets(which)%group)%rule) - 1)
      do i = 1, size(relations%alternatives)
        associate (sets => relations%alternatives(i))
          if (any(sets%first == key)) call refuse_beside(first, key, pack(sets%second, is_given(sets%second)), message)
          if (any(sets%second == key)) call refuse_beside(first, key, pack(sets%first, is_given(sets%first)), message)
        end associate
      end do
      do i = 1, size(relations%needs)
        associate (need => relations%needs(i))
          if (all(need%first /= key) .or. any(is_given(need%second)) .or. message /= '') cycle
          message = trim(key_rules(first + key)%name) // ' needs ' // names_of(first, need%second)
        end associate
      end do
    end associate
  end subroutine check_consistency

  subroutine find_given(input, targets, group, is_given)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    integer, intent(in) :: group
    logical, allocatable, intent(out) :: is_given(:)
    integer :: t

    allocate (is_given(size(input%groups(group)%values)))
    is_given = input%groups(group)%values%is_given
    do t = 1, size(targets)
      if (targets(t)%group == group) is_given(targets(t)%key) = .true.
    end do
  end subroutine find_given

  subroutine refuse_beside(first, key, others, message)
    integer, intent(in) :: first       !! row of `key_rules` before the group's
    integer, intent(in) :: key
    integer, intent(in) :: others(:)   !! keys of the other alternative that are given
    character(len=:), allocatable, intent(inout) :: message

    if (size(others) == 0 .or. message /= '') return
    message = trim(key_rules(first + key)%name) // ' and ' // trim(key_rules(first + others(1))%name) // &
                ' are both given; allowed: one of them'
  end subroutine refuse_beside

  !> "a, b or c".
  pure function names_of(first, keys) result(text)
    integer, intent(in) :: first, keys(:)
    character(len=:), allocatable :: text
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, size(keys)
      call append(names, trim(key_rules(first + keys(i))%name))
    end do
    text = listed(names, ' or ')
  end function names_of

end module nocdyn_target_consistency
