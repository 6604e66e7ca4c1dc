!> The plan of a sweep: targets, design and recorded quantities, as its input describes them. All errors in the groups of the
!> sweep are reported at once.
module nocdyn_sweep_plan
  use nocdyn_analysis_results, only: analysis_names, analysis_result_t, of_branch, of_orbit, of_path
  use nocdyn_column_names, only: count_columns
  use nocdyn_designs, only: design_t, list_design
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: add_error, error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_output_units, only: output_units
  use nocdyn_output_times, only: check_output_times, table_bytes
  use nocdyn_recorded_analyses, only: analysis_reader_t, new_analysis_reader
  use nocdyn_recorded_quantities, only: check_quantities, note_former_records, read_recorded_quantities, time_span_t, &
    wanted_trajectories
  use nocdyn_row_intervals, only: choose_row_count
  use nocdyn_schema, only: first_key, has_word, key_rules
  use nocdyn_signals, only: signal_t
  use nocdyn_statistics, only: statistic_names, statistic_t
  use nocdyn_sweep_design, only: find_varied, read_design
  use nocdyn_sweep_header, only: curve_axis_t, stored_quantity_t, sweep_header_t
  use nocdyn_targets, only: set_targets, target_t
  use nocdyn_text, only: counted, string_t, to_text
  use nocdyn_units, only: from_si, unit_for, unit_hz, units
  use nocdyn_varied_numbers, only: find_varied_numbers, varied_numbers_t
  use nocdyn_variant_signals, only: list_variant_signals
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  public :: make_plan, make_point_plan, add_plan_diagnostics, new_sweep_header, has_sweep, remove_sweep, without_sweep

  character(len=*), parameter :: kinds = 'sweep vary record'   ! of the groups of a sweep

  type, public :: sweep_plan_t
    type(input_t) :: input                            !! of the base machine and the sweep
    type(machine_t) :: machine                        !! the base machine, one lane
    type(design_t), allocatable :: design
    type(varied_numbers_t) :: numbers                 !! that the design varies
    type(statistic_t), allocatable :: statistics(:)
    type(analysis_result_t), allocatable :: analyses(:)   !! results of modes and of the response
    type(curve_axis_t) :: axis                        !! of curves
    integer, allocatable :: trajectories(:)           !! variants whose trajectories are written, ascending
    integer :: columns = 0                            !! of each trajectory
    type(string_t), allocatable :: notes(:)           !! for the user
    character(len=:), allocatable :: list_checksum    !! of the file of a list, '' if there is none
  contains
    procedure :: values, results, varies_key, summary, file_bytes
  end type sweep_plan_t

