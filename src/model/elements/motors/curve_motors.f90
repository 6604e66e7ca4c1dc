!> Motors whose torque is a function of their speed.
module nocdyn_curve_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_table_laws, only: over_speed, table_laws_t
  use nocdyn_text, only: string_t
  use nocdyn_torque_curves, only: torque_curve_t
  implicit none (type, external)
  private

  public :: new_curve_motors

  !> M = law(omega), or that of tables.
  type, extends(table_laws_t), public :: curve_motors_t
    class(torque_curve_t), allocatable :: law   !! of all motors; not allocated: they have tables
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: torque
    procedure :: slope
  end type curve_motors_t

contains

  !> A bank of motors, each on one body, either with a law or with tables.
  function new_curve_motors(names, body, lanes, law, curve) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    integer, intent(in) :: lanes
    class(torque_curve_t), intent(in), optional :: law   !! of all motors
    type(curve_t), intent(in), optional :: curve(:, :)   !! [N m] over [rad/s], shape [lanes, motors]
    type(curve_motors_t) :: bank
    integer :: e

    if (present(law) .eqv. present(curve)) error stop 'nocdyn_curve_motors: motors have either a law or tables'
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_motor, lanes, names, [(0, e=1, size(body))], body)
    if (present(law)) allocate (bank%law, source=law)
    if (present(curve)) call bank%set_curves(over_speed, curve)
  end function new_curve_motors

  !> Torque of a motor at full throttle [N m].
  pure real(wp) function torque(self, lane, motor, speed)
    class(curve_motors_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]

    if (allocated(self%law)) then
      torque = self%law%torque(lane, motor, speed)
    else
      torque = self%curve(lane, motor)%value(self%branch(lane, motor), speed)
    end if
  end function torque

  !> Derivative of `torque` by the speed [N m s/rad].
  pure real(wp) function slope(self, lane, motor, speed)
    class(curve_motors_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]

    if (allocated(self%law)) then
      slope = self%law%slope(lane, motor, speed)
    else
      slope = self%curve(lane, motor)%slope(self%branch(lane, motor), speed)
    end if
  end function slope

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(curve_motors_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        applied(i) = applied(i) + self%torque(l, e, speed(i))
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, elements)
    class(curve_motors_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        elements%applied_speed(l, i) = elements%applied_speed(l, i) + self%slope(l, e, elements%speed(l, i))
      end do
    end do
  end subroutine differentiate

  subroutine list_parameters(self, parameters)
    class(curve_motors_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%table_laws_t%list_parameters(parameters)
    if (allocated(self%law)) call self%law%list_parameters(parameters)
  end subroutine list_parameters

end module nocdyn_curve_motors
