!> Integration of a block of lanes from the first to the last output time.
module nocdyn_integration
  use nocdyn_after_step, only: change_branches, process_steps
  use nocdyn_ensemble, only: ensemble_t, initial_states, initial_states_t
  use nocdyn_error_norm, only: measure_error, worst_measure
  use nocdyn_errors, only: error_t
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_differs, any_true
  use nocdyn_methods, only: select_method
  use nocdyn_observer, only: observer_t
  use nocdyn_plain_stepping, only: prepare_plain_steps, take_plain_steps
  use nocdyn_solver_status, only: allocate_solver_status, count_step, integration_done, integration_interrupted, &
    integration_not_finite, integration_rhs_failed, integration_running, integration_step_too_small, &
    integration_too_many_steps, solver_status_t
  use nocdyn_stage_sums, only: width
  use nocdyn_step_attempt, only: attempt_fatal, attempt_not_finite, attempt_ok
  use nocdyn_step_control, only: adapt_steps, shorten_step, smallest_step
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_time_stepping, only: advance_lanes, begin_attempts, fill_lanes, integrator_t, prepare_integrator, &
    project_states, release_lanes, shift_states
  implicit none (type, external)
  private

  public :: integrate, integrate_ensemble, integrate_with, begin_integration, try_steps, accept_steps

