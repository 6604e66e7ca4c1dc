!> The recorded quantities of a sweep: the statistics and trajectories that the groups &record ask for.
module nocdyn_recorded_quantities
  use nocdyn_analysis_results, only: analysis_result_t
  use nocdyn_column_names, only: explain_no_signal, note_former_name
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_fatigue_statistics, only: fatigue_statistic
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_output_units, only: match_signal, output_units
  use nocdyn_recorded_analyses, only: analysis_reader_t
  use nocdyn_schema_text, only: suggest
  use nocdyn_signals, only: former_name, signal_t
  use nocdyn_statistics, only: is_of_fatigue, new_statistic, statistic_names, statistic_t
  use nocdyn_text, only: quoted, shortened, string_t, to_text
  use nocdyn_variant_analysis, only: matching_quantities, recorded_kinds
  implicit none (type, external)
  private

  public :: read_recorded_quantities, check_quantities, note_former_records, restrict_statistics, wanted_trajectories

  real(wp), parameter :: unknown_start = -huge(1.0_wp)   ! stands for `from` if t_start varies and `from` is not given

  !> The time span of all variants. An end that varies is not known and has its default here.
  type, public :: time_span_t
    real(wp) :: t_start = unknown_start, t_end = huge(1.0_wp)   !! [s]
  end type time_span_t

