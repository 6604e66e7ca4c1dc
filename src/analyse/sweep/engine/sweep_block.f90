!> One thread's share of a sweep: a block of lanes that works through consecutive variants.
module nocdyn_sweep_block
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_ensemble, only: ensemble_t, initial_states, initial_states_t
  use nocdyn_errors, only: error_t
  use nocdyn_fatigue_groups, only: read_curve
  use nocdyn_finite, only: is_finite
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration, only: integrate_with
  use nocdyn_input, only: input_t
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_methods, only: select_method
  use nocdyn_recorded_quantities, only: restrict_statistics
  use nocdyn_run_settings, only: choose_settings
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_serial_work, only: explain_failure
  use nocdyn_solver_status, only: integration_done, integration_interrupted, solver_status_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_statistics_observer, only: new_statistics_observer, statistics_observer_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_sweep_chunk, only: allocate_chunk, chunk_t, status_done, status_failed, status_refused
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_system, only: system_t
  use nocdyn_text, only: string_t
  use nocdyn_units, only: from_si
  use nocdyn_variant_analyses, only: analyse_chunk
  use nocdyn_variant_machines, only: new_variant_machines, variant_machines_t, variant_needs_own_block, variant_refused
  use omp_lib, only: omp_test_lock, omp_unset_lock
  implicit none (type, external)
  private

  public :: new_sweep_block

  integer, parameter :: poll_interval = 16   ! steps between two calls of the scheduler
  integer, parameter :: not_computed = -1    ! status of a variant until it has been computed

  !> The statistics of the lanes. Between the steps it polls the scheduler.
  type, extends(statistics_observer_t) :: block_observer_t
    class(scheduler_t), pointer :: scheduler => null()
    integer :: steps = 0
  contains
    procedure :: wants_stop
  end type block_observer_t

  !> The variants of a chunk, for the lanes.
  type, extends(ensemble_t) :: chunk_ensemble_t
    type(sweep_block_t), pointer :: block => null()
    type(chunk_t), pointer :: chunk => null()
    integer :: next_index = 1                    !! in the chunk
    integer, allocatable :: index(:)             !! in the chunk, of the variant in each lane
    logical, allocatable :: needs_own_block(:)   !! variants that do not fit the lanes, [variants of the chunk]
  contains
    procedure :: next, finish
  end type chunk_ensemble_t

  type, public :: sweep_block_t
    type(sweep_plan_t), pointer :: plan => null()
    class(scheduler_t), pointer :: scheduler => null()
    type(variant_machines_t) :: machines
    type(block_observer_t) :: observer
    class(stepper_t), allocatable :: stepper            !! as it is before an integration
    type(integration_settings_t) :: settings
    real(wp) :: times(2) = 0.0_wp                       !! start and end [s]
    character(len=:), allocatable, private :: message   !! why the variants that fit the lanes are refused; '': they are not
  contains
    procedure :: compute
    procedure, private :: compute_in_own_block
  end type sweep_block_t

