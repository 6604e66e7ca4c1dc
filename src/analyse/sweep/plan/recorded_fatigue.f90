!> The damages and numbers of cycles of a sweep that the groups &record ask for.
module nocdyn_recorded_fatigue
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_fatigue_groups, only: element_kind, fatigue_symbol, quantity_of, quantity_units
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema_text, only: suggestion
  use nocdyn_signals, only: signal_t
  use nocdyn_statistics, only: is_of_fatigue, new_fatigue_statistic, statistic_names, statistic_t
  use nocdyn_text, only: quoted, shortened, string_t
  implicit none (type, external)
  private

  public :: list_fatigue_statistics

contains

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
          list(k) = statistic_of(input, fatigue, kind, t_start)
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
      call input%report(record, 'fatigue', 'fatigue: there is no &fatigue ' // quoted(shortened(name)) // &
                        suggestion(name, names), diagnostics)
    end associate
  end subroutine find_fatigue

  !> A statistic of a &fatigue. It begins where its cycles are counted in a run.
  type(statistic_t) function statistic_of(input, fatigue, kind, t_start) result(statistic)
    type(input_t), intent(in) :: input
    integer, intent(in) :: fatigue, kind   !! index of the &fatigue; statistic_...
    real(wp), intent(in) :: t_start        !! [s]
    type(signal_t) :: signal
    real(wp) :: from

    from = input%groups(input%position('output'))%number('extremes_from', absent=t_start)
    associate (group => input%groups(fatigue))
      signal%element_kind = trim(element_kind(group))
      signal%element = group%text(signal%element_kind)
      signal%symbol = trim(fatigue_symbol(group))
      signal%point = ''
      signal%caption = 'signal whose cycles are counted'
      signal%positive = ''
      signal%name = signal%symbol // '_' // signal%element
      signal%unit = trim(quantity_units(quantity_of(group)))
      statistic = new_fatigue_statistic(group%name, fatigue, signal, kind, from)
      if (element_kind(group) /= 'shaft') return
      statistic%shaft = signal%element
      statistic%is_stress = signal%symbol == 'stress'
    end associate
  end function statistic_of

end module nocdyn_recorded_fatigue
