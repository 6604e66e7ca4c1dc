!> The first crossing of indicator functions that may bend where the solution does not, such as what the torques leave of the
!> capacity of a clutch that holds: the functions are evaluated several times in each of their waves, and between these times
!> wherever they may fall through zero and come back.
!>
!> Between two times a function is as far from its chord as a parabola with twice the second difference of three values would
!> be. Parts are halved until that shows that it does not reach zero, or that it falls once.
module nocdyn_followed_crossings
  use nocdyn_dense_output, only: batch, dense_output_t, sample, sample_lanes
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t
  use nocdyn_root_functions, only: sign_change_t, find_root, most_halvings, parts_of, root_functions_t, sign_of
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: find_followed_crossing, find_unsettled_lanes, new_followed_lanes

  real(wp), parameter :: part_of_wave = 0.5_wp   ! between two times [rad]
  real(wp), parameter :: safety = 2.0_wp         ! factor of the second difference
  real(wp), parameter :: far = 1.0e300_wp        ! a function so large stands for none
  real(wp), parameter :: early = 0.5_wp          ! of a step: an earlier crossing is no sign that there is none before

  !> The first crossing so far.
  type, private :: found_crossing_t
    integer :: function = 0        ! 0: there is none
    real(wp) :: theta = 1.0_wp
  end type found_crossing_t

  !> What is known of the functions of all lanes of a block; work space.
  type, public :: followed_lanes_t
    private
    integer, allocatable :: pairs(:)         ! of parts of the step, [lanes]
    real(wp), allocatable :: fastest(:)      ! [rad/s], [lanes]
    real(wp), allocatable :: t(:)            ! [s], [lanes]
    real(wp), allocatable :: theta(:, :)     ! [lanes, batch]
    real(wp), allocatable :: g(:, :, :)      ! at the ends and in the middle of a pair, [lanes, functions, 3]
  end type followed_lanes_t

