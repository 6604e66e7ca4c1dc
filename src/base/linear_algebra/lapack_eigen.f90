!> Dense eigenvalue problems, by LAPACK, which never sees a matrix with an infinity or a NaN.
module nocdyn_lapack_eigen
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: cholesky_factor, solve_triangular, singular_vectors, symmetric_eigenvectors, eigenvalues, &
    eigenvectors, tridiagonal_eigenvectors

  interface
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotrf

    subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
      import :: wp
      character, intent(in) :: side, uplo, transa, diag
      integer, intent(in) :: m, n, lda, ldb
      real(wp), intent(in) :: alpha, a(lda, *)
      real(wp), intent(inout) :: b(ldb, *)
    end subroutine dtrsm

    subroutine dgesvd(jobu, jobvt, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info)
      import :: wp
      character, intent(in) :: jobu, jobvt
      integer, intent(in) :: m, n, lda, ldu, ldvt, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: s(*), u(ldu, *), vt(ldvt, *), work(*)
      integer, intent(out) :: info
    end subroutine dgesvd

    subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
      import :: wp
      character, intent(in) :: jobz, uplo
      integer, intent(in) :: n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: w(*), work(*)
      integer, intent(out) :: info
    end subroutine dsyev

    subroutine dstev(jobz, n, d, e, z, ldz, work, info)
      import :: wp
      character, intent(in) :: jobz
      integer, intent(in) :: n, ldz
      real(wp), intent(inout) :: d(*), e(*)
      real(wp), intent(out) :: z(ldz, *), work(*)
      integer, intent(out) :: info
    end subroutine dstev

    subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
      import :: wp
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldvl, ldvr, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
      integer, intent(out) :: info
    end subroutine dgeev
  end interface

