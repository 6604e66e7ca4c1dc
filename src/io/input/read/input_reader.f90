!> Reads an input file: scanner, schema, overrides and all checks. One error reports everything that is wrong.
module nocdyn_input_reader
  use nocdyn_diagnostics, only: diagnostics_t, most_shown, no_line
  use nocdyn_errors, only: add_error, error_t, exit_input, raise
  use nocdyn_group_reader, only: read_group
  use nocdyn_input, only: group_t, input_t
  use nocdyn_input_overrides, only: override_t, read_overrides
  use nocdyn_measured_tables, only: take_measured_tables
  use nocdyn_load_cases, only: find_load_cases, is_run_of_case, keep_groups
  use nocdyn_made_groups, only: make_groups
  use nocdyn_name_checks, only: check_duplicate_names, check_references, collect_names
  use nocdyn_namelist, only: namelist_group_t, namelist_t
  use nocdyn_namelist_scanner, only: scan_namelist
  use nocdyn_schema, only: first_key, group_rule_index, group_rules, is_single, key_rules, last_key, relation_rules
  use nocdyn_schema_relations, only: relations_of, relations_t
  use nocdyn_schema_rules, only: at_least_once, exactly_once, exactly_one, occurrence_texts, required
  use nocdyn_schema_text, only: group_names, suggest_group, suggestion
  use nocdyn_near_words, only: nearest_word
  use nocdyn_text, only: append, quoted, shortened, string_t, to_text
  use nocdyn_text_file, only: largest_input, read_text_file
  implicit none (type, external)
  private

  public :: read_input, read_input_text

