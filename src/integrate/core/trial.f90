!> One attempted step of every lane of a block: what the steppers read and what they leave.
module nocdyn_trial
  use nocdyn_combinations, only: padded_columns, strip
  use nocdyn_finite, only: all_finite, is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_other
  use nocdyn_system, only: evaluation_fine, evaluation_give_up, evaluation_shorten, system_t
  implicit none (type, external)
  private

  public :: allocate_trial, set_out, spread_steps, evaluate, evaluate_finite, evaluate_start, count_evaluations
  public :: park, park_infinities

  integer, parameter, public :: trial_fine = evaluation_fine
  integer, parameter, public :: trial_shorten = evaluation_shorten
  integer, parameter, public :: trial_give_up = evaluation_give_up
  integer, parameter, public :: trial_not_finite = 3

  !> A lane that fails is parked: its step becomes zero, so that it stays at its good state y while the others go on.
  type, public :: trial_t
    integer :: lanes
    integer :: states
    integer :: components                          !! states and quadratures
    integer :: length                              !! of the state arrays: whole vectors, the rest after the components is 0
    integer :: h_length                            !! of h_spread: the same, of one lane a strip at most
    real(wp), allocatable :: t(:)                  !! start of the step
    real(wp), allocatable :: h(:)                  !! size of the step, 0 for a lane that is not working
    real(wp), allocatable :: h_spread(:, :)        !! h of each lane, repeated
    real(wp), allocatable :: y(:, :)               !! state at t, shape [lanes, padded columns] as all these
    real(wp), allocatable :: y_new(:, :)           !! state at t + h
    real(wp), allocatable :: deviation(:, :)       !! y_new minus the embedded solution
    real(wp), allocatable :: coarse_deviation(:, :)   !! the same of a coarser one, for methods with two estimates
    real(wp), allocatable :: slope(:, :)           !! f(t, y) when a lane was last started
    integer :: first_inside, last_inside           !! columns of the state whose course inside the step is of interest
    logical, allocatable :: working(:)             !! lanes that take part and have not failed
    logical :: has_coarse_deviation = .false.
    real(wp), allocatable :: scratch(:)            !! work space, shape [lanes]
    logical, allocatable :: implicit(:)            !! lanes that an implicit method moves
    integer, allocatable :: error_order(:)         !! of the method that moves the lane
    real(wp), allocatable :: most_growth(:)        !! of its step size
    integer, allocatable :: verdict(:)             !! trial_... of each lane
    integer, allocatable :: culprit(:)             !! component that is not finite, 0 if there is none
    integer, allocatable :: status(:)              !! answers to the last evaluation; evaluation_fine between evaluations
    integer :: made = 0                            !! evaluations that have not been counted yet
    integer, allocatable :: evaluations(:)         !! counts of the whole integration
    integer, allocatable :: jacobians(:)
    integer, allocatable :: factorisations(:)
  end type trial_t

