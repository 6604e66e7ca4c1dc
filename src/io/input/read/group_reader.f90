!> One group of the input, from the texts of the file and the overrides to checked values.
module nocdyn_group_reader
  use nocdyn_catalogues, only: take_catalogue
  use nocdyn_diagnostics, only: diagnostics_t, most_shown, no_line
  use nocdyn_errors, only: error_t
  use nocdyn_group_checks, only: check_group
  use nocdyn_input, only: group_t, value_t
  use nocdyn_input_overrides, only: override_t
  use nocdyn_key_relations, only: apply_relations
  use nocdyn_namelist, only: assignment_t, namelist_group_t, namelist_t
  use nocdyn_record_reader, only: read_record
  use nocdyn_raw_group, only: has_bare_unit, new_raw_group, raw_group_t
  use nocdyn_schema, only: first_key, group_rules, has_word, is_single, key_rules
  use nocdyn_schema_relations, only: relations_t
  use nocdyn_schema_rules, only: a_document, a_line_file, a_name, columns, equal_lengths, records
  use nocdyn_schema_text, only: similar_keys, suggest_key
  use nocdyn_schema_units, only: find_key, name_in_unit
  use nocdyn_table_columns, only: convert_column, read_table_columns
  use nocdyn_table_file, only: read_table_file
  use nocdyn_text, only: lower_case, shortened, shown_path, split_lines, string_t
  use nocdyn_text_file, only: first_position, largest_input, path_in, read_text_file
  use nocdyn_value_conversion, only: convert_key
  implicit none (type, external)
  private

  public :: read_group

