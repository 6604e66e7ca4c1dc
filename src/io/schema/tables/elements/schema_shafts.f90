!> Rows of the schema: the group &shaft with its keys.
module nocdyn_schema_shafts
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_name, a_number, allowed_t, an_integer, any_number, any_times, anything, at_most_one, &
    body_or_ground, equal_lengths, example_t, group_rule_t, in_machine, key_rule_t, not_negative, positive, relation_rule_t, &
    required, requires, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: node_counts = allowed_t(low=0.0_wp, high=1000.0_wp)

  type(group_rule_t), parameter, public :: shaft_groups(*) = [ &
    group_rule_t('shaft', in_machine, any_times, 'coupling', 'A stepped, solid or hollow elastic shaft between two bodies.')]

  type(key_rule_t), parameter, public :: shaft_keys(*) = [ &
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
      'internal nodes; as many as the excited frequencies and the first modes need if not given')]

  type(relation_rule_t), parameter, public :: shaft_relations(*) = [ &
    relation_rule_t('shaft', equal_lengths, 'lengths diameters bores', ''), &
    relation_rule_t('shaft', at_most_one, 'damping_ratio', 'relative_damping'), &
    relation_rule_t('shaft', requires, 'damping_frequency', 'damping_ratio relative_damping')]

  type(example_t), parameter, public :: shaft_examples(*) = [ &
    example_t('shaft', "name = 'line'  bodies = 'motor', 'machine'|" // &
      'lengths = 2.0, 3.0  diameters = 0.4, 0.35  shear_modulus = 8.0e10  density = 7850', .false.)]

end module nocdyn_schema_shafts
