!> What the Taylor arithmetic of harmonics needs besides the series of its angle: factors, and work space for powers.
module nocdyn_law_harmonics
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: harmonic_work, harmonic_factors

  !> The first columns of the work space of a group; those from the fourth on are H_1 = B_1 + d^4 H_2, H_2 and so on.
  integer, parameter, public :: derivatives = 0, second = 1, third = 2, fourth = 3

  integer, parameter, public :: most_terms = 64   !! of a part of a sum; longer sums have several parts

contains

  !> Columns [w, 0:order] of work space that each group needs.
  pure integer function harmonic_work(order)
    integer, intent(in) :: order

    harmonic_work = 0
    if (order > 0) harmonic_work = 4 + order / 4
  end function harmonic_work

  !> The factors n^j / j! of derivatives, with the signs of a sine's derivatives.
  pure function harmonic_factors(order, n) result(factors)
    integer, intent(in) :: order, n(:)
    real(wp) :: factors(size(n), 0:order)
    integer :: j

    factors(:, 0) = 1.0_wp
    do j = 1, order
      factors(:, j) = merge(1.0_wp, -1.0_wp, modulo(j, 2) == 1) * factors(:, j - 1) * n / j
    end do
  end function harmonic_factors

end module nocdyn_law_harmonics
