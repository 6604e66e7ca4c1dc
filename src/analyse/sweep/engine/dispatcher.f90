!> Who hands out the variants of a sweep to those that compute them, and takes the results: in one process or across many.
module nocdyn_dispatcher
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_chunk, only: chunk_t
  use omp_lib, only: omp_destroy_lock, omp_init_lock, omp_lock_kind, omp_set_lock, omp_test_lock, omp_unset_lock
  implicit none (type, external)
  private

  !> Threads call its procedures between `enter` and `leave`, one at a time; only `is_over` may be called as it is.
  type, abstract, public :: dispatcher_t
    integer(omp_lock_kind), private :: lock
  contains
    procedure(hand_out_interface), deferred :: hand_out
    procedure(take_interface), deferred :: take
    procedure(attend_interface), deferred :: attend
    procedure(attend_interface), deferred :: conclude
    procedure(is_over_interface), deferred :: is_over
    procedure :: open
    procedure :: close
    procedure :: enter
    procedure :: leave
    procedure :: enters
  end type dispatcher_t

  abstract interface

    !> The next variants to compute, consecutive ones; none if `count` is 0.
    subroutine hand_out_interface(self, first, count)
      import :: dispatcher_t
      class(dispatcher_t), intent(inout) :: self
      integer, intent(out) :: first, count
    end subroutine hand_out_interface

    !> Variants that have been computed, in `seconds`.
    subroutine take_interface(self, chunk, seconds)
      import :: chunk_t, dispatcher_t, wp
      class(dispatcher_t), intent(inout) :: self
      type(chunk_t), intent(in) :: chunk
      real(wp), intent(in) :: seconds
    end subroutine take_interface

    !> attend: called often while variants are computed; conclude: once, when nothing is left to compute here.
    subroutine attend_interface(self)
      import :: dispatcher_t
      class(dispatcher_t), intent(inout) :: self
    end subroutine attend_interface

    !> Whether those that compute are to leave off where they are.
    function is_over_interface(self) result(is_over)
      import :: dispatcher_t
      class(dispatcher_t), intent(in) :: self
      logical :: is_over
    end function is_over_interface

  end interface

contains

  !> Before the threads.
  subroutine open(self)
    class(dispatcher_t), intent(inout) :: self

    call omp_init_lock(self%lock)
  end subroutine open

  !> After the threads.
  subroutine close(self)
    class(dispatcher_t), intent(inout) :: self

    call omp_destroy_lock(self%lock)
  end subroutine close

  !> Waits until no other thread is inside.
  subroutine enter(self)
    class(dispatcher_t), intent(inout) :: self

    call omp_set_lock(self%lock)
  end subroutine enter

  subroutine leave(self)
    class(dispatcher_t), intent(inout) :: self

    call omp_unset_lock(self%lock)
  end subroutine leave

  !> Enters if no other thread is inside.
  logical function enters(self)
    class(dispatcher_t), intent(inout) :: self

    enters = omp_test_lock(self%lock)
  end function enters

end module nocdyn_dispatcher
