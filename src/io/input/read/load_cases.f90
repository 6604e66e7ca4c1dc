!> Load cases: which groups of a file belong to each of them, and which to the machine itself.
!>
!> Elements that a load case names by `with` belong only to the cases that name them; those that it names by `without` are not in
!> it. The run of a case is the &run that names it, else the &run without a case.
module nocdyn_load_cases
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_schema, only: group_rules
  use nocdyn_schema_text, only: suggestion
  use nocdyn_text, only: append, lower_case, quoted, shortened, string_t, to_text
  implicit none (type, external)
  private

  public :: find_load_cases, is_run_of_case, keep_groups

  !> What a file says of its load cases.
  type :: members_t
    integer, allocatable :: groups(:)     !! those that are load cases
    logical, allocatable :: has(:, :)     !! whether a case names a group by `with`, [cases, groups]
    logical, allocatable :: lacks(:, :)   !! and by `without`
    integer, allocatable :: runs(:)       !! its own &run, 0: none, [cases]
    integer :: common_run = 0             !! the &run without a case, 0: none
  end type members_t

  ! of the files of results beside the folders of load cases
  character(len=*), parameter :: file_endings(*) = [character(len=8) :: '.json', '.csv', '.nml', '.nc', '.journal', '.html', &
                                                    '.pdf', '.png', '.svg']

