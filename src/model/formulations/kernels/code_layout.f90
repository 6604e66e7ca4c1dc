!> What the code of a machine's series is made of: the laws of its banks, and where the numbers of its elements stand.
module nocdyn_code_layout
  use nocdyn_law_code, only: law_code_t, new_law_code
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_reduced_series, only: reduced_series_t
  use nocdyn_series_terms, only: has_cubic, has_history
  implicit none (type, external)
  private

  public :: find_laws, lay_out, number_of, is_forcing, first_of

  !> Where the numbers of the elements stand in the work space, and which elements loops treat alike.
  type, public :: layout_t
    logical :: is_across = .false.       !! whether numbers of lanes are computed side by side, not of elements
    integer, allocatable :: entries(:)   !! of U, [elements]
    integer, allocatable :: motion(:)    !! angle and speed, from 0, [elements + 1]
    integer, allocatable :: square(:)    !! square of the angle, [elements + 1]
    integer, allocatable :: bank(:)      !! number of the bank of the element in the code, -1: its law is polynomial, [elements]
    logical, allocatable :: is_phase(:)  !! whether it is the phase of an element before, [elements]
    integer, allocatable :: first(:)     !! element of each run, and one beyond the last element
  end type layout_t

contains

  !> The laws of the banks in the code: those that follow from the motion, then those that follow from the time.
  subroutine find_laws(series, state, laws)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), allocatable, intent(out) :: laws(:)
    integer :: b

    allocate (laws(size(series%banks%moved) + size(series%banks%timed)))
    do b = 1, size(laws)
      associate (bank_law => state%banks(number_of(series, b))%law)
        laws(b) = new_law_code(b - 1, bank_law%law, bank_law%series, bank_law)
      end associate
    end do
  end subroutine find_laws

  !> The number in the machine of a bank in the code.
  pure integer function number_of(series, b) result(number)
    type(reduced_series_t), intent(in) :: series
    integer, intent(in) :: b

    if (b <= size(series%banks%moved)) then
      number = series%banks%moved(b)
    else
      number = series%banks%timed(b - size(series%banks%moved))
    end if
  end function number_of

  !> Whether the moments of a bank follow from the time alone.
  pure logical function is_forcing(series, bank)
    type(reduced_series_t), intent(in) :: series
    integer, intent(in) :: bank   !! number in the code, -1: none

    is_forcing = bank >= size(series%banks%moved)
  end function is_forcing

  !> The first element of a bank in the code.
  pure integer function first_of(series, bank)
    type(reduced_series_t), intent(in) :: series
    integer, intent(in) :: bank

    first_of = series%banks%first(number_of(series, bank + 1))
  end function first_of

  !> Finds the layout.
  subroutine lay_out(series, state, laws, layout)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(layout_t), intent(out) :: layout
    integer :: b, e, first

    allocate (layout%motion(series%elements + 1), layout%square(series%elements + 1), source=0)
    allocate (layout%bank(series%elements), source=-1)
    allocate (layout%is_phase(series%elements), source=.false.)
    layout%entries = series%twists%first(2:) - series%twists%first(:series%elements)
    do e = 1, series%elements
      layout%motion(e + 1) = layout%motion(e) + merge(series%order + 1, 1, iand(series%terms(e), has_history) > 0)
      layout%square(e + 1) = layout%square(e) + merge(series%order + 1, 0, iand(series%terms(e), has_cubic) > 0)
    end do
    do b = 1, size(laws)
      first = series%banks%first(number_of(series, b))
      associate (law => state%banks(number_of(series, b))%law)
        associate (elements => law%law%elements)
          layout%bank(first:first + law%ports * elements - 1) = b - 1
          if (law%ports > 1) layout%is_phase(first + elements:first + 2 * elements - 1) = .true.
        end associate
      end associate
    end do
    allocate (layout%first(1), source=1)
    do e = 2, series%elements
      if (.not. are_alike(e - 1, e)) layout%first = [layout%first, e]
    end do
    layout%first = [layout%first, series%elements + 1]

  contains

    !> Whether a loop treats two elements alike, and their phases.
    pure logical function are_alike(a, b)
      integer, intent(in) :: a, b
      integer :: phase

      are_alike = layout%bank(a) == layout%bank(b) .and. layout%entries(a) == layout%entries(b) .and. &
                  series%terms(a) == series%terms(b) .and. (layout%is_phase(a) .eqv. layout%is_phase(b))
      if (.not. are_alike .or. layout%bank(a) < 0 .or. layout%is_phase(a)) return
      associate (law => state%banks(number_of(series, layout%bank(a) + 1))%law)
        phase = law%law%elements
        if (law%ports > 1) are_alike = layout%entries(a + phase) == layout%entries(b + phase) .and. &
                                       series%terms(a + phase) == series%terms(b + phase)
      end associate
    end function are_alike

  end subroutine lay_out

end module nocdyn_code_layout
