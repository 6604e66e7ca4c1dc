!> Runs of a machine of one lane.
module nocdyn_test_machine_runs
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_solver_status, only: integration_done, solver_status_t
  use nocdyn_recorder, only: recorder, recorder_t
  use nocdyn_test_states, only: formulate
  implicit none (type, external)
  private

  public :: run_machine

  !> What a run leaves at the requested times, [.., times].
  type, public :: machine_run_t
    real(wp), allocatable :: phi(:, :), omega(:, :)   !! [bodies, times]
    real(wp), allocatable :: energy(:)                !! kinetic and stored [J]
    real(wp), allocatable :: work(:)                  !! sum over all elements with a work integral [J]
    real(wp) :: effort = 0.0_wp                       !! the largest sum of absolute works [J]
    type(solver_status_t) :: solver_status
  end type machine_run_t

contains

  subroutine run_machine(machine, which, method, times, tolerance, run)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: which              !! formulation, as `formulate` numbers them
    character(len=*), intent(in) :: method
    real(wp), contiguous, intent(in) :: times(:)
    real(wp), intent(in) :: tolerance         !! rtol; atol is a tenth of it
    type(machine_run_t), intent(out) :: run
    class(formulation_t), allocatable :: formulation
    type(recorder_t) :: records
    type(integration_settings_t) :: settings
    type(error_t), allocatable :: error
    real(wp), allocatable :: y(:, :)
    integer :: i

    call formulate(machine, which, formulation)
    settings%method = method
    settings%rtol = tolerance
    settings%atol = 0.1_wp * tolerance
    y = formulation%start()
    records = recorder(formulation, size(times))
    call integrate(formulation, settings, times, y, records, run%solver_status, error)
    if (allocated(error)) error stop 'nocdyn_test_machine_runs: a setting was refused'
    if (run%solver_status%code(1) /= integration_done) error stop 'nocdyn_test_machine_runs: a run did not reach its end'
    allocate (run%phi(machine%bodies, size(times)), run%omega(machine%bodies, size(times)))
    allocate (run%energy(size(times)), run%work(size(times)))
    do i = 1, size(times)
      y(1, :) = records%y(1, i, :)
      call formulation%observe(times(i:i), y)
      run%phi(:, i) = formulation%phi(1, 1:)
      run%omega(:, i) = formulation%omega(1, 1:)
      call formulation%state%evaluate_energies(formulation%machine)
      run%energy(i) = formulation%machine%kinetic_energy(1, run%omega(:, i)) &
                      + sum(formulation%state%elements%stored(1, :))
      run%work(i) = sum(y(1, formulation%states + 1:))
      run%effort = max(run%effort, sum(abs(y(1, formulation%states + 1:))))
    end do
  end subroutine run_machine

end module nocdyn_test_machine_runs
