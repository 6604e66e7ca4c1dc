!> Steps of any explicit Runge-Kutta method.
module nocdyn_explicit_stepper
  use nocdyn_combinations, only: combination
  use nocdyn_explicit_tables, only: explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_true
  use nocdyn_stages, only: allocate_stages, estimate_error, expand, inner_state, set_weights, share_places, stages_t, &
    update_state
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_trial, only: count_evaluations, evaluate, evaluate_finite, evaluate_start, trial_t
  implicit none (type, external)
  private

  public :: explicit_stepper

  type, extends(stepper_t), public :: explicit_stepper_t
    private
    type(stages_t) :: stages
    logical :: first_same_as_last
    real(wp), allocatable :: c(:)                !! places of the stages in the step
    real(wp), allocatable :: t_stage(:)
    real(wp), allocatable :: y_stage(:, :)       !! in the columns of a stage
    logical, allocatable :: moved(:)             !! lanes whose first stage is not known yet
  contains
    procedure :: prepare
    procedure :: begin
    procedure :: attempt
    procedure :: interpolate
    procedure :: accept
    procedure :: renew
    procedure :: stiffness
  end type explicit_stepper_t

contains

  !> The stepper of a table.
  pure function explicit_stepper(table) result(stepper)
    type(explicit_table_t), intent(in) :: table
    type(explicit_stepper_t) :: stepper

    stepper%order = table%order
    stepper%error_order = table%error_order
    stepper%most_growth = table%most_growth
    stepper%degree = size(table%dense, 2)
    stepper%first_same_as_last = table%first_same_as_last
    allocate (stepper%c, source=table%c)
    call set_weights(stepper%stages, table%a, table%b, table%error, table%dense)
    stepper%has_coarse_error = allocated(table%coarse_error)
    if (stepper%has_coarse_error) stepper%stages%coarse_error = combination(table%coarse_error)
    call share_places(stepper%stages)
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

  subroutine begin(self, trial, starting)
    class(explicit_stepper_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: starting(:)
    integer :: lane

    do lane = 1, size(starting)
      if (.not. starting(lane)) cycle
      self%stages%k(lane, :, 1) = trial%slope(lane, :)
      self%moved(lane) = .false.
    end do
  end subroutine begin

  subroutine attempt(self, system, trial)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    integer :: last, stage

    if (any_true(trial%lanes, self%moved)) then
      if (any(self%moved .and. trial%working)) call renew_first_stage(self, system, trial)
    end if
    last = merge(self%stages%step - 1, self%stages%step, self%first_same_as_last)
    do stage = 2, last
      if (.not. any(trial%working)) exit
      call inner_state(self%stages, trial, stage, self%y_stage)
      call place_stage(trial%lanes, trial%t, trial%h, self%c(stage), self%t_stage)
      call evaluate(trial, system, self%t_stage, self%y_stage, self%stages%k(1, 1, self%stages%place(stage)))
    end do
    call update_state(self%stages, trial)
    if (self%first_same_as_last) then
      call place_stage(trial%lanes, trial%t, trial%h, 1.0_wp, self%t_stage)
      call evaluate_finite(trial, system, self%t_stage, trial%y_new, self%stages%k(1, 1, self%stages%place(self%stages%step)))
    end if
    call estimate_error(self%stages, trial)
    call count_evaluations(trial)
  end subroutine attempt

  !> Times of a stage.
  pure subroutine place_stage(lanes, t, h, c, t_stage)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: t(lanes), h(lanes), c
    real(wp), intent(inout) :: t_stage(lanes)

    if (lanes == 1) then
      t_stage(1) = t(1) + c * h(1)
    else
      t_stage = t + c * h
    end if
  end subroutine place_stage

  subroutine renew_first_stage(self, system, trial)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial

    call evaluate_start(trial, system, self%moved, self%stages%k)
    self%moved(:) = self%moved .and. .not. trial%working
  end subroutine renew_first_stage

  !> Evaluates the stages that only the solution inside the step needs, then the polynomials.
  subroutine interpolate(self, system, trial, wanted, coefficients)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)
    integer :: stage

    if (self%stages%all > self%stages%step) then
      trial%working(:) = wanted
      do stage = self%stages%step + 1, self%stages%all
        call inner_state(self%stages, trial, stage, self%y_stage)
        call place_stage(trial%lanes, trial%t, trial%h, self%c(stage), self%t_stage)
        call evaluate_finite(trial, system, self%t_stage, self%y_stage, &
                             self%stages%k(1, 1, self%stages%place(stage)))
      end do
      call count_evaluations(trial)
    end if
    call expand(self%stages, trial, coefficients)
  end subroutine interpolate

  subroutine accept(self, accepted)
    class(explicit_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)
    integer :: lane, component

    if (.not. self%first_same_as_last) then
      self%moved(:) = self%moved .or. accepted
      return
    end if
    associate (k => self%stages%k, last => self%stages%place(self%stages%step))
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

  !> Forgets the first stage of lanes that another method has moved.
  pure subroutine renew(self, moved)
    class(explicit_stepper_t), intent(inout) :: self
    logical, intent(in) :: moved(:)

    self%moved(:) = self%moved .or. moved
  end subroutine renew

  !> |h lambda| of the dominant eigenvalue, from the last two stages at t + h: Hairer, Wanner, Solving Ordinary
  !> Differential Equations II, (IV.2.6), for methods whose last stage is f(t + h, y_new).
  pure function stiffness(self, trial, lane) result(ratio)
    class(explicit_stepper_t), intent(in) :: self
    type(trial_t), intent(in) :: trial
    integer, intent(in) :: lane
    real(wp) :: ratio
    real(wp), parameter :: largest = 1.0e100_wp   ! keeps squares finite
    real(wp) :: slopes, states
    integer :: i

    slopes = 0.0_wp
    states = 0.0_wp
    associate (k => self%stages%k, last => self%stages%place(self%stages%step), &
               before => self%stages%place(self%stages%step - 1))
      do i = 1, trial%states
        slopes = slopes + min(abs(k(lane, i, last) - k(lane, i, before)), largest)**2
        states = states + min(abs(trial%y_new(lane, i) - self%y_stage(lane, i)), largest)**2
      end do
    end associate
    ratio = 0.0_wp
    if (states > 0) ratio = trial%h(lane) * sqrt(slopes / states)
  end function stiffness

end module nocdyn_explicit_stepper
