!> Steps that the system takes by itself, where nothing has to be decided (`nocdyn_plain_steps`): to the same bits as the steps of
!> `nocdyn_integration`.
module nocdyn_plain_stepping
  use, intrinsic :: iso_c_binding, only: c_int, c_loc, c_long
  use nocdyn_after_step, only: change_branches
  use nocdyn_error_norm, only: memory
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: any_true
  use nocdyn_observer, only: observer_t
  use nocdyn_plain_steps, only: last_step, no_step, plain_steps_t
  use nocdyn_solver_status, only: integration_done, integration_running, solver_status_t
  use nocdyn_step_control, only: final_stretch
  use nocdyn_stepper, only: stepper_t
  use nocdyn_switching, only: describe_plain_crossings, may_be_plain
  use nocdyn_system, only: system_t
  use nocdyn_time_stepping, only: integrator_t, shift_states
  implicit none (type, external)
  private

  public :: prepare_plain_steps, take_plain_steps

  integer, parameter :: most_steps = 4   ! at once: then lanes that have ended take variants, and interruptions are asked for

contains

  !> Finds whether steps may be plain at all.
  subroutine prepare_plain_steps(integrator, stepper, system, times, observer)
    type(integrator_t), target, intent(inout) :: integrator
    class(stepper_t), intent(in) :: stepper
    class(system_t), intent(in) :: system
    real(wp), intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer

    integrator%may_be_plain = stepper%series_order > 0 .and. system%lanes > 1 .and. system%measures > 0 .and. &
                              system%quadratures == 0 .and. &
                              size(times) == 2 .and. .not. integrator%first_step > 0 .and. &
                              .not. (integrator%has_events .or. integrator%has_extremes .or. system%limits_steps .or. &
                                     system%projects .or. system%hides_bends)
    if (.not. integrator%may_be_plain) return
    if (integrator%has_switches) integrator%may_be_plain = may_be_plain(integrator%switching, system)
    if (.not. integrator%may_be_plain) return
    call observer%list_ranges(stepper%series_order, integrator%plain, integrator%may_be_plain)
    if (.not. integrator%may_be_plain) return
    allocate (integrator%outcome(system%lanes), integrator%is_running(system%lanes), integrator%taken(system%lanes), &
              source=0_c_int)
    integrator%plain%lanes = system%lanes
    integrator%plain%measures = system%measures
  end subroutine prepare_plain_steps

  !> Lets the system take some plain steps; the lanes that have come to their ends are done.
  subroutine take_plain_steps(integrator, stepper, system, times, observer, solver_status, are_taken)
    type(integrator_t), target, intent(inout) :: integrator
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: times(:)   !! output times [s]
    class(observer_t), intent(inout) :: observer
    type(solver_status_t), target, intent(inout) :: solver_status
    logical, intent(out) :: are_taken   !! whether all running lanes have taken steps
    integer :: lane, left
    logical :: is_able

    are_taken = .false.
    if (.not. integrator%may_be_plain) return
    if (.not. system%takes_plain_steps()) return
    integrator%plain%most = min(most_steps, integrator%max_steps - 1 - maxval(solver_status%steps))
    if (integrator%plain%most < 1) return
    call stepper%describe_plain_steps(integrator%plain, is_able)
    if (.not. is_able) return
    associate (attempt => integrator%attempt)
      call describe_state(integrator)
      integrator%is_running(:) = merge(1_c_int, 0_c_int, integrator%occupied .and. solver_status%code == integration_running)
      integrator%outcome(:) = no_step
      if (integrator%has_switches) integrator%switching%pending(:) = 0
      integrator%taken(:) = 0
      call system%take_plain_steps(integrator%plain)
      integrator%accepted(:) = integrator%outcome > no_step
      left = 0
      do lane = 1, attempt%lanes
        solver_status%h(lane) = merge(attempt%h(lane), solver_status%h(lane), integrator%accepted(lane))
        solver_status%steps(lane) = solver_status%steps(lane) + integrator%taken(lane)
        solver_status%accepted(lane) = solver_status%accepted(lane) + integrator%taken(lane)
        attempt%evaluations(lane) = attempt%evaluations(lane) + integrator%taken(lane)
        solver_status%code(lane) = merge(integration_done, solver_status%code(lane), integrator%outcome(lane) == last_step)
        left = left + integrator%is_running(lane) - merge(1, 0, integrator%accepted(lane))
      end do
      are_taken = left == 0
      if (maxval(integrator%outcome) == last_step) then
        do lane = 1, attempt%lanes
          if (integrator%outcome(lane) /= last_step) cycle
          integrator%sample(:) = attempt%y(lane, :attempt%components)
          call observer%on_output(lane, attempt%t(lane), integrator%sample)
        end do
      end if
      if (integrator%may_shift .and. any_true(attempt%lanes, integrator%accepted)) call shift_states(integrator, system, observer)
      call stepper%accept_plain_steps(integrator%accepted)
      if (.not. integrator%has_switches) return
      if (maxval(integrator%switching%pending) == 0) return
      call system%change_plain_branches(integrator%plain)
      call change_branches(integrator, stepper, system, times, observer, solver_status)
    end associate
  end subroutine take_plain_steps

  !> Where the numbers of the lanes stand now.
  subroutine describe_state(integrator)
    type(integrator_t), target, intent(inout) :: integrator

    associate (plain => integrator%plain, attempt => integrator%attempt, control => integrator%control)
      plain%columns = size(attempt%y, 2, c_long)
      plain%rtol = control%rtol
      plain%atol = control%atol
      plain%t_end = control%t_end
      plain%longest = control%longest_step
      plain%stretch = final_stretch
      plain%memory = memory
      plain%t = c_loc(attempt%t)
      plain%y = c_loc(attempt%y)
      plain%size = c_loc(control%size)
      plain%h = c_loc(attempt%h)
      plain%wanted = c_loc(control%h)
      plain%running = c_loc(integrator%is_running)
      plain%outcome = c_loc(integrator%outcome)
      plain%taken = c_loc(integrator%taken)
    end associate
    if (integrator%has_switches) call describe_plain_crossings(integrator%switching, integrator%plain)
  end subroutine describe_state

end module nocdyn_plain_stepping
