!> Induction motors with the electrical transients of stator and rotor: the two-axis model, whose states are flux linkages.
!>
!> In the frame that turns with the mains (angular frequency w, voltage along d) and with w_r = pole pairs times speed
!>
!>     lambda_ds' = V - R_s i_ds + w lambda_qs            lambda_dr' = -R_r i_dr + (w - w_r) lambda_qr
!>     lambda_qs' =   - R_s i_qs - w lambda_ds            lambda_qr' = -R_r i_qr - (w - w_r) lambda_dr
!>
!> and the torque is 3/2 pole pairs (lambda_ds i_qs - lambda_qs i_ds). A steady state is constant in this frame. Currents follow
!> from fluxes by the inverse of the inductances. (P. C. Krause, Analysis of Electric Machinery, 1986, chapter 4.)
!>
!> V may follow the time. While the motor is disconnected, no current flows in its stator, whose flux is (L_m / L_r) lambda_r, as
!> the rotor alone makes it: lambda_s follows that by its rate, and what differs at the opening decays with `arc_time`.
module nocdyn_flux_motors
  use nocdyn_bank, only: bank_t, role_motor
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_induction_circuits, only: induction_circuit_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(+), operator(-), operator(/), speed_of, state_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_quantities, only: form_applied, form_observed, new_quantity, quantity_t, rank_current, rank_torque
  use nocdyn_schedules, only: add_schedule, guard_schedule, schedule_t, scheduled_flag, scheduled_value, value_at
  implicit none (type, external)
  private

  public :: new_flux_motors, connect_motors

  !> Keys of the circuit. Each inductance is given as such or as a reactance at the frequency; the other one is 0.
  character(len=*), parameter, public :: circuit_keys(*) = [character(len=17) :: &
    'voltage', 'frequency', 'stator_resistance', 'rotor_resistance', 'stator_leakage', 'rotor_leakage', 'mutual_inductance', &
    'stator_reactance', 'rotor_reactance', 'mutual_reactance']

  character(len=*), parameter :: share_name = 'share of frequency'   ! of the supply, where a speed is held
  character(len=*), parameter, public :: supply = 'supply'   !! the scheduled share of the voltage; its flag: disconnected
  real(wp), parameter, public :: arc_time = 1.0e-3_wp   !! time constant of the currents in opening contacts [s]
  real(wp), parameter, public :: amplitude = sqrt(2.0_wp / 3.0_wp)   !! of a phase of the star, per rms voltage between lines

  !> The internal states of a motor are the flux linkages d and q of its stator, then the ones of its rotor [V s].
  type, extends(bank_t), public :: flux_motors_t
    logical :: has_schedule = .false.            !! whether the supply follows the time
    logical, private :: is_held = .false.        !! whether the supply may have another frequency, after `hold_speed`
  contains
    procedure :: describe
    procedure :: circuit
    procedure :: inductance, field_turn, slip_frequency, direction_of
    procedure :: working_point
    procedure :: decide_internal
    procedure :: transient_frequency
    procedure :: hold_speed, follows_supply, set_supply, idle_supply
    procedure :: extremes
    procedure :: quantities
    procedure :: steady_flux, stator_current   !! which differ by the circuit of the rotor
    procedure :: observe
  end type flux_motors_t

