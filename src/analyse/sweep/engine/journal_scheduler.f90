!> The scheduler of a sweep that keeps a journal: it hands out the variants that the journal lacks and appends their results.
module nocdyn_journal_scheduler
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_posix, only: is_interrupted
  use nocdyn_scheduler, only: scheduler_t, sweep_counts_t, sweep_progress_t
  use nocdyn_sweep_chunk, only: chunk_t, status_refused
  use nocdyn_sweep_journal, only: sweep_journal_t
  implicit none (type, external)
  private

  public :: initialise_scheduler, chunk_size

  real(wp), parameter :: chunk_seconds = 0.2_wp   ! time for a chunk: long for a message, short for a person who waits
  integer, parameter :: max_variants = 8192       ! of a chunk
  integer, parameter :: max_numbers = 2**22       ! of a chunk: dozens of chunks fit into memory
  integer, parameter :: max_growth = 8            ! of a chunk over the one before

  !> Hands out the missing variants in ascending order and appends the results to the journal.
  type, extends(scheduler_t), public :: journal_scheduler_t
    type(sweep_journal_t), pointer :: journal => null()
    class(sweep_progress_t), pointer :: progress => null()
    type(sweep_counts_t) :: counts
    integer :: workers = 1                       !! threads of all processes
    integer :: lanes = 1                         !! of a worker
    type(error_t), allocatable :: error          !! the journal cannot be written: no more chunks are handed out
    integer, allocatable, private :: first(:)    !! first variant of each range that is missing ...
    integer, allocatable, private :: count(:)    !! ... and the number of its variants
    integer, private :: range = 1                !! index of the range that is handed out
    integer, private :: left = 0                 !! variants that are not yet handed out
    integer, private :: max_size = 1                 !! variants of a chunk
    integer, private :: last_size = 0            !! of the last chunk
    real(wp), private :: variant_time = 0.0_wp   !! of a worker [s], 0 if it is not known yet
    logical, private :: has_failed = .false.     !! whether `error` is allocated; other threads read this
  contains
    procedure :: next_chunk, submit, poll, finalise, commit, is_cancelled, is_complete
  end type journal_scheduler_t

contains

  !> A scheduler of the variants that the journal does not hold.
  subroutine initialise_scheduler(scheduler, journal, progress, workers, lanes)
    class(journal_scheduler_t), intent(inout) :: scheduler
    type(sweep_journal_t), target, intent(inout) :: journal
    class(sweep_progress_t), target, intent(inout) :: progress
    integer, intent(in) :: workers   !! threads of all processes
    integer, intent(in) :: lanes     !! of a worker

    scheduler%journal => journal
    scheduler%progress => progress
    scheduler%workers = workers
    scheduler%lanes = lanes
    call journal%missing(scheduler%first, scheduler%count)
    scheduler%left = sum(scheduler%count)
    scheduler%max_size = max(1, max_numbers / (size(journal%header%parameters) + size(journal%header%results)))
    scheduler%counts%total = journal%header%last - journal%header%first + 1
    scheduler%counts%done = journal%done
    scheduler%counts%refused = journal%refused
    scheduler%counts%failed = journal%failed
  end subroutine initialise_scheduler

  subroutine next_chunk(self, first, count)
    class(journal_scheduler_t), intent(inout) :: self
    integer, intent(out) :: first, count

    first = 0
    count = 0
    if (self%left == 0) return
    if (self%is_cancelled()) return
    associate (r => self%range)
      count = chunk_size(self%left, self%workers, self%lanes, self%variant_time, self%last_size)
      count = min(count, self%count(r), self%max_size)
      first = self%first(r)
      self%first(r) = first + count
      self%count(r) = self%count(r) - count
      if (self%count(r) == 0) r = r + 1
    end associate
    self%left = self%left - count
    self%last_size = count
  end subroutine next_chunk

  !> The number of variants of the next chunk: at first one for each lane, then as many as take `chunk_seconds`. When few are left
  !> and there are several workers, chunks are smaller, so that all workers end at about the same time.
  pure integer function chunk_size(left, workers, lanes, variant_time, last_size)
    integer, intent(in) :: left             !! variants that are not yet handed out, at least 1
    integer, intent(in) :: workers          !! threads of all processes
    integer, intent(in) :: lanes            !! of a worker
    real(wp), intent(in) :: variant_time    !! of a worker [s], 0 if it is not known
    integer, intent(in) :: last_size        !! of the chunk before, 0 if there was none
    integer :: share

    chunk_size = lanes
    if (variant_time > 0) chunk_size = int(min(chunk_seconds / variant_time, real(max_variants, wp)))
    chunk_size = max(lanes, min(chunk_size, max_growth * max(last_size, lanes)))
    share = (left - 1) / workers + 1
    if (workers > 1) share = max((share + 1) / 2, min(share, lanes))
    chunk_size = max(1, min(chunk_size, share))
  end function chunk_size

  subroutine submit(self, chunk, seconds)
    class(journal_scheduler_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds

    call self%commit(chunk, seconds)
    call self%poll()
  end subroutine submit

  !> Appends the results of a chunk to the journal and updates the counts.
  subroutine commit(self, chunk, seconds)
    class(journal_scheduler_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds

    if (allocated(self%error)) return
    call self%journal%append(chunk, self%error)
    if (allocated(self%error)) then
      !$omp atomic write
      self%has_failed = .true.
      return
    end if
    if (any(chunk%status /= status_refused)) self%variant_time = seconds / count(chunk%status /= status_refused)
    self%counts%done = self%journal%done
    self%counts%refused = self%journal%refused
    self%counts%failed = self%journal%failed
    self%counts%new = self%counts%new + chunk%count
  end subroutine commit

  subroutine poll(self)
    class(journal_scheduler_t), intent(inout) :: self

    call self%progress%update(self%counts)
  end subroutine poll

  !> There is nothing to do: the journal holds all results.
  subroutine finalise(self)
    class(journal_scheduler_t), intent(inout) :: self
  end subroutine finalise

  !> True after Ctrl-C, and when the journal cannot be written.
  logical function is_cancelled(self)
    class(journal_scheduler_t), intent(in) :: self

    !$omp atomic read
    is_cancelled = self%has_failed
    is_cancelled = is_cancelled .or. is_interrupted()
  end function is_cancelled

  !> Whether the journal holds every variant.
  pure logical function is_complete(self)
    class(journal_scheduler_t), intent(in) :: self

    associate (counts => self%counts)
      is_complete = counts%done + counts%refused + counts%failed == counts%total
    end associate
  end function is_complete

end module nocdyn_journal_scheduler
