!> Symmetric band matrices: how many of their eigenvalues are negative, and the rank of one without negative eigenvalues.
!>
!> Both follow from the pivots of A = L D L^T without row interchanges. By Sylvester's law of inertia A has as many negative
!> eigenvalues as D has negative pivots; J. H. Wilkinson, The Algebraic Eigenvalue Problem (1965), ch. 5, and K. J. Bathe, Finite
!> Element Procedures (1996), sec. 11.4, count the eigenvalues of a pencil below a shift so.
!>
!> Only the upper triangle is read: element (i, j), i <= j, is band(diagonal + i - j, j).
module nocdyn_symmetric_band
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: negative_pivots, semidefinite_rank

contains

  !> The number of negative eigenvalues. A pivot that is exactly zero counts as negative and is replaced by a rounding.
  pure subroutine negative_pivots(width, diagonal, band, negatives)
    integer, intent(in) :: width                         !! diagonals above the main one
    integer, intent(in) :: diagonal                      !! row of the main diagonal in `band`
    real(wp), contiguous, intent(inout) :: band(:, :)    !! overwritten, [rows, n]
    integer, intent(out) :: negatives
    integer :: j, n
    real(wp) :: least, pivot

    n = size(band, 2)
    negatives = 0
    least = tiny(1.0_wp)
    do j = 1, n
      least = max(least, epsilon(1.0_wp)**2 * abs(band(diagonal, j)))
    end do
    do j = 1, n
      pivot = band(diagonal, j)
      if (.not. abs(pivot) > least) pivot = -least
      if (pivot < 0) negatives = negatives + 1
      call eliminate(width, diagonal, j, pivot, band)
    end do
  end subroutine negative_pivots

  !> Eliminates an unknown by its pivot from the rows after it.
  pure subroutine eliminate(width, diagonal, j, pivot, band)
    integer, intent(in) :: width, diagonal               !! as of `negative_pivots`
    integer, intent(in) :: j                             !! the unknown
    real(wp), intent(in) :: pivot
    real(wp), contiguous, intent(inout) :: band(:, :)    !! [rows, n]
    integer :: i, k, last
    real(wp) :: factor

    last = min(size(band, 2), j + width)
    do i = j + 1, last
      factor = band(diagonal + j - i, i) / pivot
      do k = i, last
        band(diagonal + i - k, k) = band(diagonal + i - k, k) - factor * band(diagonal + j - k, k)
      end do
    end do
  end subroutine eliminate

  !> The rank of a matrix without negative eigenvalues: the pivots that are not rounding. Such a matrix has only zeros in the row
  !> of a pivot that is zero, so that the row is left out.
  pure subroutine semidefinite_rank(width, diagonal, band, rank)
    integer, intent(in) :: width, diagonal               !! as of `negative_pivots`
    real(wp), contiguous, intent(inout) :: band(:, :)    !! overwritten, [rows, n]
    integer, intent(out) :: rank
    real(wp), parameter :: rounding = 1.0e-12_wp         ! of the diagonal element before the elimination
    integer :: j
    real(wp) :: pivot, start(size(band, 2))

    start = band(diagonal, :)
    rank = 0
    do j = 1, size(band, 2)
      pivot = band(diagonal, j)
      if (.not. pivot > rounding * start(j)) cycle
      rank = rank + 1
      call eliminate(width, diagonal, j, pivot, band)
    end do
  end subroutine semidefinite_rank

end module nocdyn_symmetric_band
