!> The contract between a model and an integrator: a first-order system on a block of lanes.
!>
!> A block holds `lanes` copies of one system with different parameters. The lane is the first, contiguous index of every array,
!> so that each operation is a loop over lanes; one machine is a block of one lane. A lane never reads the values of another lane.
!>
!> The last `quadratures` components of a state are pure integrals: the derivative depends on none of them. Their errors are
!> controlled loosely: over all steps they add up to about a ten-thousandth of what they change by in all. Linear systems have
!> only the first `states` components.
!>
!> The Jacobian is a list of values at the positions that `jacobian_pattern` returns once, before the integration. By default
!> these are all positions, column by column.
!>
!> A system may provide the Taylor series of its solution, which the method `taylor` needs; by default it does not.
!>
!> The error of a step is measured in the states, each relative to its own size, unless the system names quantities of its own in
!> which it is measured: combinations of the states that matter, such as differences of large numbers. If its equations stay the
!> same when some states are shifted together, it may keep such a shift apart, so that those states stay small and keep their
!> digits.
module nocdyn_system
  use nocdyn_kinds, only: wp
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  ! What an evaluation returns for each lane.
  integer, parameter, public :: evaluation_ok = 0            !! the values are good
  integer, parameter, public :: evaluation_recoverable = 1   !! not admissible here: a shorter step may help
  integer, parameter, public :: evaluation_fatal = 2         !! no shorter step will help

  !> Positions of the entries of the Jacobian that can differ from zero, each at most once, in the order of their values.
  type, public :: pattern_t
    integer, allocatable :: row(:)      !! 1 to states + quadratures
    integer, allocatable :: column(:)   !! 1 to states
  end type pattern_t

  !> An ordinary differential equation y' = f(t, y) on a block of lanes, with its derivatives.
  type, abstract, public :: system_t
    integer :: lanes = 1         !! copies of the system in the block
    integer :: states = 0        !! components that the equations depend on
    integer :: quadratures = 0   !! components after the states that are integrals only
    integer :: switches = 0      !! indicator functions: a step ends where one of them falls through zero
    integer :: measures = 0      !! quantities in which `measure` measures errors; 0: in the states
    integer :: phases = 0        !! the last of these: angles excluded from the estimate of the first step
    logical :: hides_bends = .false. !! whether the series can miss a sharp transition, as of tanh
    logical :: is_shared = .false.   !! whether its lanes are variants of a sweep, which changes the cost model
    logical :: may_shift = .false.   !! whether `find_far` is called after every step
    logical :: projects = .false.    !! whether `project_state` is called after every step
    logical :: limits_steps = .false. !! whether `limit_steps` is called before every step
    logical :: follows_waves = .false.  !! whether indicators may oscillate where the state hardly moves: `find_fastest_wave`
    logical :: has_block_indicators = .false.   !! whether `block_indicators` is overridden; else lanes are looked at one by one
  contains
    procedure(derivative_interface), deferred :: derivative
    procedure(jacobian_interface), deferred :: jacobian
    procedure :: jacobian_pattern, component_name, prepare_integration, measure, measure_name, find_far
    procedure :: project_state, evaluation_obstacle, limit_steps, shift_state, restore_state, series_obstacle
    procedure :: prepare_series, series, evaluation_cost, series_cost, start_lane, indicator_values
    procedure :: takes_plain_steps, take_plain_steps, change_plain_branches
    procedure :: set_indicator, block_indicators, find_fastest_wave, find_fastest_waves, change_branch, switch_name
  end type system_t

  abstract interface

    !> dydt = f(t, y). The shapes are explicit so that a call passes addresses and no descriptors.
    subroutine derivative_interface(self, t, y, dydt, status)
      import :: system_t, wp
      class(system_t), intent(inout) :: self
      real(wp), intent(in) :: t(self%lanes)                                         !! time of each lane [s]
      real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
      real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
      integer, intent(inout) :: status(self%lanes)                                  !! `evaluation_ok` on entry
    end subroutine derivative_interface

    !> Partial derivatives of f by the states, at the positions of `jacobian_pattern`, and by the time.
    subroutine jacobian_interface(self, t, y, dfdy, dfdt, status)
      import :: system_t, wp
      class(system_t), intent(inout) :: self
      real(wp), intent(in) :: t(self%lanes)                                         !! time of each lane [s]
      real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
      real(wp), contiguous, intent(inout) :: dfdy(:, :)                             !! [lanes, positions]
      real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
      integer, intent(inout) :: status(self%lanes)                                  !! `evaluation_ok` on entry
    end subroutine jacobian_interface

  end interface

