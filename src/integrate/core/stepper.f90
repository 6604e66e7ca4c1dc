!> The interface of a one-step method.
module nocdyn_stepper
  use nocdyn_kinds, only: wp
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_observer, only: observer_t, step_block_t
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_step_control, only: step_control_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  type, abstract, public :: stepper_t
    integer :: order = 0                       !! of y_new
    integer :: error_order = 0                 !! the error estimate falls as h^(error_order + 1)
    integer :: degree = 0                      !! of the polynomials of the dense output
    real(wp) :: max_growth = 6.0_wp            !! largest ratio of a step size to the last one
    logical :: has_low_order_error = .false.   !! whether there are two error estimates
    integer :: degrees(3) = 0                  !! of the polynomials of each kind of its steps; 0: there are fewer kinds
    integer :: series_order = 0                !! order of the Taylor series that the system must have; 0: it needs none
    logical :: chooses_steps = .false.         !! whether `choose_steps` is called before every attempt
    logical :: estimates_errors = .true.       !! whether there are error estimates, at least of some lanes
    logical :: reads_slope = .true.            !! whether `start` and `resume` need attempt%slope
    logical :: passes_series = .false.         !! whether `pass_steps` does not need the coefficients of `interpolate`
  contains
    procedure :: choose_steps
    procedure(prepare_interface), deferred :: prepare
    procedure(start_interface), deferred :: start
    procedure(take_step_interface), deferred :: take_step
    procedure(interpolate_interface), deferred :: interpolate
    procedure(accept_interface), deferred :: accept
    procedure :: resume, pass_steps, describe_plain_steps, accept_plain_steps
  end type stepper_t

  abstract interface

    !> Allocates all memory that the steps need.
    subroutine prepare_interface(self, system)
      import :: stepper_t, system_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(in) :: system
    end subroutine prepare_interface

    !> Starts lanes at attempt%y, where attempt%slope = f(t, y) has been evaluated if the stepper reads it.
    subroutine start_interface(self, attempt, starting)
      import :: stepper_t, step_attempt_t
      class(stepper_t), intent(inout) :: self
      type(step_attempt_t), intent(inout) :: attempt
      logical, intent(in) :: starting(:)
    end subroutine start_interface

    !> One step of size h from (t, y) in each active lane: sets y_new and the error estimates, and disables the lanes that fail.
    subroutine take_step_interface(self, system, attempt)
      import :: stepper_t, system_t, step_attempt_t
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      type(step_attempt_t), intent(inout) :: attempt
    end subroutine take_step_interface

    !> Dense output of the last step in the lanes `wanted`: y + sum over p of coefficients(:, :, p) theta^p with
    !> theta = (time - t) / h. Disables the lanes where its evaluations fail.
    subroutine interpolate_interface(self, system, attempt, wanted, coefficients)
      import :: stepper_t, system_t, step_attempt_t, wp
      class(stepper_t), intent(inout) :: self
      class(system_t), intent(inout) :: system
      type(step_attempt_t), intent(inout) :: attempt
      logical, intent(in) :: wanted(:)
      real(wp), contiguous, intent(inout) :: coefficients(:, :, :)   !! shape [lanes, padded columns, degree]
    end subroutine interpolate_interface

    !> Tells which attempts have been accepted: the next one starts at their ends. The other lanes repeat their steps.
    subroutine accept_interface(self, accepted)
      import :: stepper_t
      class(stepper_t), intent(inout) :: self
      logical, intent(in) :: accepted(:)
    end subroutine accept_interface

  end interface

contains

  !> Sets control%h of active lanes that have been accepted since the last call; control%is_given where no error is estimated.
  subroutine choose_steps(self, system, attempt, control)
    class(stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control

    error stop 'nocdyn_stepper: a stepper that chooses its steps overrides choose_steps'
  end subroutine choose_steps

  !> Restarts lanes whose equations have changed at their present state, after `accept`, with attempt%slope = f(t, y).
  subroutine resume(self, attempt, resuming)
    class(stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: resuming(:)

    call self%start(attempt, resuming)
  end subroutine resume

  !> Describes its part of plain steps before each, if it can use them.
  subroutine describe_plain_steps(self, steps, is_able)
    class(stepper_t), target, intent(inout) :: self
    type(plain_steps_t), intent(inout) :: steps
    logical, intent(out) :: is_able

    is_able = .false.
  end subroutine describe_plain_steps

  !> Takes note of plain steps.
  subroutine accept_plain_steps(self, accepted)
    class(stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)   !! [lanes]

    call self%accept(accepted)
  end subroutine accept_plain_steps

  !> Passes the last steps of all lanes to an observer.
  subroutine pass_steps(self, steps, attempt, coefficients, observer)
    class(stepper_t), intent(in) :: self
    type(step_block_t), intent(inout) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)   !! of `interpolate`; not used if `passes_series`
    class(observer_t), intent(inout) :: observer

    steps%scale(:) = 1.0_wp
    call observer%on_steps(steps, attempt%y, attempt%y_new, coefficients)
  end subroutine pass_steps

end module nocdyn_stepper
