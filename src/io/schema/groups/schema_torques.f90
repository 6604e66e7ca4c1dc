!> Rows of the schema: the torques &motor, &load, &excitation and &engine.
module nocdyn_schema_torques
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_body, a_file, a_flag, a_name, a_number, a_selector, a_text, a_word, above_1, allowed_t, &
    an_integer, any_number, any_times, anything, at_most_one, columns, efficiencies, equal_lengths, exactly_one, example_t, &
    extrapolations, from_0_to_1, from_1, from_2, group_rule_t, in_torques, interpolations, key_rule_t, kind_rule_t, less_than, &
    linear, not_negative, not_zero, positive, relation_rule_t, required, requires, strokes, unset, up_to_64
  implicit none (type, external)
  private

  type(allowed_t), parameter :: faults = allowed_t(words='three_phase two_phase resynchronisation')
  character(len=*), parameter :: governed = 'quadratic constant table induction dc inverter'   ! kinds with a governor
  type(allowed_t), parameter :: one_or_two = allowed_t(low=1.0_wp, high=2.0_wp)
  type(allowed_t), parameter :: above_minus_1 = allowed_t(low=-1.0_wp)
  type(allowed_t), parameter :: works = allowed_t(words='engine compressor')

  type(group_rule_t), parameter, public :: torque_groups(*) = [ &
    group_rule_t('motor', in_torques, any_times, 'torque', 'A driving torque on a body, by a law of its speed.'), &
    group_rule_t('load', in_torques, any_times, 'torque', 'A resisting torque on a body: the sum of the terms that are given.'), &
    group_rule_t('excitation', in_torques, any_times, 'torque', 'A torque on a body, by a law of time or of its angle.'), &
    group_rule_t('engine', in_torques, any_times, 'torque', &
                 'The torques of the cylinders of an engine or a compressor, on its cranks.')]

  type(kind_rule_t), parameter, public :: torque_kinds(*) = [ &
    kind_rule_t('motor',      'quadratic', 'a - b omega - c omega^2'), &
    kind_rule_t('motor',      'constant',  'the same torque at every speed'), &
    kind_rule_t('motor',      'table',     'torque over speed from a table'), &
    kind_rule_t('motor',      'induction', '2 T_k / (s/s_k + s_k/s), slip s = 1 - omega/synchronous_speed (Kloss)'), &
    kind_rule_t('motor',      'induction_dq', 'induction machine with electrical transients, by its equivalent circuit'), &
    kind_rule_t('motor',      'dc',        'flux_constant i; inductance di/dt = voltage - resistance i - flux_constant omega'), &
    kind_rule_t('motor',      'inverter',  'speed control: torque_limit times the throttle of a governor, -1 to 1'), &
    kind_rule_t('motor',      'synchronous', 'start by the cage: mean torque, and pulsation at twice the slip frequency'), &
    kind_rule_t('excitation', 'harmonic',  'amplitude sin(frequency t + phase)'), &
    kind_rule_t('excitation', 'orders',    'the sum of amplitude_k sin(order_k phi + phase_k), phi the angle of the body'), &
    kind_rule_t('excitation', 'table',     'torque over time from a table; constant before and after it'), &
    kind_rule_t('excitation', 'step',      '0 before time, amplitude from then on'), &
    kind_rule_t('excitation', 'ramp',      'linear rise from 0 at time to amplitude within duration, then constant'), &
    kind_rule_t('excitation', 'pulse',     'half a sine of height amplitude from time to time + duration'), &
    kind_rule_t('excitation', 'startup',   'amplitude sin(2 (frequency t - pole_pairs phi) + phase), synchronous motor'), &
    kind_rule_t('excitation', 'external',  'what the program that runs the machine sets (nocdyn.h), amplitude until then'), &
    kind_rule_t('excitation', 'fault',     'decaying sines from time on: short circuits, faulty synchronisation')]

  type(key_rule_t), parameter, public :: torque_keys(*) = [ &
    key_rule_t('motor', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('motor', 'body', a_body, 1, '', required, anything, 'the driven body'), &
    key_rule_t('motor', 'kind', a_selector, 1, '', "'quadratic'", anything, &
      'which law the torque follows; omega is the speed of the body'), &
    key_rule_t('motor', 'a', a_number, 1, 'N m', required, anything, 'torque at standstill', 'quadratic'), &
    key_rule_t('motor', 'b', a_number, 1, 'N m s/rad', required, anything, 'decrease of the torque per speed', 'quadratic'), &
    key_rule_t('motor', 'c', a_number, 1, 'N m s2/rad2', required, anything, &
      'decrease of the torque per square of the speed', 'quadratic'), &
    key_rule_t('motor', 'torque', a_number, 1, 'N m', required, anything, 'the torque', 'constant'), &
    key_rule_t('motor', 'table_speed', a_number, any_number, 'rad/s', unset, anything, &
      'speeds of the points of a table, ascending', 'table', fewest=2, ascends=.true.), &
    key_rule_t('motor', 'table_torque', a_number, any_number, 'N m', unset, anything, &
      'torque at these speeds', 'table', fewest=2), &
    key_rule_t('motor', 'table_file', a_file, 1, '', unset, anything, &
      'two columns, speed [rad/s] and torque [N m]; synchronous: slip, d_torque, q_torque, ...', 'table synchronous'), &
    key_rule_t('motor', 'interpolation', a_word, 1, '', linear, interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland', 'table'), &
    key_rule_t('motor', 'extrapolation', a_word, 1, '', linear, extrapolations, &
      'beyond the table: straight on with the end slope, or constant', 'table'), &
    key_rule_t('motor', 'breakdown_torque', a_number, 1, 'N m', required, not_zero, &
      'T_k, the largest torque; it has the sign of synchronous_speed', 'induction'), &
    key_rule_t('motor', 'breakdown_slip', a_number, 1, '', required, positive, &
      's_k, the slip of the largest torque', 'induction'), &
    key_rule_t('motor', 'synchronous_speed', a_number, 1, 'rad/s', required, not_zero, 'speed without slip', 'induction'), &
    key_rule_t('motor', 'voltage', a_number, 1, 'V', required, anything, &
      'of the supply; of mains between lines, rms; on a name plate the rated one (supply_factors)', 'induction_dq dc'), &
    key_rule_t('motor', 'frequency', a_number, 1, 'rad/s', required, positive, &
      'angular frequency of the mains', 'induction_dq synchronous'), &
    key_rule_t('motor', 'poles', an_integer, 1, '', unset, from_2, &
      'number of poles, even; the synchronous speed is 2 frequency / poles', 'induction_dq inverter synchronous', &
      required_if='induction_dq'), &
    key_rule_t('motor', 'reversed', a_flag, 1, '', '.false.', anything, &
      'whether the field turns backwards, as with two lines exchanged', 'induction_dq synchronous'), &
    key_rule_t('motor', 'stator_resistance', a_number, 1, 'Ohm', required, not_negative, &
      'of a phase of the star; of a delta winding a third, as of all values below', 'induction_dq'), &
    key_rule_t('motor', 'rotor_resistance', a_number, 1, 'Ohm', required, positive, &
      'of a phase of the rotor, referred to the stator', 'induction_dq'), &
    key_rule_t('motor', 'stator_leakage', a_number, 1, 'H', required, not_negative, &
      'leakage inductance of a phase of the stator', 'induction_dq'), &
    key_rule_t('motor', 'rotor_leakage', a_number, 1, 'H', required, positive, &
      'leakage inductance of a phase of the rotor, referred to the stator', 'induction_dq'), &
    key_rule_t('motor', 'mutual_inductance', a_number, 1, 'H', required, positive, 'magnetising inductance', 'induction_dq'), &
    key_rule_t('motor', 'stator_reactance', a_number, 1, 'Ohm', required, not_negative, &
      'leakage reactance of a phase of the stator at the frequency', 'induction_dq'), &
    key_rule_t('motor', 'rotor_reactance', a_number, 1, 'Ohm', required, positive, &
      'leakage reactance of a phase of the rotor at the frequency, referred to the stator', 'induction_dq'), &
    key_rule_t('motor', 'mutual_reactance', a_number, 1, 'Ohm', required, positive, &
      'magnetising reactance at the frequency', 'induction_dq'), &
    key_rule_t('motor', 'outer_resistance', a_number, 1, 'Ohm', unset, positive, &
      'of the outer cage beside the inner one, whose are the values of the rotor; deep bars', 'induction_dq'), &
    key_rule_t('motor', 'outer_leakage', a_number, 1, 'H', unset, positive, &
      'leakage inductance of the outer cage, referred to the stator', 'induction_dq'), &
    key_rule_t('motor', 'outer_reactance', a_number, 1, 'Ohm', unset, positive, &
      'leakage reactance of the outer cage at the frequency, referred to the stator', 'induction_dq'), &
    key_rule_t('motor', 'rated_power', a_number, 1, 'W', required, positive, &
      'power at the shaft on the name plate, from which the circuit follows with the values below', 'induction_dq'), &
    key_rule_t('motor', 'rated_speed', a_number, 1, 'rad/s', required, positive, &
      'speed on the name plate, below the synchronous speed', 'induction_dq'), &
    key_rule_t('motor', 'efficiency', a_number, 1, '', required, efficiencies, &
      'efficiency on the name plate, 0 to 1', 'induction_dq'), &
    key_rule_t('motor', 'power_factor', a_number, 1, '', required, efficiencies, 'cos phi on the name plate', 'induction_dq'), &
    key_rule_t('motor', 'breakdown_ratio', a_number, 1, '', required, above_1, &
      'breakdown torque over the rated torque, of the data sheet', 'induction_dq'), &
    key_rule_t('motor', 'starting_torque', a_number, 1, '', unset, positive, &
      'starting torque over the rated torque: compared with one cage, fitted with two', 'induction_dq'), &
    key_rule_t('motor', 'starting_current', a_number, 1, '', unset, positive, &
      'starting current over the rated current: compared with one cage, fitted with two', 'induction_dq'), &
    key_rule_t('motor', 'cages', an_integer, 1, '', '1', one_or_two, &
      'of the circuit from the name plate; 2: its outer cage gives starting torque and current', 'induction_dq'), &
    key_rule_t('motor', 'supply_times', a_number, any_number, 's', unset, anything, &
      'times at which the supply changes; before the first one the motor is disconnected', 'induction_dq', 1, ascends=.true.), &
    key_rule_t('motor', 'supply_factors', a_number, any_number, '', unset, not_negative, &
      'share of the voltage from each of these times on, 0: disconnected; without times it is 1', 'induction_dq', 1), &
    key_rule_t('motor', 'supply_ramps', a_number, any_number, 's', '0', not_negative, &
      'time in which the share changes evenly, from each of these times', 'induction_dq', 1), &
    key_rule_t('motor', 'resistance', a_number, 1, 'Ohm', required, positive, 'resistance of the armature', 'dc'), &
    key_rule_t('motor', 'flux_constant', a_number, 1, 'V s/rad', required, not_zero, &
      'torque per current, which is voltage per speed', 'dc'), &
    key_rule_t('motor', 'inductance', a_number, 1, 'H', '0', not_negative, &
      'inductance of the armature; 0: the current has no delay', 'dc'), &
    key_rule_t('motor', 'torque_limit', a_number, 1, 'N m', required, positive, &
      'largest torque that the control gives, in both directions', 'inverter'), &
    key_rule_t('motor', 'harmonics', a_number, any_number, '', unset, positive, &
      'multiples of the electrical frequency, poles / 2 times the speed, in the torque', 'inverter', 1), &
    key_rule_t('motor', 'harmonic_shares', a_number, any_number, '', unset, anything, &
      'amplitude of each as a share of the present control torque', 'inverter', 1), &
    key_rule_t('motor', 'harmonic_torques', a_number, any_number, 'N m', unset, anything, 'amplitude of each', 'inverter', 1), &
    key_rule_t('motor', 'harmonic_phases', a_number, any_number, 'rad', '0', anything, &
      'phase of each where the angle of the body is 0', 'inverter', 1), &
    key_rule_t('motor', 'slips', a_number, any_number, '', unset, not_negative, &
      'slips of the points of a table, ascending: 0 at the synchronous speed, 1 at standstill', 'synchronous', 2, &
      ascends=.true.), &
    key_rule_t('motor', 'd_torques', a_number, any_number, 'N m', unset, anything, &
      'torque at these slips with the circuits of the d axis on both axes', 'synchronous', 2), &
    key_rule_t('motor', 'q_torques', a_number, any_number, 'N m', unset, anything, &
      'the same of the q axis; the mean is (d + q) / 2, the pulsation (d - q) / 2', 'synchronous', 2), &
    key_rule_t('motor', 'mean_torques', a_number, any_number, 'N m', unset, anything, &
      'mean torque at these slips', 'synchronous', 2), &
    key_rule_t('motor', 'pulsations', a_number, any_number, 'N m', unset, anything, &
      'amplitude of the pulsation at these slips', 'synchronous', 2), &
    key_rule_t('motor', 'phase', a_number, 1, 'rad', '0', anything, &
      'pulsation sin(2 (frequency t - poles / 2 phi) + phase), phi the angle of the body', 'synchronous'), &
    key_rule_t('motor', 'governor_speed', a_number, 1, 'rad/s', unset, anything, &
      'speed that a PI governor keeps by a throttle from 0 to 1 on the torque (dc: on the voltage)', governed), &
    key_rule_t('motor', 'governor_gain', a_number, 1, 's/rad', unset, not_zero, &
      'throttle = z + governor_gain (governor_speed - omega); gain < 0 if the motor turns backwards', governed, &
      required_if='inverter'), &
    key_rule_t('motor', 'governor_time', a_number, 1, 's', unset, positive, &
      'integral time: z'' = (throttle - z) / governor_time', governed, required_if='inverter'), &
    key_rule_t('motor', 'governor_start', a_number, 1, '', '1', from_0_to_1, &
      'throttle at t_start; that of an inverter is 0', 'quadratic constant table induction dc'), &
    key_rule_t('motor', 'set_times', a_number, any_number, 's', unset, anything, &
      'times of points between which the set speed changes evenly, instead of governor_speed', governed, 1, ascends=.true.), &
    key_rule_t('motor', 'set_speeds', a_number, any_number, 'rad/s', unset, anything, &
      'set speed at these times; constant before and after them', governed, 1), &
    key_rule_t('load', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('load', 'body', a_body, 1, '', required, anything, 'the braked body'), &
    key_rule_t('load', 'viscous', a_number, 1, 'N m s/rad', '0', not_negative, 'torque per speed'), &
    key_rule_t('load', 'quadratic', a_number, 1, 'N m s2/rad2', '0', not_negative, &
      'torque per square of the speed, against the motion: fan, propeller'), &
    key_rule_t('load', 'constant', a_number, 1, 'N m', '0', not_negative, &
      'torque against the motion: constant tanh(omega / constant_speed)'), &
    key_rule_t('load', 'constant_speed', a_number, 1, 'rad/s', '0.01', positive, &
      'speed at which the constant torque has 76 % of its full value'), &
    key_rule_t('load', 'vibration_damping', a_number, 1, 'N m s/rad', unset, not_negative, &
      'of vibrations about the mean rotation, in place of the slope of the torque over the speed'), &
    key_rule_t('load', 'vibration_factor', a_number, 1, '', unset, not_negative, &
      'the same as a multiple of mean torque over mean speed; the slope of a quadratic torque is 2'), &
    key_rule_t('load', 'mean_time', a_number, 1, 's', '1', positive, &
      'time over which a run finds the mean rotation; much longer than a vibration'), &
    key_rule_t('load', 'table_speed', a_number, any_number, 'rad/s', unset, anything, &
      'speeds of the points of a table, ascending', fewest=2, ascends=.true.), &
    key_rule_t('load', 'table_torque', a_number, any_number, 'N m', unset, anything, &
      'resisting torque at these speeds; positive resists a positive speed', fewest=2), &
    key_rule_t('load', 'table_file', a_file, 1, '', unset, anything, &
      'file with the table: two columns, speed [rad/s] and resisting torque [N m]'), &
    key_rule_t('load', 'interpolation', a_word, 1, '', linear, interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland'), &
    key_rule_t('load', 'extrapolation', a_word, 1, '', linear, extrapolations, &
      'beyond the table: straight on with the end slope, or constant'), &
    key_rule_t('excitation', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('excitation', 'body', a_body, 1, '', required, anything, 'the excited body'), &
    key_rule_t('excitation', 'kind', a_selector, 1, '', "'harmonic'", anything, 'which law the torque follows'), &
    key_rule_t('excitation', 'amplitude', a_number, 1, 'N m', required, anything, &
      'largest torque', 'harmonic step ramp pulse startup external'), &
    key_rule_t('excitation', 'frequency', a_number, 1, 'rad/s', required, not_negative, &
      'angular frequency; that of the mains for a start-up and a fault', 'harmonic startup fault'), &
    key_rule_t('excitation', 'phase', a_number, 1, 'rad', '0', anything, 'phase at t = 0', 'harmonic startup'), &
    key_rule_t('excitation', 'orders', a_number, any_number, '', unset, positive, &
      'oscillations per turn of the body, e.g. 0.5, 1, 1.5 of a four-stroke engine', 'orders', 1), &
    key_rule_t('excitation', 'amplitudes', a_number, any_number, 'N m', unset, anything, &
      'largest torque of each order', 'orders', 1), &
    key_rule_t('excitation', 'phases', a_number, any_number, 'rad', '0', anything, &
      'phase of each order at phi = 0', 'orders', 1), &
    key_rule_t('excitation', 'speeds', a_number, any_number, 'rad/s', unset, anything, &
      'speed at which each row of orders, amplitudes and phases holds', 'orders', 1), &
    key_rule_t('excitation', 'share_of_load', a_number, any_number, '', unset, anything, &
      'amplitude of each order as a share of the torque of a load at its present speed', 'orders', 1), &
    key_rule_t('excitation', 'load', a_text, 1, '', unset, anything, 'name of that load, if the body has several', 'orders'), &
    key_rule_t('excitation', 'table_time', a_number, any_number, 's', unset, anything, &
      'times of the points of a table, ascending', 'table', fewest=2, ascends=.true.), &
    key_rule_t('excitation', 'table_torque', a_number, any_number, 'N m', unset, anything, &
      'torque at these times', 'table', fewest=2), &
    key_rule_t('excitation', 'table_file', a_file, 1, '', unset, anything, &
      'two columns, time [s] and torque [N m]; orders: order, amplitude, phase_deg, speed_rpm', 'table orders'), &
    key_rule_t('excitation', 'measurement', a_text, 1, '', unset, anything, &
      'in place of the table: name of a &measurement of a torque over the time', 'table'), &
    key_rule_t('excitation', 'interpolation', a_word, 1, '', linear, interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland', 'table'), &
    key_rule_t('excitation', 'time', a_number, 1, 's', required, anything, &
      'start of the step, ramp, pulse or fault', 'step ramp pulse fault'), &
    key_rule_t('excitation', 'duration', a_number, 1, 's', required, positive, &
      'duration of the rise or of the pulse', 'ramp pulse'), &
    key_rule_t('excitation', 'pole_pairs', an_integer, 1, '', required, from_1, 'pole pairs of the motor', 'startup'), &
    key_rule_t('excitation', 'fault', a_word, 1, '', unset, faults, &
      'at the terminals of a machine at rated voltage; resynchronisation closes with a phase angle', 'fault'), &
    key_rule_t('excitation', 'rated_torque', a_number, 1, 'N m', unset, not_zero, &
      'rated apparent power / synchronous speed; > 0: brakes a body that turns forwards first', 'fault'), &
    key_rule_t('excitation', 'subtransient_reactance', a_number, 1, '', unset, positive, &
      'x'''' per unit, with that of the network up to the fault', 'fault'), &
    key_rule_t('excitation', 'transient_reactance', a_number, 1, '', unset, positive, &
      'x'' per unit; without it subtransient_time is the only time constant of the rotor', 'fault'), &
    key_rule_t('excitation', 'synchronous_reactance', a_number, 1, '', unset, positive, &
      'x per unit, of the current that remains; infinite if not given: the torque decays to 0', 'fault'), &
    key_rule_t('excitation', 'subtransient_time', a_number, 1, 's', unset, positive, &
      'time constant T'''' of the short circuit of all phases; no decay if not given', 'fault'), &
    key_rule_t('excitation', 'transient_time', a_number, 1, 's', unset, positive, &
      'time constant T'' beside transient_reactance; no decay if not given', 'fault'), &
    key_rule_t('excitation', 'armature_time', a_number, 1, 's', unset, positive, &
      'time constant T_a of the stator''s flux; no decay if not given', 'fault'), &
    key_rule_t('excitation', 'angle', a_number, 1, 'rad', '2.0943951024', anything, &
      'phase angle of a resynchronisation; 120 degrees give the largest torque', 'fault'), &
    key_rule_t('excitation', 'term_amplitudes', a_number, any_number, 'N m', unset, anything, &
      'amplitudes of given decaying sines, in place of fault', 'fault', 1), &
    key_rule_t('excitation', 'term_multiples', a_number, any_number, '', unset, not_negative, &
      'their frequencies as multiples of frequency', 'fault', 1), &
    key_rule_t('excitation', 'term_times', a_number, any_number, 's', unset, positive, &
      'their time constants; no decay if not given', 'fault', 1), &
    key_rule_t('excitation', 'term_phases', a_number, any_number, 'rad', unset, anything, &
      'their phases at the time of the fault; 0 if not given', 'fault', 1), &
    key_rule_t('excitation', 'start', a_number, 1, 's', unset, anything, &
      'the torque is 0 before; time, or t_start of &run, if not given'), &
    key_rule_t('excitation', 'end', a_number, 1, 's', unset, anything, 'the torque is 0 from then on'), &
    key_rule_t('excitation', 'decay', a_number, 1, 's', unset, positive, &
      'time constant: the torque is multiplied by exp(-(t - start) / decay)')]

  ! A statement has at most 255 continued lines.
  type(key_rule_t), parameter, public :: engine_keys(*) = [ &
    key_rule_t('engine', 'name', a_name, 1, '', required, anything, &
      'name in results and messages; its cylinders are NAME_1, NAME_2, ...'), &
    key_rule_t('engine', 'cylinders', a_body, any_number, '', required, anything, &
      'the crank of each cylinder; two cylinders of a V engine may share one', fewest=1, may_repeat=.true.), &
    key_rule_t('engine', 'works', a_word, 1, '', "'engine'", works, &
      'torques of an engine drive, of a compressor resist; pressures have one sign'), &
    key_rule_t('engine', 'stroke', an_integer, 1, '', required, strokes, &
      '4: each cylinder fires every other turn; 2: every turn'), &
    key_rule_t('engine', 'firing', a_number, any_number, 'rad', required, not_negative, &
      'angle of its crank at which each cylinder fires, at top dead centre', fewest=1), &
    key_rule_t('engine', 'orders', a_number, any_number, '', unset, not_negative, &
      'orders of the gas torque of one cylinder; 0: its mean', fewest=1), &
    key_rule_t('engine', 'amplitudes', a_number, any_number, 'N m', unset, anything, &
      'amplitude of each order: amplitude sin(order (phi - firing) + phase)', fewest=1), &
    key_rule_t('engine', 'phases', a_number, any_number, 'rad', '0', anything, 'phase of each order when the cylinder fires'), &
    key_rule_t('engine', 'speeds', a_number, any_number, 'rad/s', unset, anything, &
      'speed at which each row of orders, amplitudes and phases holds', fewest=1), &
    key_rule_t('engine', 'loads', a_number, any_number, '', unset, anything, &
      'load of the engine at which each row holds, e.g. 0.5 for half', fewest=1), &
    key_rule_t('engine', 'misfire_amplitudes', a_number, any_number, 'N m', unset, anything, &
      'amplitude of each order of a cylinder that does not fire', fewest=1), &
    key_rule_t('engine', 'misfire_phases', a_number, any_number, 'rad', unset, anything, &
      'phase of each order of such a cylinder', fewest=1), &
    key_rule_t('engine', 'table_file', a_file, 1, '', unset, anything, &
      'file with the columns order, amplitude, phase_deg, perhaps speed_rpm, load'), &
    key_rule_t('engine', 'load_share', a_number, 1, '', unset, anything, &
      'load of the engine: the torque is interpolated between the loads'), &
    key_rule_t('engine', 'mean_torque', a_number, 1, 'N m', unset, anything, &
      'mean gas torque of all cylinders together; each one has an equal part'), &
    key_rule_t('engine', 'crank_angles', a_number, any_number, 'rad', unset, anything, &
      'angles of the crank over one cycle, ascending; 0: top dead centre of firing', fewest=8, ascends=.true.), &
    key_rule_t('engine', 'pressures', a_number, any_number, 'Pa', unset, anything, &
      'pressure in a cylinder at these angles', fewest=8), &
    key_rule_t('engine', 'misfire_pressures', a_number, any_number, 'Pa', unset, anything, &
      'pressure in a cylinder that does not fire', fewest=8), &
    key_rule_t('engine', 'pressure_file', a_file, 1, '', unset, anything, &
      'file with the columns crank_angle_deg, pressure, perhaps misfire_pressure'), &
    key_rule_t('engine', 'torques', a_number, any_number, 'N m', unset, anything, &
      'in place of pressures: torque of a cylinder on its crank at these angles (crank effort)', fewest=8), &
    key_rule_t('engine', 'misfire_torques', a_number, any_number, 'N m', unset, anything, &
      'torque of a cylinder that does not fire', fewest=8), &
    key_rule_t('engine', 'torque_file', a_file, 1, '', unset, anything, &
      'file with the columns crank_angle_deg, torque, perhaps misfire_torque'), &
    key_rule_t('engine', 'crankcase_pressure', a_number, 1, 'Pa', '0', not_negative, &
      'pressure below the pistons; 0 if pressures are above that of the atmosphere'), &
    key_rule_t('engine', 'harmonics_up_to', a_number, 1, '', '24', up_to_64, &
      'highest order that is taken from pressures or torques'), &
    key_rule_t('engine', 'bore', a_number, 1, 'm', unset, positive, 'diameter of the pistons'), &
    key_rule_t('engine', 'crank_radius', a_number, 1, 'm', unset, positive, 'half the travel of the pistons'), &
    key_rule_t('engine', 'rod_length', a_number, 1, 'm', unset, positive, 'length of the connecting rods'), &
    key_rule_t('engine', 'offset', a_number, 1, 'm', '0', anything, &
      'distance of the line of the pistons from the axis of the crank, as in &crank'), &
    key_rule_t('engine', 'reciprocating_mass', a_number, 1, 'kg', unset, not_negative, &
      'mass that moves with one piston; its inertia torque has all orders of the slider-crank'), &
    key_rule_t('engine', 'vibration_damping', a_number, 1, 'N m s/rad', unset, not_negative, &
      'of the vibration about the mean rotation, at each cylinder'), &
    key_rule_t('engine', 'magnifier', a_number, 1, '', unset, positive, &
      'the same: inertia of a crank times damping_frequency over it'), &
    key_rule_t('engine', 'damping_frequency', a_number, 1, 'rad/s', unset, positive, &
      'frequency at which the damping has this magnifier'), &
    key_rule_t('engine', 'mean_time', a_number, 1, 's', '1', positive, &
      'time over which a run finds the mean rotation; much longer than a vibration'), &
    key_rule_t('engine', 'misfire', an_integer, 1, '', '0', not_negative, &
      'number of a cylinder that does not fire, 0: all fire'), &
    key_rule_t('engine', 'cylinder_scatter', a_number, any_number, '', unset, above_minus_1, &
      'relative difference of the gas torque of each cylinder; one value: + and - in turn')]

  type(relation_rule_t), parameter, public :: torque_relations(*) = [ &
    relation_rule_t('motor', exactly_one, 'table_speed table_torque', 'table_file'), &
    relation_rule_t('load', at_most_one, 'table_speed table_torque', 'table_file'), &
    relation_rule_t('excitation', exactly_one, 'orders', 'table_file'), &
    relation_rule_t('excitation', at_most_one, 'table_file', 'amplitudes phases speeds share_of_load'), &
    relation_rule_t('excitation', exactly_one, 'amplitudes', 'share_of_load'), &
    relation_rule_t('excitation', at_most_one, 'share_of_load', 'speeds'), &
    relation_rule_t('excitation', requires, 'load', 'share_of_load'), &
    relation_rule_t('excitation', exactly_one, 'table_time table_torque', 'table_file measurement'), &
    relation_rule_t('excitation', at_most_one, 'table_file', 'measurement'), &
    relation_rule_t('motor', exactly_one, 'stator_resistance rotor_resistance stator_leakage rotor_leakage ' // &
                    'mutual_inductance stator_reactance rotor_reactance mutual_reactance', &
                    'rated_power rated_speed efficiency power_factor breakdown_ratio'), &
    relation_rule_t('motor', requires, 'starting_torque starting_current cages', 'rated_power'), &
    relation_rule_t('motor', exactly_one, 'stator_leakage rotor_leakage mutual_inductance', &
                    'stator_reactance rotor_reactance mutual_reactance'), &
    relation_rule_t('motor', requires, 'outer_resistance outer_leakage outer_reactance', 'rotor_resistance'), &
    relation_rule_t('motor', requires, 'outer_resistance', 'outer_leakage outer_reactance'), &
    relation_rule_t('motor', requires, 'outer_leakage outer_reactance', 'outer_resistance'), &
    relation_rule_t('motor', at_most_one, 'outer_leakage', 'outer_reactance'), &
    relation_rule_t('motor', requires, 'supply_factors supply_ramps', 'supply_times'), &
    relation_rule_t('motor', exactly_one, 'slips d_torques q_torques mean_torques pulsations', 'table_file'), &
    relation_rule_t('motor', at_most_one, 'd_torques q_torques', 'mean_torques pulsations'), &
    relation_rule_t('motor', requires, 'd_torques q_torques mean_torques pulsations', 'slips'), &
    relation_rule_t('motor', requires, 'frequency', 'poles'), &
    relation_rule_t('motor', requires, 'harmonics', 'poles'), &
    relation_rule_t('motor', requires, 'harmonic_shares harmonic_torques harmonic_phases', 'harmonics'), &
    relation_rule_t('motor', exactly_one, 'harmonic_shares', 'harmonic_torques'), &
    relation_rule_t('motor', at_most_one, 'governor_speed', 'set_times set_speeds'), &
    relation_rule_t('motor', requires, 'governor_speed set_times', 'governor_gain'), &
    relation_rule_t('motor', requires, 'governor_speed set_times', 'governor_time'), &
    relation_rule_t('motor', requires, 'governor_gain governor_time governor_start', 'governor_speed set_times'), &
    relation_rule_t('motor', requires, 'set_speeds', 'set_times'), &
    relation_rule_t('load', at_most_one, 'vibration_damping', 'vibration_factor'), &
    relation_rule_t('load', at_most_one, 'vibration_damping vibration_factor', 'constant'), &
    relation_rule_t('load', requires, 'mean_time', 'vibration_damping vibration_factor'), &
    relation_rule_t('load', requires, 'constant_speed', 'constant'), &
    relation_rule_t('load', requires, 'interpolation extrapolation', 'table_speed table_file'), &
    relation_rule_t('motor', equal_lengths, 'table_speed table_torque', 'table_file'), &
    relation_rule_t('motor', columns, 'slips', 'table_file d_torques q_torques mean_torques pulsations'), &
    relation_rule_t('motor', equal_lengths, 'set_times set_speeds', ''), &
    relation_rule_t('motor', equal_lengths, 'harmonics harmonic_shares harmonic_torques harmonic_phases', ''), &
    relation_rule_t('motor', equal_lengths, 'supply_times supply_factors supply_ramps', ''), &
    relation_rule_t('load', equal_lengths, 'table_speed table_torque', 'table_file'), &
    relation_rule_t('excitation', equal_lengths, 'table_time table_torque', 'table_file'), &
    relation_rule_t('excitation', columns, 'orders amplitudes phases', 'table_file speeds'), &
    relation_rule_t('excitation', equal_lengths, 'orders share_of_load', ''), &
    relation_rule_t('excitation', exactly_one, 'fault', 'term_amplitudes'), &
    relation_rule_t('excitation', requires, 'fault', 'rated_torque'), &
    relation_rule_t('excitation', requires, 'fault', 'subtransient_reactance'), &
    relation_rule_t('excitation', requires, 'rated_torque subtransient_reactance transient_reactance', 'fault'), &
    relation_rule_t('excitation', requires, 'subtransient_time armature_time synchronous_reactance', 'fault'), &
    relation_rule_t('excitation', requires, 'angle', 'fault', word='resynchronisation'), &
    relation_rule_t('excitation', requires, 'transient_time', 'transient_reactance'), &
    relation_rule_t('excitation', requires, 'term_amplitudes', 'term_multiples'), &
    relation_rule_t('excitation', requires, 'term_multiples term_times term_phases', 'term_amplitudes'), &
    relation_rule_t('excitation', equal_lengths, 'term_amplitudes term_multiples', ''), &
    relation_rule_t('excitation', less_than, 'start', 'end'), &
    relation_rule_t('excitation', less_than, 'time', 'end')]

  type(relation_rule_t), parameter, public :: engine_relations(*) = [ &
    relation_rule_t('engine', at_most_one, 'vibration_damping', 'magnifier damping_frequency'), &
    relation_rule_t('engine', requires, 'magnifier', 'damping_frequency'), &
    relation_rule_t('engine', requires, 'damping_frequency', 'magnifier'), &
    relation_rule_t('engine', requires, 'mean_time', 'vibration_damping magnifier'), &
    relation_rule_t('engine', at_most_one, 'table_file', &
                    'orders amplitudes phases speeds loads misfire_amplitudes misfire_phases'), &
    relation_rule_t('engine', at_most_one, 'pressure_file', 'crank_angles pressures misfire_pressures'), &
    relation_rule_t('engine', at_most_one, 'orders amplitudes phases table_file mean_torque', &
                    'crank_angles pressures pressure_file torques torque_file'), &
    relation_rule_t('engine', at_most_one, 'torque_file', 'crank_angles torques misfire_torques'), &
    relation_rule_t('engine', at_most_one, 'pressures pressure_file misfire_pressures', 'torques torque_file misfire_torques'), &
    relation_rule_t('engine', requires, 'load_share', 'loads table_file'), &
    relation_rule_t('engine', requires, 'misfire_phases', 'misfire_amplitudes'), &
    relation_rule_t('engine', requires, 'crank_angles', 'pressures torques'), &
    relation_rule_t('engine', requires, 'pressures pressure_file', 'bore'), &
    relation_rule_t('engine', requires, 'pressures pressure_file reciprocating_mass', 'crank_radius'), &
    relation_rule_t('engine', requires, 'pressures pressure_file reciprocating_mass', 'rod_length'), &
    relation_rule_t('engine', requires, 'bore crankcase_pressure', 'pressures pressure_file'), &
    relation_rule_t('engine', requires, 'harmonics_up_to', 'pressures pressure_file torques torque_file'), &
    relation_rule_t('engine', requires, 'crank_radius rod_length offset', 'pressures pressure_file reciprocating_mass'), &
    relation_rule_t('engine', less_than, 'crank_radius', 'rod_length'), &
    relation_rule_t('engine', equal_lengths, 'cylinders firing', ''), &
    relation_rule_t('engine', columns, 'orders amplitudes phases', 'table_file speeds loads misfire_amplitudes misfire_phases'), &
    relation_rule_t('engine', columns, 'crank_angles pressures', 'pressure_file misfire_pressures'), &
    relation_rule_t('engine', columns, 'crank_angles torques', 'torque_file misfire_torques')]

  type(example_t), parameter, public :: torque_examples(*) = [ &
    example_t('motor',      "name = 'drive'    body = 'motor'    a = 200.0  b = 10.0  c = 1.0"), &
    example_t('motor',      "name = 'mains'    body = 'motor'    kind = 'induction'|" // &
                            'breakdown_torque = 100.0  breakdown_slip = 0.2  synchronous_speed = 157.08', .false.), &
    example_t('motor',      "name = 'pump'     body = 'motor'    kind = 'induction_dq'|" // &
                            'voltage = 400  frequency_hz = 50  poles = 4|' // &
                            'stator_resistance = 0.4  rotor_resistance = 0.3|' // &
                            'stator_reactance = 0.9  rotor_reactance = 0.9  mutual_reactance = 25', .false.), &
    example_t('motor',      "name = 'diesel'   body = 'motor'    kind = 'table'|" // &
                            'table_speed = 60, 120, 180  table_torque = 250, 310, 270|' // &
                            'governor_speed = 150.0  governor_gain = 0.1  governor_time = 2.0', .false.), &
    example_t('motor',      "name = 'control'  body = 'motor'    kind = 'inverter'  torque_limit = 600.0|" // &
                            'set_times = 0, 10  set_speeds_rpm = 0, 1500  governor_gain = 0.1  governor_time = 0.5|' // &
                            'poles = 4  harmonics = 6, 12  harmonic_shares = 0.02, 0.01', .false.), &
    example_t('motor',      "name = 'start'    body = 'motor'    kind = 'synchronous'  frequency_hz = 50  poles = 4|" // &
                            'slips = 0, 0.05, 0.5, 1  d_torques = 0, 900, 700, 600  q_torques = 0, 700, 400, 300', .false.), &
    example_t('load',       "name = 'work'     body = 'machine'  viscous = 100.0"), &
    example_t('load',       "name = 'fan'      body = 'machine'  quadratic = 0.01  constant = 2.0", .false.), &
    example_t('excitation', "name = 'shaker'   body = 'motor'    amplitude = 20.0  frequency = 5.0"), &
    example_t('excitation', "name = 'engine'   body = 'motor'    kind = 'orders'|" // &
                            'orders = 2, 4, 6  amplitudes = 90.0, 40.0, 15.0', .false.), &
    example_t('excitation', "name = 'blow'     body = 'machine'  kind = 'pulse'|" // &
                            'amplitude = -500.0  time = 2.0  duration = 0.05', .false.), &
    example_t('engine',     "name = 'diesel'   cylinders = 'motor'  stroke = 4  firing_deg = 0|" // &
                             'orders = 0.5, 1, 1.5, 2  amplitudes = 90, 80, 60, 40  mean_torque = 30', .false.)]

end module nocdyn_schema_torques
