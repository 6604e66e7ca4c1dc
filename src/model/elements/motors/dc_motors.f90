!> Direct-current motors with an inductance: torque k i, inductance i' = y voltage - resistance i - k omega, i = 0 at the start.
module nocdyn_dc_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_governed_banks, only: governed_bank_t, governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(-), operator(/), speed_of, state_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_text, only: string_t
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
  function new_dc_motors(names, body, voltage, resistance, flux_constant, inductance, governor) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: voltage(:, :), resistance(:, :)         !! [V], [Ohm], shape [lanes, motors]
    real(wp), intent(in) :: flux_constant(:, :), inductance(:, :)   !! k [V s/rad], [H], shape [lanes, motors]
    type(governor_t), intent(in), optional :: governor   !! no motor has one if absent
    type(dc_motors_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%states = 1
    allocate (bank%internal_names, source=[character(len=24) :: 'armature current', 'governor integral'])
    call bank%connect(role_motor, size(voltage, 1), names, body)
    call bank%add_parameter('voltage', voltage)
    call bank%add_parameter('resistance', resistance)
    call bank%add_parameter('flux_constant', flux_constant)
    call bank%add_parameter('inductance', inductance)
    if (present(governor)) call bank%add_governor(governor)
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
