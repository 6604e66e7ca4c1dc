!> Hands out a list of points to the threads of a sweep, and keeps their results in memory.
module nocdyn_point_scheduler
  use nocdyn_kinds, only: wp
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_sweep_chunk, only: chunk_t, status_done
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_point_scheduler

  type, extends(scheduler_t), public :: point_scheduler_t
    real(wp), allocatable :: results(:, :)       !! [results, points]
    logical, allocatable :: is_done(:)           !! whether a point has results
    type(string_t), allocatable :: reasons(:)    !! why others have none
    integer, private :: handed_out = 0, most = 1
  contains
    procedure :: next_chunk, submit, poll => do_nothing, finalise => do_nothing, is_cancelled
  end type point_scheduler_t

contains

  !> Of some points.
  subroutine new_point_scheduler(points, results, threads, lanes, self)
    integer, intent(in) :: points, results, threads
    integer, intent(in) :: lanes   !! of a block
    type(point_scheduler_t), intent(out) :: self

    allocate (self%results(results, points), source=0.0_wp)
    allocate (self%is_done(points), source=.false.)
    allocate (self%reasons(points))
    self%most = max(1, min(lanes, (points - 1) / threads + 1))
  end subroutine new_point_scheduler

  subroutine next_chunk(self, first, count)
    class(point_scheduler_t), intent(inout) :: self
    integer, intent(out) :: first, count

    first = self%handed_out + 1
    count = min(self%most, size(self%is_done) - self%handed_out)
    self%handed_out = self%handed_out + count
  end subroutine next_chunk

  subroutine submit(self, chunk, seconds)
    class(point_scheduler_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds
    integer :: i, p

    do i = 1, chunk%count
      p = chunk%first + i - 1
      self%is_done(p) = chunk%status(i) == status_done
      if (self%is_done(p)) then
        self%results(:, p) = chunk%results(:, i)
      else
        self%reasons(p)%text = chunk%reasons(i)%text
      end if
    end do
  end subroutine submit

  subroutine do_nothing(self)
    class(point_scheduler_t), intent(inout) :: self
  end subroutine do_nothing

  function is_cancelled(self)
    class(point_scheduler_t), intent(in) :: self
    logical :: is_cancelled

    is_cancelled = .false.
  end function is_cancelled

end module nocdyn_point_scheduler
