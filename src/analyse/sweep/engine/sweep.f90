!> The threads of a sweep: each takes chunks of variants from a scheduler until none are left. What their blocks share.
module nocdyn_sweep
  use nocdyn_assembly, only: new_asked_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_joint_simplifications, only: refuse_joints
  use nocdyn_kinds, only: wp
  use nocdyn_run_settings, only: choose_settings
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_statistics, only: needs_work_integrals
  use nocdyn_sweep_block, only: new_sweep_block, sweep_block_t
  use nocdyn_sweep_code, only: sweep_code_t
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_text, only: string_t
  use omp_lib, only: omp_destroy_lock, omp_init_lock, omp_set_num_threads
  implicit none (type, external)
  private

  public :: prepare_sweep, compute_variants

  ! Lanes of a block by the states of the machine: their numbers have to stay in the second-level cache. Measured: an engine of
  ! 22 states and chains of 10 to 40 rotors are as fast with 64 lanes as with 128; chains of 60 to 120 rotors are fastest with 32,
  ! of 1000 with 8, a multiple of the vector length of any processor. No result depends on the number of lanes.
  integer, parameter :: block_states(*) = [100, 250, huge(1)], block_lanes(*) = [64, 32, 8]

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
    ! without runs variants are analysed one by one: no chunk needs more of them than it has time for
    if (size(plan%statistics) > 0) setup%lanes = block_lanes(findloc(formulation%states <= block_states, .true., dim=1))
    if (formulation%joints%count == 0) return
    if (.not. formulation%joints%only_lock()) setup%lanes = 1
    setup%has_energy_balance = .true.   ! a run has it, which takes the same steps
    if (size(plan%analyses) == 0) return
    call refuse_joints(plan%input, .true., 'a sweep of modes or responses', error, sets_speed=.true.)
  end subroutine prepare_sweep

  !> Computes the variants that `scheduler` hands out, by threads with a block of lanes each.
  subroutine compute_variants(plan, setup, threads, scheduler, code)
    type(sweep_plan_t), target, intent(in) :: plan
    type(sweep_setup_t), intent(in) :: setup   !! of the plan
    integer, intent(in) :: threads
    class(scheduler_t), target, intent(inout) :: scheduler
    type(sweep_code_t), target, intent(inout) :: code

    call omp_init_lock(scheduler%lock)
    call omp_init_lock(code%lock)
    !$omp parallel num_threads(threads) default(shared)
    call compute_chunks(plan, setup, scheduler, code)
    !$omp end parallel
    call scheduler%finalise()
    call omp_destroy_lock(code%lock)
    call omp_destroy_lock(scheduler%lock)
  end subroutine compute_variants

  !> One thread's work.
  subroutine compute_chunks(plan, setup, scheduler, code)
    type(sweep_plan_t), target, intent(in) :: plan
    type(sweep_setup_t), intent(in) :: setup
    class(scheduler_t), target, intent(inout) :: scheduler
    type(sweep_code_t), target, intent(inout) :: code
    type(sweep_block_t), allocatable, target :: block

    call omp_set_num_threads(1)   ! of what computes in threads of its own: the response over the speeds
    allocate (block)
    call new_sweep_block(plan, setup%lanes, setup%has_energy_balance, scheduler, code, block)
    call block%compute_chunks()
    call block%machines%release()
  end subroutine compute_chunks

end module nocdyn_sweep
