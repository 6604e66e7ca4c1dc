!> Dense linear algebra by LAPACK: rank, inverse, positive definite systems, pseudo-inverse; sorting.
!>
!> LAPACK never sees a matrix with an infinity or a NaN, on which it may print and stop, or never end.
!>
!> Arrays are allocated with `source=`: gfortran 12 warns of uninitialised descriptors where an assignment allocates.
module nocdyn_lapack
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor
  implicit none (type, external)
  private

  public :: pivoted_rank, invert, solve_positive_definite, pseudo_inverse, sort_ascending, ascending_order

  interface
    subroutine dgeqp3(m, n, a, lda, jpvt, tau, work, lwork, info)
      import :: wp
      integer, intent(in) :: m, n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(inout) :: jpvt(*)
      real(wp), intent(out) :: tau(*), work(*)
      integer, intent(out) :: info
    end subroutine dgeqp3

    subroutine dgetri(n, a, lda, ipiv, work, lwork, info)
      import :: wp
      integer, intent(in) :: n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(in) :: ipiv(*)
      real(wp), intent(out) :: work(*)
      integer, intent(out) :: info
    end subroutine dgetri

    subroutine dposv(uplo, n, nrhs, a, lda, b, ldb, info)
      import :: wp
      character(len=1), intent(in) :: uplo
      integer, intent(in) :: n, nrhs, lda, ldb
      real(wp), intent(inout) :: a(lda, *), b(ldb, *)
      integer, intent(out) :: info
    end subroutine dposv

    subroutine dgelsy(m, n, nrhs, a, lda, b, ldb, jpvt, rcond, rank, work, lwork, info)
      import :: wp
      integer, intent(in) :: m, n, nrhs, lda, ldb, lwork
      real(wp), intent(inout) :: a(lda, *), b(ldb, *)
      integer, intent(inout) :: jpvt(*)
      real(wp), intent(in) :: rcond
      integer, intent(out) :: rank, info
      real(wp), intent(out) :: work(*)
    end subroutine dgelsy

    subroutine dlasrt(id, n, d, info)
      import :: wp
      character(len=1), intent(in) :: id
      integer, intent(in) :: n
      real(wp), intent(inout) :: d(*)
      integer, intent(out) :: info
    end subroutine dlasrt
  end interface

