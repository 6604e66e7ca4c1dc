!> Which keys of a group may stand together: those of its kind, one set of alternatives, those whose needs are met. An
!> override displaces what the file says against it; two statements of the same source against each other are a mistake.
module nocdyn_key_relations
  use nocdyn_input_work, only: work_t
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_fine, read_real
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_schema, only: has_word, words_of
  use nocdyn_schema_relations, only: relations_t
  use nocdyn_schema_rules, only: any_number, key_rule_t, required, unset
  use nocdyn_schema_text, only: kinds_text, listed
  use nocdyn_text, only: append, joined, lower_case, string_t
  implicit none (type, external)
  private

  public :: relate_keys

contains

  !> Refuses what does not go together, and rules out the keys that have no value here.
  subroutine relate_keys(work, relations, diagnostics)
    type(work_t), intent(inout) :: work
    type(relations_t), intent(in) :: relations
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i

    if (relations%kind > 0) call keep_keys_of_kind(work, relations%kind, diagnostics)
    do i = 1, size(relations%alternatives)
      associate (sets => relations%alternatives(i))
        call choose(work, sets%first, sets%second, sets%is_needed, diagnostics)
      end associate
    end do
    do i = 1, size(relations%needs)
      call check_need(work, relations%needs(i)%first, relations%needs(i)%second, diagnostics)
    end do
    do i = 1, size(relations%columns)
      call lengthen(work, relations%columns(i)%first)
    end do
  end subroutine relate_keys

  subroutine keep_keys_of_kind(work, key, diagnostics)
    type(work_t), intent(inout) :: work
    integer, intent(in) :: key   !! position of the key of the kind `a_kind`
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: kinds(:)
    type(key_rule_t) :: rule
    logical :: is_known
    integer :: i

    call find_kinds(work, key, kinds, is_known)
    do i = 1, size(work%drafts)
      rule = work%key(i)
      if (rule%kinds /= '') then
        if (.not. is_known) then
          work%may_miss(i) = .true.
        else if (.not. has_any_word(rule%kinds, kinds)) then
          if (work%drafts(i)%is_said()) call refuse_foreign_key(work, i, key, kinds, diagnostics)
          call work%rule_out(i)
        end if
      end if
      work%is_needed(i) = work%is_needed(i) .or. has_any_word(rule%needed_by, kinds)
    end do
  end subroutine keep_keys_of_kind

  !> The words of the key that says the kind; those that are not of the schema are reported with its value.
  subroutine find_kinds(work, key, kinds, is_known)
    type(work_t), intent(in) :: work
    integer, intent(in) :: key
    type(string_t), allocatable, intent(out) :: kinds(:)   !! in lower case; empty if none is given, nor a default
    logical, intent(out) :: is_known                       !! false if one is missing or is none of the schema
    type(key_rule_t) :: rule
    type(string_t), allocatable :: words(:)
    integer :: i, j

    rule = work%key(key)
    allocate (kinds(0))
    is_known = .not. work%drafts(key)%is_damaged
    if (.not. is_known) return
    if (.not. work%drafts(key)%is_said()) then
      is_known = rule%default /= required
      if (rule%default(1:1) == "'") call append(kinds, rule%default(2:len_trim(rule%default) - 1))
      return
    end if
    allocate (words, source=words_of(rule))
    do i = 1, size(work%drafts(key)%slots)
      if (.not. allocated(work%drafts(key)%slots(i)%text)) cycle
      call append(kinds, lower_case(work%drafts(key)%slots(i)%text))
      is_known = is_known .and. any([(words(j)%text == kinds(size(kinds))%text, j=1, size(words))])
    end do
  end subroutine find_kinds

  pure logical function has_any_word(list, words)
    character(len=*), intent(in) :: list   !! separated by blanks
    type(string_t), intent(in) :: words(:)
    integer :: i

    has_any_word = any([(has_word(list, words(i)%text), i=1, size(words))])
  end function has_any_word

  !> With the kind left to its default it was probably forgotten: then the keys of the default kind are not missed in addition.
  subroutine refuse_foreign_key(work, position, kind_position, kinds, diagnostics)
    type(work_t), intent(inout) :: work
    integer, intent(in) :: position, kind_position
    type(string_t), intent(in) :: kinds(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: text, kind_name
    type(key_rule_t) :: rule
    integer :: i

    if (work%is_overridden(kind_position) .and. .not. work%is_overridden(position)) return
    rule = work%key(position)
    kind_name = name_of(work, kind_position)
    text = trim(rule%name) // ' belongs to ' // kind_name // ' = ' // kinds_text(rule) // '; here '
    if (size(kinds) == 0) then
      text = text // 'is no ' // kind_name
    else
      text = text // kind_name // ' = ' // joined(kinds, ', ')
    end if
    if (size(kinds) > 0 .and. .not. work%drafts(kind_position)%is_said()) then
      text = text // ', the default'
      do i = 1, size(work%drafts)
        rule = work%key(i)
        if (has_any_word(rule%kinds, kinds) .or. has_any_word(rule%needed_by, kinds)) work%may_miss(i) = .true.
      end do
    end if
    call diagnostics%add(work%drafts(position)%line, work%index, text, work%drafts(position)%override)
  end subroutine refuse_foreign_key

  !> Leaves one of two sets of keys.
  subroutine choose(work, first, second, is_needed, diagnostics)
    type(work_t), intent(inout) :: work
    integer, intent(in) :: first(:), second(:)
    logical, intent(in) :: is_needed
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: one, other

    one = work%first_said(first)
    other = work%first_said(second)
    if (one > 0 .and. other > 0) then
      call refuse_both(work, one, other, diagnostics)
      if (work%is_overridden(other) .and. .not. work%is_overridden(one)) one = 0
    end if
    if (one > 0) then
      call displace(work, second)
    else if (other > 0) then
      call displace(work, first)
    else if (is_needed .and. .not. any(work%may_miss([first, second]) .or. work%is_out([first, second]))) then
      call diagnostics%add(work%line, work%index, name_of(work, first(1)) // ' or ' // name_of(work, second(1)) // &
                        ' is missing; one of them is needed')
    end if
  end subroutine choose

  subroutine refuse_both(work, one, other, diagnostics)
    type(work_t), intent(in) :: work
    integer, intent(in) :: one, other   !! positions of two keys that are both written
    type(diagnostics_t), intent(inout) :: diagnostics

    if (work%is_overridden(one) .neqv. work%is_overridden(other)) return
    call diagnostics%add(max(work%drafts(one)%line, work%drafts(other)%line), work%index, name_of(work, one) // ' and ' // &
                      name_of(work, other) // ' are both given; allowed: one of them', &
                      max(work%drafts(one)%override, work%drafts(other)%override))
  end subroutine refuse_both

  subroutine displace(work, positions)
    type(work_t), intent(inout) :: work
    integer, intent(in) :: positions(:)
    integer :: i

    do i = 1, size(positions)
      work%is_displaced(positions(i)) = work%is_displaced(positions(i)) .or. work%drafts(positions(i))%is_said()
      call work%rule_out(positions(i))
    end do
  end subroutine displace

  !> Each of `keys` that is given needs one of `needed`.
  subroutine check_need(work, keys, needed, diagnostics)
    type(work_t), intent(inout) :: work
    integer, intent(in) :: keys(:), needed(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i

    if (work%first_said(needed) > 0) return
    do i = 1, size(keys)
      if (.not. work%drafts(keys(i))%is_said()) then
        if (.not. any_has_value(work, needed)) call work%rule_out(keys(i))
      else if (any(work%is_displaced(needed)) .and. .not. work%is_overridden(keys(i))) then
        call displace(work, keys(i:i))
      else if (.not. (is_zero(work, keys(i)) .or. any(work%may_miss(needed)))) then
        call diagnostics%add(work%drafts(keys(i))%line, work%index, name_of(work, keys(i)) // ' needs ' // &
                          names_of(work, needed), work%drafts(keys(i))%override)
      end if
    end do
  end subroutine check_need

  pure logical function any_has_value(work, positions)
    type(work_t), intent(in) :: work
    integer, intent(in) :: positions(:)
    integer :: i

    any_has_value = any([(work%has_value(positions(i)), i=1, size(positions))])
  end function any_has_value

  logical function is_zero(work, position)
    type(work_t), intent(in) :: work
    integer, intent(in) :: position
    real(wp) :: value
    integer :: status

    is_zero = .false.
    associate (draft => work%drafts(position))
      if (draft%is_damaged) return
      if (draft%values_said() /= 1 .or. size(draft%slots) /= 1) return
      call read_real(draft%slots(1)%text, value, status)
      is_zero = status == literal_fine .and. abs(value) <= 0.0_wp
    end associate
  end function is_zero

  !> A list that is left to its default becomes as long as the first list beside it.
  subroutine lengthen(work, positions)
    type(work_t), intent(inout) :: work
    integer, intent(in) :: positions(:)
    type(key_rule_t) :: rule
    integer :: i

    if (.not. allocated(work%drafts(positions(1))%slots)) return
    do i = 2, size(positions)
      rule = work%key(positions(i))
      if (work%drafts(positions(i))%is_said() .or. rule%default == unset .or. rule%count /= any_number) cycle
      work%length(positions(i)) = size(work%drafts(positions(1))%slots)
    end do
  end subroutine lengthen

  pure function name_of(work, position) result(name)
    type(work_t), intent(in) :: work
    integer, intent(in) :: position
    character(len=:), allocatable :: name
    type(key_rule_t) :: rule

    rule = work%key(position)
    name = trim(rule%name)
  end function name_of

  !> "a, b or c".
  pure function names_of(work, positions) result(text)
    type(work_t), intent(in) :: work
    integer, intent(in) :: positions(:)
    character(len=:), allocatable :: text
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(size(positions)))
    do i = 1, size(positions)
      names(i)%text = name_of(work, positions(i))
    end do
    text = listed(names, ' or ')
  end function names_of

end module nocdyn_key_relations
