!> The contract between a model and an integrator: a first-order system on a block of lanes.
!>
!> A block holds `lanes` copies of one system with different numbers. Every array has the lane as its first,
!> contiguous index, so that each operation is a loop over lanes; one machine is a block of one lane. A lane
!> never reads another lane's numbers.
!>
!> The last `quadratures` components of a state are pure integrals: nothing depends on them, and error control is lenient
!> with them: a thousand times, relative to the largest of them. An integrator solves linear systems only for the first
!> `states` components.
!>
!> The Jacobian is a list of values at the positions that `jacobian_pattern` names once, before the integration: all
!> of them column by column unless a system knows better.
!>
!> A system may give the Taylor series of its solution, for methods that are made of it; by default it has none.
module nocdyn_system
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  integer, parameter, public :: evaluation_ok = 0       !! the values are good
  integer, parameter, public :: evaluation_recoverable = 1    !! not admissible here: take a shorter step
  integer, parameter, public :: evaluation_fatal = 2    !! no shorter step will help

  !> Positions of the Jacobian's entries that can differ from zero, each at most once, in the order of their values.
  type, public :: pattern_t
    integer, allocatable :: row(:)      !! 1 to states + quadratures
    integer, allocatable :: column(:)   !! 1 to states
  end type pattern_t

  !> An ordinary differential equation y' = f(t, y) on a block of lanes, with its derivatives.
  type, abstract, public :: system_t
    integer :: lanes = 1         !! copies of the system in the block
    integer :: states = 0        !! components that the equations depend on
    integer :: quadratures = 0   !! components that follow them and only accumulate
    integer :: switches = 0      !! functions whose fall through zero ends a step
  contains
    procedure(derivative_interface), deferred :: derivative
    procedure(jacobian_interface), deferred :: jacobian
    procedure :: jacobian_pattern
    procedure :: component_name
    procedure :: series_obstacle
    procedure :: prepare_series
    procedure :: series
    procedure :: start_lane
    procedure :: indicator_values
    procedure :: change_branch
    procedure :: switch_name
  end type system_t

  integer, parameter, public :: event_any = 0       !! every change of sign
  integer, parameter, public :: event_rising = 1    !! from below zero to zero or above
  integer, parameter, public :: event_falling = -1

  !> Receives the solution at the requested times, is told of events and extremes, and may stop the integration.
  !>
  !> An event is a root of a function of time and state, found on the solution inside the steps. The tracked functions
  !> are followed between the steps too: `on_extremes` receives their extremes in continuous time. An observer that
  !> `wants_steps` is handed the solution inside every step of the whole block. By default an observer wants to know nothing.
  type, public :: observer_t
    integer, allocatable :: directions(:)   !! event_... of each event function; not allocated: there are none
    integer :: tracked = 0                  !! number of tracked functions
    logical :: wants_steps = .false.      !! whether `on_steps` is called
    integer :: first_read = 1           !! components whose polynomials it reads; may change from variant to variant
    integer :: last_read = huge(0)
  contains
    procedure :: on_output
    procedure :: wants_stop
    procedure :: event_values
    procedure :: on_event
    procedure :: tracked_values
    procedure :: on_extremes
    procedure :: on_steps
  end type observer_t

  !> The steps that the lanes of a block have taken at the same time; [lanes].
  type, public :: step_block_t
    logical :: are_all_taken = .false.   !! whether all lanes have moved
    logical :: may_be_cut = .false.      !! whether `theta_end` may be less than 1
    logical, allocatable :: taken(:)     !! whether the lane has moved: the solution inside the step is given then
    logical, allocatable :: crosses(:)   !! whether the step ends where the system changes its branch
    real(wp), allocatable :: t(:)        !! start
    real(wp), allocatable :: h(:)        !! theta = (time - t) / h is the place in the step
    real(wp), allocatable :: scale(:)    !! the solution is a polynomial in scale * theta: scale is 1 or h
    real(wp), allocatable :: theta_end(:)    !! end as a place: 1, or less where the step was cut
    real(wp), allocatable :: t_new(:)    !! end as a time
  end type step_block_t

  !> Smallest and largest values of the tracked functions so far, with their times; [functions].
  type, public :: ranges_t
    real(wp), allocatable :: lowest(:), lowest_time(:), highest(:), highest_time(:)
  end type ranges_t

  abstract interface

    !> dydt = f(t, y). The shapes are explicit, so that a call hands over nothing but addresses.
    subroutine derivative_interface(self, t, y, dydt, status)
      import :: system_t, wp
      class(system_t), intent(inout) :: self
      real(wp), intent(in) :: t(self%lanes)                                         !! time of each lane
      real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
      real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
      integer, intent(inout) :: status(self%lanes)                                  !! evaluation_fine on entry
    end subroutine derivative_interface

    !> Partial derivatives of f with respect to the states, at the positions of `jacobian_pattern`, and to the time.
    subroutine jacobian_interface(self, t, y, dfdy, dfdt, status)
      import :: system_t, wp
      class(system_t), intent(inout) :: self
      real(wp), intent(in) :: t(self%lanes)
      real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
      real(wp), contiguous, intent(inout) :: dfdy(:, :)                             !! [lanes, positions]
      real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
      integer, intent(inout) :: status(self%lanes)                                  !! evaluation_fine on entry
    end subroutine jacobian_interface

  end interface

