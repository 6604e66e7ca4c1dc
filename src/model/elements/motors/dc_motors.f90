!> Direct-current motors with an inductance: torque k i, inductance i' = y voltage - resistance i - k omega, i = 0 at the start.
module nocdyn_dc_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_governed_banks, only: governed_bank_t, has_governors
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(-), operator(/), speed_of, state_of
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_dc_motors

  !> The internal states of a motor are its armature current i [A] and, where a governor throttles the voltage, its integral.
  type, extends(governed_bank_t), public :: dc_motors_t
  contains
    procedure :: describe
    procedure :: extremes
  end type dc_motors_t

contains

  !> A bank of motors, each on one body.
  function new_dc_motors(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(dc_motors_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%states = 1
    allocate (bank%internal_names, source=[character(len=24) :: 'armature current', 'governor integral'])
    call bank%connect(role_motor, keys)
    call bank%add_key(keys, 'voltage')
    call bank%add_key(keys, 'resistance')
    call bank%add_key(keys, 'flux_constant')
    call bank%add_key(keys, 'inductance')
    if (has_governors(keys)) call bank%add_governor(keys)
    call bank%prepare_law()
  end function new_dc_motors

  subroutine describe(self, tape)
    class(dc_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: current, flux, voltage

    current = state_of(tape, 1)
    flux = self%parameter(tape, 'flux_constant')
    voltage = self%parameter(tape, 'voltage')
    if (self%has_governor) voltage = self%throttle(tape) * voltage
    tape%applied = node_of(flux * current)
    tape%rate(1) = node_of((voltage - self%parameter(tape, 'resistance') * current - flux * speed_of(tape)) &
                           / self%parameter(tape, 'inductance'))
  end subroutine describe

  !> The speed without torque, and the one of the governor.
  function extremes(self, element, t) result(speeds)
    class(dc_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    associate (voltage => self%parameters(self%number_of('voltage'))%value, &
               flux_constant => self%parameters(self%number_of('flux_constant'))%value)
      speeds = [self%governed_bank_t%extremes(element, t), voltage(1, element) / flux_constant(1, element)]
    end associate
  end function extremes

end module nocdyn_dc_motors
