!> The contract between an integrator and the user of its solution: callbacks for output times, events, extremes and steps.
module nocdyn_observer
  use nocdyn_chebyshev, only: interpolation_t
  use nocdyn_kinds, only: wp
  use nocdyn_plain_steps, only: plain_steps_t
  implicit none (type, external)
  private

  ! Changes of sign that count as an event.
  integer, parameter, public :: event_any = 0        !! every one
  integer, parameter, public :: event_rising = 1     !! from below zero to zero or above
  integer, parameter, public :: event_falling = -1   !! from above zero to zero or below

  !> Receives the solution at the output times, events, extremes and whole steps, and may stop the integration. By default it
  !> receives the output times only, and ignores them.
  !>
  !> An event is a root of a function of time and state, found on the dense output of the steps. The extremes of the tracked
  !> functions are those in continuous time, between the steps too.
  type, public :: observer_t
    integer, allocatable :: directions(:)   !! event_... of each event function; not allocated: there are none
    integer :: tracked = 0                  !! number of tracked functions
    logical, allocatable :: bends(:)        !! whether a tracked function may bend more than the solution; by default none does
    real(wp), allocatable :: tracked_from(:)   !! times from which they are tracked [s], ascending; not allocated: the start
    logical :: takes_pieces = .false.       !! whether `on_piece` receives them, and `on_extremes` nothing
    logical :: bounds_functions = .false.   !! whether `bound_functions` is asked, of a single lane; only extremes are then taken
    logical :: wants_steps = .false.        !! whether `on_steps` is called
    logical :: takes_shifts = .false.       !! whether `on_shift` is overridden; a system shifts no states without
    integer :: first_read = 1               !! components whose polynomials `on_steps` reads; may change from variant to variant
    integer :: last_read = huge(0)
  contains
    procedure :: on_start, on_output, wants_stop, event_values, on_event
    procedure :: observe_lanes, tracked_values, bound_functions, find_pace, on_extremes, on_piece, on_steps, on_shift, on_jump
    procedure :: list_ranges
  end type observer_t

  !> The steps that the lanes of a block have taken together; [lanes].
  type, public :: step_block_t
    logical :: are_all_taken = .false.      !! whether all lanes have taken a step
    logical, allocatable :: taken(:)        !! whether the lane has taken a step; only then it has dense output
    logical, allocatable :: crosses(:)      !! whether the step ends where the system changes its branch
    integer, allocatable :: degree(:)       !! of the dense output, the largest one of the block at most
    real(wp), allocatable :: t(:)           !! start [s]
    real(wp), allocatable :: h(:)           !! step size [s]: theta = (time - t) / h
    real(wp), allocatable :: scale(:)       !! the solution is a polynomial in scale * theta: scale is 1 or h
    real(wp), allocatable :: theta_end(:)   !! end of the step: 1, or less where it was cut
    real(wp), allocatable :: t_new(:)       !! end [s]
  end type step_block_t

  !> A piece of a step, in which polynomials replace the tracked functions.
  type, public :: piece_t
    real(wp) :: begin = 0.0_wp, end = 0.0_wp            !! [s]
    real(wp) :: from = 0.0_wp                           !! where the part of the step begins to which it belongs [s]
    real(wp) :: step_start = 0.0_wp, step_end = 0.0_wp  !! [s]
  end type piece_t

  !> Smallest and largest values of the tracked functions from the first time in `tracked_from` on, with their times [s];
  !> [functions].
  type, public :: ranges_t
    real(wp), allocatable :: lowest(:), lowest_time(:), highest(:), highest_time(:)
  end type ranges_t

