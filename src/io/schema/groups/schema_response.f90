!> Rows of the schema: the forced response and what is judged by it, &response, &limit, &fatigue and &transit;
!> the nonlinear one, &orbit.
module nocdyn_schema_response
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_body, a_file, a_flag, a_line_file, a_name, a_number, a_text, a_word, allowed_t, an_integer, &
    any_number, any_times, anything, at_most_once, at_most_one, equal_lengths, exactly_one, example_t, extrapolations, from_1, &
    group_rule_t, in_torsional, key_rule_t, linear, not_negative, not_zero, positive, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: speed_counts = allowed_t(low=2.0_wp, high=1.0e6_wp)
  type(allowed_t), parameter :: rules = allowed_t(words='iacs_m68 iacs_m53 kr_crankshaft kr_generator')
  type(allowed_t), parameter :: margin_rules = allowed_t(words='api_617')
  type(allowed_t), parameter :: formats = allowed_t(words='csv netcdf')
  type(allowed_t), parameter :: factors = allowed_t(low=0.1_wp, high=1.5_wp)
  type(allowed_t), parameter :: margins = allowed_t(low=0.0_wp, high=0.9_wp)
  type(allowed_t), parameter :: orbit_methods = allowed_t(words='harmonic_balance shooting')
  type(allowed_t), parameter :: subharmonics = allowed_t(low=1.0_wp, high=12.0_wp)
  type(allowed_t), parameter :: harmonic_counts = allowed_t(low=1.0_wp, high=400.0_wp)
  type(allowed_t), parameter :: shares = allowed_t(low=1.0e-12_wp, high=0.01_wp)
  type(allowed_t), parameter :: directions = allowed_t(words='any up down both')
  type(allowed_t), parameter :: mean_stresses = allowed_t(words='none goodman gerber soderberg')

  type(group_rule_t), parameter, public :: response_groups(*) = [ &
    group_rule_t('response', in_torsional, at_most_once, '', "Speeds and orders of 'nocdyn response' and 'nocdyn campbell'."), &
    group_rule_t('limit', in_torsional, any_times, '', &
                 'Limits of moments, stresses, forces and heat of a coupling, damper, shaft or mesh.'), &
    group_rule_t('fatigue', in_torsional, any_times, 'fatigue', &
                 'Cycles and damage of a coupling, shaft, mesh or gear, in runs and responses.'), &
    group_rule_t('orbit', in_torsional, at_most_once, '', &
                 "Periodic motions over a number of the input or a speed, for 'nocdyn orbit'."), &
    group_rule_t('transit', in_torsional, at_most_once, '', &
                 "A range of speeds that the run passes, for 'nocdyn transit'; &run says how.")]

  type(key_rule_t), parameter, public :: response_keys(*) = [ &
    key_rule_t('response', 'body', a_body, 1, '', unset, anything, &
      'the body whose speed is held, and to whose turns orders refer'), &
    key_rule_t('response', 'speed', a_number, any_number, 'rad/s', unset, not_zero, &
      'lowest and highest speed of this body, or one speed, with the sign of its steady speed', fewest=1), &
    key_rule_t('response', 'frequency', a_number, any_number, 'rad/s', unset, positive, &
      'in place of speeds: lowest and highest frequency of a shaker, a harmonic &excitation', fewest=1), &
    key_rule_t('response', 'excitation', a_text, 1, '', unset, anything, &
      'name of the shaker, if there are several harmonic excitations'), &
    key_rule_t('response', 'count', an_integer, 1, '', '201', speed_counts, &
      'number of speeds or frequencies from the lowest to the highest; peaks between them are found'), &
    key_rule_t('response', 'orders', a_number, any_number, '', unset, positive, &
      'oscillations per turn of the body; those of the excitations if not given', fewest=1), &
    key_rule_t('response', 'signals', a_text, any_number, '', unset, anything, &
      "quantities that are written: names, or patterns with *, e.g. 'stress_*'; all if not given", fewest=1), &
    key_rule_t('response', 'format', a_word, 1, '', "'csv'", formats, &
      'response.csv and response_orders.csv, or response.nc, which nocdyn-sweep writes'), &
    key_rule_t('response', 'operating', a_number, 2, 'rad/s', unset, not_zero, 'lowest and highest speed in operation'), &
    key_rule_t('response', 'margin', a_number, 1, '', '0.1', margins, &
      'a critical speed so near to the speeds in operation, as a share of it, is reported'), &
    key_rule_t('response', 'margin_rule', a_word, 1, '', unset, margin_rules, &
      'rule with the margin of critical speeds to the speeds in operation: api_617 asks for 10 %'), &
    key_rule_t('response', 'margin_rule_file', a_line_file, 1, '', unset, anything, 'file of a rule of your own with a margin'), &
    key_rule_t('response', 'margin_rule_lines', a_text, any_number, '', unset, anything, &
      'the lines of margin_rule_file, as an input that was written has them'), &
    key_rule_t('limit', 'coupling', a_text, 1, '', unset, anything, 'name of the coupling'), &
    key_rule_t('limit', 'damper', a_text, 1, '', unset, anything, 'name of the damper'), &
    key_rule_t('limit', 'shaft', a_text, 1, '', unset, anything, 'name of the shaft'), &
    key_rule_t('limit', 'mesh', a_text, 1, '', unset, anything, 'name of the mesh'), &
    key_rule_t('limit', 'vibratory_moment', a_number, 1, 'N m', unset, positive, &
      'half range of the moment in continuous operation'), &
    key_rule_t('limit', 'moment', a_number, 1, 'N m', unset, positive, 'largest magnitude of the moment, its mean included'), &
    key_rule_t('limit', 'vibratory_frequency', a_number, any_number, 'rad/s', unset, positive, &
      'frequencies of a curve of the moment, ascending', fewest=2, ascends=.true.), &
    key_rule_t('limit', 'vibratory_moments', a_number, any_number, 'N m', unset, positive, &
      'amplitude that each order may have at these frequencies; straight between them', fewest=2), &
    key_rule_t('limit', 'table_file', a_file, 1, '', unset, anything, &
      'two columns in place of both, frequency [rad/s] and moment [N m]'), &
    key_rule_t('limit', 'temperature', a_number, 1, 'degC', unset, anything, 'of the coupling, which lowers its moments'), &
    key_rule_t('limit', 'derating_temperatures', a_number, any_number, 'degC', unset, anything, &
      'temperatures of the factors of its moments, ascending', fewest=2, ascends=.true.), &
    key_rule_t('limit', 'derating_factors', a_number, any_number, '', unset, positive, &
      'factors of the limits of moments at these temperatures; straight between them', fewest=2), &
    key_rule_t('limit', 'heat', a_number, 1, 'W', unset, positive, &
      'mean power that the coupling or shaft loses by its oscillation'), &
    key_rule_t('limit', 'largest_temperature', a_number, 1, 'degC', unset, anything, &
      'permissible temperature of a rubber coupling that heats up'), &
    key_rule_t('limit', 'vibratory_force', a_number, 1, 'N', unset, positive, &
      'half range of the force of the mesh in continuous operation'), &
    key_rule_t('limit', 'force', a_number, 1, 'N', unset, positive, 'largest magnitude of this force, its mean included'), &
    key_rule_t('limit', 'stress', a_number, 1, 'Pa', unset, positive, 'half range of the shear stress in continuous operation'), &
    key_rule_t('limit', 'stress_transient', a_number, 1, 'Pa', unset, positive, &
      'half range of the shear stress at speeds that are passed through quickly'), &
    key_rule_t('limit', 'quantity', a_text, 1, '', unset, anything, &
      "another quantity of the element: a kind in columns.json, such as 'power' of a shaft"), &
    key_rule_t('limit', 'largest', a_number, 1, '', unset, positive, 'largest magnitude of the quantity, in its SI unit'), &
    key_rule_t('limit', 'vibratory', a_number, 1, '', unset, positive, &
      'half range of the quantity in continuous operation, in its SI unit'), &
    key_rule_t('limit', 'rule', a_word, 1, '', unset, rules, &
      'limits by a rule: iacs_m68 is IACS Unified Requirement M68 for propulsion shafts'), &
    key_rule_t('limit', 'rule_file', a_line_file, 1, '', unset, anything, 'file of a rule of your own'), &
    key_rule_t('limit', 'rule_lines', a_text, any_number, '', unset, anything, &
      'the lines of rule_file, as an input that was written has them'), &
    key_rule_t('limit', 'choices', a_text, any_number, '', unset, anything, &
      "words of the rule, such as 'propeller' for the kind of shaft", fewest=1), &
    key_rule_t('limit', 'tensile_strength', a_number, 1, 'Pa', unset, positive, &
      'specified minimum tensile strength sigma_B, for the rule'), &
    key_rule_t('limit', 'c_k', a_number, 1, '', unset, factors, &
      'factor of the shape of the shaft in the rule: 1 with integral flanges, 0.6 with keyways, ...'), &
    key_rule_t('limit', 'diameter', a_number, 1, 'm', unset, positive, &
      'outer diameter in the rule; that of the coupling if not given'), &
    key_rule_t('limit', 'rated_speed', a_number, 1, 'rad/s', unset, not_zero, &
      'rated speed of the body of &response, for the rule'), &
    key_rule_t('limit', 'rule_symbols', a_text, any_number, '', unset, anything, &
      'further symbols of the rule, as it calls them', fewest=1), &
    key_rule_t('limit', 'rule_values', a_number, any_number, '', unset, anything, &
      'their numbers, in the units of the rule', fewest=1), &
    key_rule_t('fatigue', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('fatigue', 'coupling', a_text, 1, '', unset, anything, 'name of the coupling'), &
    key_rule_t('fatigue', 'shaft', a_text, 1, '', unset, anything, 'name of the shaft; its worst section counts'), &
    key_rule_t('fatigue', 'mesh', a_text, 1, '', unset, anything, 'name of the mesh'), &
    key_rule_t('fatigue', 'gear', a_text, 1, '', unset, anything, 'name of the gear, with radii'), &
    key_rule_t('fatigue', 'reference_stress', a_number, 1, 'Pa', unset, positive, &
      'half range of the shear stress that reference_cycles cycles of it break'), &
    key_rule_t('fatigue', 'reference_moment', a_number, 1, 'N m', unset, positive, 'the same as a moment'), &
    key_rule_t('fatigue', 'reference_force', a_number, 1, 'N', unset, positive, 'the same as a tooth force'), &
    key_rule_t('fatigue', 'reference_cycles', a_number, 1, '', unset, positive, &
      'number of cycles of this point of the S-N curve'), &
    key_rule_t('fatigue', 'slope', a_number, 1, '', unset, positive, &
      'exponent k of the S-N curve: cycles = reference_cycles (reference / half range)^k'), &
    key_rule_t('fatigue', 'second_slope', a_number, 1, '', unset, positive, &
      'exponent below the point of the reference; slope if not given'), &
    key_rule_t('fatigue', 'table_cycles', a_number, any_number, '', unset, positive, &
      'cycles of the points of a curve in place of slope, ascending; straight in log scales', fewest=2, ascends=.true.), &
    key_rule_t('fatigue', 'table_stress', a_number, any_number, 'Pa', unset, positive, &
      'half ranges of the shear stress at these cycles, descending', fewest=2), &
    key_rule_t('fatigue', 'table_moment', a_number, any_number, 'N m', unset, positive, 'the same as moments', fewest=2), &
    key_rule_t('fatigue', 'table_force', a_number, any_number, 'N', unset, positive, 'the same as tooth forces', fewest=2), &
    key_rule_t('fatigue', 'stress_file', a_file, 1, '', unset, anything, &
      'two columns in place of both lists, cycles and half range of the shear stress [Pa]'), &
    key_rule_t('fatigue', 'moment_file', a_file, 1, '', unset, anything, 'the same with moments [N m]'), &
    key_rule_t('fatigue', 'force_file', a_file, 1, '', unset, anything, 'the same with tooth forces [N]'), &
    key_rule_t('fatigue', 'extrapolation', a_word, 1, '', linear, extrapolations, &
      'below the last point of a table: straight on in log scales, or constant: no damage'), &
    key_rule_t('fatigue', 'endurance_limit', a_number, 1, '', '0', not_negative, &
      'half range up to which no damage is done, in the unit of the reference'), &
    key_rule_t('fatigue', 'notch_factor', a_number, 1, '', '1', from_1, 'fatigue notch factor on the half range'), &
    key_rule_t('fatigue', 'mean_stress', a_word, 1, '', "'none'", mean_stresses, &
      'half range / (1 - mean / strength), of gerber its square; soderberg by yield_stress'), &
    key_rule_t('fatigue', 'ultimate_stress', a_number, 1, 'Pa', unset, positive, &
      'shear stress that breaks the part at once, for goodman and gerber'), &
    key_rule_t('fatigue', 'yield_stress', a_number, 1, 'Pa', unset, positive, 'shear stress at which it yields, for soderberg'), &
    key_rule_t('fatigue', 'repeats', a_number, 1, '', '1', positive, &
      'how often the motion of the run occurs in the life of the machine'), &
    key_rule_t('fatigue', 'profile_speeds', a_number, any_number, 'rad/s', unset, not_zero, &
      'speeds of the body of &response, for the damage that its oscillations do', fewest=1), &
    key_rule_t('fatigue', 'profile_hours', a_number, any_number, 'h', unset, positive, &
      'how long the machine runs at each of these speeds', fewest=1), &
    key_rule_t('orbit', 'over', a_text, 1, '', unset, anything, &
      "path of the number that changes, e.g. 'excitation.shaker.frequency_hz'"), &
    key_rule_t('orbit', 'range', a_number, 2, '', unset, anything, &
      'its first and its last value, in the unit of its path: the branch begins at the first one'), &
    key_rule_t('orbit', 'body', a_body, 1, '', unset, anything, &
      'in place of a number: the body whose mean speed a mean torque on it holds'), &
    key_rule_t('orbit', 'speed', a_number, 2, 'rad/s', unset, not_zero, 'its first and its last mean speed'), &
    key_rule_t('orbit', 'mode', an_integer, 1, '', unset, from_1, &
      'in place of both: the mode of the conservative machine whose backbone curve is found'), &
    key_rule_t('orbit', 'amplitude', a_number, 2, 'rad', unset, positive, &
      'first and last amplitude of its backbone, of the body that moves most in the mode'), &
    key_rule_t('orbit', 'energy', a_number, 2, 'J', unset, positive, &
      'in place of the amplitude: first and last energy, above the one in balance'), &
    key_rule_t('orbit', 'method', a_word, 1, '', unset, orbit_methods, &
      'in harmonics, for smooth laws, or by integration with events; found by the laws if not given'), &
    key_rule_t('orbit', 'start', a_text, 1, '', "'low'", anything, &
      "the first motion: 'low', 'high', 'settled_run', or a table such as trajectory.csv"), &
    key_rule_t('orbit', 'starts', an_integer, 1, '', unset, from_1, &
      'number of runs from scattered states that look for isolated branches'), &
    key_rule_t('orbit', 'subharmonic', an_integer, 1, '', '1', subharmonics, &
      'periods of the excitation in a period of the motion'), &
    key_rule_t('orbit', 'harmonics', an_integer, 1, '', unset, harmonic_counts, &
      'harmonics of the period of the motion; found by the error if not given'), &
    key_rule_t('orbit', 'tolerance', a_number, 1, '', '1e-8', shares, &
      'error of a point, as a share of its motion, that decides the number of harmonics'), &
    key_rule_t('orbit', 'count', an_integer, 1, '', unset, speed_counts, &
      'number of values at even distances that have points, beside those that the branch needs'), &
    key_rule_t('orbit', 'stability', a_flag, 1, '', unset, anything, &
      'whether multipliers are found; default: of up to 200 states without stiff undamped parts'), &
    key_rule_t('orbit', 'switch_branches', a_flag, 1, '', '.false.', anything, &
      'whether branches that begin at period doublings and branch points are followed too'), &
    key_rule_t('orbit', 'most_points', an_integer, 1, '', '2000', speed_counts, 'points of a branch at most'), &
    key_rule_t('orbit', 'signals', a_text, any_number, '', unset, anything, &
      "columns of orbit.csv: names, or patterns with *, e.g. 'phi_*'; all if not given", fewest=1), &
    key_rule_t('orbit', 'motions', a_number, any_number, '', unset, anything, &
      'values in the range at which the motions of all branches are written, motion_1.csv, ...', fewest=1), &
    key_rule_t('orbit', 'motion_speeds', a_number, any_number, 'rad/s', unset, not_zero, &
      'mean speeds of the body at which they are written', fewest=1), &
    key_rule_t('orbit', 'spectrum', a_flag, 1, '', '.false.', anything, &
      'whether the amplitudes of all harmonics at all points are written, orbit_harmonics.csv'), &
    key_rule_t('transit', 'body', a_body, 1, '', required, anything, 'the body whose speed counts'), &
    key_rule_t('transit', 'range', a_number, 2, 'rad/s', unset, not_zero, &
      'the range of its speed; those that &limit bars in the response if not given'), &
    key_rule_t('transit', 'ramp_times', a_number, any_number, 's', unset, anything, &
      'points between which the mean speed changes evenly; without them &run and its drives lead it', &
      fewest=2, ascends=.true.), &
    key_rule_t('transit', 'ramp_speeds', a_number, any_number, 'rad/s', unset, not_zero, &
      'mean speed of the body at these times; torques where it is driven add what is missing', fewest=2), &
    key_rule_t('transit', 'direction', a_word, 1, '', "'any'", directions, 'passages that the run must make'), &
    key_rule_t('transit', 'time_limit', a_number, 1, 's', unset, positive, 'longest time in the range'), &
    key_rule_t('transit', 'passages', a_number, 1, '', unset, positive, &
      'how often each passage occurs in the life of the machine; as the run if not given'), &
    key_rule_t('transit', 'order', a_number, 1, '', unset, positive, &
      'oscillations per turn that are counted; of barred ranges the largest one if not given'), &
    key_rule_t('transit', 'turns', an_integer, 1, '', unset, from_1, &
      'whole turns of the mean speed; 2 with an engine of four strokes, else 1, if not given')]

  type(relation_rule_t), parameter, public :: response_relations(*) = [ &
    relation_rule_t('response', exactly_one, 'speed', 'frequency'), &
    relation_rule_t('response', requires, 'speed', 'body'), &
    relation_rule_t('response', requires, 'excitation', 'frequency'), &
    relation_rule_t('response', at_most_one, 'frequency', 'orders operating'), &
    relation_rule_t('response', requires, 'margin margin_rule margin_rule_file', 'operating'), &
    relation_rule_t('response', at_most_one, 'margin_rule', 'margin_rule_file'), &
    relation_rule_t('response', requires, 'margin_rule_lines', 'margin_rule_file'), &
    relation_rule_t('limit', exactly_one, 'coupling shaft damper', 'mesh'), &
    relation_rule_t('limit', at_most_one, 'coupling', 'shaft damper'), &
    relation_rule_t('limit', at_most_one, 'shaft', 'damper'), &
    relation_rule_t('limit', requires, 'largest_temperature', 'coupling'), &
    relation_rule_t('limit', requires, 'vibratory_force force', 'mesh'), &
    relation_rule_t('limit', requires, 'vibratory_moment vibratory_frequency vibratory_moments table_file ' // &
                                       'heat moment stress stress_transient rule rule_file', 'coupling shaft damper'), &
    relation_rule_t('limit', equal_lengths, 'derating_temperatures derating_factors', ''), &
    relation_rule_t('limit', requires, 'temperature', 'derating_temperatures'), &
    relation_rule_t('limit', requires, 'derating_temperatures', 'temperature'), &
    relation_rule_t('limit', requires, 'temperature', 'vibratory_moment moment vibratory_frequency table_file'), &
    relation_rule_t('limit', equal_lengths, 'vibratory_frequency vibratory_moments', 'table_file'), &
    relation_rule_t('limit', at_most_one, 'vibratory_frequency vibratory_moments', 'table_file'), &
    relation_rule_t('limit', at_most_one, 'quantity', 'vibratory_force force vibratory_moment moment stress ' // &
                                                      'stress_transient rule rule_file heat vibratory_frequency ' // &
                                                      'largest_temperature ' // &
                                                      'table_file'), &
    relation_rule_t('limit', requires, 'largest vibratory', 'quantity'), &
    relation_rule_t('limit', requires, 'quantity', 'largest vibratory'), &
    relation_rule_t('limit', at_most_one, 'rule', 'rule_file'), &
    relation_rule_t('limit', requires, 'rule_lines', 'rule_file'), &
    relation_rule_t('limit', requires, 'tensile_strength rated_speed c_k diameter choices rule_symbols rule_values', &
                                       'rule rule_file'), &
    relation_rule_t('limit', equal_lengths, 'rule_symbols rule_values', ''), &
    relation_rule_t('fatigue', exactly_one, 'coupling shaft', 'mesh gear'), &
    relation_rule_t('fatigue', at_most_one, 'coupling', 'shaft'), &
    relation_rule_t('fatigue', at_most_one, 'mesh', 'gear'), &
    relation_rule_t('fatigue', exactly_one, 'slope', 'table_cycles stress_file moment_file force_file'), &
    relation_rule_t('fatigue', at_most_one, 'table_cycles table_stress table_moment table_force', &
                                            'stress_file moment_file force_file'), &
    relation_rule_t('fatigue', at_most_one, 'stress_file', 'moment_file force_file'), &
    relation_rule_t('fatigue', at_most_one, 'moment_file', 'force_file'), &
    relation_rule_t('fatigue', equal_lengths, 'table_cycles table_stress', 'stress_file'), &
    relation_rule_t('fatigue', equal_lengths, 'table_cycles table_moment', 'moment_file'), &
    relation_rule_t('fatigue', equal_lengths, 'table_cycles table_force', 'force_file'), &
    relation_rule_t('fatigue', requires, 'extrapolation', 'table_cycles stress_file moment_file force_file'), &
    relation_rule_t('fatigue', requires, 'slope', 'reference_cycles'), &
    relation_rule_t('fatigue', requires, 'slope', 'reference_stress reference_moment reference_force'), &
    relation_rule_t('fatigue', requires, 'reference_cycles second_slope', 'slope'), &
    relation_rule_t('fatigue', requires, 'reference_stress reference_moment reference_force', 'slope'), &
    relation_rule_t('fatigue', at_most_one, 'reference_stress', 'reference_moment reference_force'), &
    relation_rule_t('fatigue', at_most_one, 'reference_moment', 'reference_force'), &
    relation_rule_t('fatigue', requires, 'table_cycles', 'table_stress table_moment table_force'), &
    relation_rule_t('fatigue', requires, 'table_stress table_moment table_force', 'table_cycles'), &
    relation_rule_t('fatigue', at_most_one, 'table_stress', 'table_moment table_force'), &
    relation_rule_t('fatigue', at_most_one, 'table_moment', 'table_force'), &
    relation_rule_t('fatigue', requires, 'reference_stress table_stress stress_file reference_moment table_moment ' // &
                                         'moment_file', 'coupling shaft'), &
    relation_rule_t('fatigue', requires, 'reference_force table_force force_file', 'mesh gear'), &
    relation_rule_t('fatigue', at_most_one, 'ultimate_stress', 'yield_stress'), &
    relation_rule_t('fatigue', equal_lengths, 'profile_speeds profile_hours', ''), &
    relation_rule_t('orbit', exactly_one, 'over', 'body mode'), &
    relation_rule_t('orbit', at_most_one, 'body', 'mode'), &
    relation_rule_t('orbit', at_most_one, 'mode', 'start starts subharmonic stability'), &
    relation_rule_t('orbit', requires, 'mode', 'amplitude energy'), &
    relation_rule_t('orbit', requires, 'amplitude energy', 'mode'), &
    relation_rule_t('orbit', at_most_one, 'amplitude', 'energy'), &
    relation_rule_t('orbit', requires, 'over', 'range'), &
    relation_rule_t('orbit', requires, 'range', 'over'), &
    relation_rule_t('orbit', requires, 'body', 'speed'), &
    relation_rule_t('orbit', requires, 'speed', 'body'), &
    relation_rule_t('orbit', requires, 'motions', 'over'), &
    relation_rule_t('orbit', requires, 'motion_speeds', 'body'), &
    relation_rule_t('transit', equal_lengths, 'ramp_times ramp_speeds', '')]

  type(example_t), parameter, public :: response_examples(*) = [ &
    example_t('response', "body = 'motor'  speed_rpm = 50, 600  operating_rpm = 300, 400", .false.), &
    example_t('limit', "coupling = 'coupling'  vibratory_moment = 40.0  moment = 200.0", .false.), &
    example_t('fatigue', "name = 'life'  coupling = 'coupling'|" // &
                         'reference_moment = 150.0  reference_cycles = 2.0e6  slope = 5.0', .false.), &
    example_t('orbit', "over = 'excitation.pulse.frequency_hz'  range = 5.0, 20.0  count = 31", .false.), &
    example_t('transit', "body = 'motor'  range_rpm = 350, 450  time_limit = 5.0  passages = 20000", .false.)]

end module nocdyn_schema_response
