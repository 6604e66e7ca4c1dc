!> Steps of any explicit Runge-Kutta method.
module nocdyn_explicit_stepper
  use nocdyn_combinations, only: combine
  use nocdyn_explicit_tables, only: explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_stepper, only: allocate_stages, estimate_error, set_weights, stepper_t, update_state
  use nocdyn_system, only: system_t
  use nocdyn_trial, only: evaluate, evaluate_start, trial_t
  implicit none (type, external)
  private

  public :: explicit_stepper

  type, extends(stepper_t), public :: explicit_stepper_t
    private
    logical :: first_same_as_last
    real(wp), allocatable :: c(:)                !! places of the stages in the step
    real(wp), allocatable :: t_stage(:)
    real(wp), allocatable :: y_stage(:, :)
    logical, allocatable :: moved(:)             !! lanes whose first stage is not known yet
  contains
    procedure :: prepare
    procedure :: begin
    procedure :: attempt
    procedure :: accept
  end type explicit_stepper_t

contains

  !> The stepper of a table.
  pure function explicit_stepper(table) result(stepper)
    type(explicit_table_t), intent(in) :: table
    type(explicit_stepper_t) :: stepper

    stepper%order = table%order
    stepper%error_order = table%error_order
    stepper%first_same_as_last = table%first_same_as_last
    allocate (stepper%c, source=table%c)
    call set_weights(stepper, table%a, table%b, table%error, table%dense)
  end function explicit_stepper

  subroutine prepare(self, system)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system

    call allocate_stages(self, system)
    if (allocated(self%moved)) deallocate (self%moved, self%t_stage, self%y_stage)
    allocate (self%moved(system%lanes), source=.false.)
    allocate (self%t_stage(system%lanes), self%y_stage(system%lanes, system%states + system%quadratures), source=0.0_wp)
  end subroutine prepare

  subroutine begin(self, trial)
    class(explicit_stepper_t), intent(inout) :: self
    type(trial_t), intent(in) :: trial

    self%k(:, :, 1) = trial%slope
    self%moved(:) = .false.
  end subroutine begin

  subroutine attempt(self, system, trial)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    integer :: stage, last

    if (any(self%moved)) call renew_first_stage(self, system, trial)
    last = merge(self%stages - 1, self%stages, self%first_same_as_last)
    do stage = 2, last
      if (.not. any(trial%working)) return
      call combine(size(trial%y), self%stages, self%inner(stage), self%k, trial%y, trial%h_spread, self%y_stage)
      self%t_stage(:) = trial%t + self%c(stage) * trial%h
      call evaluate(trial, system, self%t_stage, self%y_stage, self%k(:, :, stage))
    end do
    call update_state(self, trial)
    if (self%first_same_as_last) then
      self%t_stage(:) = trial%t + trial%h
      call evaluate(trial, system, self%t_stage, trial%y_new, self%k(:, :, self%stages))
    end if
    call estimate_error(self, trial)
  end subroutine attempt

  subroutine renew_first_stage(self, system, trial)
    class(explicit_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial

    call evaluate_start(trial, system, self%moved, self%k(:, :, 1))
    self%moved(:) = self%moved .and. .not. trial%working
  end subroutine renew_first_stage

  subroutine accept(self, accepted)
    class(explicit_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)
    integer :: lane, component

    if (.not. self%first_same_as_last) then
      self%moved(:) = self%moved .or. accepted
    else if (all(accepted)) then
      self%k(:, :, 1) = self%k(:, :, self%stages)
    else
      do component = 1, size(self%k, 2)
        do lane = 1, size(accepted)
          if (accepted(lane)) self%k(lane, component, 1) = self%k(lane, component, self%stages)
        end do
      end do
    end if
  end subroutine accept

end module nocdyn_explicit_stepper
