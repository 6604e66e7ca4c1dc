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

    all_true = count_true(n, mask) == n
  end function all_true

  !> Whether any element is true.
  pure logical function any_true(n, mask)
    integer, intent(in) :: n
    logical, intent(in) :: mask(n)

    any_true = count_true(n, mask) > 0
  end function any_true

  !> The number of true elements.
  pure integer function count_true(n, mask) result(trues)
    integer, intent(in) :: n
    logical, intent(in) :: mask(n)
    integer :: i

    trues = 0
    do i = 1, n
      trues = trues + merge(1, 0, mask(i))
    end do
  end function count_true

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
