!> The linear systems of the stages of a Rosenbrock step, one per lane: (1/gamma - h J) k = r.
module nocdyn_stage_systems
  use nocdyn_finite, only: all_finite, is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_system, only: evaluation_fine, system_t
  use nocdyn_trial, only: park, trial_not_finite, trial_shorten, trial_t
  implicit none (type, external)
  private

  public :: allocate_stage_system, renew_jacobian, factor, solve

  !> Quadratures drive nothing, so J is block triangular: the factors are those of the states alone, and the rows of the
  !> quadratures follow from the solution for the states.
  type, public :: stage_system_t
    real(wp), allocatable :: dfdy(:, :, :)             !! shape [lanes, components, states]
    real(wp), allocatable :: dfdt(:, :)                !! shape [lanes, components]
    real(wp), allocatable, private :: factors(:, :, :) !! shape [states, states, lanes]
    integer, allocatable, private :: pivots(:, :)      !! shape [states, lanes]
    real(wp), allocatable, private :: x(:)             !! right-hand side and solution of one lane
  end type stage_system_t

contains

  !> Room for the Jacobian and the factors of every lane.
  subroutine allocate_stage_system(stage_system, system)
    type(stage_system_t), intent(out) :: stage_system
    class(system_t), intent(in) :: system

    associate (lanes => system%lanes, states => system%states, components => system%states + system%quadratures)
      allocate (stage_system%dfdy(lanes, components, states), source=0.0_wp)
      allocate (stage_system%dfdt(lanes, components), source=0.0_wp)
      allocate (stage_system%factors(states, states, lanes), source=0.0_wp)
      allocate (stage_system%pivots(states, lanes), source=0)
      allocate (stage_system%x(states), source=0.0_wp)
    end associate
  end subroutine allocate_stage_system

  !> The derivatives at the start of the step; lanes where they fail are parked.
  subroutine renew_jacobian(stage_system, system, trial)
    type(stage_system_t), intent(inout) :: stage_system
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    integer :: lane

    trial%status = evaluation_fine
    call system%jacobian(trial%t, trial%y, stage_system%dfdy, stage_system%dfdt, trial%status)
    associate (dfdy => stage_system%dfdy, dfdt => stage_system%dfdt)
      if (all_finite(size(dfdy), dfdy) .and. all_finite(size(dfdt), dfdt) &
          .and. all(trial%status == evaluation_fine)) return
      do lane = 1, trial%lanes
        if (trial%status(lane) == evaluation_fine) then
          if (all(is_finite(dfdy(lane, :, :))) .and. all(is_finite(dfdt(lane, :)))) cycle
          trial%status(lane) = trial_not_finite
        end if
        dfdy(lane, :, :) = 0.0_wp
        dfdt(lane, :) = 0.0_wp
        call park(trial, lane, trial%status(lane), 0)
      end do
    end associate
  end subroutine renew_jacobian

  !> Factors for the step sizes of this attempt; a lane whose matrix is singular is parked, to take a shorter step.
  subroutine factor(stage_system, trial, gamma)
    type(stage_system_t), intent(inout) :: stage_system
    type(trial_t), intent(inout) :: trial
    real(wp), intent(in) :: gamma
    logical :: singular
    integer :: lane, i, j

    if (trial%states == 0) return
    do lane = 1, trial%lanes
      if (.not. trial%working(lane)) cycle
      do j = 1, trial%states
        do i = 1, trial%states
          stage_system%factors(i, j, lane) = -trial%h(lane) * stage_system%dfdy(lane, i, j)
        end do
        stage_system%factors(j, j, lane) = stage_system%factors(j, j, lane) + 1 / gamma
      end do
      call lu_factor(stage_system%factors(:, :, lane), stage_system%pivots(:, lane), singular)
      trial%factorisations(lane) = trial%factorisations(lane) + 1
      if (singular) call park(trial, lane, trial_shorten, 0)
    end do
  end subroutine factor

  !> k from r; zero for the lanes that are not working.
  subroutine solve(stage_system, trial, gamma, r, k)
    type(stage_system_t), intent(inout) :: stage_system
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: gamma
    real(wp), contiguous, intent(in) :: r(:, :)      !! shape [lanes, components]
    real(wp), contiguous, intent(inout) :: k(:, :)   !! shape [lanes, components]
    integer :: lane, i

    do lane = 1, trial%lanes
      if (.not. trial%working(lane)) then
        k(lane, :) = 0.0_wp
      else if (trial%states > 0) then
        do i = 1, trial%states
          stage_system%x(i) = r(lane, i)
        end do
        call lu_solve(stage_system%factors(:, :, lane), stage_system%pivots(:, lane), stage_system%x)
        do i = 1, trial%states
          k(lane, i) = stage_system%x(i)
        end do
      end if
    end do
    call solve_quadratures(trial%lanes, trial%components, trial%states, gamma, trial%h, stage_system%dfdy, r, k)
  end subroutine solve

  !> The rows k_w / gamma - h dfw/dy k_y = r_w.
  pure subroutine solve_quadratures(lanes, components, states, gamma, h, dfdy, r, k)
    integer, intent(in) :: lanes, components, states
    real(wp), intent(in) :: gamma
    real(wp), intent(in) :: h(lanes), dfdy(lanes, components, states), r(lanes, components)
    real(wp), intent(inout) :: k(lanes, components)
    integer :: lane, row, state

    do row = states + 1, components
      do lane = 1, lanes
        k(lane, row) = 0.0_wp
      end do
      do state = 1, states
        do lane = 1, lanes
          k(lane, row) = k(lane, row) + dfdy(lane, row, state) * k(lane, state)
        end do
      end do
      do lane = 1, lanes
        k(lane, row) = gamma * (r(lane, row) + h(lane) * k(lane, row))
      end do
    end do
  end subroutine solve_quadratures

end module nocdyn_stage_systems
