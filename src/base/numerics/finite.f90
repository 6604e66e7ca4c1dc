!> Tests for infinities and NaNs that raise no floating-point exception and do not change the floating-point state.
module nocdyn_finite
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: all_finite, is_finite

  ! An IEEE double is infinite or NaN if and only if its eleven exponent bits are all ones.
  integer, parameter :: exponent_place = 52
  integer, parameter :: exponent_bits = 11
  integer(int64), parameter :: exponent_ones = 2_int64**exponent_bits - 1

  integer, parameter :: several = 32

contains

  !> Whether no element is infinite or NaN, by the sum of the absolute values. False too if that sum overflows.
  pure function all_finite(n, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    logical :: all_finite
    real(wp) :: total(4)          ! four sums, as a vector
    real(wp) :: totals(several)   ! independent sums
    integer :: i, whole

    total = 0.0_wp
    whole = n - modulo(n, several)
    if (whole > 0) then
      totals = abs(x(:several))
      do i = several + 1, whole, several
        totals = totals + abs(x(i:i + several - 1))
      end do
      do i = 1, several, 4
        total = total + totals(i:i + 3)
      end do
    end if
    do i = whole + 1, n - 3, 4
      total = total + abs(x(i:i + 3))
    end do
    do i = n - modulo(n, 4) + 1, n
      total(1) = total(1) + abs(x(i))
    end do
    all_finite = is_finite((total(1) + total(2)) + (total(3) + total(4)))
  end function all_finite

  !> Whether a number is neither infinite nor NaN.
  elemental function is_finite(x)
    real(wp), intent(in) :: x
    logical :: is_finite

    is_finite = iand(shiftr(transfer(x, exponent_ones), exponent_place), exponent_ones) /= exponent_ones
  end function is_finite

end module nocdyn_finite
