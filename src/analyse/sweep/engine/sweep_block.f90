!> One thread's share of a sweep: a block of lanes that works through consecutive variants.
module nocdyn_sweep_block
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int64
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
  use nocdyn_sweep_code, only: sweep_code_t
  use nocdyn_sweep_chunk, only: allocate_chunk, chunk_t, status_done, status_failed, status_refused
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_system, only: system_t
  use nocdyn_text, only: string_t
  use nocdyn_units, only: from_si
  use nocdyn_variant_analyses, only: analyse_chunk
  use nocdyn_variant_machines, only: new_variant_machines, variant_machines_t, variant_needs_own_block, variant_refused
  use omp_lib, only: omp_set_lock, omp_test_lock, omp_unset_lock
  implicit none (type, external)
  private

  public :: new_sweep_block

  integer, parameter :: poll_interval = 16   ! steps between two calls of the scheduler
  integer, parameter :: not_computed = -1    ! status of a variant until it has been computed
  integer, parameter :: needs_own_block = -2 ! and of one that does not fit the lanes

  !> The statistics of the lanes. Between the steps it polls the scheduler.
  type, extends(statistics_observer_t) :: block_observer_t
    class(scheduler_t), pointer :: scheduler => null()
    integer :: steps = 0
    real(wp), allocatable :: values(:)   !! of the statistics of the last variant
  contains
    procedure :: wants_stop
  end type block_observer_t

  !> A chunk whose results are not all there.
  type :: open_chunk_t
    type(chunk_t) :: chunk
    logical :: is_open = .false.
    integer :: next_index = 1   !! of the next variant for a lane
    integer :: left = 0         !! variants that are in lanes or not handed out
    integer :: own_blocks = 0   !! variants that do not fit the lanes; their status is `needs_own_block`
  end type open_chunk_t

  !> The variants of one chunk after the other, for the lanes: these do not wait for the slowest variant of a chunk.
  type, extends(ensemble_t) :: chunk_ensemble_t
    type(sweep_block_t), pointer :: block => null()
    type(open_chunk_t), allocatable :: chunks(:)   !! each has a variant in a lane, or variants for lanes, [lanes + 1]
    integer :: newest = 0                          !! chunk that has variants for lanes; 0: none
    integer, allocatable :: slot(:), index(:)      !! chunk of the variant in each lane, and its number there
    real(wp), allocatable :: values(:)             !! of the targets, of the last variant
    logical :: is_last = .false.                   !! no chunk is taken after the newest one in this integration
    logical :: none_left = .false.                 !! the scheduler has no more variants
    real(wp) :: submitted = 0.0_wp                 !! when the last chunk was submitted, or the integration began [s]
  contains
    procedure :: next, finish
  end type chunk_ensemble_t

  type, public :: sweep_block_t
    type(sweep_plan_t), pointer :: plan => null()
    class(scheduler_t), pointer :: scheduler => null()
    type(sweep_code_t), pointer :: code => null()
    type(variant_machines_t) :: machines
    type(block_observer_t) :: observer
    class(stepper_t), allocatable :: stepper            !! as it is before an integration
    type(integration_settings_t) :: settings
    real(wp) :: times(2) = 0.0_wp                       !! start and end [s]
    character(len=:), allocatable, private :: message   !! why the variants that fit the lanes are refused; '': they are not
  contains
    procedure :: compute_chunks
    procedure, private :: compute_in_own_block
  end type sweep_block_t

