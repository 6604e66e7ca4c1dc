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
    integer :: internal = 0                    !! inner states
    logical :: has_energy_balance = .true.          !! whether the power of the accounted elements is integrated
    real(wp), allocatable :: phi(:, :)      !! angles [rad] after `set_state`, shape [lanes, 0:bodies], 0 is the ground
    real(wp), allocatable :: omega(:, :)    !! speeds [rad/s] after `set_state`
    real(wp), allocatable :: torque(:, :)   !! torques of the elements [N m] after `observe`
  contains
    procedure(start_interface), deferred :: start
    procedure(set_state_interface), deferred :: set_state
    procedure(reactions_interface), deferred :: reactions
    procedure(motion_interface), deferred :: switch_motion
    procedure :: attach
    procedure :: allocate_state
    procedure :: place_internal
    procedure :: choose_all_branches
    procedure :: observe
    procedure :: refresh_lane
    procedure :: start_lane
    procedure :: indicator_values
    procedure :: change_branch
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
    subroutine set_state_interface(self, y)
      import :: formulation_t, wp
      class(formulation_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: y(:, :)
    end subroutine set_state_interface

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
  subroutine attach(self, machine, mechanical, with_energy_balance)
    class(formulation_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: mechanical   !! states before the inner states
    logical, intent(in) :: with_energy_balance

    self%machine = machine
    call self%allocate_state(mechanical, with_energy_balance)
  end subroutine attach

  !> Counts the states of the machine that is there, and allocates what every formulation needs.
  subroutine allocate_state(self, mechanical, with_energy_balance)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: mechanical
    logical, intent(in) :: with_energy_balance

    associate (machine => self%machine)
      self%mechanical = mechanical
      self%internal = machine%elements%internal%count
      self%states = self%mechanical + self%internal
      self%switches = machine%switches%count
      self%lanes = machine%lanes
      self%has_energy_balance = with_energy_balance
      self%quadratures = merge(machine%work_count(), 0, with_energy_balance)
      if (allocated(self%phi)) deallocate (self%phi, self%omega, self%torque)
      allocate (self%phi(machine%lanes, 0:machine%bodies), source=0.0_wp)
      allocate (self%omega, self%torque, source=self%phi)
    end associate
  end subroutine allocate_state

  !> Hands the elements their inner states, [lanes, inner states].
  subroutine place_internal(self, internal)
    class(formulation_t), intent(inout) :: self
    real(wp), intent(in) :: internal(self%lanes, self%internal)

    if (self%internal > 0) self%machine%elements%internal%value(:, :) = internal
  end subroutine place_internal

  !> Chooses the branches of all lanes at a state to which `set_state` has brought the bodies.
  subroutine choose_all_branches(self, t, y)
    class(formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)

    call self%place_internal(y(:, self%mechanical + 1:))
    call self%machine%choose_branches(t, self%phi, self%omega)
  end subroutine choose_all_branches

  !> Brings bodies, elements and torques to the state y, so that they and the reactions can be read. Chooses the branches
  !> there: the observed formulation is not the one that is being integrated.
  subroutine observe(self, t, y)
    class(formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)

    call self%set_state(y)
    if (self%switches > 0) call self%choose_all_branches(t, y)
    if (self%internal > 0) call self%place_internal(y(:, self%mechanical + 1:))
    call self%machine%evaluate(t, self%phi, self%omega, self%torque)
  end subroutine observe

  !> A lane may have other numbers than before.
  subroutine refresh_lane(self, lane)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
  end subroutine refresh_lane

  subroutine start_lane(self, lane, t, y)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    integer :: switch

    call self%refresh_lane(lane)
    do switch = 1, self%switches
      call self%change_branch(lane, switch, t, y)
    end do
  end subroutine start_lane

  subroutine indicator_values(self, lane, t, y, g)
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
        g(switch) = switches%indicator(self%machine%banks, switch, lane, t, angle, speed, &
                                    y(self%mechanical + switches%first_internal(switch): &
                                      self%mechanical + switches%last_internal(switch)))
      end do
    end associate
  end subroutine indicator_values

  !> Beyond the widened border of its branch a lane is inside the one that `choose` finds.
  subroutine change_branch(self, lane, which, t, y)
    class(formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp) :: angle, speed

    associate (switches => self%machine%switches)
      call self%switch_motion(lane, which, y, angle, speed)
      call switches%choose(self%machine%banks, which, lane, t, angle, speed, &
                           y(self%mechanical + switches%first_internal(which):self%mechanical + switches%last_internal(which)))
    end associate
  end subroutine change_branch

  !> What the borders of a switch are, for messages, e.g. "edge of the gap of coupling 'mesh'".
  function switch_name(self, which) result(name)
    class(formulation_t), intent(in) :: self
    integer, intent(in) :: which
    character(len=:), allocatable :: name

    name = self%machine%switches%name(self%machine%banks, which)
  end function switch_name

end module nocdyn_formulation
