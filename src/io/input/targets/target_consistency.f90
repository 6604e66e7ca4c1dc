!> Numbers that vary together: each once, none beside a key that excludes its own, none without the keys that it requires.
module nocdyn_target_consistency
  use nocdyn_input, only: input_t
  use nocdyn_schema, only: key_name
  use nocdyn_schema_relations, only: relations_of, relations_t
  use nocdyn_schema_rules, only: at_most_one, exactly_one, requires
  use nocdyn_schema_text, only: listed_keys
  use nocdyn_targets, only: find_target, target_t
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: find_targets, target_at, check_consistency

contains

  !> Finds the targets of several paths and checks that they are consistent.
  subroutine find_targets(input, paths, numbers, targets, messages)
    type(input_t), intent(in) :: input
    type(string_t), intent(in) :: paths(:)
    integer, intent(in) :: numbers(:)                             !! of the paths in messages, [paths]
    type(target_t), allocatable, intent(out) :: targets(:)        !! [paths]; those with a message are not valid
    type(string_t), allocatable, intent(out) :: messages(:)       !! [paths], '' if nothing is wrong
    integer :: earlier, i

    allocate (targets(size(paths)), messages(size(paths)))
    do i = 1, size(paths)
      call find_target(input, paths(i)%text, targets(i), messages(i)%text)
    end do
    do i = 1, size(paths)
      if (targets(i)%group == 0) cycle
      call check_consistency(input, targets, i, messages(i)%text)
      earlier = same_target(targets(:i - 1), targets(i))
      if (earlier > 0) messages(i)%text = 'varies already, as number ' // to_text(numbers(earlier)) // &
                                                '; allowed: once'
    end do
  end subroutine find_targets

  !> Index of the target with a path, 0 if there is none.
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

  !> Index of the first of the targets that is the same number as `target`, 0 if there is none.
  pure integer function same_target(targets, target) result(same)
    type(target_t), intent(in) :: targets(:), target

    do same = 1, size(targets)
      if (targets(same)%group == target%group .and. targets(same)%key == target%key .and. &
          targets(same)%position == target%position) return
    end do
    same = 0
  end function same_target

  !> Whether no key that excludes the key of a target is given, and one of the keys that it requires is.
  subroutine check_consistency(input, targets, which, message)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)   !! all that vary; those with group 0 were not found
    integer, intent(in) :: which               !! index of the target to check, which was found
    character(len=:), allocatable, intent(out) :: message   !! '' if nothing is wrong
    type(relations_t) :: relations
    logical, allocatable :: is_given(:)   ! by the input or a target, [keys of the group]
    integer :: i

    message = ''
    allocate (is_given(size(input%groups(targets(which)%group)%values)))
    is_given(:) = input%groups(targets(which)%group)%values%is_given
    do i = 1, size(targets)
      if (targets(i)%group == targets(which)%group) is_given(targets(i)%key) = .true.
    end do
    associate (rule => input%groups(targets(which)%group)%rule, key => targets(which)%key)
      relations = relations_of(rule)
      do i = 1, size(relations%list)
        associate (relation => relations%list(i))
          select case (relation%form)
          case (exactly_one, at_most_one)
            if (any(relation%first == key)) call refuse_beside(pack(relation%second, is_given(relation%second)))
            if (any(relation%second == key)) call refuse_beside(pack(relation%first, is_given(relation%first)))
          case (requires)
            if (all(relation%first /= key) .or. any(is_given(relation%second)) .or. message /= '') cycle
            message = key_name(rule, key) // ' needs ' // listed_keys(rule, relation%second, ' or ')
          case default   ! of values, not of keys
          end select
        end associate
      end do
    end associate
  contains
    subroutine refuse_beside(others)
      integer, intent(in) :: others(:)   !! keys of the other set that are given

      if (size(others) == 0 .or. message /= '') return
      associate (group => input%groups(targets(which)%group))
        message = listed_keys(group%rule, [targets(which)%key, others(1)], ' and ') // ' are both given; allowed: one of them'
      end associate
    end subroutine refuse_beside
  end subroutine check_consistency

end module nocdyn_target_consistency
