!> Rosenbrock steps with the exact Jacobian, of any tableau.
module nocdyn_rosenbrock_stepper
  use nocdyn_kinds, only: wp
  use nocdyn_rosenbrock_tables, only: rosenbrock_table_t
  use nocdyn_spectral_radius, only: allocate_spectral_radius, estimate_spectral_radius, restart_power_iteration, spectral_radius_t
  use nocdyn_stage_sums, only: set_offsets, stage_sum, stage_sum_t, sum_stages
  use nocdyn_stage_systems, only: allocate_stage_system, factor, renew_jacobian, solve, stage_system_t
  use nocdyn_stages, only: allocate_stages, estimate_error, form_dense_output, set_tableau, stage_state, stages_t, update_state
  use nocdyn_step_attempt, only: count_evaluations, evaluate_finite, evaluate_start, step_attempt_t
  use nocdyn_step_costs, only: implicit_cost
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: rosenbrock_stepper

  type, extends(stepper_t), public :: rosenbrock_stepper_t
    private
    type(stages_t) :: stages
    real(wp) :: gamma
    real(wp), allocatable :: alpha(:)                 !! theta of the stages
    real(wp), allocatable :: gamma_sum(:)             !! factors of h df/dt
    type(stage_sum_t), allocatable :: coupling(:)     !! rows of c_ij
    type(stage_system_t) :: stage_system
    type(spectral_radius_t) :: spectrum
    real(wp), allocatable :: t_stage(:), y_stage(:, :), f(:, :)
    real(wp), allocatable :: r(:, :)                  !! right-hand side of the stage's linear system
    real(wp), allocatable :: one(:)                   !! ones, as long as a stage or a large tile
    real(wp), allocatable :: slope(:, :)              !! f(t, y) at the start of the step
    logical, allocatable :: no_slope(:)               !! lanes whose slope must be evaluated
    logical, allocatable :: no_jacobian(:)            !! lanes whose Jacobian must be evaluated
  contains
    procedure :: prepare, start, take_step, interpolate, accept, stiffness, reset_spectra, cost
  end type rosenbrock_stepper_t

