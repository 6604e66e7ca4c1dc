!> Roots of functions g(t, y), the events, on the solution inside the steps.
!>
!> The sign of each function is compared at the ends of a few equal parts of every step; a change of sign is followed to
!> the last bits of the time. Reaching zero counts as an event, leaving it does not, so that a function that is zero at
!> the start, or stays zero for a while, makes none by that.
module nocdyn_events
  use nocdyn_dense_output, only: dense_output_t, sample
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: event_falling, event_rising, observer_t
  use nocdyn_trial, only: trial_t
  implicit none (type, external)
  private

  public :: allocate_events, start_events, find_events

  integer, parameter :: least_parts = 4   !! of a step; more for solutions of higher degree, whose steps are longer

  type, public :: events_t
    integer, private :: parts = least_parts !! of a step
    integer :: found = 0                    !! events in the last step of the lane that was searched
    integer, allocatable :: which(:)        !! event functions, in the order of their times
    real(wp), allocatable :: theta(:)       !! places in the step
    integer, allocatable, private :: directions(:)
    integer, allocatable, private :: side(:, :)   !! sign of the last value, 0 after a zero; [lanes, functions]
    real(wp), allocatable, private :: last(:, :)  !! values at the end of the last step; [lanes, functions]
    real(wp), allocatable, private :: g(:)        !! values at the end of the present part
    real(wp), allocatable, private :: g_before(:) !! at its beginning
    real(wp), allocatable, private :: g_root(:)
    real(wp), allocatable, private :: y(:)        !! state at which the functions are taken
  end type events_t

contains

  !> Room for the event functions of an observer.
  subroutine allocate_events(events, observer, degree, trial)
    type(events_t), intent(out) :: events
    class(observer_t), intent(in) :: observer   !! with `directions`
    integer, intent(in) :: degree               !! of the solution inside the step
    type(trial_t), intent(in) :: trial

    events%parts = max(least_parts, degree / 2)
    allocate (events%directions, source=observer%directions)
    associate (functions => size(observer%directions))
      allocate (events%which(events%parts * functions), source=0)
      allocate (events%theta(events%parts * functions), source=0.0_wp)
      allocate (events%side(trial%lanes, functions), source=0)
      allocate (events%last(trial%lanes, functions), source=0.0_wp)
      allocate (events%g(functions), events%g_before(functions), events%g_root(functions), events%y(trial%components), &
                source=0.0_wp)
    end associate
  end subroutine allocate_events

  !> Takes the signs at the start of a lane.
  subroutine start_events(events, observer, trial, lane)
    type(events_t), intent(inout) :: events
    class(observer_t), intent(inout) :: observer
    type(trial_t), intent(in) :: trial
    integer, intent(in) :: lane

    events%y(:) = trial%y(lane, :trial%components)
    call observer%event_values(lane, trial%t(lane), events%y, events%g)
    events%last(lane, :) = events%g
    events%side(lane, :) = sign_of(events%g)
  end subroutine start_events

  !> Finds the events of a lane in its last step and puts them into order.
  subroutine find_events(events, observer, dense)
    type(events_t), intent(inout) :: events
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp) :: root, theta
    integer :: function, part

    events%found = 0
    events%g_before(:) = events%last(dense%lane, :)
    do part = 1, events%parts
      theta = real(part, wp) / events%parts
      call evaluate(observer, dense, theta, events%y, events%g)
      do function = 1, size(events%g)
        if (.not. is_finite(events%g(function))) cycle
        if (is_event(events%side(dense%lane, function), events%g(function), events%directions(function))) then
          call find_root(events, observer, dense, function, theta - 1.0_wp / events%parts, theta, root)
          call insert(events, function, root)
        end if
        events%side(dense%lane, function) = sign_of(events%g(function))
      end do
      events%g_before(:) = events%g
    end do
    events%last(dense%lane, :) = events%g
  end subroutine find_events

  elemental integer function sign_of(g)
    real(wp), intent(in) :: g

    sign_of = merge(1, 0, g > 0) - merge(1, 0, g < 0)
  end function sign_of

  !> Whether a function that was on `side` has come to zero or passed it, in the direction that counts.
  pure logical function is_event(side, g, direction)
    integer, intent(in) :: side, direction
    real(wp), intent(in) :: g

    is_event = side /= 0 .and. sign_of(g) /= side
    if (direction == event_rising) is_event = is_event .and. side < 0
    if (direction == event_falling) is_event = is_event .and. side > 0
  end function is_event

  !> The event functions at a place in the step.
  subroutine evaluate(observer, dense, theta, y, g)
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: theta
    real(wp), contiguous, intent(inout) :: y(:)   !! the state there
    real(wp), contiguous, intent(inout) :: g(:)

    call sample(dense, theta, y)
    call observer%event_values(dense%lane, dense%t + theta * dense%h, y, g)
  end subroutine evaluate

  !> Root of one function between the places `before` and `after`, to the spacing of the times there: the place where it is
  !> zero, or the first one found beyond its change of sign. T. R. Chandrupatla, Adv. Eng. Software 28 (1997) 145-149.
  subroutine find_root(events, observer, dense, function, before, after, root)
    type(events_t), intent(inout) :: events
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    integer, intent(in) :: function
    real(wp), intent(in) :: before, after
    real(wp), intent(out) :: root
    real(wp) :: a, b, c, ga, gb, gc   ! the newest place, the best one of the other sign, the one that they have replaced
    real(wp) :: fraction, least, tolerance, x

    tolerance = max(spacing(abs(dense%t) + dense%h) / dense%h, epsilon(before))
    a = after
    b = before
    ga = events%g(function)
    gb = events%g_before(function)
    fraction = 0.5_wp
    do while (abs(ga) > 0 .and. abs(b - a) > 2 * tolerance)
      x = a + fraction * (b - a)
      call evaluate(observer, dense, x, events%y, events%g_root)
      if (sign_of(events%g_root(function)) == sign_of(ga)) then
        c = a
        gc = ga
      else
        c = b
        gc = gb
        b = a
        gb = ga
      end if
      a = x
      ga = events%g_root(function)
      least = min(0.5_wp, tolerance / abs(b - a))
      fraction = min(1 - least, max(least, next_fraction(a, b, c, ga, gb, gc)))
    end do
    root = a
    if (abs(ga) > 0) root = max(a, b)
  end subroutine find_root

  !> Where to look next between a (0) and b (1): inverse quadratic interpolation where it can be trusted, else the middle.
  pure real(wp) function next_fraction(a, b, c, ga, gb, gc)
    real(wp), intent(in) :: a, b, c, ga, gb, gc   !! ga and gc differ from gb in sign, or a is the root
    real(wp) :: place, share

    next_fraction = 0.5_wp
    place = (a - b) / (c - b)
    share = (ga - gb) / (gc - gb)
    if (share**2 >= place .or. (1 - share)**2 >= 1 - place) return
    next_fraction = ga / (gb - ga) * (gc / (gb - gc)) + (c - a) / (b - a) * (ga / (gc - ga)) * (gb / (gc - gb))
  end function next_fraction

  !> Puts an event behind those that happen before it.
  pure subroutine insert(events, function, theta)
    type(events_t), intent(inout) :: events
    integer, intent(in) :: function
    real(wp), intent(in) :: theta
    integer :: i

    i = events%found
    do while (i > 0)
      if (events%theta(i) <= theta) exit
      events%theta(i + 1) = events%theta(i)
      events%which(i + 1) = events%which(i)
      i = i - 1
    end do
    events%theta(i + 1) = theta
    events%which(i + 1) = function
    events%found = events%found + 1
  end subroutine insert

end module nocdyn_events
