!> Events of an observer: roots of its functions g(t, y) on the dense output.
!>
!> Reaching zero is an event, leaving it is not: a function that is zero at the start, or stays zero for a while, causes no event
!> by leaving zero.
module nocdyn_events
  use nocdyn_dense_output, only: dense_output_t
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: event_falling, event_rising, observer_t
  use nocdyn_root_functions, only: allocate_root_functions, find_root, part_bracket, root_functions_t, scan_step, sign_of
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: allocate_events, find_events

  type, public :: events_t
    integer :: found = 0                    !! number of events in the last step of the lane that was searched
    integer, allocatable :: which(:)        !! index of the event function of each event, in the order of the times
    real(wp), allocatable :: theta(:)       !! of each event
    integer, allocatable, private :: directions(:)
    type(root_functions_t) :: roots
  end type events_t

contains

  !> Allocates the data of the event functions of an observer.
  subroutine allocate_events(events, observer, degree, attempt)
    type(events_t), intent(out) :: events
    class(observer_t), intent(in) :: observer   !! with `directions`
    integer, intent(in) :: degree               !! of the dense output
    type(step_attempt_t), intent(in) :: attempt

    allocate (events%directions, source=observer%directions)
    associate (functions => size(observer%directions))
      call allocate_root_functions(events%roots, functions, .false., degree, attempt)
      allocate (events%which(events%roots%parts * functions), source=0)
      allocate (events%theta(events%roots%parts * functions), source=0.0_wp)
    end associate
  end subroutine allocate_events

  !> Finds the events of a lane in its last step, in the order of their times.
  subroutine find_events(events, system, observer, dense, theta_end)
    type(events_t), intent(inout) :: events
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp), intent(in) :: theta_end              !! end of the step: 1, or less where it has been cut
    real(wp) :: root
    integer :: function, part
    logical :: is_event

    events%found = 0
    call scan_step(events%roots, system, observer, dense, theta_end)
    do part = 1, events%roots%parts
      do function = 1, size(events%directions)
        associate (side => events%roots%side(dense%lane, function), g => events%roots%values(function, part))
          if (.not. is_finite(g)) cycle
          ! whether a function with the sign `side` has reached or passed zero in the direction that counts
          is_event = side /= 0 .and. sign_of(g) /= side
          if (events%directions(function) == event_rising) is_event = is_event .and. side < 0
          if (events%directions(function) == event_falling) is_event = is_event .and. side > 0
          if (is_event) then
            call find_root(events%roots, system, observer, dense, part_bracket(events%roots, function, part, theta_end), root)
            call insert(events, function, root)
          end if
          side = sign_of(g)
        end associate
      end do
    end do
  end subroutine find_events

  !> Inserts an event after those that happen before it.
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
