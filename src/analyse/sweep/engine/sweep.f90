!> The threads of a sweep: each takes chunks of variants from a scheduler until none are left.
module nocdyn_sweep
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_block, only: new_sweep_block, sweep_block_t
  use nocdyn_sweep_chunk, only: chunk_t
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_sweep_setup, only: sweep_setup_t
  implicit none (type, external)
  private

  public :: compute_variants

contains

  !> Computes the variants that `scheduler` hands out, by threads with a block of lanes each.
  subroutine compute_variants(plan, setup, threads, scheduler)
    type(sweep_plan_t), target, intent(in) :: plan
    type(sweep_setup_t), intent(in) :: setup   !! of the plan
    integer, intent(in) :: threads
    class(scheduler_t), target, intent(inout) :: scheduler

    call scheduler%create_lock()
    !$omp parallel num_threads(threads) default(shared)
    call compute_chunks(plan, setup, scheduler)
    !$omp end parallel
    call scheduler%finalise()
    call scheduler%destroy_lock()
  end subroutine compute_variants

  !> One thread's work.
  subroutine compute_chunks(plan, setup, scheduler)
    type(sweep_plan_t), target, intent(in) :: plan
    type(sweep_setup_t), intent(in) :: setup
    class(scheduler_t), target, intent(inout) :: scheduler
    type(sweep_block_t), allocatable, target :: block
    type(chunk_t), target :: chunk
    real(wp) :: seconds
    integer :: count, first
    logical :: is_complete

    allocate (block)
    call new_sweep_block(plan, setup, scheduler, block)
    do
      call scheduler%lock()
      call scheduler%next_chunk(first, count)
      call scheduler%unlock()
      if (count == 0) exit
      seconds = time_now()
      call block%compute(first, count, chunk, is_complete)
      seconds = time_now() - seconds
      if (.not. is_complete) exit
      call scheduler%lock()
      call scheduler%submit(chunk, seconds)
      call scheduler%unlock()
    end do
    call block%release()
  end subroutine compute_chunks

  !> Of a clock that only runs forward [s].
  function time_now() result(seconds)
    real(wp) :: seconds
    integer(int64) :: count, rate

    call system_clock(count, rate)
    seconds = real(count, wp) / real(rate, wp)
  end function time_now

end module nocdyn_sweep
