!> Sums of Taylor series, for whole vectors of states.
module nocdyn_series_sums
  use nocdyn_kinds, only: wp
  use nocdyn_stage_sums, only: width
  implicit none (type, external)
  private

  public :: sum_series, scale_series

  integer, parameter :: long = 32   !! numbers summed together in blocks of many lanes

contains

  !> y = sum over k of h^k series(:, k).
  pure subroutine sum_series(n, order, series, h_length, h, y)
    integer, intent(in) :: n          !! whole vectors
    integer, intent(in) :: order
    integer, intent(in) :: h_length   !! n, or less if all vectors have the same h
    real(wp), intent(in) :: series(n, 0:order), h(h_length)
    real(wp), intent(inout) :: y(n)
    real(wp) :: sum(width)
    integer :: i, j, k

    if (h_length == n .and. modulo(n, long) == 0) then
      call sum_long_vectors(n, order, series, h, y)
      return
    end if
    do i = 1, n, width
      j = merge(i, 1, h_length == n)
      sum = series(i:i + width - 1, order)
      do k = order - 1, 0, -1
        sum = series(i:i + width - 1, k) + h(j:j + width - 1) * sum
      end do
      y(i:i + width - 1) = sum
    end do
  end subroutine sum_series

  !> Sums series of `long` numbers at a time, so that the processor does not wait for a sum.
  pure subroutine sum_long_vectors(n, order, series, h, y)
    integer, intent(in) :: n   !! a multiple of `long`
    integer, intent(in) :: order
    real(wp), intent(in) :: series(n, 0:order), h(n)
    real(wp), intent(inout) :: y(n)
    real(wp) :: sum(long)
    integer :: i, k

    do i = 1, n, long
      sum = series(i:i + long - 1, order - 1) + h(i:i + long - 1) * series(i:i + long - 1, order)
      do k = order - 2, 0, -1
        sum = series(i:i + long - 1, k) + h(i:i + long - 1) * sum
      end do
      y(i:i + long - 1) = sum
    end do
  end subroutine sum_long_vectors

  !> c(:, k) = h^k series(:, k).
  pure subroutine scale_series(n, order, series, h_length, h, c)
    integer, intent(in) :: n          !! whole vectors
    integer, intent(in) :: order
    integer, intent(in) :: h_length   !! n, or less if all vectors have the same h
    real(wp), intent(in) :: series(n, 0:order), h(h_length)
    real(wp), intent(inout) :: c(n, order)
    real(wp) :: power(width)
    integer :: i, j, k

    do i = 1, n, width
      j = merge(i, 1, h_length == n)
      power = 1.0_wp
      do k = 1, order
        power = power * h(j:j + width - 1)
        c(i:i + width - 1, k) = power * series(i:i + width - 1, k)
      end do
    end do
  end subroutine scale_series

end module nocdyn_series_sums
