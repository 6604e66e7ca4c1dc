!> The automatic choice of the first step size.
module nocdyn_first_step
  use nocdyn_kinds, only: wp
  use nocdyn_step_attempt, only: begin_attempt, count_evaluations, evaluate_finite, step_attempt_t
  use nocdyn_step_control, only: smallest_step, step_control_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: guess_first_steps

  ! The constants of HINIT in Hairer's DOPRI5.
  real(wp), parameter :: negligible = 1.0e-5_wp      !! norms below it do not define a time scale
  real(wp), parameter :: no_curvature = 1.0e-15_wp
  real(wp), parameter :: small_step = 1.0e-6_wp
  real(wp), parameter :: small_change = 0.01_wp
  real(wp), parameter :: max_growth = 100.0_wp
  real(wp), parameter :: retreat = 0.01_wp           !! factor of a small step that cannot be evaluated

  real(wp), parameter :: largest_ratio = 1.0e100_wp  !! keeps squares finite

contains

  !> Sets the first step sizes of the active lanes from the slopes at both ends of a small Euler step:
  !> Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), II.4.
  subroutine guess_first_steps(control, order, system, attempt)
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: order
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt   !! reads t, y, slope and active; overwrites h, y_new and error_estimate
    real(wp) :: h, longer, position, steepest
    integer :: component, lane

    associate (slope => control%factor, curvature => control%log_ratio)   ! work space, [lanes]
      call weigh(control, system, attempt, attempt%slope)
      slope(:) = control%log_ratio
      do lane = 1, attempt%lanes
        attempt%h(lane) = 0.0_wp
        if (.not. attempt%active(lane)) cycle
        ! an Euler step over which y changes by about 1 %
        if (system%measures > 0) then
          position = rms_ratio(control, control%size(lane, :counted(system)), control%size(lane, :counted(system)))
        else
          position = rms_ratio(control, attempt%y(lane, :attempt%states), attempt%y(lane, :attempt%states))
        end if
        h = small_step
        if (min(position, slope(lane)) >= negligible) h = small_change * position / slope(lane)
        h = min(h, control%longest(lane), control%t_end - attempt%t(lane))
        h = max(h, smallest_step(attempt%t(lane)))
        attempt%h(lane) = h
        control%h(lane) = retreat * attempt%h(lane)
      end do
      call begin_attempt(attempt)
      attempt%scratch(:) = attempt%t + attempt%h
      do component = 1, attempt%components
        attempt%y_new(:, component) = attempt%y(:, component) + attempt%h * attempt%slope(:, component)
      end do
      call evaluate_finite(attempt, system, attempt%scratch, attempt%y_new, attempt%error_estimate)
      call count_evaluations(attempt)
      attempt%error_estimate(:, :) = attempt%error_estimate - attempt%slope
      call weigh(control, system, attempt, attempt%error_estimate)
      do lane = 1, attempt%lanes
        if (.not. attempt%active(lane)) cycle
        steepest = max(slope(lane), curvature(lane) / attempt%h(lane))
        if (steepest <= no_curvature) then
          longer = max(small_step, attempt%h(lane) * 1.0e-3_wp)
        else
          longer = (small_change / steepest)**(1.0_wp / order)
        end if
        control%h(lane) = min(max_growth * attempt%h(lane), longer)
      end do
    end associate
  end subroutine guess_first_steps

  !> The number of measured quantities without the phases: the speed of a rotation is no error and sets no time scale.
  pure integer function counted(system)
    class(system_t), intent(in) :: system

    counted = system%measures - system%phases
  end function counted

  !> Sets `log_ratio` of the active lanes to the root mean square of x / (atol + rtol |y|) over the states, or over the quantities
  !> that the system measures, without the phases.
  subroutine weigh(control, system, attempt, x)
    type(step_control_t), intent(inout) :: control
    class(system_t), intent(in) :: system
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: x(:, :)   !! [lanes, padded columns]
    integer :: lane

    if (system%measures > 0) call system%measure(size(x, 2), attempt%y, x, control%new_size, control%error)
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      if (system%measures > 0) then
        control%log_ratio(lane) = rms_ratio(control, control%error(lane, :counted(system)), control%size(lane, :counted(system)))
      else
        control%log_ratio(lane) = rms_ratio(control, x(lane, :attempt%states), attempt%y(lane, :attempt%states))
      end if
    end do
  end subroutine weigh

  !> Root mean square of x / (atol + rtol |y|).
  pure real(wp) function rms_ratio(control, x, y) result(rms)
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: x(:), y(:)
    integer :: i

    rms = 0.0_wp
    do i = 1, size(x)
      rms = rms + min(abs(x(i)) / (control%atol + control%rtol * abs(y(i))), largest_ratio)**2
    end do
    rms = sqrt(rms / max(size(x), 1))
  end function rms_ratio

end module nocdyn_first_step
