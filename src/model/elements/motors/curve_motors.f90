!> Motors whose torque is a curve over their speed.
module nocdyn_curve_motors
  use nocdyn_bank, only: bank_t, role_motor
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  use nocdyn_torque_curves, only: torque_curve_t
  implicit none (type, external)
  private

  public :: new_curve_motors

  !> The branches are the segments of the curves, where these have some.
  type, extends(bank_t), public :: curve_motors_t
    class(torque_curve_t), allocatable :: curve
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: choose
    procedure :: indicator
    procedure :: switch_name
    procedure :: segment
  end type curve_motors_t

contains

  !> A bank of motors, each on one body.
  function new_curve_motors(names, body, lanes, curve) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    integer, intent(in) :: lanes
    class(torque_curve_t), intent(in) :: curve   !! of all motors
    type(curve_motors_t) :: bank
    integer :: e

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_motor, lanes, names, [(0, e=1, size(body))], body)
    allocate (bank%curve, source=curve)
    if (curve%has_segments()) call bank%set_switches([(e, e=1, size(body))])
  end function new_curve_motors

  !> The present segment of the curve of a motor.
  pure integer function segment(self, lane, motor)
    class(curve_motors_t), intent(in) :: self
    integer, intent(in) :: lane, motor

    segment = 0
    if (self%curve%has_segments()) segment = self%branch(lane, motor)
  end function segment

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(curve_motors_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        applied(i) = applied(i) + self%curve%torque(l, e, self%segment(l, e), speed(i))
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
        elements%applied_speed(l, i) = elements%applied_speed(l, i) &
                                       + self%curve%slope(l, e, self%segment(l, e), elements%speed(l, i))
      end do
    end do
  end subroutine differentiate

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(curve_motors_t), intent(inout) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)

    self%branch(lane, switch) = self%curve%segment(lane, switch, speed)
  end subroutine choose

  pure function indicator(self, switch, lane, t, angle, speed, internal)
    class(curve_motors_t), intent(in) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)
    real(wp) :: indicator

    indicator = self%curve%indicator(lane, switch, self%branch(lane, switch), speed)
  end function indicator

  function switch_name(self, switch) result(name)
    class(curve_motors_t), intent(in) :: self
    integer, intent(in) :: switch
    character(len=:), allocatable :: name

    name = 'point in the table'
  end function switch_name

  subroutine list_parameters(self, parameters)
    class(curve_motors_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%curve%list_parameters(parameters)
  end subroutine list_parameters

end module nocdyn_curve_motors
