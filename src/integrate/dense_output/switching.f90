!> Switching of branches. Steps end where an indicator function falls through zero; there the system changes its branch.
module nocdyn_switching
  use, intrinsic :: iso_c_binding, only: c_int, c_loc
  use nocdyn_dense_output, only: batch, dense_output_t, sample, sample_lanes, strip
  use nocdyn_finite, only: is_finite
  use nocdyn_followed_crossings, only: find_followed_crossing, find_unsettled_lanes, followed_lanes_t, new_followed_lanes
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_root_functions, only: allocate_root_functions, sign_change_t, find_grazing, find_root, least_distance, &
    max_grazing_steps, part_bracket, part_end, parts_of, promising, root_functions_t, scan_step, set_start, sign_of
  use nocdyn_solver_status, only: count_crossing, integration_chattering, solver_status_t
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: allocate_switching, start_switching, scan_for_crossings, may_cross, find_crossing, cross_boundaries, &
    may_be_plain, describe_plain_crossings

  integer, parameter :: max_repeats = 100   ! crossings of one boundary without progress in time; more are chattering
  real(wp), parameter :: negligible = 1.0e-10_wp          ! of the duration: a shorter time between crossings is no progress
  real(wp), parameter :: no_time = -huge(1.0_wp)

  !> The indicators at the ends of the parts of a step, for all lanes of a block at once. Few lanes come near a boundary in a
  !> step; the others are left out of the search for crossings, which goes lane by lane.
  type :: block_scan_t
    logical :: is_used = .false.               !! whether the system evaluates its indicators for blocks
    logical, allocatable :: is_near(:)         !! whether a lane may cross a boundary in the step, [lanes]
    integer, allocatable :: parts(:)           !! of the step of each lane
    real(wp), allocatable :: g(:, :, :)        !! [lanes, functions, 0:parts]; part 0 stays from step to step
    real(wp), allocatable :: t(:)              !! [s], [lanes]
    real(wp), allocatable :: theta(:, :)       !! [lanes, batch]
    real(wp), allocatable :: y(:, :, :)        !! [lanes, padded columns, batch]
    type(followed_lanes_t) :: followed         !! where the system follows waves
  end type block_scan_t

  type, public :: switching_t
    integer(c_int), allocatable :: pending(:)              !! indicator that ended the last step of each lane, 0 if none did; less
                                                           !! than 0 where its branch has changed already
    real(wp), private :: least_progress
    real(wp), allocatable, private :: last_time(:)         !! of the last crossing of each lane [s]
    integer, allocatable, private :: repeats(:, :)         !! crossings since the lane made progress, [lanes, functions]
    type(root_functions_t), private :: roots
    type(block_scan_t), private :: scan
    real(wp), allocatable, private :: g(:)   !! indicators where a lane crosses, or at the first crossing so far
    real(wp), private :: known = -1.0_wp     !! theta of that crossing, -1 while they are not known there
    real(wp), allocatable, private :: y(:)
  end type switching_t

