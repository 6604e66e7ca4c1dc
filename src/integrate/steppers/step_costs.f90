!> What a step of a method costs, from the size of the system alone, so that a choice between methods has the same outcome on
!> every machine.
!>
!> The numbers are the times of runs of one machine with `release`, in ns of the processor on which they were measured; only their
!> ratios matter. docs/pages/integrators.md has the table and the commands.
module nocdyn_step_costs
  use nocdyn_kinds, only: wp
  use nocdyn_stepper, only: observation_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: explicit_cost, implicit_cost, taylor_cost

  real(wp), parameter :: explicit_start = 1100.0_wp, explicit_state = 0.8_wp   ! sums of stages: of a step, of a state and stage
  real(wp), parameter :: implicit_start = 2500.0_wp, operation = 0.5_wp        ! Jacobian, factors and solutions
  real(wp), parameter :: taylor_start = 600.0_wp, taylor_state = 0.7_wp        ! sums of series: of a step, of a state and order
  real(wp), parameter :: sample_start = 700.0_wp, sample_function = 12.0_wp    ! of all tracked functions, of one

contains

  !> The cost of an explicit step.
  real(wp) function explicit_cost(system, observation, stages, dense_stages, degree) result(cost)
    class(system_t), intent(in) :: system
    type(observation_t), intent(in) :: observation
    integer, intent(in) :: stages         !! evaluations in a step
    integer, intent(in) :: dense_stages   !! further ones for the dense output
    integer, intent(in) :: degree         !! of the dense output
    integer :: evaluations

    evaluations = stages + merge(dense_stages, 0, observation%is_dense)
    cost = explicit_start + evaluations * (system%evaluation_cost() + explicit_state * (system%states + system%quadratures)) &
           + inspection_cost(observation, degree)
  end function explicit_cost

  !> The cost of a Rosenbrock step.
  real(wp) function implicit_cost(system, observation, stages, operations, degree) result(cost)
    class(system_t), intent(in) :: system
    type(observation_t), intent(in) :: observation
    integer, intent(in) :: stages           !! evaluations and solutions in a step
    real(wp), intent(in) :: operations      !! of a factorisation and the solutions
    integer, intent(in) :: degree           !! of the dense output

    cost = implicit_start + stages * system%evaluation_cost() + operation * operations + inspection_cost(observation, degree)
  end function implicit_cost

  !> The cost of a step by a Taylor series.
  real(wp) function taylor_cost(system, observation, order) result(cost)
    class(system_t), intent(in) :: system
    type(observation_t), intent(in) :: observation
    integer, intent(in) :: order

    cost = taylor_start + system%series_cost(order) + taylor_state * order * (system%states + system%quadratures) &
           + inspection_cost(observation, order)
  end function taylor_cost

  !> The cost of finding the extremes of the tracked functions in a step.
  pure real(wp) function inspection_cost(observation, degree) result(cost)
    type(observation_t), intent(in) :: observation
    integer, intent(in) :: degree

    cost = merge(degree * (sample_start + sample_function * observation%tracked), 0.0_wp, observation%tracked > 0)
  end function inspection_cost

end module nocdyn_step_costs
