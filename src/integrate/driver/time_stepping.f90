!> The parts of the time-stepping loop of a block: all lanes take a step together, each with its own time and step size.
module nocdyn_time_stepping
  use, intrinsic :: iso_c_binding, only: c_int
  use nocdyn_dense_output, only: allocate_dense_output, dense_output_t
  use nocdyn_ensemble, only: ensemble_t
  use nocdyn_error_norm, only: forget_sizes, measure_start
  use nocdyn_events, only: allocate_events, events_t
  use nocdyn_extremes, only: allocate_extremes, extremes_t, observe_left, start_extremes
  use nocdyn_first_step, only: guess_first_steps
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: any_differs, any_true
  use nocdyn_observer, only: observer_t, step_block_t
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_root_functions, only: start_root_functions
  use nocdyn_solver_status, only: integration_not_finite, integration_rhs_failed, integration_running, reset_solver_status, &
    solver_status_t
  use nocdyn_step_attempt, only: advance, allocate_step_attempt, attempt_not_finite, begin_attempt, evaluate_start, step_attempt_t
  use nocdyn_step_control, only: propose_steps, reset_control, step_control, step_control_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_switching, only: allocate_switching, start_switching, switching_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: prepare_integrator, fill_lanes, start_lanes, evaluate_starts, begin_attempts, advance_lanes, project_states, &
    shift_states, release_lanes

  type, public :: integrator_t
    type(step_attempt_t) :: attempt
    type(step_control_t) :: control
    type(dense_output_t) :: dense                    !! of the lane that is inspected
    type(events_t) :: events
    type(extremes_t) :: extremes
    type(switching_t) :: switching
    real(wp) :: first_step                           !! [s]; it is chosen automatically if this is 0
    integer :: max_steps
    logical :: has_events = .false.
    logical :: has_extremes = .false.
    logical :: has_switches = .false.
    logical :: has_jumps = .false.                   !! whether what holds may change at a crossing, and speeds jump
    logical :: may_shift = .false.                   !! whether the system may shift states
    logical :: wants_steps = .false.                 !! whether the observer receives the dense output of all steps
    logical :: wants_dense_steps = .false.           !! whether that is the result of `interpolate`
    logical :: may_be_plain = .false.                !! whether the system may take plain steps
    logical :: is_exhausted = .false.                !! the ensemble has no variant left
    integer :: free = 0                              !! number of lanes that hold no variant
    logical :: inspects = .false.                    !! whether the accepted steps are inspected lane by lane
    logical, allocatable :: occupied(:)              !! lanes that hold a variant
    logical, allocatable :: running(:)               !! lanes that took part in the last attempt
    logical, allocatable :: rejected(:)              !! lanes whose last attempt was complete, but with too large an error
    logical, allocatable :: starting(:)              !! lanes that start a variant, or restart on a new branch
    logical, allocatable :: unevaluated(:)           !! lanes that have started without an evaluation
    logical :: evaluates_starts = .true.             !! whether there are none, and starts are measured
    logical, allocatable :: accepted(:)              !! lanes whose last attempt was accepted
    logical, allocatable :: wanted(:)                !! lanes whose dense output of the last step is needed
    logical, allocatable :: inspected(:)             !! lanes whose dense output is evaluated lane by lane
    logical, allocatable :: far(:)                   !! lanes whose states are to be shifted
    type(step_block_t) :: steps                      !! the last steps, for the observer
    real(wp), allocatable :: t_new(:)                !! end of the last attempt of each lane [s]
    real(wp), allocatable :: next_time(:)            !! next output time of each lane [s], huge if none is left
    integer, allocatable :: next(:)                  !! index of the next output time of each lane
    real(wp), allocatable :: sample(:)               !! state of one lane, [components]
    type(plain_steps_t) :: plain
    integer(c_int), allocatable :: is_running(:), outcome(:), taken(:)   !! of plain steps, [lanes]
    real(wp), allocatable :: coefficients(:, :, :)   !! of the dense output of the last step, [lanes, padded columns, degree]
  end type integrator_t

