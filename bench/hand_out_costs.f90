!> hand_out_costs RANKS VARIANTS VARIANT_TIME JOURNAL COST SPREAD
!>
!> Simulates how rank 0 hands out VARIANTS of VARIANT_TIME seconds to RANKS of one thread, by the law of `nocdyn-mpi`. The program
!> prints one JSON object: the share of the time in which the ranks integrate, the time of the sweep [s], the number of requests,
!> and the share of the time in which rank 0 answers them.
!>
!> Rank 0 takes COST seconds for a request, one after the other, and computes in between; it looks for requests after every 0.1 ms.
!> The variants of a share take VARIANT_TIME (1 + x) on average, with x evenly from -SPREAD to SPREAD for each share, and JOURNAL
!> seconds each in the journal of their rank.
program hand_out_costs
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_hand_out, only: hand_out_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)

  integer, parameter :: lanes = 32
  real(wp), parameter :: poll_interval = 1.0e-4_wp   ! of rank 0 [s]
  integer :: ranks
  real(wp) :: variants, variant_time, journal, cost, spread   ! numbers of the command line
  type(hand_out_t) :: hand_out
  real(wp), allocatable :: time(:)    ! when the ranks send their next requests [s], a heap: no parent is later than its children
  integer, allocatable :: rank(:)     ! of each of these
  real(wp) :: answered, busy, ended, known, work
  integer(int64) :: first, requests
  integer :: count, i, waiting

  ranks = nint(number(1))
  variants = number(2)
  variant_time = number(3)
  journal = number(4)
  cost = number(5)
  spread = number(6)
  hand_out%lanes = lanes
  call hand_out%refill([1_int64], [nint(variants, int64)])
  call hand_out%serve_ranks(ranks, 1)
  time = [(0.0_wp, i=1, ranks)]
  rank = [(i, i=0, ranks - 1)]
  waiting = ranks
  answered = 0.0_wp
  busy = 0.0_wp
  ended = 0.0_wp
  work = 0.0_wp
  known = 0.0_wp
  requests = 0
  call random_init(.true., .false.)
  do while (waiting > 0)
    call serve_first()
  end do
  print '(a, es13.6, a, es13.6, a, i0, a, es13.6, a)', '{"efficiency": ', work / (ranks * ended), ', "seconds": ', ended, &
    ', "requests": ', requests, ', "busy": ', busy / ended, '}'

contains

  !> Answers the earliest request. Rank 0 serves itself without a message, but answers delay what it computes.
  subroutine serve_first()
    real(wp) :: share_time, x

    associate (own => merge(0.0_wp, 1.0_wp, rank(1) == 0))
      call random_number(x)
      answered = max(answered, time(1) + own * x * poll_interval) + own * cost
      busy = busy + own * cost
      if (own > 0) requests = requests + 1
    end associate
    hand_out%variant_time = known
    call hand_out%take(1, first, count)
    if (count == 0) then
      ended = max(ended, time(1))
      time(1) = time(waiting)
      rank(1) = rank(waiting)
      waiting = waiting - 1
    else
      call random_number(x)
      share_time = count * variant_time * (1.0_wp + spread * (2.0_wp * x - 1.0_wp))
      work = work + share_time
      share_time = share_time + count * journal
      known = share_time / count
      if (rank(1) == 0 .and. ranks > 1) share_time = share_time / (1.0_wp - min(0.9_wp, busy / max(answered, tiny(1.0_wp))))
      time(1) = answered + share_time
    end if
    call sift_down()
  end subroutine serve_first

  !> Moves the first entry of the heap to where it belongs.
  subroutine sift_down()
    integer :: child, parent

    parent = 1
    do
      child = 2 * parent
      if (child > waiting) return
      if (child < waiting) child = merge(child + 1, child, time(min(child + 1, waiting)) < time(child))
      if (time(parent) <= time(child)) return
      time([parent, child]) = time([child, parent])
      rank([parent, child]) = rank([child, parent])
      parent = child
    end do
  end subroutine sift_down

  !> A number of the command line.
  real(wp) function number(position)
    integer, intent(in) :: position
    character(len=32) :: text

    call get_command_argument(position, text)
    read (text, *) number
  end function number

end program hand_out_costs
