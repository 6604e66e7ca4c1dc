!> Torques that a program sets while it runs a machine: torque + rate (t - since). In a run by itself they keep their start value.
module nocdyn_external_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_described_elements, only: stays_whole
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, operator(*), operator(+), operator(-), time_of
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_external_excitations

  type, extends(excitation_bank_t), public :: external_excitations_t
  contains
    procedure :: torque
    procedure :: set_torque
  end type external_excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_external_excitations(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(external_excitations_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%steady_part = stays_whole
    call bank%connect(role_excitation, keys)
    call bank%add_key(keys, 'amplitude')
    call bank%add_parameter('rate', spread(spread(0.0_wp, 1, bank%lanes), 2, bank%count), is_key=.false.)
    call bank%add_parameter('since', spread(spread(0.0_wp, 1, bank%lanes), 2, bank%count), is_key=.false.)
    call bank%prepare_law()
  end function new_external_excitations

  function torque(self, tape)
    class(external_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque

    torque = self%parameter(tape, 'amplitude') + self%parameter(tape, 'rate') * (time_of(tape) - self%parameter(tape, 'since'))
  end function torque

  !> Sets the torque of one excitation from a time on, in all lanes.
  subroutine set_torque(self, element, torque, rate, since)
    class(external_excitations_t), intent(inout) :: self
    integer, intent(in) :: element      !! numbered within the bank
    real(wp), intent(in) :: torque      !! at that time [N m]
    real(wp), intent(in) :: rate        !! of its change [N m/s]
    real(wp), intent(in) :: since       !! the time [s]

    self%parameters(self%number_of('amplitude'))%value(:, element) = torque
    self%parameters(self%number_of('rate'))%value(:, element) = rate
    self%parameters(self%number_of('since'))%value(:, element) = since
  end subroutine set_torque

end module nocdyn_external_excitations
