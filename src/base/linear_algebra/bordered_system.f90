!> Linear equations whose matrix is narrow but for some last rows and columns:
!> [A B; C D] [x; y] = [r; s].
!>
!> A small one is factored as a whole. Else A is factored as a band, the border is eliminated, and the solution is refined
!> against the whole matrix, because A is nearly singular at folds.
module nocdyn_bordered_system
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: band_factor, band_solve, lu_factor, lu_solve
  implicit none (type, external)
  private

  public :: new_bordered_system

  integer, parameter :: refinements = 2

  type, public :: bordered_system_t
    integer :: inner = 0                              !! order of A
    integer :: border = 0                             !! order of D
    integer :: width = 0                              !! diagonals of A beside the main one, on each side
    logical :: is_dense = .true.
    real(wp), allocatable, private :: whole(:, :)     !! the whole matrix, or of A its band
    real(wp), allocatable :: right(:, :)              !! B and D, [inner + border, border]
    real(wp), allocatable :: below(:, :)              !! C, [border, inner]
    real(wp), allocatable, private :: factors(:, :)
    integer, allocatable, private :: pivots(:)
    real(wp), allocatable, private :: eliminated(:, :), schur(:, :)   !! A^-1 B; D - C A^-1 B
    integer, allocatable, private :: schur_pivots(:)
  contains
    procedure :: clear, add_block, factor, solve
  end type bordered_system_t

contains

  !> A system of zeros.
  type(bordered_system_t) function new_bordered_system(inner, border, width) result(self)
    integer, intent(in) :: inner, border, width   !! as in the type

    self%inner = inner
    self%border = border
    self%width = min(width, inner - 1)
    self%is_dense = 4 * self%width > inner
    if (self%is_dense) then
      allocate (self%whole(inner + border, inner + border), source=0.0_wp)
    else
      allocate (self%whole(3 * self%width + 1, inner), source=0.0_wp)
      allocate (self%eliminated(inner, border), self%schur(border, border))
    end if
    allocate (self%right(inner + border, border), self%below(border, inner), source=0.0_wp)
    allocate (self%factors, source=self%whole)
    allocate (self%pivots(size(self%whole, 2)), self%schur_pivots(border))
  end function new_bordered_system

  !> Sets all elements to zero.
  subroutine clear(self)
    class(bordered_system_t), intent(inout) :: self

    self%whole(:, :) = 0.0_wp
    self%right(:, :) = 0.0_wp
    self%below(:, :) = 0.0_wp
  end subroutine clear

  !> Adds to elements of A.
  subroutine add_block(self, row, column, block)
    class(bordered_system_t), intent(inout) :: self
    integer, intent(in) :: row, column      !! of the first element
    real(wp), intent(in) :: block(:, :)
    integer :: j, offset

    associate (rows => size(block, 1))
      do j = 1, size(block, 2)
        offset = row
        if (.not. self%is_dense) offset = row - (column + j - 1) + 2 * self%width + 1
        self%whole(offset:offset + rows - 1, column + j - 1) = self%whole(offset:offset + rows - 1, column + j - 1) + block(:, j)
      end do
    end associate
  end subroutine add_block

  subroutine factor(self, singular)
    class(bordered_system_t), intent(inout) :: self
    logical, intent(out) :: singular
    integer :: k

    associate (n => self%inner)
      if (self%is_dense) then
        self%whole(:, n + 1:) = self%right
        self%whole(n + 1:, :n) = self%below
        self%factors(:, :) = self%whole
        call lu_factor(self%factors, self%pivots, singular)
        return
      end if
      self%factors(:, :) = self%whole
      call band_factor(self%width, self%width, self%factors, self%pivots, singular)
      if (singular .or. self%border == 0) return
      do k = 1, self%border
        self%eliminated(:, k) = self%right(:n, k)
        call band_solve(self%width, self%width, self%factors, self%pivots, self%eliminated(:, k))
      end do
      self%schur(:, :) = self%right(n + 1:, :) - matmul(self%below, self%eliminated)
      call lu_factor(self%schur, self%schur_pivots, singular)
    end associate
  end subroutine factor

  !> Solves with the factors.
  subroutine solve(self, x)
    class(bordered_system_t), intent(inout) :: self
    real(wp), contiguous, intent(inout) :: x(:)   !! [r; s], on return [x; y]
    real(wp) :: given(size(x)), correction(size(x))
    integer :: k

    if (self%is_dense) then
      call lu_solve(self%factors, self%pivots, x)
      return
    end if
    given = x
    call eliminate(self, x)
    do k = 1, refinements
      correction = given - product_with(self, x)
      call eliminate(self, correction)
      x = x + correction
    end do
  end subroutine solve

  subroutine eliminate(self, x)
    class(bordered_system_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: x(:)

    associate (n => self%inner)
      call band_solve(self%width, self%width, self%factors, self%pivots, x(:n))
      if (self%border == 0) return
      x(n + 1:) = x(n + 1:) - matmul(self%below, x(:n))
      call lu_solve(self%schur, self%schur_pivots, x(n + 1:))
      x(:n) = x(:n) - matmul(self%eliminated, x(n + 1:))
    end associate
  end subroutine eliminate

  !> The whole matrix times a vector.
  pure function product_with(self, x) result(y)
    class(bordered_system_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    real(wp) :: y(size(x))
    integer :: first, j, last, offset

    associate (n => self%inner)
      y = matmul(self%right, x(n + 1:))
      y(n + 1:) = y(n + 1:) + matmul(self%below, x(:n))
      do j = 1, n
        first = max(1, j - self%width)
        last = min(n, j + self%width)
        offset = 2 * self%width + 1 - j
        y(first:last) = y(first:last) + self%whole(offset + first:offset + last, j) * x(j)
      end do
    end associate
  end function product_with

end module nocdyn_bordered_system