contains

  !> Allocates all memory of the time stepping; the loop itself allocates nothing.
  subroutine prepare_integrator(integrator, stepper, system, settings, times, observer)
    type(integrator_t), intent(out) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(in) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: times(:)   !! output times [s], ascending
    class(observer_t), intent(in) :: observer

    call stepper%prepare(system)
    call allocate_step_attempt(integrator%attempt, system)
    integrator%attempt%t(:) = times(1)
    integrator%attempt%error_order(:) = stepper%error_order
    integrator%attempt%max_growth(:) = stepper%max_growth
    integrator%attempt%degree(:) = stepper%degree
    integrator%attempt%has_low_order_estimate = stepper%has_low_order_error
    integrator%control = step_control(system%lanes, system%measures, settings%rtol, settings%atol, times(size(times)), &
                                      settings%longest_step)
    integrator%control%is_given(:) = .not. stepper%estimates_errors
    integrator%first_step = settings%first_step
    integrator%max_steps = settings%max_steps
    associate (lanes => system%lanes)
      integrator%free = lanes
      allocate (integrator%occupied(lanes), integrator%running(lanes), integrator%starting(lanes), integrator%accepted(lanes), &
                integrator%rejected(lanes), integrator%unevaluated(lanes), integrator%wanted(lanes), &
                integrator%inspected(lanes), integrator%far(lanes), integrator%steps%taken(lanes), &
                integrator%steps%crosses(lanes), source=.false.)
      allocate (integrator%t_new(lanes), integrator%next_time(lanes), source=times(1))
      allocate (integrator%steps%t(lanes), integrator%steps%h(lanes), integrator%steps%scale(lanes), &
                integrator%steps%theta_end(lanes), integrator%steps%t_new(lanes), source=0.0_wp)
      allocate (integrator%steps%degree(lanes), source=1)
      allocate (integrator%next(lanes), source=2)
      allocate (integrator%sample(integrator%attempt%components), source=0.0_wp)
      allocate (integrator%coefficients(lanes, size(integrator%attempt%y, 2), stepper%degree), source=0.0_wp)
    end associate
    call allocate_dense_output(integrator%dense, integrator%attempt%components, stepper%degree)
    integrator%wants_steps = observer%wants_steps
    integrator%wants_dense_steps = integrator%wants_steps .and. .not. stepper%passes_series
    integrator%may_shift = system%may_shift .and. observer%takes_shifts
    integrator%has_switches = system%switches > 0
    integrator%has_jumps = system%follows_waves
    ! where one of many lanes starts, all would be evaluated
    integrator%evaluates_starts = stepper%reads_slope .or. system%lanes == 1 .or. system%follows_waves
    if (integrator%has_switches) then
      call allocate_switching(integrator%switching, system, stepper%degree, integrator%attempt, times(size(times)) - times(1))
    end if
    integrator%has_extremes = observer%tracked > 0
    if (integrator%has_extremes) then
      call allocate_extremes(integrator%extremes, observer, stepper%degrees, integrator%attempt)
    end if
    if (.not. allocated(observer%directions)) return
    integrator%has_events = size(observer%directions) > 0
    if (integrator%has_events) call allocate_events(integrator%events, observer, stepper%degree, integrator%attempt)
  end subroutine prepare_integrator

  !> Fills the free lanes with the next variants of the ensemble and starts them.
  subroutine fill_lanes(integrator, stepper, system, ensemble, times, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    class(ensemble_t), intent(inout) :: ensemble
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status
    real(wp) :: t
    integer :: lane

    if (integrator%is_exhausted .or. integrator%free == 0) return
    do lane = 1, size(integrator%occupied)
      integrator%starting(lane) = .false.
      if (integrator%occupied(lane) .or. integrator%is_exhausted) cycle
      t = times(1)
      call ensemble%next(system, lane, t, integrator%sample, integrator%starting(lane))
      integrator%occupied(lane) = integrator%starting(lane)
      integrator%is_exhausted = .not. integrator%starting(lane)
      if (.not. integrator%starting(lane)) cycle
      integrator%free = integrator%free - 1
      ! sets the start of a lane: the state in `sample` at the time t, all counts zero
      associate (attempt => integrator%attempt)
        attempt%t(lane) = t
        attempt%y(lane, :attempt%components) = integrator%sample
        attempt%evaluations(lane) = 0
        attempt%jacobians(lane) = 0
        attempt%factorisations(lane) = 0
        attempt%implicit(lane) = .false.
      end associate
      if (.not. (t >= times(1) .and. t < times(size(times)))) then
        error stop 'nocdyn_time_stepping: a variant must start within the times'
      end if
      integrator%next(lane) = 2
      do while (times(integrator%next(lane)) <= t)
        integrator%next(lane) = integrator%next(lane) + 1
      end do
      integrator%next_time(lane) = times(integrator%next(lane))
      call reset_control(integrator%control, lane)
      call reset_solver_status(solver_status, lane)
    end do
    if (any(integrator%starting)) call start_lanes(integrator, stepper, system, times, observer, solver_status)
  end subroutine fill_lanes

  !> Starts the lanes in `starting`: lets the system choose their branches, tells the observer, evaluates the slope, passes the
  !> start to the observer if it is an output time, and chooses the first step.
  subroutine start_lanes(integrator, stepper, system, times, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status
    integer :: lane

    associate (attempt => integrator%attempt)
      do lane = 1, attempt%lanes
        if (.not. integrator%starting(lane)) cycle
        integrator%sample(:) = attempt%y(lane, :attempt%components)
        call system%start_lane(lane, attempt%t(lane), integrator%sample)
        call observer%on_start(lane, attempt%t(lane), integrator%sample)
        if (integrator%has_switches) call start_switching(integrator%switching, system, attempt, lane, solver_status)
        if (.not. integrator%has_jumps) cycle
        integrator%sample(:) = attempt%y(lane, :attempt%components)
        call observer%on_jump(lane, attempt%t(lane), integrator%sample)
      end do
      call evaluate_starts(integrator, system, solver_status)
      if (integrator%evaluates_starts) then
        call measure_start(integrator%control, system, attempt, integrator%starting)
      else
        call forget_sizes(integrator%control, integrator%starting)
      end if
      call stepper%start(attempt, integrator%starting)
      do lane = 1, attempt%lanes
        if (.not. integrator%starting(lane)) cycle
        integrator%sample(:) = attempt%y(lane, :attempt%components)
        if (times(integrator%next(lane) - 1) >= attempt%t(lane)) call observer%on_output(lane, attempt%t(lane), integrator%sample)
        integrator%control%h(lane) = integrator%first_step
        if (integrator%has_extremes) call start_extremes(integrator%extremes, lane)
        if (.not. attempt%active(lane)) cycle
        if (integrator%has_events) call start_root_functions(integrator%events%roots, system, observer, attempt, lane)
      end do
      if (integrator%first_step > 0 .or. .not. stepper%estimates_errors) return
      call guess_first_steps(integrator%control, stepper%order, system, attempt)
    end associate
  end subroutine start_lanes

  !> Evaluates the slope at the states of the lanes in `starting`, and ends those where that fails. If nobody reads the slope,
  !> the lanes are only noted.
  subroutine evaluate_starts(integrator, system, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    type(solver_status_t), intent(inout) :: solver_status

    integrator%attempt%active(:) = integrator%starting
    if (integrator%evaluates_starts) then
      call end_failed_starts(integrator, system, solver_status)
    else
      integrator%unevaluated(:) = integrator%unevaluated .or. integrator%starting
    end if
  end subroutine evaluate_starts

  !> Ends the lanes in `starting` where the slope cannot be evaluated.
  subroutine end_failed_starts(integrator, system, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    type(solver_status_t), intent(inout) :: solver_status
    integer :: lane

    associate (attempt => integrator%attempt)
      call evaluate_start(attempt, system, integrator%starting, attempt%slope)
      do lane = 1, attempt%lanes
        if (.not. integrator%starting(lane) .or. attempt%active(lane)) cycle
        if (solver_status%code(lane) /= integration_running) cycle
        solver_status%code(lane) = merge(integration_not_finite, integration_rhs_failed, &
                                         attempt%step_status(lane) == attempt_not_finite)
        solver_status%component(lane) = attempt%component(lane)
      end do
    end associate
  end subroutine end_failed_starts

  !> Evaluates the slope in the lanes that have started without it and for which no step has been chosen, as their series failed.
  !> The others count an evaluation, as they would alone.
  subroutine evaluate_later(integrator, system, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    type(solver_status_t), intent(inout) :: solver_status

    associate (attempt => integrator%attempt)
      integrator%starting(:) = integrator%unevaluated .and. integrator%running .and. .not. integrator%control%h > 0
      attempt%evaluations(:) = attempt%evaluations + merge(1, 0, integrator%unevaluated .and. .not. integrator%starting)
      integrator%unevaluated(:) = .false.
      if (.not. any_true(attempt%lanes, integrator%starting)) return
      attempt%active(:) = integrator%starting
      call end_failed_starts(integrator, system, solver_status)
      integrator%running(:) = integrator%running .and. solver_status%code == integration_running
      attempt%active(:) = integrator%running
    end associate
  end subroutine evaluate_later

  !> Begins the next attempt of the lanes that are still running.
  subroutine begin_attempts(integrator, stepper, system, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    type(solver_status_t), intent(inout) :: solver_status
    integer :: lane

    associate (attempt => integrator%attempt)
      integrator%running(:) = integrator%occupied .and. solver_status%code == integration_running
      attempt%active(:) = integrator%running
      if (system%limits_steps) then
        integrator%control%longest(:) = integrator%control%longest_step
        call system%limit_steps(size(attempt%y, 2), attempt%y, integrator%control%longest)
      end if
      if (stepper%chooses_steps) then
        call stepper%choose_steps(system, attempt, integrator%control)
        if (.not. integrator%evaluates_starts) then
          if (any_true(attempt%lanes, integrator%unevaluated)) call evaluate_later(integrator, system, solver_status)
        end if
        if (integrator%first_step > 0) then
          where (solver_status%steps == 0) integrator%control%h = min(integrator%control%h, integrator%first_step)
        end if
      end if
      call propose_steps(integrator%control, attempt%lanes, attempt%t, attempt%h, integrator%t_new)
      ! counts the attempts of the running lanes and stores their sizes; the other lanes get the step size 0
      do lane = 1, attempt%lanes
        solver_status%h(lane) = merge(attempt%h(lane), solver_status%h(lane), integrator%running(lane))
        attempt%h(lane) = merge(attempt%h(lane), 0.0_wp, integrator%running(lane))
        solver_status%steps(lane) = solver_status%steps(lane) + merge(1, 0, integrator%running(lane))
      end do
      call begin_attempt(attempt)
    end associate
  end subroutine begin_attempts

  !> Moves the accepted lanes to the ends of their steps.
  subroutine advance_lanes(integrator, times)
    type(integrator_t), intent(inout) :: integrator
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    integer :: lane

    associate (attempt => integrator%attempt, accepted => integrator%accepted)
      attempt%t(:) = merge(integrator%t_new, attempt%t, accepted)
      call advance(accepted, attempt%y, attempt%y_new)
      if (size(integrator%control%size) > 0) call advance(accepted, integrator%control%size, integrator%control%new_size)
      if (.not. integrator%inspects) return
      do lane = 1, attempt%lanes
        integrator%next_time(lane) = huge(integrator%next_time)
        if (integrator%next(lane) <= size(times)) integrator%next_time(lane) = times(integrator%next(lane))
      end do
    end associate
  end subroutine advance_lanes

  !> Lets the system put the states of the lanes that have moved back on its invariants.
  subroutine project_states(integrator, system)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    integer :: lane

    associate (attempt => integrator%attempt)
      do lane = 1, attempt%lanes
        if (.not. integrator%accepted(lane)) cycle
        integrator%sample(:) = attempt%y(lane, :attempt%components)
        call system%project_state(lane, attempt%t(lane), integrator%sample)
        attempt%y(lane, :attempt%components) = integrator%sample
      end do
    end associate
  end subroutine project_states

  !> Lets the system shift the states of the lanes that have moved, if any lane has gone far.
  subroutine shift_states(integrator, system, observer)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    integer :: lane

    associate (attempt => integrator%attempt)
      call system%find_far(size(attempt%y, 2), attempt%y, integrator%far)
      if (.not. any_true(attempt%lanes, integrator%far)) return
      do lane = 1, attempt%lanes
        if (.not. (integrator%far(lane) .and. integrator%accepted(lane))) cycle
        if (integrator%has_extremes) call observe_left(integrator%extremes, observer)
        call system%shift_state(lane, attempt%y, integrator%sample)
        call observer%on_shift(lane, integrator%sample)
      end do
    end associate
  end subroutine shift_states

  !> Passes the lanes that have ended to the ensemble and frees them.
  subroutine release_lanes(integrator, system, ensemble, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    class(ensemble_t), intent(inout) :: ensemble
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status
    integer :: lane

    if (.not. any_differs(size(solver_status%code), solver_status%code, integration_running)) return
    do lane = 1, size(integrator%occupied)
      if (.not. integrator%occupied(lane) .or. solver_status%code(lane) == integration_running) cycle
      integrator%occupied(lane) = .false.
      integrator%free = integrator%free + 1
      solver_status%t(lane) = integrator%attempt%t(lane)
      solver_status%evaluations(lane) = integrator%attempt%evaluations(lane)
      solver_status%jacobians(lane) = integrator%attempt%jacobians(lane)
      solver_status%factorisations(lane) = integrator%attempt%factorisations(lane)
      if (integrator%has_extremes .and. .not. observer%takes_pieces) then
        if (integrator%extremes%have_begun(lane)) call observer%on_extremes(lane, integrator%extremes%ranges(lane))
      end if
      integrator%sample(:) = integrator%attempt%y(lane, :integrator%attempt%components)
      if (integrator%may_shift) call system%restore_state(lane, integrator%sample)
      call ensemble%finish(lane, integrator%sample, solver_status)
    end do
  end subroutine release_lanes

end module nocdyn_time_stepping
