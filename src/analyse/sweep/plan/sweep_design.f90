!> What varies in a sweep and its design, from &sweep and &vary or from the file of a list.
module nocdyn_sweep_design
  use nocdyn_checksums, only: checksum_digits
  use nocdyn_designs, only: can_overflow, design_t, factor_t, grid_design, grid_size, list_design, max_variants, &
    probability_between, sampled_design
  use nocdyn_errors, only: error_t, exit_file
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_diagnostics, only: diagnostics_t, no_line
  use nocdyn_sobol_points, only: max_dimensions
  use nocdyn_table_file, only: read_list_text
  use nocdyn_text, only: quoted, string_t, to_text
  use nocdyn_text_file, only: path_in, read_text_file
  use nocdyn_varied_numbers, only: find_varied_numbers, varied_number_t, varied_numbers_t
  implicit none (type, external)
  private

  public :: read_design, find_varied, find_planned_numbers

contains

  !> Reads what varies and the design. The design is allocated if there is no error. A list refuses &vary.
  subroutine read_design(input, sweep, numbers, design, list_checksum, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: sweep   !! index of &sweep
    type(varied_numbers_t), intent(out) :: numbers
    type(design_t), allocatable, intent(out) :: design
    character(len=:), allocatable, intent(out) :: list_checksum   !! of the bytes of the file of a list, '' if there is none
    type(diagnostics_t), intent(inout) :: diagnostics
    type(factor_t), allocatable :: factors(:)
    real(wp), allocatable :: values(:, :)
    integer :: before, i

    before = diagnostics%count
    list_checksum = ''
    associate (group => input%groups(sweep), varied => input%groups_named('vary'))
      if (group%text('design') == 'list') then
        call read_list(input, sweep, numbers, values, list_checksum, diagnostics)
        do i = 1, size(varied)
          call diagnostics%add(input%groups(varied(i))%line, varied(i), &
                               "design = 'list' takes targets and values from its file; allowed: no &vary")
        end do
        call refuse_overrides(input, [integer ::], numbers, diagnostics)
        if (diagnostics%count == before) allocate (design, source=list_design(values))
      else
        call read_varied(input, sweep, varied, numbers, factors, diagnostics)
        call refuse_overrides(input, varied, numbers, diagnostics)
        if (diagnostics%count == before) call make_design(group, factors, design)
      end if
    end associate
  end subroutine read_design

  !> The design whose factors are the groups &vary.
  subroutine make_design(group, factors, design)
    type(group_t), intent(in) :: group   !! &sweep
    type(factor_t), intent(in) :: factors(:)
    type(design_t), allocatable, intent(out) :: design

    if (group%text('design') == 'grid') then
      allocate (design, source=grid_design(factors))
    else
      allocate (design, source=sampled_design(group%text('design'), factors, group%whole_number('samples'), &
                                              group%whole_number('seed')))
    end if
  end subroutine make_design

  !> Reads the file of a list: targets in its first line, values in the others.
  subroutine read_list(input, sweep, numbers, values, list_checksum, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: sweep
    type(varied_numbers_t), intent(out) :: numbers
    real(wp), allocatable, intent(out) :: values(:, :)   !! [numbers, variants]
    character(len=:), allocatable, intent(inout) :: list_checksum
    type(diagnostics_t), intent(inout) :: diagnostics
    type(error_t), allocatable :: error
    type(string_t), allocatable :: messages(:), names(:), paths(:), units(:)
    character(len=:), allocatable :: file, text
    integer :: i, line

    allocate (paths(0))
    call find_varied_numbers(input, paths, [logical ::], numbers, messages)
    file = path_in(input%file(:index(input%file, '/', back=.true.)), input%groups(sweep)%text('file'))
    call read_text_file(file, text, error)
    if (allocated(error)) then
      call input%report(sweep, 'file', 'file: ' // error%message, diagnostics, exit_file)
      return
    end if
    list_checksum = checksum_digits(text)
    call read_list_text(text, file, names, line, values, messages)
    do i = 1, size(messages)
      call input%report(sweep, 'file', 'file: ' // messages(i)%text, diagnostics)
    end do
    call split_units(names, paths, units)
    call find_varied_numbers(input, paths, [(.false., i=1, size(paths))], numbers, messages)
    do i = 1, size(paths)
      if (messages(i)%text == '' .and. units(i)%text /= '' .and. units(i)%text /= numbers%list(i)%unit) then
        messages(i)%text = 'another unit; needed: ' // paths(i)%text
        if (numbers%list(i)%unit /= '') messages(i)%text = messages(i)%text // ' [' // numbers%list(i)%unit // ']'
      end if
      if (messages(i)%text == '') cycle
      call input%report(sweep, 'file', 'file: ' // file // ':' // to_text(line) // ': column ' // to_text(i) // ', ' // &
                       quoted(names(i)%text) // ': ' // messages(i)%text, diagnostics)
    end do
  end subroutine read_list

  !> Splits names such as "load.work.viscous [N m s/rad]", the form of sweep.csv.
  subroutine split_units(names, paths, units)
    type(string_t), intent(in) :: names(:)
    type(string_t), allocatable, intent(out) :: paths(:), units(:)   !! units are '' where there is none
    integer :: bracket, i

    allocate (paths(size(names)), units(size(names)))
    do i = 1, size(names)
      associate (name => names(i)%text)
        bracket = index(name, '[', back=.true.)
        if (bracket == 0 .or. name(len(name):) /= ']') bracket = len(name) + 1
        paths(i)%text = trim(name(:bracket - 1))
        units(i)%text = name(bracket + 1:len(name) - 1)
      end associate
    end do
  end subroutine split_units

  !> Refuses overrides of numbers that vary: they would have no effect. What a load case sets is for its run.
  subroutine refuse_overrides(input, varied, numbers, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied(:)   !! index of the &vary of each number; empty if they are the ones of a list
    type(varied_numbers_t), intent(in) :: numbers
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: source
    integer :: i, t

    do i = 1 + input%case_overrides(), size(input%overrides)
      associate (text => input%overrides(i)%text)
        t = numbers%number_at(input, text(:index(text, '=') - 1))
      end associate
      if (t == 0) cycle
      if (size(varied) == 0) then
        source = 'column ' // to_text(t) // ' of the list gives this number its values'
      else
        source = 'the &vary on line ' // to_text(input%groups(varied(t))%line) // ' gives this number its values; to ' // &
                 'change those, write vary(' // to_text(t) // ').KEY=VALUE'
      end if
      call diagnostics%add(no_line, 0, 'has no effect on a sweep: ' // source, i)
    end do
  end subroutine refuse_overrides

  subroutine read_varied(input, sweep, varied, numbers, factors, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: sweep, varied(:)
    type(varied_numbers_t), intent(out) :: numbers
    type(factor_t), allocatable, intent(out) :: factors(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: design
    integer :: i

    design = input%groups(sweep)%text('design')
    call find_varied(input, varied, numbers, diagnostics)
    allocate (factors(size(varied)))
    do i = 1, size(varied)
      factors(i) = factor_of(input%groups(varied(i)))
      call check_factor(input, varied(i), design, factors(i), diagnostics)
      if (design == 'grid' .and. numbers%list(i)%is_integer) call check_whole_grid(input, varied(i), numbers%list(i), &
                                                                                   factors(i), diagnostics)
    end do
    if (size(varied) == 0) then
      call input%report(sweep, 'design', 'design = ' // quoted(design) // ' has nothing to vary; needed: a &vary', diagnostics)
    else if (design == 'sobol' .and. size(varied) > max_dimensions) then
      call input%report(sweep, 'design', "design = 'sobol' varies at most " // to_text(max_dimensions) // &
                       ' numbers; here vary ' // to_text(size(varied)), diagnostics)
    else if (design == 'grid' .and. grid_size(factors) > max_variants) then
      call input%report(sweep, 'design', 'the grid has too many variants; allowed: at most ' // to_text(max_variants) // &
                       ' by the product of all count', diagnostics)
    end if
  end subroutine read_varied

  !> The numbers of all &vary, as far as they exist.
  subroutine find_varied(input, varied, numbers, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied(:)
    type(varied_numbers_t), intent(out) :: numbers
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: messages(:), paths(:)
    logical :: are_relative(size(varied))
    integer :: i

    allocate (paths(size(varied)))
    do i = 1, size(varied)
      paths(i)%text = ''
      are_relative(i) = .false.
      if (input%groups(varied(i))%has_value('scale')) are_relative(i) = input%groups(varied(i))%text('scale') == 'relative'
      if (input%groups(varied(i))%has_value('target')) paths(i)%text = input%groups(varied(i))%text('target')
    end do
    call find_varied_numbers(input, paths, are_relative, numbers, messages)
    do i = 1, size(varied)
      if (messages(i)%text == '' .or. .not. input%groups(varied(i))%has_value('target')) cycle
      call input%report(varied(i), 'target', 'target = ' // quoted(paths(i)%text) // ': ' // messages(i)%text, diagnostics)
    end do
  end subroutine find_varied

  !> The numbers of a sweep that has been planned before: the ones of its &vary, or of the columns of its list.
  subroutine find_planned_numbers(input, labels, numbers)
    type(input_t), intent(in) :: input
    type(string_t), intent(in) :: labels(:)   !! of the numbers
    type(varied_numbers_t), intent(out) :: numbers
    type(string_t), allocatable :: messages(:)
    type(diagnostics_t) :: diagnostics
    integer, allocatable :: varied(:)
    integer :: i

    allocate (varied, source=input%groups_named('vary'))
    if (size(varied) > 0) then
      call find_varied(input, varied, numbers, diagnostics)
    else
      call find_varied_numbers(input, labels, [(.false., i=1, size(labels))], numbers, messages)
    end if
  end subroutine find_planned_numbers

  type(factor_t) function factor_of(group) result(factor)
    type(group_t), intent(in) :: group

    factor%distribution = group%text('distribution')
    factor%low = group%number('low', factor%low)
    factor%high = group%number('high', factor%high)
    factor%mean = group%number('mean', factor%mean)
    factor%deviation = group%number('deviation', factor%deviation)
    factor%median = group%number('median', factor%median)
    factor%log_deviation = group%number('log_deviation', factor%log_deviation)
    if (group%has_value('count')) factor%count = group%whole_number('count')
  end function factor_of

  !> Checks what the design requires of a factor, and that its distribution fits its ends.
  subroutine check_factor(input, varied, design, factor, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied   !! index of the &vary
    character(len=*), intent(in) :: design
    type(factor_t), intent(in) :: factor
    type(diagnostics_t), intent(inout) :: diagnostics
    logical :: has_count

    has_count = input%groups(varied)%has_value('count')
    if (design /= 'grid') then
      if (has_count) then
        call input%report(varied, 'count', "count belongs to design = 'grid'; here design = " // quoted(design), diagnostics)
      end if
      if (factor%distribution == 'uniform' .and. factor%high <= factor%low) then
        call input%report(varied, 'high', 'high = ' // to_text(factor%high) // ' is out of range; allowed: > low = ' // &
                         to_text(factor%low), diagnostics)
      else if (can_overflow(factor)) then
        call input%report(varied, 'log_deviation', 'median = ' // to_text(factor%median) // ' and log_deviation = ' // &
                         to_text(factor%log_deviation) // ' reach numbers beyond ' // to_text(huge(factor%high)) // &
                         '; allowed: smaller ones, or high', diagnostics)
      else if (probability_between(factor) <= 0.0_wp) then
        call input%report(varied, 'distribution', 'the distribution has nothing from low to high; allowed: ends ' // &
                         'nearer to its middle', diagnostics)
      end if
      return
    end if
    if (.not. has_count) then
      call input%report(varied, 'count', "count is missing; design = 'grid' needs it", diagnostics)
    else if (factor%count > 1 .and. factor%high <= factor%low) then
      call input%report(varied, 'count', 'count = ' // to_text(factor%count) // ' values from low = ' // &
                       to_text(factor%low) // ' to high = ' // to_text(factor%high) // ' are all the same; allowed: count = 1', &
                       diagnostics)
    end if
    if (factor%distribution /= 'uniform') then
      call input%report(varied, 'distribution', 'distribution = ' // quoted(trim(factor%distribution)) // &
                       " has no grid; allowed with design = 'grid': 'uniform'", diagnostics)
    end if
  end subroutine check_factor

  !> Refuses a grid of integers of which some would be rounded to the same one.
  subroutine check_whole_grid(input, varied, number, factor, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied   !! index of the &vary
    type(varied_number_t), intent(in) :: number
    type(factor_t), intent(in) :: factor
    type(diagnostics_t), intent(inout) :: diagnostics
    real(wp) :: room

    if (factor%distribution /= 'uniform' .or. factor%high <= factor%low) return
    room = anint(factor%high) - anint(factor%low) + 1.0_wp
    if (factor%count <= room) return
    call input%report(varied, 'count', 'count = ' // to_text(factor%count) // ' has repeats: ' // number%path // &
                     ' is a whole number, of which low = ' // to_text(factor%low) // ' to high = ' // to_text(factor%high) // &
                     ' holds ' // to_text(nint(room)) // '; allowed: 1 to ' // to_text(nint(room)), diagnostics)
  end subroutine check_whole_grid

end module nocdyn_sweep_design
