!> Matrices that take the coefficients of a series [a_0, a_1, b_1, ..., a_H, b_H] to those of another one.
!>
!> Linear operators with constant coefficients connect each harmonic with itself only: they multiply a_k - i b_k by a complex
!> number, a_0 by a real one. Other matrices are the sum of such a one and a full one.
module nocdyn_harmonic_blocks
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_invert
  implicit none (type, external)
  private

  public :: new_harmonic_block, subtract_product, swap, take_product

  type, public :: harmonic_block_t
    complex(wp), allocatable :: constant(:)   !! factors of a_0 and of each harmonic [0:H]
    logical :: is_full = .false.              !! whether there is a full part
    real(wp), allocatable :: full(:, :)       !! [2 H + 1, 2 H + 1]
  contains
    procedure :: clear, copy, add_full, invert, times, times_transposed
    procedure, private :: unite
  end type harmonic_block_t

  real(wp), parameter :: least_pivot = 1.0e-8_wp   ! as a share of the largest element

contains

  !> A matrix of zeros.
  type(harmonic_block_t) function new_harmonic_block(harmonics) result(self)
    integer, intent(in) :: harmonics

    allocate (self%constant(0:harmonics), source=(0.0_wp, 0.0_wp))
    allocate (self%full(2 * harmonics + 1, 2 * harmonics + 1), source=0.0_wp)
  end function new_harmonic_block

  !> Sets all elements to zero.
  pure subroutine clear(self)
    class(harmonic_block_t), intent(inout) :: self

    self%is_full = .false.
    self%constant(:) = 0.0_wp
  end subroutine clear

  !> Becomes another one, or its constant part.
  pure subroutine copy(self, other, is_whole)
    class(harmonic_block_t), intent(inout) :: self
    type(harmonic_block_t), intent(in) :: other
    logical, intent(in) :: is_whole

    self%constant(:) = other%constant
    self%is_full = other%is_full .and. is_whole
    if (.not. self%is_full) return
    self%full(:, :) = other%full
    call self%unite()
  end subroutine copy

  !> Each becomes the other one.
  pure subroutine swap(one, other)
    type(harmonic_block_t), intent(inout) :: one, other
    type(harmonic_block_t) :: held

    held%is_full = one%is_full
    one%is_full = other%is_full
    other%is_full = held%is_full
    call move_alloc(one%constant, held%constant)
    call move_alloc(other%constant, one%constant)
    call move_alloc(held%constant, other%constant)
    call move_alloc(one%full, held%full)
    call move_alloc(other%full, one%full)
    call move_alloc(held%full, other%full)
  end subroutine swap

  !> Adds a full matrix.
  pure subroutine add_full(self, matrix)
    class(harmonic_block_t), intent(inout) :: self
    real(wp), intent(in) :: matrix(:, :)   !! [2 H + 1, 2 H + 1]

    if (self%is_full) then
      self%full(:, :) = self%full + matrix
    else
      self%full(:, :) = matrix
      self%is_full = .true.
    end if
  end subroutine add_full

  !> Makes the constant part a part of the full one.
  pure subroutine unite(self)
    class(harmonic_block_t), intent(inout) :: self
    integer :: k

    if (.not. self%is_full) then
      self%full(:, :) = 0.0_wp
      self%is_full = .true.
    end if
    self%full(1, 1) = self%full(1, 1) + self%constant(0)%re
    do k = 1, ubound(self%constant, 1)
      associate (pair => self%full(2 * k:2 * k + 1, 2 * k:2 * k + 1), z => self%constant(k))
        pair(1, 1) = pair(1, 1) + z%re
        pair(2, 1) = pair(2, 1) - z%im
        pair(1, 2) = pair(1, 2) + z%im
        pair(2, 2) = pair(2, 2) + z%re
      end associate
    end do
    self%constant(:) = 0.0_wp
  end subroutine unite

  !> Inverts the matrix. Pivots that are too small are replaced by small ones.
  subroutine invert(self, singular)
    class(harmonic_block_t), intent(inout) :: self
    logical, intent(out) :: singular   !! all elements are zero
    integer :: pivots(size(self%full, 1))
    real(wp) :: least
    integer :: i

    if (.not. self%is_full) then
      least = least_pivot * maxval(abs(self%constant))
      singular = .not. least > 0
      if (singular) return
      where (abs(self%constant) < least) self%constant = least
      self%constant(:) = 1.0_wp / self%constant
      return
    end if
    call self%unite()
    least = least_pivot * maxval(abs(self%full))
    singular = .not. least > 0
    if (singular) return
    call lu_factor(self%full, pivots, singular)
    singular = .false.
    do i = 1, size(pivots)
      if (abs(self%full(i, i)) < least) self%full(i, i) = sign(least, self%full(i, i))
    end do
    call lu_invert(self%full, pivots)
  end subroutine invert

  !> c = a b. Of a and b that have a full part, the constant one is zero.
  pure subroutine take_product(a, b, c)
    type(harmonic_block_t), intent(in) :: a, b
    type(harmonic_block_t), intent(inout) :: c   !! another one than a and b

    call c%clear()
    call subtract_product(a, b, c)
    c%constant(:) = -c%constant
    if (c%is_full) c%full(:, :) = -c%full
  end subroutine take_product

  !> c = c - a b. Of a and b that have a full part, the constant one is zero.
  pure subroutine subtract_product(a, b, c)
    type(harmonic_block_t), intent(in) :: a, b
    type(harmonic_block_t), intent(inout) :: c   !! another one than a and b
    integer :: k

    if (.not. a%is_full .and. .not. b%is_full) then
      c%constant(:) = c%constant - a%constant * b%constant
      if (c%is_full) call c%unite()
      return
    end if
    call c%unite()
    if (a%is_full .and. b%is_full) then
      c%full(:, :) = c%full - matmul(a%full, b%full)
    else if (a%is_full) then
      c%full(:, 1) = c%full(:, 1) - a%full(:, 1) * b%constant(0)%re
      do k = 1, ubound(b%constant, 1)
        associate (cosines => a%full(:, 2 * k), sines => a%full(:, 2 * k + 1), z => b%constant(k))
          c%full(:, 2 * k) = c%full(:, 2 * k) - (cosines * z%re - sines * z%im)
          c%full(:, 2 * k + 1) = c%full(:, 2 * k + 1) - (cosines * z%im + sines * z%re)
        end associate
      end do
    else
      do k = 1, size(b%full, 2)
        c%full(:, k) = c%full(:, k) - scaled(a%constant, b%full(:, k))
      end do
    end if
  end subroutine subtract_product

  !> The matrix times the coefficients of a series.
  pure function times(self, x) result(y)
    class(harmonic_block_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    real(wp) :: y(size(x))

    y = scaled(self%constant, x)
    if (self%is_full) y = y + matmul(self%full, x)
  end function times

  !> The transposed matrix times a vector.
  pure function times_transposed(self, x) result(y)
    class(harmonic_block_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    real(wp) :: y(size(x))

    y = scaled(conjg(self%constant), x)
    if (self%is_full) y = y + matmul(x, self%full)
  end function times_transposed

  !> Coefficients of a series, multiplied harmonic by harmonic.
  pure function scaled(constant, x) result(y)
    complex(wp), intent(in) :: constant(0:)
    real(wp), intent(in) :: x(:)
    real(wp) :: y(size(x))
    integer :: k

    y(1) = constant(0)%re * x(1)
    do k = 1, ubound(constant, 1)
      y(2 * k) = constant(k)%re * x(2 * k) + constant(k)%im * x(2 * k + 1)
      y(2 * k + 1) = constant(k)%re * x(2 * k + 1) - constant(k)%im * x(2 * k)
    end do
  end function scaled

end module nocdyn_harmonic_blocks
