!> Banded stage matrices, with the states in an order that makes the band narrow, factored by LAPACK.
module nocdyn_banded_matrix
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_band, only: band_factor, band_solve
  use nocdyn_pattern_entries, only: entries_t
  use nocdyn_stage_matrix, only: stage_matrix_t
  implicit none (type, external)
  private

  public :: allocate_banded, half_bandwidths

  type, extends(stage_matrix_t), public :: banded_matrix_t
    private
    integer :: states
    integer :: lower, upper                  !! numbers of diagonals below and above the main one
    integer, allocatable :: order(:)         !! state of each row of the band
    integer, allocatable :: position(:)      !! of the entries in the rows of states, among the values of the Jacobian
    integer, allocatable :: row(:)           !! their rows in the band
    integer, allocatable :: column(:)        !! their columns
    real(wp), allocatable :: band(:, :, :)   !! shape [2 lower + upper + 1, states, lanes]
    integer, allocatable :: pivots(:, :)     !! shape [states, lanes]
    real(wp), allocatable :: x(:)            !! right-hand side, then solution, of one lane
  contains
    procedure :: factor
    procedure :: solve
  end type banded_matrix_t

contains

  !> Allocates the factors of every lane.
  pure subroutine allocate_banded(matrix, order, entries, lanes)
    type(banded_matrix_t), intent(out) :: matrix
    integer, intent(in) :: order(:)          !! state of each row of the band
    type(entries_t), intent(in) :: entries   !! in the rows of states
    integer, intent(in) :: lanes
    integer :: index_of(size(order))

    index_of = inverse(order)
    matrix%states = size(order)
    call half_bandwidths(order, entries, matrix%lower, matrix%upper)
    allocate (matrix%order, source=order)
    allocate (matrix%position, source=entries%position)
    allocate (matrix%row(size(entries%row)), matrix%column(size(entries%row)), source=0)
    matrix%column(:) = index_of(entries%column)
    matrix%row(:) = matrix%lower + matrix%upper + 1 + index_of(entries%row) - matrix%column
    allocate (matrix%band(2 * matrix%lower + matrix%upper + 1, matrix%states, lanes), source=0.0_wp)
    allocate (matrix%pivots(matrix%states, lanes), source=0)
    allocate (matrix%x(matrix%states), source=0.0_wp)
  end subroutine allocate_banded

  !> Numbers of diagonals below and above the main one that have entries, with the states in an order.
  pure subroutine half_bandwidths(order, entries, lower, upper)
    integer, intent(in) :: order(:)
    type(entries_t), intent(in) :: entries
    integer, intent(out) :: lower, upper
    integer :: index_of(size(order))
    integer :: p

    index_of = inverse(order)
    lower = 0
    upper = 0
    do p = 1, size(entries%row)
      lower = max(lower, index_of(entries%row(p)) - index_of(entries%column(p)))
      upper = max(upper, index_of(entries%column(p)) - index_of(entries%row(p)))
    end do
  end subroutine half_bandwidths

  !> The inverse of a permutation.
  pure function inverse(order) result(index_of)
    integer, intent(in) :: order(:)
    integer :: index_of(size(order))
    integer :: i

    do i = 1, size(order)
      index_of(order(i)) = i
    end do
  end function inverse

  subroutine factor(self, lane, shift, h, dfdy, singular)
    class(banded_matrix_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: shift
    real(wp), intent(in) :: h
    real(wp), contiguous, intent(in) :: dfdy(:, :)
    logical, intent(out) :: singular
    integer :: j, p

    associate (band => self%band(:, :, lane), diagonal => self%lower + self%upper + 1)
      band = 0.0_wp
      do p = 1, size(self%position)
        band(self%row(p), self%column(p)) = -h * dfdy(lane, self%position(p))
      end do
      do j = 1, self%states
        band(diagonal, j) = band(diagonal, j) + shift
      end do
    end associate
    call band_factor(self%lower, self%upper, self%band(:, :, lane), self%pivots(:, lane), singular)
  end subroutine factor

  subroutine solve(self, lane, r, k)
    class(banded_matrix_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: r(:, :)
    real(wp), contiguous, intent(inout) :: k(:, :)
    integer :: i

    do i = 1, self%states
      self%x(i) = r(lane, self%order(i))
    end do
    call band_solve(self%lower, self%upper, self%band(:, :, lane), self%pivots(:, lane), self%x)
    do i = 1, self%states
      k(lane, self%order(i)) = self%x(i)
    end do
  end subroutine solve

end module nocdyn_banded_matrix
