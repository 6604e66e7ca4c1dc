!> Settling times. A settling time is the last time at which a column leaves a band around its end value. That value is known
!> at the end only, so that the course of the column is stored until then.
module nocdyn_settling_time
  use nocdyn_chebyshev, only: find_last_exit, interpolation_t, max_degree, time_at
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  integer, parameter :: first_room = 64   ! steps

  !> The values of a column at the Chebyshev-Lobatto nodes of every step of a lane. The memory is kept for the next variant.
  type, public :: settling_history_t
    integer, private :: steps = 0
    real(wp), allocatable, private :: t(:, :)        !! start and end of each step [s], [2, room]
    real(wp), allocatable, private :: values(:, :)   !! [nodes, room]
  contains
    procedure :: clear, add, last_exit
  end type settling_history_t

contains

  !> Forgets the steps.
  pure subroutine clear(self)
    class(settling_history_t), intent(inout) :: self

    self%steps = 0
  end subroutine clear

  !> Adds a step.
  subroutine add(self, t_start, t_end, values)
    class(settling_history_t), intent(inout) :: self
    real(wp), intent(in) :: t_start, t_end          !! [s]
    real(wp), contiguous, intent(in) :: values(:)   !! [nodes]

    if (.not. allocated(self%t)) then
      allocate (self%t(2, first_room), self%values(size(values), first_room))
    else if (self%steps == size(self%t, 2)) then
      call grow(self)
    end if
    self%steps = self%steps + 1
    self%t(:, self%steps) = [t_start, t_end]
    self%values(:, self%steps) = values
  end subroutine add

  subroutine grow(self)
    type(settling_history_t), intent(inout) :: self
    real(wp), allocatable :: t(:, :), values(:, :)

    allocate (t(2, 2 * self%steps), values(size(self%values, 1), 2 * self%steps))
    t(:, :self%steps) = self%t
    values(:, :self%steps) = self%values
    call move_alloc(t, self%t)
    call move_alloc(values, self%values)
  end subroutine grow

  !> The last time [s] at which the column differs from `end_value` by more than the share `band` of the difference at its start;
  !> the start if there is none.
  pure real(wp) function last_exit(self, rule, end_value, band)
    class(settling_history_t), intent(in) :: self
    type(interpolation_t), intent(in) :: rule   !! of the nodes
    real(wp), intent(in) :: end_value           !! of the column
    real(wp), intent(in) :: band
    real(wp) :: deviations(max_degree + 1), position
    logical :: found
    integer :: step

    last_exit = self%t(1, 1)
    do step = self%steps, 1, -1
      deviations(:rule%degree + 1) = self%values(:, step) - end_value
      call find_last_exit(rule, deviations, band * abs(self%values(1, 1) - end_value), position, found)
      if (.not. found) cycle
      last_exit = time_at(position, self%t(1, step), self%t(2, step))
      return
    end do
  end function last_exit

end module nocdyn_settling_time