contains

  !> All positions, column by column: dfdy then has the memory layout of an array [lanes, components, states].
  function jacobian_pattern(self) result(pattern)
    class(system_t), intent(in) :: self
    type(pattern_t) :: pattern
    integer :: i, j

    associate (components => self%states + self%quadratures)
      pattern = pattern_t([((i, i=1, components), j=1, self%states)], [((j, i=1, components), j=1, self%states)])
    end associate
  end function jacobian_pattern

  !> The name of component `index` in messages, e.g. "speed of 'motor'".
  function component_name(self, index) result(name)
    class(system_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to states + quadratures
    character(len=:), allocatable :: name

    name = 'component ' // to_text(index)
    if (index > self%states) name = 'quadrature ' // to_text(index - self%states)
  end function component_name

  !> Called once before an integration, with its tolerances and its end; by default it does nothing.
  subroutine prepare_integration(self, rtol, atol, t_end)
    class(system_t), intent(inout) :: self
    real(wp), intent(in) :: rtol, atol   !! positive
    real(wp), intent(in) :: t_end        !! [s]
  end subroutine prepare_integration

  !> The sizes of the measured quantities at the state y, by which errors are judged, and an error of the state in these
  !> quantities, to which it contributes linearly.
  subroutine measure(self, columns, y, error, sizes, errors)
    class(system_t), intent(in) :: self
    integer, intent(in) :: columns   !! at least `states`
    real(wp), intent(in), dimension(self%lanes, columns) :: y, error
    real(wp), intent(inout), dimension(self%lanes, self%measures) :: sizes, errors   !! of any sign

    error stop 'nocdyn_system: a system with measures overrides measure'
  end subroutine measure

  !> The name of a measured quantity in messages, e.g. "twist of 'shaft'"; the state's name if the states are measured.
  function measure_name(self, index) result(name)
    class(system_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to measures, or to states
    character(len=:), allocatable :: name

    name = self%component_name(index)
  end function measure_name

  !> Finds the lanes whose states should be shifted; called after every step if `may_shift`.
  subroutine find_far(self, columns, y, is_far)
    class(system_t), intent(in) :: self
    integer, intent(in) :: columns   !! at least `states`
    real(wp), intent(in) :: y(self%lanes, columns)
    logical, intent(inout) :: is_far(self%lanes)

    is_far = .false.
  end subroutine find_far

  !> Puts the state of a lane after a step back on the invariants of the equations, which it has left by the error of the step.
  subroutine project_state(self, lane, t, y)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]
  end subroutine project_state

  !> Why the equations of a lane cannot be evaluated, or hardly, where they were evaluated last; '' if nothing is known.
  function evaluation_obstacle(self, lane) result(text)
    class(system_t), intent(in) :: self
    integer, intent(in) :: lane
    character(len=:), allocatable :: text

    text = ''
  end function evaluation_obstacle

  !> Shortens steps that would be too long for the search of crossings: it looks at a few times in each, however little the state
  !> bends. By default none are.
  subroutine limit_steps(self, columns, y, longest)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: columns   !! at least `states`
    real(wp), intent(in) :: y(self%lanes, columns)
    real(wp), intent(inout) :: longest(self%lanes)   !! longest steps of the lanes [s]
  end subroutine limit_steps

  !> Takes a shift out of the state of a lane, which from now on stands for y + shift, and keeps it until `restore_state`.
  subroutine shift_state(self, lane, y, shift)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:, :)    !! [lanes, columns]
    real(wp), contiguous, intent(inout) :: shift(:)   !! [states + quadratures]

    error stop 'nocdyn_system: a system that shifts its states overrides shift_state'
  end subroutine shift_state

  !> Puts all shifts of a lane that has ended back into its state.
  subroutine restore_state(self, lane, y)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]
  end subroutine restore_state

  !> The reason why the solution has no Taylor series, e.g. "coupling 'x' has no Taylor series"; empty if it has one. No function,
  !> because threads call it (`string_t` says more).
  subroutine series_obstacle(self, obstacle)
    class(system_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = 'the system has no Taylor series'
  end subroutine series_obstacle

  !> Allocates what `series` needs for an order; called once, before the integration.
  subroutine prepare_series(self, order)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: order   !! at least 2

    error stop 'nocdyn_system: a system with a Taylor series overrides prepare_series'
  end subroutine prepare_series

  !> The Taylor coefficients y^(k)(t) / k!, k = 1 to order, of the solution through (t, y(:, :, 0)).
  subroutine series(self, order, columns, t, y, status)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: order     !! as in `prepare_series`
    integer, intent(in) :: columns   !! states + quadratures, and padding
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)
    integer, intent(inout) :: status(self%lanes)   !! `evaluation_ok` on entry

    error stop 'nocdyn_system: a system with a Taylor series overrides series'
  end subroutine series

  !> The cost of an evaluation of f in a lane, in the unit of `nocdyn_step_costs`; the default is the cost of a chain of bodies.
  pure real(wp) function evaluation_cost(self) result(cost)
    class(system_t), intent(in) :: self

    cost = 60.0_wp + 0.9_wp * self%states
  end function evaluation_cost

  !> The cost of a Taylor series in a lane, in the same unit.
  pure real(wp) function series_cost(self, order) result(cost)
    class(system_t), intent(in) :: self
    integer, intent(in) :: order

    cost = order * (250.0_wp + 0.1_wp * self%states)
  end function series_cost

  !> Whether `take_plain_steps` may be called now.
  pure logical function takes_plain_steps(self)
    class(system_t), intent(in) :: self

    takes_plain_steps = .false.
  end function takes_plain_steps

  !> Takes a step of the method `taylor` in the running lanes where nothing has to be decided.
  subroutine take_plain_steps(self, steps)
    class(system_t), intent(inout) :: self
    type(plain_steps_t), intent(inout) :: steps   !! without the map to the measures

    error stop 'nocdyn_system: a system that takes plain steps overrides take_plain_steps'
  end subroutine take_plain_steps

  !> After `take_plain_steps` and a shift of the states: puts lanes whose steps have ended at boundaries on their next branches
  !> where that is simple, and changes the sign of `crossed` there.
  subroutine change_plain_branches(self, steps)
    class(system_t), intent(inout) :: self
    type(plain_steps_t), intent(in) :: steps
  end subroutine change_plain_branches

  !> Called where a lane starts, at (t, y): a system with switches chooses its branches here.
  subroutine start_lane(self, lane, t, y)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
  end subroutine start_lane

  !> The indicator functions of a lane, which are positive inside its branches.
  subroutine indicator_values(self, lane, t, y, g)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)      !! [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]

    error stop 'nocdyn_system: a system with switches overrides indicator_values'
  end subroutine indicator_values

  !> Sets one indicator function of a lane; by default all are evaluated.
  subroutine set_indicator(self, which, lane, t, y, g)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: which, lane            !! index of the indicator function; lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)      !! [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches], of which g(which) is set at least

    call self%indicator_values(lane, t, y, g)
  end subroutine set_indicator

  !> The indicator functions of all lanes, with the same bits as `indicator_values`.
  subroutine block_indicators(self, columns, t, y, g)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: columns   !! at least `states`
    real(wp), intent(in) :: t(self%lanes), y(self%lanes, columns)
    real(wp), intent(inout) :: g(self%lanes, self%switches)

    error stop 'nocdyn_system: a system with block indicators overrides block_indicators'
  end subroutine block_indicators

  !> The largest rate at which the indicators of a lane oscillate at a state [rad/s], other than by its own oscillations; 0 by
  !> default. Crossings are looked for at several times in each of these oscillations, and where indicators bend towards zero.
  subroutine find_fastest_wave(self, lane, y, fastest)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp), intent(out) :: fastest

    fastest = 0.0_wp
  end subroutine find_fastest_wave

  !> `find_fastest_wave` of all lanes; a system with block indicators that follows waves overrides it.
  subroutine find_fastest_waves(self, columns, y, fastest)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: columns   !! at least `states`
    real(wp), intent(in) :: y(self%lanes, columns)
    real(wp), intent(inout) :: fastest(self%lanes)

    fastest = 0.0_wp
  end subroutine find_fastest_waves

  !> A lane changes to the branch on the other side of an indicator's zero. The indicator must be zero or positive there
  !> afterwards. A boundary that is moved outwards a little, so that it is positive, prevents that rounding crosses back. The
  !> state may jump.
  subroutine change_branch(self, lane, which, t, y)
    class(system_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which               !! index of the indicator function
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]

    error stop 'nocdyn_system: a system with switches overrides change_branch'
  end subroutine change_branch

  !> The name of indicator function `which` in messages, e.g. "gap of 'coupling'".
  function switch_name(self, which) result(name)
    class(system_t), intent(in) :: self
    integer, intent(in) :: which
    character(len=:), allocatable :: name

    name = 'switch ' // to_text(which)
  end function switch_name

end module nocdyn_system
