!> Scheduler of the ranks above 0: it requests variants from rank 0 and appends the results to the journal of its rank.
module nocdyn_mpi_worker
  use nocdyn_journal_scheduler, only: journal_scheduler_t
  use nocdyn_mpi_messages, only: probe_message, receive_assignment, receive_tag, report_t, root, send_error, send_report, &
    tag_done, tag_request, tag_stop, wait_for_message
  use nocdyn_scheduler, only: sweep_counts_t
  implicit none (type, external)
  private

  type, extends(journal_scheduler_t), public :: mpi_worker_t
    logical, private :: is_exhausted = .false.   !! whether rank 0 has no more variants
    logical, private :: is_stopped = .false.     !! whether rank 0 has told this rank to stop
  contains
    procedure :: refill_pool, poll, finalise, is_cancelled
    procedure, private :: report
  end type mpi_worker_t

contains

  !> Requests the next variants from rank 0.
  subroutine refill_pool(self)
    class(mpi_worker_t), intent(inout) :: self
    integer :: count, first

    if (self%is_exhausted) return
    call self%report(tag_request)
    call receive_assignment(first, count)
    self%is_exhausted = count == 0
    call self%pool%refill(first, count)
  end subroutine refill_pool

  !> Tells rank 0 what has been done since the last time.
  subroutine report(self, tag)
    class(mpi_worker_t), intent(inout) :: self
    integer, intent(in) :: tag

    call send_report(tag, report_t(self%counts, self%pool%variant_time))
    self%counts = sweep_counts_t()
  end subroutine report

  !> Receives a message to stop, if there is one.
  subroutine poll(self)
    class(mpi_worker_t), intent(inout) :: self
    integer :: rank, tag

    call probe_message(rank, tag)
    if (tag /= tag_stop) return
    call receive_tag(root, tag_stop)
    !$omp atomic write
    self%is_stopped = .true.
  end subroutine poll

  !> Closes the journal, sends the last message and waits for the one of rank 0. A message to stop may arrive before it.
  subroutine finalise(self)
    class(mpi_worker_t), intent(inout) :: self
    integer :: tag

    call self%journal%file%close()
    if (allocated(self%error)) call send_error(self%error)
    call self%report(tag_done)
    do
      call wait_for_message(tag)
      call receive_tag(root, tag)
      if (tag == tag_done) exit
    end do
  end subroutine finalise

  !> After such a message, after Ctrl-C, and when the journal cannot be written.
  logical function is_cancelled(self)
    class(mpi_worker_t), intent(in) :: self
    logical :: is_stopped

    !$omp atomic read
    is_stopped = self%is_stopped
    is_cancelled = self%journal_scheduler_t%is_cancelled()
    is_cancelled = is_cancelled .or. is_stopped
  end function is_cancelled

end module nocdyn_mpi_worker
