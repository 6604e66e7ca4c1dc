!> A simulation of how rank 0 hands out the variants of a sweep to ranks of one thread, by the procedure of `nocdyn-mpi`.
module simulated_ranks
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_hand_out, only: hand_out_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: simulate

  integer, parameter :: lanes = 32
  real(wp), parameter :: poll_interval = 1.0e-4_wp   ! of rank 0, which computes in between [s]

  !> What a sweep costs.
  type, public :: sweep_costs_t
    real(wp) :: variants = 1.0e6_wp
    real(wp) :: variant_time = 1.0e-5_wp   !! average of all variants [s]
    real(wp) :: spread = 0.0_wp            !! of the average of a share: it is variant_time (1 + x), x evenly in -spread to spread
    real(wp) :: journal_time = 0.0_wp      !! of a variant, in the journal of its rank [s]
    real(wp) :: answer_time = 0.0_wp       !! of rank 0 for a request, one after the other [s]
  end type sweep_costs_t

  !> What became of it.
  type, public :: simulation_t
    real(wp) :: efficiency = 0.0_wp   !! share of the time of all ranks in which they integrate
    real(wp) :: seconds = 0.0_wp      !! until the last rank ends
    real(wp) :: busy = 0.0_wp         !! share of these in which rank 0 answers requests
    integer :: requests = 0
    integer, private :: noticed = 0   ! requests that have delayed what rank 0 computes
  end type simulation_t

contains

  !> Simulates a sweep on some ranks.
  subroutine simulate(costs, ranks, simulation)
    type(sweep_costs_t), intent(in) :: costs
    integer, intent(in) :: ranks
    type(simulation_t), intent(out) :: simulation
    type(hand_out_t) :: hand_out
    real(wp) :: time(ranks)    ! when the ranks send their next requests [s], a heap: no parent is later than its children
    integer :: rank(ranks)     ! of each of these
    real(wp) :: free_at, work
    integer :: i, waiting

    hand_out%lanes = lanes
    call hand_out%refill([1_int64], [nint(costs%variants, int64)])
    call hand_out%serve_ranks(ranks, 1)
    call random_init(.true., .false.)
    time = 0.0_wp
    rank = [(i, i=0, ranks - 1)]
    waiting = ranks
    free_at = 0.0_wp
    work = 0.0_wp
    do while (waiting > 0)
      call serve(costs, hand_out, simulation, rank(1) == 0, free_at, time(1), work)
      if (time(1) <= simulation%seconds) then   ! this rank has ended
        time(1) = time(waiting)
        rank(1) = rank(waiting)
        waiting = waiting - 1
      end if
      call sift_down(time(:waiting), rank(:waiting))
    end do
    simulation%efficiency = work / (ranks * simulation%seconds)
    simulation%busy = simulation%requests * costs%answer_time / simulation%seconds
  end subroutine simulate

  !> Answers a request. Rank 0 gives shares to itself without a message, but the answers to others delay what it computes.
  subroutine serve(costs, hand_out, simulation, is_root, free_at, time, work)
    type(sweep_costs_t), intent(in) :: costs
    type(hand_out_t), intent(inout) :: hand_out
    type(simulation_t), intent(inout) :: simulation
    logical, intent(in) :: is_root
    real(wp), intent(inout) :: free_at   !! when rank 0 has answered the requests before [s]
    real(wp), intent(inout) :: time      !! of the request; then of the next one, or if there is none `seconds`
    real(wp), intent(inout) :: work      !! of all shares [s]
    integer(int64) :: first
    integer :: count
    real(wp) :: seconds, x

    if (is_root) then
      seconds = (simulation%requests - simulation%noticed) * costs%answer_time
      simulation%noticed = simulation%requests
      time = time + seconds
      if (seconds > 0) return
      free_at = max(free_at, time)
    else
      call random_number(x)
      free_at = max(free_at, time + x * poll_interval) + costs%answer_time
      simulation%requests = simulation%requests + 1
    end if
    call hand_out%take(1, first, count)
    if (count == 0) then
      simulation%seconds = max(simulation%seconds, time)
      return
    end if
    call random_number(x)
    seconds = count * costs%variant_time * (1.0_wp + costs%spread * (2.0_wp * x - 1.0_wp))
    work = work + seconds
    seconds = seconds + count * costs%journal_time
    hand_out%variant_time = seconds / count
    time = free_at + seconds
  end subroutine serve

  !> Moves the first entry of the heap to where it belongs.
  pure subroutine sift_down(time, rank)
    real(wp), intent(inout) :: time(:)
    integer, intent(inout) :: rank(:)
    integer :: child, parent

    parent = 1
    do
      child = 2 * parent
      if (child > size(time)) return
      if (child < size(time)) child = merge(child + 1, child, time(min(child + 1, size(time))) < time(child))
      if (time(parent) <= time(child)) return
      time([parent, child]) = time([child, parent])
      rank([parent, child]) = rank([child, parent])
      parent = child
    end do
  end subroutine sift_down

end module simulated_ranks
