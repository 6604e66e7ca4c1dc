!> LU factors of a band matrix and solutions with them, by LAPACK.
!>
!> Element (i, j) of a matrix with `lower` and `upper` diagonals beside the main one is
!> band(lower + upper + 1 + i - j, j); the first `lower` rows of the band are room for the row interchanges.
module nocdyn_lapack_band
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: band_factor, band_solve

  interface
    subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
      import :: wp
      integer, intent(in) :: m, n, kl, ku, ldab
      real(wp), intent(inout) :: ab(ldab, n)
      integer, intent(out) :: ipiv(n)
      integer, intent(out) :: info
    end subroutine dgbtrf

    subroutine dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
      import :: wp
      character, intent(in) :: trans
      integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
      real(wp), intent(in) :: ab(ldab, n)
      integer, intent(in) :: ipiv(n)
      real(wp), intent(inout) :: b(ldb, nrhs)
      integer, intent(out) :: info
    end subroutine dgbtrs
  end interface

contains

  !> Factors P A = L U with row interchanges.
  subroutine band_factor(lower, upper, band, pivots, singular)
    integer, intent(in) :: lower, upper                  !! numbers of diagonals below and above the main one
    real(wp), contiguous, intent(inout) :: band(:, :)    !! A, on return L and U; shape [2 lower + upper + 1, n], n > 0
    integer, contiguous, intent(inout) :: pivots(:)      !! row interchanges, shape [n]
    logical, intent(out) :: singular                     !! a pivot is exactly zero: the factors cannot be used
    integer :: n, info

    n = size(band, 2)
    call dgbtrf(n, n, lower, upper, band, size(band, 1), pivots, info)
    if (info < 0) error stop 'nocdyn_lapack_band: dgbtrf refused an argument'
    singular = info > 0
  end subroutine band_factor

  !> Solves A x = b with the factors of `band_factor`.
  subroutine band_solve(lower, upper, factors, pivots, x)
    integer, intent(in) :: lower, upper                  !! numbers of diagonals below and above the main one
    real(wp), contiguous, intent(in) :: factors(:, :)    !! of `band_factor`
    integer, contiguous, intent(in) :: pivots(:)         !! of `band_factor`
    real(wp), contiguous, intent(inout) :: x(:)          !! b, on return x; shape [n]
    integer :: n, info

    n = size(factors, 2)
    call dgbtrs('N', n, lower, upper, 1, factors, size(factors, 1), pivots, x, n, info)
    if (info /= 0) error stop 'nocdyn_lapack_band: dgbtrs refused an argument'
  end subroutine band_solve

end module nocdyn_lapack_band