contains

  !> All positions, column by column: dfdy may then be taken for an array of the shape [lanes, components, states].
  function jacobian_pattern(self) result(pattern)
    class(system_t), intent(in) :: self
    type(pattern_t) :: pattern
    integer :: i, j

    associate (components => self%states + self%quadratures)
      allocate (pattern%row(components * self%states), pattern%column(components * self%states))
      do j = 1, self%states
        do i = 1, components
          pattern%row(i + (j - 1) * components) = i
          pattern%column(i + (j - 1) * components) = j
        end do
      end do
    end associate
  end function jacobian_pattern

  !> What component `index` is called in a message, e.g. "speed of 'motor'".
  function component_name(self, index) result(name)
    class(system_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    name = 'component ' // to_text(index)
    if (index > self%states) name = 'quadrature ' // to_text(index - self%states)
  end function component_name

  !> Why there is no Taylor series of the solution, e.g. "coupling 'x' has no Taylor series"; empty if there is one.
  function series_obstacle(self) result(obstacle)
    class(system_t), intent(in) :: self
    character(len=:), allocatable :: obstacle

    obstacle = 'the system has no Taylor series'
  end function series_obstacle

  !> Allocates what `series` needs up to an order; called once, before the integration.
  subroutine prepare_series(self, order)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: order   !! at least 2

    error stop 'nocdyn_system: a system with a Taylor series overrides prepare_series'
  end subroutine prepare_series

  !> The Taylor coefficients y^(k)(t) / k!, k = 1 to order, of the solution through (t, y(:, :, 0)).
  subroutine series(self, order, columns, t, y, status)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: order     !! that of `prepare_series`
    integer, intent(in) :: columns   !! states + quadratures, and padding
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)
    integer, intent(inout) :: status(self%lanes)   !! evaluation_fine on entry

    error stop 'nocdyn_system: a system with a Taylor series overrides series'
  end subroutine series

  !> A lane starts at (t, y): the place to choose its branches.
  subroutine start_lane(self, lane, t, y)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
  end subroutine start_lane

  !> The functions that are positive while the branches of a lane hold.
  subroutine indicator_values(self, lane, t, y, g)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)      !! [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]

    error stop 'nocdyn_system: a system with switches overrides switch_values'
  end subroutine indicator_values

  !> A lane goes to the branch beyond a function, whose value here must be zero or positive then. A border that is
  !> widened a little, so that it is positive, keeps rounding from crossing back.
  subroutine change_branch(self, lane, which, t, y)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which               !! number of the function
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]

    error stop 'nocdyn_system: a system with switches overrides cross'
  end subroutine change_branch

  !> What function `which` is called in a message, e.g. "gap of 'coupling'".
  function switch_name(self, which) result(name)
    class(system_t), intent(in) :: self
    integer, intent(in) :: which
    character(len=:), allocatable :: name

    name = 'switch ' // to_text(which)
  end function switch_name

  !> One requested time of one lane; the calls of a lane come in the order of its times.
  subroutine on_output(self, lane, t, y)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
  end subroutine on_output

  !> Asked after every attempted step while a lane is running: true ends the integration of all lanes.
  function wants_stop(self, t)
    class(observer_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! time reached by the slowest lane
    logical :: wants_stop

    wants_stop = .false.
  end function wants_stop

  !> The event functions g(t, y) of one lane, [size(directions)].
  subroutine event_values(self, lane, t, y, g)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)      !! [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)

    error stop 'nocdyn_system: an observer with events overrides event_values'
  end subroutine event_values

  !> An event of one lane; events and records of a lane come in the order of their times.
  subroutine on_event(self, lane, event, t, y, is_terminal)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: event                !! number of the event function
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)    !! state at the event
    logical, intent(out) :: is_terminal         !! true ends the integration of this lane here

    is_terminal = .false.
  end subroutine on_event

  !> The tracked functions of one lane, [tracked].
  subroutine tracked_values(self, lane, t, y, values)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)    !! [states + quadratures]
    real(wp), contiguous, intent(inout) :: values(:)

    error stop 'nocdyn_system: an observer with tracked functions overrides tracked_values'
  end subroutine tracked_values

  !> The ranges of the tracked functions when a lane has ended.
  subroutine on_extremes(self, lane, ranges)
    class(observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(ranges_t), intent(in) :: ranges

    error stop 'nocdyn_system: an observer with tracked functions overrides take_ranges'
  end subroutine on_extremes

  !> The last steps of the lanes, after their records and events: y + sum over p of c(:, :, p) (scale theta)^p.
  subroutine on_steps(self, steps, y, y_new, c)
    class(observer_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :)       !! at the starts, [lanes, padded columns]
    real(wp), contiguous, intent(in) :: y_new(:, :)   !! at the ends
    real(wp), contiguous, intent(in) :: c(:, :, :)    !! [lanes, padded columns, degree]; only of the components followed

    error stop 'nocdyn_system: an observer that follows the steps overrides follow_steps'
  end subroutine on_steps

end module nocdyn_system
