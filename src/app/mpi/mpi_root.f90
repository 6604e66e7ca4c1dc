!> Scheduler of rank 0, which computes like the other ranks and hands out variants to them between its steps.
module nocdyn_mpi_root
  use, intrinsic :: iso_c_binding, only: c_int
  use nocdyn_errors, only: error_t
  use nocdyn_hand_out, only: hand_out_t
  use nocdyn_journal_scheduler, only: journal_scheduler_t
  use nocdyn_mpi_messages, only: probe_message, receive_error, receive_report, report_t, send_assignment, send_tag, tag_done, &
    tag_error, tag_request, tag_stop
  use nocdyn_scheduler, only: sweep_counts_t, sweep_progress_t
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
    type(hand_out_t), private :: variants            !! of all ranks
    integer, private :: finished_ranks = 0           !! number of ranks that have sent their last message
    logical, private :: has_stopped = .false.        !! whether the other ranks have been told to stop
  contains
    procedure :: begin, refill_pool, poll, finalise
    procedure, private :: handle_message
  end type mpi_root_t

contains

  !> Takes the variants of the whole sweep, for all ranks.
  subroutine begin(self, variants, counts, progress)
    class(mpi_root_t), intent(inout) :: self
    type(hand_out_t), intent(in) :: variants     !! that are missing
    type(sweep_counts_t), intent(in) :: counts   !! of the others
    class(sweep_progress_t), target, intent(inout) :: progress

    self%variants = variants
    self%variants%lanes = self%pool%lanes
    call self%variants%serve_ranks(1 + self%other_ranks, self%pool%workers)
    self%counts = counts
    self%progress => progress
  end subroutine begin

  !> A share for the threads of this rank.
  subroutine refill_pool(self)
    class(mpi_root_t), intent(inout) :: self
    integer :: count, first

    if (self%pool%variant_time > 0) self%variants%variant_time = self%pool%variant_time
    call self%take_variants(self%variants, self%pool%workers, first, count)
    call self%pool%refill(first, count)
  end subroutine refill_pool

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
    type(error_t), allocatable :: error
    type(report_t) :: report
    integer :: count, first

    select case (tag)
    case (tag_request, tag_done)
      call receive_report(rank, tag, report)
      call self%counts%add(report%counts)
      if (report%variant_time > 0) self%variants%variant_time = report%variant_time
      if (tag == tag_done) then
        self%finished_ranks = self%finished_ranks + 1
      else
        call self%take_variants(self%variants, self%pool%workers, first, count)
        call send_assignment(rank, first, count)
      end if
    case (tag_error)
      call receive_error(rank, error)
      if (allocated(self%error)) return
      call move_alloc(error, self%error)
      call self%fail()
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