contains

  !> A block of lanes of the base machine, which must not be moved. `release` of its machines frees it.
  subroutine new_sweep_block(plan, lanes, with_energy_balance, scheduler, block)
    type(sweep_plan_t), target, intent(in) :: plan
    integer, intent(in) :: lanes
    logical, intent(in) :: with_energy_balance   !! whether the work integrals are among the states
    class(scheduler_t), target, intent(inout) :: scheduler
    type(sweep_block_t), target, intent(out) :: block
    real(wp) :: typical(plan%design%varied), values(size(plan%numbers%targets))

    block%plan => plan
    block%scheduler => scheduler
    block%observer%scheduler => scheduler
    call plan%values(1, typical)
    call plan%numbers%target_values(typical, values)
    call new_variant_machines(plan%input, plan%numbers%targets, lanes, with_energy_balance, block%machines, values)
    block%message = ''
    if (size(plan%statistics) == 0) return
    call prepare_integration(plan%input, block%machines%formulation, plan, block%settings, block%times, block%stepper, &
                             block%observer%statistics_observer_t, block%message)
  end subroutine new_sweep_block

  !> Settings, stepper and observer of the variants that a formulation is integrated for. Statistics that begin outside of the
  !> times are refused, and columns that the machine does not have.
  subroutine prepare_integration(input, formulation, plan, settings, times, stepper, observer, message)
    type(input_t), intent(in) :: input                           !! of the variants
    class(formulation_t), target, intent(inout) :: formulation   !! stays where it is, as the observer does
    type(sweep_plan_t), intent(in) :: plan
    type(integration_settings_t), intent(out) :: settings
    real(wp), intent(out) :: times(2)                            !! start and end [s]
    class(stepper_t), allocatable, intent(out) :: stepper
    type(statistics_observer_t), intent(out) :: observer
    character(len=:), allocatable, intent(out) :: message        !! '', or why none of these variants can be integrated
    type(string_t), allocatable :: notes(:)
    type(statistic_t), allocatable :: restricted(:)
    type(error_t), allocatable :: error
    integer :: i

    associate (run => input%groups(input%position('run')))
      times = [run%number('t_start'), run%number('t_end')]
    end associate
    call choose_settings(input, formulation, settings, notes, error)
    if (.not. allocated(error)) call check_settings(settings, error)
    if (.not. allocated(error)) call select_method(settings, formulation, stepper, error)
    if (allocated(error)) then
      call move_alloc(error%message, message)
    else
      call restrict_statistics(plan%statistics, times(1), times(2), restricted, message)
      do i = 1, size(restricted)
        if (restricted(i)%fatigue > 0) restricted(i)%curve = read_curve(input%groups(restricted(i)%fatigue))
      end do
      observer = new_statistics_observer(formulation, restricted, times(1), times(2), plan%varies_key('cubic_stiffness'))
      if (message == '' .and. observer%missing /= '') then
        message = observer%missing // ' is recorded, but this machine has no such column'
      end if
    end if
  end subroutine prepare_integration

  !> Computes the variants `first`, `first` + 1, ...
  subroutine compute(self, first, count, chunk, is_complete)
    class(sweep_block_t), target, intent(inout) :: self
    integer, intent(in) :: first, count
    type(chunk_t), target, intent(out) :: chunk
    logical, intent(out) :: is_complete   !! false if the computation was interrupted: the chunk is of no use
    integer :: i

    call allocate_chunk(chunk, first, count, self%plan%design%varied, self%plan%results())
    chunk%results(:, :) = ieee_value(0.0_wp, ieee_quiet_nan)
    chunk%status(:) = not_computed
    if (size(self%plan%statistics) > 0) then
      call integrate_chunk(self, chunk)
    else
      do i = 1, count
        call self%plan%values(first + i - 1, chunk%parameters(:, i))
        chunk%status(i) = status_done
        chunk%steps(i) = 0
      end do
    end if
    is_complete = all(chunk%status /= not_computed)
    if (is_complete .and. size(self%plan%analyses) > 0) call analyse_chunk(self%plan, self%machines, self%scheduler, chunk, &
                                                                           is_complete)
  end subroutine compute

  !> Integrates all variants of a chunk. Those that were interrupted remain `not_computed`.
  subroutine integrate_chunk(self, chunk)
    class(sweep_block_t), target, intent(inout) :: self
    type(chunk_t), target, intent(inout) :: chunk
    type(chunk_ensemble_t) :: ensemble
    class(stepper_t), allocatable :: stepper
    type(solver_status_t) :: solver_status
    real(wp), allocatable :: y(:)
    real(wp) :: t
    integer :: i
    logical :: found

    t = 0.0_wp
    ensemble%block => self
    ensemble%chunk => chunk
    allocate (ensemble%index(self%machines%formulation%lanes), source=0)
    allocate (ensemble%needs_own_block(chunk%count), source=.false.)
    if (self%message == '') then
      allocate (stepper, source=self%stepper)
      call integrate_with(stepper, self%machines%formulation, self%settings, self%times, ensemble, self%observer, solver_status)
    else
      allocate (y(self%machines%formulation%states + self%machines%formulation%quadratures), source=0.0_wp)
      call ensemble%next(self%machines%formulation, 1, t, y, found)   ! refuses all, or notes that they need a block of their own
    end if
    do i = 1, chunk%count
      if (.not. ensemble%needs_own_block(i)) cycle
      if (self%scheduler%is_cancelled()) exit
      call self%compute_in_own_block(chunk, i)
    end do
  end subroutine integrate_chunk

  !> Sets the next variant that fits the lanes in one of them.
  subroutine next(self, system, lane, t, y, found)
    class(chunk_ensemble_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: found
    character(len=:), allocatable :: reason
    real(wp) :: values(size(self%block%plan%numbers%targets))
    integer :: i, status

    do
      i = self%next_index
      found = i <= self%chunk%count
      if (.not. found) return
      self%next_index = i + 1
      call self%block%plan%values(self%chunk%first + i - 1, self%chunk%parameters(:, i))
      call self%block%plan%numbers%target_values(self%chunk%parameters(:, i), values)
      call self%block%machines%set_variant(values, lane, y, status, reason)
      select case (status)
      case (variant_refused)
        call refuse(self%chunk, i, reason)
      case (variant_needs_own_block)
        self%needs_own_block(i) = .true.
      case default
        if (self%block%message == '') exit
        call refuse(self%chunk, i, self%block%message)
      end select
    end do
    self%index(lane) = i
  end subroutine next

  subroutine refuse(chunk, index, reason)
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: index
    character(len=*), intent(in) :: reason

    chunk%status(index) = status_refused
    chunk%reasons(index)%text = reason
  end subroutine refuse

  subroutine finish(self, lane, y, solver_status)
    class(chunk_ensemble_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(solver_status_t), intent(in) :: solver_status

    call store_result(self%chunk, self%index(lane), lane, solver_status, self%block%machines%formulation, self%block%settings, &
                      self%block%plan%statistics, self%block%observer)
  end subroutine finish

  !> Takes the results of the variant in a lane, or why it failed. A result that is not finite is a failure.
  subroutine store_result(chunk, index, lane, solver_status, formulation, settings, statistics, observer)
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: index, lane
    type(solver_status_t), intent(in) :: solver_status
    class(formulation_t), intent(in) :: formulation
    type(integration_settings_t), intent(in) :: settings
    type(statistic_t), intent(in) :: statistics(:)
    class(statistics_observer_t), intent(inout) :: observer
    real(wp) :: values(size(statistics))
    integer :: i

    if (solver_status%code(lane) == integration_interrupted) return
    chunk%steps(index) = solver_status%accepted(lane)
    if (solver_status%code(lane) == integration_done) then
      chunk%status(index) = status_done
      call observer%results(lane, values)
      do i = 1, size(statistics)
        values(i) = from_si(values(i), statistics(i)%in_unit)
        chunk%results(statistics(i)%result, index) = values(i)
      end do
      i = findloc(is_finite(values), .false., dim=1)
      if (i == 0) return
      chunk%status(index) = status_failed
      chunk%reasons(index)%text = 'the result ' // statistics(i)%label // ' is not a finite number'
      chunk%results(:, index) = ieee_value(0.0_wp, ieee_quiet_nan)
    else
      chunk%status(index) = status_failed
      call explain_failure(solver_status, lane, formulation, settings, chunk%reasons(index)%text)
    end if
  end subroutine store_result

  !> Computes a variant that does not fit the lanes with a formulation of one lane.
  subroutine compute_in_own_block(self, chunk, index)
    class(sweep_block_t), intent(inout) :: self
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: index
    class(formulation_t), allocatable, target :: formulation
    type(block_observer_t), target :: observer
    class(stepper_t), allocatable :: stepper
    type(integration_settings_t) :: settings
    type(initial_states_t) :: ensemble
    type(solver_status_t) :: solver_status
    character(len=:), allocatable :: message
    real(wp) :: times(2), values(size(self%plan%numbers%targets))

    call self%plan%numbers%target_values(chunk%parameters(:, index), values)
    call self%machines%own_formulation(values, formulation, message)
    observer%scheduler => self%scheduler
    if (message == '') call prepare_integration(self%machines%input, formulation, self%plan, settings, times, stepper, &
                                                observer%statistics_observer_t, message)
    if (message /= '') then
      call refuse(chunk, index, message)
      return
    end if
    ensemble = initial_states(formulation%start())
    call integrate_with(stepper, formulation, settings, times, ensemble, observer, solver_status)
    call store_result(chunk, index, 1, solver_status, formulation, settings, self%plan%statistics, observer)
  end subroutine compute_in_own_block

  !> Polls the scheduler every `poll_interval` steps, unless another thread does.
  logical function wants_stop(self, t)
    class(block_observer_t), intent(inout) :: self
    real(wp), intent(in) :: t

    wants_stop = .false.
    self%steps = mod(self%steps + 1, poll_interval)
    if (self%steps /= 0) return
    if (omp_test_lock(self%scheduler%lock)) then
      call self%scheduler%poll()
      call omp_unset_lock(self%scheduler%lock)
    end if
    wants_stop = self%scheduler%is_cancelled()
  end function wants_stop

end module nocdyn_sweep_block
