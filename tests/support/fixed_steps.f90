!> Steps of constant size, for the measurement of orders.
module nocdyn_fixed_steps
  use nocdyn_kinds, only: wp
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_step_attempt, only: allocate_step_attempt, evaluate_start, begin_attempt, step_attempt_t
  implicit none (type, external)
  private

  public :: prepare_attempt, take_steps, one_step, measured_order

contains

  !> `steps` equal steps of a block of one lane from t_start to t_end.
  subroutine take_steps(stepper, system, t_start, t_end, steps, y)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t_start, t_end
    integer, intent(in) :: steps
    real(wp), intent(inout) :: y(:)
    type(step_attempt_t) :: attempt
    integer :: i

    call prepare_attempt(stepper, system, t_start, y, attempt)
    do i = 1, steps
      attempt%t = t_start + (i - 1) * (t_end - t_start) / steps
      attempt%h = (t_end - t_start) / steps
      call begin_attempt(attempt)
      call stepper%take_step(system, attempt)
      attempt%y = attempt%y_new
      call stepper%accept(attempt%active)
    end do
    y = attempt%y(1, :attempt%components)
  end subroutine take_steps

  !> One step of size h: its result, its error estimate, and its dense output at `theta`.
  subroutine one_step(stepper, system, t, h, theta, y)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t, h
    real(wp), intent(in) :: theta
    real(wp), intent(inout) :: y(:, :)   !! first column: initial state; on return y_new, error estimate, y(t + theta h)
    type(step_attempt_t) :: attempt
    real(wp), allocatable :: coefficients(:, :, :)
    logical, parameter :: wanted(1) = .true.
    integer :: power

    call prepare_attempt(stepper, system, t, y(:, 1), attempt)
    attempt%h = h
    call begin_attempt(attempt)
    call stepper%take_step(system, attempt)
    allocate (coefficients(1, size(attempt%y, 2), stepper%degree), source=0.0_wp)
    call stepper%interpolate(system, attempt, wanted, coefficients)
    y(:, 3) = attempt%y(1, :size(y, 1))
    do power = 1, size(coefficients, 3)
      y(:, 3) = y(:, 3) + theta**power * coefficients(1, :size(y, 1), power)
    end do
    y(:, 1) = attempt%y_new(1, :size(y, 1))
    y(:, 2) = attempt%error_estimate(1, :size(y, 1))
  end subroutine one_step

  subroutine prepare_attempt(stepper, system, t, y, attempt)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)
    type(step_attempt_t), intent(out) :: attempt

    call stepper%prepare(system)
    call allocate_step_attempt(attempt, system)
    attempt%has_low_order_estimate = stepper%has_low_order_error
    attempt%t = t
    attempt%y(1, :size(y)) = y
    call evaluate_start(attempt, system, attempt%active, attempt%slope)
    call stepper%start(attempt, attempt%active)
  end subroutine prepare_attempt

  !> The order p of errors that fall as h^p, from the errors at h and h / 2.
  elemental function measured_order(error, error_of_half) result(order)
    real(wp), intent(in) :: error, error_of_half
    real(wp) :: order

    order = log(error / error_of_half) / log(2.0_wp)
  end function measured_order

end module nocdyn_fixed_steps
