!> A machine as a first-order system: what the three formulations have in common.
module nocdyn_formulation
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  !> Extensions choose the mechanical states; the inner states of the elements follow, then, where the works are audited,
  !> those of the accounted elements as quadratures.
  type, abstract, extends(system_t), public :: formulation_t
    type(machine_t) :: machine
    integer :: mechanical = 0               !! states before the inner states of the elements
    integer :: inner = 0                    !! inner states
    logical :: is_audited = .true.          !! whether the power of the accounted elements is integrated
    real(wp), allocatable :: phi(:, :)      !! angles [rad] after `place`, shape [lanes, 0:bodies], 0 is the ground
    real(wp), allocatable :: omega(:, :)    !! speeds [rad/s] after `place`
    real(wp), allocatable :: torque(:, :)   !! torques of the elements [N m] after `observe`
  contains
    procedure(start_interface), deferred :: start
    procedure(place_interface), deferred :: place
    procedure(reactions_interface), deferred :: reactions
    procedure(motion_interface), deferred :: switch_motion
    procedure :: attach
    procedure :: make_room
    procedure :: place_inner
    procedure :: choose_branches
    procedure :: observe
    procedure :: receive
    procedure :: enter
    procedure :: switch_values
    procedure :: cross
    procedure :: switch_name
  end type formulation_t

  abstract interface

    !> The state in which the machine starts, shape [lanes, states + quadratures].
    function start_interface(self) result(y)
      import :: formulation_t, wp
      class(formulation_t), intent(in) :: self
      real(wp), allocatable :: y(:, :)
    end function start_interface

    !> Angles and speeds of the bodies from the state: fills `phi` and `omega`.
    subroutine place_interface(self, y)
      import :: formulation_t, wp
      class(formulation_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: y(:, :)
    end subroutine place_interface

    !> Multipliers lambda of all constraint rows of one lane, after `observe`: tooth forces [N] or [N m], shape [rows].
    subroutine reactions_interface(self, lane, lambda)
      import :: formulation_t, wp
      class(formulation_t), intent(inout) :: self
      integer, intent(in) :: lane
      real(wp), intent(out) :: lambda(:)
    end subroutine reactions_interface

    !> Relative angle [rad] and speed [rad/s] of the element of a switch, from the state of one lane.
    pure subroutine motion_interface(self, lane, switch, y, angle, speed)
      import :: formulation_t, wp
      class(formulation_t), intent(in) :: self
      integer, intent(in) :: lane, switch
      real(wp), contiguous, intent(in) :: y(:)
      real(wp), intent(out) :: angle, speed
    end subroutine motion_interface

  end interface

contains

  !> Takes the machine and allocates what every formulation needs.
  subroutine attach(self, machine, mechanical, audited)
    class(formulation_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: mechanical   !! states before the inner states
    logical, intent(in) :: audited

    self%machine = machine
    call self%make_room(mechanical, audited)
  end subroutine attach

  !> Counts the states of the machine that is there, and allocates what every formulation needs.
  subroutine make_room(self, mechanical, audited)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: mechanical
    logical, intent(in) :: audited

    associate (machine => self%machine)
      self%mechanical = mechanical
      self%inner = machine%elements%inner%count
      self%states = self%mechanical + self%inner
      self%switches = machine%switches%count
      self%lanes = machine%lanes
      self%is_audited = audited
      self%quadratures = merge(machine%accounts(), 0, audited)
      if (allocated(self%phi)) deallocate (self%phi, self%omega, self%torque)
      allocate (self%phi(machine%lanes, 0:machine%bodies), source=0.0_wp)
      allocate (self%omega, self%torque, source=self%phi)
    end associate
  end subroutine make_room

  !> Hands the elements their inner states, [lanes, inner states].
  subroutine place_inner(self, inner)
    class(formulation_t), intent(inout) :: self
    real(wp), intent(in) :: inner(self%lanes, self%inner)

    if (self%inner > 0) self%machine%elements%inner%value(:, :) = inner
  end subroutine place_inner

  !> Chooses the branches of all lanes at a state to which `place` has brought the bodies.
  subroutine choose_branches(self, t, y)
    class(formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)

    call self%place_inner(y(:, self%mechanical + 1:))
    call self%machine%choose_all(t, self%phi, self%omega)
  end subroutine choose_branches

  !> Brings bodies, elements and torques to the state y, so that they and the reactions can be read. Chooses the branches
  !> there: the observed formulation is not the one that is being integrated.
  subroutine observe(self, t, y)
    class(formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)

    call self%place(y)
    if (self%switches > 0) call self%choose_branches(t, y)
    if (self%inner > 0) call self%place_inner(y(:, self%mechanical + 1:))
    call self%machine%evaluate(t, self%phi, self%omega, self%torque)
  end subroutine observe

  !> A lane may have other numbers than before.
  subroutine receive(self, lane)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
  end subroutine receive

  subroutine enter(self, lane, t, y)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    integer :: switch

    call self%receive(lane)
    do switch = 1, self%switches
      call self%cross(lane, switch, t, y)
    end do
  end subroutine enter

  subroutine switch_values(self, lane, t, y, g)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)
    real(wp) :: angle, speed
    integer :: switch

    associate (switches => self%machine%switches)
      do switch = 1, self%switches
        call self%switch_motion(lane, switch, y, angle, speed)
        g(switch) = switches%margin(self%machine%banks, switch, lane, t, angle, speed, &
                                    y(self%mechanical + switches%first_inner(switch): &
                                      self%mechanical + switches%last_inner(switch)))
      end do
    end associate
  end subroutine switch_values

  !> Beyond the widened border of its branch a lane is inside the one that `choose` finds.
  subroutine cross(self, lane, which, t, y)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp) :: angle, speed

    associate (switches => self%machine%switches)
      call self%switch_motion(lane, which, y, angle, speed)
      call switches%choose(self%machine%banks, which, lane, t, angle, speed, &
                           y(self%mechanical + switches%first_inner(which):self%mechanical + switches%last_inner(which)))
    end associate
  end subroutine cross

  !> What the borders of a switch are, for messages, e.g. "edge of the gap of coupling 'mesh'".
  function switch_name(self, which) result(name)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: which
    character(len=:), allocatable :: name

    name = self%machine%switches%name(self%machine%banks, which)
  end function switch_name

end module nocdyn_formulation
