!> The step attempt of a block: the workspace that steppers read and write, one step per lane.
module nocdyn_step_attempt
  use nocdyn_finite, only: all_finite, is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_differs
  use nocdyn_stage_sums, only: large_tile, padded_columns
  use nocdyn_system, only: evaluation_fatal, evaluation_ok, evaluation_recoverable, system_t
  implicit none (type, external)
  private

  public :: allocate_step_attempt, begin_attempt, spread_steps, evaluate, evaluate_finite, evaluate_start, count_evaluations
  public :: disable_lane, disable_non_finite_lanes, advance

  ! Status of a lane's step attempt.
  integer, parameter, public :: attempt_ok = evaluation_ok
  integer, parameter, public :: attempt_recoverable = evaluation_recoverable   !! repeat with a shorter step
  integer, parameter, public :: attempt_fatal = evaluation_fatal               !! no shorter step will help
  integer, parameter, public :: attempt_not_finite = 3                         !! a value is infinite or NaN

  !> A lane that fails is disabled: its step size becomes zero, so that it keeps its state y while the other lanes go on.
  type, public :: step_attempt_t
    integer :: lanes, states
    integer :: components                               !! states and quadratures
    integer :: length                                   !! of a state array: whole vectors, with zeros after the components
    integer :: h_length                                 !! of h_spread: `length`, of one lane at most `large_tile`
    real(wp), allocatable :: t(:)                       !! start of the step [s]
    real(wp), allocatable :: h(:)                       !! step size [s], 0 for a lane that is not active
    real(wp), allocatable :: h_spread(:, :)             !! h of each lane, repeated for every component
    real(wp), allocatable :: y(:, :)                    !! state at t, [lanes, padded columns] as are the following arrays
    real(wp), allocatable :: y_new(:, :)                !! state at t + h
    real(wp), allocatable :: error_estimate(:, :)       !! y_new minus the embedded solution
    real(wp), allocatable :: low_order_estimate(:, :)   !! y_new minus a solution of lower order, for methods with two estimates
    real(wp), allocatable :: slope(:, :)                !! f(t, y) where a lane was last started
    integer :: first_dense, last_dense                  !! columns of the state whose dense output is needed
    logical, allocatable :: active(:)                   !! lanes that take part and have not failed
    logical :: has_low_order_estimate = .false.
    real(wp), allocatable :: scratch(:)                 !! work space, [lanes]
    logical, allocatable :: implicit(:)                 !! whether an implicit method takes the lane's step
    integer, allocatable :: error_order(:)              !! of the method that takes the lane's step
    integer, allocatable :: degree(:)                   !! of its dense output
    real(wp), allocatable :: max_growth(:)              !! of the step size, by that method
    integer, allocatable :: step_status(:)              !! attempt_... of each lane
    integer, allocatable :: component(:)                !! component that is not finite, 0 if there is none
    integer, allocatable :: rhs_status(:)               !! status of the last evaluation; `evaluation_ok` between evaluations
    integer :: uncounted = 0                            !! evaluations not yet added to `evaluations`
    integer, allocatable :: evaluations(:)              !! counts over the whole integration, [lanes]
    integer, allocatable :: jacobians(:), factorisations(:)
  end type step_attempt_t

