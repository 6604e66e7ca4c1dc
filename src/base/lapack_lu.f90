!> LU factors of a square matrix and solutions with them, by LAPACK.
module nocdyn_lapack_lu
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: lu_factor, lu_solve

  interface
    subroutine dgetrf(m, n, a, lda, ipiv, info)
      import :: wp
      integer, intent(in) :: m, n, lda
      real(wp), intent(inout) :: a(lda, n)
      integer, intent(out) :: ipiv(n)
      integer, intent(out) :: info
    end subroutine dgetrf

    subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: wp
      character, intent(in) :: trans
      integer, intent(in) :: n, nrhs, lda, ldb
      real(wp), intent(in) :: a(lda, n)
      integer, intent(in) :: ipiv(n)
      real(wp), intent(inout) :: b(ldb, nrhs)
      integer, intent(out) :: info
    end subroutine dgetrs
  end interface

contains

  !> P A = L U with row interchanges.
  subroutine lu_factor(matrix, pivots, singular)
    real(wp), contiguous, intent(inout) :: matrix(:, :)  !! A, on return L (unit diagonal) and U; shape [n, n], n > 0
    integer, contiguous, intent(inout) :: pivots(:)      !! row interchanges, shape [n]
    logical, intent(out) :: singular                     !! a pivot is exactly zero: the factors cannot be used
    integer :: n, info

    n = size(matrix, 1)
    call dgetrf(n, n, matrix, n, pivots, info)
    if (info < 0) error stop 'nocdyn_lapack_lu: dgetrf refused an argument'
    singular = info > 0
  end subroutine lu_factor

  !> Solves A x = b with the factors of `lu_factor`.
  subroutine lu_solve(factors, pivots, x)
    real(wp), contiguous, intent(in) :: factors(:, :)
    integer, contiguous, intent(in) :: pivots(:)
    real(wp), contiguous, intent(inout) :: x(:)          !! b, on return x; shape [n]
    integer :: n, info

    n = size(factors, 1)
    call dgetrs('N', n, 1, factors, n, pivots, x, n, info)
    if (info /= 0) error stop 'nocdyn_lapack_lu: dgetrs refused an argument'
  end subroutine lu_solve

end module nocdyn_lapack_lu