contains

  !> Room for one attempted step of every lane of the system.
  subroutine allocate_trial(trial, system)
    type(trial_t), intent(out) :: trial
    class(system_t), intent(in) :: system
    integer :: columns

    associate (lanes => system%lanes, components => system%states + system%quadratures)
      columns = padded_columns(lanes, components)
      trial%lanes = lanes
      trial%states = system%states
      trial%components = components
      trial%length = lanes * columns
      trial%first_inside = 1
      trial%last_inside = columns
      allocate (trial%t(lanes), trial%h(lanes), trial%scratch(lanes), trial%most_growth(lanes), source=0.0_wp)
      trial%h_length = merge(min(columns, strip), lanes * columns, lanes == 1)
      allocate (trial%h_spread(lanes, trial%h_length / lanes), source=0.0_wp)
      allocate (trial%y(lanes, columns), trial%y_new(lanes, columns), trial%deviation(lanes, columns), &
                trial%coarse_deviation(lanes, columns), trial%slope(lanes, columns), source=0.0_wp)
      allocate (trial%working(lanes), source=.true.)
      allocate (trial%implicit(lanes), source=.false.)
      allocate (trial%error_order(lanes), trial%verdict(lanes), trial%culprit(lanes), trial%status(lanes), &
                trial%evaluations(lanes), trial%jacobians(lanes), trial%factorisations(lanes), source=0)
    end associate
  end subroutine allocate_trial

  !> A new attempt of the lanes that are `working`, with the step sizes `h`.
  pure subroutine set_out(trial)
    type(trial_t), intent(inout) :: trial

    trial%verdict(:) = trial_fine
    call spread_steps(trial)
  end subroutine set_out

  !> Repeats the step size of each lane for all components.
  pure subroutine spread_steps(trial)
    type(trial_t), intent(inout) :: trial
    integer :: column

    if (trial%lanes == 1) then
      trial%h_spread(:, :) = trial%h(1)
    else
      do column = 1, size(trial%h_spread, 2)
        trial%h_spread(:, column) = trial%h
      end do
    end if
  end subroutine spread_steps

  !> dydt = f(t, y) within the step; lanes that cannot go on are parked. Values that are not finite are left to the caller.
  subroutine evaluate(trial, system, t, y, dydt)
    type(trial_t), intent(inout) :: trial
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t(trial%lanes)
    real(wp), intent(in) :: y(trial%length)
    real(wp), intent(inout) :: dydt(trial%length)

    trial%made = trial%made + 1
    call system%derivative(t, y, dydt, trial%status)
    if (trial%lanes == 1) then
      if (trial%status(1) /= evaluation_fine) call park_failures(trial, dydt)
    else if (any_other(trial%lanes, trial%status, evaluation_fine)) then
      call park_failures(trial, dydt)
    end if
  end subroutine evaluate

  !> The same, and lanes whose values are not finite are parked too.
  subroutine evaluate_finite(trial, system, t, y, dydt)
    type(trial_t), intent(inout) :: trial
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t(trial%lanes)
    real(wp), intent(in) :: y(trial%length)
    real(wp), intent(inout) :: dydt(trial%length)

    call evaluate(trial, system, t, y, dydt)
    if (.not. all_finite(trial%length, dydt)) call park_infinities(trial, dydt)
  end subroutine evaluate_finite

  !> slope = f(t, y) at the start of the step, new only for the lanes that moved since the last call.
  subroutine evaluate_start(trial, system, moved, slope)
    type(trial_t), intent(inout) :: trial
    class(system_t), intent(inout) :: system
    logical, intent(in) :: moved(:)
    real(wp), intent(inout) :: slope(trial%length)
    integer :: lane

    do lane = 1, trial%lanes
      if (trial%working(lane) .and. moved(lane)) trial%evaluations(lane) = trial%evaluations(lane) + 1
    end do
    call system%derivative(trial%t, trial%y, slope, trial%status)
    if (any(trial%status /= evaluation_fine)) call park_failures(trial, slope)
    if (.not. all_finite(trial%length, slope)) call park_infinities(trial, slope)
  end subroutine evaluate_start

  !> Counts the evaluations made for the lanes that are still working.
  pure subroutine count_evaluations(trial)
    type(trial_t), intent(inout) :: trial
    integer :: lane

    if (trial%lanes == 1) then
      if (trial%working(1)) trial%evaluations(1) = trial%evaluations(1) + trial%made
    else if (all_true(trial%lanes, trial%working)) then
      trial%evaluations(:) = trial%evaluations + trial%made
    else
      do lane = 1, trial%lanes
        if (trial%working(lane)) trial%evaluations(lane) = trial%evaluations(lane) + trial%made
      end do
    end if
    trial%made = 0
  end subroutine count_evaluations

  !> Parks the lanes whose status is not fine, and clears their values and the status.
  pure subroutine park_failures(trial, values)
    type(trial_t), intent(inout) :: trial
    real(wp), intent(inout) :: values(trial%lanes, trial%components)
    integer :: lane

    do lane = 1, trial%lanes
      if (trial%status(lane) == evaluation_fine) cycle
      values(lane, :) = 0.0_wp
      call park(trial, lane, trial%status(lane), 0)
      trial%status(lane) = evaluation_fine
    end do
  end subroutine park_failures

  !> Parks the lanes with values that are not finite, and clears these values.
  pure subroutine park_infinities(trial, values)
    type(trial_t), intent(inout) :: trial
    real(wp), intent(inout) :: values(trial%lanes, trial%components)
    integer :: component, lane

    do lane = 1, trial%lanes
      do component = 1, trial%components
        if (is_finite(values(lane, component))) cycle
        values(lane, :) = 0.0_wp
        call park(trial, lane, trial_not_finite, component)
        exit
      end do
    end do
  end subroutine park_infinities

  !> Takes a lane out of this step; the first verdict on it stands.
  pure subroutine park(trial, lane, verdict, culprit)
    type(trial_t), intent(inout) :: trial
    integer, intent(in) :: lane
    integer, intent(in) :: verdict   !! trial_shorten, trial_give_up or trial_not_finite
    integer, intent(in) :: culprit

    if (.not. trial%working(lane)) return
    trial%working(lane) = .false.
    trial%verdict(lane) = verdict
    trial%culprit(lane) = culprit
    trial%evaluations(lane) = trial%evaluations(lane) + trial%made
    trial%h(lane) = 0.0_wp
    trial%h_spread(lane, :) = 0.0_wp
  end subroutine park

end module nocdyn_trial