contains

  !> Allocates the arrays for the lanes of a system.
  subroutine allocate_step_attempt(attempt, system)
    type(step_attempt_t), intent(out) :: attempt
    class(system_t), intent(in) :: system
    integer :: columns

    associate (lanes => system%lanes, components => system%states + system%quadratures)
      columns = padded_columns(lanes, components)
      attempt%lanes = lanes
      attempt%states = system%states
      attempt%components = components
      attempt%length = lanes * columns
      attempt%first_dense = 1
      attempt%last_dense = columns
      allocate (attempt%t(lanes), attempt%h(lanes), attempt%scratch(lanes), attempt%max_growth(lanes), source=0.0_wp)
      attempt%h_length = merge(min(columns, large_tile), lanes * columns, lanes == 1)
      allocate (attempt%h_spread(lanes, attempt%h_length / lanes), source=0.0_wp)
      allocate (attempt%y(lanes, columns), attempt%y_new(lanes, columns), attempt%error_estimate(lanes, columns), &
                attempt%low_order_estimate(lanes, columns), attempt%slope(lanes, columns), source=0.0_wp)
      allocate (attempt%active(lanes), source=.true.)
      allocate (attempt%implicit(lanes), source=.false.)
      allocate (attempt%error_order(lanes), attempt%degree(lanes), attempt%step_status(lanes), attempt%component(lanes), &
                attempt%rhs_status(lanes), attempt%evaluations(lanes), attempt%jacobians(lanes), &
                attempt%factorisations(lanes), source=0)
    end associate
  end subroutine allocate_step_attempt

  !> Starts an attempt of the lanes that are `active`, with the step sizes `h`.
  pure subroutine begin_attempt(attempt)
    type(step_attempt_t), intent(inout) :: attempt

    attempt%step_status(:) = attempt_ok
    call spread_steps(attempt)
  end subroutine begin_attempt

  !> Repeats the step size of each lane for all components.
  pure subroutine spread_steps(attempt)
    type(step_attempt_t), intent(inout) :: attempt
    integer :: column

    if (attempt%lanes == 1) then
      attempt%h_spread(:, :) = attempt%h(1)
    else
      do column = 1, size(attempt%h_spread, 2)
        attempt%h_spread(:, column) = attempt%h
      end do
    end if
  end subroutine spread_steps

  !> dydt = f(t, y) within the step. Disables lanes whose status is not `evaluation_ok`; does not look for values that are not
  !> finite.
  subroutine evaluate(attempt, system, t, y, dydt)
    type(step_attempt_t), intent(inout) :: attempt
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t(attempt%lanes)   !! time of each lane [s]
    real(wp), intent(in) :: y(attempt%length)   !! [lanes, padded columns]
    real(wp), intent(inout) :: dydt(attempt%length)   !! [lanes, padded columns]

    attempt%uncounted = attempt%uncounted + 1
    call system%derivative(t, y, dydt, attempt%rhs_status)
    if (any_differs(attempt%lanes, attempt%rhs_status, evaluation_ok)) call disable_failed_lanes(attempt, dydt)
  end subroutine evaluate

  !> Evaluates the right-hand side, and disables lanes whose values are not finite.
  subroutine evaluate_finite(attempt, system, t, y, dydt)
    type(step_attempt_t), intent(inout) :: attempt
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t(attempt%lanes)   !! time of each lane [s]
    real(wp), intent(in) :: y(attempt%length)   !! [lanes, padded columns]
    real(wp), intent(inout) :: dydt(attempt%length)   !! [lanes, padded columns]

    call evaluate(attempt, system, t, y, dydt)
    if (.not. all_finite(attempt%length, dydt)) call disable_non_finite_lanes(attempt, dydt)
  end subroutine evaluate_finite

  !> slope = f(t, y) at the start of the step; counted only for the lanes in `moved`.
  subroutine evaluate_start(attempt, system, moved, slope)
    type(step_attempt_t), intent(inout) :: attempt
    class(system_t), intent(inout) :: system
    logical, intent(in) :: moved(:)   !! lanes whose state has changed since the last call
    real(wp), intent(inout) :: slope(attempt%length)   !! [lanes, padded columns]
    integer :: lane

    do lane = 1, attempt%lanes
      if (attempt%active(lane) .and. moved(lane)) attempt%evaluations(lane) = attempt%evaluations(lane) + 1
    end do
    call system%derivative(attempt%t, attempt%y, slope, attempt%rhs_status)
    if (any(attempt%rhs_status /= evaluation_ok)) call disable_failed_lanes(attempt, slope)
    if (.not. all_finite(attempt%length, slope)) call disable_non_finite_lanes(attempt, slope)
  end subroutine evaluate_start

  !> Adds the evaluations since the last call to the counts of the active lanes.
  pure subroutine count_evaluations(attempt)
    type(step_attempt_t), intent(inout) :: attempt

    attempt%evaluations(:) = attempt%evaluations + merge(attempt%uncounted, 0, attempt%active)
    attempt%uncounted = 0
  end subroutine count_evaluations

  !> Disables the lanes whose last evaluation failed, and clears their values and that status.
  pure subroutine disable_failed_lanes(attempt, values)
    type(step_attempt_t), intent(inout) :: attempt
    real(wp), intent(inout) :: values(attempt%lanes, attempt%components)
    integer :: lane

    do lane = 1, attempt%lanes
      if (attempt%rhs_status(lane) == evaluation_ok) cycle
      values(lane, :) = 0.0_wp
      call disable_lane(attempt, lane, attempt%rhs_status(lane), 0)
      attempt%rhs_status(lane) = evaluation_ok
    end do
  end subroutine disable_failed_lanes

  !> Disables the lanes with values that are not finite, and clears these values.
  pure subroutine disable_non_finite_lanes(attempt, values)
    type(step_attempt_t), intent(inout) :: attempt
    real(wp), intent(inout) :: values(attempt%lanes, attempt%components)
    integer :: component, lane

    do lane = 1, attempt%lanes
      do component = 1, attempt%components
        if (is_finite(values(lane, component))) cycle
        values(lane, :) = 0.0_wp
        call disable_lane(attempt, lane, attempt_not_finite, component)
        exit
      end do
    end do
  end subroutine disable_non_finite_lanes

  !> Takes a lane out of this attempt. The first status of a lane is kept: later calls do nothing.
  pure subroutine disable_lane(attempt, lane, step_status, component)
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: lane
    integer, intent(in) :: step_status   !! attempt_recoverable, attempt_fatal or attempt_not_finite
    integer, intent(in) :: component     !! that is not finite, 0 if that is not why

    if (.not. attempt%active(lane)) return
    attempt%active(lane) = .false.
    attempt%step_status(lane) = step_status
    attempt%component(lane) = component
    attempt%evaluations(lane) = attempt%evaluations(lane) + attempt%uncounted
    attempt%h(lane) = 0.0_wp
    attempt%h_spread(lane, :) = 0.0_wp
  end subroutine disable_lane

  !> Takes the new values of accepted lanes; the new ones are not read any more.
  pure subroutine advance(accepted, values, new_values)
    logical, intent(in) :: accepted(:)                                  !! [lanes]
    real(wp), allocatable, intent(inout) :: values(:, :), new_values(:, :)   !! [lanes, any]
    real(wp), allocatable :: spare(:, :)
    integer :: i

    if (all_true(size(accepted), accepted)) then
      call move_alloc(values, spare)
      call move_alloc(new_values, values)
      call move_alloc(spare, new_values)
    else
      do i = 1, size(values, 2)
        values(:, i) = merge(new_values(:, i), values(:, i), accepted)
      end do
    end if
  end subroutine advance

end module nocdyn_step_attempt
