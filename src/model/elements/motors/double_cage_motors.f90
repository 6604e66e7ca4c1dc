!> Induction motors with two cages, or with deep bars, and the electrical transients of stator and cages: the two-axis model.
!>
!> It is the model of `nocdyn_flux_motors` with one more cage, in the frame that turns with the mains. With lambda_d + i lambda_q
!>
!>     lambda_s' = V - R_s i_s - i w lambda_s,    lambda_k' = -R_k i_k - i (w - w_r) lambda_k    (k = 1, 2),
!>
!> with lambda_s = L_ls i_s + lambda_m, lambda_k = L_k i_k + lambda_m and lambda_m = L_m (i_s + i_1 + i_2). (MathWorks,
!> Simscape Electrical, Asynchronous Machine, double squirrel cage: these equations. P. C. Krause, Analysis of Electric Machinery,
!> 1986, chapter 4: their form for one cage.)
!>
!> With 1 / L = 1 / L_m + 1 / L_1 + 1 / L_2 the cages alone make the flux lambda_c = L (lambda_1 / L_1 + lambda_2 / L_2), so that
!> i_s = (lambda_s - lambda_c) / (L_ls + L), lambda_m = lambda_c + L i_s and i_k = (lambda_k - lambda_m) / L_k. While the motor is
!> disconnected, the flux of the stator is lambda_c: it follows that by its rate, and the current decays with `arc_time`.
module nocdyn_double_cage_motors
  use nocdyn_double_cage_circuits, only: double_cage_circuit_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_flux_motors, only: amplitude, arc_time, circuit_keys, connect_motors, flux_motors_t, supply
  use nocdyn_induction_circuits, only: induction_circuit_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(+), operator(-), operator(/), state_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_schedules, only: guard_schedule, scheduled_flag, scheduled_value
  implicit none (type, external)
  private

  public :: new_double_cage_motors

  !> Keys of the circuit; the rotor of `circuit_keys` is the inner cage.
  character(len=*), parameter, public :: double_cage_keys(*) = &
    [character(len=17) :: circuit_keys, 'outer_resistance', 'outer_leakage', 'outer_reactance']

  !> The internal states of a motor are the flux linkages d and q of its stator, of its inner and of its outer cage [V s].
  type, extends(flux_motors_t), public :: double_cage_motors_t
  contains
    procedure :: describe
    procedure :: double_circuit
    procedure :: extremes
    procedure :: steady_flux, stator_current
  end type double_cage_motors_t

