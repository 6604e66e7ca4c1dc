!> How an integration ended, lane by lane, and the sentence that says why.
module nocdyn_outcome
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: allocate_outcome, reset_outcome, note_method, note_crossing, failure_sentence

  integer, parameter, public :: integration_running = -1
  integer, parameter, public :: integration_done = 0
  integer, parameter, public :: integration_step_too_small = 1
  integer, parameter, public :: integration_too_many_steps = 2
  integer, parameter, public :: integration_not_finite = 3
  integer, parameter, public :: integration_gave_up = 4      !! the system said that no shorter step will help
  integer, parameter, public :: integration_interrupted = 5  !! by the observer
  integer, parameter, public :: integration_stopped = 6      !! by a terminal event

  integer, parameter, public :: integration_idle = 7         !! the lane has not been given anything
  integer, parameter, public :: integration_chattering = 8   !! the system changes its branches without end at one time

  integer, parameter, public :: most_switches = 32           !! whose times are kept

  !> Every array has one element per lane.
  type, public :: outcome_t
    integer, allocatable :: status(:)           !! integration_...
    real(wp), allocatable :: t(:)               !! time reached
    real(wp), allocatable :: h(:)               !! size of the last attempt
    integer, allocatable :: component(:)        !! that is to blame for a failure, 0 if none is
    integer, allocatable :: steps(:)            !! attempts, accepted or rejected
    integer, allocatable :: accepted(:)
    integer, allocatable :: rejected(:)
    integer, allocatable :: evaluations(:)      !! of f
    integer, allocatable :: jacobians(:)
    integer, allocatable :: factorisations(:)
    integer, allocatable :: implicit_steps(:)   !! accepted steps of an implicit method
    integer, allocatable :: switches(:)         !! between explicit and implicit method
    real(wp), allocatable :: switch_times(:, :) !! of the first switches, [most_switches, lanes]
    logical, allocatable :: implicit(:)         !! whether the last accepted step was an implicit method's
    integer, allocatable :: crossings(:)        !! changes of branches of the system
    integer, allocatable :: last_crossed(:)     !! number of the system's switch, 0 if there was none
  end type outcome_t

  integer, parameter :: digits = 6   ! of the numbers in messages

