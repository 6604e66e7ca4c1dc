!> The scheduler of a process that keeps a journal: it hands out variants to its threads and appends their results.
module nocdyn_journal_scheduler
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_errors, only: error_t
  use nocdyn_hand_out, only: hand_out_t
  use nocdyn_kinds, only: wp
  use nocdyn_number_ranges, only: range_t
  use nocdyn_posix, only: is_interrupted
  use nocdyn_scheduler, only: scheduler_t, sweep_counts_t, sweep_progress_t
  use nocdyn_sweep_chunk, only: chunk_t, status_failed, status_refused
  use nocdyn_sweep_journal, only: missing_variants, sweep_journal_t
  implicit none (type, external)
  private

  public :: initialise_scheduler, schedule_missing

  integer, parameter :: max_variants = 8192   ! of a chunk
  integer, parameter :: max_numbers = 2**22   ! of a chunk: dozens of chunks fit into memory

  !> Hands out the variants of this process and appends the results to its journal.
  type, extends(scheduler_t), public :: journal_scheduler_t
    type(sweep_journal_t), pointer :: journal => null()
    class(sweep_progress_t), pointer :: progress => null()   !! shows the counts; none if not associated
    type(sweep_counts_t) :: counts
    type(hand_out_t) :: pool              !! variants of this process
    type(error_t), allocatable :: error   !! a journal cannot be written: no more chunks are handed out
    logical, private :: has_failed = .false.     !! whether `error` is allocated; other threads read this
  contains
    procedure :: begin, next_chunk, take_variants, submit, refill_pool, poll, finalise, fail, is_cancelled, is_complete
  end type journal_scheduler_t

contains

  !> A scheduler for the threads of a process, without variants.
  subroutine initialise_scheduler(scheduler, journal, threads, lanes)
    class(journal_scheduler_t), intent(inout) :: scheduler
    type(sweep_journal_t), target, intent(inout) :: journal   !! that gets the results
    integer, intent(in) :: threads
    integer, intent(in) :: lanes   !! of a thread

    scheduler%journal => journal
    scheduler%pool%workers = threads
    scheduler%pool%lanes = lanes
    scheduler%pool%most_variants = max(1, min(max_variants, max_numbers / (size(journal%header%parameters) + &
                                                                           size(journal%header%results))))
  end subroutine initialise_scheduler

  !> Lets `hand_out` have the variants that no journal holds, and counts the others.
  subroutine schedule_missing(journals, hand_out, counts)
    type(sweep_journal_t), intent(in) :: journals(:)   !! of one sweep, or of one shard
    type(hand_out_t), intent(inout) :: hand_out
    type(sweep_counts_t), intent(out) :: counts
    type(range_t), allocatable :: missing(:)

    call missing_variants(journals, journals(1)%header, missing)
    call hand_out%refill(int(missing%first, int64), int(missing%last - missing%first + 1, int64))
    counts%total = journals(1)%header%last - journals(1)%header%first + 1
    counts%done = sum(journals%done)
    counts%refused = sum(journals%refused)
    counts%failed = sum(journals%failed)
  end subroutine schedule_missing

  !> Takes the variants of the whole sweep or shard, which it shows the progress of.
  subroutine begin(self, variants, counts, progress)
    class(journal_scheduler_t), intent(inout) :: self
    type(hand_out_t), intent(in) :: variants     !! that are missing
    type(sweep_counts_t), intent(in) :: counts   !! of the others
    class(sweep_progress_t), target, intent(inout) :: progress

    call self%pool%take_over(variants)
    self%counts = counts
    self%progress => progress
  end subroutine begin

  subroutine next_chunk(self, first, count)
    class(journal_scheduler_t), intent(inout) :: self
    integer, intent(out) :: first, count

    if (self%pool%left == 0) then
      if (.not. self%is_cancelled()) call self%refill_pool()
    end if
    call self%take_variants(self%pool, 1, first, count)
  end subroutine next_chunk

  !> The next variants of a hand-out for some workers, none if the sweep is cancelled.
  subroutine take_variants(self, hand_out, workers, first, count)
    class(journal_scheduler_t), intent(in) :: self
    type(hand_out_t), intent(inout) :: hand_out   !! may be the pool
    integer, intent(in) :: workers
    integer, intent(out) :: first, count
    integer(int64) :: variant

    first = 0
    count = 0
    if (self%is_cancelled()) return
    call hand_out%take(workers, variant, count)
    first = int(variant)
  end subroutine take_variants

  !> Gets more variants when all are handed out. There are none: the pool of a single process holds all from the start.
  subroutine refill_pool(self)
    class(journal_scheduler_t), intent(inout) :: self
  end subroutine refill_pool

  !> Appends the results of a chunk to the journal and updates the counts.
  subroutine submit(self, chunk, seconds)
    class(journal_scheduler_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds

    if (.not. allocated(self%error)) then
      call self%journal%append(chunk, self%error)
      if (allocated(self%error)) then
        call self%fail()
      else
        associate (counts => self%counts, refused => count(chunk%status == status_refused), &
                   failed => count(chunk%status == status_failed))
          if (refused < chunk%count) self%pool%variant_time = seconds / (chunk%count - refused)
          counts%done = counts%done + chunk%count - refused - failed
          counts%refused = counts%refused + refused
          counts%failed = counts%failed + failed
          counts%new = counts%new + chunk%count
        end associate
      end if
    end if
    call self%poll()
  end subroutine submit

  !> Cancels the threads, because `error` is allocated.
  subroutine fail(self)
    class(journal_scheduler_t), intent(inout) :: self

    !$omp atomic write
    self%has_failed = .true.
  end subroutine fail

  subroutine poll(self)
    class(journal_scheduler_t), intent(inout) :: self

    if (associated(self%progress)) call self%progress%update(self%counts)
  end subroutine poll

  !> There is nothing to do: the journal holds all results.
  subroutine finalise(self)
    class(journal_scheduler_t), intent(inout) :: self
  end subroutine finalise

  !> True after Ctrl-C, and when a journal cannot be written.
  logical function is_cancelled(self)
    class(journal_scheduler_t), intent(in) :: self

    !$omp atomic read
    is_cancelled = self%has_failed
    is_cancelled = is_cancelled .or. is_interrupted()
  end function is_cancelled

  !> Whether the journals hold every variant.
  pure logical function is_complete(self)
    class(journal_scheduler_t), intent(in) :: self

    associate (counts => self%counts)
      is_complete = counts%done + counts%refused + counts%failed == counts%total
    end associate
  end function is_complete

end module nocdyn_journal_scheduler
