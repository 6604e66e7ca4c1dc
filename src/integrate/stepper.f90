!> What every one-step method has: stages, weights of the result, of its error and of the solution inside the step.
module nocdyn_stepper
  use nocdyn_combinations, only: combination, combination_t, combine
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  use nocdyn_trial, only: check_deviation, check_state, trial_t
  implicit none (type, external)
  private

  public :: set_weights, allocate_stages, update_state, estimate_error

  type, abstract, public :: stepper_t
    integer :: order                                   !! of y_new
    integer :: error_order                             !! of the embedded solution
    integer :: stages
    type(combination_t), allocatable :: inner(:)       !! states that the stages are taken at, row by row
    type(combination_t) :: update                      !! weights of y_new
    type(combination_t) :: error                       !! weights of the deviation
    type(combination_t), allocatable :: dense(:)       !! weights of each power of theta = (time - t) / h
    real(wp), allocatable :: k(:, :, :)                !! the stages, shape [lanes, components, stages]
    real(wp), allocatable :: zero(:, :)                !! zeros, shape [lanes, components]
  contains
    procedure(prepare_interface), deferred :: prepare
    procedure(begin_interface), deferred :: begin
    procedure(attempt_interface), deferred :: attempt
    procedure(accept_interface), deferred :: accept
    procedure, non_overridable :: interpolate
  end type stepper_t

  abstract interface

    !> Allocates all memory that the steps will need.
    subroutine prepare_interface(self, system)
      import :: stepper_t, system_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(in) :: system
    end subroutine prepare_interface

    !> Takes over trial%slope = f(t, y) before the first step.
    subroutine begin_interface(self, trial)
      import :: stepper_t, trial_t
      class(stepper_t), intent(inout) :: self
      type(trial_t), intent(in) :: trial
    end subroutine begin_interface

    !> One step of size h from (t, y): y_new and the deviation, or a verdict on the lanes that failed.
    subroutine attempt_interface(self, system, trial)
      import :: stepper_t, system_t, trial_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      type(trial_t), intent(inout) :: trial
    end subroutine attempt_interface

    !> The next attempt of these lanes starts where this one ended; the other lanes start again where they did.
    subroutine accept_interface(self, accepted)
      import :: stepper_t
      class(stepper_t), intent(inout) :: self
      logical, intent(in) :: accepted(:)
    end subroutine accept_interface

  end interface

contains

  !> Takes over the rows of a table, without their zeros.
  pure subroutine set_weights(stepper, inner, update, error, dense)
    class(stepper_t), intent(inout) :: stepper
    real(wp), intent(in) :: inner(:, :)   !! shape [stages, stages]
    real(wp), intent(in) :: update(:)     !! shape [stages]
    real(wp), intent(in) :: error(:)      !! shape [stages]
    real(wp), intent(in) :: dense(:, :)   !! shape [stages, degree]
    integer :: i

    stepper%stages = size(update)
    allocate (stepper%inner(size(update)), stepper%dense(size(dense, 2)))
    do i = 1, size(update)
      stepper%inner(i) = combination(inner(i, :))
    end do
    stepper%update = combination(update)
    stepper%error = combination(error)
    do i = 1, size(dense, 2)
      stepper%dense(i) = combination(dense(:, i))
    end do
  end subroutine set_weights

  !> Room for the stages of every lane.
  subroutine allocate_stages(stepper, system)
    class(stepper_t), intent(inout) :: stepper
    class(system_t), intent(in) :: system

    if (allocated(stepper%k)) deallocate (stepper%k, stepper%zero)
    associate (lanes => system%lanes, components => system%states + system%quadratures)
      allocate (stepper%k(lanes, components, stepper%stages), stepper%zero(lanes, components), source=0.0_wp)
    end associate
  end subroutine allocate_stages

  !> y_new, once its stages are known; a lane where it overflows is parked.
  subroutine update_state(stepper, trial)
    class(stepper_t), intent(in) :: stepper
    type(trial_t), intent(inout) :: trial

    call combine(size(trial%y), stepper%stages, stepper%update, stepper%k, trial%y, trial%h_spread, trial%y_new)
    call check_state(trial)
  end subroutine update_state

  !> The deviation of y_new from the embedded solution, once all stages are known.
  subroutine estimate_error(stepper, trial)
    class(stepper_t), intent(in) :: stepper
    type(trial_t), intent(inout) :: trial

    call combine(size(trial%y), stepper%stages, stepper%error, stepper%k, stepper%zero, trial%h_spread, trial%deviation)
    call check_deviation(trial)
  end subroutine estimate_error

  !> The solution inside the last step: y + sum over p of coefficients(:, :, p) theta^p.
  subroutine interpolate(self, trial, coefficients)
    class(stepper_t), intent(in) :: self
    type(trial_t), intent(in) :: trial
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)   !! shape [lanes, components, degree]
    integer :: power

    do power = 1, size(self%dense)
      call combine(size(trial%y), self%stages, self%dense(power), self%k, self%zero, trial%h_spread, &
                   coefficients(:, :, power))
    end do
  end subroutine interpolate

end module nocdyn_stepper
