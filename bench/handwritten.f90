!> The paper's machine, case 2, integrated as a good engineer would do it for this machine alone.
!>
!> Reduced form, states omega_1, omega_2, phi_1, phi_2, all constants in the code; Dormand and Prince's method with the
!> error norm, the PI controller and the dense output of Hairer's DOPRI5. Nothing is allocated, nothing is indirect.
module handwritten_case2
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: integrate_case2

  integer, parameter, public :: outputs = 1001
  real(wp), parameter :: t_end = 10.0_wp

  real(wp), parameter :: inertia_1 = 10.0_wp, inertia_2 = 5.0_wp, inertia_3 = 5.0_wp
  real(wp), parameter :: stiffness = 100.0_wp, cubic_stiffness = 10.0_wp
  real(wp), parameter :: ratio = 2.0_wp / 3.0_wp
  real(wp), parameter :: motor_a = 200.0_wp, motor_b = 10.0_wp, motor_c = 1.0_wp
  real(wp), parameter :: viscous = 100.0_wp
  real(wp), parameter :: amplitude = 20.0_wp, frequency = 5.0_wp

  real(wp), parameter :: over_1 = 1.0_wp / inertia_1, over_23 = 1.0_wp / (inertia_2 + ratio**2 * inertia_3)
  real(wp), parameter :: load = ratio**2 * viscous

  real(wp), parameter :: c2 = 1.0_wp / 5, c3 = 3.0_wp / 10, c4 = 4.0_wp / 5, c5 = 8.0_wp / 9
  real(wp), parameter :: a21 = 1.0_wp / 5
  real(wp), parameter :: a31 = 3.0_wp / 40, a32 = 9.0_wp / 40
  real(wp), parameter :: a41 = 44.0_wp / 45, a42 = -56.0_wp / 15, a43 = 32.0_wp / 9
  real(wp), parameter :: a51 = 19372.0_wp / 6561, a52 = -25360.0_wp / 2187, a53 = 64448.0_wp / 6561, a54 = -212.0_wp / 729
  real(wp), parameter :: a61 = 9017.0_wp / 3168, a62 = -355.0_wp / 33, a63 = 46732.0_wp / 5247, a64 = 49.0_wp / 176, &
                         a65 = -5103.0_wp / 18656
  real(wp), parameter :: b1 = 35.0_wp / 384, b3 = 500.0_wp / 1113, b4 = 125.0_wp / 192, b5 = -2187.0_wp / 6784, b6 = 11.0_wp / 84
  real(wp), parameter :: e1 = 71.0_wp / 57600, e3 = -71.0_wp / 16695, e4 = 71.0_wp / 1920, e5 = -17253.0_wp / 339200, &
                         e6 = 22.0_wp / 525, e7 = -1.0_wp / 40
  real(wp), parameter :: d1 = -12715105075.0_wp / 11282082432.0_wp, d3 = 87487479700.0_wp / 32700410799.0_wp, &
                         d4 = -10690763975.0_wp / 1880347072.0_wp, d5 = 701980252875.0_wp / 199316789632.0_wp, &
                         d6 = -1453857185.0_wp / 822651844.0_wp, d7 = 69997945.0_wp / 29380423.0_wp

  real(wp), parameter :: safety = 0.9_wp, beta = 0.04_wp, exponent = 0.2_wp - 0.75_wp * beta
  real(wp), parameter :: least_change = 0.2_wp, most_change = 10.0_wp, least_error = 1.0e-4_wp