contains

  !> A block of lanes of the base machine, which must not be moved. `release` of its machines frees it.
  subroutine new_sweep_block(plan, lanes, with_energy_balance, scheduler, code, block)
    type(sweep_plan_t), target, intent(in) :: plan
    integer, intent(in) :: lanes
    logical, intent(in) :: with_energy_balance   !! whether the work integrals are among the states
    class(scheduler_t), target, intent(inout) :: scheduler
    type(sweep_code_t), target, intent(inout) :: code
    type(sweep_block_t), target, intent(out) :: block
    real(wp) :: typical(plan%design%varied), values(size(plan%numbers%targets))

    block%plan => plan
    block%scheduler => scheduler
    block%code => code
    block%observer%scheduler => scheduler
    call plan%values(1, typical)
    call plan%numbers%target_values(typical, values)
    call new_variant_machines(plan%input, plan%numbers%targets, lanes, with_energy_balance, block%machines, values)
    block%message = ''
    if (size(plan%statistics) == 0) return
    call prepare_integration(plan%input, block%machines%formulation, plan, block%settings, block%times, block%stepper, &
                             block%observer%statistics_observer_t, block%message)
    if (block%message /= '') return
    if (block%stepper%series_order > 0) call block%machines%formulation%prepare_series(block%stepper%series_order)
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

  !> Computes the variants that the scheduler hands out, until there are none or it cancels the sweep.
  subroutine compute_chunks(self)
    class(sweep_block_t), target, intent(inout) :: self
    type(chunk_ensemble_t) :: ensemble
    integer :: i
    logical :: found

    ensemble%block => self
    associate (lanes => self%machines%formulation%lanes)
      allocate (ensemble%slot(lanes), ensemble%index(lanes), source=0)
      allocate (ensemble%chunks(lanes + 1))
    end associate
    allocate (ensemble%values(size(self%plan%numbers%targets)))
    do
      ensemble%is_last = size(self%plan%statistics) == 0 .or. size(self%plan%analyses) > 0
      ensemble%submitted = time_now()
      call take_chunk(ensemble, found)
      if (.not. found) exit
      call integrate_chunks(self, ensemble)
      do i = 1, size(ensemble%chunks)
        if (ensemble%chunks(i)%is_open) call complete(self, ensemble, ensemble%chunks(i))
      end do
      if (self%scheduler%is_cancelled()) exit
    end do
  end subroutine compute_chunks

  !> Takes a chunk from the scheduler, if it has one.
  subroutine take_chunk(self, found)
    type(chunk_ensemble_t), intent(inout) :: self
    logical, intent(out) :: found
    integer :: count, first, i

    self%newest = 0
    found = .false.
    if (self%none_left) return
    associate (scheduler => self%block%scheduler)
      call omp_set_lock(scheduler%lock)
      call scheduler%next_chunk(first, count)
      call omp_unset_lock(scheduler%lock)
    end associate
    found = count > 0
    self%none_left = .not. found
    if (.not. found) return
    call offer_code(self%block)
    self%newest = findloc(self%chunks%is_open, .false., dim=1)
    associate (open => self%chunks(self%newest))
      call allocate_chunk(open%chunk, first, count, self%block%plan%design%varied, self%block%plan%results())
      open%chunk%results(:, :) = ieee_value(0.0_wp, ieee_quiet_nan)
      open%chunk%status(:) = not_computed
      do i = 1, count
        call self%block%plan%values(first + i - 1, open%chunk%parameters(:, i))
      end do
      open%is_open = .true.
      open%next_index = 1
      open%left = count
      open%own_blocks = 0
    end associate
  end subroutine take_chunk

  !> Integrates the variants of the newest chunk and of those that follow it. Those that were interrupted remain `not_computed`.
  subroutine integrate_chunks(self, ensemble)
    class(sweep_block_t), target, intent(inout) :: self
    type(chunk_ensemble_t), target, intent(inout) :: ensemble
    class(stepper_t), allocatable :: stepper
    type(solver_status_t) :: solver_status
    real(wp), allocatable :: y(:)
    real(wp) :: t
    logical :: found

    t = 0.0_wp
    if (size(self%plan%statistics) == 0) then
      associate (chunk => ensemble%chunks(ensemble%newest)%chunk)
        chunk%status(:) = status_done
        chunk%steps(:) = 0
      end associate
    else if (self%message == '') then
      allocate (stepper, source=self%stepper)
      call integrate_with(stepper, self%machines%formulation, self%settings, self%times, ensemble, self%observer, solver_status)
    else
      allocate (y(self%machines%formulation%states + self%machines%formulation%quadratures), source=0.0_wp)
      call ensemble%next(self%machines%formulation, 1, t, y, found)   ! refuses all, or notes that they need a block of their own
    end if
  end subroutine integrate_chunks

  !> Computes what a chunk lacks after the integration, and submits it, unless it was interrupted.
  subroutine complete(self, ensemble, open)
    class(sweep_block_t), intent(inout) :: self
    type(chunk_ensemble_t), intent(inout) :: ensemble
    type(open_chunk_t), intent(inout) :: open
    integer :: i
    logical :: is_complete

    do i = 1, open%chunk%count
      if (open%chunk%status(i) /= needs_own_block) cycle
      if (self%scheduler%is_cancelled()) exit
      call self%compute_in_own_block(open%chunk, i)
    end do
    is_complete = all(open%chunk%status >= 0)
    if (is_complete .and. size(self%plan%analyses) > 0) call analyse_chunk(self%plan, self%machines, self%scheduler, open%chunk, &
                                                                           is_complete)
    if (is_complete) call submit(ensemble, open)
    open%is_open = .false.
  end subroutine complete

  !> Hands a chunk that is complete to the scheduler.
  subroutine submit(self, open)
    type(chunk_ensemble_t), intent(inout) :: self
    type(open_chunk_t), intent(inout) :: open
    real(wp) :: now

    now = time_now()
    if (allocated(self%block%stepper)) then
      call self%block%code%count_work(self%block%machines%formulation, self%block%stepper%series_order, open%chunk%count, &
                                      sum(open%chunk%steps))
    end if
    associate (scheduler => self%block%scheduler)
      call omp_set_lock(scheduler%lock)
      call scheduler%submit(open%chunk, now - self%submitted)
      call omp_unset_lock(scheduler%lock)
    end associate
    self%submitted = now
    open%is_open = .false.
    call offer_code(self%block)
  end subroutine submit

  !> Lets the block have a program for its series, if one is due.
  subroutine offer_code(block)
    type(sweep_block_t), intent(inout) :: block

    if (.not. allocated(block%stepper)) return
    if (block%stepper%series_order > 0) call block%code%offer(block%machines%formulation)
  end subroutine offer_code

  !> Sets the next variant that fits the lanes in one of them.
  subroutine next(self, system, lane, t, y, found)
    class(chunk_ensemble_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: found
    character(len=:), allocatable :: reason
    integer :: i, status

    do
      found = self%newest > 0
      if (.not. (found .or. self%is_last)) call take_chunk(self, found)
      if (.not. found) return
      self%slot(lane) = self%newest
      associate (open => self%chunks(self%slot(lane)))
        i = open%next_index
        open%next_index = i + 1
        call self%block%plan%numbers%target_values(open%chunk%parameters(:, i), self%values)
        call self%block%machines%set_variant(self%values, lane, y, status, reason)
        if (status == variant_needs_own_block) open%own_blocks = open%own_blocks + 1
        if (i == open%chunk%count) then
          self%newest = 0
          self%is_last = self%is_last .or. open%own_blocks > 0   ! they are computed when the lanes are empty
        end if
        select case (status)
        case (variant_refused)
          call refuse(open%chunk, i, reason)
        case (variant_needs_own_block)
          open%chunk%status(i) = needs_own_block
        case default
          if (self%block%message == '') exit
          call refuse(open%chunk, i, self%block%message)
        end select
        call count_off(self, open)
      end associate
    end do
    self%index(lane) = i
  end subroutine next

  !> Takes note that a variant of a chunk needs no lane any more; of the last one, submits the chunk if it lacks nothing.
  subroutine count_off(self, open)
    type(chunk_ensemble_t), intent(inout) :: self
    type(open_chunk_t), intent(inout) :: open

    open%left = open%left - 1
    if (open%left == 0 .and. open%own_blocks == 0 .and. size(self%block%plan%analyses) == 0) call submit(self, open)
  end subroutine count_off

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

    associate (open => self%chunks(self%slot(lane)))
      call store_result(open%chunk, self%index(lane), lane, solver_status, self%block%machines%formulation, &
                        self%block%settings, self%block%plan%statistics, self%block%observer)
      if (open%chunk%status(self%index(lane)) /= not_computed) call count_off(self, open)   ! else it was interrupted
    end associate
  end subroutine finish

  !> Takes the results of the variant in a lane, or why it failed. A result that is not finite is a failure.
  subroutine store_result(chunk, index, lane, solver_status, formulation, settings, statistics, observer)
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: index, lane
    type(solver_status_t), intent(in) :: solver_status
    class(formulation_t), intent(in) :: formulation
    type(integration_settings_t), intent(in) :: settings
    type(statistic_t), intent(in) :: statistics(:)
    type(block_observer_t), intent(inout) :: observer
    integer :: i, wrong

    if (solver_status%code(lane) == integration_interrupted) return
    chunk%steps(index) = solver_status%accepted(lane)
    if (solver_status%code(lane) == integration_done) then
      chunk%status(index) = status_done
      if (.not. allocated(observer%values)) allocate (observer%values(size(statistics)))
      call observer%results(lane, observer%values)
      wrong = 0
      do i = size(statistics), 1, -1
        associate (result => chunk%results(statistics(i)%result, index))
          result = from_si(observer%values(i), statistics(i)%in_unit)
          if (.not. is_finite(result)) wrong = i
        end associate
      end do
      if (wrong == 0) return
      chunk%status(index) = status_failed
      chunk%reasons(index)%text = 'the result ' // statistics(wrong)%label // ' is not a finite number'
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

  !> Monotonic clock time [s].
  real(wp) function time_now() result(seconds)
    integer(int64) :: count, rate

    call system_clock(count, rate)
    seconds = real(count, wp) / real(rate, wp)
  end function time_now

end module nocdyn_sweep_block
