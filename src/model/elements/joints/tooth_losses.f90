!> Losses of teeth: of gears, planetary sets and elastic meshes.
!>
!> The teeth turn the first wheel by a torque T and the second one by its counterpart. The loss is a friction moment M = -s T on
!> the first wheel, against its motion: where the first wheel drives it puts in 1 / forward of what the second one gets, so
!> s = 1 - 1 / forward; where the second one drives the first gets the share `backward`, so s = 1 - backward. At rest s is
!> anywhere between, and the wheels are locked; with a backward efficiency of 0 or less they stay so, whatever torque acts on the
!> second wheel. In planetary sets the first wheel is the sun and moves against the carrier. C. Pelchen, C. Schweiger,
!> M. Otter, Modeling and Simulating the Efficiency of Gearboxes and of Planetary Gearboxes, Modelica Conference 2002.
!>
!> M depends on all torques of the machine by way of T: it is found with the ones of the joints that hold (`nocdyn_tooth_loads`).
module nocdyn_tooth_losses
  use nocdyn_bank, only: role_loss
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_friction_joints, only: friction_joints_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: literal, node_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_quantities, only: form_applied, new_quantity, quantity_t, rank_loss
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_tooth_losses

  !> Where the torques of teeth come from, and how efficient these are.
  type, public :: teeth_t
    integer, allocatable :: row(:)                       !! constraint row of each gear; 0 of a mesh, [losses]
    real(wp), allocatable :: factor(:)                   !! of its multiplier, or of the moment of the mesh, in T
    real(wp), allocatable :: forward(:, :), backward(:, :)   !! efficiencies, [lanes, losses]
    type(curve_t), allocatable :: forward_over_speed, backward_over_speed   !! the ones of all losses, over the speed of the
                                                         !! first wheel [rad/s] from 0 on; not allocated: the constants hold
  end type teeth_t

  type, extends(friction_joints_t), public :: tooth_losses_t
    integer, allocatable :: row(:)       !! as in `teeth_t`
    real(wp), allocatable :: factor(:)   !! as in `teeth_t`
    type(curve_t), allocatable, private :: forward_over_speed, backward_over_speed
  contains
    procedure :: describe
    procedure :: share
    procedure :: range_under_load
    procedure :: is_self_locking
    procedure :: extremes
    procedure :: quantities
  end type tooth_losses_t

contains

  !> A bank of losses.
  function new_tooth_losses(names, from, to, teeth) result(bank)
    type(string_t), intent(in) :: names(:)   !! of the gears
    integer, intent(in) :: from(:), to(:)    !! what the first wheel moves against, 0 = ground, and the first wheel
    type(teeth_t), intent(in) :: teeth
    type(tooth_losses_t) :: bank

    call bank%connect_joints(role_loss, size(teeth%forward, 1), names, from, to)
    bank%row = teeth%row
    bank%factor = teeth%factor
    call bank%add_parameter('efficiency', teeth%forward, is_key=.false.)
    call bank%add_parameter('backward efficiency', teeth%backward, is_key=.false.)
    if (allocated(teeth%forward_over_speed)) allocate (bank%forward_over_speed, source=teeth%forward_over_speed)
    if (allocated(teeth%backward_over_speed)) allocate (bank%backward_over_speed, source=teeth%backward_over_speed)
    call bank%add_modes()
    call bank%prepare_law()
  end function new_tooth_losses

  !> There is no moment before all others are known.
  subroutine describe(self, tape)
    class(tooth_losses_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    tape%applied = node_of(literal(tape, 0.0_wp))
  end subroutine describe

  !> The share s of the torque T that is lost, of the first lane, and its derivative by the speed.
  pure subroutine share(self, element, is_driving, speed, s, by_speed)
    class(tooth_losses_t), intent(in) :: self
    integer, intent(in) :: element       !! numbered within the bank
    logical, intent(in) :: is_driving    !! whether the first wheel drives
    real(wp), intent(in) :: speed        !! u' [rad/s]
    real(wp), intent(out) :: s           !! 0 without losses
    real(wp), intent(out) :: by_speed    !! [s/rad]
    real(wp) :: efficiency(0:3)

    efficiency = 0.0_wp
    if (is_driving) then
      efficiency(0) = self%parameters(self%number_of('efficiency'))%value(1, element)
      if (allocated(self%forward_over_speed)) efficiency = over_speed(self%forward_over_speed, speed)
      s = 1.0_wp - 1.0_wp / efficiency(0)
      by_speed = efficiency(1) / efficiency(0)**2
    else
      efficiency(0) = self%parameters(self%number_of('backward efficiency'))%value(1, element)
      if (allocated(self%backward_over_speed)) efficiency = over_speed(self%backward_over_speed, speed)
      s = 1.0_wp - efficiency(0)
      by_speed = -efficiency(1)
    end if
  end subroutine share

  !> An efficiency and its derivatives at a speed in either direction.
  pure function over_speed(curve, speed) result(efficiency)
    type(curve_t), intent(in) :: curve
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp) :: efficiency(0:3)

    efficiency = curve%derivatives(curve%segment(abs(speed)), abs(speed))
    efficiency(1) = sign(1.0_wp, speed) * efficiency(1)
  end function over_speed

  !> The moments between which the wheels stay at rest.
  pure subroutine range_under_load(self, element, load, least, most)
    class(tooth_losses_t), intent(in) :: self
    integer, intent(in) :: element         !! numbered within the bank
    real(wp), intent(in) :: load           !! T [N m]
    real(wp), intent(out) :: least, most   !! [N m]
    real(wp) :: driven, driving, slope

    call self%share(element, .true., 0.0_wp, driving, slope)
    call self%share(element, .false., 0.0_wp, driven, slope)
    least = min(-driven * load, -driving * load)
    most = max(-driven * load, -driving * load)
  end subroutine range_under_load

  !> Whether a torque on the second wheel alone cannot move the wheels from rest.
  pure logical function is_self_locking(self, element)
    class(tooth_losses_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp) :: s, slope

    call self%share(element, .false., 0.0_wp, s, slope)
    is_self_locking = s >= 1
  end function is_self_locking

  !> The loss jumps where the wheels change their direction, and bends at the points of tables.
  function extremes(self, element, t) result(speeds)
    class(tooth_losses_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    allocate (speeds(1), source=0.0_wp)
    if (allocated(self%forward_over_speed)) then
      speeds = [speeds, self%forward_over_speed%knots(), -self%forward_over_speed%knots(), &
                self%backward_over_speed%knots(), -self%backward_over_speed%knots()]
    end if
  end function extremes

  !> The moment of the loss on the first wheel.
  subroutine quantities(self, columns)
    class(tooth_losses_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    allocate (columns(1))
    columns(1) = new_quantity('loss', 'N m', [(e, e=1, self%count)], 'friction moment of the teeth', 'on the first wheel', &
                              rank_loss, form_applied, 1.0_wp)
  end subroutine quantities

end module nocdyn_tooth_losses
