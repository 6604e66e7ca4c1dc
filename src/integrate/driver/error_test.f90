!> The error test: accepts or rejects the step attempts of the lanes, and ends lanes that are done or have failed.
module nocdyn_error_test
  use nocdyn_error_norm, only: measure_error, worst_measure
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_observer, only: observer_t
  use nocdyn_solver_status, only: count_step, integration_done, integration_not_finite, integration_rhs_failed, &
    integration_step_too_small, integration_too_many_steps, solver_status_t
  use nocdyn_stage_sums, only: width
  use nocdyn_step_attempt, only: attempt_fatal, attempt_not_finite, attempt_ok
  use nocdyn_step_control, only: adapt_steps, shorten_step, smallest_step
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_time_stepping, only: integrator_t
  implicit none (type, external)
  private

  public :: test_errors

contains

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
      ! accepts the steps of all lanes
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
      call choose_columns(integrator, observer)
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
    real(wp) :: most(width), excess
    integer :: i

    is_plain_step = .false.
    associate (attempt => integrator%attempt)
      if (modulo(attempt%lanes, width) /= 0 .or. integrator%inspects) return
      ! the largest excess over the lanes: of the squared error norm over 1, or of the time over the next output time
      most = -1.0_wp
      do i = 1, attempt%lanes, width
        most = max(most, max(integrator%control%mean_square(i:i + width - 1) - 1.0_wp, integrator%t_new(i:i + width - 1) - &
               integrator%next_time(i:i + width - 1)))
      end do
      excess = max(max(most(1), most(2)), max(most(3), most(4)))
      if (excess > 0) return
      if (maxval(solver_status%steps) >= integrator%max_steps) return
      if (any_true(attempt%lanes, attempt%implicit) .or. any_true(attempt%lanes, solver_status%implicit)) return
      is_plain_step = all_true(attempt%lanes, attempt%active)
    end associate
  end function is_plain_step

  !> Chooses the columns of the state whose dense output is needed: those that the observer reads, or all if a lane is inspected.
  pure subroutine choose_columns(integrator, observer)
    type(integrator_t), intent(inout) :: integrator
    class(observer_t), intent(in) :: observer

    associate (attempt => integrator%attempt)
      attempt%first_dense = 1
      attempt%last_dense = size(attempt%y, 2)
      if (modulo(attempt%lanes, width) /= 0 .or. any(integrator%inspected)) return
      attempt%first_dense = observer%first_read
      attempt%last_dense = min(observer%last_read, attempt%last_dense)
    end associate
  end subroutine choose_columns

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

end module nocdyn_error_test
