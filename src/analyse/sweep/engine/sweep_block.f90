!> One thread's share of a sweep: a block of lanes that works through consecutive variants.
module nocdyn_sweep_block
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration, only: integrate_with
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_methods, only: select_method
  use nocdyn_solver_status, only: failure_message, integration_done, integration_interrupted, solver_status_t
  use nocdyn_ensemble, only: initial_states, initial_states_t, ensemble_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_statistics_observer, only: new_statistics_observer, statistics_observer_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_sweep_chunk, only: allocate_chunk, chunk_t, status_done, status_failed, status_refused
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_recorded_quantities, only: restrict_statistics
  use nocdyn_sweep_setup, only: sweep_setup_t, read_settings
  use nocdyn_system, only: system_t
  use nocdyn_variant_machines, only: new_variant_machines, variant_needs_own_block, variant_machines_t, variant_refused
  implicit none (type, external)
  private

  public :: new_sweep_block

  integer, parameter :: poll_interval = 16    ! steps between two looks at the rest of the world
  integer, parameter :: not_computed = -1

  !> The statistics of the lanes; between the steps it looks after the dispatcher.
  type, extends(statistics_observer_t) :: block_observer_t
    class(scheduler_t), pointer :: scheduler => null()
    integer :: steps = 0
  contains
    procedure :: wants_stop
  end type block_observer_t

  !> The variants of a chunk, for the lanes.
  type, extends(ensemble_t) :: chunk_queue_t
    type(sweep_block_t), pointer :: block => null()
    type(chunk_t), pointer :: chunk => null()
    integer :: next_index = 1               !! in the chunk
    integer, allocatable :: index(:)        !! of the variant in each lane
    logical, allocatable :: needs_own_block(:)     !! variants left over for a formulation of their own
  contains
    procedure :: next
    procedure :: finish
  end type chunk_queue_t

  !> gfortran 12 keeps the lengths of texts that functions return in static memory, of all threads: texts are made by one thread
  !> at a time, in the critical section `texts`.
  type, public :: sweep_block_t
    type(sweep_plan_t), pointer :: plan => null()
    class(scheduler_t), pointer :: scheduler => null()
    type(variant_machines_t) :: machines
    type(block_observer_t) :: observer
    class(stepper_t), allocatable :: stepper   !! as it is before an integration
    type(integration_settings_t) :: settings
    real(wp) :: times(2) = 0.0_wp              !! start and end [s]
    character(len=:), allocatable, private :: message   !! why the variants that fit the lanes are refused; '': they are not
  contains
    procedure :: compute
    procedure :: release
    procedure, private :: compute_in_own_block
  end type sweep_block_t

