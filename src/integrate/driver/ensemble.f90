!> An ensemble of variants of a system, which the lanes of a block integrate one after the other.
module nocdyn_ensemble
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: solver_status_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: initial_states

  !> A lane that has ended takes the next variant at once. The order in which variants end depends on the number of lanes; the
  !> result of a variant does not.
  type, abstract, public :: ensemble_t
  contains
    procedure(next_interface), deferred :: next
    procedure(finish_interface), deferred :: finish
  end type ensemble_t

  abstract interface

    !> Sets the parameters of the next variant in a lane of the system, and its initial state y.
    subroutine next_interface(self, system, lane, t, y, found)
      import :: ensemble_t, system_t, wp
      class(ensemble_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      integer, intent(in) :: lane
      real(wp), intent(inout) :: t                  !! the first output time; may be set to a later start [s]
      real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]
      logical, intent(out) :: found                 !! .false. if no variant is left; then none is asked for again
    end subroutine next_interface

    !> Receives the last state of the variant in a lane: done, stopped by an event, failed or interrupted.
    subroutine finish_interface(self, lane, y, solver_status)
      import :: solver_status_t, ensemble_t, wp
      class(ensemble_t), intent(inout) :: self
      integer, intent(in) :: lane
      real(wp), contiguous, intent(in) :: y(:)      !! last state, at the time solver_status%t(lane)
      type(solver_status_t), intent(in) :: solver_status        !! only the elements of this lane are final
    end subroutine finish_interface

  end interface

  !> One variant for each lane, whose parameters the system holds already.
  type, extends(ensemble_t), public :: initial_states_t
    real(wp), allocatable :: y(:, :)        !! [lanes, components]: initial states, replaced by the last states
    logical, allocatable :: begun(:)
  contains
    procedure :: next, finish
  end type initial_states_t

contains

  !> The ensemble of one variant for each lane, with the rows of y as initial states.
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
