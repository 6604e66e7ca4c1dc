!> One thread's share of a sweep: a block of lanes that works through consecutive variants.
module nocdyn_sweep_block
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_dispatcher, only: dispatcher_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration, only: integrate_with
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_methods, only: select_method
  use nocdyn_outcome, only: failure_sentence, integration_done, integration_interrupted, outcome_t
  use nocdyn_queue, only: one_each, one_each_t, queue_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_statistics_observer, only: new_statistics_observer, statistics_observer_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_sweep_chunk, only: allocate_chunk, chunk_t, status_done, status_failed, status_refused
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_sweep_records, only: fit_statistics
  use nocdyn_sweep_setup, only: sweep_setup_t, take_settings
  use nocdyn_system, only: system_t
  use nocdyn_variant_machines, only: new_variant_machines, variant_alone, variant_machines_t, variant_refused
  implicit none (type, external)
  private

  public :: new_sweep_block

  integer, parameter :: rounds = 16    ! steps between two looks at the rest of the world
  integer, parameter :: not_computed = -1

  !> The statistics of the lanes; between the steps it looks after the dispatcher.
  type, extends(statistics_observer_t) :: block_observer_t
    class(dispatcher_t), pointer :: dispatcher => null()
    integer :: steps = 0
  contains
    procedure :: stops
  end type block_observer_t

  !> The variants of a chunk, for the lanes.
  type, extends(queue_t) :: chunk_queue_t
    type(sweep_block_t), pointer :: block => null()
    type(chunk_t), pointer :: chunk => null()
    integer :: next_place = 1               !! in the chunk
    integer, allocatable :: place(:)        !! of the variant in each lane
    logical, allocatable :: is_alone(:)     !! variants left over for a formulation of their own
  contains
    procedure :: next
    procedure :: finish
  end type chunk_queue_t

  !> gfortran 12 keeps the lengths of texts that functions return in static memory, of all threads: texts are made by one thread
  !> at a time, in the critical section `texts`.
  type, public :: sweep_block_t
    type(sweep_plan_t), pointer :: plan => null()
    class(dispatcher_t), pointer :: dispatcher => null()
    type(variant_machines_t) :: machines
    type(block_observer_t) :: observer
    class(stepper_t), allocatable :: stepper   !! as it is before an integration
    type(integration_settings_t) :: settings
    real(wp) :: times(2) = 0.0_wp              !! start and end [s]
    character(len=:), allocatable, private :: complaint   !! why the variants that fit the lanes are refused; '': they are not
  contains
    procedure :: compute
    procedure :: release
    procedure, private :: compute_alone
  end type sweep_block_t

