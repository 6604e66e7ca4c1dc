!> Steps of a size that no error control changes, to measure orders with.
module nocdyn_fixed_steps
  use nocdyn_kinds, only: wp
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_trial, only: allocate_trial, evaluate_start, set_out, trial_t
  implicit none (type, external)
  private

  public :: prepare_trial, take_steps, one_step, measured_order

contains

  !> `steps` equal steps of a block of one lane from t_start to t_end.
  subroutine take_steps(stepper, system, t_start, t_end, steps, y)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t_start, t_end
    integer, intent(in) :: steps
    real(wp), intent(inout) :: y(:)
    type(trial_t) :: trial
    integer :: i

    call prepare_trial(stepper, system, t_start, y, trial)
    do i = 1, steps
      trial%t = t_start + (i - 1) * (t_end - t_start) / steps
      trial%h = (t_end - t_start) / steps
      call set_out(trial)
      call stepper%attempt(system, trial)
      trial%y = trial%y_new
      call stepper%accept(trial%working)
    end do
    y = trial%y(1, :trial%components)
  end subroutine take_steps

  !> One step of size h: its result, its deviation from the embedded solution, and the solution inside it at `theta`.
  subroutine one_step(stepper, system, t, h, theta, y)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t, h
    real(wp), intent(in) :: theta
    real(wp), intent(inout) :: y(:, :)   !! first column: start; on return the columns y_new, deviation, y(t + theta h)
    type(trial_t) :: trial
    real(wp), allocatable :: coefficients(:, :, :)
    logical, parameter :: wanted(1) = .true.
    integer :: power

    call prepare_trial(stepper, system, t, y(:, 1), trial)
    trial%h = h
    call set_out(trial)
    call stepper%attempt(system, trial)
    allocate (coefficients(1, size(trial%y, 2), stepper%degree), source=0.0_wp)
    call stepper%interpolate(system, trial, wanted, coefficients)
    y(:, 3) = trial%y(1, :size(y, 1))
    do power = 1, size(coefficients, 3)
      y(:, 3) = y(:, 3) + theta**power * coefficients(1, :size(y, 1), power)
    end do
    y(:, 1) = trial%y_new(1, :size(y, 1))
    y(:, 2) = trial%deviation(1, :size(y, 1))
  end subroutine one_step

  subroutine prepare_trial(stepper, system, t, y, trial)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(inout) :: system
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)
    type(trial_t), intent(out) :: trial

    call stepper%prepare(system)
    call allocate_trial(trial, system)
    trial%has_coarse_deviation = stepper%has_coarse_error
    trial%t = t
    trial%y(1, :size(y)) = y
    call evaluate_start(trial, system, trial%working, trial%slope)
    call stepper%begin(trial, trial%working)
  end subroutine prepare_trial

  !> The exponent p of errors that fall as h^p when h is halved.
  elemental function measured_order(error, error_of_half) result(order)
    real(wp), intent(in) :: error, error_of_half
    real(wp) :: order

    order = log(error / error_of_half) / log(2.0_wp)
  end function measured_order

end module nocdyn_fixed_steps