contains

  !> No lane has been given anything.
  pure subroutine allocate_outcome(outcome, lanes)
    type(outcome_t), intent(out) :: outcome
    integer, intent(in) :: lanes

    allocate (outcome%status(lanes), source=integration_idle)
    allocate (outcome%t(lanes), outcome%h(lanes), source=0.0_wp)
    allocate (outcome%component(lanes), outcome%steps(lanes), outcome%accepted(lanes), outcome%rejected(lanes), &
              outcome%evaluations(lanes), outcome%jacobians(lanes), outcome%factorisations(lanes), &
              outcome%implicit_steps(lanes), outcome%switches(lanes), outcome%crossings(lanes), &
              outcome%last_crossed(lanes), source=0)
    allocate (outcome%switch_times(most_switches, lanes), source=0.0_wp)
    allocate (outcome%implicit(lanes), source=.false.)
  end subroutine allocate_outcome

  !> A lane is running and nothing has been counted in it.
  pure subroutine reset_outcome(outcome, lane)
    type(outcome_t), intent(inout) :: outcome
    integer, intent(in) :: lane

    outcome%status(lane) = integration_running
    outcome%h(lane) = 0.0_wp
    outcome%component(lane) = 0
    outcome%steps(lane) = 0
    outcome%accepted(lane) = 0
    outcome%rejected(lane) = 0
    outcome%implicit_steps(lane) = 0
    outcome%switches(lane) = 0
    outcome%switch_times(:, lane) = 0.0_wp
    outcome%implicit(lane) = .false.
    outcome%crossings(lane) = 0
    outcome%last_crossed(lane) = 0
  end subroutine reset_outcome

  !> Counts an accepted step, and a switch if its method is of the other kind than that of the step before.
  pure subroutine note_method(outcome, lane, t, implicit)
    type(outcome_t), intent(inout) :: outcome
    integer, intent(in) :: lane
    real(wp), intent(in) :: t        !! start of the step
    logical, intent(in) :: implicit

    outcome%accepted(lane) = outcome%accepted(lane) + 1
    if (implicit) outcome%implicit_steps(lane) = outcome%implicit_steps(lane) + 1
    if (outcome%accepted(lane) > 1 .and. (implicit .neqv. outcome%implicit(lane))) then
      outcome%switches(lane) = outcome%switches(lane) + 1
      if (outcome%switches(lane) <= most_switches) outcome%switch_times(outcome%switches(lane), lane) = t
    end if
    outcome%implicit(lane) = implicit
  end subroutine note_method

  !> Counts a change of a branch.
  pure subroutine note_crossing(outcome, lane, which)
    type(outcome_t), intent(inout) :: outcome
    integer, intent(in) :: lane
    integer, intent(in) :: which   !! number of the system's switch

    outcome%crossings(lane) = outcome%crossings(lane) + 1
    outcome%last_crossed(lane) = which
  end subroutine note_crossing

  !> What happened to a lane, when, to which state, and what to try; for the person at the keyboard.
  function failure_sentence(outcome, lane, system, rtol, atol) result(sentence)
    type(outcome_t), intent(in) :: outcome
    integer, intent(in) :: lane
    class(system_t), intent(in) :: system
    real(wp), intent(in) :: rtol, atol
    character(len=:), allocatable :: sentence
    character(len=:), allocatable :: when

    when = 't = ' // rounded_text(outcome%t(lane), digits) // ' s'
    select case (outcome%status(lane))
    case (integration_done)
      sentence = 'the integration reached ' // when
    case (integration_step_too_small)
      sentence = too_small_sentence(outcome, lane, system, rtol, atol, when)
    case (integration_too_many_steps)
      sentence = too_many_sentence(outcome, lane, system, when)
    case (integration_chattering)
      sentence = chattering_sentence(system%switch_name(outcome%last_crossed(lane)), outcome%crossings(lane), when)
    case (integration_not_finite)
      sentence = not_finite_sentence(outcome, lane, system, when)
    case (integration_gave_up)
      sentence = gave_up_sentence(outcome%steps(lane) == 0, when)
    case (integration_idle)
      sentence = 'nothing has been integrated'
    case (integration_stopped)
      sentence = 'the integration was ended by an event at ' // when
    case (integration_interrupted)
      sentence = 'the integration was interrupted at ' // when
    case default
      error stop 'nocdyn_outcome: an integration that is running has no outcome'
    end select
  end function failure_sentence

  function too_many_sentence(outcome, lane, system, when) result(sentence)
    type(outcome_t), intent(in) :: outcome
    integer, intent(in) :: lane
    class(system_t), intent(in) :: system
    character(len=*), intent(in) :: when
    character(len=:), allocatable :: sentence

    sentence = 'the integration stopped at ' // when // ' after ' // to_text(outcome%steps(lane)) // &
      ' steps, the most that max_steps allows (last step ' // rounded_text(outcome%h(lane), digits) // ' s): '
    if (2 * outcome%crossings(lane) > outcome%steps(lane)) then
      sentence = sentence // to_text(outcome%crossings(lane)) // ' changes of branches have ended steps, the last at the ' // &
        system%switch_name(outcome%last_crossed(lane)) // '; '
    end if
    sentence = sentence // 'raise max_steps, or loosen rtol and atol'
    if (outcome%jacobians(lane) == 0) sentence = sentence // ', or, if the system is stiff, take an implicit method'
  end function too_many_sentence

  function chattering_sentence(name, crossings, when) result(sentence)
    character(len=*), intent(in) :: name
    integer, intent(in) :: crossings
    character(len=*), intent(in) :: when
    character(len=:), allocatable :: sentence

    sentence = 'the equations change to and fro without end at ' // when // ', at the ' // name // ' (' // to_text(crossings) // &
      ' changes of branches so far): both sides drive the solution back to the border between them; make the change smooth'
  end function chattering_sentence

  function too_small_sentence(outcome, lane, system, rtol, atol, when) result(sentence)
    type(outcome_t), intent(in) :: outcome
    integer, intent(in) :: lane
    class(system_t), intent(in) :: system
    real(wp), intent(in) :: rtol, atol
    character(len=*), intent(in) :: when
    character(len=:), allocatable :: sentence

    sentence = 'the step size became too small at ' // when // ' (h = ' // rounded_text(outcome%h(lane), digits) // ' s): '
    if (outcome%component(lane) > 0) then
      sentence = sentence // 'the error of the ' // system%component_name(outcome%component(lane)) // &
        ' cannot be kept within rtol = ' // rounded_text(rtol, digits) // ', atol = ' // rounded_text(atol, digits) // &
        '; loosen the tolerances, or look for a jump or a singularity there'
    else
      sentence = sentence // 'the equations refuse to be evaluated beyond this time; look for a limit that is reached there'
    end if
  end function too_small_sentence

  function not_finite_sentence(outcome, lane, system, when) result(sentence)
    type(outcome_t), intent(in) :: outcome
    integer, intent(in) :: lane
    class(system_t), intent(in) :: system
    character(len=*), intent(in) :: when
    character(len=:), allocatable :: sentence
    character(len=:), allocatable :: what

    what = 'Jacobian'
    if (outcome%component(lane) > 0) what = system%component_name(outcome%component(lane))
    if (outcome%steps(lane) == 0) then
      sentence = 'the derivative of the ' // what // ' at the start, ' // when // &
        ', is not a finite number: check the start values and the parameters'
    else
      sentence = 'the ' // what // ' stops being a finite number right after ' // when // &
        ', however short the step (h = ' // rounded_text(outcome%h(lane), digits) // ' s): look for a singularity there'
    end if
  end function not_finite_sentence

  pure function gave_up_sentence(at_start, when) result(sentence)
    logical, intent(in) :: at_start
    character(len=*), intent(in) :: when
    character(len=:), allocatable :: sentence

    if (at_start) then
      sentence = 'the equations cannot be evaluated at the start, ' // when
    else
      sentence = 'the equations cannot be evaluated beyond ' // when // ', and a shorter step does not help'
    end if
    sentence = sentence // ': check the start values and the parameters'
  end function gave_up_sentence

end module nocdyn_outcome
