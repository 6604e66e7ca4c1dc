!> Steps that end where a system changes its branch, and the change.
module nocdyn_switching
  use nocdyn_dense_output, only: dense_output_t
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_outcome, only: integration_chattering, note_crossing, outcome_t
  use nocdyn_system, only: observer_t, system_t
  use nocdyn_trial, only: trial_t
  use nocdyn_watched_functions, only: allocate_watched, bracket_t, evaluate, find_dip, find_root, part_of_step, place, &
    scan_step, sign_of, start_watched, watched_t
  implicit none (type, external)
  private

  public :: allocate_switching, start_switching, find_fall, cross_borders

  integer, parameter, public :: most_repeats = 100        !! crossings of one function while its lane makes no progress
  real(wp), parameter :: negligible = 1.0e-10_wp          ! of the whole time: no progress from one crossing to the next
  real(wp), parameter :: no_time = -huge(1.0_wp)

  type, public :: switching_t
    integer, allocatable :: due(:)                         !! function that ended the last step of each lane, 0 if none did
    real(wp), private :: least_progress
    real(wp), allocatable, private :: last_time(:)         !! of a crossing of each lane
    integer, allocatable, private :: repeats(:, :)         !! crossings since the lane made progress, [lanes, functions]
    type(watched_t), private :: watched
    real(wp), allocatable, private :: g(:)                 !! functions where a lane crosses, or at the first fall found so far
    real(wp), allocatable, private :: y(:)
  end type switching_t

