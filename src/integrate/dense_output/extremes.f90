!> Extremes in continuous time of functions of the solution, such as moments and reactions.
!>
!> In every step each function is replaced by the polynomial through its values at Chebyshev-Lobatto nodes, as many as the dense
!> output has coefficients: a linear function of the state is represented exactly. Functions that bend more than the solution are
!> replaced piece by piece (`nocdyn_step_pieces`). The extremes of the polynomial are found to machine precision wherever it can
!> exceed those so far.
module nocdyn_extremes
  use nocdyn_chebyshev, only: interpolation_t, list_extremes, max_degree, new_interpolation, raise_to_maximum, time_at
  use nocdyn_dense_output, only: dense_output_t, sample
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t, ranges_t
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_step_pieces, only: new_step_pieces, step_pieces_t
  implicit none (type, external)
  private

  public :: allocate_extremes, start_extremes, restart_extremes, update_extremes

  real(wp), parameter, public :: before_jump = 64.0_wp   !! spacings of the time between the last node and a jump

  type, public :: extremes_t
    type(ranges_t), allocatable :: ranges(:)               !! [lanes]
    logical, allocatable :: have_begun(:)                  !! whether a lane has come to the time from which they count, [lanes]
    real(wp), allocatable, private :: last(:, :)           !! values at the ends of the last steps, [functions, lanes]
    type(interpolation_t), allocatable, private :: rules(:)   !! of the degrees of the steps, [largest degree]
    real(wp), allocatable, private :: values(:, :)         !! [functions, most nodes]
    real(wp), allocatable, private :: y(:)                 !! [components]
    type(step_pieces_t), allocatable, private :: pieces(:) !! of the steps of the lanes, [lanes]
    integer, allocatable, private :: bending(:)            !! functions that may bend more than the solution
    logical, allocatable, private :: replaced(:)           !! whose polynomials count in a piece, [functions]
    real(wp), allocatable, private :: fastest(:), scale(:) !! waves [rad/s] and scale of these at the ends of the steps, [lanes]
  end type extremes_t