contains

  !> Reads and checks a file. The message of the error has one line for each diagnostic, in the order of the file.
  subroutine read_input(file, overrides, input, error, diagnostics, load_cases, only_case)
    character(len=*), intent(in) :: file
    type(string_t), intent(in) :: overrides(:)   !! PATH=VALUE
    type(input_t), intent(out) :: input
    type(error_t), allocatable, intent(out) :: error            !! the file or an override is wrong
    type(diagnostics_t), intent(out), optional :: diagnostics   !! the ones of the error
    type(input_t), allocatable, intent(out), optional :: load_cases(:)   !! as of `read_input_text`
    character(len=*), intent(in), optional :: only_case                  !! likewise
    character(len=:), allocatable :: text

    call read_text_file(file, text, error, largest_input, may_be_pipe=.true.)
    if (allocated(error)) return
    call read_input_text(text, file, overrides, input, error, diagnostics, load_cases, only_case)
  end subroutine read_input

  !> Reads and checks the text of a file: the machine itself and, if they are asked for, its load cases.
  subroutine read_input_text(text, file, overrides, input, error, all_diagnostics, load_cases, only_case)
    character(len=*), intent(in) :: text
    character(len=*), intent(in) :: file         !! its name in messages
    type(string_t), intent(in) :: overrides(:)   !! PATH=VALUE
    type(input_t), intent(out) :: input
    type(error_t), allocatable, intent(out) :: error                !! the text or an override is wrong
    type(diagnostics_t), intent(out), optional :: all_diagnostics   !! the ones of the error, but for the ones of load cases
    type(input_t), allocatable, intent(out), optional :: load_cases(:)
    character(len=*), intent(in), optional :: only_case   !! the load case that is read; the others stay empty; '': all are read
    type(diagnostics_t) :: diagnostics
    logical, allocatable :: lacks(:)
    integer :: c
    logical :: is_readable   ! whether the load cases are

    input%file = file
    input%overrides = overrides
    call read_all_groups(text, input, diagnostics, error)
    if (allocated(error)) return
    is_readable = diagnostics%count == 0
    if (is_readable) call find_load_cases(input, lacks, diagnostics)
    if (diagnostics%count > 0) then
      call input%refuse(diagnostics, error)
    else
      if (size(input%load_cases) > 0) call keep_groups(input, lacks)
      call make_groups(input)
    end if
    if (present(all_diagnostics)) all_diagnostics = diagnostics
    if (.not. (is_readable .and. present(load_cases))) return
    allocate (load_cases(size(input%load_cases)))
    do c = 1, size(load_cases)
      if (present(only_case)) then
        if (only_case /= '' .and. only_case /= input%load_cases(c)%name) cycle
      end if
      call read_load_case(text, input, c, overrides, load_cases(c), error)
    end do
  end subroutine read_input_text

  !> Reads one load case of a file.
  subroutine read_load_case(text, machine, c, overrides, input, error)
    character(len=*), intent(in) :: text   !! of the file
    type(input_t), intent(in) :: machine
    integer, intent(in) :: c   !! of `machine%load_cases`
    type(string_t), intent(in) :: overrides(:)   !! PATH=VALUE of the command line
    type(input_t), intent(out) :: input   !! without groups if it is wrong
    type(error_t), allocatable, intent(inout) :: error   !! gets the mistakes of this case too
    type(error_t), allocatable :: own
    type(diagnostics_t) :: diagnostics
    integer :: g, i

    input%file = machine%file
    input%load_case = machine%load_cases(c)
    allocate (input%overrides(0))
    do i = 1, size(input%load_case%overrides)
      call append(input%overrides, input%load_case%overrides(i)%text)
    end do
    do i = 1, size(overrides)
      call append(input%overrides, overrides(i)%text)
    end do
    call read_all_groups(text, input, diagnostics, own)
    associate (lacks => input%load_case%lacks, own_overrides => size(input%load_case%overrides))
      do g = 1, merge(size(lacks), 0, diagnostics%count == 0)
        if (.not. lacks(g) .or. input%groups(g)%name == '') cycle
        do i = 1, size(input%groups(g)%values)
          associate (override => input%groups(g)%values(i)%override)
            if (override > 0 .and. override <= own_overrides) call diagnostics%add(no_line, 0, 'the load case leaves out ' // &
                                                                                   input%label(g), override)
          end associate
        end do
      end do
    end associate
    if (diagnostics%count == 0) then
      call keep_groups(input, input%load_case%lacks)
      call check_references(input%groups, bodies_are_known(input%groups), diagnostics)   ! to dampers that it leaves out
      call make_groups(input)
    end if
    call input%refuse(diagnostics, own)
    if (allocated(own) .and. allocated(input%groups)) deallocate (input%groups)   ! they are not to be looked at
    call add_error(error, own)
  end subroutine read_load_case

  !> Reads and checks all groups of a file.
  subroutine read_all_groups(text, input, diagnostics, error)
    character(len=*), intent(in) :: text
    type(input_t), intent(inout) :: input   !! with its file and overrides
    type(diagnostics_t), intent(inout) :: diagnostics
    type(error_t), allocatable, intent(out) :: error   !! there are no groups
    type(namelist_t) :: namelist
    type(override_t), allocatable :: parsed(:)
    integer :: first(size(group_rules)), g, rule
    logical :: is_misspelt(size(group_rules))
    type(string_t), allocatable :: names(:)

    if (index(text, achar(0)) > 0) then
      call raise(error, exit_input, input%shown_file() // ': not a text file')
      return
    end if
    call scan_namelist(text, namelist, diagnostics)
    if (namelist%group_count == 0 .and. diagnostics%count == 0) then
      call raise(error, exit_input, input%shown_file() // ": no group in it; 'nocdyn new FILE' writes an example")
      return
    end if

    call read_overrides(input%overrides, parsed, diagnostics)
    call read_groups(namelist, parsed, input, diagnostics)
    ! checks how often each group occurs
    allocate (names, source=group_names())
    first = 0
    is_misspelt = .false.
    do g = 1, size(input%groups)
      rule = input%groups(g)%rule
      if (rule == 0) then
        rule = nearest_word(input%groups(g)%kind, names)
        if (rule > 0) is_misspelt(rule) = .true.
      else if (first(rule) == 0) then
        first(rule) = g
      else if (is_run_of_case(input%groups(g))) then
        cycle
      else if (is_run_of_case(input%groups(first(rule)))) then
        first(rule) = g
      else if (is_single(rule)) then
        call diagnostics%add(input%groups(g)%line, g, 'given twice, first on line ' // to_text(input%groups(first(rule))%line) &
          // '; allowed: ' // trim(occurrence_texts(group_rules(rule)%occurrence)))
      end if
    end do
    do rule = 1, size(group_rules)
      if (first(rule) > 0 .or. is_misspelt(rule)) cycle
      if (all(group_rules(rule)%occurrence /= [exactly_once, at_least_once])) cycle
      call diagnostics%add(no_line, 0, 'there is no &' // trim(group_rules(rule)%name) // '; needed: ' &
        // trim(occurrence_texts(group_rules(rule)%occurrence)))
    end do
    call refuse_unused(input%groups, parsed, diagnostics)
    call check_duplicate_names(input%groups, diagnostics)
    call check_references(input%groups, bodies_are_known(input%groups), diagnostics)
    call take_measured_tables(input%groups, diagnostics)
  end subroutine read_all_groups

  !> Reads all groups of the file, then the single groups that it does not have.
  subroutine read_groups(namelist, overrides, input, diagnostics)
    type(namelist_t), intent(in) :: namelist
    type(override_t), intent(inout) :: overrides(:)
    type(input_t), intent(inout) :: input
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, allocatable :: added(:)
    character(len=:), allocatable :: folder, hint
    type(namelist_group_t) :: source
    type(relations_t) :: relations(size(group_rules))
    integer :: numbers(size(group_rules))   ! of groups so far
    integer :: g, n, rule

    do g = 1, size(relations)
      relations(g) = relations_of(g)
    end do
    numbers = 0
    folder = input%file(:index(input%file, '/', back=.true.))
    ! rows of the single groups that the file does not have, but that have only defaults or overrides
    allocate (added(0))
    do rule = 1, size(group_rules)
      if (.not. is_single(rule)) cycle
      if (any([(namelist%groups(g)%name == group_rules(rule)%name, g=1, namelist%group_count)])) cycle
      if ((any(key_rules(first_key(rule):last_key(rule))%default == required) .or. &
           any(relation_rules%group == group_rules(rule)%name .and. relation_rules%form == exactly_one)) .and. &
          all(overrides%group_rule /= rule)) cycle
      added = [added, rule]
    end do
    n = namelist%group_count
    allocate (input%groups(n + size(added)))
    do g = 1, n + size(added)
      associate (group => input%groups(g))
        group%name = ''
        source = namelist_group_t()
        if (g > n) then
          group%rule = added(g - n)
          group%kind = trim(group_rules(group%rule)%name)
        else
          source = namelist%groups(g)
          group%kind = source%name
          group%line = source%line
          group%rule = group_rule_index(group%kind)
          if (group%rule == 0) then
            hint = ''
            if (diagnostics%count < most_shown) call suggest_group(group%kind, hint)
            call diagnostics%add(group%line, g, 'there is no such group' // hint)
            cycle
          end if
          numbers(group%rule) = numbers(group%rule) + 1
          group%ordinal = numbers(group%rule)
        end if
        call read_group(namelist, source, g, overrides, folder, relations(group%rule), group, diagnostics)
      end associate
    end do
  end subroutine read_groups

  !> Refuses overrides of elements that do not exist.
  subroutine refuse_unused(groups, overrides, diagnostics)
    type(group_t), intent(in) :: groups(:)
    type(override_t), intent(in) :: overrides(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: kind
    integer :: g, i

    do i = 1, size(overrides)
      if (overrides(i)%is_used .or. .not. overrides(i)%is_valid) cycle
      kind = trim(group_rules(overrides(i)%group_rule)%name)
      if (overrides(i)%number > 0) then
        call diagnostics%add(no_line, 0, 'there is no ' // kind // '(' // to_text(overrides(i)%number) // '); the file has ' // &
                             to_text(count(groups%rule == overrides(i)%group_rule)) // ' &' // kind, i)
        cycle
      end if
      call collect_names(groups, pack([(g, g=1, size(groups))], groups%rule == overrides(i)%group_rule), names)
      call diagnostics%add(no_line, 0, 'there is no &' // kind // ' ' // quoted(shortened(overrides(i)%name)) // &
                           suggestion(overrides(i)%name, names), i)
    end do
  end subroutine refuse_unused

  !> Whether the names of all bodies are known: false if there is a &body, perhaps misspelt, whose name cannot be read.
  pure logical function bodies_are_known(groups)
    type(group_t), intent(in) :: groups(:)
    type(string_t), allocatable :: names(:)
    integer :: body, g

    allocate (names, source=group_names())
    body = group_rule_index('body')
    bodies_are_known = .true.
    do g = 1, size(groups)
      if (groups(g)%rule == 0) then
        bodies_are_known = bodies_are_known .and. nearest_word(groups(g)%kind, names) /= body
      else if (groups(g)%rule == body) then
        bodies_are_known = bodies_are_known .and. groups(g)%name /= ''
      end if
    end do
  end function bodies_are_known

end module nocdyn_input_reader
