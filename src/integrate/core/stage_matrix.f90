!> The matrices A = 1/gamma - h J of the stages of a Rosenbrock step for the states of each lane, factored by LAPACK: dense, or
!> banded with the states in an order that makes the band narrow.
module nocdyn_stage_matrix
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: band_factor, band_solve, lu_factor, lu_solve
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_t
  implicit none (type, external)
  private

  public :: choose_stage_matrix, allocate_dense, allocate_banded, half_bandwidths

  real(wp), parameter :: solutions = 6   ! with one factorisation: the stages of RODAS
  ! Operations that take as long as the BLAS calls for one column inside DGBTRF and DGBTRS: 15 to 20 ns at 2 to 4 operations per
  ! ns, measured with the reference LAPACK at orders 4 to 200 and bandwidths 1 to 16.
  real(wp), parameter :: column_cost = 40

  type, public :: stage_matrix_t
    logical :: is_banded = .false.
    integer, private :: lower = 0, upper = 0            !! numbers of diagonals of a band below and above the main one
    integer, allocatable, private :: order(:)           !! state of each row
    type(entries_t), private :: entries                 !! of the Jacobian in the rows of states, with their places in `factors`
    real(wp), allocatable, private :: factors(:, :, :)  !! [states, or 2 lower + upper + 1 rows of a band; states; lanes]
    integer, allocatable, private :: pivots(:, :)       !! [states, lanes]
    real(wp), allocatable, private :: x(:)              !! right-hand side, then solution, of one lane
  contains
    procedure :: operations, factor, solve
  end type stage_matrix_t