contains

  !> Cholesky factor R of A = R^T R (DPOTRF), in the upper triangle of `matrix`.
  subroutine cholesky_factor(matrix, is_indefinite)
    real(wp), contiguous, intent(inout) :: matrix(:, :)   !! A, symmetric
    logical, intent(out) :: is_indefinite                 !! whether A is not positive definite, or not finite
    integer :: info

    is_indefinite = .not. all(is_finite(matrix))
    if (is_indefinite) return
    call dpotrf('U', size(matrix, 1), matrix, max(1, size(matrix, 1)), info)
    is_indefinite = info /= 0
  end subroutine cholesky_factor

  !> Replaces B by R^-1 B or, from the right, by B R^-1 (DTRSM).
  subroutine solve_triangular(factor, matrix, from_right)
    real(wp), contiguous, intent(in) :: factor(:, :)      !! of `cholesky_factor`
    real(wp), contiguous, intent(inout) :: matrix(:, :)   !! B
    logical, intent(in) :: from_right

    call dtrsm(merge('R', 'L', from_right), 'U', 'N', 'N', size(matrix, 1), size(matrix, 2), 1.0_wp, factor, &
               max(1, size(factor, 1)), matrix, max(1, size(matrix, 1)))
  end subroutine solve_triangular

  !> Singular values, descending, and all right singular vectors, as columns (DGESVD).
  subroutine singular_vectors(matrix, values, vectors, has_failed)
    real(wp), intent(in) :: matrix(:, :)                  !! [m, n]
    real(wp), intent(out) :: values(:)                    !! [n], zeros after the first min(m, n)
    real(wp), intent(out) :: vectors(:, :)                !! [n, n]
    logical, intent(out) :: has_failed                    !! LAPACK does not converge, or an element is not finite
    real(wp), allocatable :: a(:, :), transposed(:, :), work(:)
    real(wp) :: none(1, 1), room(1)
    integer :: info, m, n

    m = max(1, size(matrix, 1))   ! one row of zeros where there is none: without rows DGESVD sets no vectors
    n = size(matrix, 2)
    values = 0.0_wp
    vectors = 0.0_wp
    has_failed = .not. all(is_finite(matrix))
    if (has_failed) return
    allocate (a(m, n), source=0.0_wp)
    a(:size(matrix, 1), :) = matrix
    allocate (transposed(n, n))
    call dgesvd('N', 'A', m, n, a, m, values, none, 1, transposed, n, room, -1, info)
    allocate (work(int(room(1))))
    call dgesvd('N', 'A', m, n, a, m, values, none, 1, transposed, n, work, size(work), info)
    vectors = transpose(transposed)
    has_failed = info /= 0
  end subroutine singular_vectors

  !> Eigenvalues of a symmetric matrix, ascending, and orthonormal eigenvectors (DSYEV).
  subroutine symmetric_eigenvectors(matrix, values, vectors, has_failed)
    real(wp), intent(in) :: matrix(:, :)   !! symmetric, [n, n]
    real(wp), intent(out) :: values(:)   !! [n]
    real(wp), contiguous, intent(out) :: vectors(:, :)    !! as columns
    logical, intent(out) :: has_failed                    !! LAPACK does not converge, or an element is not finite
    real(wp), allocatable :: work(:)
    integer :: info, n

    n = size(matrix, 1)
    values = 0.0_wp
    vectors(:, :) = matrix
    has_failed = .not. all(is_finite(matrix))
    if (has_failed) return
    allocate (work(max(1, 34 * n)))
    call dsyev('V', 'U', n, vectors, max(1, n), values, work, size(work), info)
    has_failed = info /= 0
  end subroutine symmetric_eigenvectors

  !> Eigenvalues of a symmetric tridiagonal matrix, ascending, and orthonormal eigenvectors (DSTEV).
  subroutine tridiagonal_eigenvectors(diagonal, beside, values, vectors, has_failed)
    real(wp), intent(in) :: diagonal(:)                   !! [n]
    real(wp), intent(in) :: beside(:)                     !! elements beside the diagonal, [n - 1] or more
    real(wp), intent(out) :: values(:)                    !! [n]
    real(wp), contiguous, intent(out) :: vectors(:, :)    !! as columns, [n, n]
    logical, intent(out) :: has_failed                    !! LAPACK does not converge, or an element is not finite
    real(wp) :: off(size(diagonal)), work(2 * size(diagonal))
    integer :: info, n

    n = size(diagonal)
    values = diagonal
    vectors(:, :) = 0.0_wp
    off(:n - 1) = beside(:n - 1)
    has_failed = .not. (all(is_finite(diagonal)) .and. all(is_finite(off(:n - 1))))
    if (has_failed) return
    call dstev('V', n, values, off, vectors, n, work, info)
    has_failed = info /= 0
  end subroutine tridiagonal_eigenvectors

  !> Eigenvalues of a real matrix (DGEEV); conjugate pairs follow each other.
  subroutine eigenvalues(matrix, values, has_failed)
    real(wp), intent(in) :: matrix(:, :)     !! [n, n]
    complex(wp), intent(out) :: values(:)    !! [n]
    logical, intent(out) :: has_failed       !! LAPACK does not converge, or an element is not finite
    real(wp), allocatable :: a(:, :), imaginary(:), real_part(:), work(:)
    real(wp) :: left(1, 1), right(1, 1), room(1)
    integer :: info, n

    n = size(matrix, 1)
    values = 0.0_wp
    has_failed = .not. all(is_finite(matrix))
    if (has_failed .or. n == 0) return
    allocate (a, source=matrix)
    allocate (real_part(n), imaginary(n), source=0.0_wp)
    call dgeev('N', 'N', n, a, n, real_part, imaginary, left, 1, right, 1, room, -1, info)
    allocate (work(int(room(1))))
    call dgeev('N', 'N', n, a, n, real_part, imaginary, left, 1, right, 1, work, size(work), info)
    has_failed = info /= 0
    values = cmplx(real_part, imaginary, wp)
  end subroutine eigenvalues

  !> Eigenvalues of a real matrix and right eigenvectors; conjugate pairs follow each other (DGEEV).
  subroutine eigenvectors(matrix, values, vectors, has_failed, left_vectors)
    real(wp), intent(in) :: matrix(:, :)   !! [n, n]
    complex(wp), intent(out) :: values(:)   !! [n]
    complex(wp), intent(out) :: vectors(:, :)             !! as columns
    logical, intent(out) :: has_failed                    !! LAPACK does not converge, or an element is not finite
    complex(wp), intent(out), optional :: left_vectors(:, :)   !! u with u^H A = value u^H, as columns
    real(wp), allocatable :: a(:, :), imaginary(:), left(:, :), real_part(:), right(:, :), work(:)
    real(wp) :: room(1)
    integer :: info, n

    n = size(matrix, 1)
    values = 0.0_wp
    vectors = 0.0_wp
    if (present(left_vectors)) left_vectors = 0.0_wp
    has_failed = .not. all(is_finite(matrix))
    if (has_failed .or. n == 0) return
    allocate (a, source=matrix)
    allocate (right(n, n), left(n, n), real_part(n), imaginary(n), source=0.0_wp)
    associate (job => merge('V', 'N', present(left_vectors)))
      call dgeev(job, 'V', n, a, n, real_part, imaginary, left, n, right, n, room, -1, info)
      allocate (work(int(room(1))))
      call dgeev(job, 'V', n, a, n, real_part, imaginary, left, n, right, n, work, size(work), info)
    end associate
    has_failed = info /= 0
    values = cmplx(real_part, imaginary, wp)
    call combine_parts(imaginary, right, vectors)
    if (present(left_vectors)) call combine_parts(imaginary, left, left_vectors)
  end subroutine eigenvectors

  !> Complex vectors from the form of LAPACK: of a conjugate pair the first column is the real part, the second the imaginary one.
  pure subroutine combine_parts(imaginary, parts, vectors)
    real(wp), intent(in) :: imaginary(:)          !! parts of the eigenvalues
    real(wp), intent(in) :: parts(:, :)
    complex(wp), intent(inout) :: vectors(:, :)
    integer :: i

    do i = 1, size(imaginary)
      if (imaginary(i) > 0.0_wp) then
        vectors(:, i) = cmplx(parts(:, i), parts(:, i + 1), wp)
      else if (imaginary(i) < 0.0_wp) then
        vectors(:, i) = cmplx(parts(:, i - 1), -parts(:, i), wp)
      else
        vectors(:, i) = cmplx(parts(:, i), 0.0_wp, wp)
      end if
    end do
  end subroutine combine_parts

end module nocdyn_lapack_eigen
