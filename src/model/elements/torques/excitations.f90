!> Harmonic excitations, eq. (17): M_0 sin(omega_p t + phase).
module nocdyn_excitations
  use nocdyn_bank, only: harmonic_t, role_excitation, sine_harmonic
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
    procedure :: to_mean_torque
    procedure :: list_harmonics
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

  !> The mean of a sine is zero; with the frequency 0 it is a constant.
  subroutine to_mean_torque(self)
    class(excitations_t), intent(inout) :: self

    where (abs(self%values_of('frequency')) > 0.0_wp) self%parameters(self%number_of('amplitude'))%value = 0.0_wp
    self%parameters(self%number_of('frequency'))%value = 0.0_wp
    self%is_silent = .not. any(abs(self%values_of('amplitude')) > 0)
    call self%prepare_law()
  end subroutine to_mean_torque

  !> One harmonic, unless the frequency is 0.
  subroutine list_harmonics(self, element, speed, list)
    class(excitations_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: speed    !! u' [rad/s]
    type(harmonic_t), allocatable, intent(out) :: list(:)
    real(wp), dimension(self%lanes, self%count) :: amplitude, frequency, phase

    amplitude = self%values_of('amplitude')
    frequency = self%values_of('frequency')
    phase = self%values_of('phase')
    allocate (list(merge(1, 0, frequency(1, element) > 0)))
    list(:) = sine_harmonic(amplitude(1, element), frequency(1, element), 0.0_wp, phase(1, element), &
                            self%rows%last_body(element))
  end subroutine list_harmonics

end module nocdyn_excitations
