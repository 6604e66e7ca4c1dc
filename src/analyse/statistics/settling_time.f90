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
    real(wp), allocatable, private :: t(:, :)      !! start and end of each step [s], [2, room]
    integer, allocatable, private :: before(:)     !! values of the steps before each one, [room + 1]
    real(wp), allocatable, private :: values(:)    !! of all steps
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
      allocate (self%t(2, first_room), self%before(first_room + 1), self%values(first_room * size(values)))
      self%before(1) = 0
    else
      call make_room(self, size(values))
    end if
    self%steps = self%steps + 1
    associate (step => self%steps)
      self%t(:, step) = [t_start, t_end]
      self%before(step + 1) = self%before(step) + size(values)
      self%values(self%before(step) + 1:self%before(step + 1)) = values
    end associate
  end subroutine add

  !> Makes room for one more step with some values.
  subroutine make_room(self, added)
    type(settling_history_t), intent(inout) :: self
    integer, intent(in) :: added
    real(wp), allocatable :: t(:, :), values(:)
    integer, allocatable :: before(:)

    if (self%steps == size(self%t, 2)) then
      allocate (t(2, 2 * self%steps), before(2 * self%steps + 1))
      t(:, :self%steps) = self%t
      before(:self%steps + 1) = self%before
      call move_alloc(t, self%t)
      call move_alloc(before, self%before)
    end if
    associate (used => self%before(self%steps + 1))
      if (used + added <= size(self%values)) return
      allocate (values(2 * (used + added)))
      values(:used) = self%values(:used)
    end associate
    call move_alloc(values, self%values)
  end subroutine make_room

  !> The last time [s] at which the column differs from `end_value` by more than the share `band` of the difference at its start;
  !> the start if there is none.
  pure real(wp) function last_exit(self, rules, end_value, band)
    class(settling_history_t), intent(in) :: self
    type(interpolation_t), intent(in) :: rules(:)   !! of the degrees of the steps
    real(wp), intent(in) :: end_value           !! of the column
    real(wp), intent(in) :: band
    real(wp) :: deviations(max_degree + 1), position
    logical :: found
    integer :: nodes, step

    last_exit = self%t(1, 1)
    do step = self%steps, 1, -1
      nodes = self%before(step + 1) - self%before(step)
      deviations(:nodes) = self%values(self%before(step) + 1:self%before(step + 1)) - end_value
      call find_last_exit(rules(nodes - 1), deviations, band * abs(self%values(1) - end_value), position, found)
      if (.not. found) cycle
      last_exit = time_at(position, self%t(1, step), self%t(2, step))
      return
    end do
  end function last_exit

end module nocdyn_settling_time
