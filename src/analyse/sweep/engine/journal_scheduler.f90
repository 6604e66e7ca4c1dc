!> The books of a sweep: which variants are missing, how many are handed out at once, what has become of them.
module nocdyn_journal_scheduler
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_posix, only: is_interrupted
  use nocdyn_sweep_chunk, only: chunk_t, status_refused
  use nocdyn_sweep_journal, only: sweep_journal_t
  implicit none (type, external)
  private

  public :: initialise_scheduler, chunk_size

  real(wp), parameter :: chunk_seconds = 0.2_wp   !! aimed at: long beside a message, short beside a person's patience
  integer, parameter :: most_at_once = 8192       !! variants, and ...
  integer, parameter :: most_numbers = 2**22      !! ... numbers: keep chunks small enough to be held by the dozen
  integer, parameter :: growth = 8                !! of a chunk over the one before, at most

  !> Numbers of variants.
  type, public :: sweep_counts_t
    integer :: total = 0
    integer :: done = 0      !! without failures
    integer :: refused = 0
    integer :: failed = 0
    integer :: new = 0       !! computed by this process and those that report to it, failures included
  end type sweep_counts_t

  !> Told how far a sweep has come, often.
  type, abstract, public :: sweep_progress_t
  contains
    procedure(update_interface), deferred :: update
  end type sweep_progress_t

  abstract interface
    subroutine update_interface(self, counts)
      import :: sweep_counts_t, sweep_progress_t
      class(sweep_progress_t), intent(inout) :: self
      type(sweep_counts_t), intent(in) :: counts
    end subroutine update_interface
  end interface

  !> Hands out the missing variants in their order and writes the results to the journal.
  type, extends(scheduler_t), public :: journal_scheduler_t
    type(sweep_journal_t), pointer :: journal => null()
    class(sweep_progress_t), pointer :: progress => null()
    type(sweep_counts_t) :: counts
    integer :: workers = 1                       !! threads of all processes
    integer :: lanes = 1                         !! of a worker
    type(error_t), allocatable :: error          !! of the journal; nothing is handed out then
    integer, allocatable, private :: first(:)    !! missing variants: ranges ...
    integer, allocatable, private :: count(:)    !! ... and their lengths
    integer, private :: range = 1                !! from which is handed out
    integer, private :: left = 0                 !! variants not handed out
    integer, private :: most = 1                 !! variants to hand out at once
    integer, private :: last_size = 0            !! of the chunk last handed out
    real(wp), private :: pace = 0.0_wp           !! seconds that a worker needs for a variant, 0: not known yet
    logical, private :: has_failed = .false.      !! `error` as other threads see it
  contains
    procedure :: next_chunk
    procedure :: submit
    procedure :: poll
    procedure :: finalise
    procedure :: commit
    procedure :: is_cancelled
    procedure :: is_complete
  end type journal_scheduler_t

contains

  !> The books of the variants that the journal does not hold.
  subroutine initialise_scheduler(scheduler, journal, progress, workers, lanes)
    class(journal_scheduler_t), intent(inout) :: scheduler
    type(sweep_journal_t), target, intent(inout) :: journal
    class(sweep_progress_t), target, intent(inout) :: progress
    integer, intent(in) :: workers, lanes

    scheduler%journal => journal
    scheduler%progress => progress
    scheduler%workers = workers
    scheduler%lanes = lanes
    call journal%missing(scheduler%first, scheduler%count)
    scheduler%left = sum(scheduler%count)
    scheduler%most = max(1, most_numbers / (size(journal%header%parameters) + size(journal%header%results)))
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
      count = min(self%count(r), self%most, chunk_size(self%left, self%workers, self%lanes, self%pace, self%last_size))
      first = self%first(r)
      self%first(r) = first + count
      self%count(r) = self%count(r) - count
      if (self%count(r) == 0) r = r + 1
    end associate
    self%left = self%left - count
    self%last_size = count
  end subroutine next_chunk

  !> Variants to hand out at once: one for each lane at first, then what takes `chunk_seconds`; at the end, when `left`
  !> variants are shared by several workers, less, so that these come to their ends together.
  pure integer function chunk_size(left, workers, lanes, pace, last_size)
    integer, intent(in) :: left        !! at least 1
    integer, intent(in) :: workers, lanes
    real(wp), intent(in) :: pace       !! seconds for a variant, 0 if it is not known
    integer, intent(in) :: last_size   !! of the chunk before, 0 if there was none
    integer :: share

    chunk_size = lanes
    if (pace > 0) chunk_size = int(min(chunk_seconds / pace, real(most_at_once, wp)))
    chunk_size = max(lanes, min(chunk_size, growth * max(last_size, lanes)))
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

  !> Writes the results to the journal.
  subroutine commit(self, chunk, seconds)
    class(journal_scheduler_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds

    if (allocated(self%error)) return
    !$omp critical (texts)
    call self%journal%append(chunk, self%error)
    !$omp end critical (texts)
    if (allocated(self%error)) then
      !$omp atomic write
      self%has_failed = .true.
      return
    end if
    if (any(chunk%status /= status_refused)) self%pace = seconds / count(chunk%status /= status_refused)
    self%counts%done = self%journal%done
    self%counts%refused = self%journal%refused
    self%counts%failed = self%journal%failed
    self%counts%new = self%counts%new + chunk%count
  end subroutine commit

  subroutine poll(self)
    class(journal_scheduler_t), intent(inout) :: self

    !$omp critical (texts)
    call self%progress%update(self%counts)
    !$omp end critical (texts)
  end subroutine poll

  !> All variants have been computed here.
  subroutine finalise(self)
    class(journal_scheduler_t), intent(inout) :: self
  end subroutine finalise

  !> After Ctrl-C, and when the journal cannot be written.
  function is_cancelled(self)
    class(journal_scheduler_t), intent(in) :: self
    logical :: is_cancelled

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
