!> What the march asks of every one-step method.
module nocdyn_stepper
  use nocdyn_kinds, only: wp
  use nocdyn_step_control, only: step_control_t
  use nocdyn_observer, only: observer_t, step_block_t
  use nocdyn_system, only: system_t
  use nocdyn_step_attempt, only: step_attempt_t
  implicit none (type, external)
  private

  type, abstract, public :: stepper_t
    integer :: order = 0         !! of y_new
    integer :: error_order = 0   !! the error estimate falls as h^(error_order + 1)
    real(wp) :: max_growth = 6.0_wp   !! of the step size from one step to the next
    integer :: degree = 0        !! of the polynomials inside a step
    logical :: has_low_order_error = .false.   !! whether there are two error estimates
    logical :: needs_series = .false.       !! whether the system must have a Taylor series
    logical :: chooses_steps = .false.        !! whether `choose_steps` chooses the sizes of the steps, which then have no error
                                              !! estimate
    logical :: passes_series = .false.          !! whether `pass_steps` does without the coefficients of `interpolate`
  contains
    procedure :: choose_steps
    procedure(prepare_interface), deferred :: prepare
    procedure(start_interface), deferred :: start
    procedure(take_step_interface), deferred :: take_step
    procedure(interpolate_interface), deferred :: interpolate
    procedure(accept_interface), deferred :: accept
    procedure :: resume
    procedure :: pass_steps
  end type stepper_t

  abstract interface

    !> Allocates all memory that the steps will need.
    subroutine prepare_interface(self, system)
      import :: stepper_t, system_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(in) :: system
    end subroutine prepare_interface

    !> Takes over trial%slope = f(t, y) of lanes that start.
    subroutine start_interface(self, attempt, starting)
      import :: stepper_t, step_attempt_t
      class(stepper_t), intent(inout) :: self
      type(step_attempt_t), intent(inout) :: attempt
      logical, intent(in) :: starting(:)
    end subroutine start_interface

    !> One step of size h from (t, y): y_new and the deviations, or a verdict on the lanes that failed.
    subroutine take_step_interface(self, system, attempt)
      import :: stepper_t, system_t, step_attempt_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      type(step_attempt_t), intent(inout) :: attempt
    end subroutine take_step_interface

    !> The solution inside the last step, y + sum over p of coefficients(:, :, p) theta^p with theta = (time - t) / h,
    !> of the lanes in `wanted`, or a verdict on those where it could not be had.
    subroutine interpolate_interface(self, system, attempt, wanted, coefficients)
      import :: stepper_t, system_t, step_attempt_t, wp
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      type(step_attempt_t), intent(inout) :: attempt
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
  subroutine choose_steps(self, system, attempt, control)
    class(stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control

    error stop 'nocdyn_stepper: a stepper that plans its steps overrides plan'
  end subroutine choose_steps

  !> Takes over trial%slope = f(t, y) of lanes whose equations have changed where they are, after `accept`.
  subroutine resume(self, attempt, resuming)
    class(stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: resuming(:)

    call self%start(attempt, resuming)
  end subroutine resume

  !> Shows an observer the last steps of all lanes.
  subroutine pass_steps(self, steps, attempt, coefficients, observer)
    class(stepper_t), intent(in) :: self
    type(step_block_t), intent(inout) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)   !! of `interpolate`, unless `passes_series`
    class(observer_t), intent(inout) :: observer

    steps%scale(:) = 1.0_wp
    call observer%on_steps(steps, attempt%y, attempt%y_new, coefficients)
  end subroutine pass_steps

end module nocdyn_stepper