contains

  !> Reads group `index` of the input: texts of file and overrides, relations between keys, conversion, tables of files, checks.
  subroutine read_group(namelist, source, index, overrides, folder, relations, group, diagnostics)
    type(namelist_t), intent(in) :: namelist
    type(namelist_group_t), intent(in) :: source   !! empty for a single group that the file does not have
    integer, intent(in) :: index   !! of the group in the input
    type(override_t), intent(inout) :: overrides(:)
    character(len=*), intent(in) :: folder         !! of the input file, with a slash at its end, or ''
    type(relations_t), intent(in) :: relations     !! of the keys of this group
    type(group_t), intent(inout) :: group          !! `rule`, `kind` and `line` are set
    type(diagnostics_t), intent(inout) :: diagnostics
    type(raw_group_t), allocatable :: raw
    integer :: i, k, key, unit, written
    logical :: has_number
    character(len=:), allocatable :: message

    allocate (raw, source=new_raw_group(index, group%rule, group%line, source%is_malformed))
    ! takes over the assignments of the file
    do i = source%first_assignment, source%last_assignment
      associate (assignment => namelist%assignments(i))
        call find_key(raw%rule, assignment%key, key, unit)
        if (key == 0) then
          call refuse_key(assignment, raw, diagnostics)
          cycle
        end if
        written = key
        call raw%keys(raw%position(key))%assign(namelist, assignment, unit, message)
        if (message == '') cycle
        call find_key_without_equals(namelist, assignment, raw%rule, key, unit)
        if (key > 0) then
          message = message // "; is '=' missing after " // name_in_unit(key_rules(key), unit) // '?'
          raw%keys(raw%position(key))%may_be_missing = .true.
        else if (has_bare_unit(raw%keys(raw%position(written)), namelist, assignment)) then
          message = message // '; a number with its unit stands in quotes'
        end if
        call diagnostics%add(assignment%line, raw%index, message)
      end associate
    end do
    group%name = ''
    do i = 1, size(raw%keys)
      if (key_rules(raw%keys(i)%rule)%value_type /= a_name .or. raw%keys(i)%count_given() /= 1) cycle
      group%name = raw%keys(i)%values(1)%text
    end do
    has_number = .not. is_single(group%rule) .and. group_rules(group%rule)%name_space == ''   ! instead of a name, in paths
    call take_overrides(group%name, merge(group%ordinal, 0, has_number), overrides, raw, diagnostics)
    do i = 1, size(raw%keys)
      call raw%keys(i)%trim_values()
    end do
    call apply_relations(raw, relations, diagnostics)
    allocate (group%values(size(raw%keys)))
    do i = 1, size(raw%keys)
      call convert_key(raw, i, group%values(i), diagnostics)
    end do
    do i = 1, size(relations%list)
      associate (relation => relations%list(i))
        if (relation%form == records) call read_record(folder, raw, group, diagnostics)
        if (all(relation%form /= [equal_lengths, columns]) .or. size(relation%second) == 0) cycle
        if (.not. all([(belongs(group, relations%selector, relation%first(k)), k=1, size(relation%first))])) cycle
        if (relation%form == equal_lengths) then
          call read_table(folder, relation%second(1), relation%first, raw, group, diagnostics)
        else
          call read_table_columns(folder, relation, raw, group, diagnostics)
        end if
      end associate
    end do
    call check_documents(folder, raw, group, diagnostics)
    call read_line_files(folder, raw, group, diagnostics)
    call take_catalogue(raw, group, diagnostics)
    call check_group(raw, relations, group, diagnostics)
  end subroutine read_group

  !> The keys that were probably meant are not reported as missing in addition. After many errors they are not searched.
  subroutine refuse_key(assignment, raw, diagnostics)
    type(assignment_t), intent(in) :: assignment
    type(raw_group_t), intent(inout) :: raw
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: similar(:)
    character(len=:), allocatable :: hint
    integer :: i, key, unit

    hint = ''
    if (diagnostics%count >= most_shown) then
      raw%keys%may_be_missing = .true.
    else
      allocate (similar, source=similar_keys(raw%rule, assignment%key))
      do i = 1, size(similar)
        call find_key(raw%rule, similar(i)%text, key, unit)
        raw%keys(raw%position(key))%may_be_missing = .true.
      end do
      call suggest_key(raw%rule, assignment%key, hint)
    end if
    call diagnostics%add(assignment%line, raw%index, shortened(assignment%key) // ' is not a key of &' // &
                         trim(group_rules(raw%rule)%name) // hint)
  end subroutine refuse_key

  !> The first key among the values of an assignment: its equals sign was probably forgotten.
  subroutine find_key_without_equals(namelist, assignment, rule, key, unit)
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    integer, intent(in) :: rule   !! row of `group_rules`
    integer, intent(out) :: key   !! row of `key_rules`, 0 if there is none
    integer, intent(out) :: unit  !! in which the key is written
    integer :: i

    key = 0
    unit = 0
    do i = assignment%first_item, assignment%last_item
      if (namelist%items(i)%is_quoted .or. namelist%items(i)%is_null) cycle
      call find_key(rule, lower_case(namelist%item_text(namelist%items(i))), key, unit)
      if (key > 0) return
    end do
  end subroutine find_key_without_equals

  !> Takes over the overrides of the group, and marks them as used.
  subroutine take_overrides(name, number, overrides, raw, diagnostics)
    character(len=*), intent(in) :: name   !! of the element, '' for groups without names
    integer, intent(in) :: number          !! among the groups without names
    type(override_t), intent(inout) :: overrides(:)
    type(raw_group_t), intent(inout) :: raw
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    integer :: i

    do i = 1, size(overrides)
      if (.not. overrides(i)%is_valid .or. overrides(i)%group_rule /= raw%rule) cycle
      if (overrides(i)%name /= name .or. overrides(i)%number /= number) cycle
      overrides(i)%is_used = .true.
      call raw%keys(raw%position(overrides(i)%key_rule))%override_with(overrides(i)%namelist, overrides(i)%target, &
                                                                       overrides(i)%unit, i, message)
      if (message /= '' .and. has_bare_unit(raw%keys(raw%position(overrides(i)%key_rule)), overrides(i)%namelist, &
                                            overrides(i)%target)) then
        message = message // '; a number with its unit stands in quotes'
      end if
      if (message /= '') call diagnostics%add(no_line, 0, message, i)
    end do
  end subroutine take_overrides

  !> Whether a key is one of the kind of its group.
  pure logical function belongs(group, selector, position)
    type(group_t), intent(in) :: group
    integer, intent(in) :: selector, position   !! positions of the selector key, 0: none, and of the key

    belongs = .true.
    associate (rule => key_rules(first_key(group%rule) + position - 1))
      if (selector == 0 .or. rule%only_if == '') return
      belongs = allocated(group%values(selector)%texts)
      if (belongs) belongs = has_word(rule%only_if, group%values(selector)%texts(1)%text)
    end associate
  end function belongs

  !> Replaces the file of a table by its two columns.
  subroutine read_table(folder, file, lists, raw, group, diagnostics)
    character(len=*), intent(in) :: folder
    integer, intent(in) :: file, lists(:)   !! positions of the keys of the file and of the columns
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: messages(:)
    type(value_t) :: source
    integer :: code, i

    if (.not. allocated(group%values(file)%texts)) return
    source = group%values(file)
    group%values(file) = value_t()
    do i = 1, size(lists)
      group%values(lists(i)) = value_t(source%is_given, source%line, source%override)
    end do
    call read_table_file(path_in(folder, source%texts(1)%text), group%values(lists(1))%numbers, &
                         group%values(lists(2))%numbers, messages, code)
    if (size(messages) == 0) then
      do i = 1, size(lists)
        associate (rule => key_rules(raw%keys(lists(i))%rule))
          call convert_column(shown_path(source%texts(1)%text) // ': ' // trim(rule%name), rule, 0, &
                              group%values(lists(i))%numbers, messages)
        end associate
      end do
    end if
    do i = 1, size(messages)
      call diagnostics%add(source%line, raw%index, raw%keys(file)%name() // ': ' // messages(i)%text, source%override, code)
    end do
  end subroutine read_table

  !> Refuses files for other programs that cannot be read. The group keeps no path, which would be of no use beside the results.
  subroutine check_documents(folder, raw, group, diagnostics)
    character(len=*), intent(in) :: folder
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(inout) :: group   !! with its tables read
    type(diagnostics_t), intent(inout) :: diagnostics
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text
    integer :: i

    do i = 1, size(group%values)
      if (key_rules(raw%keys(i)%rule)%value_type /= a_document .or. .not. allocated(group%values(i)%texts)) cycle
      associate (value => group%values(i))
        call read_text_file(path_in(folder, value%texts(1)%text), text, error, largest_input)
        if (allocated(error)) call diagnostics%add(value%line, raw%index, raw%keys(i)%name() // ': ' // error%message, &
                                                   value%override, error%code)
        deallocate (value%texts)
      end associate
    end do
  end subroutine check_documents

  !> Takes over the lines of text files into the keys behind theirs, unless these are given. The paths stay, for messages.
  subroutine read_line_files(folder, raw, group, diagnostics)
    character(len=*), intent(in) :: folder
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text
    integer :: i

    do i = 1, size(group%values)
      if (key_rules(raw%keys(i)%rule)%value_type /= a_line_file .or. .not. allocated(group%values(i)%texts)) cycle
      associate (file => group%values(i), lines => group%values(i + 1))
        if (lines%count() > 0) cycle
        call read_text_file(path_in(folder, file%texts(1)%text), text, error, largest_input)
        if (allocated(error)) then
          call diagnostics%add(file%line, raw%index, raw%keys(i)%name() // ': ' // error%message, file%override, error%code)
          cycle
        end if
        lines = value_t(file%is_given, file%line, file%override)
        call split_lines(text(first_position(text):), lines%texts)
      end associate
    end do
  end subroutine read_line_files

end module nocdyn_group_reader
