!> The threads of a sweep: each takes chunks of variants from a scheduler until none are left. What their blocks share.
module nocdyn_sweep
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_assembly, only: new_asked_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_joint_simplifications, only: refuse_joints
  use nocdyn_kinds, only: wp
  use nocdyn_run_settings, only: choose_settings
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_statistics_observer, only: needs_work_integrals
  use nocdyn_sweep_block, only: new_sweep_block, sweep_block_t
  use nocdyn_sweep_chunk, only: chunk_t
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_text, only: string_t
  use omp_lib, only: omp_destroy_lock, omp_init_lock, omp_set_lock, omp_set_num_threads, omp_unset_lock
  implicit none (type, external)
  private

  public :: prepare_sweep, compute_variants

  ! Measured: chains of 10 rotors are fastest with 32 lanes, chains of 100 with 8 to 32, chains of 1000 with 4 to 8. No result
  ! depends on the number of lanes.
  integer, parameter :: max_states = 250   ! the parameters of `large_block` lanes fit into the second-level cache
  integer, parameter :: large_block = 32
  integer, parameter :: small_block = 8    ! lanes of larger machines: a multiple of the vector length of any processor

  !> What all blocks of a sweep share.
  type, public :: sweep_setup_t
    integer :: lanes = 1                       !! of a block
    logical :: has_energy_balance = .false.    !! whether the work integrals are among the states
  end type sweep_setup_t

contains

  !> Finds what the blocks share; refuses a base machine that `nocdyn run` would refuse.
  subroutine prepare_sweep(plan, setup, error)
    type(sweep_plan_t), intent(in) :: plan
    type(sweep_setup_t), intent(out) :: setup
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable :: formulation
    type(integration_settings_t) :: settings
    type(string_t), allocatable :: notes(:)

    setup%has_energy_balance = needs_work_integrals(plan%statistics)
    call new_asked_formulation(plan%input, plan%machine, formulation, setup%has_energy_balance)
    if (size(plan%statistics) > 0) call choose_settings(plan%input, formulation, settings, notes, error)
    setup%lanes = merge(large_block, small_block, formulation%states <= max_states)
    if (formulation%joints%count == 0) return
    setup%lanes = 1   ! whose joints may be in different sets
    setup%has_energy_balance = .true.   ! a run has it, which takes the same steps
    if (size(plan%analyses) > 0) call refuse_joints(plan%input, .true., 'a sweep of modes or responses', error)
  end subroutine prepare_sweep

  !> Computes the variants that `scheduler` hands out, by threads with a block of lanes each.
  subroutine compute_variants(plan, setup, threads, scheduler)
    type(sweep_plan_t), target, intent(in) :: plan
    type(sweep_setup_t), intent(in) :: setup   !! of the plan
    integer, intent(in) :: threads
    class(scheduler_t), target, intent(inout) :: scheduler

    call omp_init_lock(scheduler%lock)
    !$omp parallel num_threads(threads) default(shared)
    call compute_chunks(plan, setup, scheduler)
    !$omp end parallel
    call scheduler%finalise()
    call omp_destroy_lock(scheduler%lock)
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

    call omp_set_num_threads(1)   ! of what computes in threads of its own: the response over the speeds
    allocate (block)
    call new_sweep_block(plan, setup%lanes, setup%has_energy_balance, scheduler, block)
    do
      call omp_set_lock(scheduler%lock)
      call scheduler%next_chunk(first, count)
      call omp_unset_lock(scheduler%lock)
      if (count == 0) exit
      seconds = time_now()
      call block%compute(first, count, chunk, is_complete)
      seconds = time_now() - seconds
      if (.not. is_complete) exit
      call omp_set_lock(scheduler%lock)
      call scheduler%submit(chunk, seconds)
      call omp_unset_lock(scheduler%lock)
    end do
    call block%machines%release()
  end subroutine compute_chunks

  !> Monotonic clock time [s].
  real(wp) function time_now() result(seconds)
    integer(int64) :: count, rate

    call system_clock(count, rate)
    seconds = real(count, wp) / real(rate, wp)
  end function time_now

end module nocdyn_sweep
