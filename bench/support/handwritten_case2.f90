!> The paper's machine, case 2, integrated as a good engineer would do it for this machine alone.
!>
!> Reduced form, states omega_1, omega_2, phi_1, phi_2, all constants in the code but two that vary from machine to
!> machine; Dormand and Prince's method with the error norm, the PI controller and the dense output of Hairer's DOPRI5.
!> Nothing is allocated, nothing is indirect.
module handwritten_case2
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: variant_of, trajectory, end_and_peak

  integer, parameter, public :: outputs = 1001
  real(wp), parameter :: t_end = 10.0_wp

  real(wp), parameter :: inertia_1 = 10.0_wp, inertia_2 = 5.0_wp, inertia_3 = 5.0_wp
  real(wp), parameter :: stiffness = 100.0_wp
  real(wp), parameter :: ratio = 2.0_wp / 3.0_wp
  real(wp), parameter :: motor_a = 200.0_wp, motor_b = 10.0_wp, motor_c = 1.0_wp
  real(wp), parameter :: amplitude = 20.0_wp, frequency = 5.0_wp

  real(wp), parameter :: over_1 = 1.0_wp / inertia_1, over_23 = 1.0_wp / (inertia_2 + ratio**2 * inertia_3)

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
  real(wp), parameter :: min_factor = 0.2_wp, most_change = 10.0_wp, least_error = 1.0e-4_wp
  real(wp), parameter :: near = 1.0e-5_wp   ! of theta: the twist is flat where its rate is zero

  type, public :: variant_t
    private
    real(wp) :: cubic_stiffness   !! [N m/rad3]
    real(wp) :: load              !! viscous, about the axis of body 2 [N m s/rad]
  end type variant_t

  !> A run on its way: the step at work and what the controller remembers.
  type :: integrator_t
    real(wp) :: t, h, error, old_error
    real(wp), dimension(4) :: y, y_new, k1, k3, k4, k5, k6, k7
    real(wp) :: rtol, atol
    logical :: was_rejected
    integer :: steps         ! attempts
    integer :: evaluations
  end type integrator_t

