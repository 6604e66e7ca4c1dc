!> Integrations of the classic problems, and the methods suitable for each.
module nocdyn_classic_runs
  use nocdyn_classic_problem, only: classic_problem_t, end_error
  use nocdyn_errors, only: error_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: integration_done, solver_status_t
  use nocdyn_recorder, only: recorder, recorder_t
  implicit none (type, external)
  private

  public :: solve_classic, suits

  character(len=8), parameter, public :: classic_methods(5) = &
    [character(len=8) :: 'rk45', 'rk853', 'rodas4', 'rodas5p', 'auto']

contains

  !> Explicit methods would need millions of steps for the stiff problems.
  elemental function suits(method, is_stiff)
    character(len=*), intent(in) :: method   !! one of classic_methods
    logical, intent(in) :: is_stiff
    logical :: suits

    suits = .not. is_stiff .or. index(method, 'rk') /= 1
  end function suits

  subroutine solve_classic(problem, method, rtol, error, solver_status)
    class(classic_problem_t), intent(inout) :: problem
    character(len=*), intent(in) :: method
    real(wp), intent(in) :: rtol
    real(wp), intent(out) :: error           !! `end_error`; huge if the end was not reached
    type(solver_status_t), intent(out) :: solver_status
    type(integration_settings_t) :: settings
    type(recorder_t) :: records
    type(error_t), allocatable :: refusal
    real(wp) :: y(1, problem%states)

    settings%method = method
    settings%rtol = rtol
    settings%atol = problem%atol_ratio * rtol
    records = recorder(problem, 2)
    y(1, :) = problem%y_start
    call integrate(problem, settings, [0.0_wp, problem%t_end], y, records, solver_status, refusal)
    if (allocated(refusal)) error stop 'nocdyn_classic_runs: a setting was refused'
    error = huge(1.0_wp)
    if (solver_status%code(1) == integration_done) error = end_error(problem, y(1, :))
  end subroutine solve_classic

end module nocdyn_classic_runs
