!> The settings that all blocks of a sweep share, and the check that its base machine can be run.
module nocdyn_sweep_setup
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_run_settings, only: settings_of
  use nocdyn_series_strips, only: strip
  use nocdyn_size_limits, only: check_size, choose_method
  use nocdyn_statistics_observer, only: needs_work_integrals
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: prepare_sweep, read_settings

  ! Measured: chains of 10 rotors are fastest with 32 lanes, those of 100 with 8 to 32, those of 1000 with 4 to 8. No result
  ! depends on the number of lanes.
  integer, parameter :: max_states = 250   ! the parameters of `strip` lanes fit into the second-level cache
  integer, parameter :: small_block = 8    ! lanes of larger machines: a multiple of the vector length of any processor

  type, public :: sweep_setup_t
    integer :: lanes = 1                       !! of a block
    logical :: has_energy_balance = .false.    !! whether a recorded column needs the work integrals
  end type sweep_setup_t

contains

  !> Finds the settings; refuses a base machine that `nocdyn run` would refuse.
  subroutine prepare_sweep(plan, setup, error)
    type(sweep_plan_t), intent(in) :: plan
    type(sweep_setup_t), intent(out) :: setup
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: machine
    class(formulation_t), allocatable :: formulation
    type(integration_settings_t) :: settings
    type(group_t) :: run
    real(wp) :: times(2)

    call assemble_machine(plan%input, machine, error)
    if (.not. allocated(error)) call check_size(plan%input, machine, error)
    if (allocated(error)) return
    run = plan%input%single('run')
    call new_formulation(run%text('formulation'), machine, formulation)
    call read_settings(plan%input, formulation, settings, times, error)
    if (allocated(error)) return
    setup%has_energy_balance = needs_work_integrals(formulation, plan%statistics)
    setup%lanes = merge(strip, small_block, formulation%states <= max_states)
  end subroutine prepare_sweep

  !> The integration settings and the times of &run.
  subroutine read_settings(input, formulation, settings, times, error)
    type(input_t), intent(in) :: input
    class(formulation_t), intent(in) :: formulation
    type(integration_settings_t), intent(out) :: settings
    real(wp), intent(out) :: times(2)                   !! start and end [s]
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run
    type(string_t), allocatable :: notes(:)
    character(len=:), allocatable :: method

    call choose_method(input, formulation, method, notes, error)
    if (allocated(error)) return
    run = input%single('run')
    settings = settings_of(input, method)
    times = [run%number('t_start'), run%number('t_end')]
  end subroutine read_settings

end module nocdyn_sweep_setup
