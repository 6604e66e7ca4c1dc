!> Sets of elements of a machine, by what their laws are.
module nocdyn_element_sets
  use nocdyn_bank, only: role_coupling
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: has_springs_only, coupling_elements, element_names

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
