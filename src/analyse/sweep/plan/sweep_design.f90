!> What a sweep varies, and the values of each variant: &sweep and &vary, or the file of a list.
module nocdyn_sweep_design
  use nocdyn_checksums, only: checksum_digits
  use nocdyn_designs, only: design_t, factor_t, grid_design, grid_size, latin_design, leaves_numbers, list_design, &
    most_variants, probability_between, random_design, sobol_design
  use nocdyn_errors, only: error_t, exit_file
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_mistakes, only: mistakes_t, no_line
  use nocdyn_sobol_points, only: most_dimensions
  use nocdyn_sweep_mistakes, only: add_mistake
  use nocdyn_table_file, only: read_list_text
  use nocdyn_target_company, only: find_targets, target_at
  use nocdyn_targets, only: target_t
  use nocdyn_text, only: quoted, string_t, to_text
  use nocdyn_text_file, only: path_in, read_text_file
  implicit none (type, external)
  private

  public :: read_design, find_varied

contains

  !> Targets and design; the design is allocated if there is no mistake.
  subroutine read_design(input, sweep, targets, design, list_checksum, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: sweep   !! index of &sweep
    type(target_t), allocatable, intent(out) :: targets(:)
    class(design_t), allocatable, intent(out) :: design
    character(len=:), allocatable, intent(out) :: list_checksum   !! of the file's bytes; '' without a list
    type(mistakes_t), intent(inout) :: mistakes
    type(factor_t), allocatable :: factors(:)
    real(wp), allocatable :: values(:, :)
    integer :: before

    before = mistakes%count
    list_checksum = ''
    associate (group => input%groups(sweep), varied => input%groups_named('vary'))
      if (group%text('design') == 'list') then
        call read_list(input, sweep, targets, values, list_checksum, mistakes)
        call refuse_varied(input, varied, mistakes)
        call refuse_overrides(input, [integer ::], targets, mistakes)
        if (mistakes%count == before) allocate (design, source=list_design(values))
      else
        call read_varied(input, sweep, varied, targets, factors, mistakes)
        call refuse_overrides(input, varied, targets, mistakes)
        if (mistakes%count == before) call make_design(group, factors, design)
      end if
    end associate
  end subroutine read_design

  !> The design of &vary.
  subroutine make_design(group, factors, design)
    type(group_t), intent(in) :: group   !! &sweep
    type(factor_t), intent(in) :: factors(:)
    class(design_t), allocatable, intent(out) :: design
    integer :: samples, seed

    samples = 0
    seed = 0
    if (group%has_value('samples')) samples = group%whole_number('samples')
    if (group%has_value('seed')) seed = group%whole_number('seed')
    select case (group%text('design'))
    case ('grid')
      allocate (design, source=grid_design(factors))
    case ('random')
      allocate (design, source=random_design(factors, samples, seed))
    case ('latin')
      allocate (design, source=latin_design(factors, samples, seed))
    case ('sobol')
      allocate (design, source=sobol_design(factors, samples, seed))
    case default
      error stop 'nocdyn_sweep_design: the schema allows a design that is not there'
    end select
  end subroutine make_design

  !> The targets in the first line of a file, and the values in the others.
  subroutine read_list(input, sweep, targets, values, list_checksum, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: sweep
    type(target_t), allocatable, intent(out) :: targets(:)
    real(wp), allocatable, intent(out) :: values(:, :)   !! [targets, variants]
    character(len=:), allocatable, intent(inout) :: list_checksum
    type(mistakes_t), intent(inout) :: mistakes
    type(error_t), allocatable :: error
    type(string_t), allocatable :: complaints(:), names(:), paths(:), units(:)
    character(len=:), allocatable :: file, text
    integer :: i, line

    allocate (targets(0))
    file = path_in(input%file(:index(input%file, '/', back=.true.)), input%groups(sweep)%text('file'))
    call read_text_file(file, text, error)
    if (allocated(error)) then
      call add_mistake(input, sweep, 'file', 'file: ' // error%message, mistakes, exit_file)
      return
    end if
    list_checksum = checksum_digits(text)
    call read_list_text(text, file, names, line, values, complaints)
    do i = 1, size(complaints)
      call add_mistake(input, sweep, 'file', 'file: ' // complaints(i)%text, mistakes)
    end do
    call take_units_off(names, paths, units)
    call find_targets(input, paths, targets, complaints)
    do i = 1, size(paths)
      if (complaints(i)%text == '' .and. units(i)%text /= '' .and. units(i)%text /= targets(i)%unit) then
        complaints(i)%text = 'another unit; needed: ' // paths(i)%text
        if (targets(i)%unit /= '') complaints(i)%text = complaints(i)%text // ' [' // targets(i)%unit // ']'
      end if
      if (complaints(i)%text == '') cycle
      call add_mistake(input, sweep, 'file', 'file: ' // file // ':' // to_text(line) // ': column ' // to_text(i) // ', ' // &
                       quoted(names(i)%text) // ': ' // complaints(i)%text, mistakes)
    end do
  end subroutine read_list

  !> "load.work.viscous [N m s/rad]", as sweep.csv has it.
  subroutine take_units_off(names, paths, units)
    type(string_t), intent(in) :: names(:)
    type(string_t), allocatable, intent(out) :: paths(:), units(:)   !! '' where there is no unit
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
  end subroutine take_units_off

  subroutine refuse_varied(input, varied, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied(:)
    type(mistakes_t), intent(inout) :: mistakes
    integer :: i

    do i = 1, size(varied)
      call mistakes%add(input%groups(varied(i))%line, varied(i), &
                        "design = 'list' takes targets and values from its file; allowed: no &vary")
    end do
  end subroutine refuse_varied

  !> An override of a number that varies would be without effect.
  subroutine refuse_overrides(input, varied, targets, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied(:)   !! the &vary of each target; none if these are those of a list
    type(target_t), intent(in) :: targets(:)
    type(mistakes_t), intent(inout) :: mistakes
    character(len=:), allocatable :: source
    integer :: i, t

    do i = 1, size(input%overrides)
      associate (text => input%overrides(i)%text)
        t = target_at(input, targets, text(:index(text, '=') - 1))
      end associate
      if (t == 0) cycle
      if (size(varied) == 0) then
        source = 'column ' // to_text(t) // ' of the list gives this number its values'
      else
        source = 'the &vary on line ' // to_text(input%groups(varied(t))%line) // ' gives this number its values; to ' // &
                 'change those, write vary(' // to_text(t) // ').KEY=VALUE'
      end if
      call mistakes%add(no_line, 0, 'has no effect on a sweep: ' // source, i)
    end do
  end subroutine refuse_overrides

  !> The targets and factors of all &vary.
  subroutine read_varied(input, sweep, varied, targets, factors, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: sweep, varied(:)
    type(target_t), allocatable, intent(out) :: targets(:)
    type(factor_t), allocatable, intent(out) :: factors(:)
    type(mistakes_t), intent(inout) :: mistakes
    character(len=:), allocatable :: design
    integer :: i

    design = input%groups(sweep)%text('design')
    call find_varied(input, varied, targets, mistakes)
    allocate (factors(size(varied)))
    do i = 1, size(varied)
      factors(i) = factor_of(input%groups(varied(i)))
      call check_factor(input, varied(i), design, factors(i), mistakes)
      if (design == 'grid' .and. targets(i)%is_whole) call check_whole_grid(input, varied(i), targets(i), factors(i), mistakes)
    end do
    if (size(varied) == 0) then
      call add_mistake(input, sweep, 'design', 'design = ' // quoted(design) // ' has nothing to vary; needed: a &vary', mistakes)
    else if (design == 'sobol' .and. size(varied) > most_dimensions) then
      call add_mistake(input, sweep, 'design', "design = 'sobol' varies at most " // to_text(most_dimensions) // &
                       ' numbers; here vary ' // to_text(size(varied)), mistakes)
    else if (design == 'grid' .and. grid_size(factors) > most_variants) then
      call add_mistake(input, sweep, 'design', 'the grid has too many variants; allowed: at most ' // to_text(most_variants) // &
                       ' by the product of all count', mistakes)
    end if
  end subroutine read_varied

  !> The targets of all &vary, as far as they are there.
  subroutine find_varied(input, varied, targets, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied(:)
    type(target_t), allocatable, intent(out) :: targets(:)
    type(mistakes_t), intent(inout) :: mistakes
    type(string_t), allocatable :: complaints(:), paths(:)
    integer :: i

    allocate (paths(size(varied)))
    do i = 1, size(varied)
      paths(i)%text = ''
      if (input%groups(varied(i))%has_value('target')) paths(i)%text = input%groups(varied(i))%text('target')
    end do
    call find_targets(input, paths, targets, complaints)
    do i = 1, size(varied)
      if (complaints(i)%text == '' .or. .not. input%groups(varied(i))%has_value('target')) cycle
      call add_mistake(input, varied(i), 'target', 'target = ' // quoted(paths(i)%text) // ': ' // complaints(i)%text, mistakes)
    end do
  end subroutine find_varied

  function factor_of(group) result(factor)
    type(group_t), intent(in) :: group
    type(factor_t) :: factor

    factor%distribution = group%text('distribution')
    factor%low = group%number('low', factor%low)
    factor%high = group%number('high', factor%high)
    factor%mean = group%number('mean', factor%mean)
    factor%deviation = group%number('deviation', factor%deviation)
    factor%median = group%number('median', factor%median)
    factor%log_deviation = group%number('log_deviation', factor%log_deviation)
    if (group%has_value('count')) factor%count = group%whole_number('count')
  end function factor_of

  !> What the design asks of a factor, and the distribution of its ends.
  subroutine check_factor(input, varied, design, factor, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied   !! index of the &vary
    character(len=*), intent(in) :: design
    type(factor_t), intent(in) :: factor
    type(mistakes_t), intent(inout) :: mistakes
    logical :: has_count

    has_count = input%groups(varied)%has_value('count')
    if (design /= 'grid') then
      if (has_count) then
        call add_mistake(input, varied, 'count', "count belongs to design = 'grid'; here design = " // quoted(design), mistakes)
      end if
      if (factor%distribution == 'uniform' .and. factor%high <= factor%low) then
        call add_mistake(input, varied, 'high', 'high = ' // to_text(factor%high) // ' is out of range; allowed: > low = ' // &
                         to_text(factor%low), mistakes)
      else if (leaves_numbers(factor)) then
        call refuse_overflow(input, varied, factor, mistakes)
      else if (probability_between(factor) <= 0.0_wp) then
        call add_mistake(input, varied, 'distribution', 'the distribution has nothing from low to high; allowed: ends ' // &
                         'nearer to its middle', mistakes)
      end if
      return
    end if
    if (.not. has_count) then
      call add_mistake(input, varied, 'count', "count is missing; design = 'grid' needs it", mistakes)
    else if (factor%count > 1 .and. factor%high <= factor%low) then
      call add_mistake(input, varied, 'count', 'count = ' // to_text(factor%count) // ' values from low = ' // &
                       to_text(factor%low) // ' to high = ' // to_text(factor%high) // ' are all the same; allowed: count = 1', &
                       mistakes)
    else if (factor%distribution == 'uniform' .and. factor%count > 1 .and. leaves_numbers(factor)) then
      call refuse_overflow(input, varied, factor, mistakes)
    end if
    if (factor%distribution /= 'uniform') then
      call add_mistake(input, varied, 'distribution', 'distribution = ' // quoted(trim(factor%distribution)) // &
                       " has no grid; allowed with design = 'grid': 'uniform'", mistakes)
    end if
  end subroutine check_factor

  subroutine refuse_overflow(input, varied, factor, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied   !! index of the &vary
    type(factor_t), intent(in) :: factor
    type(mistakes_t), intent(inout) :: mistakes
    character(len=:), allocatable :: most

    most = to_text(huge(factor%high))
    select case (factor%distribution)
    case ('uniform')
      call add_mistake(input, varied, 'high', 'high = ' // to_text(factor%high) // ' is too far from low = ' // &
                       to_text(factor%low) // '; allowed: high - low at most ' // most, mistakes)
    case ('normal')
      call add_mistake(input, varied, 'deviation', 'mean = ' // to_text(factor%mean) // ' and deviation = ' // &
                       to_text(factor%deviation) // ' reach numbers beyond ' // most // &
                       '; allowed: smaller ones, or low and high', mistakes)
    case default
      call add_mistake(input, varied, 'log_deviation', 'median = ' // to_text(factor%median) // ' and log_deviation = ' // &
                       to_text(factor%log_deviation) // ' reach numbers beyond ' // most // &
                       '; allowed: smaller ones, or high', mistakes)
    end select
  end subroutine refuse_overflow

  !> Values of a whole number must not round to the same one.
  subroutine check_whole_grid(input, varied, target, factor, mistakes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: varied   !! index of the &vary
    type(target_t), intent(in) :: target
    type(factor_t), intent(in) :: factor
    type(mistakes_t), intent(inout) :: mistakes
    real(wp) :: room

    if (factor%distribution /= 'uniform' .or. factor%high <= factor%low .or. leaves_numbers(factor)) return
    room = anint(factor%high) - anint(factor%low) + 1.0_wp
    if (factor%count <= room) return
    call add_mistake(input, varied, 'count', 'count = ' // to_text(factor%count) // ' has repeats: ' // target%path // &
                     ' is a whole number, of which low = ' // to_text(factor%low) // ' to high = ' // to_text(factor%high) // &
                     ' holds ' // to_text(nint(room)) // '; allowed: 1 to ' // to_text(nint(room)), mistakes)
  end subroutine check_whole_grid

end module nocdyn_sweep_design
