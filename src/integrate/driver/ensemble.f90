!> What the lanes of a block work through: one variant after the other.
module nocdyn_ensemble
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: solver_status_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: initial_states

  !> A lane that has ended is given the next variant at once. The order in which variants end depends on the block; the
  !> result of each does not.
  type, abstract, public :: ensemble_t
  contains
    procedure(next_interface), deferred :: next
    procedure(finish_interface), deferred :: finish
  end type ensemble_t

  abstract interface

    !> Puts the numbers of the next variant into a lane of the system, and its start into y.
    subroutine next_interface(self, system, lane, t, y, found)
      import :: ensemble_t, system_t, wp
      class(ensemble_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      integer, intent(in) :: lane
      real(wp), intent(inout) :: t                  !! the first requested time; may be set to a later start
      real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]
      logical, intent(out) :: found                 !! .false. if no variant is left; then none is asked for again
    end subroutine next_interface

    !> Takes the end of the variant in a lane: done, stopped by an event, failed or interrupted.
    subroutine finish_interface(self, lane, y, solver_status)
      import :: solver_status_t, ensemble_t, wp
      class(ensemble_t), intent(inout) :: self
      integer, intent(in) :: lane
      real(wp), contiguous, intent(in) :: y(:)      !! last state, at the time outcome%t(lane)
      type(solver_status_t), intent(in) :: solver_status        !! only the elements of this lane are settled
    end subroutine finish_interface

  end interface

  !> One variant for each lane, whose numbers are in the system already.
  type, extends(ensemble_t), public :: initial_states_t
    real(wp), allocatable :: y(:, :)        !! [lanes, components]: starts, and ends once they are reached
    type(solver_status_t) :: solver_status
    logical, allocatable :: begun(:)
  contains
    procedure :: next
    procedure :: finish
  end type initial_states_t

contains

  !> The queue of the lanes that start at the rows of y.
  pure function initial_states(y) result(ensemble)
    real(wp), intent(in) :: y(:, :)   !! [lanes, components]
    type(initial_states_t) :: ensemble

    allocate (ensemble%y, source=y)
    allocate (ensemble%begun(size(y, 1)), source=.false.)
  end function initial_states

  subroutine next(self, system, lane, t, y, found)
    class(initial_states_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: found

    found = .not. self%begun(lane)
    if (found) y(:) = self%y(lane, :)
    self%begun(lane) = .true.
  end subroutine next

  subroutine finish(self, lane, y, solver_status)
    class(initial_states_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(solver_status_t), intent(in) :: solver_status

    self%y(lane, :) = y
  end subroutine finish

end module nocdyn_ensemble
