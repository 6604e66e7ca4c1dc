!> Torques of a slider-crank: of the pressure on its piston, and of the inertia of what moves with it.
module nocdyn_slider_cranks
  use nocdyn_curves, only: curve_t, extrapolation_linear, interpolation_cubic, new_curve
  use nocdyn_fourier, only: fourier_coefficients
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: lever, gas_harmonics, sampled_gas_torque, inertia_harmonics, close_cycle, sample_cycle

  type, public :: cylinder_t
    real(wp) :: bore = 0.0_wp           !! diameter of the piston [m]
    real(wp) :: crank_radius = 0.0_wp   !! r [m]
    real(wp) :: rod_length = 0.0_wp     !! l > r [m]
  end type cylinder_t

  real(wp), parameter :: pi = acos(-1.0_wp)
  integer, parameter, public :: samples = 4096   !! of a cycle: the pressure between them follows from points that are less dense

contains

  !> Torque per force on the piston, r sin(theta) (1 + lambda cos(theta) / sqrt(1 - lambda^2 sin(theta)^2)) with lambda = r / l.
  elemental real(wp) function lever(crank, theta)
    type(cylinder_t), intent(in) :: crank
    real(wp), intent(in) :: theta   !! angle of the crank after top dead centre [rad]
    real(wp) :: ratio

    ratio = crank%crank_radius / crank%rod_length
    lever = crank%crank_radius * sin(theta) * (1.0_wp + ratio * cos(theta) / sqrt(1.0_wp - (ratio * sin(theta))**2))
  end function lever

  !> Takes the last point of a cycle away if it is the first one again, which then has the mean of both values.
  pure subroutine close_cycle(cycle, theta, values)
    real(wp), intent(in) :: cycle                               !! [rad]
    real(wp), allocatable, intent(inout) :: theta(:), values(:) !! points, ascending; [rad], of any unit
    integer :: last

    last = size(theta)
    if (theta(last) - theta(1) <= cycle - 0.5_wp * (theta(last) - theta(last - 1))) return
    values(1) = 0.5_wp * (values(1) + values(last))
    theta = theta(:last - 1)
    values = values(:last - 1)
  end subroutine close_cycle

  !> The values at equal distances over a cycle from the angle 0 on, by a monotone cubic through points that repeat.
  function sample_cycle(cycle, theta, values) result(sampled)
    real(wp), intent(in) :: cycle       !! [rad]
    real(wp), intent(in) :: theta(:)    !! points of less than a cycle, ascending [rad]
    real(wp), intent(in) :: values(:)   !! at the points
    real(wp) :: sampled(samples)
    type(curve_t) :: curve
    integer :: i

    curve = new_curve([theta - cycle, theta, theta + cycle], [values, values, values], interpolation_cubic, &
                      extrapolation_linear)
    do i = 1, samples
      sampled(i) = curve%value(theta(1) + modulo(cycle * (i - 1) / samples - theta(1), cycle))
    end do
  end function sample_cycle

  !> Mean and harmonics of the gas torque, sums of sine_k sin(k x) + cosine_k cos(k x), x = 2 pi theta / cycle.
  subroutine gas_harmonics(crank, cycle, theta, pressure, mean, sine, cosine)
    type(cylinder_t), intent(in) :: crank
    real(wp), intent(in) :: cycle                     !! 2 pi or 4 pi [rad]
    real(wp), intent(in) :: theta(:)                  !! points of less than a cycle, ascending; 0: top dead centre [rad]
    real(wp), intent(in) :: pressure(:)               !! at the points, above the one of the crankcase [Pa]
    real(wp), intent(out) :: mean                     !! [N m]
    real(wp), intent(out) :: sine(:), cosine(:)       !! [N m], [harmonics]

    call fourier_coefficients(sampled_gas_torque(crank, cycle, theta, pressure), mean, sine, cosine)
  end subroutine gas_harmonics

  !> The gas torque at equal distances over a cycle from the angle 0 on.
  function sampled_gas_torque(crank, cycle, theta, pressure) result(torque)
    type(cylinder_t), intent(in) :: crank
    real(wp), intent(in) :: cycle                   !! 2 pi or 4 pi [rad]
    real(wp), intent(in) :: theta(:), pressure(:)   !! as of `gas_harmonics`
    real(wp) :: torque(samples)                     !! [N m]
    integer :: i

    torque = sample_cycle(cycle, theta, pressure)
    do i = 1, samples
      torque(i) = torque(i) * 0.25_wp * pi * crank%bore**2 * lever(crank, cycle * (i - 1) / samples)
    end do
  end function sampled_gas_torque

  !> Amplitudes of sin(k theta), k = 1 to 4, of the torque of a reciprocating mass m over omega^2:
  !> m r^2 (lambda / 4, -1/2, -3 lambda / 4, -lambda^2 / 4), lambda = r / l. The terms that are left out are smaller by
  !> lambda^2. The first three are in J. P. Den Hartog, Mechanical Vibrations, 4th edition, 1956, chapter 5; the fourth follows
  !> likewise from the piston's travel r (cos theta + lambda / 4 cos 2 theta).
  pure function inertia_harmonics(crank, mass) result(amplitude)
    type(cylinder_t), intent(in) :: crank
    real(wp), intent(in) :: mass    !! [kg]
    real(wp) :: amplitude(4)        !! [kg m2]

    associate (ratio => crank%crank_radius / crank%rod_length)
      amplitude = mass * crank%crank_radius**2 * [0.25_wp * ratio, -0.5_wp, -0.75_wp * ratio, -0.25_wp * ratio**2]
    end associate
  end function inertia_harmonics

end module nocdyn_slider_cranks
