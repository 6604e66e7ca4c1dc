!> What the march asks of every one-step method.
module nocdyn_stepper
  use nocdyn_kinds, only: wp
  use nocdyn_step_control, only: step_control_t
  use nocdyn_system, only: observer_t, steps_t, system_t
  use nocdyn_trial, only: trial_t
  implicit none (type, external)
  private

  type, abstract, public :: stepper_t
    integer :: order = 0         !! of y_new
    integer :: error_order = 0   !! the error estimate falls as h^(error_order + 1)
    real(wp) :: most_growth = 6.0_wp   !! of the step size from one step to the next
    integer :: degree = 0        !! of the polynomials inside a step
    logical :: has_coarse_error = .false.   !! whether there are two error estimates
    logical :: needs_series = .false.       !! whether the system must have a Taylor series
    logical :: plans_steps = .false.        !! whether `plan` chooses the sizes of the steps, which then have no error estimate
    logical :: shows_own = .false.          !! whether `show` does without the coefficients of `interpolate`
  contains
    procedure :: plan
    procedure(prepare_interface), deferred :: prepare
    procedure(begin_interface), deferred :: begin
    procedure(attempt_interface), deferred :: attempt
    procedure(interpolate_interface), deferred :: interpolate
    procedure(accept_interface), deferred :: accept
    procedure :: resume
    procedure :: show
  end type stepper_t

  abstract interface

    !> Allocates all memory that the steps will need.
    subroutine prepare_interface(self, system)
      import :: stepper_t, system_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(in) :: system
    end subroutine prepare_interface

    !> Takes over trial%slope = f(t, y) of lanes that start.
    subroutine begin_interface(self, trial, starting)
      import :: stepper_t, trial_t
      class(stepper_t), intent(inout) :: self
      type(trial_t), intent(inout) :: trial
      logical, intent(in) :: starting(:)
    end subroutine begin_interface

    !> One step of size h from (t, y): y_new and the deviations, or a verdict on the lanes that failed.
    subroutine attempt_interface(self, system, trial)
      import :: stepper_t, system_t, trial_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      type(trial_t), intent(inout) :: trial
    end subroutine attempt_interface

    !> The solution inside the last step, y + sum over p of coefficients(:, :, p) theta^p with theta = (time - t) / h,
    !> of the lanes in `wanted`, or a verdict on those where it could not be had.
    subroutine interpolate_interface(self, system, trial, wanted, coefficients)
      import :: stepper_t, system_t, trial_t, wp
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      type(trial_t), intent(inout) :: trial
      logical, intent(in) :: wanted(:)
      real(wp), contiguous, intent(inout) :: coefficients(:, :, :)   !! shape [lanes, padded columns, degree]
    end subroutine interpolate_interface

    !> The next attempt of these lanes starts where this one ended; the other lanes start again where they did.
    subroutine accept_interface(self, accepted)
      import :: stepper_t
      class(stepper_t), intent(inout) :: self
      logical, intent(in) :: accepted(:)
    end subroutine accept_interface

  end interface

contains

  !> Sets control%h of the lanes that are working and have moved since the last call.
  subroutine plan(self, system, trial, control)
    class(stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    type(step_control_t), intent(inout) :: control

    error stop 'nocdyn_stepper: a stepper that plans its steps overrides plan'
  end subroutine plan

  !> Takes over trial%slope = f(t, y) of lanes whose equations have changed where they are, after `accept`.
  subroutine resume(self, trial, resuming)
    class(stepper_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: resuming(:)

    call self%begin(trial, resuming)
  end subroutine resume

  !> Shows an observer the last steps of all lanes.
  subroutine show(self, steps, trial, coefficients, observer)
    class(stepper_t), intent(in) :: self
    type(steps_t), intent(inout) :: steps
    type(trial_t), intent(in) :: trial
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)   !! of `interpolate`, unless `shows_own`
    class(observer_t), intent(inout) :: observer

    steps%scale(:) = 1.0_wp
    call observer%follow_steps(steps, trial%y, trial%y_new, coefficients)
  end subroutine show

end module nocdyn_stepper
