!> The contract of a scheduler, which hands out the variants of a sweep to threads and takes their results: in one process or
!> across many; and of what shows the progress of a sweep.
module nocdyn_scheduler
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_chunk, only: chunk_t
  use omp_lib, only: omp_lock_kind
  implicit none (type, external)
  private

  !> Threads call its procedures while they have its lock; only `is_cancelled` may be called without.
  type, abstract, public :: scheduler_t
    integer(omp_lock_kind) :: lock   !! of OpenMP, while there are threads
  contains
    procedure(next_chunk_interface), deferred :: next_chunk
    procedure(submit_interface), deferred :: submit
    procedure(poll_interface), deferred :: poll
    procedure(poll_interface), deferred :: finalise
    procedure(is_cancelled_interface), deferred :: is_cancelled
  end type scheduler_t

  !> Numbers of variants.
  type, public :: sweep_counts_t
    integer :: total = 0
    integer :: done = 0      !! without failures
    integer :: refused = 0
    integer :: failed = 0
    integer :: new = 0       !! computed by this process and the ranks that report to it, failures included
  contains
    procedure :: add
  end type sweep_counts_t

  !> Shows how far a sweep has come.
  type, abstract, public :: sweep_progress_t
  contains
    procedure(update_interface), deferred :: update
  end type sweep_progress_t

  abstract interface

    !> Called often.
    subroutine update_interface(self, counts)
      import :: sweep_counts_t, sweep_progress_t
      class(sweep_progress_t), intent(inout) :: self
      type(sweep_counts_t), intent(in) :: counts
    end subroutine update_interface

    !> The next variants to compute: `count` consecutive ones from `first` on. None are left if `count` is 0.
    subroutine next_chunk_interface(self, first, count)
      import :: scheduler_t
      class(scheduler_t), intent(inout) :: self
      integer, intent(out) :: first, count
    end subroutine next_chunk_interface

    !> Takes the results of a chunk.
    subroutine submit_interface(self, chunk, seconds)
      import :: chunk_t, scheduler_t, wp
      class(scheduler_t), intent(inout) :: self
      type(chunk_t), intent(in) :: chunk
      real(wp), intent(in) :: seconds   !! that its computation took
    end subroutine submit_interface

    !> `poll` is called often while variants are computed, `finalise` once after the threads have ended.
    subroutine poll_interface(self)
      import :: scheduler_t
      class(scheduler_t), intent(inout) :: self
    end subroutine poll_interface

    !> Whether the threads are to stop where they are.
    function is_cancelled_interface(self) result(is_cancelled)
      import :: scheduler_t
      class(scheduler_t), intent(in) :: self
      logical :: is_cancelled
    end function is_cancelled_interface

  end interface

contains

  !> Adds what another process has computed.
  pure subroutine add(self, other)
    class(sweep_counts_t), intent(inout) :: self
    type(sweep_counts_t), intent(in) :: other

    self%done = self%done + other%done
    self%refused = self%refused + other%refused
    self%failed = self%failed + other%failed
    self%new = self%new + other%new
  end subroutine add

end module nocdyn_scheduler
