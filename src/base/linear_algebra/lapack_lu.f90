!> LU factors of a square matrix and solutions with them, by LAPACK.
!>
!> Integrators mostly solve small systems, for which the calls inside LAPACK cost more than the arithmetic. With the reference
!> LAPACK and gfortran 12, at order 4 (12), the unblocked DGETF2 takes a third (two fifths) of the time of DGETRF, and a plain
!> loop over the factors a quarter (three fifths) of that of DGETRS.
module nocdyn_lapack_lu
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: lu_factor, lu_solve

  integer, parameter :: small_order = 64   ! above it blocks pay if an optimised LAPACK is linked

  interface
    subroutine dgetrf(m, n, a, lda, ipiv, info)
      import :: wp
      integer, intent(in) :: m, n, lda
      real(wp), intent(inout) :: a(lda, n)
      integer, intent(out) :: ipiv(n)
      integer, intent(out) :: info
    end subroutine dgetrf

    subroutine dgetf2(m, n, a, lda, ipiv, info)
      import :: wp
      integer, intent(in) :: m, n, lda
      real(wp), intent(inout) :: a(lda, n)
      integer, intent(out) :: ipiv(n)
      integer, intent(out) :: info
    end subroutine dgetf2

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

  !> Factors P A = L U with row interchanges.
  subroutine lu_factor(matrix, pivots, singular)
    real(wp), contiguous, intent(inout) :: matrix(:, :)  !! A, on return L (unit diagonal) and U; shape [n, n], n > 0
    integer, contiguous, intent(inout) :: pivots(:)      !! row interchanges, shape [n]
    logical, intent(out) :: singular                     !! a pivot is exactly zero: the factors cannot be used
    integer :: n, info

    n = size(matrix, 1)
    if (n <= small_order) then
      call dgetf2(n, n, matrix, n, pivots, info)
    else
      call dgetrf(n, n, matrix, n, pivots, info)
    end if
    if (info < 0) error stop 'nocdyn_lapack_lu: dgetrf or dgetf2 refused an argument'
    singular = info > 0
  end subroutine lu_factor

  !> Solves A x = b with the factors of `lu_factor`.
  subroutine lu_solve(factors, pivots, x)
    real(wp), contiguous, intent(in) :: factors(:, :)   !! of `lu_factor`
    integer, contiguous, intent(in) :: pivots(:)   !! of `lu_factor`
    real(wp), contiguous, intent(inout) :: x(:)          !! b, on return x; shape [n]
    integer :: n, info

    n = size(factors, 1)
    if (n <= small_order) then
      call substitute(n, factors, pivots, x)
    else
      call dgetrs('N', n, 1, factors, n, pivots, x, n, info)
      if (info /= 0) error stop 'nocdyn_lapack_lu: dgetrs refused an argument'
    end if
  end subroutine lu_solve

  !> Forward and backward substitution, as DGETRS. For so few elements the vector loops of gfortran 12 are slower.
  pure subroutine substitute(n, factors, pivots, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: factors(n, n)
    integer, intent(in) :: pivots(n)
    real(wp), intent(inout) :: x(n)
    real(wp) :: pivot
    integer :: i, j

    do j = 1, n
      pivot = x(pivots(j))
      x(pivots(j)) = x(j)
      x(j) = pivot
    end do
    do j = 1, n - 1
      pivot = x(j)
      !GCC$ novector
      do i = j + 1, n
        x(i) = x(i) - factors(i, j) * pivot
      end do
    end do
    do j = n, 1, -1
      pivot = x(j) / factors(j, j)
      x(j) = pivot
      !GCC$ novector
      do i = 1, j - 1
        x(i) = x(i) - factors(i, j) * pivot
      end do
    end do
  end subroutine substitute

end module nocdyn_lapack_lu
