!> Processing of accepted steps: output times, events, extremes, and changes of branches.
module nocdyn_after_step
  use nocdyn_dense_output, only: batch, load_lane, sample, sample_batch
  use nocdyn_events, only: find_events
  use nocdyn_extremes, only: end_extremes, restart_extremes, update_extremes
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_observer, only: observer_t
  use nocdyn_solver_status, only: integration_done, integration_running, integration_stopped, integration_too_many_steps, &
    solver_status_t
  use nocdyn_step_control, only: resume_control
  use nocdyn_stepper, only: stepper_t
  use nocdyn_switching, only: cross_boundaries, find_crossing, may_cross, scan_for_crossings
  use nocdyn_system, only: system_t
  use nocdyn_time_stepping, only: evaluate_starts, integrator_t
  implicit none (type, external)
  private

  public :: process_steps, change_branches, output_until

  real(wp), parameter :: same_time = 16.0_wp   ! spacings of the time by which a row may be before a crossing that it is at

contains

  !> Finds what lies in the accepted steps, ends steps at changes of branches and terminal events, and informs the observer of
  !> output times, events and extremes.
  subroutine process_steps(integrator, system, times, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status
    logical :: crosses   ! whether the lane may cross a boundary
    integer :: i, lane
    real(wp) :: t
    logical :: is_terminal

    associate (steps => integrator%steps)
      steps%theta_end(:) = 1.0_wp
      steps%crosses(:) = .false.
      if (.not. integrator%inspects) then
        call describe_steps(integrator)
        return
      end if
      if (integrator%has_switches .and. any_true(integrator%attempt%lanes, integrator%accepted)) then
        call scan_for_crossings(integrator%switching, system, integrator%attempt, integrator%coefficients, integrator%accepted)
      end if
      do lane = 1, integrator%attempt%lanes
        if (.not. integrator%accepted(lane)) cycle
        crosses = .false.
        if (integrator%has_switches) crosses = may_cross(integrator%switching, lane)
        if (crosses .or. integrator%has_events .or. integrator%next_time(lane) < integrator%t_new(lane)) then
          call load_lane(integrator%dense, integrator%attempt, integrator%coefficients, lane)
        end if
        if (crosses) then
          call end_at_crossing(integrator, system, observer, lane, solver_status, steps%theta_end(lane))
          steps%crosses(lane) = integrator%switching%pending(lane) > 0
        end if
        if (integrator%has_events) then
          ! events in their order, with the output times between them; a terminal event ends the step and the lane
          call find_events(integrator%events, system, observer, integrator%dense, steps%theta_end(lane))
          do i = 1, integrator%events%found
            t = min(integrator%attempt%t(lane) + integrator%events%theta(i) * integrator%attempt%h(lane), integrator%t_new(lane))
            call output_until(integrator, lane, t, times, observer)
            call sample(integrator%dense, integrator%events%theta(i), integrator%sample)
            call observer%on_event(lane, integrator%events%which(i), t, integrator%sample, is_terminal)
            if (.not. is_terminal) cycle
            solver_status%code(lane) = integration_stopped
            steps%theta_end(lane) = integrator%events%theta(i)
            integrator%t_new(lane) = t
            integrator%attempt%y_new(lane, :integrator%attempt%components) = integrator%sample
            steps%crosses(lane) = .false.
            exit
          end do
        end if
        if (integrator%next_time(lane) <= integrator%t_new(lane)) then
          call output_until(integrator, lane, integrator%t_new(lane), times, observer)
        end if
      end do
      call describe_steps(integrator)
      if (integrator%has_extremes) then
        call update_extremes(integrator%extremes, observer, steps, integrator%attempt, integrator%coefficients)
      end if
    end associate
  end subroutine process_steps

  !> Describes the steps of the whole block.
  subroutine describe_steps(integrator)
    type(integrator_t), intent(inout) :: integrator

    associate (steps => integrator%steps, attempt => integrator%attempt)
      steps%taken(:) = integrator%accepted
      steps%are_all_taken = all_true(size(integrator%accepted), integrator%accepted)
      steps%degree(:) = attempt%degree
      steps%t(:) = attempt%t
      steps%h(:) = attempt%h
      steps%t_new(:) = integrator%t_new
    end associate
  end subroutine describe_steps

  !> Cuts the step of a lane at the boundary of its branch.
  subroutine end_at_crossing(integrator, system, observer, lane, solver_status, theta_end)
    type(integrator_t), intent(inout) :: integrator
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    integer, intent(in) :: lane
    type(solver_status_t), intent(inout) :: solver_status
    real(wp), intent(out) :: theta_end   !! theta of the cut, 1 if there is none
    real(wp) :: t

    call find_crossing(integrator%switching, system, observer, integrator%dense, theta_end)
    if (integrator%switching%pending(lane) == 0) return
    t = integrator%attempt%t(lane) + theta_end * integrator%attempt%h(lane)
    if (t >= integrator%t_new(lane)) then
      theta_end = 1.0_wp
      return
    end if
    integrator%t_new(lane) = t
    call sample(integrator%dense, theta_end, integrator%sample)
    integrator%attempt%y_new(lane, :integrator%attempt%components) = integrator%sample
    if (solver_status%code(lane) /= integration_done) return
    solver_status%code(lane) = merge(integration_too_many_steps, integration_running, &
                                     solver_status%steps(lane) >= integrator%max_steps)
  end subroutine end_at_crossing

  !> Passes the output times up to t that are due to the observer. Rows at a crossing where joints may
  !> change wait until the lane is on its next branch.
  subroutine output_until(integrator, lane, t, times, observer)
    type(integrator_t), intent(inout) :: integrator
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer
    real(wp) :: end_of_rows, theta(batch)
    logical :: waits
    integer :: ahead, i

    end_of_rows = integrator%t_new(lane)
    waits = integrator%has_jumps .and. integrator%steps%crosses(lane)
    if (waits) end_of_rows = end_of_rows - same_time * spacing(end_of_rows)
    associate (next => integrator%next(lane))
      do while (next <= size(times))
        theta = 0.0_wp
        ahead = 0
        do while (ahead < min(batch, size(times) + 1 - next))
          if (times(next + ahead) > t .or. times(next + ahead) >= end_of_rows) exit
          ahead = ahead + 1
          theta(ahead) = (times(next + ahead - 1) - integrator%dense%t) / integrator%dense%h
        end do
        if (ahead == 0) exit
        call sample_batch(integrator%dense, theta)
        do i = 1, ahead
          call observer%on_output(lane, times(next), integrator%dense%states(:integrator%attempt%components, i))
          next = next + 1
        end do
      end do
      if (next > size(times) .or. waits) return
      if (times(next) > t) return
      integrator%sample(:) = integrator%attempt%y_new(lane, :integrator%attempt%components)
      call observer%on_output(lane, times(next), integrator%sample)
      next = next + 1
    end associate
  end subroutine output_until

  !> Passes the output times at a crossing, where the lane now is on its next branch.
  subroutine output_at_crossing(integrator, lane, times, observer)
    type(integrator_t), intent(inout) :: integrator
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: times(:)
    class(observer_t), intent(inout) :: observer

    integrator%sample(:) = integrator%attempt%y(lane, :integrator%attempt%components)
    associate (next => integrator%next(lane))
      do while (next <= size(times))
        if (times(next) > integrator%attempt%t(lane)) exit
        call observer%on_output(lane, times(next), integrator%sample)
        next = next + 1
      end do
      integrator%next_time(lane) = huge(integrator%next_time)
      if (next <= size(times)) integrator%next_time(lane) = times(next)
    end associate
  end subroutine output_at_crossing

  !> Lanes whose step ended at the boundary of a branch change to the next branch and restart there; those that have come to the
  !> end only show it in their last row.
  subroutine change_branches(integrator, stepper, system, times, observer, solver_status)
    type(integrator_t), intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), intent(inout) :: solver_status
    integer :: lane

    associate (attempt => integrator%attempt, starting => integrator%starting)
      do lane = 1, attempt%lanes
        starting(lane) = .false.
        if (.not. integrator%accepted(lane) .or. integrator%switching%pending(lane) == 0) cycle
        starting(lane) = solver_status%code(lane) == integration_running
        if (starting(lane)) then
          call cross_boundaries(integrator%switching, system, attempt, lane, solver_status)
          call resume_control(integrator%control, lane, solver_status%h(lane))
          if (integrator%has_extremes) call restart_extremes(integrator%extremes, lane)
        else if (solver_status%code(lane) == integration_done .and. integrator%has_jumps) then
          call cross_boundaries(integrator%switching, system, attempt, lane, solver_status)
          if (integrator%has_extremes) call end_extremes(integrator%extremes, observer, attempt, lane)
        end if
        if (.not. (integrator%has_jumps .and. integrator%steps%crosses(lane))) cycle
        integrator%sample(:) = attempt%y(lane, :attempt%components)
        call observer%on_jump(lane, attempt%t(lane), integrator%sample)
        call output_at_crossing(integrator, lane, times, observer)
      end do
      if (.not. any(starting)) return
      call evaluate_starts(integrator, system, solver_status)
      call stepper%resume(attempt, starting)
    end associate
  end subroutine change_branches

end module nocdyn_after_step
