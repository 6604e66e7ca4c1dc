!> Names of columns of trajectory.csv as a person writes them: with or without the unit, and as patterns with *.
module nocdyn_column_names
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t, raise
  use nocdyn_input, only: input_t
  use nocdyn_machine, only: machine_t
  use nocdyn_output_units, only: output_units, turn_labels
  use nocdyn_near_words, only: nearest_word
  use nocdyn_patterns, only: matches
  use nocdyn_text, only: append, joined, quoted, string_t, to_text
  use nocdyn_trajectory_columns, only: column_count, column_t, list_columns
  implicit none (type, external)
  private

  public :: choose_columns, count_columns, explain_no_column, quantity_of

  integer, parameter :: most_names = 16   ! in a message

contains

  !> The columns that &output asks for, ascending: the time, and those of the patterns of `columns`; all if there are none.
  subroutine choose_columns(input, labels, chosen, error)
    type(input_t), intent(in) :: input
    type(string_t), intent(in) :: labels(:)                 !! of all columns, that of the time first
    integer, allocatable, intent(out) :: chosen(:)
    type(error_t), allocatable, intent(out) :: error        !! patterns that match nothing
    type(diagnostics_t) :: diagnostics
    type(string_t), allocatable :: patterns(:)
    character(len=:), allocatable :: pattern
    logical :: is_chosen(size(labels)), is_found
    integer :: c, i, output

    output = input%position('output')
    allocate (patterns, source=input%groups(output)%texts('columns'))
    is_chosen = size(patterns) == 0 .and. .not. [(is_of_node(labels(c)%text), c=1, size(labels))]
    is_chosen(1) = .true.
    do i = 1, size(patterns)
      pattern = trim(adjustl(patterns(i)%text))
      is_found = .false.
      do c = 1, size(labels)
        if (is_of_node(labels(c)%text) .and. index(pattern, '[') == 0) cycle
        if (.not. (matches(pattern, labels(c)%text) .or. matches(pattern, without_unit(labels(c)%text)))) cycle
        is_chosen(c) = .true.
        is_found = .true.
      end do
      if (.not. is_found) call input%report(output, 'columns', 'columns(' // to_text(i) // ') = ' // quoted(pattern) // &
                                            ' matches no column of trajectory.csv' // hint_for(pattern, labels), diagnostics)
    end do
    if (diagnostics%count > 0) call raise(error, diagnostics%worst_code(), input%diagnostics_text(diagnostics))
    allocate (chosen, source=pack([(c, c=1, size(labels))], is_chosen))
  end subroutine choose_columns

  !> Whether a column is that of a node inside of a shaft, which only patterns with a bracket choose.
  elemental logical function is_of_node(label)
    character(len=*), intent(in) :: label

    is_of_node = index(label, '] [') > 0
  end function is_of_node

  !> The number of the columns that &output asks for.
  subroutine count_columns(input, machine, count, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    integer, intent(out) :: count
    type(error_t), allocatable, intent(out) :: error        !! patterns that match nothing
    type(column_t), allocatable :: columns(:)
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: chosen(:), units(:)

    count = column_count(machine) - 2 * machine%nodes
    if (.not. input%groups(input%position('output'))%has_value('columns')) return
    call list_columns(machine, columns, labels)
    allocate (units(size(labels)))
    call turn_labels(labels, output_units(input), units)
    call choose_columns(input, labels, chosen, error)
    count = size(chosen)
  end subroutine count_columns

  !> What to write instead of a pattern: the nearest name or pattern of names, else the patterns of all names.
  function hint_for(pattern, labels) result(text)
    character(len=*), intent(in) :: pattern
    type(string_t), intent(in) :: labels(:)   !! of the columns, that of the time first
    character(len=:), allocatable :: quantity, text
    type(string_t), allocatable :: of_quantities(:)                                 ! e.g. 'phi_*'
    type(string_t) :: names(size(labels) - 1), of_elements(size(labels) - 1)        ! e.g. 'phi_motor', '*_motor'
    integer :: i

    allocate (of_quantities(0))
    do i = 1, size(names)
      names(i)%text = without_unit(labels(i + 1)%text)
      of_elements(i)%text = names(i)%text
      quantity = quantity_of(names(i)%text)
      if (quantity /= names(i)%text) then
        of_elements(i)%text = '*' // names(i)%text(len(quantity) + 1:)
        quantity = quantity // '_*'
      end if
      call append_new(of_quantities, quantity)
    end do
    text = near_match(pattern, of_quantities)
    if (text == '') text = near_match(pattern, names)
    if (text == '') text = near_match(pattern, of_elements)
    if (text == '') text = near_match(pattern // '_*', of_quantities)
    if (text == '') text = near_match('*_' // pattern, of_elements)
    if (text == '' .and. index(pattern, '[') > 0) text = near_match(pattern, labels)
    if (text == '') text = '; allowed: ' // joined(of_quantities, ', ', most_names)
  end function hint_for

  !> Appends a text that is not yet in a list.
  pure subroutine append_new(list, text)
    type(string_t), allocatable, intent(inout) :: list(:)
    character(len=*), intent(in) :: text
    integer :: i

    if (.not. any([(list(i)%text == text, i=1, size(list))])) call append(list, text)
  end subroutine append_new

  !> Why a name that is no column may have been written, e.g. "; did you mean 'omega_motor'?".
  pure subroutine explain_no_column(name, labels, text)
    character(len=*), intent(in) :: name
    type(string_t), intent(in) :: labels(:)   !! of the columns, with their units
    character(len=:), allocatable, intent(out) :: text
    type(string_t) :: names(size(labels))   ! labels without units
    integer :: i

    do i = 1, size(labels)
      names(i)%text = without_unit(labels(i)%text)
    end do
    if (index(name, '[') > 0) then
      text = near_match(name, labels)
    else
      text = near_match(name, names)
    end if
    if (text == '') text = ', which has ' // related_names(name, names)
  end subroutine explain_no_column

  !> The label without its unit.
  pure function without_unit(label) result(name)
    character(len=*), intent(in) :: label
    character(len=:), allocatable :: name

    name = label(:index(label, ' [', back=.true.) - 1)
  end function without_unit

  !> The first part of a name, 'omega' of 'omega_motor'; the whole name of an energy and of the time.
  pure function quantity_of(name) result(quantity)
    character(len=*), intent(in) :: name   !! with or without its unit
    character(len=:), allocatable :: quantity
    character(len=*), parameter :: of_machine = '|t|kinetic_energy|elastic_energy|work_in|work_out|energy_residual|'

    quantity = name(:index(name // ' [', ' [') - 1)
    if (index(of_machine, '|' // quantity // '|') == 0) quantity = name(:index(name // '_', '_') - 1)
  end function quantity_of

  !> E.g. "; did you mean 'omega_motor'?", '' if no name is similar.
  pure function near_match(name, candidates) result(text)
    character(len=*), intent(in) :: name
    type(string_t), intent(in) :: candidates(:)
    character(len=:), allocatable :: text
    integer :: nearest

    text = ''
    nearest = nearest_word(name, candidates)
    if (nearest > 0) text = '; did you mean ' // quoted(candidates(nearest)%text) // '?'
  end function near_match

  !> The columns of the element or of the kind that a quantity may mean; if there are none, the first ones of all columns.
  pure function related_names(quantity, names) result(text)
    character(len=*), intent(in) :: quantity
    type(string_t), intent(in) :: names(:)   !! without units
    character(len=:), allocatable :: text
    type(string_t), allocatable :: related(:)
    character(len=:), allocatable :: element, name
    integer :: i

    name = quantity(:index(quantity // ' [', ' [') - 1)
    element = name(index(name, '_') + 1:)
    allocate (related(0))
    do i = 1, size(names)
      if (index(names(i)%text // '|', '_' // element // '|') == 0 .and. index(names(i)%text, name // '_') /= 1) cycle
      call append(related, names(i)%text)
    end do
    if (size(related) > 0) then
      text = joined(related, ', ', most_names)
    else
      text = joined(names, ', ', most_names)
      if (size(names) > most_names) text = text // ' in its first line'
    end if
  end function related_names

end module nocdyn_column_names
