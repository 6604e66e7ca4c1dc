!> Gauss-Legendre quadrature.
module nocdyn_quadrature
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: gauss_legendre_rule, legendre_pair

  integer, parameter :: max_newton_steps = 20   ! four or five are needed

contains

  !> Nodes and weights on [0, 1] that integrate polynomials of degree 2 n - 1 exactly.
  pure subroutine gauss_legendre_rule(n, nodes, weights)
    integer, intent(in) :: n
    real(wp), intent(out) :: nodes(n)     !! ascending
    real(wp), intent(out) :: weights(n)   !! their sum is 1
    real(wp), parameter :: pi = acos(-1.0_wp)
    real(wp) :: change, slope, value, x
    integer :: i, step

    do i = 1, n
      x = -cos(pi * (i - 0.25_wp) / (n + 0.5_wp))
      do step = 1, max_newton_steps
        call legendre(n, x, value, slope)
        change = value / slope
        x = x - change
        if (abs(change) <= epsilon(x)) exit
      end do
      call legendre(n, x, value, slope)
      nodes(i) = 0.5_wp * (1 + x)
      weights(i) = 1 / ((1 - x**2) * slope**2)
    end do
  end subroutine gauss_legendre_rule

  !> P_n and its derivative.
  pure subroutine legendre(n, x, value, slope)
    integer, intent(in) :: n
    real(wp), intent(in) :: x   !! between -1 and 1, not at the ends
    real(wp), intent(out) :: value, slope
    real(wp) :: before

    call legendre_pair(n, x, value, before)
    slope = n * (x * value - before) / (x**2 - 1)
  end subroutine legendre

  !> The Legendre polynomials of degree n and n - 1, by Bonnet's recurrence.
  pure subroutine legendre_pair(n, x, value, before)
    integer, intent(in) :: n
    real(wp), intent(in) :: x
    real(wp), intent(out) :: value, before
    real(wp) :: next
    integer :: k

    before = 1.0_wp
    value = x
    do k = 2, n
      next = ((2 * k - 1) * x * value - (k - 1) * before) / k
      before = value
      value = next
    end do
  end subroutine legendre_pair

end module nocdyn_quadrature
