!> Polynomials of functions of the solution, such as moments and reactions, in every step, and their extremes in continuous time.
!>
!> In every step of a lane each function is replaced by the polynomial through its values at Chebyshev-Lobatto nodes, as many as
!> the dense output of the step has coefficients: a linear function of the state is represented exactly. Functions that bend more
!> than the solution are replaced piece by piece (`nocdyn_step_pieces`). The extremes of the polynomial are found to machine
!> precision wherever it can exceed those so far. Steps in which bounds show that no function can leave its range are not sampled.
module nocdyn_extremes
  use nocdyn_chebyshev, only: interpolation_t, max_degree, new_interpolation, raise_to_maximum, time_at
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t, piece_t, ranges_t, step_block_t
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_step_pieces, only: before_jump, new_step_pieces, step_pieces_t
  implicit none (type, external)
  private

  public :: allocate_extremes, start_extremes, restart_extremes, update_extremes, end_extremes, observe_left

  type, public :: extremes_t
    type(ranges_t), allocatable :: ranges(:)               !! [lanes]
    logical, allocatable :: have_begun(:)                  !! whether a lane has come to the time from which they count, [lanes]
    real(wp), allocatable, private :: from(:)              !! times from which functions are tracked [s]
    type(interpolation_t), allocatable, private :: rules(:)   !! of the degrees of the steps, [largest degree]
    integer, allocatable, private :: degree(:)             !! of the last steps, [lanes]
    logical, allocatable, private :: is_known(:)           !! whether `last` has the values where the next step begins, [lanes]
    real(wp), allocatable, private :: last(:, :)           !! values at the ends of the last pieces, [functions, lanes]
    real(wp), allocatable, private :: values(:, :, :)      !! [functions, most nodes, lanes]
    logical, allocatable, private :: active(:)             !! lanes whose step is sampled
    real(wp), allocatable, private :: start(:)             !! of the part of the step [s], [lanes]
    real(wp), allocatable, private :: t(:), theta(:)       !! of the sample, [lanes]
    real(wp), allocatable, private :: y(:, :), y_lane(:)   !! [lanes, components], [components]
    type(step_pieces_t), allocatable, private :: pieces(:) !! of the steps of the lanes, [lanes]
    integer, allocatable, private :: bending(:)            !! functions that may bend more than the solution
    logical, allocatable, private :: replaced(:)           !! whose polynomials count in a piece, [functions]
    real(wp), allocatable, private :: fastest(:), scale(:) !! waves [rad/s] and scale of these where pieces begin, [lanes]
    ! of a single lane whose observer bounds the functions, [functions]:
    real(wp), allocatable, private :: room(:)              !! by how much they may change without leaving their ranges
    logical, private :: has_room = .false.                 !! whether `room` is known
    logical, private :: has_left_out = .false.             !! whether the last step was left out
    real(wp), private :: left_at = 0.0_wp                  !! its end [s]
    real(wp), allocatable, private :: left(:, :)           !! state there, [1, components]
    real(wp), allocatable, private :: end_room(:)          !! as `room`, by the values at the end of a step
    real(wp), allocatable, private :: slopes(:), bends(:)  !! bounds in the last step
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
    associate (functions => observer%tracked, lanes => attempt%lanes)
      allocate (extremes%ranges(lanes), extremes%pieces(lanes))
      do lane = 1, lanes
        extremes%pieces(lane) = new_step_pieces(functions)
        associate (ranges => extremes%ranges(lane))
          allocate (ranges%lowest(functions), ranges%lowest_time(functions), ranges%highest(functions), &
                    ranges%highest_time(functions), source=0.0_wp)
        end associate
      end do
      allocate (extremes%have_begun(lanes), extremes%is_known(lanes), extremes%active(lanes), extremes%replaced(functions), &
                source=.false.)
      allocate (extremes%degree(lanes), source=1)
      allocate (extremes%last(functions, lanes), extremes%values(functions, maxval(degrees) + 1, lanes), &
                extremes%y(lanes, attempt%components), extremes%y_lane(attempt%components), source=0.0_wp)
      allocate (extremes%start(lanes), extremes%t(lanes), extremes%theta(lanes), extremes%fastest(lanes), extremes%scale(lanes), &
                source=0.0_wp)
      allocate (extremes%room(functions), extremes%end_room(functions), source=0.0_wp)
      if (observer%bounds_functions) allocate (extremes%left, source=extremes%y)
      allocate (extremes%slopes(functions), extremes%bends(functions), source=0.0_wp)
    end associate
    allocate (extremes%from(1), source=-huge(1.0_wp))
    if (allocated(observer%tracked_from)) extremes%from = observer%tracked_from
    allocate (extremes%bending(0))
    if (allocated(observer%bends)) extremes%bending = pack([(i, i=1, observer%tracked)], observer%bends)
  end subroutine allocate_extremes

  !> Forgets the functions of a lane, which starts.
  pure subroutine start_extremes(extremes, lane)
    type(extremes_t), intent(inout) :: extremes
    integer, intent(in) :: lane

    extremes%have_begun(lane) = .false.
    call extremes%pieces(lane)%restart()
    call restart_extremes(extremes, lane)
  end subroutine start_extremes

  !> Forgets the present values of the functions of a lane, after a jump.
  pure subroutine restart_extremes(extremes, lane)
    type(extremes_t), intent(inout) :: extremes
    integer, intent(in) :: lane

    extremes%is_known(lane) = .false.
    extremes%has_room = .false.
    extremes%has_left_out = .false.
  end subroutine restart_extremes

  !> Follows the functions through the last steps of the lanes, in the parts of them from each time in `tracked_from` on.
  subroutine update_extremes(extremes, observer, steps, attempt, c)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_block_t), intent(in) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: c(:, :, :)   !! coefficients of the dense output, [lanes, padded columns, degree]
    integer :: i, lane
    logical :: has_moved

    extremes%degree(:) = attempt%degree
    do i = 1, size(extremes%from)
      extremes%active(:) = steps%taken .and. steps%t_new > extremes%from(i)
      if (i > 1) extremes%active(:) = extremes%active .and. steps%t < extremes%from(i)   ! else it is the part of the first
      if (.not. any(extremes%active)) cycle
      extremes%start(:) = max(steps%t, extremes%from(i))
      ! begins the parts of the steps of the active lanes with their first pieces
      where (extremes%active .and. extremes%start > steps%t) extremes%is_known = .false.
      if (observer%bounds_functions) call exclude_step(extremes, observer, steps, attempt, c)
      call observe_starts(extremes, observer, steps, attempt, c)
      do lane = 1, size(extremes%active)
        if (.not. extremes%active(lane)) cycle
        if (.not. extremes%have_begun(lane)) then
          extremes%ranges(lane)%lowest(:) = extremes%last(:, lane)
          extremes%ranges(lane)%highest(:) = extremes%last(:, lane)
          extremes%ranges(lane)%lowest_time(:) = extremes%start(lane)
          extremes%ranges(lane)%highest_time(:) = extremes%start(lane)
        end if
        extremes%have_begun(lane) = .true.
        call extremes%pieces(lane)%start_step(extremes%start(lane), steps%t_new(lane), extremes%fastest(lane), &
                                              extremes%degree(lane))
      end do
      do while (any(extremes%active))
        call sample_pieces(extremes, observer, steps, attempt, c)
        do lane = 1, size(extremes%active)
          if (.not. extremes%active(lane)) cycle
          associate (pieces => extremes%pieces(lane))
            call find_replaced(extremes, lane)
            call take_piece(extremes, observer, lane, piece_t(pieces%begin, pieces%end, extremes%start(lane), steps%t(lane), &
                                                              steps%t_new(lane)))
            call pieces%advance(has_moved)
            if (has_moved) extremes%last(:, lane) = extremes%values(:, extremes%degree(lane) + 1, lane)
            if (.not. pieces%is_done) cycle
            extremes%active(lane) = .false.
            if (observer%bounds_functions) call pieces%find_room(extremes%last(:, lane), extremes%room)
            extremes%has_room = observer%bounds_functions
            call observer%find_pace(lane, extremes%fastest(lane), extremes%scale(lane))
          end associate
        end do
      end do
    end do
  end subroutine update_extremes

  !> Observes the active lanes where their parts of the steps begin, if the values there are not known.
  subroutine observe_starts(extremes, observer, steps, attempt, c)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_block_t), intent(in) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: c(:, :, :)
    integer :: lane

    if (.not. any(extremes%active .and. .not. extremes%is_known)) return
    extremes%t(:) = extremes%start
    call observe(extremes, observer, steps, attempt, c)
    do lane = 1, size(extremes%active)
      if (.not. extremes%active(lane) .or. extremes%is_known(lane)) cycle
      extremes%y_lane(:) = extremes%y(lane, :)
      call observer%tracked_values(lane, extremes%t(lane), extremes%y_lane, extremes%last(:, lane))
      call observer%find_pace(lane, extremes%fastest(lane), extremes%scale(lane))
      extremes%is_known(lane) = .true.
    end do
  end subroutine observe_starts

  !> Leaves out the step of a single lane if no function can leave its range in it; else opens the functions that may. As long as
  !> they cannot have come to the ends of their ranges they are not evaluated at all.
  subroutine exclude_step(extremes, observer, steps, attempt, c)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_block_t), intent(in) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: c(:, :, :)
    real(wp), parameter :: far = 0.25_wp * huge(1.0_wp)   ! without a bound
    real(wp) :: fastest, scale   ! at the end of the step
    integer :: last

    associate (pieces => extremes%pieces(1), room => extremes%room, slopes => extremes%slopes)
      pieces%is_open(:, 0) = .true.
      if (.not. extremes%have_begun(1) .or. steps%crosses(1) .or. steps%theta_end(1) < 1) then
        call observe_left(extremes, observer)
        return
      end if
      last = attempt%degree(1) + 1
      call observer%bound_functions(1, steps, attempt%y, c(:, :, :attempt%degree(1)), slopes, extremes%bends)
      room(:) = max(-far, room - min(slopes, far))
      if (extremes%has_room .and. all(room >= 0 .or. slopes <= 0)) then
        ! the values at its end may be asked for
        extremes%left_at = end_of_nodes(extremes%start(1), steps%t_new(1))
        extremes%t(:) = extremes%left_at
        call find_states_at(extremes, steps, attempt, c)
        extremes%left(:, :) = extremes%y
        extremes%has_left_out = .true.
        extremes%is_known(1) = .false.
        extremes%active(1) = .false.
        return
      end if
      extremes%t(:) = end_of_nodes(extremes%start(1), steps%t_new(1))
      call observe(extremes, observer, steps, attempt, c)
      extremes%y_lane(:) = extremes%y(1, :)
      call observer%tracked_values(1, extremes%t(1), extremes%y_lane, extremes%values(:, last, 1))
      call observer%find_pace(1, fastest, scale)
      call pieces%find_room(extremes%values(:, last, 1), extremes%end_room)
      ! a function that starts by r inside its range, and ends by e, cannot leave it if its slope is at most r + e
      if (.not. (extremes%has_room .and. all(room + extremes%end_room >= 0 .or. slopes <= 0))) then
        call observe_left(extremes, observer)
        call observe_starts(extremes, observer, steps, attempt, c)
        call pieces%find_open(extremes%last(:, 1), extremes%values(:, last, 1), slopes, extremes%bends)
        call pieces%include_values(extremes%values(:, last, 1))
        if (any(pieces%is_open(:, 0))) return
        call pieces%find_room(extremes%values(:, last, 1), extremes%end_room)
      end if
      extremes%has_left_out = .false.
      extremes%is_known(1) = .true.
      extremes%last(:, 1) = extremes%values(:, last, 1)
      room(:) = extremes%end_room
      extremes%has_room = .true.
      extremes%fastest(1) = fastest
      extremes%scale(1) = scale
      extremes%active(1) = .false.
    end associate
  end subroutine exclude_step

  !> Observes the end of a step that was left out; to be called before the states are shifted.
  subroutine observe_left(extremes, observer)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer

    if (.not. extremes%has_left_out) return
    extremes%has_left_out = .false.
    extremes%t(:) = extremes%left_at
    call observer%observe_lanes(extremes%t, extremes%left)
    extremes%y_lane(:) = extremes%left(1, :)
    call observer%tracked_values(1, extremes%t(1), extremes%y_lane, extremes%last(:, 1))
    call observer%find_pace(1, extremes%fastest(1), extremes%scale(1))
    extremes%is_known(1) = .true.
  end subroutine observe_left

  !> The time of the last node of a piece, with its rounding [s].
  pure real(wp) function end_of_nodes(begin, end)
    real(wp), intent(in) :: begin, end   !! [s]
    real(wp) :: half

    half = 0.5_wp * (end - begin)
    end_of_nodes = begin + half + half
  end function end_of_nodes

  !> Takes the functions after a jump at the end of a lane: constants in a piece without a length.
  subroutine end_extremes(extremes, observer, attempt, lane)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: lane
    integer :: i

    if (.not. extremes%have_begun(lane)) return
    extremes%t(:) = attempt%t
    extremes%y(:, :) = attempt%y(:, :attempt%components)
    call observer%observe_lanes(extremes%t, extremes%y)
    extremes%y_lane(:) = extremes%y(lane, :)
    call observer%tracked_values(lane, extremes%t(lane), extremes%y_lane, extremes%last(:, lane))
    do i = 2, extremes%degree(lane) + 1
      extremes%values(:, i, lane) = extremes%last(:, lane)
    end do
    extremes%replaced(:) = .true.
    call take_piece(extremes, observer, lane, piece_t(attempt%t(lane), attempt%t(lane), attempt%t(lane), attempt%t(lane), &
                                                      attempt%t(lane)))
  end subroutine end_extremes

  !> Brings the active lanes to the times `t`, the other lanes to where their steps start.
  subroutine observe(extremes, observer, steps, attempt, c)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_block_t), intent(in) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: c(:, :, :)

    call find_states_at(extremes, steps, attempt, c)
    call observer%observe_lanes(extremes%t, extremes%y)
  end subroutine observe

  !> Sets `y` to the states of the active lanes at the times `t`, of the other lanes to where their steps start.
  subroutine find_states_at(extremes, steps, attempt, c)
    type(extremes_t), intent(inout) :: extremes
    type(step_block_t), intent(in) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: c(:, :, :)

    extremes%theta(:) = 0.0_wp
    where (extremes%active) extremes%theta = min(1.0_wp, (extremes%t - steps%t) / steps%h)
    if (attempt%lanes == 1) then
      call find_state(size(attempt%y, 2), attempt%components, extremes%degree(1), extremes%theta(1), attempt%y, c, extremes%y)
    else
      call find_states(attempt%lanes, size(attempt%y, 2), attempt%components, maxval(extremes%degree), extremes%theta, &
                       extremes%active, attempt%y, c, extremes%y)
    end if
  end subroutine find_states_at

  !> The state of a single lane at t + theta h, as `find_states`: with components in vectors.
  pure subroutine find_state(columns, components, degree, theta, start, c, y)
    integer, intent(in) :: columns, components, degree
    real(wp), intent(in) :: theta, start(columns), c(columns, degree)
    real(wp), intent(inout) :: y(components)
    integer :: p

    y = c(:components, degree)
    do p = degree - 1, 1, -1
      y = c(:components, p) + theta * y
    end do
    y = start(:components) + theta * y
  end subroutine find_state

  !> The states of the lanes at t + theta h, the start where a lane is not active.
  pure subroutine find_states(lanes, columns, components, degree, theta, active, start, c, y)
    integer, intent(in) :: lanes, columns, components, degree
    real(wp), intent(in) :: theta(lanes), start(lanes, columns), c(lanes, columns, degree)
    logical, intent(in) :: active(lanes)
    real(wp), intent(inout) :: y(lanes, components)
    integer :: i, p

    do i = 1, components
      y(:, i) = c(:, i, degree)
      do p = degree - 1, 1, -1
        y(:, i) = c(:, i, p) + theta * y(:, i)
      end do
      y(:, i) = merge(start(:, i) + theta * y(:, i), start(:, i), active)
    end do
  end subroutine find_states

  !> Evaluates the functions at the nodes of the pieces of the active lanes; at the first one they are known.
  subroutine sample_pieces(extremes, observer, steps, attempt, c)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    type(step_block_t), intent(in) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: c(:, :, :)
    integer :: i, lane
    real(wp) :: half, t

    do i = 1, maxval(extremes%degree, mask=extremes%active)
      extremes%t(:) = steps%t
      do lane = 1, attempt%lanes
        if (.not. extremes%active(lane)) cycle
        associate (piece => extremes%pieces(lane), degree => extremes%degree(lane))
          ! a node is before a crossing that ends the step: a function may jump there, which would spoil the polynomial
          half = 0.5_wp * (piece%end - piece%begin)
          t = piece%begin + half + extremes%rules(degree)%nodes(min(i, degree)) * half
          if (steps%crosses(lane) .and. piece%end >= steps%t_new(lane)) then
            t = max(piece%begin, min(t, steps%t_new(lane) - before_jump * spacing(steps%t_new(lane))))
          end if
          extremes%t(lane) = t
        end associate
      end do
      call observe(extremes, observer, steps, attempt, c)
      do lane = 1, attempt%lanes
        if (.not. extremes%active(lane) .or. i > extremes%degree(lane)) cycle
        extremes%y_lane(:) = extremes%y(lane, :)
        call observer%tracked_values(lane, extremes%t(lane), extremes%y_lane, extremes%values(:, i + 1, lane))
      end do
    end do
  end subroutine sample_pieces

  !> Gives the polynomials in a piece to the observer, or widens the ranges of a lane by them.
  subroutine take_piece(extremes, observer, lane, piece)
    type(extremes_t), intent(inout) :: extremes
    class(observer_t), intent(inout) :: observer
    integer, intent(in) :: lane
    type(piece_t), intent(in) :: piece

    associate (rule => extremes%rules(extremes%degree(lane)), values => extremes%values(:, :extremes%degree(lane) + 1, lane))
      values(:, 1) = extremes%last(:, lane)
      if (observer%takes_pieces) then
        call observer%on_piece(lane, piece, rule, values, extremes%replaced)
      else
        call widen_ranges(rule, values, extremes%replaced, extremes%ranges(lane), piece%begin, piece%end)
      end if
    end associate
  end subroutine take_piece

  !> Finds the functions whose polynomials count in the present piece of a lane.
  pure subroutine find_replaced(extremes, lane)
    type(extremes_t), intent(inout) :: extremes
    integer, intent(in) :: lane
    real(wp) :: values(0:max_degree)
    integer :: function, i

    associate (pieces => extremes%pieces(lane), degree => extremes%degree(lane))
      extremes%replaced(:) = pieces%is_open(:, pieces%depth)
      do i = 1, size(extremes%bending)
        function = extremes%bending(i)
        if (.not. extremes%replaced(function)) cycle
        values(0) = extremes%last(function, lane)
        values(1:degree) = extremes%values(function, 2:degree + 1, lane)
        call pieces%replaces(function, extremes%rules(degree), values, extremes%scale(lane), extremes%replaced(function))
      end do
    end associate
  end subroutine find_replaced

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