contains

  !> A lane starts at (t, y): the system has its parameters and has chosen its branches. Where these do not hold, the state jumps
  !> at once.
  subroutine on_start(self, lane, t, y)
    class(observer_t), target, intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! before such a jump, [states + quadratures]
  end subroutine on_start

  !> Lists the ranges that plain steps widen; then `on_steps` is not called for them.
  subroutine list_ranges(self, order, steps, are_all)
    class(observer_t), target, intent(inout) :: self
    integer, intent(in) :: order                    !! of the series
    type(plain_steps_t), intent(inout) :: steps
    logical, intent(out) :: are_all                 !! whether the observer needs no more of such a step

    are_all = .not. self%wants_steps
  end subroutine list_ranges

  !> One output time of one lane; the calls of a lane come in the order of the times.
  subroutine on_output(self, lane, t, y)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
  end subroutine on_output

  !> Asked after every step attempt while a lane is running: true ends the integration of all lanes.
  function wants_stop(self, t)
    class(observer_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! time that the slowest lane has reached
    logical :: wants_stop

    wants_stop = .false.
  end function wants_stop

  !> The event functions g(t, y) of one lane.
  subroutine event_values(self, lane, t, y, g)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)      !! [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [size(directions)]

    error stop 'nocdyn_observer: an observer with events overrides event_values'
  end subroutine event_values

  !> An event of one lane. Events and output times of a lane come in the order of the times.
  subroutine on_event(self, lane, event, t, y, is_terminal)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: event                !! index of the event function
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)    !! state at the event
    logical, intent(out) :: is_terminal         !! true ends the integration of this lane here

    is_terminal = .false.
  end subroutine on_event

  !> All lanes at the times and states at which `tracked_values` is asked next; lanes without a step are where they start.
  subroutine observe_lanes(self, t, y)
    class(observer_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states + quadratures]
  end subroutine observe_lanes

  !> The tracked functions of one lane.
  subroutine tracked_values(self, lane, t, y, values)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)           !! [states + quadratures]
    real(wp), contiguous, intent(inout) :: values(:)   !! [tracked]

    error stop 'nocdyn_observer: an observer with tracked functions overrides tracked_values'
  end subroutine tracked_values

  !> Bounds of the sizes of the first two derivatives of the tracked functions in the last step of a lane by theta. Steps in which
  !> they show that no function can leave its range so far are not sampled.
  subroutine bound_functions(self, lane, steps, y, c, slopes, bends)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :)      !! at the starts, [lanes, padded columns]
    real(wp), contiguous, intent(in) :: c(:, :, :)   !! solution y + sum over p of c(:, :, p) theta^p
    real(wp), intent(out) :: slopes(:), bends(:)     !! huge if there is none, [tracked]

    slopes = huge(slopes)
    bends = huge(bends)
  end subroutine bound_functions

  !> How fast tracked functions that bend may oscillate with the time, or with angles, where they were evaluated last, and a size
  !> of which a small part is rounding in them.
  subroutine find_pace(self, lane, fastest, scale)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: fastest   !! [rad/s]
    real(wp), intent(out) :: scale     !! in the unit of the functions

    fastest = 0.0_wp
    scale = 0.0_wp
  end subroutine find_pace

  !> The ranges of the tracked functions when a lane has ended; not called if it has ended before they are tracked.
  subroutine on_extremes(self, lane, ranges)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(ranges_t), intent(in) :: ranges

    error stop 'nocdyn_observer: an observer with tracked functions overrides on_extremes'
  end subroutine on_extremes

  !> The tracked functions in a piece of a step of one lane; the pieces of a lane come in the order of the times. If there are
  !> several times in `tracked_from`, the part of a step from each of them on comes too, with its own pieces.
  subroutine on_piece(self, lane, piece, rule, values, replaced)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(piece_t), intent(in) :: piece
    type(interpolation_t), intent(in) :: rule
    real(wp), contiguous, intent(in) :: values(:, :)   !! at its nodes, [tracked, nodes]
    logical, intent(in) :: replaced(:)                 !! functions that the polynomials replace here; others come in halves of it

    error stop 'nocdyn_observer: an observer that takes pieces overrides on_piece'
  end subroutine on_piece

  !> The last steps of the lanes, after their output times and events: y + sum over p of c(:, :, p) (scale theta)^p.
  subroutine on_steps(self, steps, y, y_new, c)
    class(observer_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :)       !! at the starts, [lanes, padded columns]
    real(wp), contiguous, intent(in) :: y_new(:, :)   !! at the ends
    real(wp), contiguous, intent(in) :: c(:, :, :)    !! [lanes, padded columns, degree]; only columns first_read to last_read

    error stop 'nocdyn_observer: an observer that wants steps overrides on_steps'
  end subroutine on_steps

  !> The system has taken a shift out of the state of a lane: from now on each y of this lane stands for y + all shifts so far.
  subroutine on_shift(self, lane, shift)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: shift(:)   !! [states + quadratures]
  end subroutine on_shift

  !> The state of a lane may have jumped to (t, y), after the end of a step or at the start.
  subroutine on_jump(self, lane, t, y)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
  end subroutine on_jump

end module nocdyn_observer