contains

  !> Numerical rank by QR with column pivoting (DGEQP3): the diagonal elements of R above `tolerance` times the first.
  subroutine pivoted_rank(matrix, tolerance, rank, pivots)
    real(wp), intent(in) :: matrix(:, :)   !! [rows, columns]
    real(wp), intent(in) :: tolerance      !! relative to the largest column
    integer, intent(out) :: rank           !! 0 if an element is not finite
    integer, intent(out) :: pivots(:)      !! columns in the order of pivoting, shape [columns]; the first `rank` are independent
    real(wp), allocatable :: a(:, :), tau(:), work(:)
    integer :: info, k, m, n

    m = size(matrix, 1)
    n = size(matrix, 2)
    pivots = [(k, k=1, n)]
    rank = 0
    if (min(m, n) == 0 .or. .not. all(is_finite(matrix))) return
    allocate (tau(min(m, n)), work(2 * n + 32 * (n + 1)))
    allocate (a, source=matrix)
    pivots = 0
    call dgeqp3(m, n, a, m, pivots, tau, work, size(work), info)
    if (info /= 0) error stop 'nocdyn_lapack: dgeqp3 was called with a wrong argument'
    do k = 1, min(m, n)
      if (abs(a(k, k)) <= tolerance * abs(a(1, 1))) exit
      rank = k
    end do
  end subroutine pivoted_rank

  !> The inverse by LU (DGETRF, DGETRI), and the logarithm of |determinant|.
  subroutine invert(matrix, inverse, log_determinant, is_singular)
    real(wp), intent(in) :: matrix(:, :)                  !! square
    real(wp), allocatable, intent(out) :: inverse(:, :)   !! not the inverse if singular
    real(wp), intent(out) :: log_determinant              !! meaningless if singular
    logical, intent(out) :: is_singular                   !! a pivot is exactly zero, or an element is not finite
    real(wp), allocatable :: work(:)
    integer, allocatable :: ipiv(:)
    integer :: info, k, n

    n = size(matrix, 1)
    allocate (ipiv(n), work(max(1, 32 * n)))
    allocate (inverse, source=matrix)
    log_determinant = 0.0_wp
    is_singular = .not. all(is_finite(matrix))
    if (is_singular) return
    call lu_factor(inverse, ipiv, is_singular)
    if (is_singular) return
    do k = 1, n
      log_determinant = log_determinant + log(abs(inverse(k, k)))
    end do
    call dgetri(n, inverse, max(1, n), ipiv, work, size(work), info)
  end subroutine invert

  !> Solves matrix * x = rhs by Cholesky (DPOSV). A pivot that is the rounding of what it is the difference of has no value.
  subroutine solve_positive_definite(matrix, rhs, solution, is_indefinite)
    real(wp), intent(in) :: matrix(:, :)   !! symmetric, [n, n]
    real(wp), intent(in) :: rhs(:, :)   !! right-hand sides as columns, [n, m]
    real(wp), allocatable, intent(out) :: solution(:, :)   !! [n, m]
    logical, intent(out) :: is_indefinite   !! not positive definite, or only by rounding, or not finite: no solution
    real(wp), parameter :: rounding = 4.0_wp * epsilon(1.0_wp)
    real(wp), allocatable :: a(:, :)
    integer :: info, k, n

    n = size(matrix, 1)
    allocate (a, source=matrix)
    allocate (solution, source=rhs)
    is_indefinite = .not. all(is_finite(matrix))
    if (is_indefinite) return
    call dposv('L', n, size(rhs, 2), a, max(1, n), solution, max(1, n), info)
    is_indefinite = info /= 0
    do k = 1, n
      is_indefinite = is_indefinite .or. a(k, k)**2 <= rounding * matrix(k, k)
    end do
  end subroutine solve_positive_definite

  !> Moore-Penrose inverse: the least-squares solutions of smallest norm for the unit vectors (DGELSY).
  function pseudo_inverse(matrix, tolerance) result(inverse)
    real(wp), intent(in) :: matrix(:, :)   !! [rows, columns], finite
    real(wp), intent(in) :: tolerance          !! singular below this times the largest, as in `pivoted_rank`
    real(wp) :: inverse(size(matrix, 2), size(matrix, 1))
    real(wp), allocatable :: a(:, :), b(:, :), work(:)
    integer, allocatable :: jpvt(:)
    integer :: info, k, m, n, rank

    m = size(matrix, 1)
    n = size(matrix, 2)
    allocate (b(max(m, n), m), source=0.0_wp)
    allocate (jpvt(n), source=0)
    allocate (work(32 * (m + n + 1) + min(m, n) * 2))
    do k = 1, m
      b(k, k) = 1.0_wp
    end do
    allocate (a, source=matrix)
    if (min(m, n) > 0) call dgelsy(m, n, m, a, m, b, size(b, 1), jpvt, tolerance, rank, work, size(work), info)
    inverse = b(:n, :)
  end function pseudo_inverse

  !> Sorts numbers (DLASRT).
  subroutine sort_ascending(values)
    real(wp), contiguous, intent(inout) :: values(:)   !! of any unit
    integer :: info

    call dlasrt('I', size(values), values, info)
  end subroutine sort_ascending

  !> The permutation that sorts numbers, by Shell's sort; equal ones stay in their order.
  pure function ascending_order(values) result(order)
    real(wp), intent(in) :: values(:)   !! of any unit
    integer :: order(size(values))      !! `values(order)` is sorted
    integer :: before, gap, i, k, this

    order = [(i, i=1, size(values))]
    gap = size(values) / 2
    do while (gap > 0)
      do i = gap + 1, size(values)
        this = order(i)
        k = i
        do while (k > gap)
          before = order(k - gap)
          if (values(before) < values(this) .or. (before < this .and. values(before) <= values(this))) exit
          order(k) = before
          k = k - gap
        end do
        order(k) = this
      end do
      gap = gap / 2
    end do
  end function ascending_order

end module nocdyn_lapack
