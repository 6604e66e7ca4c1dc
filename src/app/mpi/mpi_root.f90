!> Scheduler of rank 0, which computes like the other ranks and serves their messages between its steps.
module nocdyn_mpi_root
  use, intrinsic :: iso_c_binding, only: c_int
  use nocdyn_kinds, only: wp
  use nocdyn_mpi_messages, only: probe_message, receive_results, receive_tag, send_assignment, send_tag, tag_done, tag_request, &
    tag_results, tag_stop
  use nocdyn_sweep_chunk, only: chunk_t
  use nocdyn_journal_scheduler, only: journal_scheduler_t
  implicit none (type, external)
  private

  integer(c_int), parameter :: poll_interval = 200   ! while rank 0 waits for the other ranks [microseconds]

  interface
    integer(c_int) function c_usleep(microseconds) bind(c, name='usleep')
      import :: c_int
      integer(c_int), value, intent(in) :: microseconds
    end function c_usleep
  end interface

  type, extends(journal_scheduler_t), public :: mpi_root_t
    integer :: other_ranks = 0                       !! number of ranks besides this one
    integer, private :: finished_ranks = 0           !! number of ranks that have sent their last message
    logical, private :: has_stopped = .false.   !! whether the other ranks have been told to stop
  contains
    procedure :: poll, finalise
    procedure, private :: handle_message
  end type mpi_root_t

contains

  !> Shows the progress and answers all waiting messages. If the sweep is cancelled, tells the other ranks to stop.
  subroutine poll(self)
    class(mpi_root_t), intent(inout) :: self
    integer :: rank, tag

    call self%journal_scheduler_t%poll()
    do
      call probe_message(rank, tag)
      if (tag == 0) exit
      call self%handle_message(rank, tag)
    end do
    if (self%has_stopped) return
    if (.not. self%is_cancelled()) return
    self%has_stopped = .true.
    do rank = 1, self%other_ranks
      call send_tag(rank, tag_stop)
    end do
  end subroutine poll

  !> Answers a message of another rank.
  subroutine handle_message(self, rank, tag)
    class(mpi_root_t), intent(inout) :: self
    integer, intent(in) :: rank, tag
    type(chunk_t) :: chunk
    real(wp) :: seconds
    integer :: count, first

    select case (tag)
    case (tag_request)
      call receive_tag(rank, tag)
      call self%next_chunk(first, count)
      call send_assignment(rank, first, count)
    case (tag_results)
      call receive_results(rank, chunk, seconds)
      call self%commit(chunk, seconds)
    case (tag_done)
      call receive_tag(rank, tag)
      self%finished_ranks = self%finished_ranks + 1
    case default
      error stop 'nocdyn_mpi_root: rank 0 received a message with an unknown tag'
    end select
  end subroutine handle_message

  !> Receives the last messages of all ranks, and confirms them.
  subroutine finalise(self)
    class(mpi_root_t), intent(inout) :: self
    integer(c_int) :: status
    integer :: rank

    do while (self%finished_ranks < self%other_ranks)
      call self%poll()
      status = c_usleep(poll_interval)
    end do
    do rank = 1, self%other_ranks
      call send_tag(rank, tag_done)
    end do
  end subroutine finalise

end module nocdyn_mpi_root
