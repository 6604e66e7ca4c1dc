!> Harmonic excitations, eq. (17): M_0 sin(omega_p t + phase).
module nocdyn_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, operator(*), operator(+), time_of
  use nocdyn_law_functions, only: sin
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_excitations

  type, extends(excitation_bank_t), public :: excitations_t
  contains
    procedure :: torque
  end type excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_excitations(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(excitations_t) :: bank

    bank%is_polynomial = .false.
    call bank%connect(role_excitation, keys)
    call bank%add_key(keys, 'amplitude')
    call bank%add_key(keys, 'frequency')
    call bank%add_key(keys, 'phase')
    call bank%prepare_law()
  end function new_excitations

  function torque(self, tape)
    class(excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque

    torque = self%parameter(tape, 'amplitude') &
             * sin(self%parameter(tape, 'frequency') * time_of(tape) + self%parameter(tape, 'phase'))
  end function torque

end module nocdyn_excitations
