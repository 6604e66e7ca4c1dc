!> A machine as a first-order system: the common part of the three formulations.
module nocdyn_formulation
  use nocdyn_error_measures, only: error_measures_t
  use nocdyn_joint_sets, only: joint_sets_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t, new_machine_state
  use nocdyn_system, only: system_t
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: observe_elements, start_branches, indicate_branch, choose_branch   ! for extensions that add to them

  !> Extensions choose the mechanical states, the first of which are the speeds and angles of some bodies. The internal states
  !> of the elements follow. If there is an energy balance, the work integrals of the elements `machine%with_work` come last, as
  !> quadratures.
  type, abstract, extends(system_t), public :: formulation_t
    type(machine_t) :: machine
    type(machine_state_t) :: state           !! of `machine`
    integer, allocatable :: moving(:)        !! bodies whose speeds and then angles are the first states
    integer :: mechanical = 0                !! number of states before the internal states
    integer :: internal = 0                  !! number of internal states
    logical :: has_energy_balance = .true.   !! whether the powers of the elements `machine%with_work` are integrated
    real(wp), allocatable :: phi(:, :)       !! angles [rad] after `set_state`, [lanes, 0:bodies], body 0 is the ground
    real(wp), allocatable :: omega(:, :)     !! speeds [rad/s] after `set_state`, [lanes, 0:bodies]
    real(wp), allocatable :: zero_twist(:, :)   !! twists where the angles in the state are zero [rad], [lanes, elements]
    real(wp), allocatable :: driven_rate(:)     !! rates of the elements by drives of a steady state; not allocated: none,
                                                !! [elements]
    type(error_measures_t) :: norm              !! quantities in which errors are measured
    type(joint_sets_t) :: joints                !! clutches and freewheels; see `joint_formulation_t`
    real(wp), allocatable, private :: lane_state(:)   !! the state of one lane, work space, [states]
    real(wp), allocatable :: torque(:, :)    !! torques of the elements on the bodies [N m] after `observe`, [lanes, 0:bodies]
  contains
    procedure(formulate_interface), deferred :: formulate
    procedure(start_interface), deferred :: start
    procedure(set_state_interface), deferred :: set_state
    procedure(reactions_interface), deferred :: reactions
    procedure(motion_interface), deferred :: switch_motion
    procedure :: allocate_state, turn_drives, set_norm, gather, reset_origin, angle_at_zero, twist_at_zero, component_name
    procedure :: measure, measure_name
    procedure :: observe => observe_elements
    procedure :: refresh_lane, refresh_laws
    procedure :: start_lane => start_branches
    procedure :: limit_steps, fastest_wave, indicator_values
    procedure :: set_indicator => indicate_branch
    procedure :: change_branch => change_to_branch
    procedure :: switch_name
  end type formulation_t

  abstract interface

    !> Forms the equations of `machine`, after any change of its structure.
    subroutine formulate_interface(self, with_energy_balance)
      import :: formulation_t
      class(formulation_t), intent(inout) :: self
      logical, intent(in) :: with_energy_balance   !! whether the powers of the elements `machine%with_work` are integrated
    end subroutine formulate_interface

    !> The start state of the machine, [lanes, states + quadratures].
    function start_interface(self) result(y)
      import :: formulation_t, wp
      class(formulation_t), intent(in) :: self
      real(wp), allocatable :: y(:, :)
    end function start_interface

    !> Fills `phi`, `omega` and the internal states of the elements from the state.
    subroutine set_state_interface(self, y)
      import :: formulation_t, wp
      class(formulation_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states + quadratures], or without the quadratures
    end subroutine set_state_interface

    !> Reactions of all constraint rows of one lane, after `observe`.
    subroutine reactions_interface(self, lane, lambda)
      import :: formulation_t, wp
      class(formulation_t), intent(inout) :: self
      integer, intent(in) :: lane
      real(wp), intent(out) :: lambda(:)   !! multipliers in the units of `machine%constraints`, [rows]
    end subroutine reactions_interface

    !> Relative angle and speed of the element of a switch, from the state of one lane.
    pure subroutine motion_interface(self, lane, switch, y, motion)
      import :: formulation_t, wp
      class(formulation_t), intent(in) :: self
      integer, intent(in) :: lane
      integer, intent(in) :: switch              !! 1 to `switches`
      real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
      real(wp), intent(out) :: motion(4)         !! angle [rad] and speed [rad/s] of its element, then of the phase if it has one
    end subroutine motion_interface

  end interface

