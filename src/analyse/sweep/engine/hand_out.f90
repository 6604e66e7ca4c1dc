!> Hands out the variants of a sweep to workers in shares that shrink towards the end (guided self-scheduling).
!>
!> A process takes shares of the missing variants for its threads, from rank 0 if there are several, and hands them out to its
!> threads in chunks. Both are handed out by the same law. tests/support/simulated_ranks.f90 simulates it for many ranks.
module nocdyn_hand_out
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: share_size

  real(wp), parameter, public :: chunk_seconds = 0.2_wp   !! for a chunk: long for a journal, short for a person who waits
  integer, parameter :: max_growth = 8                    ! of a share over the one before

  ! An answer of rank 0 and its messages take less than `answer_seconds` (`scripts/bench hand_out`: 0.3 us without a network).
  ! Rank 0 is busy for a twentieth of the time with the requests of all ranks while their shares take `bulk` times as long as one
  ! answer to each of them, and for a quarter of the time with those at the end.
  real(wp), parameter :: answer_seconds = 5.0e-6_wp
  integer, parameter :: bulk = 20, least = 4

  !> Ranges of variants that are not yet handed out.
  type, public :: hand_out_t
    integer(int64) :: left = 0                          !! number of variants
    integer :: workers = 1                              !! threads that share them
    integer :: lanes = 1                                !! of a worker
    integer :: most_variants = huge(1)                  !! of a share
    real(wp) :: most_seconds = chunk_seconds            !! for a worker's share
    real(wp) :: least_seconds = 0.0_wp                  !! for a worker's share, as long as enough variants are left
    real(wp) :: variant_time = 0.0_wp                   !! of a worker [s], 0 if it is not known yet
    integer(int64), allocatable, private :: first(:)    !! first variant of each range ...
    integer(int64), allocatable, private :: count(:)    !! ... and the number of its variants
    integer, private :: range = 1                       !! index of the range that is handed out
    integer, private :: last_size = 0                   !! of a worker's share in the last one
  contains
    generic :: refill => refill_ranges, refill_range
    procedure :: take_over, serve_ranks, take
    procedure, private :: refill_ranges, refill_range
  end type hand_out_t

contains

  !> Takes ranges in ascending order. Those before must have been handed out.
  subroutine refill_ranges(self, first, count)
    class(hand_out_t), intent(inout) :: self
    integer(int64), intent(in) :: first(:), count(:)   !! first variant and number of variants of each range

    if (self%left > 0) error stop 'nocdyn_hand_out: refill needs that all variants have been handed out'
    self%first = first
    self%count = count
    self%left = sum(count)
    self%range = 1
  end subroutine refill_ranges

  !> Takes one range, as another hand-out has taken it; it may have no variants.
  subroutine refill_range(self, first, count)
    class(hand_out_t), intent(inout) :: self
    integer, intent(in) :: first, count

    if (count > 0) call self%refill_ranges([int(first, int64)], [int(count, int64)])
  end subroutine refill_range

  !> Takes the ranges of another one.
  subroutine take_over(self, other)
    class(hand_out_t), intent(inout) :: self
    type(hand_out_t), intent(in) :: other

    call self%refill(other%first, other%count)
  end subroutine take_over

  !> Hands out to the threads of ranks, which send a message for each share.
  subroutine serve_ranks(self, ranks, threads)
    class(hand_out_t), intent(inout) :: self
    integer, intent(in) :: ranks, threads   !! threads of each rank

    self%workers = ranks * threads
    self%most_seconds = max(chunk_seconds, bulk * ranks * answer_seconds)
    self%least_seconds = least * ranks * answer_seconds
  end subroutine serve_ranks

  !> The next consecutive variants for some workers, none if all are handed out.
  subroutine take(self, workers, first, count)
    class(hand_out_t), intent(inout) :: self
    integer, intent(in) :: workers         !! that share them
    integer(int64), intent(out) :: first
    integer, intent(out) :: count

    first = 0
    count = 0
    if (self%left == 0) return
    self%last_size = share_size(self, self%last_size)
    associate (r => self%range)
      count = int(min(int(self%last_size, int64) * workers, self%count(r), int(self%most_variants, int64)))
      first = self%first(r)
      self%first(r) = first + count
      self%count(r) = self%count(r) - count
      if (self%count(r) == 0) r = r + 1
    end associate
    self%left = self%left - count
  end subroutine take

  !> The number of variants of a worker's next share: at first one for each lane, then as many as take `most_seconds`. When few
  !> are left and there are several workers, shares are smaller, so that all workers end at about the same time.
  pure integer function share_size(hand_out, last_size) result(variants)
    type(hand_out_t), intent(in) :: hand_out   !! with variants that are left
    integer, intent(in) :: last_size           !! of the share before, 0 if there was none
    integer(int64) :: share
    real(wp) :: most

    associate (lanes => hand_out%lanes, workers => hand_out%workers, time => hand_out%variant_time)
      most = lanes
      if (time > 0) most = max(most, min(hand_out%most_seconds / time, real(hand_out%most_variants, wp)))
      most = min(most, real(max_growth, wp) * max(last_size, lanes), real(huge(1) / workers, wp))
      share = (hand_out%left - 1) / workers + 1
      if (workers > 1) share = max((share + 1) / 2, min(share, int(lanes, int64)))
      if (time > 0) share = max(share, int(min(hand_out%least_seconds / time, most), int64))
      variants = max(1, int(min(int(most, int64), share)))
    end associate
  end function share_size

end module nocdyn_hand_out