contains

  !> Allocates the data of the indicator functions of a system.
  subroutine allocate_switching(switching, system, degree, attempt, duration)
    type(switching_t), intent(out) :: switching
    class(system_t), intent(in) :: system
    integer, intent(in) :: degree      !! of the dense output
    type(step_attempt_t), intent(in) :: attempt
    real(wp), intent(in) :: duration   !! of the integration [s]

    switching%least_progress = negligible * duration
    allocate (switching%pending(attempt%lanes), source=0)
    allocate (switching%last_time(attempt%lanes), source=no_time)
    allocate (switching%repeats(attempt%lanes, system%switches), source=0)
    allocate (switching%g(system%switches), switching%y(attempt%components), source=0.0_wp)
    call allocate_root_functions(switching%roots, system%switches, .true., degree, attempt)
    switching%scan%is_used = system%has_block_indicators .and. system%lanes >= strip
    if (.not. switching%scan%is_used) return
    associate (lanes => attempt%lanes, scan => switching%scan)
      allocate (scan%is_near(lanes), source=.true.)
      if (system%follows_waves) scan%followed = new_followed_lanes(lanes, system%switches)
      allocate (scan%parts(lanes), source=1)
      allocate (scan%g(lanes, system%switches, 0:parts_of(degree)), scan%t(lanes), scan%theta(lanes, batch), &
                scan%y(lanes, size(attempt%y, 2), batch), source=0.0_wp)
    end associate
  end subroutine allocate_switching

  !> Whether a system may find crossings in plain steps: the way of `scan_for_crossings` and `find_crossing` without waves.
  pure logical function may_be_plain(switching, system)
    type(switching_t), intent(in) :: switching
    class(system_t), intent(in) :: system

    may_be_plain = switching%scan%is_used .and. .not. system%follows_waves
  end function may_be_plain

  !> Where plain steps find the indicators, and put the ones that have ended steps.
  subroutine describe_plain_crossings(switching, steps)
    type(switching_t), target, intent(inout) :: switching
    type(plain_steps_t), intent(inout) :: steps

    steps%indicator = c_loc(switching%scan%g)
    steps%side = c_loc(switching%roots%side)
    steps%crossed = c_loc(switching%pending)
    steps%promising = promising
    steps%least_distance = least_distance
    steps%grazing_steps = max_grazing_steps
  end subroutine describe_plain_crossings

  !> Starts a lane on the branches that the system has chosen; branches that do not hold there change at once.
  subroutine start_switching(switching, system, attempt, lane, solver_status)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: lane
    type(solver_status_t), intent(inout) :: solver_status

    switching%last_time(lane) = no_time
    switching%pending(lane) = 0
    call cross_boundaries(switching, system, attempt, lane, solver_status)
  end subroutine start_switching

  !> Looks at the last steps of all lanes at once, if the system can; before `may_cross` and `find_crossing`.
  subroutine scan_for_crossings(switching, system, attempt, coefficients, taken)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)   !! of the dense output, [lanes, padded columns, degree]
    logical, intent(in) :: taken(:)                             !! whether the lane has taken a step, [lanes]
    integer :: columns, function, i, l, part, parts

    if (.not. switching%scan%is_used) return
    associate (scan => switching%scan)
      if (system%follows_waves) then
        call find_unsettled_lanes(scan%followed, switching%roots, system, attempt, coefficients, taken, scan%y, scan%is_near)
        return
      end if
      columns = size(scan%y, 2)
      scan%parts(:) = parts_of(attempt%degree)
      parts = maxval(scan%parts, mask=taken)
      do part = 0, parts - 1, batch
        do i = 1, batch
          scan%theta(:, i) = 1.0_wp * min(part + i, scan%parts) / scan%parts
        end do
        call sample_lanes(attempt%lanes, columns, maxval(attempt%degree, mask=taken), attempt%y, coefficients, taken, &
                          scan%theta, scan%y)
        do i = 1, min(batch, parts - part)
          scan%t(:) = attempt%t + scan%theta(:, i) * attempt%h
          call system%block_indicators(columns, scan%t, scan%y(:, :, i), scan%g(:, :, part + i))
        end do
      end do
      call find_near(attempt%lanes, size(switching%g), parts, taken, switching%roots%side, scan%g, scan%is_near)
      ! the ends of the steps of lanes that cross nothing are the starts of their next ones
      do function = 1, size(scan%g, 2)
        do l = 1, size(taken)
          if (taken(l) .and. .not. scan%is_near(l)) scan%g(l, function, 0) = scan%g(l, function, parts)
        end do
      end do
    end associate
  end subroutine scan_for_crossings

  !> Finds the lanes that may cross a boundary: all others have positive indicators, none of which is at the lowest point of a
  !> parabola between two parts.
  pure subroutine find_near(lanes, functions, parts, taken, side, g, is_near)
    integer, intent(in) :: lanes, functions, parts
    logical, intent(in) :: taken(lanes)
    integer, intent(in) :: side(lanes, functions)
    real(wp), intent(in) :: g(lanes, functions, 0:parts)
    logical, intent(inout) :: is_near(lanes)
    integer :: function, l, part

    is_near = .false.
    do function = 1, functions
      do l = 1, lanes
        is_near(l) = is_near(l) .or. side(l, function) < 1
      end do
      do part = 1, parts
        do l = 1, lanes
          is_near(l) = is_near(l) .or. .not. g(l, function, part) > 0
        end do
      end do
      do part = 1, parts - 1
        do l = 1, lanes
          associate (before => g(l, function, part - 1), middle => g(l, function, part), after => g(l, function, part + 1))
            if (taken(l)) is_near(l) = is_near(l) .or. has_minimum(before, middle, after)
          end associate
        end do
      end do
    end do
  end subroutine find_near

  !> Whether the parabola through three equidistant values has its minimum between them.
  pure logical function has_minimum(before, middle, after)
    real(wp), intent(in) :: before, middle, after

    has_minimum = abs(after - before) < 2 * ((after - middle) - (middle - before))
  end function has_minimum

  !> Whether a lane may have crossed a boundary in its last step.
  pure logical function may_cross(switching, lane)
    type(switching_t), intent(in) :: switching
    integer, intent(in) :: lane

    may_cross = .true.
    if (switching%scan%is_used) may_cross = switching%scan%is_near(lane)
  end function may_cross

  !> Finds the first crossing in the last step of a lane: the theta where an indicator falls through zero. An indicator that is
  !> zero at the start and then negative crosses at the start.
  subroutine find_crossing(switching, system, observer, dense, theta)
    type(switching_t), intent(inout) :: switching   !! sets `pending` to the indicator, 0 if there is no crossing
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense    !! of the lane
    real(wp), intent(out) :: theta                  !! of the crossing, 1 if there is none
    integer :: function, part

    theta = 1.0_wp
    switching%known = -1.0_wp
    switching%pending(dense%lane) = 0
    if (system%follows_waves) then
      call find_followed_crossing(switching%roots, system, observer, dense, switching%pending(dense%lane), theta)
      return
    end if
    if (switching%scan%is_used) then
      ! takes the values of one lane
      switching%roots%parts = switching%scan%parts(dense%lane)
      do part = 0, switching%roots%parts
        switching%roots%values(:, part) = switching%scan%g(dense%lane, :, part)
      end do
    else
      call scan_step(switching%roots, system, observer, dense, 1.0_wp)
    end if
    do part = 1, switching%roots%parts
      do function = 1, size(switching%g)
        associate (side => switching%roots%side(dense%lane, function), g => switching%roots%values(function, part))
          if (.not. is_finite(g)) cycle
          if (side > 0 .and. g <= 0) then
            call find_earlier_crossing(switching, system, observer, dense, &
                                       part_bracket(switching%roots, function, part, 1.0_wp), theta)
          else if (side == 0 .and. g < 0) then
            call keep_first(switching, dense%lane, function, part_end(switching%roots, part - 1, 1.0_wp), theta)
          end if
          side = sign_of(g)
        end associate
      end do
      if (switching%pending(dense%lane) > 0) exit
    end do
    call find_grazing_crossings(switching, system, observer, dense, theta)
    if (switching%scan%is_used) switching%scan%g(dense%lane, :, 0) = switching%roots%values(:, switching%roots%parts)
  end subroutine find_crossing

  !> Replaces the crossing at theta by the crossing of one indicator in a bracket, if it is earlier. Of many indicators with a
  !> crossing in one part of a step, most are still positive at the first crossing so far, so that few roots have to be found.
  subroutine find_earlier_crossing(switching, system, observer, dense, whole, theta)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    type(sign_change_t), intent(in) :: whole
    real(wp), intent(inout) :: theta
    type(sign_change_t) :: bracket
    real(wp) :: root

    bracket = whole
    if (switching%pending(dense%lane) > 0) then
      if (theta <= bracket%before) return
      if (theta < bracket%after) then
        if (abs(switching%known - theta) > 0) then
          ! the indicators at the first crossing so far, evaluated once
          switching%known = theta
          call sample(dense, theta, switching%y)
          call system%indicator_values(dense%lane, dense%t + theta * dense%h, switching%y, switching%g)
        end if
        associate (g => switching%g(bracket%function))
          if (is_finite(g)) then
            if (g > 0) return
            bracket%after = theta
            bracket%g_after = g
          end if
        end associate
      end if
    end if
    call find_root(switching%roots, system, observer, dense, bracket, root)
    call keep_first(switching, dense%lane, bracket%function, root, theta)
  end subroutine find_earlier_crossing

  !> Finds crossings from which an indicator returns before the end of a part, as at a grazing contact.
  subroutine find_grazing_crossings(switching, system, observer, dense, theta)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(inout) :: theta
    type(sign_change_t) :: bracket
    real(wp) :: root
    integer :: function, part
    logical :: found

    do part = 1, switching%roots%parts - 1
      if (part_end(switching%roots, part - 1, 1.0_wp) >= theta) exit
      do function = 1, size(switching%g)
        associate (g => switching%roots%values)
          if (.not. may_graze(g(function, part - 1), g(function, part), g(function, part + 1))) cycle
        end associate
        call find_grazing(switching%roots, system, observer, dense, function, part, bracket, found)
        if (.not. found) cycle
        call find_root(switching%roots, system, observer, dense, bracket, root)
        call keep_first(switching, dense%lane, function, root, theta)
      end do
    end do
  end subroutine find_grazing_crossings

  !> Whether three values are positive, and their parabola has its minimum between them.
  pure logical function may_graze(before, middle, after)
    real(wp), intent(in) :: before, middle, after

    may_graze = min(sign_of(before), sign_of(middle), sign_of(after)) > 0
    if (may_graze) may_graze = has_minimum(before, middle, after)
  end function may_graze

  !> Replaces the crossing at theta by one at `root`, if that is earlier.
  pure subroutine keep_first(switching, lane, function, root, theta)
    type(switching_t), intent(inout) :: switching
    integer, intent(in) :: lane, function
    real(wp), intent(in) :: root
    real(wp), intent(inout) :: theta

    if (switching%pending(lane) > 0 .and. root >= theta) return
    switching%pending(lane) = function
    theta = root
  end subroutine keep_first

  !> Changes the branch at the pending boundary, then at all other boundaries that the lane has reached or passed, until there are
  !> none. Ends the lane with `integration_chattering` if that does not end.
  subroutine cross_boundaries(switching, system, attempt, lane, solver_status)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt   !! its state may jump
    integer, intent(in) :: lane
    type(solver_status_t), intent(inout) :: solver_status
    real(wp) :: limit
    logical :: crossed
    integer :: function

    if (attempt%t(lane) - switching%last_time(lane) > switching%least_progress) switching%repeats(lane, :) = 0
    if (switching%pending(lane) < 0) then
      function = -switching%pending(lane)
      call count_crossing(solver_status, lane, function)
      switching%repeats(lane, function) = switching%repeats(lane, function) + 1
      switching%last_time(lane) = attempt%t(lane)
      if (switching%repeats(lane, function) >= max_repeats) solver_status%code(lane) = integration_chattering
      switching%pending(lane) = 0
      return
    end if
    switching%y(:) = attempt%y(lane, :attempt%components)
    call system%indicator_values(lane, attempt%t(lane), switching%y, switching%g)
    limit = -tiny(limit)
    if (switching%pending(lane) > 0) then
      switching%g(switching%pending(lane)) = 0.0_wp   ! whatever rounding says
      limit = 0.0_wp
    end if
    do
      ! changes the branches of all indicators that are not above a limit
      crossed = .false.
      do function = 1, size(switching%g)
        if (.not. is_finite(switching%g(function))) cycle
        if (switching%g(function) > limit) cycle
        call system%change_branch(lane, function, attempt%t(lane), switching%y)
        call count_crossing(solver_status, lane, function)
        switching%repeats(lane, function) = switching%repeats(lane, function) + 1
        crossed = .true.
      end do
      if (.not. crossed .or. any(switching%repeats(lane, :) >= max_repeats)) exit
      switching%last_time(lane) = attempt%t(lane)
      call system%indicator_values(lane, attempt%t(lane), switching%y, switching%g)
      limit = -tiny(limit)   ! an indicator that is zero now may be at the start of its branch
    end do
    attempt%y(lane, :attempt%components) = switching%y
    if (crossed) solver_status%code(lane) = integration_chattering
    switching%pending(lane) = 0
    call set_start(switching%roots, lane, switching%g)
    if (switching%scan%is_used) switching%scan%g(lane, :, 0) = switching%g
  end subroutine cross_boundaries

end module nocdyn_switching
