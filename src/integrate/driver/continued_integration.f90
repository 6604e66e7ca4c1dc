!> An integration of one lane that goes on from call to call, and whose system may change between them.
!>
!> Its steps are the ones of a single integration to the end, to the same bits. A step that goes beyond the time that is asked
!> for is held: what lies after that time is passed to the observer by later calls, and only then does the lane move to the end of
!> the step. Where the system changes, a step that is held ends there.
module nocdyn_continued_integration
  use nocdyn_after_step, only: output_until
  use nocdyn_dense_output, only: sample
  use nocdyn_ensemble, only: initial_states, initial_states_t
  use nocdyn_error_norm, only: forget_sizes, measure_start
  use nocdyn_errors, only: error_t
  use nocdyn_integration, only: accept_steps, begin_integration, try_steps
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_methods, only: select_method
  use nocdyn_observer, only: observer_t
  use nocdyn_solver_status, only: integration_done, integration_running, solver_status_t
  use nocdyn_step_control, only: resume_control
  use nocdyn_stepper, only: stepper_t
  use nocdyn_switching, only: start_switching
  use nocdyn_system, only: system_t
  use nocdyn_time_stepping, only: evaluate_starts, fill_lanes, integrator_t, start_lanes
  implicit none (type, external)
  private

  !> A copy of it and of its system goes on by itself.
  type, public :: continued_integration_t
    type(solver_status_t) :: solver_status
    real(wp) :: t = 0.0_wp                     !! time that was asked for last [s]
    class(stepper_t), allocatable, private :: stepper
    type(integrator_t), private :: integrator
    logical, private :: holds = .false.        !! whether the lane has not moved to the end of its last step
  contains
    procedure :: begin, end_at, end_time, advance_to, cut_step, resume, has_failed
  end type continued_integration_t

