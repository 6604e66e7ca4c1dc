!> PI governors: the throttle y = clip(z + gain (set_speed - omega)) between 0 and 1, z' = (y - z) / time.
!>
!> Between the limits z' = gain (set_speed - omega) / time, the integral of a PI controller. At a limit z tends to the limit.
!> Stopping the integration there (clamping) would make the state slide along the limit when the governor leaves it.
!> (K. J. Astrom, T. Hagglund, PID Controllers, 2nd ed. 1995, section 3.5: anti-windup by tracking, with the integral time.)
module nocdyn_governors
  use nocdyn_bank, only: boundary_width
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  implicit none (type, external)
  private

  !> The governors of the motors of a bank, shape [lanes, motors].
  type, public :: governor_t
    real(wp), allocatable :: set_speed(:, :)   !! [rad/s]
    real(wp), allocatable :: gain(:, :)        !! [s/rad], not zero
    real(wp), allocatable :: time(:, :)        !! integral time [s], positive
    real(wp), allocatable :: start(:, :)       !! throttle y at the start, 0 to 1
  contains
    procedure :: list_parameters
    procedure :: throttle
    procedure :: steady_throttle
    procedure :: rate
    procedure :: slopes
    procedure :: branch
    procedure :: indicator
  end type governor_t

  integer, parameter :: closed = -1, governing = 0, open = 1   ! the branches

contains

  !> Throttle y on a branch.
  pure real(wp) function throttle(self, lane, motor, branch, z, speed) result(y)
    class(governor_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    integer, intent(in) :: branch   !! closed, governing or open
    real(wp), intent(in) :: z, speed   !! integral, speed of the motor [rad/s]

    select case (branch)
    case (governing)
      y = z + self%gain(lane, motor) * (self%set_speed(lane, motor) - speed)
    case (open)
      y = 1.0_wp
    case default
      y = 0.0_wp
    end select
  end function throttle

  !> Throttle that a constant speed of the first lane ends in; at the set speed, where any is steady, the open one.
  pure real(wp) function steady_throttle(self, motor, speed) result(y)
    class(governor_t), intent(in) :: self
    integer, intent(in) :: motor
    real(wp), intent(in) :: speed   !! of the motor [rad/s]

    y = merge(1.0_wp, 0.0_wp, self%gain(1, motor) * (self%set_speed(1, motor) - speed) >= 0.0_wp)
  end function steady_throttle

  !> Rate z' of the integral [1/s].
  pure real(wp) function rate(self, lane, motor, throttle, z)
    class(governor_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: throttle   !! [1]
    real(wp), intent(in) :: z          !! integral [1]

    rate = (throttle - z) / self%time(lane, motor)
  end function rate

  !> Derivatives of the throttle and of z' by z and by the speed.
  pure subroutine slopes(self, lane, motor, branch, by_integral, by_speed, rate_by_integral, rate_by_speed)
    class(governor_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    integer, intent(in) :: branch   !! closed, governing or open
    real(wp), intent(out) :: by_integral, by_speed             !! of the throttle
    real(wp), intent(out) :: rate_by_integral, rate_by_speed   !! of z'

    by_integral = merge(1.0_wp, 0.0_wp, branch == governing)
    by_speed = -self%gain(lane, motor) * by_integral
    rate_by_integral = (by_integral - 1.0_wp) / self%time(lane, motor)
    rate_by_speed = by_speed / self%time(lane, motor)
  end subroutine slopes

  !> The branch that contains the state.
  pure integer function branch(self, lane, motor, z, speed)
    class(governor_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: z, speed   !! integral, speed of the motor [rad/s]

    branch = governing
    associate (y => self%throttle(lane, motor, governing, z, speed))
      if (y < 0) branch = closed
      if (y > 1) branch = open
    end associate
  end function branch

  !> Distance of the throttle from the nearest boundary of a branch, negative beyond it.
  pure real(wp) function indicator(self, lane, motor, branch, z, speed)
    class(governor_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    integer, intent(in) :: branch   !! closed, governing or open
    real(wp), intent(in) :: z, speed   !! integral, speed of the motor [rad/s]

    associate (y => self%throttle(lane, motor, governing, z, speed))
      select case (branch)
      case (governing)
        indicator = min(y, 1.0_wp - y)
      case (open)
        indicator = y - 1.0_wp
      case default
        indicator = -y
      end select
    end associate
    indicator = indicator + boundary_width
  end function indicator

  subroutine list_parameters(self, parameters)
    class(governor_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add('governor_speed', self%set_speed)
    call parameters%add('governor_gain', self%gain)
    call parameters%add_key('governor_time', self%time)
    call parameters%add('governor_start', self%start)
  end subroutine list_parameters

end module nocdyn_governors