contains

  !> The stepper of a tableau.
  pure function rosenbrock_stepper(table) result(stepper)
    type(rosenbrock_table_t), intent(in) :: table
    type(rosenbrock_stepper_t) :: stepper
    integer :: i

    stepper%order = table%order
    stepper%error_order = table%error_order
    stepper%degree = size(table%dense, 2)
    stepper%degrees(1) = stepper%degree
    stepper%gamma = table%gamma
    allocate (stepper%alpha, source=table%alpha)
    allocate (stepper%gamma_sum, source=table%gamma_sum)
    allocate (stepper%coupling(size(table%m)))
    do i = 1, size(table%m)
      stepper%coupling(i) = stage_sum(table%c(i, :))
    end do
    call set_tableau(stepper%stages, table%a, table%m, table%error, table%dense)
  end function rosenbrock_stepper

  subroutine prepare(self, system)
    class(rosenbrock_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system

    call allocate_stages(self%stages, system)
    call set_offsets(self%coupling, system%lanes * size(self%stages%k, 2), self%stages%all)
    call allocate_stage_system(self%stage_system, system)
    call allocate_spectral_radius(self%spectrum, system)
    if (allocated(self%slope)) deallocate (self%t_stage, self%y_stage, self%f, self%r, self%one, self%slope, &
                                           self%no_slope, self%no_jacobian)
    associate (lanes => system%lanes)
      allocate (self%t_stage(lanes), source=0.0_wp)
      allocate (self%y_stage, self%f, self%r, self%slope, source=self%stages%k(:, :, 1))
      allocate (self%one, source=self%stages%zero + 1)
      allocate (self%no_slope(lanes), self%no_jacobian(lanes), source=.true.)
    end associate
  end subroutine prepare

  subroutine start(self, attempt, starting)
    class(rosenbrock_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: starting(:)
    integer :: lane

    do lane = 1, size(starting)
      attempt%implicit(lane) = attempt%implicit(lane) .or. starting(lane)
      if (.not. starting(lane)) cycle
      self%slope(lane, :) = attempt%slope(lane, :)
      self%no_slope(lane) = .false.
      self%no_jacobian(lane) = .true.
    end do
  end subroutine start

  subroutine take_step(self, system, attempt)
    class(rosenbrock_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: lane, stage

    ! evaluates f and its derivatives at the start of the step; after a rejected step they are kept
    if (any(self%no_slope .and. attempt%active)) then
      call evaluate_start(attempt, system, self%no_slope, self%slope)
      self%no_slope(:) = self%no_slope .and. .not. attempt%active
    end if
    if (any(self%no_jacobian .and. attempt%active)) then
      do lane = 1, attempt%lanes
        if (self%no_jacobian(lane) .and. attempt%active(lane)) attempt%jacobians(lane) = attempt%jacobians(lane) + 1
      end do
      call renew_jacobian(self%stage_system, system, attempt)
      self%no_jacobian(:) = self%no_jacobian .and. .not. attempt%active
    end if
    call factor(self%stage_system, attempt, self%gamma)
    call solve_stage(self, attempt, 1, self%slope)
    do stage = 2, self%stages%step
      if (.not. any(attempt%active)) exit
      call stage_state(self%stages, attempt, stage, self%y_stage)
      self%t_stage(:) = attempt%t + self%alpha(stage) * attempt%h
      call evaluate_finite(attempt, system, self%t_stage, self%y_stage, self%f)
      call solve_stage(self, attempt, stage, self%f)
    end do
    call update_state(self%stages, attempt)
    call estimate_error(self%stages, attempt)
    call count_evaluations(attempt)
  end subroutine take_step

  !> Solves (1/gamma - h J) k_i = f_i + sum c_ij k_j + gamma_i h df/dt.
  subroutine solve_stage(self, attempt, stage, f)
    class(rosenbrock_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: stage
    real(wp), intent(in) :: f(attempt%length)
    logical :: all_finite
    integer :: component

    call sum_stages(self%coupling(stage), self%stages%k, attempt%length, f, size(self%one), self%one, self%r, all_finite)
    if (abs(self%gamma_sum(stage)) > 0) then
      ! r = r + gamma_sum h df/dt
      do component = 1, attempt%components
        self%r(:, component) = self%r(:, component) + attempt%h * (self%gamma_sum(stage) * self%stage_system%dfdt(:, component))
      end do
    end if
    call solve(self%stage_system, attempt, self%gamma, self%r, self%stages%k(:, :, stage))
  end subroutine solve_stage

  subroutine interpolate(self, system, attempt, wanted, coefficients)
    class(rosenbrock_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)

    call form_dense_output(self%stages, attempt, coefficients)
  end subroutine interpolate

  !> Lanes whose step has been accepted need new derivatives.
  subroutine accept(self, accepted)
    class(rosenbrock_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)

    self%no_slope(:) = self%no_slope .or. accepted
    self%no_jacobian(:) = self%no_jacobian .or. accepted
  end subroutine accept

  !> Restarts the eigenvalue estimates of lanes that start or change to this method.
  pure subroutine reset_spectra(self, starting)
    class(rosenbrock_stepper_t), intent(inout) :: self
    logical, intent(in) :: starting(:)
    integer :: lane

    do lane = 1, size(starting)
      if (starting(lane)) call restart_power_iteration(self%spectrum, lane)
    end do
  end subroutine reset_spectra

  !> |h lambda| of the dominant eigenvalue of the Jacobian at the start of the step, by power iteration.
  function stiffness(self, attempt, lane) result(ratio)
    class(rosenbrock_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: lane
    real(wp) :: ratio

    call estimate_spectral_radius(self%spectrum, lane, self%stage_system%dfdy, ratio)
    ratio = attempt%h(lane) * ratio
  end function stiffness

  !> The cost of a step, after `prepare`.
  real(wp) function cost(self, system)
    class(rosenbrock_stepper_t), intent(in) :: self
    class(system_t), intent(in) :: system

    cost = 0.0_wp
    if (system%states > 0) cost = self%stage_system%matrix%operations()
    cost = implicit_cost(system, self%stages%step, cost, self%degree)
  end function cost

end module nocdyn_rosenbrock_stepper
