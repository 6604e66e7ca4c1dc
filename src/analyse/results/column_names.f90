!> Names of signals as a person writes them: with or without the unit, and as patterns with *.
module nocdyn_column_names
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_machine, only: machine_t
  use nocdyn_near_words, only: near_match
  use nocdyn_output_units, only: output_units, turn_units
  use nocdyn_patterns, only: matches
  use nocdyn_signals, only: former_name, label_signals, list_signals, signal_t
  use nocdyn_text, only: append, append_new, joined, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: choose_columns, choose_signals, count_columns, explain_no_signal, note_former_name, with_unit

  integer, parameter :: most_names = 16   ! in a message

contains

  !> The columns that &output asks for, ascending: the time, and the ones of the patterns of `columns`; all but the ones of inner
  !> nodes if there are none.
  subroutine choose_columns(input, signals, chosen, notes, error)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)                     !! the time first, in the units of the table
    integer, allocatable, intent(out) :: chosen(:)
    type(string_t), allocatable, intent(inout) :: notes(:)       !! on former names
    type(error_t), allocatable, intent(out) :: error             !! patterns that match nothing
    integer :: output
    logical :: is_chosen(size(signals))

    output = input%position('output')
    if (input%groups(output)%has_value('columns')) then
      call match_patterns(input, output, 'columns', signals, is_chosen, notes, error)
    else
      is_chosen = .not. signals%is_inner()
    end if
    is_chosen(1) = .true.
    allocate (chosen, source=places(is_chosen))
  end subroutine choose_columns

  !> The signals that the key `signals` of &response or &orbit asks for; all without it.
  subroutine choose_signals(input, kind, signals, chosen, notes, error)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind                     !! of the group
    type(signal_t), intent(in) :: signals(:)
    integer, allocatable, intent(out) :: chosen(:)           !! ascending
    type(string_t), allocatable, intent(inout) :: notes(:)   !! on former names
    type(error_t), allocatable, intent(out) :: error         !! patterns that match nothing
    logical :: is_chosen(size(signals))

    is_chosen = .true.
    if (input%groups(input%position(kind))%has_value('signals')) then
      call match_patterns(input, input%position(kind), 'signals', signals, is_chosen, notes, error)
    end if
    allocate (chosen, source=places(is_chosen))
  end subroutine choose_signals

  pure function places(is_chosen) result(chosen)
    logical, intent(in) :: is_chosen(:)
    integer, allocatable :: chosen(:)
    integer :: i

    allocate (chosen, source=pack([(i, i=1, size(is_chosen))], is_chosen))
  end function places

  !> Finds the signals that match some pattern of a key, by their names with or without the unit, or by former names.
  subroutine match_patterns(input, group, key, signals, is_chosen, notes, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group              !! of the input
    character(len=*), intent(in) :: key       !! 'columns' of &output, or 'signals' of &response or &orbit
    type(signal_t), intent(in) :: signals(:)  !! of a run the time first
    logical, intent(out) :: is_chosen(:)         !! [signals]
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(diagnostics_t) :: diagnostics
    type(string_t), allocatable :: labels(:), patterns(:)
    character(len=:), allocatable :: file, former, hint, pattern
    logical :: is_found, is_former, is_response
    integer :: c, i

    is_response = input%groups(group)%kind == 'response'
    file = 'trajectory.csv'
    if (is_response) file = 'response_orders.csv'
    if (input%groups(group)%kind == 'orbit') file = 'orbit.csv'
    call label_signals(signals, labels)
    allocate (patterns, source=input%groups(group)%texts(key))
    is_chosen = .false.
    do i = 1, size(patterns)
      pattern = trim(adjustl(patterns(i)%text))
      is_found = .false.
      is_former = .false.
      do c = 1, size(signals)
        if (signals(c)%is_inner() .and. index(pattern, '[') == 0) cycle
        if (.not. (matches(pattern, labels(c)%text) .or. matches(pattern, signals(c)%name))) then
          call former_name(signals(c), is_response, former)
          if (former == '') cycle
          if (.not. (matches(pattern, former) .or. matches(pattern, former // ' [' // signals(c)%unit // ']'))) cycle
          if (.not. is_former) call note_former_name(input, group, key, former, signals(c)%name, notes)
          is_former = .true.
        end if
        is_chosen(c) = .true.
        is_found = .true.
      end do
      if (is_found) cycle
      call find_hint(pattern, signals(merge(2, 1, key == 'columns'):), labels, hint)
      call input%report(group, key, key // '(' // to_text(i) // ') = ' // quoted(pattern) // ' matches no column of ' // file // &
                        hint, diagnostics)
    end do
    call input%refuse(diagnostics, error)
  end subroutine match_patterns

  !> Notes that an input has a name which a signal had before.
  subroutine note_former_name(input, group, key, former, name, notes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group   !! of the input
    character(len=*), intent(in) :: key, former, name
    type(string_t), allocatable, intent(inout) :: notes(:)

    call append(notes, input%place(group, key) // ': ' // former // ' is called ' // name // &
                       ' now; the next release will not know the former name')
  end subroutine note_former_name

  !> The number of the columns that &output asks for.
  subroutine count_columns(input, machine, count, notes, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    integer, intent(out) :: count
    type(string_t), allocatable, intent(inout) :: notes(:)  !! on former names
    type(error_t), allocatable, intent(out) :: error        !! patterns that match nothing
    type(signal_t), allocatable :: signals(:)
    integer, allocatable :: chosen(:), units(:)

    call list_signals(machine, signals)
    call turn_units(signals, output_units(input), units)
    call choose_columns(input, signals, chosen, notes, error)
    count = size(chosen)
  end subroutine count_columns

  !> What to write instead of a pattern: the nearest name or pattern of names, else the patterns of all names.
  subroutine find_hint(pattern, signals, labels, text)
    character(len=*), intent(in) :: pattern
    type(signal_t), intent(in) :: signals(:)
    type(string_t), intent(in) :: labels(:)
    character(len=:), allocatable, intent(out) :: text
    type(string_t), allocatable :: of_quantities(:)                                     ! e.g. 'phi_*'
    type(string_t) :: names(size(signals)), of_elements(size(signals))                  ! e.g. 'phi_motor', '*_motor'
    integer :: i

    allocate (of_quantities(0))
    do i = 1, size(names)
      associate (one => signals(i))
        names(i)%text = one%name
        of_elements(i)%text = one%name
        if (one%element /= '') of_elements(i)%text = '*' // one%name(len(one%symbol) + 1:)
        if (one%element /= '') call append_new(of_quantities, one%symbol // '_*')
        if (one%element == '') call append_new(of_quantities, one%symbol)
      end associate
    end do
    text = near_match(pattern, of_quantities)
    if (text == '') text = near_match(pattern, names)
    if (text == '') text = near_match(pattern, of_elements)
    if (text == '') text = near_match(pattern // '_*', of_quantities)
    if (text == '') text = near_match('*_' // pattern, of_elements)
    if (text == '' .and. index(pattern, '[') > 0) text = near_match(pattern, labels)
    if (text == '') text = '; allowed: ' // joined(of_quantities, ', ', most_names)
  end subroutine find_hint

  !> The label of a column: the name and, unless it is '', the unit in brackets.
  pure function with_unit(name, unit) result(label)
    character(len=*), intent(in) :: name, unit
    character(len=:), allocatable :: label

    label = name
    if (unit /= '') label = name // ' [' // unit // ']'
  end function with_unit

  !> Why a name that is no signal may have been written, e.g. "; did you mean 'omega_motor'?".
  subroutine explain_no_signal(name, signals, text)
    character(len=*), intent(in) :: name
    type(signal_t), intent(in) :: signals(:)
    character(len=:), allocatable, intent(out) :: text
    type(string_t), allocatable :: labels(:)
    type(string_t) :: names(size(signals))
    integer :: i

    do i = 1, size(signals)
      names(i)%text = signals(i)%name
    end do
    call label_signals(signals, labels)
    text = near_match(name, names)
    if (index(name, '[') > 0) text = near_match(name, labels)
    if (text == '') text = ', which has ' // related_names(name(:index(name // ' [', ' [') - 1), signals, names)
  end subroutine explain_no_signal

  !> The signals of the element or with the symbol that a name may mean; if there are none, the first ones of all.
  pure function related_names(name, signals, names) result(text)
    character(len=*), intent(in) :: name     !! without a unit
    type(signal_t), intent(in) :: signals(:)
    type(string_t), intent(in) :: names(:)   !! of the signals
    character(len=:), allocatable :: text
    type(string_t), allocatable :: related(:)
    integer :: i

    allocate (related(0))
    do i = 1, size(signals)
      if (index(name // '|', '_' // signals(i)%element // '|') > 0 .or. signals(i)%symbol == name .or. &
          signals(i)%element == name) call append(related, names(i)%text)
    end do
    if (size(related) > 0) then
      text = joined(related, ', ', most_names)
    else
      text = joined(names, ', ', most_names)
      if (size(names) > most_names) text = text // ' in its first line'
    end if
  end function related_names

end module nocdyn_column_names
