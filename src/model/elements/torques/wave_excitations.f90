!> Excitations that are sums of sines of the time and of the angle u of their body: sum of A sin(f t + order u + phase).
!>
!> Engine orders have f = 0; the ones of one excitation that are whole multiples of one order follow from one sine and one cosine.
!> A synchronous motor with p pole pairs pulsates during its start at twice the slip frequency: f = 2 omega_mains, order = -2 p.
module nocdyn_wave_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: angle_of, expression_t, operator(*), operator(+), time_of
  use nocdyn_law_functions, only: cos, harmonics, sin
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_order_terms, only: new_order_terms, order_terms_t
  implicit none (type, external)
  private

  public :: new_wave_excitations

  type, extends(excitation_bank_t), public :: wave_excitations_t
    type(order_terms_t) :: sorted
  contains
    procedure :: sum_of_waves
    procedure :: torque => sum_of_waves
  end type wave_excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_wave_excitations(keys, owner, amplitude, frequency, order, phase) result(bank)
    class(element_keys_t), intent(in) :: keys
    integer, intent(in) :: owner(:)   !! excitation of each term
    real(wp), intent(in) :: amplitude(:, :), frequency(:, :)   !! [N m], [rad/s], shape [lanes, terms]
    real(wp), intent(in) :: order(:, :), phase(:, :)           !! [1], [rad], shape [lanes, terms]
    type(wave_excitations_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_excitation, keys)
    call bank%add_parameter('amplitude', amplitude, element=owner)
    call bank%add_parameter('frequency', frequency, is_key=.false., element=owner)
    call bank%add_parameter('order', order, is_key=.false., element=owner)
    call bank%add_parameter('phase', phase, element=owner)
    bank%sorted = new_order_terms(bank%count, owner, order(1, :), &
                                 .not. any(abs(frequency) > 0, dim=1) .and. all(order > 0, dim=1))
    call bank%add_parameter('base', spread(bank%sorted%base, 1, bank%lanes), is_key=.false.)
    call bank%prepare_law()
  end function new_wave_excitations

  !> The sum of all terms.
  function sum_of_waves(self, tape) result(torque)
    class(wave_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque
    integer :: k
    logical :: is_empty

    is_empty = size(self%sorted%multiples) == 0
    if (.not. is_empty) torque = sum_of_multiples(self, tape, self%sorted%multiples)
    do k = 1, size(self%sorted%single, 1)
      if (is_empty) then
        torque = wave(self, tape, self%sorted%single(k, :))
      else
        torque = torque + wave(self, tape, self%sorted%single(k, :))
      end if
      is_empty = .false.
    end do
  end function sum_of_waves

  !> The terms that are multiples of the base.
  function sum_of_multiples(self, tape, n) result(torque)
    class(wave_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: n(:)   !! the multiples that some excitation has
    type(expression_t) :: a(size(n)), amplitude, b(size(n)), phase, torque
    integer :: k

    do k = 1, size(n)
      amplitude = self%parameter(tape, 'amplitude', self%sorted%multiple(n(k), :))
      phase = self%parameter(tape, 'phase', self%sorted%multiple(n(k), :))
      a(k) = amplitude * cos(phase)
      b(k) = amplitude * sin(phase)
    end do
    torque = harmonics(n, a, b, self%parameter(tape, 'base') * angle_of(tape))
  end function sum_of_multiples

  !> One term of each excitation, A sin(f t + order u + phase).
  function wave(self, tape, columns) result(torque)
    class(wave_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: columns(:)   !! the term of each excitation, 0 for none
    type(expression_t) :: torque

    torque = self%parameter(tape, 'amplitude', columns) &
             * sin(self%parameter(tape, 'frequency', columns) * time_of(tape) &
                   + self%parameter(tape, 'order', columns) * angle_of(tape) + self%parameter(tape, 'phase', columns))
  end function wave

end module nocdyn_wave_excitations