contains

  !> Whether a group is a &run that names a load case.
  logical function is_run_of_case(group)
    type(group_t), intent(in) :: group

    is_run_of_case = group%kind == 'run' .and. group%rule > 0
    if (is_run_of_case) is_run_of_case = group%has_value('load_case')
  end function is_run_of_case

  !> Finds the load cases of an input, and the groups that are not of the machine itself.
  subroutine find_load_cases(input, machine_lacks, diagnostics)
    type(input_t), intent(inout) :: input   !! all groups of the file; gets its load cases
    logical, allocatable, intent(out) :: machine_lacks(:)   !! [groups]
    type(diagnostics_t), intent(inout) :: diagnostics
    type(members_t) :: members
    integer :: c, g, i

    allocate (members%groups, source=input%groups_named('load_case'))
    allocate (machine_lacks(size(input%groups)), source=.false.)
    if (allocated(input%load_cases)) deallocate (input%load_cases)
    allocate (input%load_cases(size(members%groups)))
    call find_runs(input, members, diagnostics)
    if (size(members%groups) == 0) return
    allocate (members%has(size(members%groups), size(input%groups)), source=.false.)
    allocate (members%lacks, source=members%has)
    do c = 1, size(members%groups)
      ! the name of a load case is the one of a folder
      associate (name => input%groups(members%groups(c))%name)   ! without commas
        if (any([(index(lower_case(name) // ',', trim(file_endings(i)) // ',') > 0, i=1, size(file_endings))])) then
          call input%report(members%groups(c), 'name', 'name = ' // quoted(shortened(name)) // &
                            ' is that of a file of results; allowed: ' // &
                            'a name without such an ending, for it is that of a folder', diagnostics)
        else if (index(name, '/') > 0 .or. index(name, '.') == 1) then
          call input%report(members%groups(c), 'name', 'name = ' // quoted(shortened(name)) // &
                            ' is no name of a folder; allowed: a name without / and without a dot at its beginning', diagnostics)
        end if
      end associate
      call find_members(input, members%groups(c), 'with', members%has(c, :), diagnostics)
      call find_members(input, members%groups(c), 'without', members%lacks(c, :), diagnostics)
      do g = 1, size(input%groups)
        if (members%has(c, g) .and. members%lacks(c, g)) call input%report(members%groups(c), 'with', &
          'with and without both name ' // quoted(input%groups(g)%name) // '; allowed: one of them', diagnostics)
      end do
      call check_values(input, members%groups(c), diagnostics)
    end do
    do c = 1, size(members%groups)
      associate (load_case => input%load_cases(c), group => input%groups(members%groups(c)))
        load_case%name = group%name
        load_case%title = group%text('title')
        load_case%repeats = group%number('repeats')
        load_case%line = group%line
        allocate (load_case%analyses, source=group%texts('analyses'))
        allocate (load_case%lacks(size(input%groups)))
        load_case%lacks(:) = members%lacks(c, :) .or. (any(members%has, dim=1) .and. .not. members%has(c, :))
        call list_overrides(input, members%groups(c), load_case%lacks, load_case%overrides, diagnostics)
        call leave_frame(input, members, merge(members%runs(c), members%common_run, members%runs(c) > 0), load_case%lacks)
      end associate
    end do
    machine_lacks(:) = any(members%has, dim=1)
    call leave_frame(input, members, members%common_run, machine_lacks)
  end subroutine find_load_cases

  !> The values that a load case sets: the condition of all couplings of rubber, the cylinder of all engines that does not fire,
  !> and what it lists, which goes before these.
  subroutine list_overrides(input, group, lacks, overrides, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group        !! the &load_case
    logical, intent(in) :: lacks(:)     !! groups that it leaves out
    type(string_t), allocatable, intent(out) :: overrides(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: listed(:)
    integer :: g, i

    allocate (overrides(0))
    associate (own => input%groups(group))
      if (own%has_value('rubber')) then
        do g = 1, size(lacks)
          if (lacks(g) .or. input%groups(g)%kind /= 'coupling') cycle
          if (input%groups(g)%text('kind') /= 'rubber') cycle
          call append(overrides, 'coupling.' // input%groups(g)%name // '.condition=' // own%text('rubber'))
        end do
        if (size(overrides) == 0) call input%report(group, 'rubber', 'rubber = ' // quoted(own%text('rubber')) // &
          ": the machine has no &coupling of kind = 'rubber'", diagnostics)
      end if
      if (own%has_value('misfire')) then
        i = size(overrides)
        do g = 1, size(lacks)
          if (lacks(g) .or. input%groups(g)%kind /= 'engine') cycle
          call append(overrides, 'engine.' // input%groups(g)%name // '.misfire=' // to_text(own%whole_number('misfire')))
        end do
        if (size(overrides) == i) call input%report(group, 'misfire', 'misfire = ' // to_text(own%whole_number('misfire')) // &
                                                    ': the machine has no &engine', diagnostics)
      end if
      allocate (listed, source=own%texts('set'))
      do i = 1, size(listed)
        call append(overrides, listed(i)%text)
      end do
    end associate
  end subroutine list_overrides

  !> Leaves out the groups &load_case, every &run but one, and each &limit of an element that is left out.
  subroutine leave_frame(input, members, run, lacks)
    type(input_t), intent(in) :: input
    type(members_t), intent(in) :: members
    integer, intent(in) :: run   !! index of the group that stays; 0: the first one
    logical, intent(inout) :: lacks(:)   !! [groups]
    integer, allocatable :: runs(:)
    integer :: i

    allocate (runs, source=input%groups_named('run'))
    lacks(members%groups) = .true.
    lacks(runs) = .true.
    lacks(merge(run, runs(1), run > 0)) = .false.
    do i = 1, size(lacks)
      if (lacks(i) .and. is_element(input%groups(i))) lacks = lacks .or. limits_of(input, input%groups(i))
    end do
  end subroutine leave_frame

  !> Which groups &limit are of an element.
  pure function limits_of(input, element) result(are_limits)
    type(input_t), intent(in) :: input
    type(group_t), intent(in) :: element
    logical :: are_limits(size(input%groups))
    integer :: g

    are_limits = .false.
    if (all(element%kind /= [character(len=8) :: 'coupling', 'shaft', 'mesh', 'damper'])) return
    do g = 1, size(input%groups)
      associate (group => input%groups(g))
        if (group%kind /= 'limit' .or. group%rule == 0) cycle
        if (group%has_value(trim(element%kind))) are_limits(g) = group%text(trim(element%kind)) == element%name
      end associate
    end do
  end function limits_of

  !> Finds the &run of every case.
  subroutine find_runs(input, members, diagnostics)
    type(input_t), intent(in) :: input
    type(members_t), intent(inout) :: members
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, allocatable :: runs(:)
    type(string_t), allocatable :: names(:)
    integer :: c, i

    allocate (runs, source=input%groups_named('run'))
    allocate (members%runs(size(members%groups)), source=0)
    allocate (names(size(members%groups)))
    do c = 1, size(names)
      names(c)%text = input%groups(members%groups(c))%name
    end do
    do i = 1, size(runs)
      if (.not. is_run_of_case(input%groups(runs(i)))) then
        members%common_run = runs(i)
        cycle
      end if
      do c = 1, size(names)
        if (names(c)%text == input%groups(runs(i))%text('load_case')) exit
      end do
      if (c > size(names)) then
        call input%report(runs(i), 'load_case', 'load_case: there is no &load_case ' // &
                          quoted(shortened(input%groups(runs(i))%text('load_case'))) // &
                          suggestion(input%groups(runs(i))%text('load_case'), names), diagnostics)
      else if (members%runs(c) > 0) then
        call input%report(runs(i), 'load_case', 'load_case: the &run of ' // quoted(names(c)%text) // ' is on line ' // &
                          to_text(input%groups(members%runs(c))%line), diagnostics)
      else
        members%runs(c) = runs(i)
      end if
    end do
    if (members%common_run > 0) return
    do c = 1, size(names)
      if (members%runs(c) > 0 .or. .not. wants_run(input%groups(members%groups(c)))) cycle
      call input%report(members%groups(c), 'name', 'there is no &run for it; needed: one with load_case = ' // &
                        quoted(shortened(names(c)%text)) // ', or one without load_case, for all', diagnostics)
    end do
  end subroutine find_runs

  !> Whether a load case is run over the time.
  logical function wants_run(group)
    type(group_t), intent(in) :: group   !! &load_case
    type(string_t), allocatable :: analyses(:)
    integer :: i

    allocate (analyses, source=group%texts('analyses'))
    wants_run = size(analyses) == 0
    if (.not. wants_run) wants_run = any([(analyses(i)%text == 'run', i=1, size(analyses))])
  end function wants_run

  !> Refuses values of a load case that are not the ones of its machine, its run or its output.
  subroutine check_values(input, group, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group   !! the &load_case
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: values(:)
    character(len=:), allocatable :: value
    integer :: i

    allocate (values, source=input%groups(group)%texts('set'))
    do i = 1, size(values)
      value = adjustl(values(i)%text)
      if (index(value, 'load_case.') /= 1 .and. index(value, 'output.directory') /= 1) cycle
      call input%report(group, 'set', 'set ' // quoted(shortened(value)) // ': no load case sets that; allowed: ' // &
                        'values of the machine, of &run and of &output without directory', diagnostics)
    end do
  end subroutine check_values

  !> Marks the elements that a load case names.
  subroutine find_members(input, group, key, is_named, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group           !! the &load_case
    character(len=*), intent(in) :: key    !! with, without
    logical, intent(inout) :: is_named(:)  !! [groups]
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: elements(:), names(:)
    integer :: found, g, i

    allocate (names, source=input%groups(group)%texts(key))
    if (size(names) == 0) return
    allocate (elements(0))
    do g = 1, size(input%groups)
      if (is_element(input%groups(g))) call append(elements, input%groups(g)%name)
    end do
    do i = 1, size(names)
      found = 0
      do g = 1, size(input%groups)
        if (input%groups(g)%name /= names(i)%text .or. .not. is_element(input%groups(g))) cycle
        if (found > 0) call input%report(group, key, key // ': ' // quoted(shortened(names(i)%text)) // ' is the name of ' // &
          input%location(found) // ' and of ' // input%location(g) // '; needed: a name that one element has', diagnostics)
        found = g
        is_named(g) = .true.
      end do
      if (found > 0) cycle
      do g = 1, size(input%groups)
        if (input%groups(g)%name == names(i)%text .and. names(i)%text /= '') exit
      end do
      if (g <= size(input%groups)) then
        call input%report(group, key, key // ': ' // quoted(names(i)%text) // ' is a &' // trim(input%groups(g)%kind) // &
                          '; allowed: names of elements', diagnostics)
      else
        call input%report(group, key, key // ': there is no element ' // quoted(shortened(names(i)%text)) // &
                          suggestion(names(i)%text, elements), diagnostics)
      end if
    end do
  end subroutine find_members

  !> Whether a group is one that load cases can have or lack: one with a name, no body, no load case.
  logical function is_element(group)
    type(group_t), intent(in) :: group

    is_element = group%rule > 0 .and. group%name /= ''
    if (is_element) is_element = group%kind == 'damper' .or. &
                                 all(group_rules(group%rule)%name_space /= [character(len=9) :: 'body', 'load_case'])
  end function is_element

  !> Leaves the groups of a load case or of the machine itself. Its &run is the one of an input without load cases then.
  subroutine keep_groups(input, lacks)
    type(input_t), intent(inout) :: input
    logical, intent(in) :: lacks(:)   !! whether a group is left out, of the first groups of the input
    type(group_t), allocatable :: kept(:)
    integer :: g, k, run

    allocate (kept(size(input%groups) - count(lacks)))
    k = 0
    do g = 1, size(input%groups)
      if (g <= size(lacks)) then
        if (lacks(g)) cycle
      end if
      k = k + 1
      kept(k) = input%groups(g)
    end do
    call move_alloc(kept, input%groups)
    run = input%position('run')
    input%groups(run)%values(input%groups(run)%key_position('load_case')) = value_t()
  end subroutine keep_groups

end module nocdyn_load_cases