contains

  !> A bank of motors, each on one body, all or none of which have a supply over the time.
  function new_double_cage_motors(keys, rated) result(bank)
    class(element_keys_t), intent(in) :: keys
    real(wp), intent(in), optional :: rated(:, :, :)   !! circuits in place of the ones of the keys, in SI, [lanes, motors, keys]
    type(double_cage_motors_t) :: bank

    allocate (bank%internal_names, source=[character(len=24) :: 'stator flux d', 'stator flux q', 'inner cage flux d', &
                                           'inner cage flux q', 'outer cage flux d', 'outer cage flux q'])
    call connect_motors(bank, keys, double_cage_keys, rated)
  end function new_double_cage_motors

  subroutine describe(self, tape)
    class(double_cage_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: cage(2), current(2), drop(2, 2), flux(2, 3), magnetising, mutual, resistance(2), share(2), &
                          slip_frequency
    integer :: axis, k

    resistance = [self%parameter(tape, 'rotor_resistance'), self%parameter(tape, 'outer_resistance')]
    cage = [self%inductance(tape, 'rotor_leakage', 'rotor_reactance'), &
            self%inductance(tape, 'outer_leakage', 'outer_reactance')]
    mutual = 1.0_wp / (1.0_wp / self%inductance(tape, 'mutual_inductance', 'mutual_reactance') &
                       + 1.0_wp / cage(1) + 1.0_wp / cage(2))
    share = [mutual / cage(1), mutual / cage(2)]
    associate (stator => mutual + self%inductance(tape, 'stator_leakage', 'stator_reactance'))
      do axis = 1, 2
        flux(axis, :) = [state_of(tape, axis), state_of(tape, axis + 2), state_of(tape, axis + 4)]
        magnetising = share(1) * flux(axis, 2) + share(2) * flux(axis, 3)   ! without the current of the stator
        current(axis) = (flux(axis, 1) - magnetising) / stator
        magnetising = magnetising + mutual * current(axis)
        do k = 1, 2
          drop(axis, k) = (resistance(k) / cage(k)) * (flux(axis, k + 1) - magnetising)
        end do
      end do
      call describe_stator(self, tape, stator, flux(:, 1), current, &
                           [share(1) * drop(1, 1) + share(2) * drop(1, 2), share(1) * drop(2, 1) + share(2) * drop(2, 2)])
    end associate
    tape%applied = node_of(1.5_wp * (self%parameter(tape, 'direction') * self%parameter(tape, 'pole pairs')) &
                           * (flux(1, 1) * current(2) - flux(2, 1) * current(1)))
    slip_frequency = self%slip_frequency(tape)
    do k = 1, 2
      tape%rate(2 * k + 1) = node_of(slip_frequency * flux(2, k + 1) - drop(1, k))
      tape%rate(2 * k + 2) = node_of(-slip_frequency * flux(1, k + 1) - drop(2, k))
    end do
  end subroutine describe

  !> The rates of the flux of the stator.
  subroutine describe_stator(self, tape, inductance, flux, current, decay)
    class(double_cage_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: inductance             !! transient one of the stator [H]
    type(expression_t), intent(in) :: flux(2), current(2)    !! of the stator, on both axes [V s], [A]
    type(expression_t), intent(in) :: decay(2)               !! of the flux that the cages make, by their resistances [V]
    type(expression_t) :: is_off, rate(2), resistance, turn, voltage

    resistance = self%parameter(tape, 'stator_resistance')
    voltage = amplitude * self%parameter(tape, 'voltage')
    turn = self%field_turn(tape)
    if (self%has_schedule) then
      is_off = scheduled_flag(self, tape, supply, 1)
      resistance = (1.0_wp - is_off) * resistance + (1.0_wp / arc_time) * is_off * inductance
      voltage = scheduled_value(self, tape, supply, 1) * voltage
    end if
    rate(1) = voltage + turn * flux(2) - resistance * current(1)
    rate(2) = -turn * flux(1) - resistance * current(2)
    if (self%has_schedule) then
      rate = [rate(1) - is_off * decay(1), rate(2) - is_off * decay(2)]
      call guard_schedule(self, tape, supply, 1)
    end if
    tape%rate(1:2) = [node_of(rate(1)), node_of(rate(2))]
  end subroutine describe_stator

  !> The circuit of one motor in one lane, with both cages.
  pure type(double_cage_circuit_t) function double_circuit(self, lane, element) result(circuit)
    class(double_cage_motors_t), intent(in) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: element   !! numbered within the bank
    type(induction_circuit_t) :: inner   ! without the outer cage

    inner = self%circuit(lane, element)
    circuit%voltage = inner%voltage
    circuit%frequency = inner%frequency
    circuit%pole_pairs = inner%pole_pairs
    circuit%stator_resistance = inner%stator_resistance
    circuit%stator_leakage = inner%stator - inner%mutual
    circuit%mutual = inner%mutual
    circuit%resistance = [inner%rotor_resistance, value('outer_resistance')]
    circuit%leakage = [inner%rotor - inner%mutual, value('outer_leakage') + value('outer_reactance') / inner%frequency]

  contains

    pure real(wp) function value(name)
      character(len=*), intent(in) :: name   !! of a parameter

      value = self%parameters(self%number_of(name))%value(lane, element)
    end function value

  end function double_circuit

  pure function steady_flux(self, element, slip, share) result(flux)
    class(double_cage_motors_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: slip, share
    complex(wp) :: flux(self%states / 2)
    type(double_cage_circuit_t) :: circuit

    circuit = self%double_circuit(1, element)
    circuit%voltage = circuit%voltage * share
    flux = circuit%steady_flux(slip)
  end function steady_flux

  !> The synchronous speed, and the ones of the extremes of the steady torque.
  function extremes(self, element, t) result(speeds)
    class(double_cage_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)
    type(double_cage_circuit_t) :: circuit

    circuit = self%double_circuit(1, element)
    speeds = self%direction_of(element) * circuit%frequency / circuit%pole_pairs * (1.0_wp - [0.0_wp, circuit%extreme_slips()])
  end function extremes

  pure complex(wp) function stator_current(self, lane, element, flux)
    class(double_cage_motors_t), intent(in) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: element
    complex(wp), intent(in) :: flux(:)   !! of the stator, the inner and the outer cage [V s]
    type(double_cage_circuit_t) :: circuit

    circuit = self%double_circuit(lane, element)
    stator_current = circuit%stator_current(flux)
  end function stator_current

end module nocdyn_double_cage_motors
