!> Units of the field in results, by &output units: which columns they fit.
module nocdyn_output_units
  use nocdyn_input, only: group_t, input_t
  use nocdyn_text, only: string_t
  use nocdyn_units, only: unit_for, unit_index, units
  implicit none (type, external)
  private

  public :: match_column, output_units, turn_labels, unit_of

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

  !> Writes labels such as 'omega_motor [rad/s]' with the units that fit them.
  pure subroutine turn_labels(labels, wanted, unit)
    type(string_t), intent(inout) :: labels(:)   !! of columns in SI units
    integer, intent(in) :: wanted(:)             !! indices of `units`
    integer, intent(out) :: unit(:)              !! of each column: index of `units`, 0: that of SI, [labels]
    integer :: i

    do i = 1, size(labels)
      unit(i) = unit_for(unit_of(labels(i)%text), wanted)
      if (unit(i) > 0) labels(i)%text = label_in(labels(i)%text, unit(i))
    end do
  end subroutine turn_labels

  !> A label with the name of another unit.
  pure function label_in(label, unit) result(text)
    character(len=*), intent(in) :: label
    integer, intent(in) :: unit   !! index of `units`
    character(len=:), allocatable :: text

    text = label(:index(label, '[', back=.true.)) // trim(units(unit)%name) // ']'
  end function label_in

  !> Whether a quantity is a column: its label without unit, in SI or in any unit that fits.
  pure subroutine match_column(label, quantity, wanted, is_column, unit)
    character(len=*), intent(in) :: label      !! in SI
    character(len=*), intent(in) :: quantity   !! as a user writes it
    integer, intent(in) :: wanted(:)           !! units of a quantity without one: indices of `units`
    logical, intent(out) :: is_column
    integer, intent(out) :: unit               !! of the quantity: index of `units`, 0: that of SI

    unit = 0
    is_column = quantity == label
    if (is_column) return
    unit = unit_for(unit_of(label), wanted)
    is_column = quantity == label(:index(label, ' [', back=.true.) - 1)
    if (is_column) return
    do unit = size(units), 1, -1
      is_column = units(unit)%si == unit_of(label) .and. quantity == label_in(label, unit)
      if (is_column) return
    end do
  end subroutine match_column

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
