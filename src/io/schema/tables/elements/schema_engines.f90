!> Rows of the schema: the keys of &engine and the relations between them.
module nocdyn_schema_engines
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_body, a_file, a_name, a_number, allowed_t, an_integer, any_number, any_times, anything, &
    at_most_one, columns, equal_lengths, example_t, from_0_to_1, group_rule_t, in_torques, key_rule_t, less_than, not_negative, &
    positive, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: strokes = allowed_t(low=2.0_wp, high=4.0_wp)
  type(allowed_t), parameter :: above_minus_1 = allowed_t(low=-1.0_wp)
  type(allowed_t), parameter :: up_to_64 = allowed_t(low=0.0_wp, high=64.0_wp, excludes_low=.true.)

  type(group_rule_t), parameter, public :: engine_groups(*) = [ &
    group_rule_t('engine', in_torques, any_times, 'torque', &
                 'The gas and inertia torques of the cylinders of an engine, on its cranks.')]

  type(key_rule_t), parameter, public :: engine_keys(*) = [ &
    key_rule_t('engine', 'name', a_name, 1, '', required, anything, &
      'name in results and messages; its cylinders are NAME_1, NAME_2, ...'), &
    key_rule_t('engine', 'cylinders', a_body, any_number, '', required, anything, &
      'the crank of each cylinder; two cylinders of a V engine may share one', fewest=1, may_repeat=.true.), &
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
    key_rule_t('engine', 'crankcase_pressure', a_number, 1, 'Pa', '0', not_negative, &
      'pressure below the pistons; 0 if pressures are above that of the atmosphere'), &
    key_rule_t('engine', 'harmonics_up_to', a_number, 1, '', '24', up_to_64, 'highest order that is taken from the pressure'), &
    key_rule_t('engine', 'bore', a_number, 1, 'm', unset, positive, 'diameter of the pistons'), &
    key_rule_t('engine', 'crank_radius', a_number, 1, 'm', unset, positive, 'half the travel of the pistons'), &
    key_rule_t('engine', 'rod_length', a_number, 1, 'm', unset, positive, 'length of the connecting rods'), &
    key_rule_t('engine', 'reciprocating_mass', a_number, 1, 'kg', unset, not_negative, &
      'mass that moves with one piston; its inertia torque has the orders 1 to 4'), &
    key_rule_t('engine', 'misfire', an_integer, 1, '', '0', not_negative, &
      'number of a cylinder that does not fire, 0: all fire'), &
    key_rule_t('engine', 'cylinder_scatter', a_number, any_number, '', unset, above_minus_1, &
      'relative difference of the gas torque of each cylinder; one value: + and - in turn')]

  type(relation_rule_t), parameter, public :: engine_relations(*) = [ &
    relation_rule_t('engine', at_most_one, 'table_file', &
                    'orders amplitudes phases speeds loads misfire_amplitudes misfire_phases'), &
    relation_rule_t('engine', at_most_one, 'pressure_file', 'crank_angles pressures misfire_pressures'), &
    relation_rule_t('engine', at_most_one, 'orders amplitudes phases table_file mean_torque', &
                    'crank_angles pressures pressure_file'), &
    relation_rule_t('engine', requires, 'load_share', 'loads table_file'), &
    relation_rule_t('engine', requires, 'misfire_phases', 'misfire_amplitudes'), &
    relation_rule_t('engine', requires, 'pressures pressure_file', 'bore'), &
    relation_rule_t('engine', requires, 'pressures pressure_file reciprocating_mass', 'crank_radius'), &
    relation_rule_t('engine', requires, 'pressures pressure_file reciprocating_mass', 'rod_length'), &
    relation_rule_t('engine', requires, 'bore crankcase_pressure harmonics_up_to', 'pressures pressure_file'), &
    relation_rule_t('engine', requires, 'crank_radius rod_length', 'pressures pressure_file reciprocating_mass'), &
    relation_rule_t('engine', less_than, 'crank_radius', 'rod_length'), &
    relation_rule_t('engine', equal_lengths, 'cylinders firing', ''), &
    relation_rule_t('engine', columns, 'orders amplitudes phases', 'table_file speeds loads misfire_amplitudes misfire_phases'), &
    relation_rule_t('engine', columns, 'crank_angles pressures', 'pressure_file misfire_pressures')]

  type(example_t), parameter, public :: engine_examples(*) = [ &
    example_t('engine',      "name = 'diesel'   cylinders = 'motor'  stroke = 4  firing_deg = 0|" // &
                             'orders = 0.5, 1, 1.5, 2  amplitudes = 90, 80, 60, 40  mean_torque = 30', .false.)]

end module nocdyn_schema_engines
