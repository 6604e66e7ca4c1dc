!> LU factors of a square matrix or of a band matrix and solutions with them, by LAPACK.
!>
!> Element (i, j) of a band matrix with `lower` and `upper` diagonals beside the main one is
!> band(lower + upper + 1 + i - j, j); the first `lower` rows of the band are room for the row interchanges.
!>
!> Integrators mostly solve small systems, for which the calls inside LAPACK cost more than the arithmetic. With the reference
!> LAPACK and gfortran 12, at order 4 (12), the unblocked DGETF2 takes a third (two fifths) of the time of DGETRF, and a plain
!> loop over the factors a quarter (three fifths) of the time of DGETRS.
module nocdyn_lapack_lu
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: lu_factor, lu_invert, lu_solve, band_factor, band_solve

  integer, parameter :: small_order = 64   ! above it blocks pay if an optimised LAPACK is linked
  integer, parameter :: small_band = 16    ! diagonals of U above the main one

  interface
    subroutine dgetrf(m, n, a, lda, ipiv, info)
      import :: wp
      integer, intent(in) :: m, n, lda
      real(wp), intent(inout) :: a(lda, n)
      integer, intent(out) :: ipiv(n), info
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

    subroutine dgetri(n, a, lda, ipiv, work, lwork, info)
      import :: wp
      integer, intent(in) :: n, lda, lwork
      real(wp), intent(inout) :: a(lda, n)
      integer, intent(in) :: ipiv(n)
      real(wp), intent(out) :: work(lwork)
      integer, intent(out) :: info
    end subroutine dgetri

    subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
      import :: wp
      integer, intent(in) :: m, n, kl, ku, ldab
      real(wp), intent(inout) :: ab(ldab, n)
      integer, intent(out) :: ipiv(n), info
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

  procedure(dgetrf) :: dgetf2

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

  !> The inverse by the factors of `lu_factor`.
  subroutine lu_invert(factors, pivots)
    real(wp), contiguous, intent(inout) :: factors(:, :)   !! of `lu_factor`, on return the inverse
    integer, contiguous, intent(in) :: pivots(:)           !! of `lu_factor`
    integer, parameter :: columns = 32                     ! that DGETRI takes at once
    real(wp) :: work(columns * size(pivots))
    integer :: info

    associate (n => size(pivots))
      call dgetri(n, factors, n, pivots, work, size(work), info)
    end associate
    if (info /= 0) error stop 'nocdyn_lapack_lu: dgetri refused an argument, or a pivot is zero'
  end subroutine lu_invert

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

  !> Factors P A = L U of a band matrix with row interchanges.
  subroutine band_factor(lower, upper, band, pivots, singular)
    integer, intent(in) :: lower, upper                  !! numbers of diagonals below and above the main one
    real(wp), contiguous, intent(inout) :: band(:, :)    !! A, on return L and U; shape [2 lower + upper + 1, n], n > 0
    integer, contiguous, intent(inout) :: pivots(:)      !! row interchanges, shape [n]
    logical, intent(out) :: singular                     !! a pivot is exactly zero: the factors cannot be used
    integer :: n, info

    n = size(band, 2)
    call dgbtrf(n, n, lower, upper, band, size(band, 1), pivots, info)
    if (info < 0) error stop 'nocdyn_lapack_lu: dgbtrf refused an argument'
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
    if (lower + upper <= small_band) then
      call substitute_band(n, lower, lower + upper, factors, pivots, x)
      return
    end if
    call dgbtrs('N', n, lower, upper, 1, factors, size(factors, 1), pivots, x, n, info)
    if (info /= 0) error stop 'nocdyn_lapack_lu: dgbtrs refused an argument'
  end subroutine band_solve

  !> Forward and backward substitution, as DGBTRS, which calls two procedures for each row of a few elements.
  pure subroutine substitute_band(n, lower, upper, factors, pivots, x)
    integer, intent(in) :: n, lower, upper   !! diagonals of L below, of U above the main one
    real(wp), intent(in) :: factors(lower + upper + 1, n)
    integer, intent(in) :: pivots(n)
    real(wp), intent(inout) :: x(n)
    real(wp) :: pivot
    integer :: i, j

    do j = 1, n - 1
      pivot = x(pivots(j))
      x(pivots(j)) = x(j)
      x(j) = pivot
      !GCC$ novector
      do i = 1, min(lower, n - j)
        x(j + i) = x(j + i) - factors(upper + 1 + i, j) * pivot
      end do
    end do
    do i = n, 1, -1
      pivot = x(i)
      !GCC$ novector
      do j = min(n, i + upper), i + 1, -1   ! the order of DTBSV, whose loop over rows is the inner one
        pivot = pivot - factors(upper + 1 + i - j, j) * x(j)
      end do
      x(i) = pivot / factors(upper + 1, i)
    end do
  end subroutine substitute_band

end module nocdyn_lapack_lu
