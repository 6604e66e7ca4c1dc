!> Integration with one call: from a system and output times to the array of the states there.
module nocdyn_solve
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_sampler, only: sampler, sampler_t
  use nocdyn_solver_status, only: failure_message, integration_done, solver_status_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: solve

contains

  !> Sets y(:, i) to the state at times(i); y(:, 1) is the initial state.
  subroutine solve(system, times, settings, y, error)
    class(system_t), intent(inout) :: system               !! of one lane
    real(wp), contiguous, intent(in) :: times(:)           !! output times [s], ascending
    type(integration_settings_t), intent(in) :: settings
    real(wp), contiguous, intent(inout) :: y(:, :)         !! [components, times]; set as far as the integration came
    type(error_t), allocatable, intent(out) :: error       !! allocated if a setting is refused or the end is not reached
    type(sampler_t) :: samples
    type(solver_status_t) :: solver_status
    real(wp) :: state(1, size(y, 1))

    if (system%lanes /= 1) error stop 'nocdyn_solve: the system must have one lane'
    if (size(y, 2) /= size(times)) error stop 'nocdyn_solve: y must have one column for each time'
    samples = sampler(1, size(y, 1), size(times))
    state(1, :) = y(:, 1)
    call integrate(system, settings, times, state, samples, solver_status, error)
    if (allocated(error)) return
    y(:, :samples%count(1)) = samples%y(:, :samples%count(1), 1)
    if (solver_status%code(1) == integration_done) return
    call raise(error, exit_failed, failure_message(solver_status, 1, system, settings%rtol, settings%atol))
  end subroutine solve

end module nocdyn_solve
