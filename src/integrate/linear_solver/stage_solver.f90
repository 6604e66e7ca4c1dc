!> Choice between dense and banded stage matrices.
module nocdyn_stage_solver
  use nocdyn_banded_matrix, only: allocate_banded, banded_matrix_t, half_bandwidths
  use nocdyn_dense_matrix, only: allocate_dense, dense_matrix_t
  use nocdyn_kinds, only: wp
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_t
  use nocdyn_stage_matrix, only: stage_matrix_t
  implicit none (type, external)
  private

  public :: choose_stage_matrix

  real(wp), parameter :: solutions = 6   ! with one factorisation: the stages of RODAS
  ! Operations that take as long as the BLAS calls for one column inside DGBTRF and DGBTRS: 15 to 20 ns at 2 to 4 operations per
  ! ns, measured with the reference LAPACK at orders 4 to 200 and bandwidths 1 to 16.
  real(wp), parameter :: column_cost = 40

contains

  !> Allocates the matrices of every lane, dense or banded, whichever needs fewer operations in a step. Up to about a dozen
  !> states this is always the dense one.
  subroutine choose_stage_matrix(entries, lanes, states, matrix)
    type(entries_t), intent(in) :: entries   !! in the rows of states
    integer, intent(in) :: lanes, states
    class(stage_matrix_t), allocatable, intent(out) :: matrix
    type(dense_matrix_t), allocatable :: dense
    type(banded_matrix_t), allocatable :: banded
    integer, allocatable :: order(:)
    integer :: lower, upper

    allocate (order(states), source=0)
    order(:) = reverse_cuthill_mckee(states, entries%row, entries%column)
    call half_bandwidths(order, entries, lower, upper)
    if (banded_cost(states, lower, upper) < dense_cost(states)) then
      allocate (banded)
      call allocate_banded(banded, order, entries, lanes)
      call move_alloc(banded, matrix)
    else
      allocate (dense)
      call allocate_dense(dense, entries, lanes, states)
      call move_alloc(dense, matrix)
    end if
  end subroutine choose_stage_matrix

  !> Operations of a step with a dense matrix: 2/3 n^3 for the factorisation, 2 n^2 for each solution.
  elemental function dense_cost(states) result(cost)
    integer, intent(in) :: states
    real(wp) :: cost

    associate (n => real(states, wp))
      cost = (2 * n / 3 + 2 * solutions) * n**2
    end associate
  end function dense_cost

  !> Operations of a step with a banded matrix. Row interchanges widen U to lower + upper diagonals: a column costs
  !> 2 lower (lower + upper) in the factorisation and 2 (2 lower + upper) in each solution.
  elemental function banded_cost(states, lower, upper) result(cost)
    integer, intent(in) :: states
    integer, intent(in) :: lower, upper   !! numbers of diagonals below and above the main one
    real(wp) :: cost

    associate (n => real(states, wp), l => real(lower, wp), u => real(upper, wp))
      cost = n * (2 * l * (l + u) + column_cost + solutions * (2 * (2 * l + u) + column_cost))
    end associate
  end function banded_cost

end module nocdyn_stage_solver
