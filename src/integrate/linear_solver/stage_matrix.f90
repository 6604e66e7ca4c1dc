!> The interface of a linear solver for the stages of a Rosenbrock step, with A = 1/gamma - h J for the states of each lane.
module nocdyn_stage_matrix
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  type, abstract, public :: stage_matrix_t
  contains
    procedure(factor_interface), deferred :: factor
    procedure(solve_interface), deferred :: solve
  end type stage_matrix_t

  abstract interface

    !> Factors the matrix of one lane.
    subroutine factor_interface(self, lane, shift, h, dfdy, singular)
      import :: stage_matrix_t, wp
      class(stage_matrix_t), intent(inout) :: self
      integer, intent(in) :: lane
      real(wp), intent(in) :: shift                      !! 1/gamma
      real(wp), intent(in) :: h                          !! step size [s]
      real(wp), contiguous, intent(in) :: dfdy(:, :)     !! shape [lanes, positions]
      logical, intent(out) :: singular                   !! the matrix is singular: its factors cannot be used
    end subroutine factor_interface

    !> Solves A k = r for the states of one lane, with its factors.
    subroutine solve_interface(self, lane, r, k)
      import :: stage_matrix_t, wp
      class(stage_matrix_t), intent(inout) :: self
      integer, intent(in) :: lane
      real(wp), contiguous, intent(in) :: r(:, :)        !! shape [lanes, components]
      real(wp), contiguous, intent(inout) :: k(:, :)     !! shape [lanes, components]
    end subroutine solve_interface

  end interface

end module nocdyn_stage_matrix
