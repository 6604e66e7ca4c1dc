!> Sets of elements of a machine, by what their laws are.
module nocdyn_element_sets
  use nocdyn_bank, only: role_coupling
  use nocdyn_machine, only: machine_t
  implicit none (type, external)
  private

  public :: has_springs_only, coupling_elements

contains

  !> Whether all restoring moments are polynomials.
  pure logical function has_springs_only(machine)
    type(machine_t), intent(in) :: machine
    integer :: i

    has_springs_only = all([(machine%banks(i)%bank%has_polynomial_potential .or. size(machine%banks(i)%bank%to) == 0, &
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

end module nocdyn_element_sets
