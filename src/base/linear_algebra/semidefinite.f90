!> Small symmetric positive semidefinite systems that are solved again and again, without allocating anything while they are
!> definite: scaled to a unit diagonal and factored by Cholesky (DPOTRF); by the pseudo-inverse where they are singular.
module nocdyn_semidefinite
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank, pseudo_inverse
  implicit none (type, external)
  private

  public :: new_semidefinite, null_tolerance

  real(wp), parameter :: null_tolerance = 1.0e-11_wp   !! eigenvalues below it count as zero, relative to the largest

  type, public :: semidefinite_t
    integer :: order = 0                               !! rows of the present matrix
    logical :: is_singular = .false.
    integer :: weakest = 0                             !! row with the least pivot
    real(wp) :: least_pivot = 1.0_wp                   !! of the scaled matrix
    real(wp), allocatable, private :: factor(:, :)     !! of the scaled matrix, its pseudo-inverse if singular
    real(wp), allocatable, private :: scale(:)         !! 1 / sqrt(diagonal)
    real(wp), allocatable, private :: work(:, :)       !! right-hand side
  contains
    procedure :: set_matrix, solve, find_rank
  end type semidefinite_t

  interface
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      character(len=1), intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, n)
      integer, intent(out) :: info
    end subroutine dpotrf

    subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
      import :: wp
      character(len=1), intent(in) :: uplo
      integer, intent(in) :: n, nrhs, lda, ldb
      real(wp), intent(in) :: a(lda, n)
      real(wp), intent(inout) :: b(ldb, nrhs)
      integer, intent(out) :: info
    end subroutine dpotrs
  end interface

contains

  !> Room for matrices of at most so many rows.
  pure type(semidefinite_t) function new_semidefinite(most_rows) result(self)
    integer, intent(in) :: most_rows

    allocate (self%factor(most_rows, most_rows), self%scale(most_rows), self%work(most_rows, 1), source=0.0_wp)
  end function new_semidefinite

  !> Factors the matrix of some rows and columns of a larger one.
  subroutine set_matrix(self, matrix, chosen, order)
    class(semidefinite_t), intent(inout) :: self
    real(wp), intent(in) :: matrix(:, :)   !! symmetric, of any unit
    integer, intent(in) :: chosen(:)       !! rows, the first `order` count
    integer, intent(in) :: order
    integer :: info, k

    self%order = order
    call fill(self, matrix, chosen)
    info = 0
    if (order > 0) call dpotrf('L', order, self%factor, size(self%factor, 1), info)
    self%weakest = info
    self%least_pivot = merge(0.0_wp, 1.0_wp, info > 0)
    do k = 1, merge(order, 0, info == 0)
      if (self%factor(k, k)**2 > self%least_pivot) cycle
      self%weakest = k
      self%least_pivot = self%factor(k, k)**2
    end do
    self%is_singular = self%least_pivot <= null_tolerance
    if (.not. self%is_singular) return
    call fill(self, matrix, chosen)
    self%factor(:order, :order) = pseudo_inverse(self%factor(:order, :order), null_tolerance)
  end subroutine set_matrix

  !> Scales the matrix.
  pure subroutine fill(self, matrix, chosen)
    type(semidefinite_t), intent(inout) :: self
    real(wp), intent(in) :: matrix(:, :)
    integer, intent(in) :: chosen(:)
    integer :: i, k

    do k = 1, self%order
      self%scale(k) = 1.0_wp / sqrt(max(matrix(chosen(k), chosen(k)), tiny(1.0_wp)))
    end do
    do k = 1, self%order
      do i = 1, self%order
        self%factor(i, k) = self%scale(i) * self%scale(k) * matrix(chosen(i), chosen(k))
      end do
    end do
  end subroutine fill

  !> The rank of the matrix of some rows and columns, and one of them that depends on the others.
  subroutine find_rank(self, matrix, chosen, rank, dependent)
    class(semidefinite_t), intent(inout) :: self
    real(wp), intent(in) :: matrix(:, :)
    integer, intent(in) :: chosen(:)     !! rows
    integer, intent(out) :: rank
    integer, intent(out) :: dependent    !! 0 if the rank is full
    integer :: pivots(size(chosen))

    self%order = size(chosen)
    call fill(self, matrix, chosen)
    call pivoted_rank(self%factor(:self%order, :self%order), null_tolerance, rank, pivots)
    dependent = 0
    if (rank < size(chosen)) dependent = chosen(pivots(rank + 1))
  end subroutine find_rank

  !> Replaces a right-hand side by the solution; by the one of least norm of the scaled matrix if it is singular.
  subroutine solve(self, x)
    class(semidefinite_t), intent(inout) :: self
    real(wp), intent(inout) :: x(:)   !! [order], at least
    integer :: info

    associate (n => self%order)
      self%work(:n, 1) = self%scale(:n) * x(:n)
      if (self%is_singular) then
        self%work(:n, 1) = matmul(self%factor(:n, :n), self%work(:n, 1))
      else if (n > 0) then
        call dpotrs('L', n, 1, self%factor, size(self%factor, 1), self%work, size(self%work, 1), info)
      end if
      x(:n) = self%scale(:n) * self%work(:n, 1)
    end associate
  end subroutine solve

end module nocdyn_semidefinite
