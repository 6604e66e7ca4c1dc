!> One attempted step of every lane of a block: what the steppers read and what they leave.
module nocdyn_trial
  use nocdyn_finite, only: all_finite, is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: evaluation_fine, evaluation_give_up, evaluation_shorten, system_t
  implicit none (type, external)
  private

  public :: allocate_trial, set_out, evaluate, evaluate_start, check_state, check_deviation, park

  integer, parameter, public :: trial_fine = evaluation_fine
  integer, parameter, public :: trial_shorten = evaluation_shorten
  integer, parameter, public :: trial_give_up = evaluation_give_up
  integer, parameter, public :: trial_not_finite = 3

  !> A lane that fails is parked: its step becomes zero, so that it stays at its good state y while the others go on.
  type, public :: trial_t
    integer :: lanes
    integer :: states
    integer :: components                          !! states and quadratures
    real(wp), allocatable :: t(:)                  !! start of the step
    real(wp), allocatable :: h(:)                  !! size of the step, 0 for a lane that is not working
    real(wp), allocatable :: h_spread(:, :)        !! h of each lane, repeated for every component
    real(wp), allocatable :: y(:, :)               !! state at t
    real(wp), allocatable :: y_new(:, :)           !! state at t + h
    real(wp), allocatable :: deviation(:, :)       !! y_new minus the embedded solution
    real(wp), allocatable :: slope(:, :)           !! f(t, y) where the integration started
    logical, allocatable :: working(:)             !! lanes that take part and have not failed
    integer, allocatable :: verdict(:)             !! trial_... of each lane
    integer, allocatable :: culprit(:)             !! component that is not finite, 0 if there is none
    integer, allocatable :: status(:)              !! answers to the last evaluation
    integer, allocatable :: suspect(:)             !! component that is not finite in the last evaluation
    integer, allocatable :: evaluations(:)         !! counts of the whole integration
    integer, allocatable :: jacobians(:)
    integer, allocatable :: factorisations(:)
  end type trial_t

contains

  !> Room for one attempted step of every lane of the system.
  subroutine allocate_trial(trial, system)
    type(trial_t), intent(out) :: trial
    class(system_t), intent(in) :: system

    associate (lanes => system%lanes, components => system%states + system%quadratures)
      trial%lanes = lanes
      trial%states = system%states
      trial%components = components
      allocate (trial%t(lanes), trial%h(lanes), source=0.0_wp)
      allocate (trial%h_spread(lanes, components), trial%y(lanes, components), trial%y_new(lanes, components), &
                trial%deviation(lanes, components), trial%slope(lanes, components), source=0.0_wp)
      allocate (trial%working(lanes), source=.true.)
      allocate (trial%verdict(lanes), trial%culprit(lanes), trial%status(lanes), trial%suspect(lanes), &
                trial%evaluations(lanes), trial%jacobians(lanes), trial%factorisations(lanes), source=0)
    end associate
  end subroutine allocate_trial

  !> A new attempt of the lanes that are `working`, with the step sizes `h`.
  pure subroutine set_out(trial)
    type(trial_t), intent(inout) :: trial
    integer :: component

    trial%verdict(:) = trial_fine
    do component = 1, trial%components
      trial%h_spread(:, component) = trial%h
    end do
  end subroutine set_out

  !> dydt = f(t, y) within the step; lanes that cannot go on are parked.
  subroutine evaluate(trial, system, t, y, dydt)
    type(trial_t), intent(inout) :: trial
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), contiguous, intent(inout) :: dydt(:, :)
    integer :: lane

    do lane = 1, trial%lanes
      if (trial%working(lane)) trial%evaluations(lane) = trial%evaluations(lane) + 1
    end do
    trial%status(:) = evaluation_fine
    call system%derivative(t, y, dydt, trial%status)
    if (all(trial%status == evaluation_fine)) then
      if (all_finite(size(dydt), dydt)) return
    end if
    call clear_failures(trial%status, trial%suspect, dydt)
    call park_failures(trial)
  end subroutine evaluate

  !> slope = f(t, y) at the start of the step, new only for the lanes that moved since the last call.
  subroutine evaluate_start(trial, system, moved, slope)
    type(trial_t), intent(inout) :: trial
    class(system_t), intent(inout) :: system
    logical, intent(in) :: moved(:)
    real(wp), contiguous, intent(inout) :: slope(:, :)
    integer :: lane

    do lane = 1, trial%lanes
      if (trial%working(lane) .and. moved(lane)) trial%evaluations(lane) = trial%evaluations(lane) + 1
    end do
    trial%status(:) = evaluation_fine
    call system%derivative(trial%t, trial%y, slope, trial%status)
    if (all(trial%status == evaluation_fine)) then
      if (all_finite(size(slope), slope)) return
    end if
    call clear_failures(trial%status, trial%suspect, slope)
    call park_failures(trial)
  end subroutine evaluate_start

  !> Turns values that are not finite into a status, and clears the values of the lanes that failed.
  pure subroutine clear_failures(status, suspect, values)
    integer, intent(inout) :: status(:)
    integer, intent(inout) :: suspect(:)   !! component that is not finite, of the lanes where one is
    real(wp), contiguous, intent(inout) :: values(:, :)
    integer :: lane, component

    do lane = 1, size(status)
      if (status(lane) == evaluation_fine) then
        do component = 1, size(values, 2)
          if (is_finite(values(lane, component))) cycle
          status(lane) = trial_not_finite
          suspect(lane) = component
          exit
        end do
      end if
      if (status(lane) /= evaluation_fine) values(lane, :) = 0.0_wp
    end do
  end subroutine clear_failures

  !> Parks the lanes whose status is not fine.
  pure subroutine park_failures(trial)
    type(trial_t), intent(inout) :: trial
    integer :: lane

    do lane = 1, trial%lanes
      if (trial%status(lane) == evaluation_fine) cycle
      call park(trial, lane, trial%status(lane), merge(trial%suspect(lane), 0, trial%status(lane) == trial_not_finite))
    end do
  end subroutine park_failures

  !> Parks the lanes where y_new overflowed.
  pure subroutine check_state(trial)
    type(trial_t), intent(inout) :: trial

    if (all_finite(size(trial%y_new), trial%y_new)) return
    trial%status(:) = evaluation_fine
    call clear_failures(trial%status, trial%suspect, trial%y_new)
    call park_failures(trial)
  end subroutine check_state

  !> Parks the lanes where the deviation overflowed.
  pure subroutine check_deviation(trial)
    type(trial_t), intent(inout) :: trial

    if (all_finite(size(trial%deviation), trial%deviation)) return
    trial%status(:) = evaluation_fine
    call clear_failures(trial%status, trial%suspect, trial%deviation)
    call park_failures(trial)
  end subroutine check_deviation

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
    trial%h(lane) = 0.0_wp
    trial%h_spread(lane, :) = 0.0_wp
  end subroutine park

end module nocdyn_trial