contains

  pure function derivative(t, y) result(dydt)
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(4)
    real(wp) :: dydt(4)
    real(wp) :: twist, moment

    twist = y(4) - y(3)
    moment = (stiffness + cubic_stiffness * twist * twist) * twist
    dydt(1) = (motor_a - (motor_b + motor_c * y(1)) * y(1) + amplitude * sin(frequency * t) + moment) * over_1
    dydt(2) = -(moment + load * y(2)) * over_23
    dydt(3) = y(1)
    dydt(4) = y(2)
  end function derivative

  !> From rest to t_end; states at `outputs` equidistant times.
  subroutine integrate_case2(rtol, atol, states, steps, evaluations)
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(out) :: states(4, outputs)
    integer, intent(out) :: steps         !! attempts
    integer, intent(out) :: evaluations
    real(wp), dimension(4) :: y, y_new, k1, k2, k3, k4, k5, k6, k7, scales
    real(wp) :: t, h, error, old_error, change
    integer :: next
    logical :: was_rejected

    y = 0.0_wp
    states(:, 1) = y
    t = 0.0_wp
    k1 = derivative(t, y)
    h = first_step(y, k1, rtol, atol)
    evaluations = 2
    steps = 0
    next = 2
    old_error = least_error
    was_rejected = .false.
    do
      if (t + 1.01_wp * h >= t_end) h = t_end - t
      k2 = derivative(t + c2 * h, y + h * (a21 * k1))
      k3 = derivative(t + c3 * h, y + h * (a31 * k1 + a32 * k2))
      k4 = derivative(t + c4 * h, y + h * (a41 * k1 + a42 * k2 + a43 * k3))
      k5 = derivative(t + c5 * h, y + h * (a51 * k1 + a52 * k2 + a53 * k3 + a54 * k4))
      k6 = derivative(t + h, y + h * (a61 * k1 + a62 * k2 + a63 * k3 + a64 * k4 + a65 * k5))
      y_new = y + h * (b1 * k1 + b3 * k3 + b4 * k4 + b5 * k5 + b6 * k6)
      k7 = derivative(t + h, y_new)
      steps = steps + 1
      evaluations = evaluations + 6

      scales = atol + rtol * max(abs(y), abs(y_new))
      error = sqrt(0.25_wp * sum((h * (e1 * k1 + e3 * k3 + e4 * k4 + e5 * k5 + e6 * k6 + e7 * k7) / scales)**2))
      change = safety * max(error, 1.0e-30_wp)**(-exponent)
      if (error > 1.0_wp) then
        h = h * max(least_change, change)
        was_rejected = .true.
        cycle
      end if

      if (time_of(next) <= t + h) call interpolate(t, h, y, y_new, k1, k3, k4, k5, k6, k7, next, states)
      t = t + h
      if (next > outputs) exit

      change = min(max(least_change, change * old_error**beta), most_change)
      if (was_rejected) change = min(change, 1.0_wp)
      h = h * change
      old_error = max(error, least_error)
      was_rejected = .false.
      y = y_new
      k1 = k7
    end do
  end subroutine integrate_case2

  !> The states at the outputs within a step, by the polynomial of CONTD5 in powers of theta.
  pure subroutine interpolate(t, h, y, y_new, k1, k3, k4, k5, k6, k7, next, states)
    real(wp), intent(in) :: t, h
    real(wp), dimension(4), intent(in) :: y, y_new, k1, k3, k4, k5, k6, k7
    integer, intent(inout) :: next   !! output
    real(wp), intent(inout) :: states(4, outputs)
    real(wp) :: rise(4), bend(4), p1(4), p2(4), p3(4), theta, over_h

    rise = y_new - y
    bend = h * (d1 * k1 + d3 * k3 + d4 * k4 + d5 * k5 + d6 * k6 + d7 * k7)
    p1 = h * k1
    p2 = 3 * rise - h * (2 * k1 + k7) + bend
    p3 = h * (k1 + k7) - 2 * (rise + bend)
    over_h = 1 / h
    do while (next <= outputs)
      if (time_of(next) > t + h) exit
      theta = (time_of(next) - t) * over_h
      states(:, next) = y + theta * (p1 + theta * (p2 + theta * (p3 + theta * bend)))
      next = next + 1
    end do
  end subroutine interpolate

  pure real(wp) function time_of(output)
    integer, intent(in) :: output

    time_of = (output - 1) * (t_end / (outputs - 1))
    if (output == outputs) time_of = t_end
  end function time_of

  !> Hairer's first step for a method of order 5.
  pure function first_step(y, dydt, rtol, atol) result(h)
    real(wp), intent(in) :: y(4), dydt(4)
    real(wp), intent(in) :: rtol, atol
    real(wp) :: h
    real(wp) :: scales(4), size_y, size_f, size_change, h_0

    scales = atol + rtol * abs(y)
    size_y = norm2(y / scales)
    size_f = norm2(dydt / scales)
    h_0 = 1.0e-6_wp
    if (size_y > 1.0e-5_wp .and. size_f > 1.0e-5_wp) h_0 = 0.01_wp * size_y / size_f
    size_change = norm2((derivative(h_0, y + h_0 * dydt) - dydt) / scales) / h_0
    h = min(100 * h_0, (0.01_wp / max(size_f, size_change))**0.2_wp)
  end function first_step

end module handwritten_case2

!> handwritten RTOL ATOL REPETITIONS STATES_FILE
program handwritten
  use contest, only: number_argument, print_report, seconds_now, text_argument, whole_argument, write_states
  use handwritten_case2, only: integrate_case2, outputs
  use nocdyn_kinds, only: wp
  implicit none (type, external)

  real(wp) :: states(4, outputs), rtol, atol
  real(wp), allocatable :: seconds(:)
  integer :: steps, evaluations, i

  rtol = number_argument(1)
  atol = number_argument(2)
  allocate (seconds(whole_argument(3)))
  do i = 1, size(seconds)
    seconds(i) = seconds_now()
    call integrate_case2(rtol, atol, states, steps, evaluations)
    seconds(i) = seconds_now() - seconds(i)
  end do
  call write_states(text_argument(4), states)
  call print_report(seconds, steps, evaluations)
end program handwritten
