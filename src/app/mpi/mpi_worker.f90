!> The ranks of a sweep but the first: they ask rank 0 for variants and send it the results.
module nocdyn_mpi_worker
  use nocdyn_dispatcher, only: dispatcher_t
  use nocdyn_kinds, only: wp
  use nocdyn_mpi_messages, only: ask, goodbye_word, look, receive_answer, receive_word, root, send_results, send_word, &
    stop_word, wait_for_message
  use nocdyn_posix, only: is_interrupted
  use nocdyn_sweep_chunk, only: chunk_t
  implicit none (type, external)
  private

  type, extends(dispatcher_t), public :: mpi_worker_t
    logical, private :: is_exhausted = .false.   !! rank 0 has nothing left
    logical, private :: is_stopped = .false.     !! by rank 0
  contains
    procedure :: hand_out
    procedure :: take
    procedure :: attend
    procedure :: conclude
    procedure :: is_over
  end type mpi_worker_t

contains

  subroutine hand_out(self, first, count)
    class(mpi_worker_t), intent(inout) :: self
    integer, intent(out) :: first, count

    first = 0
    count = 0
    if (self%is_exhausted) return
    if (self%is_over()) return
    call ask()
    call receive_answer(first, count)
    self%is_exhausted = count == 0
  end subroutine hand_out

  subroutine take(self, chunk, seconds)
    class(mpi_worker_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds

    call send_results(chunk, seconds)
  end subroutine take

  subroutine attend(self)
    class(mpi_worker_t), intent(inout) :: self
    integer :: rank, word

    call look(rank, word)
    if (word /= stop_word) return
    call receive_word(root, stop_word)
    !$omp atomic write
    self%is_stopped = .true.
  end subroutine attend

  !> Takes leave of rank 0; a late word to stop is received on the way.
  subroutine conclude(self)
    class(mpi_worker_t), intent(inout) :: self
    integer :: word

    call send_word(root, goodbye_word)
    do
      call wait_for_message(word)
      call receive_word(root, word)
      if (word == goodbye_word) exit
    end do
  end subroutine conclude

  function is_over(self)
    class(mpi_worker_t), intent(in) :: self
    logical :: is_over

    !$omp atomic read
    is_over = self%is_stopped
    is_over = is_over .or. is_interrupted()
  end function is_over

end module nocdyn_mpi_worker