contains

  elemental function variant_of(cubic_stiffness, viscous) result(variant)
    real(wp), intent(in) :: cubic_stiffness   !! of the coupling [N m/rad3]
    real(wp), intent(in) :: viscous           !! of the load, about its own axis [N m s/rad]
    type(variant_t) :: variant

    variant = variant_t(cubic_stiffness, ratio**2 * viscous)
  end function variant_of

  pure function derivative(variant, t, y) result(dydt)
    type(variant_t), intent(in) :: variant
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(4)
    real(wp) :: dydt(4)
    real(wp) :: elastic

    elastic = moment(variant, y(4) - y(3))
    dydt(1) = (motor_a - (motor_b + motor_c * y(1)) * y(1) + amplitude * sin(frequency * t) + elastic) * over_1
    dydt(2) = -(elastic + variant%load * y(2)) * over_23
    dydt(3) = y(1)
    dydt(4) = y(2)
  end function derivative

  elemental function moment(variant, twist)
    type(variant_t), intent(in) :: variant
    real(wp), intent(in) :: twist
    real(wp) :: moment

    moment = (stiffness + variant%cubic_stiffness * twist * twist) * twist
  end function moment

  !> From rest to t_end; states at `outputs` equidistant times.
  pure subroutine trajectory(variant, rtol, atol, states, steps, evaluations)
    type(variant_t), intent(in) :: variant
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(out) :: states(4, outputs)
    integer, intent(out) :: steps         !! attempts
    integer, intent(out) :: evaluations
    type(integrator_t) :: march
    integer :: next

    call begin(variant, rtol, atol, march)
    states(:, 1) = march%y
    next = 2
    do
      call step(variant, march)
      if (time_of(next) <= march%t + march%h) call interpolate(march, next, states)
      if (next > outputs) exit
      call go_on(march)
    end do
    steps = march%steps
    evaluations = march%evaluations
  end subroutine trajectory

  !> From rest to t_end: the state there, and the largest |elastic moment| of the continuous solution.
  pure subroutine end_and_peak(variant, rtol, atol, y, peak, steps, evaluations)
    type(variant_t), intent(in) :: variant
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(out) :: y(4)
    real(wp), intent(out) :: peak         !! [N m]
    integer, intent(out) :: steps         !! attempts
    integer, intent(out) :: evaluations
    type(integrator_t) :: march
    real(wp) :: twist   ! the largest |twist| so far: the moment grows with it

    call begin(variant, rtol, atol, march)
    twist = 0.0_wp
    do
      call step(variant, march)
      if ((march%y(2) - march%y(1)) * (march%y_new(2) - march%y_new(1)) < 0) twist = max(twist, abs(extreme_twist(march)))
      if (march%t + march%h >= t_end) exit
      call go_on(march)
    end do
    y = march%y_new
    peak = abs(moment(variant, max(twist, abs(y(4) - y(3)))))
    steps = march%steps
    evaluations = march%evaluations
  end subroutine end_and_peak

  pure subroutine begin(variant, rtol, atol, march)
    type(variant_t), intent(in) :: variant
    real(wp), intent(in) :: rtol, atol
    type(integrator_t), intent(out) :: march

    march%t = 0.0_wp
    march%y = 0.0_wp
    march%k1 = derivative(variant, march%t, march%y)
    march%h = first_step(variant, march%y, march%k1, rtol, atol)
    march%old_error = least_error
    march%rtol = rtol
    march%atol = atol
    march%was_rejected = .false.
    march%steps = 0
    march%evaluations = 2
  end subroutine begin

  !> Until a step is accepted; y and t still are those of its start.
  pure subroutine step(variant, march)
    type(variant_t), intent(in) :: variant
    type(integrator_t), intent(inout) :: march
    real(wp) :: k2(4), scales(4), error, change

    associate (t => march%t, h => march%h, y => march%y, y_new => march%y_new, k1 => march%k1, k3 => march%k3, &
               k4 => march%k4, k5 => march%k5, k6 => march%k6, k7 => march%k7)
      do
        if (t + 1.01_wp * h >= t_end) h = t_end - t
        k2 = derivative(variant, t + c2 * h, y + h * (a21 * k1))
        k3 = derivative(variant, t + c3 * h, y + h * (a31 * k1 + a32 * k2))
        k4 = derivative(variant, t + c4 * h, y + h * (a41 * k1 + a42 * k2 + a43 * k3))
        k5 = derivative(variant, t + c5 * h, y + h * (a51 * k1 + a52 * k2 + a53 * k3 + a54 * k4))
        k6 = derivative(variant, t + h, y + h * (a61 * k1 + a62 * k2 + a63 * k3 + a64 * k4 + a65 * k5))
        y_new = y + h * (b1 * k1 + b3 * k3 + b4 * k4 + b5 * k5 + b6 * k6)
        k7 = derivative(variant, t + h, y_new)
        march%steps = march%steps + 1
        march%evaluations = march%evaluations + 6

        scales = march%atol + march%rtol * max(abs(y), abs(y_new))
        error = sqrt(0.25_wp * sum((h * (e1 * k1 + e3 * k3 + e4 * k4 + e5 * k5 + e6 * k6 + e7 * k7) / scales)**2))
        if (error <= 1.0_wp) exit
        change = safety * max(error, 1.0e-30_wp)**(-exponent)
        h = h * max(min_factor, change)
        march%was_rejected = .true.
      end do
    end associate
    march%error = error
  end subroutine step

  !> To the end of the accepted step, and the size of the next one.
  pure subroutine go_on(march)
    type(integrator_t), intent(inout) :: march
    real(wp) :: change

    march%t = march%t + march%h
    change = safety * max(march%error, 1.0e-30_wp)**(-exponent) * march%old_error**beta
    change = min(max(min_factor, change), most_change)
    if (march%was_rejected) change = min(change, 1.0_wp)
    march%h = march%h * change
    march%old_error = max(march%error, least_error)
    march%was_rejected = .false.
    march%y = march%y_new
    march%k1 = march%k7
  end subroutine go_on

  !> The states at the outputs within a step, by the polynomial of CONTD5 in powers of theta.
  pure subroutine interpolate(march, next, states)
    type(integrator_t), intent(in) :: march
    integer, intent(inout) :: next   !! output
    real(wp), intent(inout) :: states(4, outputs)
    real(wp) :: p(4, 0:4), theta, over_h

    p = polynomial(march)
    over_h = 1 / march%h
    do while (next <= outputs)
      if (time_of(next) > march%t + march%h) exit
      theta = (time_of(next) - march%t) * over_h
      states(:, next) = p(:, 0) + theta * (p(:, 1) + theta * (p(:, 2) + theta * (p(:, 3) + theta * p(:, 4))))
      next = next + 1
    end do
  end subroutine interpolate

  !> The twist where its rate is zero in a step whose ends have rates of different signs, by bisection and Newton's method.
  pure function extreme_twist(march) result(twist)
    type(integrator_t), intent(in) :: march
    real(wp) :: twist
    real(wp) :: p(4, 0:4), rate(0:4), theta, low, high, value, change
    integer :: i

    p = polynomial(march)
    rate = p(2, :) - p(1, :)
    low = 0.0_wp
    high = 1.0_wp
    theta = rate(0) / (rate(0) - (march%y_new(2) - march%y_new(1)))
    do i = 1, 20
      value = rate(0) + theta * (rate(1) + theta * (rate(2) + theta * (rate(3) + theta * rate(4))))
      if (value * rate(0) > 0) then
        low = theta
      else
        high = theta
      end if
      change = value / (rate(1) + theta * (2 * rate(2) + theta * (3 * rate(3) + theta * 4 * rate(4))))
      theta = theta - change
      if (abs(change) < near) exit
      if (theta <= low .or. theta >= high) theta = 0.5_wp * (low + high)
    end do
    twist = p(4, 0) - p(3, 0) + theta * (p(4, 1) - p(3, 1) + theta * (p(4, 2) - p(3, 2) &
            + theta * (p(4, 3) - p(3, 3) + theta * (p(4, 4) - p(3, 4)))))
  end function extreme_twist

  !> Coefficients of the dense output in powers of theta, 0 at the start of the step and 1 at its end.
  pure function polynomial(march) result(p)
    type(integrator_t), intent(in) :: march
    real(wp) :: p(4, 0:4)
    real(wp), dimension(4) :: rise, bend

    associate (h => march%h, k1 => march%k1, k3 => march%k3, k4 => march%k4, k5 => march%k5, k6 => march%k6, k7 => march%k7)
      rise = march%y_new - march%y
      bend = h * (d1 * k1 + d3 * k3 + d4 * k4 + d5 * k5 + d6 * k6 + d7 * k7)
      p(:, 0) = march%y
      p(:, 1) = h * k1
      p(:, 2) = 3 * rise - h * (2 * k1 + k7) + bend
      p(:, 3) = h * (k1 + k7) - 2 * (rise + bend)
      p(:, 4) = bend
    end associate
  end function polynomial

  pure real(wp) function time_of(output)
    integer, intent(in) :: output

    time_of = (output - 1) * (t_end / (outputs - 1))
    if (output == outputs) time_of = t_end
  end function time_of

  !> Hairer's first step for a method of order 5.
  pure function first_step(variant, y, dydt, rtol, atol) result(h)
    type(variant_t), intent(in) :: variant
    real(wp), intent(in) :: y(4), dydt(4)
    real(wp), intent(in) :: rtol, atol
    real(wp) :: h
    real(wp) :: scales(4), size_y, size_f, size_change, h_0

    scales = atol + rtol * abs(y)
    size_y = norm2(y / scales)
    size_f = norm2(dydt / scales)
    h_0 = 1.0e-6_wp
    if (size_y > 1.0e-5_wp .and. size_f > 1.0e-5_wp) h_0 = 0.01_wp * size_y / size_f
    size_change = norm2((derivative(variant, h_0, y + h_0 * dydt) - dydt) / scales) / h_0
    h = min(100 * h_0, (0.01_wp / max(size_f, size_change))**0.2_wp)
  end function first_step

end module handwritten_case2