contains

  !> Starts at `span(1)`, where the observer gets the first row.
  subroutine begin(self, system, settings, span, y, observer, error)
    class(continued_integration_t), intent(inout) :: self
    class(system_t), intent(inout) :: system           !! of one lane
    type(integration_settings_t), intent(in) :: settings
    real(wp), intent(in) :: span(2)                    !! start, and the end beyond which no step goes [s]
    real(wp), intent(in) :: y(:, :)                    !! initial state, [1, components]
    class(observer_t), intent(inout) :: observer       !! of rows only
    type(error_t), allocatable, intent(out) :: error   !! allocated if a setting is refused
    type(initial_states_t) :: ensemble

    if (system%lanes /= 1) error stop 'nocdyn_continued_integration: the system must have one lane'
    call check_settings(settings, error)
    if (.not. allocated(error)) call select_method(settings, system, self%stepper, error)
    if (allocated(error)) return
    call begin_integration(self%integrator, self%stepper, system, settings, span, observer, self%solver_status)
    ensemble = initial_states(y)
    self%t = span(1)
    call fill_lanes(self%integrator, self%stepper, system, ensemble, span, observer, self%solver_status)
    call count_work(self)
  end subroutine begin

  !> Moves the end. A step that is held and goes to the present end stays as it is.
  subroutine end_at(self, t_end)
    class(continued_integration_t), intent(inout) :: self
    real(wp), intent(in) :: t_end   !! after the present time, which is before the present end [s]

    associate (control => self%integrator%control)
      if (.not. (t_end > self%t .and. self%t < control%t_end)) error stop 'nocdyn_continued_integration: the end is not ahead'
      control%t_end = t_end
      control%ends_at_t_end(1) = .false.
    end associate
    if (self%solver_status%code(1) == integration_done) self%solver_status%code(1) = integration_running
  end subroutine end_at

  !> The end beyond which no step goes [s].
  pure real(wp) function end_time(self)
    class(continued_integration_t), intent(in) :: self

    end_time = self%integrator%control%t_end
  end function end_time

  !> Whether the integration has ended before its time.
  pure logical function has_failed(self)
    class(continued_integration_t), intent(in) :: self

    has_failed = all(self%solver_status%code(1) /= [integration_running, integration_done])
  end function has_failed

  !> Integrates until the observer has the row at a time, unless the integration fails.
  subroutine advance_to(self, t, system, observer)
    class(continued_integration_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! after the present time, not after the end [s]
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    real(wp) :: times(2)

    if (self%has_failed() .or. .not. t > self%t) return
    times = [self%t, t]
    self%t = t
    associate (integrator => self%integrator)
      integrator%next(1) = 2
      integrator%next_time(1) = t
      if (self%holds) then
        call output_until(integrator, 1, integrator%t_new(1), times, observer)
        call hold_or_accept(self, times, system, observer)
      end if
      do while (integrator%next(1) == 2 .and. self%solver_status%code(1) == integration_running)
        call try_steps(integrator, self%stepper, system, times, observer, self%solver_status)
        if (integrator%accepted(1)) call hold_or_accept(self, times, system, observer)
      end do
    end associate
    call count_work(self)
  end subroutine advance_to

  !> Holds a step that goes beyond the time that is asked for, or moves to its end.
  subroutine hold_or_accept(self, times, system, observer)
    class(continued_integration_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: times(:)   !! of the last row and of this one [s]
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer

    associate (integrator => self%integrator)
      self%holds = integrator%next(1) > 2 .and. integrator%t_new(1) > times(2)
      if (.not. self%holds) call accept_steps(integrator, self%stepper, system, times, observer, self%solver_status)
    end associate
  end subroutine hold_or_accept

  !> Ends a step that is held at the present time; before the system changes.
  subroutine cut_step(self, system, observer)
    class(continued_integration_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    real(wp) :: theta

    if (.not. self%holds) return
    associate (integrator => self%integrator)
      theta = (self%t - integrator%attempt%t(1)) / integrator%attempt%h(1)
      call sample(integrator%dense, theta, integrator%sample)
      integrator%t_new(1) = self%t
      integrator%attempt%y_new(1, :integrator%attempt%components) = integrator%sample
      integrator%steps%theta_end(1) = theta
      integrator%steps%crosses(1) = .false.
      if (integrator%has_switches) integrator%switching%pending(1) = 0
      self%solver_status%code(1) = integration_running
      call accept_steps(integrator, self%stepper, system, [self%t, self%t], observer, self%solver_status)
    end associate
    self%holds = .false.
  end subroutine cut_step

  !> Goes on with equations that have changed since `cut_step`; the observer gets the row there again. Nothing is left to
  !> do at the end.
  subroutine resume(self, system, observer)
    class(continued_integration_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer

    if (self%solver_status%code(1) == integration_running) then
      associate (integrator => self%integrator)
        integrator%starting(1) = .true.
        if (self%solver_status%steps(1) == 0) then
          integrator%next(1) = 2
          call start_lanes(integrator, self%stepper, system, [self%t, self%t], observer, self%solver_status)
        else
          call restart(self, system)
        end if
      end associate
      call count_work(self)
    end if
    associate (integrator => self%integrator)
      integrator%sample(:) = integrator%attempt%y(1, :integrator%attempt%components)
      call observer%on_output(1, self%t, integrator%sample)
    end associate
  end subroutine resume

  !> Starts again at the present state, on the branches of the system.
  subroutine restart(self, system)
    class(continued_integration_t), intent(inout) :: self
    class(system_t), intent(inout) :: system

    associate (integrator => self%integrator)
      if (integrator%has_switches) then
        call start_switching(integrator%switching, system, integrator%attempt, 1, self%solver_status)
      end if
      call resume_control(integrator%control, 1, self%solver_status%h(1))
      call evaluate_starts(integrator, system, self%solver_status)
      if (integrator%evaluates_starts) then
        call measure_start(integrator%control, system, integrator%attempt, integrator%starting)
      else
        call forget_sizes(integrator%control, integrator%starting)
      end if
      call self%stepper%resume(integrator%attempt, integrator%starting)
    end associate
  end subroutine restart

  !> The time that the steps have reached, and the work until there.
  subroutine count_work(self)
    class(continued_integration_t), intent(inout) :: self

    associate (attempt => self%integrator%attempt, solver_status => self%solver_status)
      solver_status%t(1) = attempt%t(1)
      solver_status%evaluations(1) = attempt%evaluations(1)
      solver_status%jacobians(1) = attempt%jacobians(1)
      solver_status%factorisations(1) = attempt%factorisations(1)
    end associate
  end subroutine count_work

end module nocdyn_continued_integration