contains

  !> Reads what is recorded, in the order of the file.
  subroutine read_recorded_quantities(input, reader, signals, span, variants, statistics, analyses, diagnostics)
    type(input_t), intent(in) :: input
    type(analysis_reader_t), intent(in) :: reader
    type(signal_t), intent(in) :: signals(:)   !! of trajectory.csv
    type(time_span_t), intent(in) :: span
    integer, intent(in) :: variants           !! number of variants, huge if it is not known
    type(statistic_t), allocatable, intent(out) :: statistics(:)
    type(analysis_result_t), allocatable, intent(out) :: analyses(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i

    allocate (statistics(0), analyses(0))
    associate (records => input%groups_named(reader%kind))
      do i = 1, size(records)
        associate (group => input%groups(records(i)))
          if (group%has_value('quantity')) then
            call add_statistics(input, records(i), signals, span, size(analyses), statistics, diagnostics)
          else if (group%has_value('fatigue')) then
            call add_fatigue(input, records(i), span, size(analyses), statistics, diagnostics)
          else if (any([group%has_value('mode'), group%has_value('response'), group%has_value('orbit'), &
                        group%has_value('path')])) then
            call reader%add_results(input, records(i), size(statistics), analyses, diagnostics)
          else if (group%kind /= 'record') then
            call diagnostics%add(group%line, records(i), 'no number is named; needed: quantity, fatigue, mode, response, ' // &
                                 'orbit or path')
          else if (.not. group%has_value('trajectories')) then
            call diagnostics%add(group%line, records(i), 'there is nothing to record; needed: quantity, fatigue, mode, ' // &
                                 'response, orbit, path or trajectories')
          end if
          if (group%kind == 'record') call check_trajectories(input, records(i), variants, diagnostics)
        end associate
      end do
    end associate
  end subroutine read_recorded_quantities

  !> Checks the quantities only, as far as an input with errors has them.
  subroutine check_quantities(input, signals, diagnostics)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)   !! of trajectory.csv
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: column, i

    associate (records => input%groups_named('record'))
      do i = 1, size(records)
        if (.not. input%groups(records(i))%has_value('quantity')) cycle
        call find_column(input, records(i), signals, column, diagnostics)
      end do
    end associate
  end subroutine check_quantities

  !> The statistics of a variant that runs from `t_start` to `t_end` [s]. Those that would begin outside of these times begin at
  !> `t_start`, and `message` reports the first of them.
  subroutine restrict_statistics(statistics, t_start, t_end, fitted, message)
    type(statistic_t), intent(in) :: statistics(:)   !! of the plan
    real(wp), intent(in) :: t_start, t_end
    type(statistic_t), allocatable, intent(out) :: fitted(:)
    character(len=:), allocatable, intent(out) :: message   !! '' if all begin within the times
    integer :: i

    message = ''
    allocate (fitted, source=statistics)
    do i = 1, size(fitted)
      if (fitted(i)%from >= t_start .and. fitted(i)%from < t_end) cycle
      if (fitted(i)%from > unknown_start .and. message == '') message = fitted(i)%label // ': from = ' // &
        to_text(fitted(i)%from) // ' is out of range; allowed: from t_start = ' // to_text(t_start) // ' to t_end = ' // &
        to_text(t_end)
      fitted(i)%from = t_start
    end do
  end subroutine restrict_statistics

  subroutine add_statistics(input, record, signals, span, others, statistics, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record   !! index of the &record
    type(signal_t), intent(in) :: signals(:)
    type(time_span_t), intent(in) :: span
    integer, intent(in) :: others   !! results of a variant that are no statistics, so far
    type(statistic_t), allocatable, intent(inout) :: statistics(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(statistic_t) :: statistic
    type(string_t), allocatable :: words(:)
    real(wp), allocatable :: band, from   ! of the group, if it has them
    integer :: column, i, k, unit
    logical :: of_magnitude   ! whether that is kept, and not the largest value

    call find_column(input, record, signals, column, diagnostics, unit)
    call check_from(input, record, span, diagnostics)
    if (column == 0) return
    associate (group => input%groups(record))
      words = group%texts('statistic')
      if (group%has_value('from')) from = group%number('from')
      if (group%has_value('band')) band = group%number('band')
      of_magnitude = any([(words(i)%text == 'max_abs', i=1, size(words))]) &
                     .and. .not. any([(words(i)%text == 'max', i=1, size(words))])
      do i = 1, size(words)
        k = findloc(statistic_names == words(i)%text, .true., dim=1)
        if (k == 0 .or. is_of_fatigue(k)) then
          call input%report(record, 'statistic', 'statistic = ' // quoted(words(i)%text) // ' does not belong to quantity; ' // &
                            'needed: ' // trim(merge('fatigue         ', 'mode or response', k > 0)), diagnostics)
          cycle
        end if
        statistic = new_statistic(signals, column, k, span%t_start, from, band, unit, of_magnitude)
        call append_statistic(input, record, others, statistic, statistics, diagnostics)
      end do
    end associate
  end subroutine add_statistics

  subroutine add_fatigue(input, record, span, others, statistics, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record   !! index of the &record
    type(time_span_t), intent(in) :: span
    integer, intent(in) :: others   !! as in `add_statistics`
    type(statistic_t), allocatable, intent(inout) :: statistics(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(statistic_t), allocatable :: list(:)
    integer :: i

    call list_fatigue_statistics(input, record, span%t_start, list, diagnostics)
    do i = 1, size(list)
      call append_statistic(input, record, others, list(i), statistics, diagnostics)
    end do
  end subroutine add_fatigue

  !> The column of the quantity of a &record, with or without its unit; 0 if there is none. The unit may be one of the field;
  !> without one it is the one of trajectory.csv.
  subroutine find_column(input, record, signals, column, diagnostics, unit)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record
    type(signal_t), intent(in) :: signals(:)
    integer, intent(out) :: column
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, intent(out), optional :: unit   !! of its statistics: index of `units`, 0: SI
    character(len=:), allocatable :: quantity, reason
    integer :: quantity_unit

    quantity = trim(adjustl(input%groups(record)%text('quantity')))
    call match_column(quantity, signals, output_units(input), column, quantity_unit)
    if (present(unit)) unit = quantity_unit
    if (column > 0) return
    call explain_no_signal(quantity, signals, reason)
    call input%report(record, 'quantity', 'quantity = ' // quoted(quantity) // ' is no column of trajectory.csv' // reason, &
                      diagnostics)
  end subroutine find_column

  !> The column that a quantity names; a name of today goes before a former one.
  subroutine match_column(quantity, signals, wanted, column, unit, is_former)
    character(len=*), intent(in) :: quantity
    type(signal_t), intent(in) :: signals(:)
    integer, intent(in) :: wanted(:)         !! units of a quantity without one: indices of `units`
    integer, intent(out) :: column, unit     !! 0 if there is none; index of `units`, 0: SI
    logical, intent(out), optional :: is_former
    integer :: i, other_unit
    logical :: has_former, matches

    column = 0
    unit = 0
    if (present(is_former)) is_former = .false.
    do i = 1, size(signals)
      call match_signal(signals(i), quantity, wanted, matches, other_unit, has_former)
      if (.not. matches .or. (has_former .and. column > 0)) cycle
      column = i
      unit = other_unit
      if (present(is_former)) is_former = has_former
      if (.not. has_former) return
    end do
  end subroutine match_column

  !> Notes on groups &record that name signals as they were called before.
  subroutine note_former_records(input, reader, signals, notes)
    type(input_t), intent(in) :: input
    type(analysis_reader_t), intent(in) :: reader
    type(signal_t), intent(in) :: signals(:)   !! of trajectory.csv
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: former, name
    integer, allocatable :: found(:), records(:)
    integer :: column, i, unit
    logical :: is_former

    allocate (records, source=input%groups_named(reader%kind))
    do i = 1, size(records)
      associate (group => input%groups(records(i)))
        if (group%has_value('quantity')) then
          call match_column(trim(adjustl(group%text('quantity'))), signals, output_units(input), column, unit, is_former)
          if (.not. is_former) cycle
          call former_name(signals(column), .false., former)
          call note_former_name(input, records(i), 'quantity', former, signals(column)%name, notes)
        else if (group%has_value('response')) then
          name = group%text('response')
          found = matching_quantities(reader%quantities, name, recorded_kinds)
          if (size(found) /= 1) cycle
          associate (one => reader%quantities(found(1)))
            if (one%name /= name .and. one%element /= name) call note_former_name(input, records(i), 'response', name, one%name, &
                                                                                  notes)
          end associate
        end if
      end associate
    end do
  end subroutine note_former_records

  subroutine check_from(input, record, span, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record
    type(time_span_t), intent(in) :: span
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: allowed
    real(wp) :: from

    if (.not. input%groups(record)%has_value('from')) return
    from = input%groups(record)%number('from')
    allowed = '< t_end = ' // to_text(span%t_end)
    if (from < span%t_start) allowed = '>= t_start = ' // to_text(span%t_start)
    if (from < span%t_start .or. from >= span%t_end) call input%report(record, 'from', 'from = ' // to_text(from) // &
                                                       ' is out of range; allowed: ' // allowed, diagnostics)
  end subroutine check_from

  !> Appends a statistic that is not recorded yet.
  subroutine append_statistic(input, record, others, statistic, statistics, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record, others   !! as in `add_statistics`
    type(statistic_t), intent(in) :: statistic
    type(statistic_t), allocatable, intent(inout) :: statistics(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(statistic_t), allocatable :: longer(:)
    integer :: k

    if (any([(statistics(k)%label == statistic%label, k=1, size(statistics))])) then
      call input%report(record, 'statistic', quoted(statistic%label) // ' is recorded already; allowed: once', diagnostics)
      return
    end if
    allocate (longer(size(statistics) + 1))
    longer(:size(statistics)) = statistics
    longer(size(longer)) = statistic
    longer(size(longer))%result = others + size(longer)
    call move_alloc(longer, statistics)
  end subroutine append_statistic

  !> The variants whose trajectories are to be written, ascending, each once.
  pure function wanted_trajectories(input) result(wanted)
    type(input_t), intent(in) :: input
    integer, allocatable :: wanted(:)
    integer, allocatable :: numbers(:), records(:)
    integer :: i, k

    allocate (wanted(0))
    allocate (records, source=input%groups_named('record'))
    do i = 1, size(records)
      if (.not. input%groups(records(i))%has_value('trajectories')) cycle
      numbers = input%groups(records(i))%whole_numbers('trajectories')
      do k = 1, size(numbers)
        if (all(wanted /= numbers(k))) wanted = [pack(wanted, wanted < numbers(k)), numbers(k), pack(wanted, wanted > numbers(k))]
      end do
    end do
  end function wanted_trajectories

  subroutine check_trajectories(input, record, variants, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record
    integer, intent(in) :: variants
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, allocatable :: wanted(:)
    integer :: i

    if (.not. input%groups(record)%has_value('trajectories')) return
    allocate (wanted, source=input%groups(record)%whole_numbers('trajectories'))
    do i = 1, size(wanted)
      if (wanted(i) <= variants) cycle
      call input%report(record, 'trajectories', 'trajectories(' // to_text(i) // ') = ' // to_text(wanted(i)) // &
                       ' is out of range; allowed: 1 to ' // to_text(variants) // ', the number of variants', diagnostics)
    end do
  end subroutine check_trajectories

  !> The statistics of a &record with a &fatigue.
  subroutine list_fatigue_statistics(input, record, t_start, list, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record      !! index of the &record
    real(wp), intent(in) :: t_start    !! [s]
    type(statistic_t), allocatable, intent(out) :: list(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: words(:)
    integer :: fatigue, i, k

    allocate (list(0))
    call find_fatigue(input, record, fatigue, diagnostics)
    if (fatigue == 0) return
    allocate (words, source=input%groups(record)%texts('statistic'))
    deallocate (list)
    allocate (list(count([(is_of_fatigue(findloc(statistic_names == words(i)%text, .true., dim=1)), i=1, size(words))])))
    k = 0
    do i = 1, size(words)
      associate (kind => findloc(statistic_names == words(i)%text, .true., dim=1))
        if (is_of_fatigue(kind)) then
          k = k + 1
          list(k) = fatigue_statistic(input, fatigue, kind, t_start)
        else
          call input%report(record, 'statistic', 'statistic = ' // quoted(words(i)%text) // ' does not belong to fatigue; ' // &
                            "allowed: 'damage', 'cycles'", diagnostics)
        end if
      end associate
    end do
  end subroutine list_fatigue_statistics

  !> The &fatigue that a &record names, 0 if there is none.
  subroutine find_fatigue(input, record, fatigue, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record
    integer, intent(out) :: fatigue   !! index in the input
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: hint
    integer, allocatable :: groups(:)
    integer :: i

    allocate (groups, source=input%groups_named('fatigue'))
    allocate (names(size(groups)))
    associate (name => input%groups(record)%values(input%groups(record)%key_position('fatigue'))%texts(1)%text)
      do i = 1, size(groups)
        names(i)%text = input%groups(groups(i))%name
        if (names(i)%text /= name) cycle
        fatigue = groups(i)
        return
      end do
      fatigue = 0
      call suggest(name, names, hint)
      call input%report(record, 'fatigue', 'fatigue: there is no &fatigue ' // quoted(shortened(name)), diagnostics, hint=hint)
    end associate
  end subroutine find_fatigue

end module nocdyn_recorded_quantities