contains

  !> Allocates the data of the tracked functions of an observer.
  subroutine allocate_extremes(extremes, observer, degrees, attempt)
    type(extremes_t), intent(out) :: extremes
    class(observer_t), intent(in) :: observer
    integer, intent(in) :: degrees(:)   !! of the dense output of each kind of steps; 0: there are fewer kinds
    type(step_attempt_t), intent(in) :: attempt
    integer :: i, lane

    allocate (extremes%rules(maxval(degrees)))
    do i = 1, size(degrees)
      if (degrees(i) == 0) cycle
      extremes%rules(degrees(i)) = new_interpolation(degrees(i))
    end do
    allocate (extremes%ranges(attempt%lanes))
    allocate (extremes%have_begun(attempt%lanes), source=.false.)
    do lane = 1, attempt%lanes
      associate (ranges => extremes%ranges(lane), functions => observer%tracked)
        allocate (ranges%lowest(functions), ranges%lowest_time(functions), ranges%highest(functions), &
                  ranges%highest_time(functions), source=0.0_wp)
      end associate
    end do
    allocate (extremes%last(observer%tracked, attempt%lanes), extremes%values(observer%tracked, maxval(degrees) + 1), &
              extremes%y(attempt%components), extremes%fastest(attempt%lanes), extremes%scale(attempt%lanes), source=0.0_wp)
    allocate (extremes%replaced(observer%tracked), source=.false.)
    allocate (extremes%bending(0))
    if (allocated(observer%bends)) extremes%bending = pack([(i, i=1, observer%tracked)], observer%bends)
    allocate (extremes%pieces(attempt%lanes))
    do lane = 1, attempt%lanes
      extremes%pieces(lane) = new_step_pieces(observer%tracked)
    end do
  end subroutine allocate_extremes

  !> Sets the ranges of a lane at its start, if they count from there.
  subroutine start_extremes(extremes, observer, attempt, lane)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: lane

    extremes%have_begun(lane) = attempt%t(lane) >= observer%tracked_from
    call extremes%pieces(lane)%restart()
    if (.not. extremes%have_begun(lane)) return
    call restart_extremes(extremes, observer, attempt, lane)
    call start_ranges(extremes%ranges(lane), extremes%last(:, lane), attempt%t(lane))
  end subroutine start_extremes

  !> Sets the ranges to the values of a single time.
  pure subroutine start_ranges(ranges, values, t)
    type(ranges_t), intent(inout) :: ranges
    real(wp), contiguous, intent(in) :: values(:)   !! [functions]
    real(wp), intent(in) :: t

    ranges%lowest(:) = values
    ranges%highest(:) = values
    ranges%lowest_time(:) = t
    ranges%highest_time(:) = t
  end subroutine start_ranges

  !> Evaluates the tracked functions at the present state of a lane, after a jump.
  subroutine restart_extremes(extremes, observer, attempt, lane)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: lane

    if (.not. extremes%have_begun(lane)) return
    extremes%y(:) = attempt%y(lane, :attempt%components)
    call observer%tracked_values(lane, attempt%t(lane), extremes%y, extremes%last(:, lane))
    call observer%find_pace(lane, extremes%fastest(lane), extremes%scale(lane))
    call tell_values(observer, lane, extremes%last(:, lane))
  end subroutine restart_extremes

  !> Tells the present values of the functions whose turning points are wanted.
  subroutine tell_values(observer, lane, values)
    class(observer_t), intent(inout) :: observer
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: values(:)   !! [functions]
    integer :: function

    do function = observer%tracked - observer%turning + 1, observer%tracked
      call observer%on_turn(lane, function, values(function))
    end do
  end subroutine tell_values

  !> Widens the ranges of a lane by its last step, from `tracked_from` up to t_end. If the step ends at a crossing, the last node
  !> is just before it: a function may jump there, which would spoil the polynomial.
  subroutine update_extremes(extremes, observer, dense, t_end, ends_at_crossing)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp), intent(in) :: t_end   !! end of the step [s]
    logical, intent(in) :: ends_at_crossing
    real(wp) :: t_start, values(0:max_degree)
    logical :: has_moved
    integer :: function, i, last

    if (t_end <= observer%tracked_from) return
    t_start = max(dense%t, observer%tracked_from)
    if (.not. extremes%have_begun(dense%lane)) call begin(extremes, observer, dense, t_start)
    last = dense%degree + 1
    associate (lane => dense%lane, pieces => extremes%pieces(dense%lane), rule => extremes%rules(dense%degree))
      call pieces%start_step(t_start, t_end, extremes%fastest(lane), dense%degree)
      do while (.not. pieces%is_done)
        call sample_piece(extremes, observer, dense, pieces%begin, pieces%end, ends_at_crossing .and. pieces%end >= t_end)
        extremes%replaced(:) = pieces%is_open(:, pieces%depth)
        do i = 1, size(extremes%bending)
          function = extremes%bending(i)
          if (.not. extremes%replaced(function)) cycle
          values(:last - 1) = extremes%values(function, :last)
          call pieces%replaces(function, rule, values, extremes%scale(lane), extremes%replaced(function))
        end do
        call widen_ranges(rule, extremes%values(:, :last), extremes%replaced, extremes%ranges(lane), pieces%begin, pieces%end)
        call tell_turns(observer, lane, rule, extremes%values(:, :last), extremes%replaced)
        call pieces%advance(has_moved)
        if (has_moved) extremes%last(:, lane) = extremes%values(:, last)
      end do
      call observer%find_pace(lane, extremes%fastest(lane), extremes%scale(lane))
    end associate
  end subroutine update_extremes

  !> Evaluates the functions at the nodes in a piece of a step; at the first one they are known.
  subroutine sample_piece(extremes, observer, dense, t_start, t_end, ends_at_crossing)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp), intent(in) :: t_start, t_end         !! of the piece [s]
    logical, intent(in) :: ends_at_crossing
    real(wp) :: t, half, middle
    integer :: i, last

    last = dense%degree + 1
    half = 0.5_wp * (t_end - t_start)
    middle = t_start + half
    extremes%values(:, 1) = extremes%last(:, dense%lane)
    do i = 2, last
      t = middle + extremes%rules(dense%degree)%nodes(i - 1) * half
      if (i == last .and. ends_at_crossing) t = max(t_start, t_end - before_jump * spacing(t_end))
      call sample(dense, min(1.0_wp, (t - dense%t) / dense%h), extremes%y)
      call observer%tracked_values(dense%lane, t, extremes%y, extremes%values(:, i))
    end do
  end subroutine sample_piece

  !> Tells the extremes inside of a piece of a step and the values at its end.
  subroutine tell_turns(observer, lane, rule, values_of, replaced)
    class(observer_t), intent(inout) :: observer
    integer, intent(in) :: lane
    type(interpolation_t), intent(in) :: rule
    real(wp), contiguous, intent(in) :: values_of(:, :)   !! [functions, nodes]
    logical, intent(in) :: replaced(:)                    !! functions that count
    real(wp) :: turns(max_degree), values(0:max_degree)
    integer :: function, i, turn_count

    do function = observer%tracked - observer%turning + 1, observer%tracked
      if (.not. replaced(function)) cycle
      values(:rule%degree) = values_of(function, :)
      call list_extremes(rule, values, observer%least_range(lane, function), turns, turn_count)
      do i = 1, turn_count
        call observer%on_turn(lane, function, turns(i))
      end do
      call observer%on_turn(lane, function, values(rule%degree))
    end do
  end subroutine tell_turns

  !> Sets the ranges of a lane to the values at a time in its last step.
  subroutine begin(extremes, observer, dense, t)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp), intent(in) :: t                      !! [s]

    call sample(dense, (t - dense%t) / dense%h, extremes%y)
    call observer%tracked_values(dense%lane, t, extremes%y, extremes%last(:, dense%lane))
    call observer%find_pace(dense%lane, extremes%fastest(dense%lane), extremes%scale(dense%lane))
    call start_ranges(extremes%ranges(dense%lane), extremes%last(:, dense%lane), t)
    call tell_values(observer, dense%lane, extremes%last(:, dense%lane))
    extremes%have_begun(dense%lane) = .true.
  end subroutine begin

  !> Widens the ranges by the extremes of the polynomials through `values_of`, over the times from t_start to t_end.
  pure subroutine widen_ranges(rule, values_of, replaced, ranges, t_start, t_end)
    type(interpolation_t), intent(in) :: rule
    real(wp), contiguous, intent(in) :: values_of(:, :)   !! [functions, nodes]
    logical, intent(in) :: replaced(:)                    !! functions that count
    type(ranges_t), intent(inout) :: ranges
    real(wp), intent(in) :: t_start, t_end   !! [s]
    real(wp) :: values(0:max_degree), extreme, position
    integer :: function
    logical :: found

    do function = 1, size(values_of, 1)
      if (.not. replaced(function)) cycle
      values(:rule%degree) = values_of(function, :)
      call raise_to_maximum(rule, values, ranges%highest(function), position, found)
      if (found) ranges%highest_time(function) = time_at(position, t_start, t_end)
      values(:rule%degree) = -values(:rule%degree)
      extreme = -ranges%lowest(function)
      call raise_to_maximum(rule, values, extreme, position, found)
      ranges%lowest(function) = -extreme
      if (found) ranges%lowest_time(function) = time_at(position, t_start, t_end)
    end do
  end subroutine widen_ranges

end module nocdyn_extremes
