!> The linear systems of the stages of a Rosenbrock step, one in each lane: (1/gamma - h J) k = r.
module nocdyn_stage_systems
  use nocdyn_finite, only: all_finite, is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_pattern_entries, only: entries_in_rows, entries_t, message_length, pattern_error
  use nocdyn_stage_matrix, only: choose_stage_matrix, stage_matrix_t
  use nocdyn_step_attempt, only: attempt_not_finite, attempt_recoverable, disable_lane, step_attempt_t
  use nocdyn_system, only: evaluation_ok, pattern_t, system_t
  implicit none (type, external)
  private

  public :: allocate_stage_system, renew_jacobian, factor, solve

  !> Nothing depends on the quadratures, so J is block triangular: only the block of the states is factored, and the rows of the
  !> quadratures follow from the solution for the states.
  type, public :: stage_system_t
    real(wp), allocatable :: dfdt(:, :)                     !! [lanes, components]
    real(wp), allocatable :: dfdy(:, :)                     !! [lanes, positions]
    type(stage_matrix_t) :: matrix                          !! of the states, if there are any
    type(entries_t), private :: quadratures                 !! entries of the Jacobian in the rows of quadratures
  end type stage_system_t

contains

  !> Allocates the Jacobian and the factors of every lane. Stops if the system's pattern is wrong.
  subroutine allocate_stage_system(stage_system, system)
    type(stage_system_t), intent(out) :: stage_system
    class(system_t), intent(in) :: system
    type(pattern_t) :: pattern
    character(len=message_length) :: pattern_message

    pattern = system%jacobian_pattern()
    pattern_message = pattern_error(pattern, system%states, system%quadratures)
    if (pattern_message /= '') error stop 'nocdyn_stage_systems: ' // pattern_message
    associate (lanes => system%lanes, states => system%states, components => system%states + system%quadratures)
      allocate (stage_system%dfdy(lanes, size(pattern%row)), source=0.0_wp)
      allocate (stage_system%dfdt(lanes, components), source=0.0_wp)
      stage_system%quadratures = entries_in_rows(pattern, states + 1, components)
      if (states > 0) call choose_stage_matrix(entries_in_rows(pattern, 1, states), lanes, states, stage_system%matrix)
    end associate
  end subroutine allocate_stage_system

  !> Evaluates the Jacobian and df/dt at the start of the step. Disables lanes where that fails.
  subroutine renew_jacobian(stage_system, system, attempt)
    type(stage_system_t), intent(inout) :: stage_system
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: lane

    call system%jacobian(attempt%t, attempt%y, stage_system%dfdy, stage_system%dfdt, attempt%rhs_status)
    associate (dfdy => stage_system%dfdy, dfdt => stage_system%dfdt)
      if (all_finite(size(dfdy), dfdy) .and. all_finite(size(dfdt), dfdt) .and. all(attempt%rhs_status == evaluation_ok)) return
      do lane = 1, attempt%lanes
        if (attempt%rhs_status(lane) == evaluation_ok) then
          if (all(is_finite(dfdy(lane, :))) .and. all(is_finite(dfdt(lane, :)))) cycle
          attempt%rhs_status(lane) = attempt_not_finite
        end if
        dfdy(lane, :) = 0.0_wp
        dfdt(lane, :) = 0.0_wp
        call disable_lane(attempt, lane, attempt%rhs_status(lane), 0)
        attempt%rhs_status(lane) = evaluation_ok
      end do
    end associate
  end subroutine renew_jacobian

  !> Factors the matrices for the step sizes of this attempt. Disables lanes with a singular matrix: they take a shorter step.
  subroutine factor(stage_system, attempt, gamma)
    type(stage_system_t), intent(inout) :: stage_system
    type(step_attempt_t), intent(inout) :: attempt
    real(wp), intent(in) :: gamma   !! of the tableau
    logical :: singular
    integer :: lane

    if (attempt%states == 0) return
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      call stage_system%matrix%factor(lane, 1 / gamma, attempt%h(lane), stage_system%dfdy, singular)
      attempt%factorisations(lane) = attempt%factorisations(lane) + 1
      if (singular) call disable_lane(attempt, lane, attempt_recoverable, 0)
    end do
  end subroutine factor

  !> Solves for k; sets it to zero in the lanes that are not active.
  subroutine solve(stage_system, attempt, gamma, r, k)
    type(stage_system_t), intent(inout) :: stage_system
    type(step_attempt_t), intent(in) :: attempt
    real(wp), intent(in) :: gamma                    !! of the tableau
    real(wp), contiguous, intent(in) :: r(:, :)      !! [lanes, components]
    real(wp), contiguous, intent(inout) :: k(:, :)   !! [lanes, components]
    integer :: lane, p, w

    if (attempt%states > 0) then
      do lane = 1, attempt%lanes
        if (attempt%active(lane)) call stage_system%matrix%solve(lane, r, k)
      end do
    end if
    if (attempt%components > attempt%states) then
      ! solves the rows of the quadratures: k_w / gamma - h dfw/dy k_y = r_w
      k(:, attempt%states + 1:attempt%components) = 0.0_wp
      associate (row => stage_system%quadratures%row, column => stage_system%quadratures%column, &
                 position => stage_system%quadratures%position, dfdy => stage_system%dfdy)
        do p = 1, size(position)
          do lane = 1, attempt%lanes
            k(lane, row(p)) = k(lane, row(p)) + dfdy(lane, position(p)) * k(lane, column(p))
          end do
        end do
      end associate
      do w = attempt%states + 1, attempt%components
        do lane = 1, attempt%lanes
          k(lane, w) = gamma * (r(lane, w) + attempt%h(lane) * k(lane, w))
        end do
      end do
    end if
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) k(lane, :) = 0.0_wp
    end do
  end subroutine solve

end module nocdyn_stage_systems