contains

  !> Counts the states of `machine` and allocates the arrays of the bodies.
  subroutine allocate_state(self, moving, mechanical, with_energy_balance)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: moving(:)             !! bodies whose speeds and then angles are the first states
    integer, intent(in) :: mechanical            !! number of states before the internal states
    logical, intent(in) :: with_energy_balance   !! whether the powers of the elements `machine%with_work` are integrated

    associate (machine => self%machine)
      self%state = new_machine_state(machine)
      self%moving = moving
      self%mechanical = mechanical
      self%internal = machine%elements%internal%count
      self%states = self%mechanical + self%internal
      self%switches = machine%switches%count
      self%limits_steps = any(machine%switches%phase_order > 0)
      self%lane_state = spread(0.0_wp, 1, self%states)
      self%lanes = machine%lanes
      self%has_energy_balance = with_energy_balance
      self%quadratures = merge(size(machine%with_work), 0, with_energy_balance)
      if (allocated(self%phi)) deallocate (self%phi, self%omega, self%torque)
      allocate (self%phi(machine%lanes, 0:machine%bodies), source=0.0_wp)
      allocate (self%omega, self%torque, source=self%phi)
      if (allocated(machine%driven_speed)) self%driven_rate = machine%driven_rates()
    end associate
  end subroutine allocate_state

  !> Gives the bodies other speeds by drives.
  subroutine turn_drives(self, driven_speed)
    class(formulation_t), intent(inout) :: self   !! of a steady state, with drives
    real(wp), intent(in) :: driven_speed(:)       !! [rad/s], [bodies]

    self%machine%driven_speed = driven_speed
    self%driven_rate = self%machine%driven_rates()
  end subroutine turn_drives

  !> Name of a component of the state, for messages.
  function component_name(self, index) result(name)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    associate (n => size(self%moving), names => self%machine%names)
      if (index <= n) then
        name = 'speed of ' // quoted(names(self%moving(index))%text)
      else if (index <= 2 * n) then
        name = 'angle of ' // quoted(names(self%moving(index - n))%text)
      else if (index <= self%mechanical) then
        name = 'elastic moment on ' // quoted(names(self%moving(index - 2 * n))%text)
      else if (index <= self%states) then
        name = self%machine%internal_name(index - self%mechanical)
      else
        name = 'work of ' // quoted(self%machine%element_name(self%machine%with_work(index - self%states)))
      end if
    end associate
  end function component_name

  !> Evaluates bodies, elements and torques at a state, so that they and the reactions can be read.
  !>
  !> The branches of the laws are chosen by the state: `keep_branches` of the state keeps the branches of an integration.
  subroutine observe_elements(self, t, y, in_motion)
    class(formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)          !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)       !! [lanes, states], at least
    logical, intent(in), optional :: in_motion        !! whether joints keep their modes; absent or false: by the state

    call self%gather(y)
    if (self%switches > 0) call self%state%choose_branches(self%machine, t)
    call self%state%evaluate_elements(self%machine, t)
    call self%state%elements%scatter(self%machine%elements%rows, self%torque)
  end subroutine observe_elements

  !> Sets the motion of bodies and elements from the state.
  subroutine gather(self, y)
    class(formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states], at least

    call self%set_state(y)
    call self%state%elements%gather(self%machine%elements%rows, self%phi, self%omega)
  end subroutine gather

  !> Forgets the shifts of a lane, before it starts. By default there are none.
  subroutine reset_origin(self, lane)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
  end subroutine reset_origin

  !> The angle of a body where the angles in the state are zero [rad]; by default they are the angles of the bodies.
  pure real(wp) function angle_at_zero(self, lane, body)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: lane, body

    angle_at_zero = 0.0_wp
  end function angle_at_zero

  !> Twist of an element where all coordinates are zero [rad].
  pure real(wp) function twist_at_zero(self, lane, element)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: lane, element

    twist_at_zero = self%zero_twist(lane, element)
  end function twist_at_zero

  !> Sets the quantities in which errors are measured.
  subroutine set_norm(self, norm)
    class(formulation_t), intent(inout) :: self
    type(error_measures_t), intent(in) :: norm

    self%norm = norm
    self%measures = norm%count
    self%phases = size(norm%free)
  end subroutine set_norm

  !> The sizes of the measured quantities, and an error of the state in them.
  subroutine measure(self, columns, y, error, sizes, errors)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: columns
    real(wp), intent(in), dimension(self%lanes, columns) :: y, error
    real(wp), intent(inout), dimension(self%lanes, self%measures) :: sizes, errors

    call self%norm%measure(self%lanes, columns, y, error, sizes, errors)
  end subroutine measure

  !> Name of a measured quantity, for messages.
  function measure_name(self, index) result(name)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name
    integer :: element

    element = self%norm%twist_of(index)
    if (element == 0) then
      name = self%component_name(self%norm%state_of(index))
    else
      name = 'twist of ' // quoted(self%machine%element_name(element))
      if (index <= size(self%norm%coupling)) name = 'rate of ' // name
    end if
  end function measure_name

  !> Updates everything that depends on the parameters of a lane, after they have changed. By default nothing does.
  subroutine refresh_lane(self, lane)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
  end subroutine refresh_lane

  !> Computes what the laws keep of the parameters of a lane, after values of elements have changed, in a motion too.
  subroutine refresh_laws(self, lane)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%machine%refresh_lane(lane)
    call self%state%refresh_lane(self%machine, lane)
  end subroutine refresh_laws

  !> Prepares a lane that starts at time t and state y, with new parameters perhaps.
  subroutine start_branches(self, lane, t, y)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! state, [states + quadratures]
    integer :: switch

    call self%refresh_lane(lane)
    call self%norm%start_lane(lane, y, self%zero_twist(lane, :), self%machine%laws%rest(lane, :))
    do switch = 1, self%switches
      if (self%joints%joint_of(switch) == 0) call choose_branch(self, lane, switch, t, y)
    end do
  end subroutine start_branches

  !> A step must show how the teeth of wheels with a transmission error approach and part, even in free flight.
  subroutine limit_steps(self, columns, y, longest)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: columns
    real(wp), intent(in) :: y(self%lanes, columns)   !! [lanes, states], at least
    real(wp), intent(inout) :: longest(self%lanes)   !! [s]
    real(wp), parameter :: part = 0.5_wp   ! of an oscillation in a step [rad]
    real(wp) :: motion(4)
    integer :: lane, switch

    do switch = 1, self%switches
      associate (order => self%machine%switches%phase_order(switch))
        if (order <= 0) cycle
        do lane = 1, self%lanes
          self%lane_state(:) = y(lane, :self%states)
          call self%switch_motion(lane, switch, self%lane_state, motion)
          longest(lane) = min(longest(lane), part / max(order * abs(motion(4)), tiny(part)))
        end do
      end associate
    end do
  end subroutine limit_steps

  !> The largest rate at which moments and reactions of a lane oscillate with the time or with angles [rad/s], after `gather`.
  pure real(wp) function fastest_wave(self, lane) result(fastest)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), parameter :: order = 4.0_wp   ! of what cardan joints and cranks do over the angle of their driver
    integer :: i

    fastest = self%state%fastest_wave(self%machine, lane)
    associate (motions => self%joints%motions)
      do i = 1, motions%count
        if (motions%driver(i) == 0) cycle
        fastest = max(fastest, order * abs(self%state%elements%speed(lane, motions%driver(i))))
      end do
    end associate
  end function fastest_wave

  !> Indicators of all switches of one lane: positive on the present branches, zero at their boundaries.
  subroutine indicator_values(self, lane, t, y, g)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]
    integer :: switch

    do switch = 1, self%switches
      call self%set_indicator(switch, lane, t, y, g)
    end do
  end subroutine indicator_values

  !> Indicator of one switch.
  subroutine indicate_branch(self, which, lane, t, y, g)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: which, lane            !! switch, 1 to `switches`; lane
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]
    real(wp) :: motion(4)

    associate (switches => self%machine%switches)
      call self%switch_motion(lane, which, y, motion)
      call switches%indicator(self%machine%banks, self%state%banks, which, lane, [t, motion], &
                              y(self%mechanical + 1:self%states), g(which))
    end associate
  end subroutine indicate_branch

  !> Puts one lane on the branch to which its state belongs, after it has crossed a boundary. Boundaries are shifted outwards,
  !> so that the state is inside the new branch.
  subroutine choose_branch(self, lane, which, t, y)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which               !! switch, 1 to `switches`
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! state, [states + quadratures]
    real(wp) :: motion(4)

    associate (switches => self%machine%switches)
      call self%switch_motion(lane, which, y, motion)
      call switches%choose(self%machine%banks, self%state%banks, which, lane, t, motion, y(self%mechanical + 1:self%states))
    end associate
  end subroutine choose_branch

  !> Changes a branch for an integrator, which lets the state jump.
  subroutine change_to_branch(self, lane, which, t, y)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which                  !! switch, 1 to `switches`
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(inout) :: y(:)   !! state, [states + quadratures]

    call choose_branch(self, lane, which, t, y)
  end subroutine change_to_branch

  !> Name of the boundaries of a switch, for messages, e.g. "edge of the gap of coupling 'mesh'".
  function switch_name(self, which) result(name)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: which   !! 1 to `switches`
    character(len=:), allocatable :: name

    name = self%machine%switches%name(self%machine%banks, which)
  end function switch_name

end module nocdyn_formulation
