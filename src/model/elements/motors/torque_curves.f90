!> Torque-speed laws of motors that are smooth.
module nocdyn_torque_curves
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  implicit none (type, external)
  private

  !> The laws of the motors of a bank.
  type, abstract, public :: torque_curve_t
  contains
    procedure(torque_interface), deferred :: torque   !! [N m]
    procedure(torque_interface), deferred :: slope    !! by the speed [N m s/rad]
    procedure(list_interface), deferred :: list_parameters
    procedure(knees_interface), deferred :: knees     !! speeds of an extreme or of no torque, in the first lane [rad/s]
  end type torque_curve_t

  abstract interface
    pure function torque_interface(self, lane, motor, speed) result(value)
      import :: torque_curve_t, wp
      class(torque_curve_t), intent(in) :: self
      integer, intent(in) :: lane, motor
      real(wp), intent(in) :: speed    !! [rad/s]
      real(wp) :: value
    end function torque_interface

    subroutine list_interface(self, parameters)
      import :: lane_parameters_t, torque_curve_t
      class(torque_curve_t), target, intent(inout) :: self
      type(lane_parameters_t), intent(inout) :: parameters
    end subroutine list_interface

    pure function knees_interface(self, motor) result(speeds)
      import :: torque_curve_t, wp
      class(torque_curve_t), intent(in) :: self
      integer, intent(in) :: motor
      real(wp), allocatable :: speeds(:)
    end function knees_interface
  end interface

  !> Eq. (20): A - B omega - C omega^2.
  type, extends(torque_curve_t), public :: quadratic_curve_t
    real(wp), allocatable :: a(:, :), b(:, :), c(:, :)   !! [N m], [N m s/rad], [N m s2/rad2]; shape [lanes, motors]
  contains
    procedure :: torque => quadratic_torque
    procedure :: slope => quadratic_slope
    procedure :: list_parameters => list_quadratic
    procedure :: knees => quadratic_knees
  end type quadratic_curve_t

  !> Kloss' formula 2 T_k / (s / s_k + s_k / s) with the slip s = 1 - omega / synchronous_speed, as 2 T_k s s_k / (s^2 + s_k^2).
  type, extends(torque_curve_t), public :: induction_curve_t
    real(wp), allocatable :: breakdown_torque(:, :)    !! T_k [N m], shape [lanes, motors]
    real(wp), allocatable :: breakdown_slip(:, :)      !! s_k, positive
    real(wp), allocatable :: synchronous_speed(:, :)   !! [rad/s], not zero
  contains
    procedure :: torque => induction_torque
    procedure :: slope => induction_slope
    procedure :: list_parameters => list_induction
    procedure :: knees => induction_knees
  end type induction_curve_t

contains

  pure real(wp) function quadratic_torque(self, lane, motor, speed) result(value)
    class(quadratic_curve_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]

    value = self%a(lane, motor) - (self%b(lane, motor) + self%c(lane, motor) * speed) * speed
  end function quadratic_torque

  pure real(wp) function quadratic_slope(self, lane, motor, speed) result(value)
    class(quadratic_curve_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]

    value = -(self%b(lane, motor) + 2.0_wp * self%c(lane, motor) * speed)
  end function quadratic_slope

  pure function induction_torque(self, lane, motor, speed) result(value)
    class(induction_curve_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp) :: slip, value

    slip = 1.0_wp - speed / self%synchronous_speed(lane, motor)
    associate (s_k => self%breakdown_slip(lane, motor))
      value = 2.0_wp * self%breakdown_torque(lane, motor) * slip * s_k / (slip**2 + s_k**2)
    end associate
  end function induction_torque

  pure function induction_slope(self, lane, motor, speed) result(value)
    class(induction_curve_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp) :: slip, value

    slip = 1.0_wp - speed / self%synchronous_speed(lane, motor)
    associate (s_k => self%breakdown_slip(lane, motor))
      value = -2.0_wp * self%breakdown_torque(lane, motor) * s_k * (s_k**2 - slip**2) / (slip**2 + s_k**2)**2 &
              / self%synchronous_speed(lane, motor)
    end associate
  end function induction_slope

  !> The vertex, and the speeds without torque, where a, b and c are of sizes that belong together.
  pure function quadratic_knees(self, motor) result(speeds)
    class(quadratic_curve_t), intent(in) :: self
    integer, intent(in) :: motor
    real(wp), allocatable :: speeds(:)
    real(wp), parameter :: together = 1.0e-20_wp   ! ratio of coefficients below which one is no part of the law
    real(wp) :: discriminant

    allocate (speeds(0))
    associate (a => self%a(1, motor), b => self%b(1, motor), c => self%c(1, motor))
      discriminant = b**2 + 4.0_wp * a * c
      if (abs(c) > together * max(abs(a), abs(b))) then
        speeds = -0.5_wp / c * [b, b - sqrt(max(discriminant, 0.0_wp)), b + sqrt(max(discriminant, 0.0_wp))]
      else if (abs(b) > together * abs(a)) then
        speeds = [a / b]
      end if
    end associate
  end function quadratic_knees

  !> The synchronous speed, and those of the largest torque as a motor and as a generator.
  pure function induction_knees(self, motor) result(speeds)
    class(induction_curve_t), intent(in) :: self
    integer, intent(in) :: motor
    real(wp), allocatable :: speeds(:)

    speeds = self%synchronous_speed(1, motor) * (1.0_wp + self%breakdown_slip(1, motor) * [-1.0_wp, 0.0_wp, 1.0_wp])
  end function induction_knees

  subroutine list_quadratic(self, parameters)
    class(quadratic_curve_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_key('a', self%a)
    call parameters%add_key('b', self%b)
    call parameters%add_key('c', self%c)
  end subroutine list_quadratic

  subroutine list_induction(self, parameters)
    class(induction_curve_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_key('breakdown_torque', self%breakdown_torque)
    call parameters%add_key('breakdown_slip', self%breakdown_slip)
    call parameters%add_key('synchronous_speed', self%synchronous_speed)
  end subroutine list_induction

end module nocdyn_torque_curves