contains

  !> A block of lanes of the base machine, which stays where it is. To be given up by `release`.
  subroutine new_sweep_block(plan, setup, dispatcher, block, error)
    type(sweep_plan_t), target, intent(in) :: plan
    type(sweep_setup_t), intent(in) :: setup
    class(dispatcher_t), target, intent(inout) :: dispatcher
    type(sweep_block_t), target, intent(out) :: block
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: typical(plan%design%varied)

    block%plan => plan
    block%dispatcher => dispatcher
    call plan%values(1, typical)
    call new_variant_machines(plan%input, plan%targets, setup%lanes, setup%is_audited, block%machines, error, typical)
    if (allocated(error)) return
    !$omp critical (texts)
    call take_settings(plan%input, block%machines%formulation, block%settings, block%times, error)
    if (.not. allocated(error)) call select_method(block%settings, block%stepper, error)
    if (.not. allocated(error)) then
      call new_block_observer(block%machines%formulation, plan, block%times, dispatcher, block%observer, error)
    end if
    block%complaint = ''
    if (allocated(error)) call move_alloc(error%message, block%complaint)
    !$omp end critical (texts)
    if (allocated(error)) deallocate (error)
  end subroutine new_sweep_block

  subroutine release(self)
    class(sweep_block_t), intent(inout) :: self

    call self%machines%release()
  end subroutine release

  !> The statistics of variants that run through these times; if some begin outside of them, or have nothing to look at, that is
  !> an error.
  subroutine new_block_observer(formulation, plan, times, dispatcher, observer, error)
    class(formulation_t), target, intent(inout) :: formulation   !! stays where it is, as the observer does
    type(sweep_plan_t), intent(in) :: plan
    real(wp), intent(in) :: times(2)
    class(dispatcher_t), target, intent(inout) :: dispatcher
    type(block_observer_t), intent(out) :: observer
    type(error_t), allocatable, intent(out) :: error
    type(statistic_t), allocatable :: statistics(:)
    character(len=:), allocatable :: complaint

    call fit_statistics(plan%statistics, times(1), times(2), statistics, complaint)
    observer%statistics_observer_t = new_statistics_observer(formulation, statistics, times(1), times(2))
    observer%dispatcher => dispatcher
    if (complaint == '' .and. observer%missing /= '') then
      complaint = observer%missing // ' is recorded, but this machine has no such column'
    end if
    if (complaint /= '') call raise(error, exit_input, complaint)
  end subroutine new_block_observer

  !> The variants `first`, `first` + 1, ... Those that are interrupted do not count: `is_complete` is false then.
  subroutine compute(self, first, count, chunk, is_complete)
    class(sweep_block_t), target, intent(inout) :: self
    integer, intent(in) :: first, count
    type(chunk_t), target, intent(out) :: chunk
    logical, intent(out) :: is_complete
    type(chunk_queue_t) :: queue
    class(stepper_t), allocatable :: stepper
    type(outcome_t) :: outcome
    integer :: i

    call allocate_chunk(chunk, first, count, self%plan%design%varied, size(self%plan%statistics))
    chunk%results(:, :) = ieee_value(0.0_wp, ieee_quiet_nan)
    chunk%status(:) = not_computed
    queue%block => self
    queue%chunk => chunk
    allocate (queue%place(self%machines%formulation%lanes), source=0)
    allocate (queue%is_alone(count), source=.false.)
    if (self%complaint == '') then
      allocate (stepper, source=self%stepper)
      call integrate_with(stepper, self%machines%formulation, self%settings, self%times, queue, self%observer, outcome)
    else
      call refuse_all(self%machines%formulation, queue)
    end if
    do i = 1, count
      if (.not. queue%is_alone(i)) cycle
      if (self%dispatcher%is_over()) exit
      call self%compute_alone(chunk, i)
    end do
    is_complete = all(chunk%status /= not_computed)
  end subroutine compute

  !> Goes through a queue whose variants are refused or left over.
  subroutine refuse_all(formulation, queue)
    class(formulation_t), intent(inout) :: formulation
    type(chunk_queue_t), intent(inout) :: queue
    real(wp), allocatable :: y(:)
    real(wp) :: t
    logical :: found

    allocate (y(formulation%states + formulation%quadratures), source=0.0_wp)
    t = 0.0_wp
    call queue%next(formulation, 1, t, y, found)
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
    integer :: i, verdict

    do
      i = self%next_place
      found = i <= self%chunk%count
      if (.not. found) return
      self%next_place = i + 1
      call self%block%plan%values(self%chunk%first + i - 1, self%chunk%parameters(:, i))
      call self%block%machines%put(self%chunk%parameters(:, i), lane, y, verdict, reason)
      select case (verdict)
      case (variant_refused)
        call refuse(self%chunk, i, reason)
      case (variant_alone)
        self%is_alone(i) = .true.
      case default
        if (self%block%complaint == '') exit
        call refuse(self%chunk, i, self%block%complaint)
      end select
    end do
    self%place(lane) = i
    call self%block%observer%begin(lane, y)
  end subroutine next

  subroutine refuse(chunk, place, reason)
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: place
    character(len=*), intent(in) :: reason

    chunk%status(place) = status_refused
    chunk%reasons(place)%text = reason
  end subroutine refuse

  subroutine finish(self, lane, y, outcome)
    class(chunk_queue_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(outcome_t), intent(in) :: outcome

    call conclude(self%chunk, self%place(lane), lane, outcome, self%block%machines%formulation, self%block%settings, &
                  self%block%observer)
  end subroutine finish

  !> What has become of the variant in a lane.
  subroutine conclude(chunk, place, lane, outcome, formulation, settings, observer)
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: place, lane
    type(outcome_t), intent(in) :: outcome
    class(formulation_t), intent(in) :: formulation
    type(integration_settings_t), intent(in) :: settings
    class(statistics_observer_t), intent(inout) :: observer

    if (outcome%status(lane) == integration_interrupted) return
    chunk%steps(place) = outcome%accepted(lane)
    if (outcome%status(lane) == integration_done) then
      chunk%status(place) = status_done
      call observer%results(lane, chunk%results(:, place))
    else
      chunk%status(place) = status_failed
      !$omp critical (texts)
      chunk%reasons(place)%text = failure_sentence(outcome, lane, formulation, settings%rtol, settings%atol)
      !$omp end critical (texts)
    end if
  end subroutine conclude

  !> A variant that no lane of the block can hold: a formulation of one lane, made for it.
  subroutine compute_alone(self, chunk, place)
    class(sweep_block_t), intent(inout) :: self
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: place
    class(formulation_t), allocatable, target :: formulation
    type(block_observer_t), target :: observer
    class(stepper_t), allocatable :: stepper
    type(integration_settings_t) :: settings
    type(one_each_t) :: queue
    type(outcome_t) :: outcome
    type(error_t), allocatable :: error
    real(wp), allocatable :: start(:)
    real(wp) :: times(2)

    call self%machines%alone_formulation(chunk%parameters(:, place), formulation)
    !$omp critical (texts)
    call take_settings(self%machines%input, formulation, settings, times, error)
    if (.not. allocated(error)) call check_settings(settings, error)
    if (.not. allocated(error)) call select_method(settings, stepper, error)
    if (.not. allocated(error)) call new_block_observer(formulation, self%plan, times, self%dispatcher, observer, error)
    if (allocated(error)) call refuse(chunk, place, error%message)
    !$omp end critical (texts)
    if (allocated(error)) return
    queue = one_each(formulation%start())
    allocate (start, source=queue%y(1, :))
    call observer%begin(1, start)
    call integrate_with(stepper, formulation, settings, times, queue, observer, outcome)
    call conclude(chunk, place, 1, outcome, formulation, settings, observer)
  end subroutine compute_alone

  !> Looks after the dispatcher now and then, unless another thread does.
  function stops(self, t)
    class(block_observer_t), intent(inout) :: self
    real(wp), intent(in) :: t
    logical :: stops

    stops = .false.
    self%steps = mod(self%steps + 1, rounds)
    if (self%steps /= 0) return
    if (self%dispatcher%enters()) then
      call self%dispatcher%attend()
      call self%dispatcher%leave()
    end if
    stops = self%dispatcher%is_over()
  end function stops

end module nocdyn_sweep_block
