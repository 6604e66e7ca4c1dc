!> Samples of a record at other abscissae.
module nocdyn_resampling
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: sampled_at

contains

  !> The values at ascending abscissae: cubic polynomials through the four points about each; beyond the record its end values.
  pure function sampled_at(x, y, at) result(values)
    real(wp), intent(in) :: x(:)    !! ascending, at least 1
    real(wp), intent(in) :: y(:)    !! [points]
    real(wp), intent(in) :: at(:)   !! ascending
    real(wp) :: values(size(at))
    integer :: first, i, last, s

    s = 1
    do i = 1, size(at)
      do while (s < size(x) - 1)
        if (at(i) < x(s + 1)) exit
        s = s + 1
      end do
      if (at(i) <= x(1)) then
        values(i) = y(1)
      else if (at(i) >= x(size(x))) then
        values(i) = y(size(x))
      else
        last = min(size(x), max(s + 2, 4))
        first = max(1, last - 3)
        values(i) = polynomial_at(x(first:last), y(first:last), at(i))
      end if
    end do
  end function sampled_at

  !> The polynomial through some points, by Lagrange's formula.
  pure real(wp) function polynomial_at(x, y, at) result(value)
    real(wp), intent(in) :: x(:), y(:), at
    integer :: i, k
    real(wp) :: term

    value = 0.0_wp
    do i = 1, size(x)
      term = y(i)
      do k = 1, size(x)
        if (k /= i) term = term * (at - x(k)) / (x(i) - x(k))
      end do
      value = value + term
    end do
  end function polynomial_at

end module nocdyn_resampling
