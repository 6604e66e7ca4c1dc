!> Excitations by faults of an electrical machine: sums of decaying sines from the time of the fault on.
!>
!> With x = t - time, the torque is the sum of A exp(-rate x) sin(n f x + phase), f the angular frequency of the mains.
module nocdyn_fault_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_described_elements, only: stays_away
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, operator(*), operator(+), operator(-), pick, time_of
  use nocdyn_law_functions, only: add_guard, exp, sin
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_fault_excitations

  !> The terms of one fault.
  type, public :: fault_terms_t
    real(wp) :: frequency = 0.0_wp          !! f [rad/s]
    real(wp), allocatable :: amplitude(:)   !! A [N m], [terms]
    real(wp), allocatable :: multiple(:)    !! n, [terms]
    real(wp), allocatable :: rate(:)        !! [1/s], [terms]
    real(wp), allocatable :: phase(:)       !! [rad], [terms]
  end type fault_terms_t

  type, extends(excitation_bank_t), public :: fault_excitations_t
    integer, private :: most_terms = 0   !! of the excitation with the most
  contains
    procedure :: torque
    procedure :: has_ended => fault_has_ended
  end type fault_excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_fault_excitations(keys, terms) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(fault_terms_t), intent(in) :: terms(:)   !! the same in every lane, [excitations]
    type(fault_excitations_t) :: bank
    integer :: e

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%steady_part = stays_away
    call bank%connect(role_excitation, keys)
    bank%most_terms = maxval([(size(terms(e)%amplitude), e=1, bank%count)])
    call bank%add_key(keys, 'time')
    call bank%add_parameter('mains', spread([(terms(e)%frequency, e=1, bank%count)], 1, bank%lanes), is_key=.false.)
    call add_numbers(bank, terms)
    call bank%add_switches([('fault', e=1, bank%count)], 2)
    call bank%prepare_law()
  end function new_fault_excitations

  !> Adds the numbers of the terms. Those that an excitation lacks are 0.
  subroutine add_numbers(bank, terms)
    type(fault_excitations_t), intent(inout) :: bank
    type(fault_terms_t), intent(in) :: terms(:)
    real(wp), dimension(bank%lanes, bank%count, bank%most_terms) :: amplitude, multiple, phase, rate
    integer :: e, k

    amplitude = 0.0_wp
    multiple = 0.0_wp
    phase = 0.0_wp
    rate = 0.0_wp
    do e = 1, bank%count
      do k = 1, size(terms(e)%amplitude)
        amplitude(:, e, k) = terms(e)%amplitude(k)
        multiple(:, e, k) = terms(e)%multiple(k)
        phase(:, e, k) = terms(e)%phase(k)
        rate(:, e, k) = terms(e)%rate(k)
      end do
    end do
    call bank%add_parts('amplitude', amplitude)
    call bank%add_parts('multiple', multiple)
    call bank%add_parts('phase', phase)
    call bank%add_parts('rate', rate)
  end subroutine add_numbers

  !> A fault has no part in a steady state.
  pure logical function fault_has_ended(self, element)
    class(fault_excitations_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank

    fault_has_ended = .true.
  end function fault_has_ended

  function torque(self, tape)
    class(fault_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque
    type(expression_t) :: has_begun, time, wave, x
    integer :: columns(self%count), k

    time = self%parameter(tape, 'time')
    has_begun = pick(1, [literal(tape, 0.0_wp), literal(tape, 1.0_wp)])
    x = has_begun * (time_of(tape) - time)
    torque = literal(tape, 0.0_wp)
    do k = 1, self%most_terms
      columns = self%part_columns(k)
      wave = self%parameter(tape, 'amplitude', columns) * exp(-(self%parameter(tape, 'rate', columns) * x)) &
             * sin(self%parameter(tape, 'multiple', columns) * self%parameter(tape, 'mains') * x &
                   + self%parameter(tape, 'phase', columns))
      torque = torque + has_begun * wave
    end do
    call add_guard(1, 1, time - time_of(tape), literal(tape, 0.0_wp))   ! time does not go back
  end function torque

end module nocdyn_fault_excitations
