!> Units of the field in results, by &output units: which columns they fit.
module nocdyn_output_units
  use nocdyn_input, only: group_t, input_t
  use nocdyn_signals, only: former_name, signal_t
  use nocdyn_text, only: string_t
  use nocdyn_units, only: unit_for, unit_index, units
  implicit none (type, external)
  private

  public :: match_signal, output_units, turn_units, unit_of

contains

  !> Indices in `units` of the units that an input asks for.
  pure function output_units(input) result(wanted)
    type(input_t), intent(in) :: input
    integer, allocatable :: wanted(:)
    type(group_t) :: output
    type(string_t), allocatable :: names(:)
    integer :: i

    output = input%single('output')
    allocate (names, source=output%texts('units'))
    allocate (wanted(size(names)))
    do i = 1, size(names)
      wanted(i) = unit_index(names(i)%text)
    end do
  end function output_units

  !> Gives signals the units that fit them.
  pure subroutine turn_units(signals, wanted, unit)
    type(signal_t), intent(inout) :: signals(:)            !! in SI
    integer, intent(in) :: wanted(:)                       !! indices of `units`
    integer, allocatable, intent(out) :: unit(:)           !! of each: index of `units`, 0: SI
    integer :: i

    allocate (unit(size(signals)))
    do i = 1, size(signals)
      unit(i) = unit_for(signals(i)%unit, wanted)
      if (unit(i) > 0) signals(i)%unit = trim(units(unit(i))%name)
    end do
  end subroutine turn_units

  !> Whether a text names a signal: by its name, or its former one, with or without a unit that fits.
  pure subroutine match_signal(signal, text, wanted, matches, unit, is_former)
    type(signal_t), intent(in) :: signal
    character(len=*), intent(in) :: text   !! as a user writes it
    integer, intent(in) :: wanted(:)       !! units of a quantity without one: indices of `units`
    logical, intent(out) :: matches
    integer, intent(out) :: unit           !! of the text: index of `units`, 0: SI
    logical, intent(out) :: is_former      !! whether it is the former name
    character(len=:), allocatable :: former
    integer :: n

    call former_name(signal, .false., former)
    is_former = index(text // ' ', former // ' ') == 1 .and. former /= ''
    n = merge(len(former), len(signal%name), is_former)
    unit = unit_for(signal%unit, wanted)
    matches = is_former .or. index(text // ' ', signal%name // ' ') == 1
    if (.not. matches .or. len(text) == n) return
    unit = 0
    matches = text(n + 1:) == ' [' // signal%unit // ']'
    if (matches) return
    do unit = size(units), 1, -1
      matches = units(unit)%si == signal%unit .and. text(n + 1:) == ' [' // trim(units(unit)%name) // ']'
      if (matches) return
    end do
  end subroutine match_signal

  !> The text between the brackets at the end of a label, '' if there are none.
  pure function unit_of(label) result(text)
    character(len=*), intent(in) :: label
    character(len=:), allocatable :: text
    integer :: bracket

    bracket = index(label, ' [', back=.true.)
    text = ''
    if (bracket > 0) text = label(bracket + 2:len(label) - 1)
  end function unit_of

end module nocdyn_output_units