contains

  !> Solves y' = f(t, y) once in each lane, by the method in `settings`.
  subroutine integrate(system, settings, times, y, observer, solver_status, error)
    class(system_t), intent(inout) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)       !! output times [s], ascending, from the start to the end
    real(wp), contiguous, intent(inout) :: y(:, :)     !! [lanes, components]: initial states, on return the last states
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(out) :: solver_status            !! says which lanes failed
    type(error_t), allocatable, intent(out) :: error   !! allocated if a setting is refused
    type(initial_states_t) :: ensemble

    if (size(y, 1) /= system%lanes .or. size(y, 2) /= system%states + system%quadratures) then
      error stop 'nocdyn_integration: y must have the shape [lanes, states + quadratures]'
    end if
    ensemble = initial_states(y)
    call integrate_ensemble(system, settings, times, ensemble, observer, solver_status, error)
    y = ensemble%y
  end subroutine integrate

  !> Solves y' = f(t, y) for all variants of an ensemble; a lane that has ended takes the next variant.
  subroutine integrate_ensemble(system, settings, times, ensemble, observer, solver_status, error)
    class(system_t), intent(inout) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)       !! output times of every variant [s], ascending
    class(ensemble_t), intent(inout) :: ensemble             !! hands out the variants and takes their ends
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(out) :: solver_status            !! of the last variant in each lane
    type(error_t), allocatable, intent(out) :: error   !! allocated if a setting is refused
    class(stepper_t), allocatable :: stepper

    call check_settings(settings, error)
    if (allocated(error)) return
    call select_method(settings, system, stepper, error)
    if (allocated(error)) return
    call integrate_with(stepper, system, settings, times, ensemble, observer, solver_status)
  end subroutine integrate_ensemble

  !> Integrates with a given stepper and with settings that have been checked.
  subroutine integrate_with(stepper, system, settings, times, ensemble, observer, solver_status)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s], ascending, at least 2
    class(ensemble_t), intent(inout) :: ensemble
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(out) :: solver_status
    type(integrator_t) :: integrator
    logical :: are_taken, is_interrupted

    call begin_integration(integrator, stepper, system, settings, times, observer, solver_status)
    do
      call fill_lanes(integrator, stepper, system, ensemble, times, observer, solver_status)
      if (integrator%free == system%lanes) exit
      call take_plain_steps(integrator, stepper, system, times, observer, solver_status, are_taken)
      if (.not. are_taken) call attempt_steps(integrator, stepper, system, times, observer, solver_status)
      call interrupt_if_asked(integrator, observer, solver_status, is_interrupted)
      call release_lanes(integrator, system, ensemble, observer, solver_status)
      if (is_interrupted) exit
    end do
  end subroutine integrate_with

  !> Allocates all that an integration needs; the lanes are free.
  subroutine begin_integration(integrator, stepper, system, settings, times, observer, solver_status)
    type(integrator_t), intent(out) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s], ascending, at least 2
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(out) :: solver_status

    if (size(times) < 2) error stop 'nocdyn_integration: times needs a start and an end'
    if (.not. all(times(2:) > times(:size(times) - 1))) error stop 'nocdyn_integration: times must ascend'
    call system%prepare_integration(settings%rtol, settings%atol, times(size(times)))
    call allocate_solver_status(solver_status, system%lanes)
    if (stepper%series_order > 0) call system%prepare_series(stepper%series_order)
    call prepare_integrator(integrator, stepper, system, settings, times, observer)
    call prepare_plain_steps(integrator, stepper, system, times, observer)
  end subroutine begin_integration

  !> Attempts a step in all running lanes.
  subroutine attempt_steps(integrator, stepper, system, times, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status

    call try_steps(integrator, stepper, system, times, observer, solver_status)
    if (any_true(system%lanes, integrator%accepted)) then
      call accept_steps(integrator, stepper, system, times, observer, solver_status)
    end if
  end subroutine attempt_steps

  !> Computes a step of all running lanes, and passes what lies in those that are accepted to the observer. The lanes stay where
  !> they are.
  subroutine try_steps(integrator, stepper, system, times, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status

    call begin_attempts(integrator, stepper, system, solver_status)
    call stepper%take_step(system, integrator%attempt)
    call test_errors(integrator, stepper, system, observer, solver_status)
    if (.not. any_true(system%lanes, integrator%accepted)) return
    if (integrator%inspects .or. integrator%wants_steps) then
      call process_steps(integrator, system, times, observer, solver_status)
    end if
    if (integrator%wants_steps) then
      call stepper%pass_steps(integrator%steps, integrator%attempt, integrator%coefficients, observer)
    end if
  end subroutine try_steps

  !> Moves the lanes that have been accepted to the ends of their steps, where their branches change.
  subroutine accept_steps(integrator, stepper, system, times, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status

    call advance_lanes(integrator, times)
    if (system%projects) call project_states(integrator, system)
    if (integrator%may_shift) call shift_states(integrator, system, observer)
    call stepper%accept(integrator%accepted)
    if (integrator%has_switches) call change_branches(integrator, stepper, system, times, observer, solver_status)
  end subroutine accept_steps

  !> Ends all running lanes if the observer wants to stop at the time that the slowest lane has reached.
  subroutine interrupt_if_asked(integrator, observer, solver_status, is_interrupted)
    type(integrator_t), intent(in) :: integrator
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status
    logical, intent(out) :: is_interrupted
    real(wp) :: slowest
    integer :: lane

    is_interrupted = .false.
    slowest = huge(slowest)
    ! the loop without a condition vectorises: 17 ns for 32 lanes, with one 55 ns
    if (any_differs(size(solver_status%code), solver_status%code, integration_running)) then
      do lane = 1, size(solver_status%code)
        if (solver_status%code(lane) == integration_running) slowest = min(slowest, integrator%attempt%t(lane))
      end do
    else
      do lane = 1, size(solver_status%code)
        slowest = min(slowest, integrator%attempt%t(lane))
      end do
    end if
    if (slowest >= huge(slowest)) return
    is_interrupted = observer%wants_stop(slowest)
    if (.not. is_interrupted) return
    where (solver_status%code == integration_running) solver_status%code = integration_interrupted
  end subroutine interrupt_if_asked

  !> Accepts or rejects the last attempt of each lane, sets the next step sizes, and ends the lanes that cannot continue.
  subroutine test_errors(integrator, stepper, system, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    class(observer_t), intent(in) :: observer
    type(solver_status_t), intent(inout) :: solver_status
    integer :: failed, lane, wanted
    logical :: is_plain   ! whether the steps of all lanes have only to be counted

    call measure_error(integrator%control, system, integrator%attempt)
    integrator%inspects = integrator%has_events .or. integrator%has_extremes .or. integrator%has_switches
    is_plain = .false.
    if (integrator%attempt%lanes > 1) is_plain = is_plain_step(integrator, solver_status)
    if (is_plain) then
      integrator%accepted(:) = .true.
      integrator%rejected(:) = .false.
      integrator%inspected(:) = .false.
      integrator%wanted(:) = integrator%wants_dense_steps
      wanted = merge(integrator%attempt%lanes, 0, integrator%wants_dense_steps)
    else
      ! finds the lanes whose errors are within the tolerances, and among them the lanes whose dense output is needed
      wanted = 0
      do lane = 1, integrator%attempt%lanes
        integrator%accepted(lane) = integrator%attempt%active(lane) .and. integrator%control%mean_square(lane) <= 1
        integrator%inspected(lane) = integrator%accepted(lane) &
                                     .and. (integrator%inspects .or. integrator%next_time(lane) < integrator%t_new(lane))
        integrator%wanted(lane) = integrator%inspected(lane) .or. (integrator%accepted(lane) .and. integrator%wants_dense_steps)
        if (integrator%wanted(lane)) wanted = wanted + 1
      end do
    end if
    if (wanted > 0) then
      ! the columns that the observer reads, or all if a lane is inspected
      integrator%attempt%first_dense = 1
      integrator%attempt%last_dense = size(integrator%attempt%y, 2)
      if (modulo(integrator%attempt%lanes, width) == 0 .and. .not. any(integrator%inspected)) then
        integrator%attempt%first_dense = observer%first_read
        integrator%attempt%last_dense = min(observer%last_read, integrator%attempt%last_dense)
      end if
      call stepper%interpolate(system, integrator%attempt, integrator%wanted, integrator%coefficients)
      is_plain = is_plain .and. all_true(integrator%attempt%lanes, integrator%attempt%active)
    end if
    if (is_plain) then
      failed = 0
      solver_status%accepted(:) = solver_status%accepted + 1
      solver_status%code(:) = merge(integration_done, solver_status%code, integrator%control%ends_at_t_end)
      integrator%inspects = count(integrator%next_time <= integrator%t_new) > 0   ! `any` does not vectorise
    else
      call finish_steps(integrator, solver_status, failed)
    end if
    call adapt_steps(integrator%control, integrator%attempt%lanes, integrator%accepted, integrator%rejected, &
                     integrator%attempt%error_order, integrator%attempt%max_growth, solver_status%h)
    if (failed == 0) return
    do lane = 1, integrator%attempt%lanes
      if (integrator%running(lane) .and. .not. integrator%accepted(lane)) call handle_rejection(integrator, lane, solver_status)
    end do
  end subroutine test_errors

  !> Whether all lanes have taken explicit steps within the tolerances, without an output time before their ends: then no lane
  !> needs a decision of its own. False if the lanes are not whole vectors.
  pure logical function is_plain_step(integrator, solver_status)
    type(integrator_t), intent(in) :: integrator
    type(solver_status_t), intent(in) :: solver_status
    real(wp) :: most(width)
    integer :: i

    is_plain_step = .false.
    associate (attempt => integrator%attempt)
      if (modulo(attempt%lanes, width) /= 0 .or. integrator%inspects) return
      ! the largest excess over the lanes: of the squared error norm over 1, or of the time over the next output time
      most = -1.0_wp
      do i = 1, attempt%lanes, width
        most = max(most, max(integrator%control%mean_square(i:i + width - 1) - 1.0_wp, &
                             integrator%t_new(i:i + width - 1) - integrator%next_time(i:i + width - 1)))
      end do
      if (max(max(most(1), most(2)), max(most(3), most(4))) > 0) return
      if (maxval(solver_status%steps) >= integrator%max_steps) return
      if (any_true(attempt%lanes, attempt%implicit) .or. any_true(attempt%lanes, solver_status%implicit)) return
      is_plain_step = all_true(attempt%lanes, attempt%active)
    end associate
  end function is_plain_step

  !> Counts the accepted steps, and ends the lanes that have reached the final time or the largest number of steps.
  pure subroutine finish_steps(integrator, solver_status, failed)
    type(integrator_t), intent(inout) :: integrator
    type(solver_status_t), intent(inout) :: solver_status
    integer, intent(out) :: failed   !! number of attempts that were not accepted
    logical :: is_fine
    integer :: lane

    failed = 0
    do lane = 1, integrator%attempt%lanes
      integrator%rejected(lane) = .false.
      if (.not. integrator%running(lane)) cycle
      if (solver_status%steps(lane) >= integrator%max_steps) solver_status%code(lane) = integration_too_many_steps
      is_fine = integrator%attempt%step_status(lane) == attempt_ok
      integrator%rejected(lane) = is_fine .and. .not. integrator%accepted(lane)
      integrator%accepted(lane) = is_fine .and. integrator%accepted(lane)
      if (integrator%accepted(lane)) then
        call count_step(solver_status, lane, integrator%attempt%t(lane), integrator%attempt%implicit(lane))
        if (integrator%control%ends_at_t_end(lane)) solver_status%code(lane) = integration_done
        if (integrator%next_time(lane) <= integrator%t_new(lane)) integrator%inspects = .true.
      else
        failed = failed + 1
      end if
    end do
  end subroutine finish_steps

  !> A lane takes a shorter step, or fails if no shorter step will help or none is possible.
  subroutine handle_rejection(integrator, lane, solver_status)
    type(integrator_t), intent(inout) :: integrator
    integer, intent(in) :: lane
    type(solver_status_t), intent(inout) :: solver_status

    solver_status%rejected(lane) = solver_status%rejected(lane) + 1
    associate (attempt => integrator%attempt)
      if (attempt%step_status(lane) /= attempt_ok) call shorten_step(integrator%control, lane, solver_status%h(lane))
      if (attempt%step_status(lane) == attempt_fatal) then
        solver_status%code(lane) = integration_rhs_failed
      else if (solver_status%h(lane) <= smallest_step(attempt%t(lane))) then
        solver_status%code(lane) = merge(integration_not_finite, integration_step_too_small, &
                                         attempt%step_status(lane) == attempt_not_finite)
        solver_status%component(lane) = attempt%component(lane)
        if (attempt%step_status(lane) == attempt_ok) then
          solver_status%component(lane) = 0
          solver_status%measure(lane) = worst_measure(integrator%control, attempt, lane)
        end if
      end if
    end associate
  end subroutine handle_rejection

end module nocdyn_integration
