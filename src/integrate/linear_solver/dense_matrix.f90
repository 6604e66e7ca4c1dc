!> Dense stage matrices, factored by LAPACK.
module nocdyn_dense_matrix
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_pattern_entries, only: entries_t
  use nocdyn_stage_matrix, only: stage_matrix_t
  implicit none (type, external)
  private

  public :: allocate_dense

  type, extends(stage_matrix_t), public :: dense_matrix_t
    private
    integer :: states
    type(entries_t) :: entries                !! of the Jacobian in the rows of states
    real(wp), allocatable :: factors(:, :, :) !! shape [states, states, lanes]
    integer, allocatable :: pivots(:, :)      !! shape [states, lanes]
    real(wp), allocatable :: x(:)             !! right-hand side, then solution, of one lane
  contains
    procedure :: factor
    procedure :: solve
  end type dense_matrix_t

contains

  !> Allocates the factors of every lane.
  pure subroutine allocate_dense(matrix, entries, lanes, states)
    type(dense_matrix_t), intent(out) :: matrix
    type(entries_t), intent(in) :: entries   !! in the rows of states
    integer, intent(in) :: lanes, states

    matrix%states = states
    matrix%entries = entries
    allocate (matrix%factors(states, states, lanes), source=0.0_wp)
    allocate (matrix%pivots(states, lanes), source=0)
    allocate (matrix%x(states), source=0.0_wp)
  end subroutine allocate_dense

  subroutine factor(self, lane, shift, h, dfdy, singular)
    class(dense_matrix_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: shift
    real(wp), intent(in) :: h
    real(wp), contiguous, intent(in) :: dfdy(:, :)
    logical, intent(out) :: singular
    integer :: i, p

    associate (a => self%factors(:, :, lane))
      a = 0.0_wp
      do p = 1, size(self%entries%position)
        a(self%entries%row(p), self%entries%column(p)) = -h * dfdy(lane, self%entries%position(p))
      end do
      do i = 1, self%states
        a(i, i) = a(i, i) + shift
      end do
    end associate
    call lu_factor(self%factors(:, :, lane), self%pivots(:, lane), singular)
  end subroutine factor

  subroutine solve(self, lane, r, k)
    class(dense_matrix_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: r(:, :)
    real(wp), contiguous, intent(inout) :: k(:, :)
    integer :: i

    do i = 1, self%states
      self%x(i) = r(lane, i)
    end do
    call lu_solve(self%factors(:, :, lane), self%pivots(:, lane), self%x)
    do i = 1, self%states
      k(lane, i) = self%x(i)
    end do
  end subroutine solve

end module nocdyn_dense_matrix
