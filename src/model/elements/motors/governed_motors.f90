!> Motors whose torque a governor throttles.
module nocdyn_governed_motors
  use nocdyn_bank, only: quantity_t
  use nocdyn_curve_motors, only: curve_motors_t, new_curve_motors
  use nocdyn_elements, only: elements_t
  use nocdyn_governors, only: governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_text, only: string_t
  use nocdyn_torque_curves, only: torque_curve_t
  implicit none (type, external)
  private

  public :: new_governed_motors

  !> y curve(omega) - drag omega, y the throttle, whose integral is an inner state. The switches of the governors follow those
  !> of the curves.
  type, extends(curve_motors_t), public :: governed_motors_t
    type(governor_t) :: governor
    real(wp), allocatable :: drag(:, :)   !! what no throttle changes [N m s/rad], shape [lanes, motors]
  contains
    procedure :: list_numbers
    procedure :: polynomials
    procedure :: evaluate
    procedure :: differentiate
    procedure :: start_inner
    procedure :: evaluate_inner
    procedure :: inner_name
    procedure :: choose
    procedure :: margin
    procedure :: switch_name
    procedure :: quantities
    procedure :: observe
    procedure, private :: first_governor
  end type governed_motors_t

contains

  !> A bank of motors, each on one body.
  function new_governed_motors(names, body, curve, governor, drag) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    class(torque_curve_t), intent(in) :: curve      !! of all motors
    type(governor_t), intent(in) :: governor        !! of all motors
    real(wp), intent(in) :: drag(:, :)              !! [N m s/rad], shape [lanes, motors]
    type(governed_motors_t) :: bank
    integer :: e

    bank%curve_motors_t = new_curve_motors(names, body, size(drag, 1), curve)
    bank%governor = governor
    allocate (bank%drag, source=drag)
    bank%inner = 1
    bank%inner_values = bank%values
    call bank%let_switch([bank%switching, (e, e=1, size(body))])
  end function new_governed_motors

  subroutine polynomials(self, laws)
    class(governed_motors_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    laws%by_speed(:, self%first:self%last()) = -self%drag
  end subroutine polynomials

  !> Number of the switch before the governors'.
  pure integer function first_governor(self)
    class(governed_motors_t), intent(in) :: self

    first_governor = size(self%switching) - size(self%to)
  end function first_governor

  !> All of it needs the throttle.
  subroutine evaluate(self, time, angle, speed, restoring, working)
    class(governed_motors_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), working(self%values)
  end subroutine evaluate

  subroutine start_inner(self, speed, inner)
    class(governed_motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)
    real(wp), intent(inout) :: inner(self%inner_values)
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        inner(i) = self%governor%start_integral(l, e, speed(i))
      end do
    end do
  end subroutine start_inner

  subroutine evaluate_inner(self, speed, inner, working, rate)
    class(governed_motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)
    real(wp), intent(in) :: inner(self%inner_values)
    real(wp), intent(inout) :: working(self%values)
    real(wp), intent(inout) :: rate(self%inner_values)
    real(wp) :: throttle
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        throttle = self%governor%throttle(l, e, self%branch(l, self%first_governor() + e), inner(i), speed(i))
        working(i) = working(i) + throttle * self%curve%torque(l, e, self%segment(l, e), speed(i))
        rate(i) = self%governor%rate(l, e, throttle, inner(i))
      end do
    end do
  end subroutine evaluate_inner

  subroutine differentiate(self, elements)
    class(governed_motors_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: by_integral, by_speed, slope, throttle, torque
    integer :: branch, e, i, l, s

    do e = 1, size(self%to)
      i = self%first + e - 1
      s = self%first_inner + e - 1
      do l = 1, self%lanes
        branch = self%branch(l, self%first_governor() + e)
        throttle = self%governor%throttle(l, e, branch, elements%inner%value(l, s), elements%speed(l, i))
        call self%governor%slopes(l, e, branch, by_integral, by_speed, elements%inner%rate_inner(l, 1, s), &
                                  elements%inner%rate_speed(l, s))
        torque = self%curve%torque(l, e, self%segment(l, e), elements%speed(l, i))
        slope = self%curve%slope(l, e, self%segment(l, e), elements%speed(l, i))
        elements%working_speed(l, i) = elements%working_speed(l, i) + (throttle * slope + by_speed * torque)
        elements%inner%working(l, s) = by_integral * torque
      end do
    end do
  end subroutine differentiate

  function inner_name(self, index) result(name)
    class(governed_motors_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    name = 'governor integral'
  end function inner_name

  subroutine choose(self, switch, lane, t, angle, speed, inner)
    class(governed_motors_t), intent(inout) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: inner(:)

    associate (motor => switch - self%first_governor())
      if (motor > 0) then
        self%branch(lane, switch) = self%governor%branch(lane, motor, inner(1), speed)
      else
        call self%curve_motors_t%choose(switch, lane, t, angle, speed, inner)
      end if
    end associate
  end subroutine choose

  pure function margin(self, switch, lane, t, angle, speed, inner)
    class(governed_motors_t), intent(in) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: inner(:)
    real(wp) :: margin

    associate (motor => switch - self%first_governor())
      if (motor > 0) then
        margin = self%governor%margin(lane, motor, self%branch(lane, switch), inner(1), speed)
      else
        margin = self%curve_motors_t%margin(switch, lane, t, angle, speed, inner)
      end if
    end associate
  end function margin

  function switch_name(self, switch) result(name)
    class(governed_motors_t), intent(in) :: self
    integer, intent(in) :: switch
    character(len=:), allocatable :: name

    name = 'point in the table'
    if (switch > self%first_governor()) name = 'limit of the governor'
  end function switch_name

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
    integer, intent(in) :: quantity
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)
    integer :: e

    if (quantity == 1) then
      values = elements%working(lane, self%first:self%last())
    else
      do e = 1, size(self%to)
        values(e) = self%governor%throttle(lane, e, self%branch(lane, self%first_governor() + e), &
                                           elements%inner%value(lane, self%first_inner + e - 1), &
                                           elements%speed(lane, self%first + e - 1))
      end do
    end if
  end subroutine observe

  subroutine list_numbers(self, numbers)
    class(governed_motors_t), target, intent(inout) :: self
    type(lane_numbers_t), intent(inout) :: numbers

    call self%curve_motors_t%list_numbers(numbers)
    call self%governor%list_numbers(numbers)
    call numbers%add('drag', self%drag)
  end subroutine list_numbers

end module nocdyn_governed_motors
