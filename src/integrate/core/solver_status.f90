!> Status and statistics of an integration, lane by lane, and messages about failures.
module nocdyn_solver_status
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: allocate_solver_status, reset_solver_status, count_step, count_crossing, failure_message

  integer, parameter, public :: integration_running = -1
  integer, parameter, public :: integration_done = 0
  integer, parameter, public :: integration_step_too_small = 1
  integer, parameter, public :: integration_too_many_steps = 2
  integer, parameter, public :: integration_not_finite = 3
  integer, parameter, public :: integration_rhs_failed = 4    !! the system said that no shorter step will help
  integer, parameter, public :: integration_interrupted = 5   !! by the observer
  integer, parameter, public :: integration_stopped = 6       !! by a terminal event
  integer, parameter, public :: integration_idle = 7          !! the lane holds no variant
  integer, parameter, public :: integration_chattering = 8    !! the system changes its branches endlessly at one time

  integer, parameter, public :: max_switch_times = 32           !! whose times are kept

  !> Every array has one element per lane.
  type, public :: solver_status_t
    integer, allocatable :: code(:)             !! integration_...
    real(wp), allocatable :: t(:)               !! time reached [s]
    real(wp), allocatable :: h(:)               !! step size of the last attempt [s]
    integer, allocatable :: component(:)        !! that caused a failure, 0 if none did
    integer, allocatable :: measure(:)          !! measured quantity whose error did, 0 if none did
    integer, allocatable :: steps(:)            !! attempts, accepted or rejected
    integer, allocatable :: accepted(:), rejected(:)
    integer, allocatable :: evaluations(:)      !! of f
    integer, allocatable :: jacobians(:), factorisations(:)
    integer, allocatable :: implicit_steps(:)   !! accepted steps of an implicit method without trials
    integer, allocatable :: switches(:)         !! changes between explicit and implicit method
    real(wp), allocatable :: switch_times(:, :) !! times of the first such changes [s], [max_switch_times, lanes]
    logical, allocatable :: implicit(:)         !! whether the last accepted step was an implicit method's
    integer, allocatable :: crossings(:)        !! changes of the system's branches
    integer, allocatable :: last_crossing(:)    !! index of the switch of the last such change, 0 if there was none
  end type solver_status_t

  integer, parameter :: digits = 6   ! of the numbers in messages

