!> Polynomials on [-1, 1]: as sums of Chebyshev polynomials c_1 T_0 + c_2 T_1 + ..., which are well-conditioned at any degree,
!> and by their values at the Chebyshev-Lobatto nodes.
module nocdyn_chebyshev
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: lobatto_nodes, find_maximum, differentiate, series_value

  integer, parameter, public :: max_nodes = 40   !! and coefficients
  integer, parameter :: max_newton_steps = 60     !! bisection alone would need as many

contains

  !> The nodes -cos(pi i / degree), and the matrix from values there to coefficients.
  pure subroutine lobatto_nodes(degree, nodes, to_series)
    integer, intent(in) :: degree
    real(wp), intent(out) :: nodes(0:degree)   !! ascending, -1 to 1
    real(wp), intent(out) :: to_series(0:degree, 0:degree)   !! [coefficients, places]
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer :: i, k

    if (degree >= max_nodes) error stop 'nocdyn_chebyshev: a polynomial has too many coefficients'
    do i = 0, degree
      nodes(i) = -cos(pi * i / degree)
      do k = 0, degree
        to_series(k, i) = 2 * end_weight(i, degree) * end_weight(k, degree) / degree * cos(pi * k * (degree - i) / degree)
      end do
    end do
  end subroutine lobatto_nodes

  !> The weight of a term in interpolation at Chebyshev-Lobatto nodes: 1/2 for the first and last one, else 1.
  pure real(wp) function end_weight(i, last)
    integer, intent(in) :: i, last

    end_weight = merge(0.5_wp, 1.0_wp, i == 0 .or. i == last)
  end function end_weight

  !> The largest value of the polynomial through `values` and its argument, by Newton's method on the derivative, safeguarded by
  !> bisection, between the neighbours of the largest value.
  pure subroutine find_maximum(n, nodes, to_series, values, node, peak)
    integer, intent(in) :: n
    real(wp), intent(in) :: nodes(n), to_series(n, n), values(n)   !! of `lobatto_nodes`, and the values there
    real(wp), intent(out) :: node, peak   !! argument, -1 to 1, and value of the maximum
    real(wp), dimension(max_nodes) :: c, slopes, curvatures   ! coefficients of the polynomial and of its derivatives
    real(wp) :: below, above, candidate, slope, curvature
    integer :: i, step

    i = maxloc(values, dim=1)
    node = nodes(i)
    peak = values(i)
    c(:n) = 0.0_wp
    do step = 1, n
      c(:n) = c(:n) + to_series(:, step) * values(step)
    end do
    call differentiate(n, c, slopes)
    below = nodes(max(i - 1, 1))
    above = nodes(min(i + 1, n))
    if (series_value(n, slopes, below) <= 0 .or. series_value(n, slopes, above) >= 0) return
    call differentiate(n, slopes, curvatures)
    candidate = node
    do step = 1, max_newton_steps
      slope = series_value(n, slopes, candidate)
      curvature = series_value(n, curvatures, candidate)
      if (slope > 0) then
        below = candidate
      else
        above = candidate
      end if
      candidate = 0.5_wp * (below + above)
      if (curvature < 0) then
        if (abs(slope) < -curvature * (above - below)) candidate = min(above, max(below, node - slope / curvature))
      end if
      if (abs(candidate - node) <= epsilon(node)) exit
      node = candidate
    end do
    peak = max(peak, series_value(n, c, node))
  end subroutine find_maximum

  !> The coefficients of the derivative of a sum of Chebyshev polynomials: d_(k-1) = d_(k+1) + 2 k c_k, with d_0 halved.
  pure subroutine differentiate(n, c, d)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(n)   !! of T_0 to T_(n-1)
    real(wp), intent(inout) :: d(n)   !! of the derivative; the last one is 0
    real(wp) :: after(max_nodes + 2)
    integer :: k

    after(:n + 2) = 0.0_wp
    do k = n - 1, 1, -1
      after(k) = after(k + 2) + 2 * k * c(k + 1)
    end do
    d = after(:n)
    d(1) = 0.5_wp * d(1)
  end subroutine differentiate

  !> The sum of Chebyshev polynomials at x, by Clenshaw's recurrence.
  pure real(wp) function series_value(n, c, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(n), x   !! coefficients of T_0 to T_(n-1), and the argument, -1 to 1
    real(wp) :: last, last_but_one, next
    integer :: k

    last = 0.0_wp
    last_but_one = 0.0_wp
    do k = n, 2, -1
      next = c(k) + 2 * x * last - last_but_one
      last_but_one = last
      last = next
    end do
    series_value = c(1) + x * last - last_but_one
  end function series_value

end module nocdyn_chebyshev
