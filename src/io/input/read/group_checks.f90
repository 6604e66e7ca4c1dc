!> Checks of one group that need several of its values: lists of equal length, ascending lists, numbers that are less than others,
!> different bodies.
module nocdyn_group_checks
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_input, only: group_t
  use nocdyn_raw_group, only: raw_group_t
  use nocdyn_schema, only: first_key, key_name, key_rules
  use nocdyn_schema_relations, only: relation_t, relations_t
  use nocdyn_schema_rules, only: a_body, body_or_ground, columns, equal_lengths, less_than, records, unset
  use nocdyn_schema_text, only: number_text
  use nocdyn_schema_units, only: name_in_unit
  use nocdyn_text, only: counted, quoted, string_t, to_text
  use nocdyn_text_sort, only: argsort
  implicit none (type, external)
  private

  public :: check_group, ascending_message, less_than_message

contains

  !> Reports what is wrong between the values of a group.
  subroutine check_group(raw, relations, group, diagnostics)
    type(raw_group_t), intent(in) :: raw   !! the same group before its conversion
    type(relations_t), intent(in) :: relations
    type(group_t), intent(in) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    integer :: i, k

    do i = 1, size(group%values)
      if (.not. key_rules(raw%keys(i)%rule)%ascends) cycle
      do k = 2, group%values(i)%count()
        message = ascending_message(group, i, k, raw%keys(i)%unit)
        if (message /= '') call diagnostics%add(max(group%values(i)%line, raw%keys(i)%values(k)%line), raw%index, message, &
                                                group%values(i)%override)
      end do
    end do
    do i = 1, size(relations%list)
      associate (relation => relations%list(i))
        select case (relation%form)
        case (equal_lengths)
          call check_lengths(raw, group, relation%first, diagnostics)
        case (records)
          do k = 1, size(relation%first)
            if (.not. group%values(relation%first(k))%has_any()) cycle
            call check_lengths(raw, group, [relation%first(k), relation%first(size(relation%first))], diagnostics)
          end do
        case (columns)
          call check_lengths(raw, group, relation%first, diagnostics)
          do k = 2, size(relation%second)
            if (group%values(relation%second(k))%has_any()) then
              call check_lengths(raw, group, [relation%first(1), relation%second(k)], diagnostics)
            end if
          end do
        case (less_than)
          message = less_than_message(group, relation)
          if (message /= '') call raw%report([relation%first, relation%second], message, diagnostics)
        case default   ! of keys, not of values
        end select
      end associate
    end do
    call check_different_bodies(raw, group, diagnostics)
  end subroutine check_group

  !> What is wrong with value `i` of an ascending list if it is not greater than the one before it, else ''.
  function ascending_message(group, position, i, unit) result(message)
    type(group_t), intent(in) :: group
    integer, intent(in) :: position   !! of the key
    integer, intent(in) :: i          !! 2 to the length of the list
    integer, intent(in) :: unit       !! of the message: index of `units`, 0: the one of the schema
    character(len=:), allocatable :: message

    message = ''
    if (group%values(position)%number_at(i) > group%values(position)%number_at(i - 1)) return
    message = element(i) // ' must be greater than ' // element(i - 1)
  contains
    function element(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text

      text = name_in_unit(key_rules(first_key(group%rule) + position - 1), unit) // '(' // to_text(i) // ') = ' // &
             number_text(group%values(position)%number_at(i), unit)
    end function element
  end function ascending_message

  !> What is wrong with two numbers of which one must be less than the other, '' if nothing is.
  function less_than_message(group, relation) result(message)
    type(group_t), intent(in) :: group
    type(relation_t), intent(in) :: relation   !! `less_than`
    character(len=:), allocatable :: message
    character(len=:), allocatable :: comparison

    message = ''
    associate (low => group%values(relation%first(1)), high => group%values(relation%second(1)))
      if (.not. (allocated(low%numbers) .and. allocated(high%numbers))) return
      if (high%numbers(1) > low%numbers(1)) return
      comparison = '> '
      if (relation%equal_if_one > 0) then
        if (high%numbers(1) >= low%numbers(1)) return   ! the design of the sweep decides whether they may be equal
        if (sum(group%whole_numbers(key_name(group%rule, relation%equal_if_one))) == 1) comparison = '>= '
      end if
      message = key_name(group%rule, relation%second(1)) // ' = ' // to_text(high%numbers(1)) // ' is out of range; ' // &
                'allowed: ' // comparison // key_name(group%rule, relation%first(1)) // ' = ' // to_text(low%numbers(1))
    end associate
  end function less_than_message

  !> Every list has as many values as the first one that is given.
  subroutine check_lengths(raw, group, lists, diagnostics)
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(in) :: group
    integer, intent(in) :: lists(:)   !! positions of the keys
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: first, i

    do first = 1, size(lists)
      if (group%values(lists(first))%has_any()) exit
    end do
    if (first > size(lists)) return
    associate (first_key => raw%keys(lists(first)), first_value => group%values(lists(first)))
      do i = 1, size(lists)
        associate (key => raw%keys(lists(i)), value => group%values(lists(i)))
          if (value%has_any()) then
            if (value%count() == first_value%count()) cycle
            call raw%report(lists([first, i]), key%name() // ' has ' // counted(value%count(), 'value', 'values') // ' and ' // &
                            first_key%name() // ' has ' // counted(first_value%count(), 'value', 'values') // &
                            '; needed: as many of each', diagnostics)
          else if (key_rules(key%rule)%default == unset .and. &
                   .not. (key%may_be_missing .or. key%is_excluded .or. key%is_given())) then
            call raw%report(lists([first]), key%name() // ' is missing; needed: ' // &
                            counted(first_value%count(), 'value', 'values') // ', one for each of ' // &
                            first_key%name(), diagnostics)
          end if
        end associate
      end do
    end associate
  end subroutine check_lengths

  !> No body, nor the ground, occurs twice among the values of a group.
  subroutine check_different_bodies(raw, group, diagnostics)
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(in) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: names(:)
    integer, allocatable :: order(:), owner(:)   ! owner: position of the key of each name
    character(len=:), allocatable :: text
    integer :: counts(size(group%values))   ! of the bodies of each key
    integer :: i, key, last, next

    counts = 0
    do key = 1, size(counts)
      associate (rule => key_rules(raw%keys(key)%rule))
        if (any(rule%value_type == [a_body, body_or_ground]) .and. .not. rule%may_repeat) counts(key) = group%values(key)%count()
      end associate
    end do
    allocate (names(sum(counts)), owner(sum(counts)))
    owner(:) = [((key, i=1, counts(key)), key=1, size(counts))]
    do i = 1, size(owner)
      names(i)%text = group%values(owner(i))%texts(i - sum(counts(:owner(i) - 1)))%text
    end do
    if (size(names) < 2) return
    call argsort(names, order)
    do i = 2, size(order)
      last = order(i - 1)
      next = order(i)
      if (names(next)%text /= names(last)%text) cycle
      if (owner(last) == owner(next)) then
        text = raw%keys(owner(next))%name() // ' has ' // quoted(names(next)%text) // ' twice; allowed: different bodies'
      else
        text = raw%keys(owner(next))%name() // ' is ' // quoted(names(next)%text) // ', as is ' // &
               raw%keys(owner(last))%name() // '; allowed: different members'
      end if
      call raw%report(owner([last, next]), text, diagnostics)
    end do
  end subroutine check_different_bodies

end module nocdyn_group_checks
