!> Excitations that change during a limited time: steps, ramps and half-sine pulses.
module nocdyn_timed_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_described_elements, only: stays_whole
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, operator(*), operator(+), operator(-), operator(/), &
    pick, time_of
  use nocdyn_law_functions, only: add_guard, sin
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_timed_excitations

  integer, parameter, public :: shape_step = 1    !! 0, then the amplitude
  integer, parameter, public :: shape_ramp = 2    !! linear from 0 to the amplitude, then constant
  integer, parameter, public :: shape_pulse = 3   !! half a sine wave with the amplitude, then 0

  type, extends(excitation_bank_t), public :: timed_excitations_t
  contains
    procedure :: torque
  end type timed_excitations_t

  character(len=*), parameter :: switch_names(3) = &   ! by shape
    [character(len=16) :: 'step', 'end of the ramp', 'end of the pulse']

  integer, parameter :: before = 1, during = 2, after = 3   ! the branches
  real(wp), parameter :: pi = acos(-1.0_wp)

contains

  !> A bank of excitations, each on one body.
  function new_timed_excitations(keys, shape) result(bank)
    class(element_keys_t), intent(in) :: keys
    integer, intent(in) :: shape(:)   !! shape_... of each
    type(timed_excitations_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%steady_part = stays_whole
    call bank%connect(role_excitation, keys)
    call bank%add_key(keys, 'amplitude')
    call bank%add_key(keys, 'time')
    call bank%add_key(keys, 'duration', absent=1.0_wp)
    call bank%add_parameter('is step', spread(merge(1.0_wp, 0.0_wp, shape == shape_step), 1, bank%lanes), is_key=.false.)
    call bank%add_parameter('is ramp', spread(merge(1.0_wp, 0.0_wp, shape == shape_ramp), 1, bank%lanes), is_key=.false.)
    call bank%add_switches(switch_names(shape), after)
    call bank%prepare_law()
  end function new_timed_excitations

  !> Torques as parts of the amplitude: x while a ramp rises, sin(pi x) during a pulse, with x from 0 to 1; a step ends as it
  !> begins.
  function torque(self, tape)
    class(timed_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque
    type(expression_t) :: begin, duration, is_pulse, is_ramp, is_step, none, part, x

    begin = self%parameter(tape, 'time')
    duration = self%parameter(tape, 'duration')
    is_step = self%parameter(tape, 'is step')
    is_ramp = self%parameter(tape, 'is ramp')
    is_pulse = 1.0_wp - is_step - is_ramp
    none = literal(tape, 0.0_wp)
    x = (time_of(tape) - begin) / duration
    part = pick(1, [none, is_ramp, none]) * x + pick(1, [none, is_pulse, none]) * sin(pi * x) &
           + pick(1, [none, none, is_step + is_ramp])
    torque = self%parameter(tape, 'amplitude') * part
    call add_guard(1, before, begin - time_of(tape), none)   ! time does not go back across a boundary
    call add_guard(1, during, begin + (1.0_wp - is_step) * duration - time_of(tape), none)
  end function torque

end module nocdyn_timed_excitations
