!> Torques of a slider-crank: of the pressure on its piston, and of the inertia of what moves with it.
module nocdyn_slider_cranks
  use nocdyn_curves, only: curve_t, extrapolation_linear, interpolation_cubic, new_curve
  use nocdyn_fourier, only: fourier_coefficients
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: lever, gas_harmonics, sampled_gas_torque, inertia_harmonics, turn_angles, inertia_orders, close_cycle, sample_cycle

  type, public :: cylinder_t
    real(wp) :: bore = 0.0_wp           !! diameter of the piston [m]
    real(wp) :: crank_radius = 0.0_wp   !! r [m]
    real(wp) :: rod_length = 0.0_wp     !! l [m], more than r + |e|
    real(wp) :: offset = 0.0_wp         !! e, of the piston's line beside the axis of the crank [m]
  end type cylinder_t

  real(wp), parameter :: pi = acos(-1.0_wp)
  integer, parameter, public :: samples = 4096   !! of a cycle: the pressure between them follows from points that are less dense
  integer, parameter :: turn_samples = 1024      ! of the inertia, whose harmonics fall faster than those of a pressure
  integer, parameter, public :: highest_order = 64   !! of an inertia torque; for r / l <= 0.9 it has no more above rounding

contains

  !> Torque per force on the piston, -x' of its position x = r cos(theta) + sqrt(l^2 - p^2), p = r sin(theta) - e, which are the
  !> rows of nocdyn_crank_rows: r sin(theta) + p r cos(theta) / sqrt(l^2 - p^2).
  elemental real(wp) function lever(crank, theta)
    type(cylinder_t), intent(in) :: crank
    real(wp), intent(in) :: theta   !! angle of the crank from where it points along the line of the piston, to it [rad]
    real(wp) :: across

    across = crank%crank_radius * sin(theta) - crank%offset
    lever = crank%crank_radius * (sin(theta) + across * cos(theta) / sqrt(crank%rod_length**2 - across**2))
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

  !> The torque of a reciprocating mass m over omega^2, as of `inertia_orders`: the one of the inertia m x'^2. For small
  !> lambda = r / l and no offset it is m r^2 (lambda / 4, -1/2, -3 lambda / 4, -lambda^2 / 4) sin(k theta), k = 1 to 4, the first
  !> three in J. P. Den Hartog, Mechanical Vibrations, 4th edition, 1956, chapter 5.
  pure subroutine inertia_harmonics(crank, mass, sine, cosine)
    type(cylinder_t), intent(in) :: crank
    real(wp), intent(in) :: mass                                   !! [kg]
    real(wp), allocatable, intent(out) :: sine(:), cosine(:)       !! [kg m2], of the orders 1, 2, ...

    call inertia_orders(mass * lever(crank, turn_angles())**2, sine, cosine)
  end subroutine inertia_harmonics

  !> The angles of a turn at which `inertia_orders` wants an inertia [rad].
  pure function turn_angles()
    real(wp) :: turn_angles(turn_samples)
    integer :: i

    turn_angles = [(2.0_wp * pi * (i - 1) / turn_samples, i=1, turn_samples)]
  end function turn_angles

  !> The torque -J'(theta) / 2 over omega^2 of an inertia J(theta) that repeats every turn: the sum of sine_k sin(k theta) +
  !> cosine_k cos(k theta), with all orders up to `highest_order` that are more than rounding errors.
  pure subroutine inertia_orders(inertia, sine, cosine)
    real(wp), intent(in) :: inertia(:)                         !! at `turn_angles` [kg m2]
    real(wp), allocatable, intent(out) :: sine(:), cosine(:)   !! [kg m2], of the orders 1, 2, ...
    real(wp), parameter :: rounding = 2 * epsilon(1.0_wp)      ! of the coefficients of J, relative to its largest value
    real(wp), dimension(highest_order) :: by_cosine, by_sine
    real(wp) :: mean
    integer :: k, last

    call fourier_coefficients(inertia, mean, by_sine, by_cosine)
    last = findloc(hypot(by_sine, by_cosine) > rounding * maxval(abs(inertia)), .true., dim=1, back=.true.)
    sine = [(0.5_wp * k * by_cosine(k), k=1, last)]
    cosine = [(-0.5_wp * k * by_sine(k), k=1, last)]
  end subroutine inertia_orders

end module nocdyn_slider_cranks
