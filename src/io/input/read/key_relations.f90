!> The relations between the keys of a group: which keys its kind has, which exclude or require each other. An override replaces
!> keys of the file that contradict it; two contradicting keys of the same source are an error.
module nocdyn_key_relations
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_ok, read_real
  use nocdyn_raw_group, only: raw_group_t, raw_key_t
  use nocdyn_schema, only: has_word, key_rules, words_of
  use nocdyn_schema_relations, only: relation_t, relations_t
  use nocdyn_schema_rules, only: any_number, at_most_one, columns, equal_lengths, exactly_one, required, requires, unset
  use nocdyn_schema_text, only: listed_keys, only_if_text
  use nocdyn_text, only: append, joined, lower_case, quoted, string_t
  implicit none (type, external)
  private

  public :: apply_relations

contains

  !> Reports contradicting keys, and excludes the keys that have no value in this group.
  subroutine apply_relations(group, relations, diagnostics)
    type(raw_group_t), intent(inout) :: group
    type(relations_t), intent(in) :: relations
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i, k

    if (relations%selector > 0) call apply_selector(group, relations%selector, diagnostics)
    do i = 1, size(relations%list)
      associate (relation => relations%list(i))
        select case (relation%form)
        case (exactly_one, at_most_one)
          call choose(group, relation, relations, diagnostics)
        case (requires)
          call check_requirement(group, relation, diagnostics)
        case (equal_lengths, columns)
          if (.not. allocated(group%keys(relation%first(1))%values)) cycle
          do k = 2, size(relation%first)   ! a list with its default becomes as long as the first one
            associate (key => group%keys(relation%first(k)))
              if (key%is_given() .or. key_rules(key%rule)%default == unset .or. key_rules(key%rule)%count /= any_number) cycle
              key%length = size(group%keys(relation%first(1))%values)
            end associate
          end do
        case default   ! of values, which are checked after their conversion
        end select
      end associate
    end do
  end subroutine apply_relations

  !> Excludes the keys that the selected kind does not have.
  subroutine apply_selector(group, selector, diagnostics)
    type(raw_group_t), intent(inout) :: group
    integer, intent(in) :: selector   !! position of the selector key
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: words(:)
    logical :: is_known
    integer :: i

    call find_words(group%keys(selector), words, is_known)
    do i = 1, size(group%keys)
      associate (key => group%keys(i), rule => key_rules(group%keys(i)%rule))
        if (rule%only_if /= '') then
          if (.not. is_known) then
            key%may_be_missing = .true.
          else if (.not. has_any_word(rule%only_if, words)) then
            if (key%is_given()) call refuse_foreign_key(group, i, selector, words, diagnostics)
            call key%exclude()
          end if
        end if
        key%is_required = key%is_required .or. has_any_word(rule%required_if, words)
      end associate
    end do
  end subroutine apply_selector

  !> The words of the selector key. Words that the schema does not have are reported when the key is converted.
  subroutine find_words(key, words, is_known)
    type(raw_key_t), intent(in) :: key
    type(string_t), allocatable, intent(out) :: words(:)   !! in lower case; empty if none is given, nor a default
    logical, intent(out) :: is_known                       !! the schema has all of them
    type(string_t), allocatable :: allowed(:)
    integer :: i, j

    allocate (words(0))
    is_known = .not. key%is_malformed
    if (.not. is_known) return
    associate (rule => key_rules(key%rule))
      if (.not. key%is_given()) then
        is_known = rule%default /= required
        if (rule%default(1:1) == "'") call append(words, rule%default(2:len_trim(rule%default) - 1))
        return
      end if
      allocate (allowed, source=words_of(rule))
    end associate
    do i = 1, size(key%values)
      if (.not. allocated(key%values(i)%text)) cycle
      call append(words, lower_case(key%values(i)%text))
      is_known = is_known .and. any([(allowed(j)%text == words(size(words))%text, j=1, size(allowed))])
    end do
  end subroutine find_words

  !> Whether a list has one of some words.
  pure logical function has_any_word(list, words)
    character(len=*), intent(in) :: list   !! separated by blanks
    type(string_t), intent(in) :: words(:)
    integer :: i

    has_any_word = any([(has_word(list, words(i)%text), i=1, size(words))])
  end function has_any_word

  !> If the selector has its default, the user probably forgot it: then the keys of the default kind are not reported as missing.
  subroutine refuse_foreign_key(group, position, selector, words, diagnostics)
    type(raw_group_t), intent(inout) :: group
    integer, intent(in) :: position, selector   !! positions of the key and of the selector key
    type(string_t), intent(in) :: words(:)      !! of the selector key
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: selector_name, text
    integer :: i

    if (group%keys(selector)%override > 0 .and. group%keys(position)%override == 0) return
    selector_name = group%keys(selector)%name()
    text = group%keys(position)%name() // ' belongs to ' // selector_name // ' = ' // &
           only_if_text(key_rules(group%keys(position)%rule)) // '; here '
    if (size(words) == 0) then
      text = text // 'is no ' // selector_name
    else
      text = text // selector_name // ' = ' // joined(words, ', ')
    end if
    if (size(words) > 0 .and. .not. group%keys(selector)%is_given()) then
      text = text // ', the default'
      do i = 1, size(group%keys)
        associate (rule => key_rules(group%keys(i)%rule))
          if (has_any_word(rule%only_if, words) .or. has_any_word(rule%required_if, words)) group%keys(i)%may_be_missing = .true.
        end associate
      end do
    end if
    call group%report([position], text, diagnostics)
  end subroutine refuse_foreign_key

  !> Keeps one of two sets of keys.
  subroutine choose(group, relation, relations, diagnostics)
    type(raw_group_t), intent(inout) :: group
    type(relation_t), intent(in) :: relation   !! `exactly_one` or `at_most_one`
    type(relations_t), intent(in) :: relations
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: one, other

    one = group%first_given(relation%first)
    other = group%first_given(relation%second)
    if (one > 0 .and. other > 0) then
      if ((group%keys(one)%override > 0) .eqv. (group%keys(other)%override > 0)) then   ! no override decides between them
        call group%report([one, other], group%written_names([one, other], ' and ') // &
                          ' are both given; allowed: one of them', diagnostics)
        group%keys([relation%first, relation%second])%may_be_missing = .true.   ! which are needed is not known
      end if
      if (group%keys(other)%override > 0 .and. group%keys(one)%override == 0) one = 0
    end if
    if (one > 0) then
      call supersede(group, relation%second)
    else if (other > 0) then
      call supersede(group, relation%first)
    else if (relation%form == exactly_one) then
      if (any(group%keys([relation%first, relation%second])%may_be_missing)) return
      if (any(group%keys([relation%first, relation%second])%is_excluded)) return
      call group%report([integer ::], listed_keys(group%rule, [alternatives(relations, relation%first), &
                                                               alternatives(relations, relation%second)], ' or ') // &
                        ' is missing; one of them is needed', diagnostics)
      group%keys([relation%first, relation%second])%may_be_missing = .true.   ! it is reported
    end if
  end subroutine choose

  !> The keys of a set that exclude each other; of a set that belongs together the first one.
  pure function alternatives(relations, keys)
    type(relations_t), intent(in) :: relations
    integer, intent(in) :: keys(:)   !! positions
    integer, allocatable :: alternatives(:)
    integer :: i

    alternatives = keys(:1)
    if (size(keys) == 1) return
    do i = 1, size(relations%list)
      associate (relation => relations%list(i))
        if (relation%form /= at_most_one) cycle
        if (relation%first(1) == keys(1) .and. relation%second(1) == keys(2)) alternatives = keys
      end associate
    end do
  end function alternatives

  !> Excludes keys because another set is given.
  subroutine supersede(group, positions)
    type(raw_group_t), intent(inout) :: group
    integer, intent(in) :: positions(:)   !! of the keys
    integer :: i

    do i = 1, size(positions)
      associate (key => group%keys(positions(i)))
        key%is_superseded = key%is_superseded .or. key%is_given()
        call key%exclude()
      end associate
    end do
  end subroutine supersede

  !> Each key of the first set that is given requires one of the second set, or its word.
  subroutine check_requirement(group, relation, diagnostics)
    type(raw_group_t), intent(inout) :: group
    type(relation_t), intent(in) :: relation   !! `requires`
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: words(:)
    character(len=:), allocatable :: needed   ! "fault", "fault = 'resynchronisation'", "a or b"
    logical :: has_needed, is_known, is_reported
    integer :: i, j

    associate (keys => relation%first, others => relation%second)
      is_reported = .false.
      is_known = .true.
      if (relation%word == '') then
        if (group%first_given(others) > 0) return
        has_needed = any([(group%keys(others(j))%has_value(), j=1, size(others))])
      else
        call find_words(group%keys(others(1)), words, is_known)
        has_needed = has_any_word(relation%word, words)
        if (has_needed) return
      end if
      do i = 1, size(keys)
        associate (key => group%keys(keys(i)))
          if (.not. key%is_given()) then
            if (.not. has_needed) call key%exclude()
          else if (any(group%keys(others)%is_superseded) .and. key%override == 0) then
            call supersede(group, keys(i:i))
          else if (key%override == 0 .and. relation%word /= '' .and. any(group%keys(others)%override > 0)) then
            call supersede(group, keys(i:i))   ! as the keys of another kind
          else if (is_known .and. .not. any(group%keys(others)%may_be_missing)) then
            if (is_zero(key)) cycle
            needed = listed_keys(group%rule, others, ' or ')
            if (relation%word /= '') needed = needed // ' = ' // quoted(trim(relation%word))
            call group%report(keys(i:i), key%name() // ' needs ' // needed, diagnostics)
            is_reported = .true.
          end if
        end associate
      end do
      if (is_reported) group%keys(others)%may_be_missing = .true.
    end associate
  end subroutine check_requirement

  !> Whether the key has one value, the number 0.
  logical function is_zero(key)
    type(raw_key_t), intent(in) :: key
    real(wp) :: value
    integer :: status

    is_zero = .false.
    if (key%is_malformed .or. key%count_given() /= 1) return
    if (size(key%values) /= 1) return
    call read_real(key%values(1)%text, value, status)
    is_zero = status == literal_ok .and. abs(value) <= 0.0_wp
  end function is_zero

end module nocdyn_key_relations
