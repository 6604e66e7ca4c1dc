!> Scheduler of the ranks above 0: it requests variants from rank 0 and sends it the results.
module nocdyn_mpi_worker
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_kinds, only: wp
  use nocdyn_mpi_messages, only: probe_message, receive_assignment, receive_tag, root, send_results, send_tag, tag_done, &
    tag_request, tag_stop, wait_for_message
  use nocdyn_posix, only: is_interrupted
  use nocdyn_sweep_chunk, only: chunk_t
  implicit none (type, external)
  private

  type, extends(scheduler_t), public :: mpi_worker_t
    logical, private :: is_exhausted = .false.   !! whether rank 0 has no more variants
    logical, private :: is_stopped = .false.     !! whether rank 0 has told this rank to stop
  contains
    procedure :: next_chunk, submit, poll, finalise, is_cancelled
  end type mpi_worker_t

contains

  !> Requests the next variants from rank 0.
  subroutine next_chunk(self, first, count)
    class(mpi_worker_t), intent(inout) :: self
    integer, intent(out) :: first   !! variant
    integer, intent(out) :: count   !! number of variants, 0: there are no more

    first = 0
    count = 0
    if (self%is_exhausted) return
    if (self%is_cancelled()) return
    call send_tag(root, tag_request)
    call receive_assignment(first, count)
    self%is_exhausted = count == 0
  end subroutine next_chunk

  !> Sends results to rank 0.
  subroutine submit(self, chunk, seconds)
    class(mpi_worker_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds   !! to compute the chunk [s]

    call send_results(chunk, seconds)
  end subroutine submit

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

  !> Sends the last message and waits for that of rank 0. A message to stop may arrive before it.
  subroutine finalise(self)
    class(mpi_worker_t), intent(inout) :: self
    integer :: tag

    call send_tag(root, tag_done)
    do
      call wait_for_message(tag)
      call receive_tag(root, tag)
      if (tag == tag_done) exit
    end do
  end subroutine finalise

  !> After such a message, and after Ctrl-C.
  function is_cancelled(self)
    class(mpi_worker_t), intent(in) :: self
    logical :: is_cancelled

    !$omp atomic read
    is_cancelled = self%is_stopped
    is_cancelled = is_cancelled .or. is_interrupted()
  end function is_cancelled

end module nocdyn_mpi_worker
