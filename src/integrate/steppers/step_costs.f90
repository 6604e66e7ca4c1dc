!> What a step of a method costs, from the size of the system alone, so that a choice between methods has the same outcome on
!> every machine, whatever is recorded.
!>
!> The numbers are the times of runs of one machine with `release`, in ns of the processor on which they were measured; only
!> their ratios matter. docs/pages/integrators.md has the table. A run follows the extremes of about two columns for each state.
!> Variants of a sweep follow few; their series and stages share vectors, their linear systems do not.
module nocdyn_step_costs
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: explicit_cost, implicit_cost, taylor_cost

  real(wp), parameter :: explicit_start = 1100.0_wp, explicit_state = 0.8_wp   ! sums of stages: of a step, of a state and stage
  real(wp), parameter :: implicit_start = 2500.0_wp, operation = 0.5_wp        ! Jacobian, factors and solutions
  real(wp), parameter :: taylor_start = 600.0_wp, taylor_state = 0.7_wp        ! sums of series: of a step, of a state and order
  real(wp), parameter :: shared_explicit_start = 300.0_wp, shared_taylor_start = 150.0_wp   ! where variants share vectors
  real(wp), parameter :: shared_coefficient = 0.6_wp                           ! coefficient of a shared series, in evaluations
  real(wp), parameter :: sample_start = 820.0_wp, sample_state = 24.0_wp       ! of the columns: of a sample, of a state

contains

  !> The cost of an explicit step.
  pure real(wp) function explicit_cost(system, evaluations, degree) result(cost)
    class(system_t), intent(in) :: system
    integer, intent(in) :: evaluations   !! in a step, with its dense output
    integer, intent(in) :: degree        !! of the dense output

    cost = merge(shared_explicit_start, explicit_start, system%is_shared) &
           + evaluations * (system%evaluation_cost() + explicit_state * system%states) + inspection_cost(system, degree)
  end function explicit_cost

  !> The cost of a Rosenbrock step.
  pure real(wp) function implicit_cost(system, evaluations, operations, degree) result(cost)
    class(system_t), intent(in) :: system
    integer, intent(in) :: evaluations   !! in a step
    real(wp), intent(in) :: operations   !! of a factorisation and the solutions
    integer, intent(in) :: degree        !! of the dense output

    cost = implicit_start + evaluations * system%evaluation_cost() + operation * operations + inspection_cost(system, degree)
  end function implicit_cost

  !> The cost of a step by a Taylor series.
  pure real(wp) function taylor_cost(system, order) result(cost)
    class(system_t), intent(in) :: system
    integer, intent(in) :: order

    cost = taylor_state * order * system%states + inspection_cost(system, order)
    if (system%is_shared) then
      cost = cost + shared_taylor_start + shared_coefficient * order * system%evaluation_cost()
    else
      cost = cost + taylor_start + system%series_cost(order)
    end if
  end function taylor_cost

  !> The cost of finding the extremes of the columns in a step.
  pure real(wp) function inspection_cost(system, degree) result(cost)
    class(system_t), intent(in) :: system
    integer, intent(in) :: degree   !! of the dense output

    cost = 0.0_wp
    if (.not. system%is_shared) cost = degree * (sample_start + sample_state * system%states)
  end function inspection_cost

end module nocdyn_step_costs
