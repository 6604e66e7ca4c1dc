!> Tests over all lanes of a block, in loops without a branch.
module nocdyn_masks
  implicit none (type, external)
  private

  public :: all_true, any_true, any_differs

contains

  !> Whether all elements are true.
  pure logical function all_true(n, mask)
    integer, intent(in) :: n
    logical, intent(in) :: mask(n)

    all_true = count(mask) == n
  end function all_true

  !> Whether any element is true.
  pure logical function any_true(n, mask)
    integer, intent(in) :: n
    logical, intent(in) :: mask(n)

    any_true = count(mask) > 0
  end function any_true

  !> Whether any number differs from `usual`.
  pure logical function any_differs(n, numbers, usual)
    integer, intent(in) :: n, numbers(n), usual
    integer :: differences, i

    differences = 0
    do i = 1, n
      differences = ior(differences, ieor(numbers(i), usual))
    end do
    any_differs = differences /= 0
  end function any_differs

end module nocdyn_masks