contains

  !> Makes the plan from the groups of the sweep. `nocdyn run` must accept the base machine.
  subroutine make_plan(input, plan, error)
    type(input_t), intent(in) :: input   !! read without errors
    type(sweep_plan_t), intent(out) :: plan
    type(error_t), allocatable, intent(out) :: error
    type(diagnostics_t) :: diagnostics
    type(error_t), allocatable :: failure
    integer, allocatable :: sweeps(:)
    integer :: variants

    allocate (sweeps, source=input%groups_named('sweep'))
    if (size(sweeps) == 0) then
      call raise(error, exit_input, input%shown_file() // ": there is no &sweep; 'nocdyn help input sweep' shows one")
      return
    end if
    plan%input = input
    call read_design(input, sweeps(1), plan%numbers, plan%design, plan%list_checksum, diagnostics)
    variants = huge(variants)
    if (allocated(plan%design)) variants = plan%design%variants
    call read_quantities('record', variants, plan, diagnostics, failure)
    if (.not. allocated(failure)) then
      call refuse_varied_axis(plan, diagnostics)
      allocate (plan%trajectories, source=wanted_trajectories(input))
      if (plan%results() == 0 .and. diagnostics%count == 0) call input%report(sweeps(1), 'design', &
        'no number of the variants is kept; needed: a &record with quantity, fatigue, mode, response, orbit or path', diagnostics)
      if (size(plan%trajectories) > 0) call check_output_times(input, diagnostics)
      call count_columns(input, plan%machine, plan%columns, plan%notes, failure)
    end if
    call input%refuse(diagnostics, error)
    call add_error(error, failure)
  end subroutine make_plan

  !> The plan of a machine whose numbers are chosen later: the groups of a kind name what is computed. The design is a list of one
  !> point, 0 in all; another list takes its place.
  subroutine make_point_plan(input, paths, kind, plan, error)
    type(input_t), intent(in) :: input
    type(string_t), intent(in) :: paths(:)     !! of the numbers
    character(len=*), intent(in) :: kind       !! a group with the keys of &record
    type(sweep_plan_t), intent(out) :: plan
    type(error_t), allocatable, intent(out) :: error
    type(diagnostics_t) :: diagnostics
    type(error_t), allocatable :: failure
    type(string_t), allocatable :: messages(:)
    logical :: are_relative(size(paths))
    real(wp) :: origin(size(paths), 1)
    integer :: i

    plan%input = input
    plan%list_checksum = ''
    are_relative = .false.
    origin = 0.0_wp
    call find_varied_numbers(input, paths, are_relative, plan%numbers, messages)
    i = findloc([(messages(i)%text /= '', i=1, size(messages))], .true., dim=1)
    if (i > 0) then
      call raise(error, exit_input, input%shown_file() // ': ' // messages(i)%text)
      return
    end if
    allocate (plan%design, source=list_design(origin))
    allocate (plan%trajectories(0))
    call read_quantities(kind, 1, plan, diagnostics, failure)
    call input%refuse(diagnostics, error)
    call add_error(error, failure)
  end subroutine make_point_plan

  !> Reads what is computed of each variant, with the base machine.
  subroutine read_quantities(kind, variants, plan, diagnostics, error)
    character(len=*), intent(in) :: kind      !! of the groups that name it
    integer, intent(in) :: variants           !! huge if the number is not known
    type(sweep_plan_t), intent(inout) :: plan !! with the input and the numbers
    type(diagnostics_t), intent(inout) :: diagnostics
    type(error_t), allocatable, intent(out) :: error
    type(analysis_reader_t) :: reader
    type(signal_t), allocatable :: signals(:)

    call list_variant_signals(plan%input, plan%numbers%targets, plan%machine, signals, error)
    if (.not. allocated(error)) call new_analysis_reader(plan%input, plan%machine, kind, reader, error)
    if (allocated(error)) return
    call read_recorded_quantities(plan%input, reader, signals, fixed_span(plan%input, plan%numbers%targets), variants, &
                                  plan%statistics, plan%analyses, diagnostics)
    allocate (plan%notes(0))
    call note_former_records(plan%input, reader, signals, plan%notes)
    call set_axis(plan%input, reader, plan%axis)
  end subroutine read_quantities

  !> What curves are over: the speeds of &response, or its frequencies.
  subroutine set_axis(input, reader, axis)
    type(input_t), intent(in) :: input
    type(analysis_reader_t), intent(in) :: reader
    type(curve_axis_t), intent(out) :: axis
    integer :: unit

    if (.not. allocated(reader%settings%speeds)) return   ! nothing over the speed is kept
    if (reader%settings%axis%is_frequency) then
      axis%label = 'frequency'
      unit = unit_hz
    else
      axis%label = 'omega_' // input%groups(reader%settings%group)%text('body')
      unit = unit_for('rad/s', output_units(input))
    end if
    axis%unit = 'rad/s'
    if (unit > 0) axis%unit = trim(units(unit)%name)
    axis%points = from_si(reader%settings%speeds, unit)
  end subroutine set_axis

  !> Refuses curves over speeds that differ between variants.
  subroutine refuse_varied_axis(plan, diagnostics)
    type(sweep_plan_t), intent(in) :: plan
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=*), parameter :: grid = 'speed frequency count'
    integer :: i

    if (.not. any(plan%analyses%is_curve())) return
    do i = 1, size(plan%numbers%targets)
      associate (target => plan%numbers%targets(i), group => plan%input%groups(plan%numbers%targets(i)%group))
        if (group%kind /= 'response') cycle
        associate (key => key_rules(first_key(group%rule) + target%key - 1)%name)
          if (.not. has_word(grid, trim(key))) cycle
          call plan%input%report(target%group, trim(key), trim(key) // " varies, and a &record with statistic = 'curve' " // &
                                 'compares the variants at the same speeds; allowed: one of both', diagnostics)
          return
        end associate
      end associate
    end do
  end subroutine refuse_varied_axis

  !> Adds wrong targets and quantities to the error of an input that cannot be read, if all its errors are in groups of the sweep
  !> and there are targets: the columns can depend on them.
  subroutine add_plan_diagnostics(input, diagnostics, error)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(inout) :: diagnostics   !! of reading the input
    type(error_t), allocatable, intent(inout) :: error
    type(error_t), allocatable :: failure
    type(machine_t) :: machine
    type(signal_t), allocatable :: signals(:)
    type(varied_numbers_t) :: numbers
    integer, allocatable :: varied(:)
    integer :: i

    if (diagnostics%count == 0) return
    do i = 1, diagnostics%count
      if (diagnostics%list(i)%group == 0) return
      if (.not. has_word(kinds, input%groups(diagnostics%list(i)%group)%kind)) return
    end do
    allocate (varied, source=input%groups_named('vary'))
    call find_varied(input, varied, numbers, diagnostics)
    call list_variant_signals(input, numbers%targets, machine, signals, failure)
    if (size(varied) > 0 .and. .not. allocated(failure)) call check_quantities(input, signals, diagnostics)
    deallocate (error)   ! its mistakes are among the diagnostics
    call input%refuse(diagnostics, error)
    call add_error(error, failure)
  end subroutine add_plan_diagnostics

  !> The numbers of a variant: the ones of the design, rounded where they are integers.
  pure subroutine values(self, variant, x)
    class(sweep_plan_t), intent(in) :: self
    integer, intent(in) :: variant   !! 1 to `design%variants`
    real(wp), intent(out) :: x(:)    !! [numbers]

    call self%design%values(variant, x)
    call self%numbers%round(x)
  end subroutine values

  !> Number of results of each variant.
  pure integer function results(self)
    class(sweep_plan_t), intent(in) :: self

    results = size(self%statistics) + size(self%analyses)
  end function results

  !> Whether the design varies a key of some elements.
  pure logical function varies_key(self, key)
    class(sweep_plan_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: i

    varies_key = .false.
    do i = 1, size(self%numbers%targets)
      associate (target => self%numbers%targets(i))
        if (key_rules(first_key(self%input%groups(target%group)%rule) + target%key - 1)%name == key) varies_key = .true.
      end associate
    end do
  end function varies_key

  !> E.g. 'random, 100000 variants that differ in 2 numbers, 7 results'.
  function summary(self) result(text)
    class(sweep_plan_t), intent(in) :: self
    character(len=:), allocatable :: text
    type(group_t) :: group

    group = self%input%single('sweep')
    text = group%text('design') // ', ' // &
           counted(self%design%variants, 'variant that differs in ', 'variants that differ in ') // &
           counted(self%design%varied, 'number', 'numbers') // ', ' // counted(self%results(), 'result', 'results')
    if (size(self%trajectories) > 0) text = text // ', ' // counted(size(self%trajectories), 'trajectory', 'trajectories')
  end function summary

  !> About how much the journal and the results of some variants take [bytes], the trajectories included.
  real(wp) function file_bytes(self, variants, has_table)
    class(sweep_plan_t), intent(in) :: self
    integer, intent(in) :: variants      !! of the journal
    logical, intent(in) :: has_table     !! whether there is a sweep.csv
    real(wp), parameter :: of_number = 8.0_wp, of_status = 8.0_wp
    integer :: columns, rows
    type(string_t), allocatable :: notes(:)

    columns = size(self%numbers%list) + self%results()
    file_bytes = 2 * real(variants, wp) * (of_number * columns + of_status)   ! journal and sweep.nc
    if (has_table) file_bytes = file_bytes + table_bytes(variants, columns + 2)
    if (size(self%trajectories) == 0) return
    allocate (notes(0))
    call choose_row_count(self%input, self%machine, rows, notes)
    file_bytes = file_bytes + size(self%trajectories) * table_bytes(rows, self%columns)
  end function file_bytes

  !> The time span of the base machine, as far as it does not vary.
  pure type(time_span_t) function fixed_span(input, targets) result(span)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    integer :: i

    i = input%position('run')
    associate (run => input%groups(i))
      if (.not. any(targets%group == i .and. targets%key == run%key_position('t_start'))) span%t_start = run%number('t_start')
      if (.not. any(targets%group == i .and. targets%key == run%key_position('t_end'))) span%t_end = run%number('t_end')
    end associate
  end function fixed_span

  !> The header of the files of a shard.
  type(sweep_header_t) function new_sweep_header(plan, shard, shards) result(header)
    type(sweep_plan_t), intent(in) :: plan
    integer, intent(in) :: shard, shards   !! 1 of 1 is the whole sweep
    type(group_t) :: group
    integer :: i

    header%title = plan%input%title()
    header%source = 'nocdyn ' // version // ' (' // compiler_text // ')'
    group = plan%input%single('sweep')
    header%design = group%text('design')
    if (group%has_value('seed')) header%seed = group%whole_number('seed')
    header%input_file = plan%input%file
    header%input_text = input_text(plan%input)
    header%list_checksum = plan%list_checksum
    header%variants = plan%design%variants
    header%first = first_of_shard(header%variants, shard, shards)
    header%last = first_of_shard(header%variants, shard + 1, shards) - 1
    allocate (header%parameters(size(plan%numbers%list)), header%results(plan%results()))
    do i = 1, size(plan%numbers%list)
      associate (one => plan%numbers%list(i))
        call set_quantity(one%path, one%unit, one%long_name, header%parameters(i))
      end associate
    end do
    do i = 1, size(plan%statistics)
      associate (one => plan%statistics(i))
        call set_quantity(one%label, one%unit, one%long_name, header%results(one%result))
        call set_facts(one%signal, trim(statistic_names(one%kind)), header%results(one%result))
      end associate
    end do
    do i = 1, size(plan%analyses)
      associate (one => plan%analyses(i))
        call set_quantity(one%label, one%unit, one%long_name, header%results(one%result))
        if (one%mode == of_path) then
          header%results(one%result)%facts(1)%text = 'path'
          header%results(one%result)%facts(3)%text = one%command
          header%results(one%result)%facts(6)%text = one%path
        else if (one%mode == of_orbit .and. one%quantity == of_branch) then
          header%results(one%result)%facts(1)%text = 'orbit'
          header%results(one%result)%facts(2)%text = one%word
        else if (one%mode == of_orbit) then
          call set_facts(one%signal, 'orbit_' // one%word, header%results(one%result))
        else if (one%mode == 0) then
          call set_facts(one%signal, trim(analysis_names(one%statistic)), header%results(one%result))
        else
          header%results(one%result)%facts(1)%text = 'mode'
          header%results(one%result)%facts(2)%text = trim(analysis_names(one%statistic))
          header%results(one%result)%facts(3)%text = 'mode'
          header%results(one%result)%facts(4)%text = to_text(one%mode)
        end if
        header%results(one%result)%point = one%point
      end associate
    end do
    if (any(plan%analyses%is_curve())) header%axis = plan%axis
  end function new_sweep_header

  !> The first variant of a shard. Shards are equal, but for one variant more in the first ones if there is a remainder.
  pure integer function first_of_shard(variants, shard, shards) result(first)
    integer, intent(in) :: variants, shard, shards

    first = (shard - 1) * (variants / shards) + min(shard - 1, mod(variants, shards)) + 1
  end function first_of_shard

  subroutine set_quantity(label, unit, long_name, quantity)
    character(len=*), intent(in) :: label, unit, long_name
    type(stored_quantity_t), intent(out) :: quantity
    integer :: k

    quantity%label = label
    quantity%unit = unit
    quantity%long_name = long_name
    do k = 1, size(quantity%facts)
      quantity%facts(k)%text = ''
    end do
  end subroutine set_quantity

  !> What is known of the signal of a result, in the order of `fact_names`.
  subroutine set_facts(signal, statistic, quantity)
    type(signal_t), intent(in) :: signal
    character(len=*), intent(in) :: statistic
    type(stored_quantity_t), intent(inout) :: quantity

    quantity%facts(1)%text = signal%symbol
    quantity%facts(2)%text = statistic
    quantity%facts(3)%text = signal%element_kind
    quantity%facts(4)%text = signal%element
    quantity%facts(5)%text = signal%point
    quantity%facts(6)%text = signal%caption
    quantity%facts(7)%text = signal%positive
  end subroutine set_facts

  !> Whether an input has groups of a sweep.
  pure logical function has_sweep(input)
    type(input_t), intent(in) :: input
    integer :: i

    has_sweep = any([(has_word(kinds, input%groups(i)%kind), i=1, size(input%groups))])
  end function has_sweep

  !> The input without the groups of the sweep.
  pure type(input_t) function without_sweep(input) result(machine_input)
    type(input_t), intent(in) :: input
    logical :: is_kept(size(input%groups))
    integer :: i, kept

    is_kept = [(.not. has_word(kinds, input%groups(i)%kind), i=1, size(input%groups))]
    machine_input%file = input%file
    allocate (machine_input%overrides, source=input%overrides)
    allocate (machine_input%groups(count(is_kept)))
    kept = 0
    do i = 1, size(input%groups)
      if (.not. is_kept(i)) cycle
      kept = kept + 1
      machine_input%groups(kept) = input%groups(i)
    end do
  end function without_sweep

  !> Removes the groups of the sweep from an input, or a load case.
  pure subroutine remove_sweep(input)
    type(input_t), intent(inout) :: input
    type(input_t) :: kept

    if (.not. allocated(input%groups)) return   ! a load case that is not wanted
    if (.not. has_sweep(input)) return
    kept = without_sweep(input)
    call move_alloc(kept%groups, input%groups)
  end subroutine remove_sweep

end module nocdyn_sweep_plan