contains

  !> Allocates the matrices of every lane, dense or banded, whichever needs fewer operations in a step. Up to about a dozen
  !> states this is always the dense one.
  subroutine choose_stage_matrix(entries, lanes, states, matrix)
    type(entries_t), intent(in) :: entries   !! in the rows of states
    integer, intent(in) :: lanes, states
    type(stage_matrix_t), intent(out) :: matrix
    integer :: lower, upper
    integer, allocatable :: order(:)

    allocate (order(states), source=0)
    order(:) = reverse_cuthill_mckee(states, entries%row, entries%column)
    call half_bandwidths(order, entries, lower, upper)
    if (banded_operations(real(states, wp), real(lower, wp), real(upper, wp)) < dense_operations(real(states, wp))) then
      call allocate_banded(matrix, order, entries, lanes)
    else
      call allocate_dense(matrix, entries, lanes, states)
    end if
  end subroutine choose_stage_matrix

  !> Operations of a step with a banded matrix. Row interchanges widen U to l + u diagonals: a column costs 2 l (l + u) in the
  !> factorisation and 2 (2 l + u) in each solution.
  elemental real(wp) function banded_operations(n, l, u) result(operations)
    real(wp), intent(in) :: n, l, u   !! states, numbers of diagonals below and above the main one

    operations = n * (2 * l * (l + u) + column_cost + solutions * (2 * (2 * l + u) + column_cost))
  end function banded_operations

  !> Operations of a step with a dense matrix: 2/3 n^3 for the factorisation, 2 n^2 for each solution.
  elemental real(wp) function dense_operations(n) result(operations)
    real(wp), intent(in) :: n   !! states

    operations = (2 * n / 3 + 2 * solutions) * n**2
  end function dense_operations

  !> Operations of a step of one lane.
  pure real(wp) function operations(self)
    class(stage_matrix_t), intent(in) :: self

    associate (n => real(size(self%order), wp))
      operations = dense_operations(n)
      if (self%is_banded) operations = banded_operations(n, real(self%lower, wp), real(self%upper, wp))
    end associate
  end function operations

  !> Allocates dense matrices of every lane.
  pure subroutine allocate_dense(matrix, entries, lanes, states)
    type(stage_matrix_t), intent(out) :: matrix
    type(entries_t), intent(in) :: entries   !! in the rows of states
    integer, intent(in) :: lanes, states
    integer :: i

    matrix%entries = entries
    call allocate_factors(matrix, [(i, i=1, states)], states, lanes)
  end subroutine allocate_dense

  !> Allocates banded matrices of every lane.
  pure subroutine allocate_banded(matrix, order, entries, lanes)
    type(stage_matrix_t), intent(out) :: matrix
    integer, intent(in) :: order(:)          !! state of each row of the band
    type(entries_t), intent(in) :: entries   !! in the rows of states
    integer, intent(in) :: lanes
    integer :: index_of(size(order)), i

    matrix%is_banded = .true.
    matrix%entries = entries
    call half_bandwidths(order, entries, matrix%lower, matrix%upper)
    index_of(order) = [(i, i=1, size(order))]
    matrix%entries%column(:) = index_of(entries%column)
    matrix%entries%row(:) = matrix%lower + matrix%upper + 1 + index_of(entries%row) - matrix%entries%column
    call allocate_factors(matrix, order, 2 * matrix%lower + matrix%upper + 1, lanes)
  end subroutine allocate_banded

  !> Allocates the factors of every lane.
  pure subroutine allocate_factors(matrix, order, rows, lanes)
    type(stage_matrix_t), intent(inout) :: matrix
    integer, intent(in) :: order(:)   !! state of each row
    integer, intent(in) :: rows       !! of the array of factors
    integer, intent(in) :: lanes

    allocate (matrix%order, source=order)
    allocate (matrix%factors(rows, size(order), lanes), matrix%x(size(order)), source=0.0_wp)
    allocate (matrix%pivots(size(order), lanes), source=0)
  end subroutine allocate_factors

  !> Numbers of diagonals below and above the main one that have entries, with the states in an order.
  pure subroutine half_bandwidths(order, entries, lower, upper)
    integer, intent(in) :: order(:)
    type(entries_t), intent(in) :: entries
    integer, intent(out) :: lower, upper
    integer :: index_of(size(order)), i

    index_of(order) = [(i, i=1, size(order))]
    lower = max(0, maxval(index_of(entries%row) - index_of(entries%column)))
    upper = max(0, maxval(index_of(entries%column) - index_of(entries%row)))
  end subroutine half_bandwidths

  !> Factors the matrix of one lane.
  subroutine factor(self, lane, shift, h, dfdy, singular)
    class(stage_matrix_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: shift                    !! 1/gamma
    real(wp), intent(in) :: h                        !! step size [s]
    real(wp), contiguous, intent(in) :: dfdy(:, :)   !! [lanes, positions]
    logical, intent(out) :: singular                 !! the matrix is singular: its factors cannot be used
    integer :: i, j, p

    associate (a => self%factors(:, :, lane), entries => self%entries)
      a = 0.0_wp
      do p = 1, size(entries%position)
        a(entries%row(p), entries%column(p)) = -h * dfdy(lane, entries%position(p))
      end do
      do j = 1, size(self%order)
        i = merge(self%lower + self%upper + 1, j, self%is_banded)
        a(i, j) = a(i, j) + shift
      end do
    end associate
    if (self%is_banded) then
      call band_factor(self%lower, self%upper, self%factors(:, :, lane), self%pivots(:, lane), singular)
    else
      call lu_factor(self%factors(:, :, lane), self%pivots(:, lane), singular)
    end if
  end subroutine factor

  !> Solves A k = r for the states of one lane, with its factors.
  subroutine solve(self, lane, r, k)
    class(stage_matrix_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: r(:, :)      !! [lanes, components]
    real(wp), contiguous, intent(inout) :: k(:, :)   !! [lanes, components]
    integer :: i

    do i = 1, size(self%order)
      self%x(i) = r(lane, self%order(i))
    end do
    if (self%is_banded) then
      call band_solve(self%lower, self%upper, self%factors(:, :, lane), self%pivots(:, lane), self%x)
    else
      call lu_solve(self%factors(:, :, lane), self%pivots(:, lane), self%x)
    end if
    do i = 1, size(self%order)
      k(lane, self%order(i)) = self%x(i)
    end do
  end subroutine solve

end module nocdyn_stage_matrix
