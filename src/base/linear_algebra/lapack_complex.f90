!> Complex linear systems, tridiagonal, banded or dense, by LAPACK.
!>
!> The band has the form of `nocdyn_lapack_lu`: element (i, j) is band(lower + upper + 1 + i - j, j).
module nocdyn_lapack_complex
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: complex_band_factor, complex_band_solve, complex_eigenvectors, complex_solve, tridiagonal_factor, tridiagonal_solve

  interface
    pure subroutine zgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
      import :: wp
      integer, intent(in) :: m, n, kl, ku, ldab
      complex(wp), intent(inout) :: ab(ldab, n)
      integer, intent(out) :: ipiv(n), info
    end subroutine zgbtrf

    pure subroutine zgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
      import :: wp
      character, intent(in) :: trans
      integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
      complex(wp), intent(in) :: ab(ldab, n)
      integer, intent(in) :: ipiv(n)
      complex(wp), intent(inout) :: b(ldb, nrhs)
      integer, intent(out) :: info
    end subroutine zgbtrs

    pure subroutine zgttrf(n, dl, d, du, du2, ipiv, info)
      import :: wp
      integer, intent(in) :: n
      complex(wp), intent(inout) :: dl(n - 1), d(n), du(n - 1)
      complex(wp), intent(out) :: du2(n - 2)
      integer, intent(out) :: ipiv(n), info
    end subroutine zgttrf

    pure subroutine zgttrs(trans, n, nrhs, dl, d, du, du2, ipiv, b, ldb, info)
      import :: wp
      character, intent(in) :: trans
      integer, intent(in) :: n, nrhs, ldb
      complex(wp), intent(in) :: dl(n - 1), d(n), du(n - 1), du2(n - 2)
      integer, intent(in) :: ipiv(n)
      complex(wp), intent(inout) :: b(ldb, nrhs)
      integer, intent(out) :: info
    end subroutine zgttrs

    pure subroutine zgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: wp
      integer, intent(in) :: n, nrhs, lda, ldb
      complex(wp), intent(inout) :: a(lda, n), b(ldb, nrhs)
      integer, intent(out) :: ipiv(n), info
    end subroutine zgesv

    subroutine zggev(jobvl, jobvr, n, a, lda, b, ldb, alpha, beta, vl, ldvl, vr, ldvr, work, lwork, rwork, info)
      import :: wp
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldb, ldvl, ldvr, lwork
      complex(wp), intent(inout) :: a(lda, n), b(ldb, n)
      complex(wp), intent(out) :: alpha(n), beta(n), vl(ldvl, *), vr(ldvr, n), work(*)
      real(wp), intent(out) :: rwork(*)
      integer, intent(out) :: info
    end subroutine zggev
  end interface