contains

  !> A block of lanes of the base machine, which stays where it is. To be given up by `release`.
  subroutine new_sweep_block(plan, setup, scheduler, block, error)
    type(sweep_plan_t), target, intent(in) :: plan
    type(sweep_setup_t), intent(in) :: setup
    class(scheduler_t), target, intent(inout) :: scheduler
    type(sweep_block_t), target, intent(out) :: block
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: typical(plan%design%varied)

    block%plan => plan
    block%scheduler => scheduler
    call plan%values(1, typical)
    call new_variant_machines(plan%input, plan%targets, setup%lanes, setup%has_energy_balance, block%machines, error, typical)
    if (allocated(error)) return
    !$omp critical (texts)
    call read_settings(plan%input, block%machines%formulation, block%settings, block%times, error)
    if (.not. allocated(error)) call select_method(block%settings, block%stepper, error)
    if (.not. allocated(error)) then
      call new_block_observer(block%machines%formulation, plan, block%times, scheduler, block%observer, error)
    end if
    block%message = ''
    if (allocated(error)) call move_alloc(error%message, block%message)
    !$omp end critical (texts)
    if (allocated(error)) deallocate (error)
  end subroutine new_sweep_block

  subroutine release(self)
    class(sweep_block_t), intent(inout) :: self

    call self%machines%release()
  end subroutine release

  !> The statistics of variants that run through these times; if some begin outside of them, or have nothing to look at, that is
  !> an error.
  subroutine new_block_observer(formulation, plan, times, scheduler, observer, error)
    class(formulation_t), target, intent(inout) :: formulation   !! stays where it is, as the observer does
    type(sweep_plan_t), intent(in) :: plan
    real(wp), intent(in) :: times(2)
    class(scheduler_t), target, intent(inout) :: scheduler
    type(block_observer_t), intent(out) :: observer
    type(error_t), allocatable, intent(out) :: error
    type(statistic_t), allocatable :: statistics(:)
    character(len=:), allocatable :: message

    call restrict_statistics(plan%statistics, times(1), times(2), statistics, message)
    observer%statistics_observer_t = new_statistics_observer(formulation, statistics, times(1), times(2))
    observer%scheduler => scheduler
    if (message == '' .and. observer%missing /= '') then
      message = observer%missing // ' is recorded, but this machine has no such column'
    end if
    if (message /= '') call raise(error, exit_input, message)
  end subroutine new_block_observer

  !> The variants `first`, `first` + 1, ... Those that are interrupted do not count: `is_complete` is false then.
  subroutine compute(self, first, count, chunk, is_complete)
    class(sweep_block_t), target, intent(inout) :: self
    integer, intent(in) :: first, count
    type(chunk_t), target, intent(out) :: chunk
    logical, intent(out) :: is_complete
    type(chunk_queue_t) :: ensemble
    class(stepper_t), allocatable :: stepper
    type(solver_status_t) :: solver_status
    integer :: i

    call allocate_chunk(chunk, first, count, self%plan%design%varied, size(self%plan%statistics))
    chunk%results(:, :) = ieee_value(0.0_wp, ieee_quiet_nan)
    chunk%status(:) = not_computed
    ensemble%block => self
    ensemble%chunk => chunk
    allocate (ensemble%index(self%machines%formulation%lanes), source=0)
    allocate (ensemble%needs_own_block(count), source=.false.)
    if (self%message == '') then
      allocate (stepper, source=self%stepper)
      call integrate_with(stepper, self%machines%formulation, self%settings, self%times, ensemble, self%observer, solver_status)
    else
      call refuse_all(self%machines%formulation, ensemble)
    end if
    do i = 1, count
      if (.not. ensemble%needs_own_block(i)) cycle
      if (self%scheduler%is_cancelled()) exit
      call self%compute_in_own_block(chunk, i)
    end do
    is_complete = all(chunk%status /= not_computed)
  end subroutine compute

  !> Goes through a queue whose variants are refused or left over.
  subroutine refuse_all(formulation, ensemble)
    class(formulation_t), intent(inout) :: formulation
    type(chunk_queue_t), intent(inout) :: ensemble
    real(wp), allocatable :: y(:)
    real(wp) :: t
    logical :: found

    allocate (y(formulation%states + formulation%quadratures), source=0.0_wp)
    t = 0.0_wp
    call ensemble%next(formulation, 1, t, y, found)
    if (found) error stop 'nocdyn_sweep_block: a variant has been put into a lane that does not run'
  end subroutine refuse_all

  !> Puts the numbers of the next variant that a lane can hold into one.
  subroutine next(self, system, lane, t, y, found)
    class(chunk_queue_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: found
    character(len=:), allocatable :: reason
    integer :: i, status

    do
      i = self%next_index
      found = i <= self%chunk%count
      if (.not. found) return
      self%next_index = i + 1
      call self%block%plan%values(self%chunk%first + i - 1, self%chunk%parameters(:, i))
      call self%block%machines%set_variant(self%chunk%parameters(:, i), lane, y, status, reason)
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
    call self%block%observer%start_lane(lane, y)
  end subroutine next

  subroutine refuse(chunk, index, reason)
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: index
    character(len=*), intent(in) :: reason

    chunk%status(index) = status_refused
    chunk%reasons(index)%text = reason
  end subroutine refuse

  subroutine finish(self, lane, y, solver_status)
    class(chunk_queue_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(solver_status_t), intent(in) :: solver_status

    call store_result(self%chunk, self%index(lane), lane, solver_status, self%block%machines%formulation, self%block%settings, &
                  self%block%observer)
  end subroutine finish

  !> What has become of the variant in a lane.
  subroutine store_result(chunk, index, lane, solver_status, formulation, settings, observer)
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: index, lane
    type(solver_status_t), intent(in) :: solver_status
    class(formulation_t), intent(in) :: formulation
    type(integration_settings_t), intent(in) :: settings
    class(statistics_observer_t), intent(inout) :: observer

    if (solver_status%code(lane) == integration_interrupted) return
    chunk%steps(index) = solver_status%accepted(lane)
    if (solver_status%code(lane) == integration_done) then
      chunk%status(index) = status_done
      call observer%results(lane, chunk%results(:, index))
    else
      chunk%status(index) = status_failed
      !$omp critical (texts)
      chunk%reasons(index)%text = failure_message(solver_status, lane, formulation, settings%rtol, settings%atol)
      !$omp end critical (texts)
    end if
  end subroutine store_result

  !> A variant that no lane of the block can hold: a formulation of one lane, made for it.
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
    type(error_t), allocatable :: error
    real(wp), allocatable :: start(:)
    real(wp) :: times(2)

    call self%machines%own_formulation(chunk%parameters(:, index), formulation)
    !$omp critical (texts)
    call read_settings(self%machines%input, formulation, settings, times, error)
    if (.not. allocated(error)) call check_settings(settings, error)
    if (.not. allocated(error)) call select_method(settings, stepper, error)
    if (.not. allocated(error)) call new_block_observer(formulation, self%plan, times, self%scheduler, observer, error)
    if (allocated(error)) call refuse(chunk, index, error%message)
    !$omp end critical (texts)
    if (allocated(error)) return
    ensemble = initial_states(formulation%start())
    allocate (start, source=ensemble%y(1, :))
    call observer%start_lane(1, start)
    call integrate_with(stepper, formulation, settings, times, ensemble, observer, solver_status)
    call store_result(chunk, index, 1, solver_status, formulation, settings, observer)
  end subroutine compute_in_own_block

  !> Looks after the dispatcher now and then, unless another thread does.
  function wants_stop(self, t)
    class(block_observer_t), intent(inout) :: self
    real(wp), intent(in) :: t
    logical :: wants_stop

    wants_stop = .false.
    self%steps = mod(self%steps + 1, poll_interval)
    if (self%steps /= 0) return
    if (self%scheduler%try_lock()) then
      call self%scheduler%poll()
      call self%scheduler%unlock()
    end if
    wants_stop = self%scheduler%is_cancelled()
  end function wants_stop

end module nocdyn_sweep_block
