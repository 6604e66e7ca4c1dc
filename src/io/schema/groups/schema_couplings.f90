!> Rows of the schema: elastic elements, &coupling, &shaft and &mesh.
module nocdyn_schema_couplings
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_file, a_flag, a_line_file, a_name, a_number, a_selector, a_text, a_word, allowed_t, &
    an_integer, any_number, any_times, anything, at_most_one, body_or_ground, efficiencies, equal_lengths, exactly_one, &
    example_t, extrapolations, from_1, group_rule_t, in_machine, interpolations, key_rule_t, kind_rule_t, less_than, linear, &
    not_negative, positive, relation_rule_t, required, requires, reverse_efficiencies, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: node_counts = allowed_t(low=0.0_wp, high=1000.0_wp)
  type(allowed_t), parameter :: temperatures = allowed_t(low=-273.15_wp, high=1000.0_wp)
  type(allowed_t), parameter, public :: conditions = allowed_t(words='cold warm steady')
  type(allowed_t), parameter :: pressure_angles = allowed_t(low=0.0_wp, high=0.7854_wp)   ! [rad]

  type(group_rule_t), parameter, public :: coupling_groups(*) = [ &
    group_rule_t('coupling', in_machine, any_times, 'coupling', &
                 'An elastic coupling of two bodies, or of a body and the ground.'), &
    group_rule_t('shaft', in_machine, any_times, 'coupling', 'A stepped, solid or hollow elastic shaft between two bodies.'), &
    group_rule_t('mesh', in_machine, any_times, 'coupling', 'An elastic mesh of two wheels.')]

  type(kind_rule_t), parameter, public :: coupling_kinds(*) = [ &
    kind_rule_t('coupling', 'elastic', 'a spring with damping, friction, play or a table'), &
    kind_rule_t('coupling', 'rubber', 'stiffness and relative damping of a data sheet, with their tables and heat')]

  type(key_rule_t), parameter, public :: coupling_keys(*) = [ &
    key_rule_t('coupling', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('coupling', 'kind', a_selector, 1, '', "'elastic'", anything, 'which law its moment follows'), &
    key_rule_t('coupling', 'bodies', body_or_ground, 2, '', required, anything, &
      "the two ends; twist = angle of the second - angle of the first; 'ground' does not turn"), &
    key_rule_t('coupling', 'stiffness', a_number, 1, 'N m/rad', '0', not_negative, 'linear part of the elastic moment'), &
    key_rule_t('coupling', 'cubic_stiffness', a_number, 1, 'N m/rad3', '0', anything, &
      'cubic part of the elastic moment; negative softens', only_if='elastic'), &
    key_rule_t('coupling', 'polynomial', a_number, any_number, 'N m/rad^k', unset, anything, &
      'p_1, p_2, ...: p_k w^k, w = twist - rest_twist, are added to the elastic moment', fewest=1, only_if='elastic'), &
    key_rule_t('coupling', 'damping', a_number, 1, 'N m s/rad', '0', not_negative, &
      'moment per rate of twist; with a gap only in contact, at most as large as the elastic moment'), &
    key_rule_t('coupling', 'relative_damping', a_number, 1, '', unset, not_negative, &
      'psi of data sheets: energy lost in a cycle by the largest elastic energy; at every frequency'), &
    key_rule_t('coupling', 'magnifier', a_number, 1, '', unset, positive, &
      'M of data sheets, 2 pi / psi, in place of relative_damping'), &
    key_rule_t('coupling', 'damping_frequency', a_number, 1, 'rad/s', unset, positive, &
      'frequency at which a viscous damping stands for relative_damping over the time (run, sweep)'), &
    key_rule_t('coupling', 'section_modulus', a_number, 1, 'm3', unset, positive, &
      'section modulus against torsion of the weakest section: stress = moment / section_modulus'), &
    key_rule_t('coupling', 'diameter', a_number, 1, 'm', unset, positive, &
      'diameter of a round section, in place of section_modulus'), &
    key_rule_t('coupling', 'bore', a_number, 1, 'm', unset, not_negative, 'diameter of its bore; 0 if not given'), &
    key_rule_t('coupling', 'rest_twist', a_number, 1, 'rad', '0', anything, 'twist without elastic moment'), &
    key_rule_t('coupling', 'gap', a_number, 1, 'rad', '0', not_negative, &
      'total play: no moment within +- gap/2 of rest_twist, beyond it contact, which never pulls', only_if='elastic'), &
    key_rule_t('coupling', 'saturation', a_number, 1, 'N m', unset, positive, &
      'bounds the elastic moment M smoothly: saturation tanh(M / saturation)', only_if='elastic'), &
    key_rule_t('coupling', 'friction', a_number, 1, 'N m', '0', not_negative, &
      'moment of a slipping clutch: friction tanh(rate of twist / friction_speed)', only_if='elastic'), &
    key_rule_t('coupling', 'friction_speed', a_number, 1, 'rad/s', '0.01', positive, &
      'rate of twist at which the friction has 76 % of its full moment', only_if='elastic'), &
    key_rule_t('coupling', 'maxwell_stiffness', a_number, any_number, 'N m/rad', unset, positive, &
      'stiffness of springs in series with dampers, parallel to the spring, as of rubber', fewest=1, only_if='elastic'), &
    key_rule_t('coupling', 'maxwell_time', a_number, any_number, 's', unset, positive, &
      'relaxation time of each of them: damping / maxwell_stiffness', fewest=1, only_if='elastic'), &
    key_rule_t('coupling', 'table_twist', a_number, any_number, 'rad', unset, anything, &
      'twist - rest_twist of the points of a table, ascending', fewest=2, ascends=.true., only_if='elastic'), &
    key_rule_t('coupling', 'table_moment', a_number, any_number, 'N m', unset, anything, &
      'elastic moment at these points', fewest=2, only_if='elastic'), &
    key_rule_t('coupling', 'table_file', a_file, 1, '', unset, anything, &
      'file with the table: two columns, twist - rest_twist [rad] and moment [N m]', only_if='elastic'), &
    key_rule_t('coupling', 'interpolation', a_word, 1, '', linear, interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland', only_if='elastic'), &
    key_rule_t('coupling', 'extrapolation', a_word, 1, '', linear, extrapolations, &
      'beyond the table: straight on with the end slope, or constant', only_if='elastic'), &
    key_rule_t('coupling', 'table_torque', a_number, any_number, 'N m', unset, not_negative, &
      'mean torques, without sign, of the two factors that follow, ascending', 'rubber', fewest=2, ascends=.true.), &
    key_rule_t('coupling', 'torque_stiffness', a_number, any_number, '', '1', positive, &
      'factors of stiffness at these torques; stiffness is linear in the twist between them', 'rubber', fewest=2), &
    key_rule_t('coupling', 'torque_damping', a_number, any_number, '', '1', positive, &
      'factors of the relative damping at these torques; straight between them', 'rubber', fewest=2), &
    key_rule_t('coupling', 'table_amplitude', a_number, any_number, 'N m', unset, not_negative, &
      'vibratory torques of the two factors that follow, ascending', 'rubber', fewest=2, ascends=.true.), &
    key_rule_t('coupling', 'amplitude_stiffness', a_number, any_number, '', '1', positive, &
      'factors of stiffness at these amplitudes; straight between them', 'rubber', fewest=2), &
    key_rule_t('coupling', 'amplitude_damping', a_number, any_number, '', '1', positive, &
      'factors of the relative damping at these amplitudes', 'rubber', fewest=2), &
    key_rule_t('coupling', 'table_frequency', a_number, any_number, 'rad/s', unset, not_negative, &
      'frequencies of the two factors that follow, ascending', 'rubber', fewest=2, ascends=.true.), &
    key_rule_t('coupling', 'frequency_stiffness', a_number, any_number, '', '1', positive, &
      'factors of stiffness at these frequencies; straight between them', 'rubber', fewest=2), &
    key_rule_t('coupling', 'frequency_damping', a_number, any_number, '', '1', positive, &
      'factors of the relative damping at these frequencies', 'rubber', fewest=2), &
    key_rule_t('coupling', 'table_temperature', a_number, any_number, 'degC', unset, anything, &
      'temperatures of the rubber of the two factors that follow, ascending', 'rubber', fewest=2, ascends=.true.), &
    key_rule_t('coupling', 'temperature_stiffness', a_number, any_number, '', '1', positive, &
      'factors of stiffness at these temperatures, S_t of data sheets', 'rubber', fewest=2), &
    key_rule_t('coupling', 'temperature_damping', a_number, any_number, '', '1', positive, &
      'factors of the relative damping at these temperatures', 'rubber', fewest=2), &
    key_rule_t('coupling', 'condition', a_word, 1, '', unset, conditions, &
      'cold, warm, or steady by its heat, the default with data of its cooling; else cold', 'rubber'), &
    key_rule_t('coupling', 'ambient_temperature', a_number, 1, 'degC', unset, temperatures, &
      'temperature of the coupling without loss of power, and if it is cold', 'rubber'), &
    key_rule_t('coupling', 'thermal_resistance', a_number, 1, 'K/W', unset, positive, &
      'rise of the temperature by the mean power that is lost', 'rubber'), &
    key_rule_t('coupling', 'power_loss', a_number, 1, 'W', unset, positive, &
      'P_KV of data sheets: permissible power loss, at which the rise is power_loss_rise', 'rubber'), &
    key_rule_t('coupling', 'power_loss_rise', a_number, 1, 'K', unset, positive, &
      'rise of the temperature at power_loss: from the ambient to the permissible temperature', 'rubber'), &
    key_rule_t('coupling', 'warm_temperature', a_number, 1, 'degC', unset, temperatures, &
      'temperature of the coupling if it is warm', 'rubber'), &
    key_rule_t('coupling', 'warm_stiffness', a_number, 1, 'N m/rad', unset, positive, &
      'stiffness of the warm coupling, where data sheets give it in place of tables', 'rubber'), &
    key_rule_t('coupling', 'warm_damping', a_number, 1, '', unset, not_negative, &
      'relative damping of the warm coupling', 'rubber'), &
    key_rule_t('coupling', 'nominal_torque', a_number, 1, 'N m', unset, positive, &
      'T_KN of data sheets: torque in continuous operation', 'rubber'), &
    key_rule_t('coupling', 'maximum_torque', a_number, 1, 'N m', unset, positive, 'T_Kmax of data sheets', 'rubber'), &
    key_rule_t('coupling', 'vibratory_torque', a_number, 1, 'N m', unset, positive, &
      'T_KW of data sheets: amplitude in continuous operation', 'rubber'), &
    key_rule_t('coupling', 'limits', a_flag, 1, '', '.false.', anything, &
      'whether maximum_torque, vibratory_torque and power_loss are limits, as of a &limit', 'rubber'), &
    key_rule_t('coupling', 'first_inertia', a_number, 1, 'kg m2', unset, not_negative, &
      'inertia of its side at the first body', 'rubber'), &
    key_rule_t('coupling', 'second_inertia', a_number, 1, 'kg m2', unset, not_negative, 'and at the second body', 'rubber'), &
    key_rule_t('coupling', 'inertias', a_flag, 1, '', '.false.', anything, &
      'whether these are added to those of the bodies', 'rubber'), &
    key_rule_t('coupling', 'catalogue_file', a_line_file, 1, '', unset, anything, &
      'file with a row for each size of a series, which gives the keys that are not given', 'rubber'), &
    key_rule_t('coupling', 'catalogue_lines', a_text, any_number, '', unset, anything, &
      'the lines of catalogue_file, as an input that was written has them', 'rubber'), &
    key_rule_t('coupling', 'size', a_text, 1, '', unset, anything, 'the size in the catalogue', 'rubber'), &
    key_rule_t('shaft', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('shaft', 'bodies', body_or_ground, 2, '', required, anything, &
      'the two bodies at its ends; half of the inertia of a short shaft is added to each'), &
    key_rule_t('shaft', 'lengths', a_number, any_number, 'm', required, positive, &
      'length of each uniform segment, from the first body on', fewest=1), &
    key_rule_t('shaft', 'diameters', a_number, any_number, 'm', required, positive, 'outer diameter of each segment', fewest=1), &
    key_rule_t('shaft', 'bores', a_number, any_number, 'm', '0', not_negative, &
      'inner diameter of each segment, less than the outer one', fewest=1), &
    key_rule_t('shaft', 'shear_modulus', a_number, any_number, 'Pa', required, positive, &
      'shear modulus G: 8e10 of steel; one value, or one for each segment', fewest=1), &
    key_rule_t('shaft', 'density', a_number, any_number, 'kg/m3', unset, not_negative, &
      'density: 7850 of steel; one value, or one for each segment; 0 or not given: no inertia', fewest=1), &
    key_rule_t('shaft', 'damping_ratio', a_number, 1, '', unset, not_negative, &
      'damping ratio D of its oscillations at damping_frequency, in place of relative_damping'), &
    key_rule_t('shaft', 'relative_damping', a_number, 1, '', unset, not_negative, &
      'psi: energy lost in a cycle by the largest elastic energy; at every frequency'), &
    key_rule_t('shaft', 'damping_frequency', a_number, 1, 'rad/s', unset, positive, &
      'frequency at which a viscous damping stands for the relative one over the time (run, sweep)'), &
    key_rule_t('shaft', 'nodes', an_integer, 1, '', unset, node_counts, &
      'internal nodes; as many as the excited frequencies and the first modes need if not given'), &
    key_rule_t('mesh', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('mesh', 'bodies', body_or_ground, 2, '', required, anything, 'the two wheels'), &
    key_rule_t('mesh', 'radii', a_number, 2, 'm', unset, positive, &
      'radii at which the force acts, in the order of the bodies: those of the base circles'), &
    key_rule_t('mesh', 'teeth', an_integer, 2, '', unset, from_1, &
      'numbers of teeth by body; the radii are module * teeth / 2 * cos(pressure_angle)'), &
    key_rule_t('mesh', 'module', a_number, 1, 'm', unset, positive, &
      'module of the teeth, of helical ones in the transverse plane'), &
    key_rule_t('mesh', 'pressure_angle', a_number, 1, 'rad', '0.3490658504', pressure_angles, &
      'pressure angle beside teeth and module, in the transverse plane; 20 degrees if not given'), &
    key_rule_t('mesh', 'internal', a_flag, 1, '', '.false.', anything, &
      'an internal gear: both wheels turn in the same direction'), &
    key_rule_t('mesh', 'stiffness', a_number, 1, 'N/m', required, positive, &
      'mean stiffness of the mesh along the line of action'), &
    key_rule_t('mesh', 'damping', a_number, 1, 'N s/m', '0', not_negative, &
      'force per rate of deformation; with backlash in contact only, at most the elastic force'), &
    key_rule_t('mesh', 'backlash', a_number, 1, 'm', '0', not_negative, &
      'play between both flanks along the line of action; no force inside'), &
    key_rule_t('mesh', 'transmission_error', a_number, any_number, 'm', unset, not_negative, &
      'amplitudes of the deviation from equal motion, along the line of action', fewest=1), &
    key_rule_t('mesh', 'error_orders', a_number, any_number, '', unset, positive, &
      'order of each in turns of the first body; if not given 1, 2, ... times its teeth', fewest=1), &
    key_rule_t('mesh', 'error_phases', a_number, any_number, 'rad', unset, anything, &
      'phase of each: amplitude * sin(order * angle + phase)', fewest=1), &
    key_rule_t('mesh', 'efficiency', a_number, 1, '', unset, efficiencies, &
      'share of the power that the second wheel gets where the first one drives; 1 without losses'), &
    key_rule_t('mesh', 'reverse_efficiency', a_number, 1, '', unset, reverse_efficiencies, &
      'the same where the second wheel drives; as efficiency if not given; 0 or less: self-locking'), &
    key_rule_t('mesh', 'table_speed', a_number, any_number, 'rad/s', unset, not_negative, &
      'speeds of the first wheel of the points of a table of efficiencies, from 0 on', fewest=2, ascends=.true.), &
    key_rule_t('mesh', 'table_efficiency', a_number, any_number, '', unset, efficiencies, &
      'efficiency at these speeds; beyond the last point as there', fewest=2), &
    key_rule_t('mesh', 'table_reverse', a_number, any_number, '', unset, reverse_efficiencies, &
      'reverse efficiency at these speeds', fewest=2)]

  type(relation_rule_t), parameter, public :: coupling_relations(*) = [ &
    relation_rule_t('coupling', at_most_one, 'table_twist table_moment', 'table_file'), &
    relation_rule_t('coupling', at_most_one, 'table_twist table_moment table_file', &
                    'stiffness cubic_stiffness polynomial gap saturation'), &
    relation_rule_t('coupling', at_most_one, 'saturation', 'cubic_stiffness polynomial gap'), &
    relation_rule_t('coupling', at_most_one, 'maxwell_stiffness maxwell_time', &
                    'polynomial gap saturation table_twist table_file relative_damping magnifier'), &
    relation_rule_t('coupling', requires, 'maxwell_stiffness', 'maxwell_time'), &
    relation_rule_t('coupling', requires, 'maxwell_time', 'maxwell_stiffness'), &
    relation_rule_t('coupling', equal_lengths, 'maxwell_stiffness maxwell_time', ''), &
    relation_rule_t('coupling', requires, 'gap', 'stiffness cubic_stiffness polynomial'), &
    relation_rule_t('coupling', requires, 'saturation', 'stiffness'), &
    relation_rule_t('coupling', requires, 'friction_speed', 'friction'), &
    relation_rule_t('coupling', at_most_one, 'relative_damping', 'magnifier'), &
    relation_rule_t('coupling', requires, 'damping_frequency', 'relative_damping magnifier catalogue_file'), &
    relation_rule_t('coupling', at_most_one, 'section_modulus', 'diameter bore'), &
    relation_rule_t('coupling', requires, 'bore', 'diameter'), &
    relation_rule_t('coupling', less_than, 'bore', 'diameter'), &
    relation_rule_t('coupling', requires, 'interpolation extrapolation', 'table_twist table_file'), &
    relation_rule_t('coupling', equal_lengths, 'table_twist table_moment', 'table_file'), &
    relation_rule_t('coupling', requires, 'torque_stiffness torque_damping', 'table_torque'), &
    relation_rule_t('coupling', equal_lengths, 'table_torque torque_stiffness torque_damping', ''), &
    relation_rule_t('coupling', requires, 'amplitude_stiffness amplitude_damping', 'table_amplitude'), &
    relation_rule_t('coupling', equal_lengths, 'table_amplitude amplitude_stiffness amplitude_damping', ''), &
    relation_rule_t('coupling', requires, 'frequency_stiffness frequency_damping', 'table_frequency'), &
    relation_rule_t('coupling', equal_lengths, 'table_frequency frequency_stiffness frequency_damping', ''), &
    relation_rule_t('coupling', requires, 'temperature_stiffness temperature_damping', 'table_temperature'), &
    relation_rule_t('coupling', equal_lengths, 'table_temperature temperature_stiffness temperature_damping', ''), &
    relation_rule_t('coupling', at_most_one, 'thermal_resistance', 'power_loss_rise'), &
    relation_rule_t('coupling', requires, 'power_loss_rise', 'power_loss catalogue_file'), &
    relation_rule_t('coupling', requires, 'thermal_resistance power_loss_rise table_temperature', 'ambient_temperature'), &
    relation_rule_t('coupling', requires, 'ambient_temperature', &
                    'thermal_resistance power_loss_rise table_temperature catalogue_file'), &
    relation_rule_t('coupling', requires, 'warm_temperature', 'table_temperature'), &
    relation_rule_t('coupling', at_most_one, 'warm_temperature', 'warm_stiffness warm_damping'), &
    relation_rule_t('coupling', requires, 'catalogue_file', 'size'), &
    relation_rule_t('coupling', requires, 'catalogue_lines size', 'catalogue_file'), &
    relation_rule_t('shaft', equal_lengths, 'lengths diameters bores', ''), &
    relation_rule_t('shaft', at_most_one, 'damping_ratio', 'relative_damping'), &
    relation_rule_t('shaft', requires, 'damping_frequency', 'damping_ratio relative_damping'), &
    relation_rule_t('mesh', exactly_one, 'radii', 'teeth'), &
    relation_rule_t('mesh', requires, 'module', 'teeth'), &
    relation_rule_t('mesh', requires, 'teeth', 'module'), &
    relation_rule_t('mesh', requires, 'pressure_angle', 'teeth'), &
    relation_rule_t('mesh', at_most_one, 'efficiency reverse_efficiency', 'table_speed table_efficiency'), &
    relation_rule_t('mesh', requires, 'reverse_efficiency', 'efficiency'), &
    relation_rule_t('mesh', requires, 'table_reverse', 'table_efficiency'), &
    relation_rule_t('mesh', equal_lengths, 'table_speed table_efficiency', ''), &
    relation_rule_t('mesh', requires, 'error_orders error_phases', 'transmission_error')]

  type(example_t), parameter, public :: coupling_examples(*) = [ &
    example_t('coupling', "name = 'coupling' bodies = 'motor', 'pinion' stiffness = 100.0 cubic_stiffness = 10"), &
    example_t('coupling', "name = 'splines' bodies = 'motor', 'pinion'|" // &
                          'stiffness = 1.0e5 gap = 0.02 damping = 5.0', .false.), &
    example_t('coupling', "name = 'clutch'   bodies = 'motor', 'pinion' friction = 50.0", .false.), &
    example_t('coupling', "name = 'rubber'   bodies = 'motor', 'pinion'|" // &
                          "table_twist = -0.2, 0, 0.2  table_moment = -90, 0, 60  interpolation = 'cubic'", .false.), &
    example_t('coupling', "name = 'highly_flexible'  bodies = 'motor', 'pinion'|" // &
      "kind = 'rubber'  stiffness = 100  relative_damping = 1.13  damping_frequency_hz = 5", .false.), &
    example_t('shaft', "name = 'line'  bodies = 'motor', 'machine'|" // &
      'lengths = 2.0, 3.0  diameters = 0.4, 0.35  shear_modulus = 8.0e10  density = 7850', .false.), &
    example_t('mesh', "name = 'teeth'  bodies = 'pinion', 'machine'  radii = 2.0, 3.0|" // &
      'stiffness = 1.0e8  damping = 1.0e4', .false.)]

end module nocdyn_schema_couplings
