!> A machine as a first-order system: what the three formulations have in common.
module nocdyn_formulation
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  !> Extensions choose the states; where the works are audited, those of the accounted elements follow as quadratures.
  type, abstract, extends(system_t), public :: formulation_t
    type(machine_t) :: machine
    logical :: is_audited = .true.          !! whether the power of the accounted elements is integrated
    real(wp), allocatable :: phi(:, :)      !! angles [rad] after `place`, shape [lanes, 0:bodies], 0 is the ground
    real(wp), allocatable :: omega(:, :)    !! speeds [rad/s] after `place`
    real(wp), allocatable :: torque(:, :)   !! torques of the elements [N m] after `observe`
  contains
    procedure(start_interface), deferred :: start
    procedure(place_interface), deferred :: place
    procedure(reactions_interface), deferred :: reactions
    procedure :: attach
    procedure :: observe
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

  end interface

contains

  !> Takes the machine and allocates what every formulation needs.
  subroutine attach(self, machine, audited)
    class(formulation_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: audited

    self%machine = machine
    self%lanes = machine%lanes
    self%is_audited = audited
    self%quadratures = merge(machine%accounts(), 0, audited)
    allocate (self%phi(machine%lanes, 0:machine%bodies), source=0.0_wp)
    allocate (self%omega, self%torque, source=self%phi)
  end subroutine attach

  !> Brings bodies, elements and torques to the state y, so that they and the reactions can be read.
  subroutine observe(self, t, y)
    class(formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)

    call self%place(y)
    call self%machine%evaluate(t, self%phi, self%omega, self%torque)
  end subroutine observe

end module nocdyn_formulation
