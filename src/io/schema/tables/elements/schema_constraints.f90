!> Rows of the schema: the rigid joints, &gear, &planetary, &differential and &constraint.
module nocdyn_schema_constraints
  use nocdyn_schema_rules, only: a_body, a_flag, a_name, a_number, an_integer, any_number, any_times, anything, &
    at_most_one, body_or_ground, efficiencies, equal_lengths, exactly_one, example_t, from_1, group_rule_t, in_machine, &
    key_rule_t, not_negative, not_zero, positive, relation_rule_t, required, requires, reverse_efficiencies, unset
  implicit none (type, external)
  private

  type(group_rule_t), parameter, public :: constraint_groups(*) = [ &
    group_rule_t('gear', in_machine, any_times, 'constraint', &
                 'A rigid gear: R1 omega_1 + R2 omega_2 = 0, a minus if internal.'), &
    group_rule_t('planetary', in_machine, any_times, 'constraint', &
                 'A planetary gear set (Willis): z_s omega_s + z_r omega_r = (z_s + z_r) omega_c.'), &
    group_rule_t('differential', in_machine, any_times, 'constraint', 'A differential: omega_1 + omega_2 = 2 omega_case.'), &
    group_rule_t('constraint', in_machine, any_times, 'constraint', 'Any rigid relation: the sum of coefficient * speed is 0.')]

  type(key_rule_t), parameter, public :: constraint_keys(*) = [ &
    key_rule_t('gear', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('gear', 'bodies', body_or_ground, 2, '', required, anything, &
      "the two wheels; 'ground' does not turn, and locks the other one"), &
    key_rule_t('gear', 'radii', a_number, 2, 'm', unset, positive, 'pitch radii, in the order of the bodies'), &
    key_rule_t('gear', 'teeth', an_integer, 2, '', unset, from_1, 'numbers of teeth, in the order of the bodies'), &
    key_rule_t('gear', 'internal', a_flag, 1, '', '.false.', anything, &
      'an internal gear: both wheels turn in the same direction'), &
    key_rule_t('gear', 'efficiency', a_number, 1, '', unset, efficiencies, &
      'share of the power that the second wheel gets where the first one drives; 1 without losses'), &
    key_rule_t('gear', 'reverse_efficiency', a_number, 1, '', unset, reverse_efficiencies, &
      'the same where the second wheel drives; as efficiency if not given; 0 or less: self-locking'), &
    key_rule_t('gear', 'table_speed', a_number, any_number, 'rad/s', unset, not_negative, &
      'speeds of the first wheel of the points of a table of efficiencies, from 0 on', fewest=2, ascends=.true.), &
    key_rule_t('gear', 'table_efficiency', a_number, any_number, '', unset, efficiencies, &
      'efficiency at these speeds; beyond the last point as there', fewest=2), &
    key_rule_t('gear', 'table_reverse', a_number, any_number, '', unset, reverse_efficiencies, &
      'reverse efficiency at these speeds', fewest=2), &
    key_rule_t('planetary', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('planetary', 'sun', body_or_ground, 1, '', required, anything, &
      "the sun wheel; one of the three members may be 'ground', which does not turn"), &
    key_rule_t('planetary', 'ring', body_or_ground, 1, '', required, anything, 'the ring, an internal wheel'), &
    key_rule_t('planetary', 'carrier', body_or_ground, 1, '', required, anything, &
      'the carrier; its inertia includes the mass of the planets, whose spin is neglected'), &
    key_rule_t('planetary', 'teeth', an_integer, 2, '', required, from_1, &
      'numbers of teeth of sun and ring; the ring has more', ascends=.true.), &
    key_rule_t('planetary', 'efficiency', a_number, 1, '', unset, efficiencies, &
      'share that the ring gets of the power of the sun, with the carrier at rest; 1 without losses'), &
    key_rule_t('planetary', 'reverse_efficiency', a_number, 1, '', unset, reverse_efficiencies, &
      'the same where the ring drives; as efficiency if not given; 0 or less: self-locking'), &
    key_rule_t('planetary', 'table_speed', a_number, any_number, 'rad/s', unset, not_negative, &
      'speeds of the sun against the carrier of the points of a table of efficiencies, from 0 on', fewest=2, ascends=.true.), &
    key_rule_t('planetary', 'table_efficiency', a_number, any_number, '', unset, efficiencies, &
      'efficiency at these speeds; beyond the last point as there', fewest=2), &
    key_rule_t('planetary', 'table_reverse', a_number, any_number, '', unset, reverse_efficiencies, &
      'reverse efficiency at these speeds', fewest=2), &
    key_rule_t('differential', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('differential', 'sides', body_or_ground, 2, '', required, anything, &
      "the two side shafts; one of the three members may be 'ground', which does not turn"), &
    key_rule_t('differential', 'case', body_or_ground, 1, '', required, anything, &
      'the case, which turns with the mean speed of the sides'), &
    key_rule_t('constraint', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('constraint', 'bodies', a_body, any_number, '', required, anything, &
      'the bodies whose speeds are related', fewest=1), &
    key_rule_t('constraint', 'coefficients', a_number, any_number, '', required, not_zero, 'as many numbers as bodies', fewest=1)]

  type(relation_rule_t), parameter, public :: constraint_relations(*) = [ &
    relation_rule_t('gear', exactly_one, 'radii', 'teeth'), &
    relation_rule_t('gear', at_most_one, 'efficiency reverse_efficiency', 'table_speed table_efficiency'), &
    relation_rule_t('gear', requires, 'reverse_efficiency', 'efficiency'), &
    relation_rule_t('gear', requires, 'table_reverse', 'table_efficiency'), &
    relation_rule_t('gear', equal_lengths, 'table_speed table_efficiency', ''), &
    relation_rule_t('planetary', at_most_one, 'efficiency reverse_efficiency', 'table_speed table_efficiency'), &
    relation_rule_t('planetary', requires, 'reverse_efficiency', 'efficiency'), &
    relation_rule_t('planetary', requires, 'table_reverse', 'table_efficiency'), &
    relation_rule_t('planetary', equal_lengths, 'table_speed table_efficiency', ''), &
    relation_rule_t('constraint', equal_lengths, 'bodies coefficients', '')]

  type(example_t), parameter, public :: constraint_examples(*) = [ &
    example_t('gear',         "name = 'reducer'  bodies = 'pinion', 'machine' radii = 2.0, 3.0"), &
    example_t('planetary',    "name = 'stage'    sun = 'pinion' ring = 'ground' carrier = 'machine' teeth = 20, 70", .false.), &
    example_t('differential', "name = 'axle'     sides = 'left', 'right' case = 'machine'", .false.), &
    example_t('constraint',   "name = 'summing'  bodies = 'motor', 'pinion', 'machine' coefficients = 1, 0.5, -2", .false.)]

end module nocdyn_schema_constraints