contains

  !> A bank of motors, each on one body, all or none of which have a supply over the time.
  function new_flux_motors(keys, rated) result(bank)
    class(element_keys_t), intent(in) :: keys
    real(wp), intent(in), optional :: rated(:, :, :)   !! circuits in place of the ones of the keys, in SI, [lanes, motors, keys]
    type(flux_motors_t) :: bank

    allocate (bank%internal_names, source=[character(len=24) :: 'stator flux d', 'stator flux q', 'rotor flux d', 'rotor flux q'])
    call connect_motors(bank, keys, circuit_keys, rated)
  end function new_flux_motors

  !> Makes a bank of motors on mains, whose `internal_names` are set, from its keys.
  subroutine connect_motors(bank, keys, names, rated)
    class(flux_motors_t), intent(inout) :: bank
    class(element_keys_t), intent(in) :: keys
    character(len=*), intent(in) :: names(:)             !! of the keys of the circuit
    real(wp), intent(in), optional :: rated(:, :, :)     !! as in `new_flux_motors`
    type(schedule_t), allocatable :: schedule(:, :)
    integer :: e, k, lane

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%states = size(bank%internal_names)
    call bank%connect(role_motor, keys)
    do k = 1, size(names)
      if (present(rated)) then
        call bank%add_parameter(names(k), rated(:, :, k), is_key=.false.)
      else
        call bank%add_key(keys, names(k))
      end if
    end do
    call bank%add_parameter('pole pairs', 0.5_wp * keys%values('poles'), is_key=.false.)
    call bank%add_parameter('direction', 1.0_wp - 2.0_wp * keys%values('reversed'), is_key=.false.)
    bank%has_schedule = keys%has('supply_times')
    if (bank%has_schedule) then
      allocate (schedule(bank%lanes, bank%count))
      do e = 1, bank%count
        do lane = 1, bank%lanes
          call schedule_supply(keys%numbers('supply_times', lane, e), keys%numbers('supply_factors', lane, e), &
                               keys%numbers('supply_ramps', lane, e), schedule(lane, e))
        end do
      end do
      call add_schedule(bank, supply, schedule, 'change of the supply')
    end if
    call bank%prepare_law()
  end subroutine connect_motors

  !> The share of the voltage of one motor: at each time a change to the next factor, within a ramp. Before the first one, and
  !> with the factor 0, the motor is disconnected.
  subroutine schedule_supply(time, factor, ramp, schedule)
    real(wp), intent(in) :: time(:), factor(:), ramp(:)   ! [s], [1], [s]
    type(schedule_t), intent(out) :: schedule
    real(wp) :: before
    integer :: k

    call schedule%append(time(1), 0.0_wp, 0.0_wp, .true.)
    before = 0.0_wp
    do k = 1, size(time)
      if (ramp(k) > 0) call schedule%append(time(k), before, (factor(k) - before) / ramp(k), .false.)
      call schedule%append(time(k) + ramp(k), factor(k), 0.0_wp, .not. factor(k) > 0)
      before = factor(k)
    end do
  end subroutine schedule_supply

  subroutine describe(self, tape)
    class(flux_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: circuit(3), determinant, drive, ds, dr, mutual, own, pole_pairs, qs, qr, rotor, rotor_rate, &
                          slip_frequency, stator, turn

    ds = state_of(tape, 1)
    qs = state_of(tape, 2)
    dr = state_of(tape, 3)
    qr = state_of(tape, 4)
    mutual = self%inductance(tape, 'mutual_inductance', 'mutual_reactance')
    stator = mutual + self%inductance(tape, 'stator_leakage', 'stator_reactance')
    rotor = mutual + self%inductance(tape, 'rotor_leakage', 'rotor_reactance')
    determinant = stator * rotor - mutual * mutual
    rotor_rate = self%parameter(tape, 'rotor_resistance') / determinant   ! of the flux, times an inductance [1/(H s)]
    pole_pairs = self%parameter(tape, 'direction') * self%parameter(tape, 'pole pairs')
    slip_frequency = self%slip_frequency(tape)
    circuit = stator_circuit(self, tape, [stator, rotor, mutual, determinant])
    own = circuit(1)
    drive = circuit(2)
    turn = self%field_turn(tape)
    tape%applied = node_of(1.5_wp * pole_pairs * (mutual / determinant) * (qs * dr - ds * qr))
    tape%rate(1) = node_of(circuit(3) - own * ds + drive * dr + turn * qs)
    tape%rate(2) = node_of(drive * qr - own * qs - turn * ds)
    tape%rate(3) = node_of(rotor_rate * mutual * ds - rotor_rate * stator * dr + slip_frequency * qr)
    tape%rate(4) = node_of(rotor_rate * mutual * qs - rotor_rate * stator * qr - slip_frequency * dr)
  end subroutine describe

  !> One inductance [H], from the key that is given.
  type(expression_t) function inductance(self, tape, key, reactance)
    class(flux_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: key, reactance

    inductance = self%parameter(tape, key) + self%parameter(tape, reactance) / self%parameter(tape, 'frequency')
  end function inductance

  !> The angular frequency of the fields against the rotor [rad/s].
  type(expression_t) function slip_frequency(self, tape)
    class(flux_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: frequency, pole_pairs

    frequency = self%parameter(tape, 'frequency')
    pole_pairs = self%parameter(tape, 'direction') * self%parameter(tape, 'pole pairs')
    slip_frequency = frequency - pole_pairs * speed_of(tape)
    if (self%is_held) slip_frequency = self%parameter(tape, share_name) * frequency - pole_pairs * speed_of(tape)
  end function slip_frequency

  !> The angular frequency of the frame against what carries the flux of the stator [rad/s]: the stator itself, or the rotor while
  !> the motor is disconnected.
  type(expression_t) function field_turn(self, tape)
    class(flux_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: pole_pairs

    field_turn = self%parameter(tape, 'frequency')
    if (.not. self%has_schedule) return
    pole_pairs = self%parameter(tape, 'direction') * self%parameter(tape, 'pole pairs')
    field_turn = field_turn - scheduled_flag(self, tape, supply, 1) * pole_pairs * speed_of(tape)
  end function field_turn

  !> What the stator flux follows: its own rate and that by the rotor flux [1/s], and the voltage [V].
  function stator_circuit(self, tape, inductances) result(circuit)
    class(flux_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: inductances(4)   !! of stator, rotor, both [H]; the determinant [H2]
    type(expression_t) :: circuit(3)
    type(expression_t) :: is_off, resistance, voltage

    resistance = self%parameter(tape, 'stator_resistance')
    voltage = amplitude * self%parameter(tape, 'voltage')
    associate (stator => inductances(1), rotor => inductances(2), mutual => inductances(3), determinant => inductances(4))
      circuit = [(resistance / determinant) * rotor, (resistance / determinant) * mutual, voltage]
      if (.not. self%has_schedule) return
      is_off = scheduled_flag(self, tape, supply, 1)
      resistance = (1.0_wp - is_off) * resistance + (is_off * determinant) / (arc_time * rotor)
      circuit(1) = (resistance * rotor) / determinant
      circuit(2) = (resistance * mutual) / determinant
      resistance = (is_off * mutual) / rotor * self%parameter(tape, 'rotor_resistance')   ! times rotor current: rate of the flux
      circuit(1) = circuit(1) - (resistance * mutual) / determinant
      circuit(2) = circuit(2) - (resistance * stator) / determinant
      circuit(3) = scheduled_value(self, tape, supply, 1) * voltage
      call guard_schedule(self, tape, supply, 1)
    end associate
  end function stator_circuit

  !> The circuit of one motor in one lane.
  pure type(induction_circuit_t) function circuit(self, lane, element)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: element   !! numbered within the bank

    circuit%voltage = amplitude * value('voltage')
    circuit%frequency = value('frequency')
    circuit%pole_pairs = value('pole pairs')
    circuit%stator_resistance = value('stator_resistance')
    circuit%rotor_resistance = value('rotor_resistance')
    circuit%mutual = value('mutual_inductance') + value('mutual_reactance') / circuit%frequency
    circuit%stator = circuit%mutual + value('stator_leakage') + value('stator_reactance') / circuit%frequency
    circuit%rotor = circuit%mutual + value('rotor_leakage') + value('rotor_reactance') / circuit%frequency

  contains

    pure real(wp) function value(name)
      character(len=*), intent(in) :: name   !! of a parameter

      value = self%parameters(self%number_of(name))%value(lane, element)
    end function value

  end function circuit

  !> The fluxes of the steady state with the slip at a speed, by the circuit.
  subroutine decide_internal(self, t, speed, internal, is_decided)
    class(flux_motors_t), intent(in) :: self
    real(wp), intent(in) :: t                !! [s]
    real(wp), intent(in) :: speed(:)         !! u' [rad/s], [motors]
    real(wp), intent(inout) :: internal(:)   !! [states * motors]
    logical, intent(out) :: is_decided(:)    !! [states]
    complex(wp) :: flux(self%states / 2)
    integer :: e, k
    real(wp) :: share, slip

    is_decided = .true.
    do e = 1, self%count
      call self%working_point(e, t, speed(e), slip, share)
      flux = self%steady_flux(e, slip, share)
      internal((e - 1) * self%states + 1:e * self%states) = [(real(flux(k), wp), aimag(flux(k)), k=1, size(flux))]
    end do
  end subroutine decide_internal

  !> The fluxes of the stator and of each cage that do not change at a slip, of a motor of the first lane [V s].
  pure function steady_flux(self, element, slip, share) result(flux)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: slip     !! 1 at standstill
    real(wp), intent(in) :: share    !! of the voltage of the mains
    complex(wp) :: flux(self%states / 2)
    type(induction_circuit_t) :: circuit

    circuit = self%circuit(1, element)
    circuit%voltage = circuit%voltage * share
    flux = circuit%steady_flux(slip)
  end function steady_flux

  !> The slip and the share of the voltage of a motor of the first lane.
  subroutine working_point(self, element, t, speed, slip, share)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), intent(in) :: speed    !! u' [rad/s]
    real(wp), intent(out) :: slip    !! 1 at standstill
    real(wp), intent(out) :: share   !! of the voltage of the mains
    type(induction_circuit_t) :: circuit

    circuit = self%circuit(1, element)
    slip = circuit%slip(self%direction_of(element) * speed)
    if (self%is_held) slip = self%parameters(self%number_of(share_name))%value(1, element) - self%idle_supply(element, speed)
    share = 1.0_wp
    if (self%has_schedule) share = value_at(self, supply, element, t)
  end subroutine working_point

  !> 1, or -1 with a reversed field, of a motor of the first lane.
  pure real(wp) function direction_of(self, element)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank

    direction_of = self%parameters(self%number_of('direction'))%value(1, element)
  end function direction_of

  !> The torque swings with the mains after a change of the supply, which at the start is the one of switching on.
  pure real(wp) function transient_frequency(self, element, is_steady)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: element     !! numbered within the bank
    logical, intent(in) :: is_steady   !! whether its fluxes begin as they stay

    transient_frequency = 0.0_wp
    if (is_steady .and. .not. self%has_schedule) return
    transient_frequency = self%parameters(self%number_of('frequency'))%value(1, element)
  end function transient_frequency

  !> Gives the motors a supply of any frequency.
  subroutine hold_speed(self)
    class(flux_motors_t), intent(inout) :: self

    if (self%is_held) return
    self%is_held = .true.
    call self%add_parameter(share_name, spread(spread(1.0_wp, 1, self%lanes), 2, self%count), is_key=.false.)
    call self%prepare_law()
  end subroutine hold_speed

  pure logical function follows_supply(self)
    class(flux_motors_t), intent(in) :: self

    follows_supply = self%is_held
  end function follows_supply

  subroutine set_supply(self, share)
    class(flux_motors_t), intent(inout) :: self
    real(wp), intent(in) :: share   !! of the frequency in the input

    self%parameters(self%number_of(share_name))%value(1, :) = share
  end subroutine set_supply

  pure real(wp) function idle_supply(self, element, speed)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: speed    !! u' [rad/s]

    associate (circuit => self%circuit(1, element))
      idle_supply = 1.0_wp - circuit%slip(self%direction_of(element) * speed)
    end associate
  end function idle_supply

  !> The synchronous speed, and the ones of the largest steady torque as a motor and as a generator.
  function extremes(self, element, t) result(speeds)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)
    type(induction_circuit_t) :: circuit

    circuit = self%circuit(1, element)
    associate (synchronous => self%direction_of(element) * circuit%frequency / circuit%pole_pairs)
      speeds = synchronous * (1.0_wp + circuit%breakdown_slip() * [-1.0_wp, 0.0_wp, 1.0_wp])
    end associate
  end function extremes

  !> Torque, and the current of the stator.
  subroutine quantities(self, columns)
    class(flux_motors_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    allocate (columns(2))
    columns(1) = new_quantity('torque', 'N m', [(e, e=1, self%count)], 'torque on the body', 'with a positive speed', &
                              rank_torque, form_applied, 1.0_wp)
    columns(2) = new_quantity('current', 'A', columns(1)%elements, 'line current (rms)', '', rank_current, form_observed, 1.0_wp)
  end subroutine quantities

  !> The current of the stator of one motor in one lane [A].
  pure complex(wp) function stator_current(self, lane, element, flux)
    class(flux_motors_t), intent(in) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: element       !! numbered within the bank
    complex(wp), intent(in) :: flux(:)   !! of the stator and of each cage [V s]
    type(induction_circuit_t) :: circuit

    circuit = self%circuit(lane, element)
    stator_current = circuit%stator_current(flux)
  end function stator_current

  pure subroutine observe(self, elements, quantity, lane, values)
    class(flux_motors_t), intent(in) :: self
    type(element_values_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! index in `quantities`
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]; the current is the one of a line, rms
    integer, parameter :: most_fluxes = 3   ! an array whose size is not known is allocated
    complex(wp) :: flux(most_fluxes)
    integer :: e, k, first

    if (quantity /= 2) error stop 'nocdyn_flux_motors: the current is the quantity without a form'
    do e = 1, size(values)
      do k = 1, self%states / 2
        first = self%first_internal + self%states * (e - 1) + 2 * (k - 1)
        flux(k) = cmplx(elements%internal%value(lane, first), elements%internal%value(lane, first + 1), wp)
      end do
      values(e) = sqrt(0.5_wp) * abs(self%stator_current(lane, e, flux(:self%states / 2)))
    end do
  end subroutine observe

end module nocdyn_flux_motors
