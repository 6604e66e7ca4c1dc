!> Rows of the schema: the group &mesh with its keys.
module nocdyn_schema_meshes
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_flag, a_name, a_number, allowed_t, an_integer, any_number, any_times, anything, at_most_one, &
    body_or_ground, efficiencies, equal_lengths, exactly_one, example_t, from_1, group_rule_t, in_machine, key_rule_t, &
    not_negative, positive, relation_rule_t, required, requires, reverse_efficiencies, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: pressure_angles = allowed_t(low=0.0_wp, high=0.7854_wp)   ! [rad]

  type(group_rule_t), parameter, public :: mesh_groups(*) = [ &
    group_rule_t('mesh', in_machine, any_times, 'coupling', 'An elastic mesh of two wheels.')]

  type(key_rule_t), parameter, public :: mesh_keys(*) = [ &
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

  type(relation_rule_t), parameter, public :: mesh_relations(*) = [ &
    relation_rule_t('mesh', exactly_one, 'radii', 'teeth'), &
    relation_rule_t('mesh', requires, 'module', 'teeth'), &
    relation_rule_t('mesh', requires, 'teeth', 'module'), &
    relation_rule_t('mesh', requires, 'pressure_angle', 'teeth'), &
    relation_rule_t('mesh', at_most_one, 'efficiency reverse_efficiency', 'table_speed table_efficiency'), &
    relation_rule_t('mesh', requires, 'reverse_efficiency', 'efficiency'), &
    relation_rule_t('mesh', requires, 'table_reverse', 'table_efficiency'), &
    relation_rule_t('mesh', equal_lengths, 'table_speed table_efficiency', ''), &
    relation_rule_t('mesh', requires, 'error_orders error_phases', 'transmission_error')]

  type(example_t), parameter, public :: mesh_examples(*) = [ &
    example_t('mesh', "name = 'teeth'  bodies = 'pinion', 'machine'  radii = 2.0, 3.0|" // &
      'stiffness = 1.0e8  damping = 1.0e4', .false.)]

end module nocdyn_schema_meshes