contains

  !> Work space for a block of lanes.
  type(followed_lanes_t) function new_followed_lanes(lanes, functions) result(self)
    integer, intent(in) :: lanes, functions

    allocate (self%pairs(lanes), source=0)
    allocate (self%fastest(lanes), self%t(lanes), self%theta(lanes, batch), self%g(lanes, functions, 3), source=0.0_wp)
  end function new_followed_lanes

  !> Looks at the last steps of all lanes at once, and finds those whose steps `find_followed_crossing` has to look at: the
  !> functions of the others stay above zero, and show it without a halving.
  subroutine find_unsettled_lanes(self, roots, system, attempt, coefficients, taken, y, is_unsettled)
    type(followed_lanes_t), intent(inout) :: self
    type(root_functions_t), intent(inout) :: roots   !! `last` becomes the values at the ends of the steps of settled lanes
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)   !! of the dense output, [lanes, padded columns, degree]
    logical, intent(in) :: taken(:)                             !! whether the lane has taken a step, [lanes]
    real(wp), contiguous, intent(inout) :: y(:, :, :)           !! work space, [lanes, padded columns, batch]
    logical, intent(inout) :: is_unsettled(:)                   !! [lanes]
    integer :: columns, first, i, l, pair

    columns = size(y, 2)
    call system%find_fastest_waves(columns, attempt%y, self%fastest)
    do l = 1, attempt%lanes
      self%pairs(l) = pairs_of_step(attempt%degree(l), attempt%h(l), self%fastest(l))
      if (.not. taken(l)) self%pairs(l) = 1
      is_unsettled(l) = taken(l) .and. any(roots%side(l, :) < 1)
      self%g(l, :, 1) = roots%last(:, l)
    end do
    do first = 1, maxval(self%pairs), batch / 2
      do i = 1, batch
        ! the ends of the pairs have the even numbers; lanes with fewer pairs stay at the end of their step
        self%theta(:, i) = 1.0_wp * min(2 * first - 2 + i, 2 * self%pairs) / (2 * self%pairs)
      end do
      call sample_lanes(attempt%lanes, columns, maxval(attempt%degree, mask=taken), attempt%y, coefficients, taken, &
                        self%theta, y)
      do pair = first, min(first + batch / 2 - 1, maxval(self%pairs))
        do i = 1, 2
          associate (sample => 2 * (pair - first) + i)
            self%t(:) = attempt%t + self%theta(:, sample) * attempt%h
            call system%block_indicators(columns, self%t, y(:, :, sample), self%g(:, :, 1 + i))
          end associate
        end do
        do l = 1, attempt%lanes
          if (pair > self%pairs(l) .or. .not. taken(l)) cycle
          is_unsettled(l) = is_unsettled(l) .or. any(.not. stays_above(self%g(l, :, 1), self%g(l, :, 2), self%g(l, :, 3)))
          self%g(l, :, 1) = self%g(l, :, 3)
        end do
      end do
    end do
    do l = 1, attempt%lanes
      if (taken(l) .and. .not. is_unsettled(l)) roots%last(:, l) = self%g(l, :, 1)
    end do
  end subroutine find_unsettled_lanes

  !> Whether three values of a function show that it stays above zero, or that there is none.
  elemental logical function stays_above(before, middle, after)
    real(wp), intent(in) :: before, middle, after

    stays_above = is_settled(before, middle, after) .and. .not. (middle <= 0 .or. after <= 0)
  end function stays_above

  !> The number of pairs of parts of a step.
  pure integer function pairs_of_step(degree, duration, fastest)
    integer, intent(in) :: degree          ! of the dense output
    real(wp), intent(in) :: duration       ! [s]
    real(wp), intent(in) :: fastest        ! [rad/s]

    pairs_of_step = max((parts_of(degree) + 1) / 2, &
                        ceiling(min(0.25_wp * huge(1), 0.5_wp * duration * fastest / part_of_wave)))
  end function pairs_of_step

  !> Finds the first crossing in the last step of a lane: the theta where an indicator falls through zero. The functions are
  !> looked at up to there; it is done again where it is early in the step, as they may have no sense beyond.
  subroutine find_followed_crossing(roots, system, observer, dense, function, theta)
    type(root_functions_t), intent(inout) :: roots   !! `side` and `last` of the lane are those at the start of the step
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense     !! of the lane
    integer, intent(out) :: function                 !! 0 if there is none
    real(wp), intent(out) :: theta                   !! of the crossing, 1 if there is none
    type(found_crossing_t) :: first, next
    real(wp) :: fastest, searched

    roots%first_side(:) = roots%side(dense%lane, :)
    call sample(dense, 0.0_wp, roots%y)
    call system%find_fastest_wave(dense%lane, roots%y, fastest)
    searched = 1.0_wp
    call search_step(roots, system, observer, dense, fastest, searched, first)
    do while (first%function > 0 .and. first%theta < early * searched)
      searched = first%theta
      roots%side(dense%lane, :) = roots%first_side
      call search_step(roots, system, observer, dense, fastest, searched, next)
      if (next%function == 0 .or. next%function == first%function) exit
      if (next%theta < first%theta) first = next
    end do
    function = first%function
    theta = first%theta
  end subroutine find_followed_crossing

  !> Looks at a step up to theta_end, pair by pair of its parts.
  subroutine search_step(roots, system, observer, dense, fastest, theta_end, first)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: fastest   !! [rad/s]
    real(wp), intent(in) :: theta_end
    type(found_crossing_t), intent(out) :: first
    integer :: pair, pairs

    pairs = pairs_of_step(dense%degree, theta_end * dense%h, fastest)
    roots%halves(:, 1, 0) = roots%last(:, dense%lane)
    do pair = 1, pairs
      associate (a => theta_end * (2 * pair - 2) / (2 * pairs), m => theta_end * (2 * pair - 1) / (2 * pairs), &
                 b => theta_end * (2 * pair) / (2 * pairs))
        call evaluate(roots%y, system, dense, m, roots%halves(:, 2, 0))
        call evaluate(roots%y, system, dense, b, roots%halves(:, 3, 0))
        call search_pair(roots, system, observer, dense, [a, m, b], 0, first)
      end associate
      if (first%function > 0) return
      roots%halves(:, 1, 0) = roots%halves(:, 3, 0)
    end do
    roots%last(:, dense%lane) = roots%halves(:, 3, 0)
  end subroutine search_step

  !> Looks at two parts of a step of equal length, between three times where `roots%halves` has the functions at this level.
  recursive subroutine search_pair(roots, system, observer, dense, theta, level, first)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: theta(3)
    integer, intent(in) :: level   !! halvings so far
    type(found_crossing_t), intent(inout) :: first
    real(wp) :: middle
    integer :: part
    logical :: is_known   ! where they cross zero

    associate (values => roots%halves(:, :, level))
      is_known = level == most_halvings
      if (.not. is_known) is_known = all(is_settled(values(:, 1), values(:, 2), values(:, 3)))
      do part = 1, 2
        if (is_known) then
          call cross_part(roots, system, observer, dense, theta(part:part + 1), values(:, part:part + 1), first)
        else
          middle = theta(part) + 0.5_wp * (theta(part + 1) - theta(part))
          roots%halves(:, 1, level + 1) = values(:, part)
          roots%halves(:, 3, level + 1) = values(:, part + 1)
          call evaluate(roots%y, system, dense, middle, roots%halves(:, 2, level + 1))
          call search_pair(roots, system, observer, dense, [theta(part), middle, theta(part + 1)], level + 1, first)
        end if
        if (first%function > 0) return
      end do
    end associate
  end subroutine search_pair

  !> Whether three values of a function show where it crosses zero.
  elemental logical function is_settled(before, middle, after)
    real(wp), intent(in) :: before, middle, after
    real(wp) :: bend

    is_settled = .true.
    if (.not. (is_finite(before) .and. is_finite(middle) .and. is_finite(after))) return
    if (max(abs(before), abs(middle), abs(after)) > far .or. max(before, middle, after) <= 0) return
    bend = safety * abs(0.25_wp * before - 0.5_wp * middle + 0.25_wp * after) * 4
    is_settled = is_settled_part(before, middle, bend) .and. is_settled_part(middle, after, bend)
  end function is_settled

  !> Whether one of the parts is monotonic or stays above zero.
  elemental logical function is_settled_part(before, after, bend)
    real(wp), intent(in) :: before, after
    real(wp), intent(in) :: bend   !! second difference
    real(wp) :: change

    change = after - before
    is_settled_part = abs(change) >= 0.5_wp * bend .or. max(before, after) <= 0
    if (is_settled_part .or. min(before, after) <= 0) return
    is_settled_part = 0.5_wp * (before + after) - 0.125_wp * bend - 0.5_wp * change * (change / bend) > 0
  end function is_settled_part

  !> Finds the first function that falls through zero in a part of a step. A function that is zero at the start and then negative
  !> crosses at the start.
  subroutine cross_part(roots, system, observer, dense, theta, values, first)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: theta(2)         !! of the ends
    real(wp), intent(in) :: values(:, :)     !! of the functions there, [functions, 2]
    type(found_crossing_t), intent(inout) :: first
    real(wp) :: root
    integer :: function

    do function = 1, size(values, 1)
      associate (side => roots%side(dense%lane, function), g => values(function, 2))
        if (.not. is_finite(g)) cycle
        if (side > 0 .and. g <= 0) then
          call find_root(roots, system, observer, dense, sign_change_t(function, theta(1), theta(2), values(function, 1), g), &
                         root)
          if (first%function == 0 .or. root < first%theta) first = found_crossing_t(function, root)
        else if (side == 0 .and. g < 0) then
          if (first%function == 0 .or. theta(1) < first%theta) first = found_crossing_t(function, theta(1))
        end if
        side = sign_of(g)
      end associate
    end do
  end subroutine cross_part

  !> The functions at one theta.
  subroutine evaluate(y, system, dense, theta, g)
    real(wp), contiguous, intent(inout) :: y(:)   !! the state there, work space
    class(system_t), intent(inout) :: system
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: theta
    real(wp), contiguous, intent(inout) :: g(:)

    call sample(dense, theta, y)
    call system%indicator_values(dense%lane, dense%t + theta * dense%h, y, g)
  end subroutine evaluate

end module nocdyn_followed_crossings
