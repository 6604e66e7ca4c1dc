!> Explicit Runge-Kutta steps, of any tableau.
module nocdyn_explicit_stepper
  use nocdyn_explicit_tables, only: explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_stage_sums, only: stage_sum
  use nocdyn_stages, only: allocate_stages, estimate_error, form_dense_output, set_tableau, share_storage, stage_state, &
    stages_t, update_state
  use nocdyn_step_attempt, only: count_evaluations, evaluate, evaluate_finite, evaluate_start, step_attempt_t
  use nocdyn_step_costs, only: explicit_cost
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: explicit_stepper

  type, extends(stepper_t), public :: explicit_stepper_t
    private
    type(stages_t) :: stages
    logical :: first_same_as_last
    real(wp), allocatable :: c(:)                !! nodes of the tableau: theta of the stages
    real(wp), allocatable :: t_stage(:)
    real(wp), allocatable :: y_stage(:, :)       !! state of a stage, [lanes, padded columns]
    logical, allocatable :: moved(:)             !! lanes whose first stage must be evaluated
  contains
    procedure :: prepare, start, take_step, interpolate, accept, invalidate_first_stage, stiffness, cost
  end type explicit_stepper_t

contains

  !> The stepper of a tableau.
  pure function explicit_stepper(table) result(stepper)
    type(explicit_table_t), intent(in) :: table
    type(explicit_stepper_t) :: stepper

    stepper%order = table%order
    stepper%error_order = table%error_order
    stepper%max_growth = table%max_growth
    stepper%degree = size(table%dense, 2)
    stepper%degrees(1) = stepper%degree
    stepper%first_same_as_last = table%first_same_as_last
    allocate (stepper%c, source=table%c)
    call set_tableau(stepper%stages, table%a, table%b, table%error, table%dense)
    stepper%has_low_order_error = allocated(table%low_order_error)
    if (stepper%has_low_order_error) stepper%stages%low_order_error = stage_sum(table%low_order_error)
    call share_storage(stepper%stages)
  end function explicit_stepper

  subroutine prepare(self, system)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system

    call allocate_stages(self%stages, system)
    if (allocated(self%moved)) deallocate (self%moved, self%t_stage, self%y_stage)
    allocate (self%moved(system%lanes), source=.false.)
    allocate (self%t_stage(system%lanes), source=0.0_wp)
    allocate (self%y_stage, source=self%stages%k(:, :, 1))
  end subroutine prepare

  subroutine start(self, attempt, starting)
    class(explicit_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: starting(:)
    integer :: lane

    do lane = 1, size(starting)
      if (.not. starting(lane)) cycle
      self%stages%k(lane, :, 1) = attempt%slope(lane, :)
      self%moved(lane) = .false.
    end do
  end subroutine start

  subroutine take_step(self, system, attempt)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: last, stage

    if (any_true(attempt%lanes, self%moved)) then
      if (any(self%moved .and. attempt%active)) then
        call evaluate_start(attempt, system, self%moved, self%stages%k)
        self%moved(:) = self%moved .and. .not. attempt%active
      end if
    end if
    last = merge(self%stages%step - 1, self%stages%step, self%first_same_as_last)
    do stage = 2, last
      if (.not. any(attempt%active)) exit
      call stage_state(self%stages, attempt, stage, self%y_stage)
      self%t_stage(:) = attempt%t + self%c(stage) * attempt%h
      call evaluate(attempt, system, self%t_stage, self%y_stage, self%stages%k(1, 1, self%stages%k_index(stage)))
    end do
    call update_state(self%stages, attempt)
    if (self%first_same_as_last) then
      self%t_stage(:) = attempt%t + attempt%h
      call evaluate_finite(attempt, system, self%t_stage, attempt%y_new, self%stages%k(1, 1, &
                                                                                       self%stages%k_index(self%stages%step)))
    end if
    call estimate_error(self%stages, attempt)
    call count_evaluations(attempt)
  end subroutine take_step

  !> Evaluates the stages that only the dense output needs, then its polynomials.
  subroutine interpolate(self, system, attempt, wanted, coefficients)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)
    integer :: lane, stage

    if (self%stages%all > self%stages%step) then
      attempt%active(:) = wanted
      do stage = self%stages%step + 1, self%stages%all
        call stage_state(self%stages, attempt, stage, self%y_stage)
        do lane = 1, attempt%lanes   ! steps of other kinds, or refused, have stages of no meaning, perhaps huge
          if (.not. wanted(lane)) self%y_stage(lane, :) = attempt%y(lane, :)
        end do
        self%t_stage(:) = attempt%t + self%c(stage) * attempt%h
        call evaluate_finite(attempt, system, self%t_stage, self%y_stage, self%stages%k(1, 1, self%stages%k_index(stage)))
      end do
      call count_evaluations(attempt)
    end if
    call form_dense_output(self%stages, attempt, coefficients)
  end subroutine interpolate

  subroutine accept(self, accepted)
    class(explicit_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)
    integer :: lane, component

    if (.not. self%first_same_as_last) then
      self%moved(:) = self%moved .or. accepted
      return
    end if
    associate (k => self%stages%k, last => self%stages%k_index(self%stages%step))
      if (all_true(size(accepted), accepted)) then
        k(:, :, 1) = k(:, :, last)
      else
        do component = 1, size(k, 2)
          do lane = 1, size(accepted)
            if (accepted(lane)) k(lane, component, 1) = k(lane, component, last)
          end do
        end do
      end if
    end associate
  end subroutine accept

  !> Has the first stage evaluated again for lanes that another method has moved.
  pure subroutine invalidate_first_stage(self, moved)
    class(explicit_stepper_t), intent(inout) :: self
    logical, intent(in) :: moved(:)

    self%moved(:) = self%moved .or. moved
  end subroutine invalidate_first_stage

  !> |h lambda| of the dominant eigenvalue of the Jacobian, estimated from the last two stages at t + h: Hairer, Wanner, Solving
  !> Ordinary Differential Equations II, (IV.2.6), for methods whose last stage is f(t + h, y_new).
  pure function stiffness(self, attempt, lane) result(ratio)
    class(explicit_stepper_t), intent(in) :: self
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: lane
    real(wp) :: ratio
    real(wp), parameter :: largest = 1.0e100_wp   ! keeps squares finite
    real(wp) :: slopes, states
    integer :: i

    slopes = 0.0_wp
    states = 0.0_wp
    associate (k => self%stages%k, last => self%stages%k_index(self%stages%step), &
               before => self%stages%k_index(self%stages%step - 1))
      do i = 1, attempt%states
        slopes = slopes + min(abs(k(lane, i, last) - k(lane, i, before)), largest)**2
        states = states + min(abs(attempt%y_new(lane, i) - self%y_stage(lane, i)), largest)**2
      end do
    end associate
    ratio = 0.0_wp
    if (states > 0) ratio = attempt%h(lane) * sqrt(slopes / states)
  end function stiffness

  !> The cost of a step.
  real(wp) function cost(self, system)
    class(explicit_stepper_t), intent(in) :: self
    class(system_t), intent(in) :: system

    cost = explicit_cost(system, merge(self%stages%all - 1, self%stages%all, self%first_same_as_last), self%degree)
  end function cost

end module nocdyn_explicit_stepper
