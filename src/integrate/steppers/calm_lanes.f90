!> Lanes that step by series and have nothing to decide: their steps are counted together, and their choices are left alone.
module nocdyn_calm_lanes
  use nocdyn_kinds, only: wp
  use nocdyn_method_choice, only: by_series, by_stages, by_systems, choice_t, count_steps, kind_data_t, near_limit, stiff_signs, &
    weak_sign
  implicit none (type, external)
  private

  public :: allocate_calm_lanes, begin_calm, end_calm, may_go_on, go_on

  !> What is counted, [lanes].
  type, public :: calm_lanes_t
    private
    integer, allocatable :: steps(:)          !! accepted steps without a decision, unless they show signs of stiffness
    integer, allocatable :: uncounted(:)      !! of these, those that have been made
    integer, allocatable :: signs(:)          !! as in `choice_t`, of implicit steps
    logical, allocatable :: is_in_doubt(:)    !! the same
    logical, allocatable :: waits(:)          !! whether signs lead to nothing yet
  end type calm_lanes_t

contains

  !> Allocates the counts of lanes that have not started.
  pure subroutine allocate_calm_lanes(calm, lanes)
    type(calm_lanes_t), intent(out) :: calm
    integer, intent(in) :: lanes

    allocate (calm%steps(lanes), calm%uncounted(lanes), calm%signs(lanes), source=0)
    allocate (calm%is_in_doubt(lanes), calm%waits(lanes), source=.false.)
  end subroutine allocate_calm_lanes

  !> Takes what is counted of a lane, after a decision.
  pure subroutine begin_calm(calm, lane, choice, data)
    type(calm_lanes_t), intent(inout) :: calm
    integer, intent(in) :: lane
    type(choice_t), intent(in) :: choice
    type(kind_data_t), intent(in) :: data

    calm%uncounted(lane) = 0
    calm%signs(lane) = choice%signs(by_systems)
    calm%is_in_doubt(lane) = choice%is_in_doubt
    calm%waits(lane) = choice%wait(by_systems) > 0
    associate (steps => calm%steps(lane))
      steps = 0
      if (choice%kind /= by_series .or. choice%before > 0) return
      steps = huge(steps)
      if (calm%waits(lane)) then
        steps = choice%wait(by_systems)
      else if (choice%is_in_doubt) then
        steps = choice%doubt
      end if
      if (data%tries(by_stages)) steps = min(steps, choice%wait(by_stages))
    end associate
  end subroutine begin_calm

  !> Gives it back, before a decision.
  pure subroutine end_calm(calm, lane, choice)
    type(calm_lanes_t), intent(inout) :: calm
    integer, intent(in) :: lane
    type(choice_t), intent(inout) :: choice

    if (calm%uncounted(lane) == 0) return
    call count_steps(choice, calm%uncounted(lane))
    choice%signs(by_systems) = calm%signs(lane)
    choice%is_in_doubt = calm%is_in_doubt(lane)
    calm%uncounted(lane) = 0
  end subroutine end_calm

  !> Whether no active lane has anything to decide before its next series is known.
  pure logical function may_go_on(calm, lanes, active, was_tried, has_moved)
    type(calm_lanes_t), intent(in) :: calm
    integer, intent(in) :: lanes
    logical, intent(in), dimension(lanes) :: active, was_tried, has_moved   !! as in `auto_stepper_t`
    integer :: lane

    may_go_on = .true.
    do lane = 1, lanes
      may_go_on = may_go_on .and. (.not. active(lane) .or. (calm%uncounted(lane) + 1 < calm%steps(lane) &
                                                            .and. (has_moved(lane) .or. .not. was_tried(lane))))
    end do
  end function may_go_on

  !> Whether the last steps and the next ones leave all active lanes without anything to decide; if so, counts the last ones.
  pure subroutine go_on(calm, data, lanes, active, has_moved, h, lambda, is_calm)
    type(calm_lanes_t), intent(inout) :: calm
    type(kind_data_t), intent(in) :: data
    integer, intent(in) :: lanes
    logical, intent(in) :: active(lanes), has_moved(lanes)   !! whether a lane takes part; whether its last step was accepted
    real(wp), intent(in) :: h(lanes), lambda(lanes)          !! next step size [s], dominant eigenvalue [1/s]
    logical, intent(inout) :: is_calm
    real(wp) :: near, weak
    integer :: lane

    near = near_limit * data%limit(by_series)
    weak = weak_sign * data%limit(by_series)
    do lane = 1, lanes
      is_calm = is_calm .and. (.not. active(lane) .or. calm%waits(lane) &
                               .or. (merge(calm%signs(lane) + 1, 0, h(lane) * lambda(lane) > near) < stiff_signs &
                                     .and. (calm%is_in_doubt(lane) .or. .not. h(lane) * lambda(lane) > weak)))
    end do
    if (.not. is_calm) return
    do lane = 1, lanes
      if (.not. (active(lane) .and. has_moved(lane))) cycle
      calm%uncounted(lane) = calm%uncounted(lane) + 1
      calm%signs(lane) = merge(calm%signs(lane) + 1, 0, h(lane) * lambda(lane) > near)
      calm%is_in_doubt(lane) = calm%is_in_doubt(lane) .or. h(lane) * lambda(lane) > weak
    end do
  end subroutine go_on

end module nocdyn_calm_lanes
