!> Harmonic excitations, eq. (17): M_0 sin(omega_p t + phase).
module nocdyn_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, operator(*), operator(+), time_of
  use nocdyn_law_functions, only: sin
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_excitations

  type, extends(excitation_bank_t), public :: excitations_t
  contains
    procedure :: torque
  end type excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_excitations(names, body, amplitude, frequency, phase) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: amplitude(:, :), frequency(:, :), phase(:, :)   !! [N m], [rad/s], [rad], shape [lanes, excitations]
    type(excitations_t) :: bank

    bank%is_polynomial = .false.
    call bank%connect(role_excitation, size(amplitude, 1), names, body)
    call bank%add_parameter('amplitude', amplitude)
    call bank%add_parameter('frequency', frequency)
    call bank%add_parameter('phase', phase)
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
