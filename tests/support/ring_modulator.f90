!> The ring modulator of the Test Set for IVP Solvers 2.4 (Mazzia and Magherini), RINGMOD: fifteen stiff equations that depend on
!> the time, in volts, amperes and seconds; the state at t = 0 is zero.
module nocdyn_ring_modulator
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: ring_derivative, ring_jacobian

  integer, parameter, public :: ring_states = 15

  real(wp), parameter :: pi = acos(-1.0_wp)
  real(wp), parameter :: fast = 2.0e4_wp * pi, slow = 2.0e3_wp * pi     ! frequencies of the inputs [rad/s]
  real(wp), parameter :: gamma = 40.67286402e-9_wp, delta = 17.7493332_wp   ! of the diodes
  real(wp), parameter :: most = 300.0_wp   ! exponent of a diode: a step that goes too far must not overflow
  real(wp), parameter :: capacity(7) = [1.6e-8_wp, 1.6e-8_wp, 2.0e-12_wp, 2.0e-12_wp, 2.0e-12_wp, 2.0e-12_wp, 1.0e-8_wp]
  real(wp), parameter :: inductance(8:15) = [4.45_wp, 4.45_wp, 5.0e-4_wp, 5.0e-4_wp, 5.0e-4_wp, 5.0e-4_wp, 2.0e-3_wp, 2.0e-3_wp]

  ! Voltages of the four diodes: rows of signs of y(3:7), and the sign of the fast input.
  real(wp), parameter :: voltage(4, 3:7) = reshape([real(wp) :: &
    1, 0, 0, -1,  0, -1, 1, 0,  -1, 0, 1, 0,  0, 1, 0, -1,  -1, -1, 1, 1], [4, 5])
  real(wp), parameter :: input_sign(4) = [-1.0_wp, -1.0_wp, 1.0_wp, 1.0_wp]

  ! Signs of their currents in the equations 3 to 7.
  real(wp), parameter :: current(3:7, 4) = reshape([real(wp) :: &
    -1, 0, 1, 0, 1,  0, 1, 0, -1, 1,  0, -1, -1, 0, -1,  1, 0, 0, 1, -1], [5, 4])

contains

  subroutine ring_derivative(t, y, dydt)
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)      !! [ring_states]
    real(wp), intent(out) :: dydt(:)  !! [ring_states]
    real(wp) :: linear(ring_states, ring_states)

    call set_linear_part(linear)
    dydt(:) = matmul(linear, y)
    dydt(3:7) = dydt(3:7) + matmul(current, gamma * (exp(exponents(t, y)) - 1))
    dydt(14) = dydt(14) + 0.5_wp * sin(slow * t)
    dydt(:7) = dydt(:7) / capacity
    dydt(8:) = dydt(8:) / inductance
  end subroutine ring_derivative

  subroutine ring_jacobian(t, y, dfdy, dfdt)
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)          !! [ring_states]
    real(wp), intent(out) :: dfdy(:, :)   !! [ring_states, ring_states]
    real(wp), intent(out) :: dfdt(:)      !! [ring_states]
    real(wp) :: slopes(4)
    integer :: j

    call set_linear_part(dfdy)
    slopes = gamma * delta * exp(exponents(t, y))
    do j = 3, 7
      dfdy(3:7, j) = dfdy(3:7, j) + matmul(current, slopes * voltage(:, j))
    end do
    dfdt(:) = 0.0_wp
    dfdt(3:7) = matmul(current, slopes * input_sign) * (2 * fast * cos(fast * t))
    dfdt(14) = 0.5_wp * slow * cos(slow * t)
    do j = 1, ring_states
      dfdy(:7, j) = dfdy(:7, j) / capacity
      dfdy(8:, j) = dfdy(8:, j) / inductance
    end do
    dfdt(:7) = dfdt(:7) / capacity
    dfdt(8:) = dfdt(8:) / inductance
  end subroutine ring_jacobian

  !> Exponents of the four diodes.
  pure function exponents(t, y)
    real(wp), intent(in) :: t, y(:)
    real(wp) :: exponents(4)

    exponents = min(delta * (matmul(voltage, y(3:7)) + input_sign * (2 * sin(fast * t))), most)
  end function exponents

  !> All terms but the diodes and the inputs, before the division by capacities and inductances.
  pure subroutine set_linear_part(linear)
    real(wp), intent(out) :: linear(:, :)

    linear = 0.0_wp
    linear(1, [1, 8, 10, 11, 14]) = [-1 / 2.5e4_wp, 1.0_wp, -0.5_wp, 0.5_wp, 1.0_wp]
    linear(2, [2, 9, 12, 13, 15]) = [-1 / 2.5e4_wp, 1.0_wp, -0.5_wp, 0.5_wp, 1.0_wp]
    linear(3, 10) = 1.0_wp
    linear(4, 11) = -1.0_wp
    linear(5, 12) = 1.0_wp
    linear(6, 13) = -1.0_wp
    linear(7, 7) = -1 / 50.0_wp
    linear(8, 1) = -1.0_wp
    linear(9, 2) = -1.0_wp
    linear(10, [1, 3, 10]) = [0.5_wp, -1.0_wp, -17.3_wp]
    linear(11, [1, 4, 11]) = [-0.5_wp, 1.0_wp, -17.3_wp]
    linear(12, [2, 5, 12]) = [0.5_wp, -1.0_wp, -17.3_wp]
    linear(13, [2, 6, 13]) = [-0.5_wp, 1.0_wp, -17.3_wp]
    linear(14, [1, 14]) = [-1.0_wp, -86.3_wp]
    linear(15, [2, 15]) = [-1.0_wp, -636.3_wp]
  end subroutine set_linear_part

end module nocdyn_ring_modulator