contains

  !> Room for the switches of a system.
  subroutine allocate_switching(switching, system, degree, trial, duration)
    type(switching_t), intent(out) :: switching
    class(system_t), intent(in) :: system
    integer, intent(in) :: degree      !! of the solution inside the step
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: duration   !! of the whole integration

    switching%least_progress = negligible * duration
    allocate (switching%due(trial%lanes), source=0)
    allocate (switching%last_time(trial%lanes), source=no_time)
    allocate (switching%repeats(trial%lanes, system%switches), source=0)
    allocate (switching%g(system%switches), switching%y(trial%components), source=0.0_wp)
    call allocate_watched(switching%watched, system%switches, .true., degree, trial)
  end subroutine allocate_switching

  !> A lane starts on the branches that it has entered; those that do not hold there are left at once.
  subroutine start_switching(switching, system, observer, trial, lane, outcome)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(trial_t), intent(in) :: trial
    integer, intent(in) :: lane
    type(outcome_t), intent(inout) :: outcome

    switching%last_time(lane) = no_time
    switching%due(lane) = 0
    call cross_borders(switching, system, observer, trial, lane, outcome)
  end subroutine start_switching

  !> The first place in the last step of a lane where a function falls through zero. A function that is zero at the start and
  !> then negative has never been on its branch: it falls at the start.
  subroutine find_fall(switching, system, observer, dense, theta)
    type(switching_t), intent(inout) :: switching   !! `due` is the function, 0 if none falls
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense    !! of the lane
    real(wp), intent(out) :: theta                  !! 1 if none falls
    integer :: function, part

    theta = 1.0_wp
    switching%due(dense%lane) = 0
    call scan_step(switching%watched, system, observer, dense, 1.0_wp)
    do part = 1, switching%watched%parts
      do function = 1, size(switching%g)
        associate (side => switching%watched%side(dense%lane, function), g => switching%watched%values(function, part))
          if (.not. is_finite(g)) cycle
          if (side > 0 .and. g <= 0) then
            call find_fall_of(switching, system, observer, dense, part_of_step(switching%watched, function, part, 1.0_wp), theta)
          else if (side == 0 .and. g < 0) then
            call keep_first(switching, dense%lane, function, place(switching%watched, part - 1, 1.0_wp), theta)
          end if
          side = sign_of(g)
        end associate
      end do
      if (switching%due(dense%lane) > 0) exit
    end do
    call find_short_falls(switching, system, observer, dense, theta)
  end subroutine find_fall

  !> The fall of one function in a bracket, if it comes before that at theta. Of many functions that fall in one part of a step
  !> only few are followed to their roots: most are seen to be positive at the first fall known so far.
  subroutine find_fall_of(switching, system, observer, dense, whole, theta)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    type(bracket_t), intent(in) :: whole
    real(wp), intent(inout) :: theta
    type(bracket_t) :: bracket
    real(wp) :: root

    bracket = whole
    if (switching%due(dense%lane) > 0) then
      if (theta <= bracket%before) return
      if (theta < bracket%after .and. is_finite(switching%g(bracket%function))) then
        if (switching%g(bracket%function) > 0) return
        bracket%after = theta
        bracket%g_after = switching%g(bracket%function)
      end if
    end if
    call find_root(switching%watched, system, observer, dense, bracket, root)
    call keep_first(switching, dense%lane, bracket%function, root, theta)
    if (switching%due(dense%lane) == bracket%function) then
      call evaluate(.true., system, observer, dense, theta, switching%y, switching%g)
    end if
  end subroutine find_fall_of

  !> The same for falls from which a function comes back before the end of a part, as at a grazing contact.
  subroutine find_short_falls(switching, system, observer, dense, theta)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(inout) :: theta
    type(bracket_t) :: bracket
    real(wp) :: root
    integer :: function, part
    logical :: found

    do part = 1, switching%watched%parts - 1
      if (place(switching%watched, part - 1, 1.0_wp) >= theta) exit
      do function = 1, size(switching%g)
        associate (g => switching%watched%values)
          if (.not. may_dip(g(function, part - 1), g(function, part), g(function, part + 1))) cycle
        end associate
        call find_dip(switching%watched, system, observer, dense, function, part, bracket, found)
        if (.not. found) cycle
        call find_root(switching%watched, system, observer, dense, bracket, root)
        call keep_first(switching, dense%lane, function, root, theta)
      end do
    end do
  end subroutine find_short_falls

  !> Whether the parabola through three equidistant positive values has its minimum between them.
  pure logical function may_dip(before, middle, after)
    real(wp), intent(in) :: before, middle, after

    may_dip = min(sign_of(before), sign_of(middle), sign_of(after)) > 0
    if (may_dip) may_dip = abs(after - before) < 2 * ((after - middle) - (middle - before))
  end function may_dip

  pure subroutine keep_first(switching, lane, function, root, theta)
    type(switching_t), intent(inout) :: switching
    integer, intent(in) :: lane, function
    real(wp), intent(in) :: root
    real(wp), intent(inout) :: theta

    if (switching%due(lane) > 0 .and. root >= theta) return
    switching%due(lane) = function
    theta = root
  end subroutine keep_first

  !> Crosses the border that is due, and all others at which a lane is or beyond which it is found then; ends the lane if there
  !> is no end to it.
  subroutine cross_borders(switching, system, observer, trial, lane, outcome)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(trial_t), intent(in) :: trial
    integer, intent(in) :: lane
    type(outcome_t), intent(inout) :: outcome
    real(wp) :: limit
    logical :: crossed

    if (trial%t(lane) - switching%last_time(lane) > switching%least_progress) switching%repeats(lane, :) = 0
    switching%y(:) = trial%y(lane, :trial%components)
    call system%switch_values(lane, trial%t(lane), switching%y, switching%g)
    limit = -tiny(limit)
    if (switching%due(lane) > 0) then
      switching%g(switching%due(lane)) = 0.0_wp   ! whatever rounding says
      limit = 0.0_wp
    end if
    do
      call cross_below(switching, system, trial%t(lane), lane, limit, crossed, outcome)
      if (.not. crossed .or. any(switching%repeats(lane, :) >= most_repeats)) exit
      switching%last_time(lane) = trial%t(lane)
      call system%switch_values(lane, trial%t(lane), switching%y, switching%g)
      limit = -tiny(limit)   ! a function that is zero now may be at the beginning of its branch
    end do
    if (crossed) outcome%status(lane) = integration_chattering
    switching%due(lane) = 0
    call start_watched(switching%watched, system, observer, trial, lane)
  end subroutine cross_borders

  !> Crosses the borders of all functions that are not above a limit.
  subroutine cross_below(switching, system, t, lane, limit, crossed, outcome)
    type(switching_t), intent(inout) :: switching
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t
    integer, intent(in) :: lane
    real(wp), intent(in) :: limit
    logical, intent(out) :: crossed   !! whether there were any
    type(outcome_t), intent(inout) :: outcome
    integer :: function

    crossed = .false.
    do function = 1, size(switching%g)
      if (.not. is_finite(switching%g(function))) cycle
      if (switching%g(function) > limit) cycle
      call system%cross(lane, function, t, switching%y)
      call note_crossing(outcome, lane, function)
      switching%repeats(lane, function) = switching%repeats(lane, function) + 1
      crossed = .true.
    end do
  end subroutine cross_below

end module nocdyn_switching