contains

  !> Factors P A = L U of a band matrix with row interchanges (ZGBTRF).
  pure subroutine complex_band_factor(lower, upper, band, pivots, singular)
    integer, intent(in) :: lower, upper                    !! numbers of diagonals below and above the main one
    complex(wp), contiguous, intent(inout) :: band(:, :)   !! A, on return L and U; shape [2 lower + upper + 1, n], n > 0
    integer, contiguous, intent(inout) :: pivots(:)        !! row interchanges, shape [n]
    logical, intent(out) :: singular                       !! a pivot is exactly zero: the factors cannot be used
    integer :: info, n

    n = size(band, 2)
    call zgbtrf(n, n, lower, upper, band, size(band, 1), pivots, info)
    if (info < 0) error stop 'nocdyn_lapack_complex: zgbtrf refused an argument'
    singular = info > 0
  end subroutine complex_band_factor

  !> Solves A x = b with the factors of `complex_band_factor` (ZGBTRS).
  pure subroutine complex_band_solve(lower, upper, factors, pivots, x)
    integer, intent(in) :: lower, upper                     !! numbers of diagonals below and above the main one
    complex(wp), contiguous, intent(in) :: factors(:, :)    !! of `complex_band_factor`
    integer, contiguous, intent(in) :: pivots(:)            !! of `complex_band_factor`
    complex(wp), contiguous, intent(inout) :: x(:)          !! b, on return x; shape [n]
    integer :: info, n

    n = size(factors, 2)
    call zgbtrs('N', n, lower, upper, 1, factors, size(factors, 1), pivots, x, n, info)
    if (info /= 0) error stop 'nocdyn_lapack_complex: zgbtrs refused an argument'
  end subroutine complex_band_solve

  !> Factors P A = L U of a tridiagonal matrix with row interchanges (ZGTTRF).
  pure subroutine tridiagonal_factor(diagonals, pivots, singular)
    complex(wp), contiguous, intent(inout) :: diagonals(:, :)   !! the one below, the main one, the one above from its first
                                                                !! element on, and one more of the factors; shape [n, 4]
    integer, contiguous, intent(inout) :: pivots(:)             !! row interchanges, shape [n]
    logical, intent(out) :: singular                            !! a pivot is exactly zero: the factors cannot be used
    integer :: info

    call zgttrf(size(pivots), diagonals(:, 1), diagonals(:, 2), diagonals(:, 3), diagonals(:, 4), pivots, info)
    if (info < 0) error stop 'nocdyn_lapack_complex: zgttrf refused an argument'
    singular = info > 0
  end subroutine tridiagonal_factor

  !> Solves A x = b with the factors of `tridiagonal_factor` (ZGTTRS).
  pure subroutine tridiagonal_solve(factors, pivots, x)
    complex(wp), contiguous, intent(in) :: factors(:, :)   !! of `tridiagonal_factor`
    integer, contiguous, intent(in) :: pivots(:)           !! of `tridiagonal_factor`
    complex(wp), contiguous, intent(inout) :: x(:)         !! b, on return x; shape [n]
    integer :: info

    call zgttrs('N', size(x), 1, factors(:, 1), factors(:, 2), factors(:, 3), factors(:, 4), pivots, x, size(x), info)
    if (info /= 0) error stop 'nocdyn_lapack_complex: zgttrs refused an argument'
  end subroutine tridiagonal_solve

  !> Solves A x = b (ZGESV).
  pure subroutine complex_solve(matrix, x, singular)
    complex(wp), contiguous, intent(inout) :: matrix(:, :)   !! A, [n, n]; overwritten
    complex(wp), contiguous, intent(inout) :: x(:)           !! b, on return x, if A is not singular; [n]
    logical, intent(out), optional :: singular               !! whether a pivot is exactly zero
    integer :: info, pivots(size(x))

    call zgesv(size(x), 1, matrix, size(x), pivots, x, size(x), info)
    if (info < 0) error stop 'nocdyn_lapack_complex: zgesv refused an argument'
    if (present(singular)) singular = info > 0
  end subroutine complex_solve

  !> Eigenvalues with A x = value B x, and the vectors x (ZGGEV).
  subroutine complex_eigenvectors(a, b, values, vectors, has_failed)
    complex(wp), contiguous, intent(inout) :: a(:, :), b(:, :)      !! overwritten, finite, [n, n]
    complex(wp), intent(out) :: values(:)                           !! [n]
    complex(wp), contiguous, intent(out) :: vectors(:, :)           !! as columns, [n, n]
    logical, intent(out) :: has_failed                              !! LAPACK does not converge, or B is singular
    integer, parameter :: rooms = 34
    complex(wp) :: beta(size(values)), none(1, 1), work(rooms * size(values))
    real(wp) :: real_work(8 * size(values))
    integer :: info, n

    n = size(values)
    call zggev('N', 'V', n, a, n, b, n, values, beta, none, 1, vectors, n, work, size(work), real_work, info)
    if (info < 0) error stop 'nocdyn_lapack_complex: zggev refused an argument'
    has_failed = info /= 0 .or. .not. all(abs(beta) > 0)
    if (.not. has_failed) values = values / beta
  end subroutine complex_eigenvectors

end module nocdyn_lapack_complex
