!> A ball that falls through air and bounces: height y(1) [m], velocity y(2) [m/s].
module ball
  use nocdyn_kinds, only: wp
  use nocdyn_sampler, only: sampler_t
  implicit none (type, external)
  private

  public :: fall

  !> A sampler with an event: the height falls to zero, which ends the flight.
  type, extends(sampler_t), public :: ground_t
  contains
    procedure :: event_values
    procedure :: on_event
  end type ground_t

contains

  subroutine fall(t, y, dydt)
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)
    real(wp), intent(out) :: dydt(:)
    real(wp), parameter :: gravity = 9.81_wp, drag = 0.01_wp

    dydt(1) = y(2)
    dydt(2) = -gravity - drag * abs(y(2)) * y(2)
  end subroutine fall

  subroutine event_values(self, lane, t, y, g)
    class(ground_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    g(1) = y(1)
  end subroutine event_values

  subroutine on_event(self, lane, event, t, y, is_terminal)
    class(ground_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: event
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    logical, intent(out) :: is_terminal

    is_terminal = .true.
  end subroutine on_event

end module ball

!> Prints the times and speeds at which the ball hits the ground within five seconds.
program bouncing_ball
  use ball, only: fall, ground_t
  use nocdyn_errors, only: error_t
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: failure_message, integration_done, integration_stopped, solver_status_t
  use nocdyn_plain_system, only: plain_system, plain_system_t
  use nocdyn_sampler, only: sampler
  use nocdyn_observer, only: event_falling
  implicit none (type, external)
  real(wp), parameter :: t_end = 5.0_wp, restitution = 0.8_wp
  type(integration_settings_t), parameter :: settings = integration_settings_t(method='rk853', rtol=1.0e-10_wp, atol=1.0e-10_wp)
  type(plain_system_t) :: system
  type(ground_t) :: ground
  type(solver_status_t) :: solver_status
  type(error_t), allocatable :: error
  real(wp) :: t, y(1, 2)

  system = plain_system(2, fall)
  t = 0.0_wp
  y(1, :) = [5.0_wp, 0.0_wp]
  do
    ground%sampler_t = sampler(1, 2, 2)
    ground%directions = [event_falling]
    call integrate(system, settings, [t, t_end], y, ground, solver_status, error)
    if (allocated(error)) error stop error%message
    t = solver_status%t(1)
    if (solver_status%code(1) == integration_done) exit
    if (solver_status%code(1) /= integration_stopped) error stop failure_message(solver_status, 1, system, settings%rtol, &
                                                                                 settings%atol)
    print '("ground at t =", f10.7, " s with", f11.7, " m/s")', t, y(1, 2)
    y(1, :) = [0.0_wp, -restitution * y(1, 2)]
  end do
  print '("height at t =", f10.7, " s is ", f11.7, " m")', t, y(1, 1)
end program bouncing_ball