contains

  !> Allocates the status of lanes that hold no variant.
  pure subroutine allocate_solver_status(solver_status, lanes)
    type(solver_status_t), intent(out) :: solver_status
    integer, intent(in) :: lanes

    allocate (solver_status%code(lanes), source=integration_idle)
    allocate (solver_status%t(lanes), solver_status%h(lanes), source=0.0_wp)
    allocate (solver_status%component(lanes), solver_status%measure(lanes), solver_status%steps(lanes), &
              solver_status%accepted(lanes), solver_status%rejected(lanes), solver_status%evaluations(lanes), &
              solver_status%jacobians(lanes), solver_status%factorisations(lanes), solver_status%implicit_steps(lanes), &
              solver_status%switches(lanes), solver_status%crossings(lanes), solver_status%last_crossing(lanes), source=0)
    allocate (solver_status%switch_times(max_switch_times, lanes), source=0.0_wp)
    allocate (solver_status%implicit(lanes), source=.false.)
  end subroutine allocate_solver_status

  !> Sets the status of a lane that starts: running, all counts zero.
  pure subroutine reset_solver_status(solver_status, lane)
    type(solver_status_t), intent(inout) :: solver_status
    integer, intent(in) :: lane

    solver_status%code(lane) = integration_running
    solver_status%h(lane) = 0.0_wp
    solver_status%component(lane) = 0
    solver_status%measure(lane) = 0
    solver_status%steps(lane) = 0
    solver_status%accepted(lane) = 0
    solver_status%rejected(lane) = 0
    solver_status%implicit_steps(lane) = 0
    solver_status%switch_times(:min(solver_status%switches(lane), max_switch_times), lane) = 0.0_wp
    solver_status%switches(lane) = 0
    solver_status%implicit(lane) = .false.
    solver_status%crossings(lane) = 0
    solver_status%last_crossing(lane) = 0
  end subroutine reset_solver_status

  !> Counts an accepted step, and a change of method if the step before was of the other kind.
  pure subroutine count_step(solver_status, lane, t, implicit)
    type(solver_status_t), intent(inout) :: solver_status
    integer, intent(in) :: lane
    real(wp), intent(in) :: t        !! start of the step [s]
    logical, intent(in) :: implicit  !! whether an implicit method took the step

    solver_status%accepted(lane) = solver_status%accepted(lane) + 1
    if (implicit) solver_status%implicit_steps(lane) = solver_status%implicit_steps(lane) + 1
    if (solver_status%accepted(lane) > 1 .and. (implicit .neqv. solver_status%implicit(lane))) then
      solver_status%switches(lane) = solver_status%switches(lane) + 1
      if (solver_status%switches(lane) <= max_switch_times) solver_status%switch_times(solver_status%switches(lane), lane) = t
    end if
    solver_status%implicit(lane) = implicit
  end subroutine count_step

  !> Counts a change of branch.
  pure subroutine count_crossing(solver_status, lane, which)
    type(solver_status_t), intent(inout) :: solver_status
    integer, intent(in) :: lane
    integer, intent(in) :: which   !! index of the system's switch

    solver_status%crossings(lane) = solver_status%crossings(lane) + 1
    solver_status%last_crossing(lane) = which
  end subroutine count_crossing

  !> The message to the user about a lane: what happened, when, to which component, and what to try.
  function failure_message(solver_status, lane, system, rtol, atol) result(sentence)
    type(solver_status_t), intent(in) :: solver_status
    integer, intent(in) :: lane
    class(system_t), intent(in) :: system
    real(wp), intent(in) :: rtol, atol   !! tolerances of the integration
    character(len=:), allocatable :: sentence, reason, when

    when = 't = ' // rounded_text(solver_status%t(lane), digits) // ' s'
    select case (solver_status%code(lane))
    case (integration_done)
      sentence = 'the integration reached ' // when
    case (integration_step_too_small)
      sentence = too_small_sentence(solver_status, lane, system, rtol, atol, when)
    case (integration_too_many_steps)
      sentence = 'the integration stopped at ' // when // ' after ' // to_text(solver_status%steps(lane)) // &
        ' steps, the most that max_steps allows (last step ' // rounded_text(solver_status%h(lane), digits) // ' s): '
      if (2 * solver_status%crossings(lane) > solver_status%steps(lane)) then
        sentence = sentence // to_text(solver_status%crossings(lane)) // ' changes of branches have ended steps, ' // &
          'the last at the ' // system%switch_name(solver_status%last_crossing(lane)) // '; '
      end if
      sentence = sentence // 'raise max_steps, or loosen rtol and atol'
      if (solver_status%jacobians(lane) == 0) sentence = sentence // ', or, if the system is stiff, take an implicit method'
    case (integration_chattering)
      reason = system%evaluation_obstacle(lane)
      if (reason /= '') then
        sentence = 'no motion fits all joints beyond ' // when // ': ' // reason
      else
        sentence = 'the solution chatters at ' // when // ', at the ' // &
          system%switch_name(solver_status%last_crossing(lane)) // ' (' // to_text(solver_status%crossings(lane)) // &
          ' changes of branches so far): the equations on both sides of the boundary drive it back; make the change smooth'
      end if
    case (integration_not_finite)
      reason = 'Jacobian'
      if (solver_status%component(lane) > 0) reason = system%component_name(solver_status%component(lane))
      if (solver_status%steps(lane) == 0) then
        sentence = 'the derivative of the ' // reason // ' at the start, ' // when // &
          ', is not a finite number: check the start values and the parameters'
      else
        sentence = 'the ' // reason // ' stops being a finite number right after ' // when // &
          ', however short the step (h = ' // rounded_text(solver_status%h(lane), digits) // ' s): look for a singularity there'
      end if
    case (integration_rhs_failed)
      sentence = 'the equations cannot be evaluated beyond ' // when // ', and a shorter step does not help'
      if (solver_status%steps(lane) == 0) sentence = 'the equations cannot be evaluated at the start, ' // when
      reason = system%evaluation_obstacle(lane)
      if (reason /= '' .and. solver_status%steps(lane) > 0) sentence = 'no motion fits all joints beyond ' // when
      if (reason == '') reason = 'check the start values and the parameters'
      sentence = sentence // ': ' // reason
    case (integration_idle)
      sentence = 'nothing has been integrated'
    case (integration_stopped)
      sentence = 'the integration was ended by an event at ' // when
    case (integration_interrupted)
      sentence = 'the integration was interrupted at ' // when
    case default
      error stop 'nocdyn_solver_status: an integration that is running has no failure message'
    end select
  end function failure_message

  !> The message about a lane whose step size has become too small.
  function too_small_sentence(solver_status, lane, system, rtol, atol, when) result(sentence)
    type(solver_status_t), intent(in) :: solver_status
    integer, intent(in) :: lane
    class(system_t), intent(in) :: system
    real(wp), intent(in) :: rtol, atol
    character(len=*), intent(in) :: when
    character(len=:), allocatable :: sentence, what

    what = ''
    if (solver_status%component(lane) > 0) what = system%component_name(solver_status%component(lane))
    if (solver_status%measure(lane) > 0) what = system%measure_name(solver_status%measure(lane))
    sentence = 'the step size became too small at ' // when // ' (h = ' // rounded_text(solver_status%h(lane), digits) // ' s): '
    if (system%evaluation_obstacle(lane) /= '') then
      sentence = sentence // system%evaluation_obstacle(lane)
    else if (what /= '') then
      sentence = sentence // 'the error of the ' // what // ' cannot be kept within rtol = ' // &
        rounded_text(rtol, digits) // ', atol = ' // rounded_text(atol, digits) // &
        '; loosen the tolerances, or look for a jump or a singularity there'
    else
      sentence = sentence // 'the equations cannot be evaluated beyond this time; look for a limit that is reached there'
    end if
  end function too_small_sentence

end module nocdyn_solver_status
