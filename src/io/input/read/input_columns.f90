!> Lists that belong together: as many values in each, the first of a table ascending, tables from files.
module nocdyn_input_columns
  use nocdyn_input, only: group_t, value_t
  use nocdyn_ordering_rules, only: ascending_message
  use nocdyn_input_work, only: work_t
  use nocdyn_kinds, only: wp
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_schema_relations, only: key_sets_t
  use nocdyn_schema_rules, only: key_rule_t, unset
  use nocdyn_table_file, only: read_table_file
  use nocdyn_text, only: string_t, to_text
  use nocdyn_text_file, only: path_in
  implicit none (type, external)
  private

  public :: complete_columns

contains

  !> Puts the tables of files into the lists, and checks the lists that the input itself gives.
  subroutine complete_columns(work, columns, folder, group, diagnostics)
    type(work_t), intent(in) :: work
    type(key_sets_t), intent(in) :: columns(:)
    character(len=*), intent(in) :: folder   !! of the input file, with a slash at its end, or ''
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: c

    do c = 1, size(columns)
      if (size(columns(c)%second) == 1) then
        call complete_table(work, folder, columns(c)%first, columns(c)%second(1), group, diagnostics)
      else
        call check_lengths(work, group, columns(c)%first, diagnostics)
      end if
    end do
  end subroutine complete_columns

  subroutine complete_table(work, folder, lists, file, group, diagnostics)
    type(work_t), intent(in) :: work
    character(len=*), intent(in) :: folder
    integer, intent(in) :: lists(2), file   !! positions of keys
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics

    if (allocated(group%values(file)%texts)) then
      call read_columns(folder, group, file, lists, work, diagnostics)
    else
      call check_ascent(work, group%values(lists(1)), lists(1), diagnostics)
      call check_lengths(work, group, lists, diagnostics)
    end if
  end subroutine complete_table

  !> The two lists take the place of the file.
  subroutine read_columns(folder, group, file, lists, work, diagnostics)
    character(len=*), intent(in) :: folder
    type(group_t), intent(inout) :: group
    integer, intent(in) :: file, lists(:)   !! positions of keys
    type(work_t), intent(in) :: work
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: messages(:)
    type(key_rule_t) :: rule
    type(value_t) :: source
    integer :: code, i

    rule = work%key(file)
    source = group%values(file)
    group%values(file) = value_t()
    do i = 1, size(lists)
      group%values(lists(i)) = value_t(source%is_given, source%line, source%override)
    end do
    call read_table_file(path_in(folder, source%texts(1)%text), group%values(lists(1))%numbers, &
                         group%values(lists(2))%numbers, messages, code)
    do i = 1, size(messages)
      call diagnostics%add(source%line, work%index, trim(rule%name) // ': ' // messages(i)%text, source%override, code)
    end do
  end subroutine read_columns

  subroutine check_ascent(work, value, position, diagnostics)
    type(work_t), intent(in) :: work
    type(value_t), intent(in) :: value
    integer, intent(in) :: position
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    type(key_rule_t) :: rule
    integer :: i

    if (.not. allocated(value%numbers)) return
    rule = work%key(position)
    do i = 2, size(value%numbers)
      message = ascending_message(trim(rule%name), value%numbers, i)
      if (message /= '') call diagnostics%add(max(value%line, work%drafts(position)%slots(i)%line), work%index, message, &
                                             value%override)
    end do
  end subroutine check_ascent

  !> Every list has as many values as the first one that is given.
  subroutine check_lengths(work, group, lists, diagnostics)
    type(work_t), intent(in) :: work
    type(group_t), intent(in) :: group
    integer, intent(in) :: lists(:)   !! positions of keys
    type(diagnostics_t), intent(inout) :: diagnostics
    type(key_rule_t) :: rule, first_rule
    integer :: first, i

    do first = 1, size(lists)
      if (group%values(lists(first))%has_any()) exit
    end do
    if (first > size(lists)) return
    first_rule = work%key(lists(first))
    do i = 1, size(lists)
      rule = work%key(lists(i))
      associate (value => group%values(lists(i)), reference => group%values(lists(first)))
        if (value%has_any()) then
          if (value%count() == reference%count()) cycle
          call diagnostics%add(max(value%line, reference%line), work%index, trim(rule%name) // ' has ' // counted(value) // &
                            ' and ' // trim(first_rule%name) // ' has ' // counted(reference) // '; needed: as many of each', &
                            max(value%override, reference%override))
        else if (rule%default == unset .and. .not. (work%may_miss(lists(i)) .or. work%drafts(lists(i))%is_said())) then
          call diagnostics%add(reference%line, work%index, trim(rule%name) // ' is missing; needed: ' // &
                            counted(reference) // ', one for each of ' // trim(first_rule%name), reference%override)
        end if
      end associate
    end do
  end subroutine check_lengths

  pure function counted(value) result(text)
    type(value_t), intent(in) :: value
    character(len=:), allocatable :: text

    text = to_text(value%count()) // trim(merge(' value ', ' values', value%count() == 1))
  end function counted

end module nocdyn_input_columns
