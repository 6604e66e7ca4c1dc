!> Attempts of a block whose lanes take steps of different kinds: one kind after the other, the other lanes not active meanwhile.
module nocdyn_mixed_attempt
  use nocdyn_kinds, only: wp
  use nocdyn_step_attempt, only: spread_steps, step_attempt_t
  implicit none (type, external)
  private

  public :: allocate_mixed_attempt, begin_kinds, select_lanes, keep_lanes, end_kinds

  type, public :: mixed_attempt_t
    private
    logical, allocatable :: active(:), selected(:)   !! lanes at the start of the attempt, lanes whose turn it is
    logical, allocatable :: succeeded(:)             !! lanes that have not failed so far
    real(wp), allocatable :: h(:)                    !! step sizes at the start [s]
    real(wp), allocatable :: y_new(:, :), error_estimate(:, :), low_order_estimate(:, :)   !! of lanes that had their turn
  end type mixed_attempt_t

contains

  !> Allocates the results of all lanes.
  subroutine allocate_mixed_attempt(mixed, lanes, columns)
    type(mixed_attempt_t), intent(out) :: mixed
    integer, intent(in) :: lanes, columns   !! of the state arrays

    allocate (mixed%active(lanes), mixed%selected(lanes), mixed%succeeded(lanes), source=.false.)
    allocate (mixed%h(lanes), source=0.0_wp)
    allocate (mixed%y_new(lanes, columns), mixed%error_estimate(lanes, columns), mixed%low_order_estimate(lanes, columns), &
              source=0.0_wp)
  end subroutine allocate_mixed_attempt

  !> Begins an attempt of several kinds.
  pure subroutine begin_kinds(mixed, attempt)
    type(mixed_attempt_t), intent(inout) :: mixed
    type(step_attempt_t), intent(in) :: attempt

    mixed%active(:) = attempt%active
    mixed%succeeded(:) = attempt%active
    mixed%h(:) = attempt%h
  end subroutine begin_kinds

  !> Activates only the lanes of one kind.
  pure subroutine select_lanes(mixed, attempt, are_of_kind)
    type(mixed_attempt_t), intent(inout) :: mixed
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: are_of_kind(:)   !! [lanes]
    integer :: lane

    do lane = 1, attempt%lanes
      mixed%selected(lane) = mixed%active(lane) .and. are_of_kind(lane)
      attempt%active(lane) = mixed%selected(lane)
      attempt%h(lane) = merge(mixed%h(lane), 0.0_wp, mixed%selected(lane))
    end do
    call spread_steps(attempt)
  end subroutine select_lanes

  !> Keeps the results of the lanes whose turn it was.
  pure subroutine keep_lanes(mixed, attempt, has_error, has_low_order_error)
    type(mixed_attempt_t), intent(inout) :: mixed
    type(step_attempt_t), intent(in) :: attempt
    logical, intent(in) :: has_error, has_low_order_error   !! whether their kind estimates these errors; else they are 0
    integer :: lane

    do lane = 1, attempt%lanes
      if (.not. mixed%selected(lane)) cycle
      mixed%succeeded(lane) = attempt%active(lane)
      mixed%y_new(lane, :) = attempt%y_new(lane, :)
      mixed%error_estimate(lane, :) = merge(attempt%error_estimate(lane, :), 0.0_wp, has_error)
      mixed%low_order_estimate(lane, :) = merge(attempt%low_order_estimate(lane, :), 0.0_wp, has_low_order_error)
    end do
  end subroutine keep_lanes

  !> Puts the results of all lanes into the attempt.
  pure subroutine end_kinds(mixed, attempt)
    type(mixed_attempt_t), intent(in) :: mixed
    type(step_attempt_t), intent(inout) :: attempt

    attempt%active(:) = mixed%succeeded
    attempt%h(:) = merge(mixed%h, 0.0_wp, mixed%succeeded)
    call spread_steps(attempt)
    attempt%y_new(:, :) = mixed%y_new
    attempt%error_estimate(:, :) = mixed%error_estimate
    attempt%low_order_estimate(:, :) = mixed%low_order_estimate
  end subroutine end_kinds

end module nocdyn_mixed_attempt
