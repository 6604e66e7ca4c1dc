!> Sets of elements of a machine, by what their laws are.
module nocdyn_element_sets
  use nocdyn_bank, only: role_coupling
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: has_springs_only, coupling_elements, element_names, wholes, whole_names, whole_sums

contains

  !> Whether all restoring moments are polynomials.
  pure logical function has_springs_only(machine)
    type(machine_t), intent(in) :: machine
    integer :: i

    has_springs_only = all([(machine%banks(i)%bank%has_polynomial_potential .or. machine%banks(i)%bank%count == 0, &
                             i=1, size(machine%banks))])
  end function has_springs_only

  !> Elements of the role coupling, ascending.
  pure function coupling_elements(machine) result(elements)
    type(machine_t), intent(in) :: machine
    integer, allocatable :: elements(:)
    integer :: e, i

    elements = [integer ::]
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%role == role_coupling) elements = [elements, [(e, e=bank%first, bank%last())]]
      end associate
    end do
  end function coupling_elements

  !> The numbers, from 1, of the elements of which some elements are parts: consecutive ones of the same name.
  pure function wholes(names) result(whole)
    type(string_t), intent(in) :: names(:)   !! of the elements, in ascending order
    integer :: whole(size(names))
    integer :: i

    whole = 1
    do i = 2, size(names)
      whole(i) = whole(i - 1)
      if (names(i)%text /= names(i - 1)%text) whole(i) = whole(i) + 1
    end do
  end function wholes

  !> One name of each number of `wholes`.
  pure function whole_names(names) result(list)
    type(string_t), intent(in) :: names(:)
    type(string_t), allocatable :: list(:)
    integer :: i, whole(size(names))

    whole = wholes(names)
    allocate (list(maxval([0, whole])))
    do i = 1, size(names)
      list(whole(i))%text = names(i)%text
    end do
  end function whole_names

  !> The sums over the parts of each number of `wholes`.
  pure function whole_sums(names, values) result(sums)
    type(string_t), intent(in) :: names(:)
    real(wp), intent(in) :: values(:)        !! in any unit, [elements]
    real(wp), allocatable :: sums(:)
    integer :: i, whole(size(names))

    whole = wholes(names)
    allocate (sums(maxval([0, whole])), source=0.0_wp)
    do i = 1, size(names)
      sums(whole(i)) = sums(whole(i)) + values(i)
    end do
  end function whole_sums

  !> The names of some elements of a machine.
  function element_names(machine, elements) result(names)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: elements(:)   !! their numbers
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(size(elements)))
    do i = 1, size(elements)
      names(i)%text = machine%element_name(elements(i))
    end do
  end function element_names

end module nocdyn_element_sets
