!> Integration of a block of lanes from the first to the last output time.
module nocdyn_integration
  use nocdyn_after_step, only: change_branches, process_steps
  use nocdyn_ensemble, only: ensemble_t, initial_states, initial_states_t
  use nocdyn_error_test, only: test_errors
  use nocdyn_errors, only: error_t
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: any_differs, any_true
  use nocdyn_methods, only: select_method
  use nocdyn_observer, only: observer_t
  use nocdyn_solver_status, only: allocate_solver_status, integration_interrupted, integration_running, solver_status_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_time_stepping, only: advance_lanes, begin_attempts, fill_lanes, integrator_t, prepare_integrator, &
    project_states, release_lanes, shift_states
  implicit none (type, external)
  private

  public :: integrate, integrate_ensemble, integrate_with

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
    logical :: is_interrupted

    if (size(times) < 2) error stop 'nocdyn_integration: times needs a start and an end'
    if (.not. all(times(2:) > times(:size(times) - 1))) error stop 'nocdyn_integration: times must ascend'
    call system%prepare_integration(settings%rtol, settings%atol, times(size(times)))
    call allocate_solver_status(solver_status, system%lanes)
    if (stepper%series_order > 0) call system%prepare_series(stepper%series_order)
    call prepare_integrator(integrator, stepper, system, settings, times, observer)
    do
      call fill_lanes(integrator, stepper, system, ensemble, times, observer, solver_status)
      if (integrator%free == system%lanes) exit
      call begin_attempts(integrator, stepper, system, solver_status)
      call stepper%take_step(system, integrator%attempt)
      call test_errors(integrator, stepper, system, observer, solver_status)
      if (any_true(system%lanes, integrator%accepted)) then
        if (integrator%inspects .or. integrator%wants_steps) then
          call process_steps(integrator, system, times, observer, solver_status)
        end if
        if (integrator%wants_steps) then
          call stepper%pass_steps(integrator%steps, integrator%attempt, integrator%coefficients, observer)
        end if
        call advance_lanes(integrator, times)
        if (system%projects) call project_states(integrator, system)
        if (integrator%may_shift) call shift_states(integrator, system, observer)
        call stepper%accept(integrator%accepted)
        if (integrator%has_switches) call change_branches(integrator, stepper, system, times, observer, solver_status)
      end if
      call interrupt_if_asked(integrator, observer, solver_status, is_interrupted)
      call release_lanes(integrator, system, ensemble, observer, solver_status)
      if (is_interrupted) exit
    end do
  end subroutine integrate_with

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

end module nocdyn_integration
