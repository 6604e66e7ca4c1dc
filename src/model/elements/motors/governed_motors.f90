!> Motors whose torque a governor throttles.
module nocdyn_governed_motors
  use nocdyn_bank, only: quantity_t
  use nocdyn_curve_motors, only: curve_motors_t, new_curve_motors
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_governors, only: governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_text, only: string_t
  use nocdyn_torque_curves, only: torque_curve_t
  implicit none (type, external)
  private

  public :: new_governed_motors

  !> M = y torque(omega) - drag omega with the throttle y of a governor, whose integral is an internal state. The switches of
  !> the governors follow those of the tables.
  type, extends(curve_motors_t), public :: governed_motors_t
    type(governor_t) :: governor
    real(wp), allocatable :: drag(:, :)   !! not throttled [N m s/rad], shape [lanes, motors]
  contains
    procedure :: list_parameters
    procedure :: polynomials
    procedure :: evaluate
    procedure :: differentiate
    procedure :: start_internal
    procedure :: evaluate_internal
    procedure :: choose
    procedure :: indicator
    procedure :: quantities
    procedure :: observe
    procedure, private :: first_governor
  end type governed_motors_t

contains

  !> A bank of motors, each on one body, either with a law or with tables.
  function new_governed_motors(names, body, governor, drag, law, curve) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    type(governor_t), intent(in) :: governor             !! of all motors
    real(wp), intent(in) :: drag(:, :)                   !! [N m s/rad], shape [lanes, motors]
    class(torque_curve_t), intent(in), optional :: law   !! of all motors
    type(curve_t), intent(in), optional :: curve(:, :)   !! [N m] over [rad/s], shape [lanes, motors]
    type(governed_motors_t) :: bank
    integer :: e

    bank%curve_motors_t = new_curve_motors(names, body, size(drag, 1), law, curve)
    bank%governor = governor
    allocate (bank%drag, source=drag)
    bank%states = 1
    allocate (bank%internal_names, source=[character(len=24) :: 'governor integral'])
    bank%internal_values = bank%values
    call bank%add_switches([('limit of the governor', e=1, size(body))])
  end function new_governed_motors

  subroutine polynomials(self, laws)
    class(governed_motors_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    laws%by_speed(:, self%first:self%last()) = -self%drag
  end subroutine polynomials

  !> Number of switches before those of the governors.
  pure integer function first_governor(self)
    class(governed_motors_t), intent(in) :: self

    first_governor = size(self%switch_element) - size(self%to)
  end function first_governor

  !> Adds nothing: the whole torque depends on the throttle, an internal state.
  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(governed_motors_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
  end subroutine evaluate

  subroutine start_internal(self, speed, internal)
    class(governed_motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)   !! [lanes, states, motors]
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        internal(i) = self%governor%start_integral(l, e, speed(i))
      end do
    end do
  end subroutine start_internal

  subroutine evaluate_internal(self, speed, internal, applied, rate)
    class(governed_motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(in) :: internal(self%internal_values)   !! [lanes, states, motors]
    real(wp), intent(inout) :: applied(self%values)   !! [N m]
    real(wp), intent(inout) :: rate(self%internal_values)   !! [lanes, states, motors]
    real(wp) :: throttle
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        throttle = self%governor%throttle(l, e, self%branch(l, self%first_governor() + e), internal(i), speed(i))
        applied(i) = applied(i) + throttle * self%torque(l, e, speed(i))
        rate(i) = self%governor%rate(l, e, throttle, internal(i))
      end do
    end do
  end subroutine evaluate_internal

  subroutine differentiate(self, elements)
    class(governed_motors_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: by_integral, by_speed, slope, throttle, torque
    integer :: branch, e, i, l, s

    do e = 1, size(self%to)
      i = self%first + e - 1
      s = self%first_internal + e - 1
      do l = 1, self%lanes
        branch = self%branch(l, self%first_governor() + e)
        throttle = self%governor%throttle(l, e, branch, elements%internal%value(l, s), elements%speed(l, i))
        call self%governor%slopes(l, e, branch, by_integral, by_speed, elements%internal%rate_internal(l, 1, s), &
                                  elements%internal%rate_speed(l, s))
        torque = self%torque(l, e, elements%speed(l, i))
        slope = self%slope(l, e, elements%speed(l, i))
        elements%applied_speed(l, i) = elements%applied_speed(l, i) + (throttle * slope + by_speed * torque)
        elements%internal%applied(l, s) = by_integral * torque
      end do
    end do
  end subroutine differentiate

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(governed_motors_t), intent(inout) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    associate (motor => switch - self%first_governor())
      if (motor > 0) then
        self%branch(lane, switch) = self%governor%branch(lane, motor, internal(1), speed)
      else
        call self%curve_motors_t%choose(switch, lane, t, angle, speed, internal)
      end if
    end associate
  end subroutine choose

  pure function indicator(self, switch, lane, t, angle, speed, internal)
    class(governed_motors_t), intent(in) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element
    real(wp) :: indicator

    associate (motor => switch - self%first_governor())
      if (motor > 0) then
        indicator = self%governor%indicator(lane, motor, self%branch(lane, switch), internal(1), speed)
      else
        indicator = self%curve_motors_t%indicator(switch, lane, t, angle, speed, internal)
      end if
    end associate
  end function indicator

  !> Torque and throttle.
  function quantities(self) result(columns)
    class(governed_motors_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(2))
    columns(1) = quantity_t('torque', 'N m', [(e, e=1, size(self%to))])
    columns(2) = quantity_t('throttle', '1', [(e, e=1, size(self%to))])
  end function quantities

  pure subroutine observe(self, elements, quantity, lane, values)
    class(governed_motors_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! index in `quantities`
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]
    integer :: e

    if (quantity == 1) then
      values = elements%applied(lane, self%first:self%last())
    else
      do e = 1, size(self%to)
        values(e) = self%governor%throttle(lane, e, self%branch(lane, self%first_governor() + e), &
                                           elements%internal%value(lane, self%first_internal + e - 1), &
                                           elements%speed(lane, self%first + e - 1))
      end do
    end if
  end subroutine observe

  subroutine list_parameters(self, parameters)
    class(governed_motors_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%curve_motors_t%list_parameters(parameters)
    call self%governor%list_parameters(parameters)
    call parameters%add('drag', self%drag)
  end subroutine list_parameters

end module nocdyn_governed_motors
