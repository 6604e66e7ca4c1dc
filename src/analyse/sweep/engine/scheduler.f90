!> Who hands out the variants of a sweep to those that compute them, and takes the results: in one process or across many.
module nocdyn_scheduler
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_chunk, only: chunk_t
  use omp_lib, only: omp_destroy_lock, omp_init_lock, omp_lock_kind, omp_set_lock, omp_test_lock, omp_unset_lock
  implicit none (type, external)
  private

  !> Threads call its procedures between `lock` and `unlock`, one at a time; only `is_cancelled` may be called as it is.
  type, abstract, public :: scheduler_t
    integer(omp_lock_kind), private :: omp_lock
  contains
    procedure(next_chunk_interface), deferred :: next_chunk
    procedure(submit_interface), deferred :: submit
    procedure(poll_interface), deferred :: poll
    procedure(poll_interface), deferred :: finalise
    procedure(is_cancelled_interface), deferred :: is_cancelled
    procedure :: create_lock
    procedure :: destroy_lock
    procedure :: lock
    procedure :: unlock
    procedure :: try_lock
  end type scheduler_t

  abstract interface

    !> The next variants to compute, consecutive ones; none if `count` is 0.
    subroutine next_chunk_interface(self, first, count)
      import :: scheduler_t
      class(scheduler_t), intent(inout) :: self
      integer, intent(out) :: first, count
    end subroutine next_chunk_interface

    !> Variants that have been computed, in `seconds`.
    subroutine submit_interface(self, chunk, seconds)
      import :: chunk_t, scheduler_t, wp
      class(scheduler_t), intent(inout) :: self
      type(chunk_t), intent(in) :: chunk
      real(wp), intent(in) :: seconds
    end subroutine submit_interface

    !> `poll` is called often while variants are computed, `finalise` once, when nothing is left to compute here.
    subroutine poll_interface(self)
      import :: scheduler_t
      class(scheduler_t), intent(inout) :: self
    end subroutine poll_interface

    !> Whether those that compute are to leave off where they are.
    function is_cancelled_interface(self) result(is_cancelled)
      import :: scheduler_t
      class(scheduler_t), intent(in) :: self
      logical :: is_cancelled
    end function is_cancelled_interface

  end interface

contains

  !> Before the threads.
  subroutine create_lock(self)
    class(scheduler_t), intent(inout) :: self

    call omp_init_lock(self%omp_lock)
  end subroutine create_lock

  !> After the threads.
  subroutine destroy_lock(self)
    class(scheduler_t), intent(inout) :: self

    call omp_destroy_lock(self%omp_lock)
  end subroutine destroy_lock

  !> Waits until no other thread is inside.
  subroutine lock(self)
    class(scheduler_t), intent(inout) :: self

    call omp_set_lock(self%omp_lock)
  end subroutine lock

  subroutine unlock(self)
    class(scheduler_t), intent(inout) :: self

    call omp_unset_lock(self%omp_lock)
  end subroutine unlock

  !> Enters if no other thread is inside.
  logical function try_lock(self)
    class(scheduler_t), intent(inout) :: self

    try_lock = omp_test_lock(self%omp_lock)
  end function try_lock

end module nocdyn_scheduler
