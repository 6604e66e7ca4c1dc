!> Rows of the schema: the joints that lock, &clutch and &freewheel.
module nocdyn_schema_joints
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_name, a_number, a_selector, a_word, allowed_t, any_number, any_times, anything, at_most_one, &
    body_or_ground, equal_lengths, exactly_one, example_t, group_rule_t, in_machine, interpolations, key_rule_t, kind_rule_t, &
    not_negative, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  character(len=*), parameter :: linear = "'linear'"
  type(allowed_t), parameter :: directions = allowed_t(words='forward backward')
  type(allowed_t), parameter :: shares = allowed_t(low=0.0_wp, high=1.0_wp)

  type(group_rule_t), parameter, public :: joint_groups(*) = [ &
    group_rule_t('clutch', in_machine, any_times, 'torque', 'A friction clutch, which locks and slips; on the ground a brake.'), &
    group_rule_t('freewheel', in_machine, any_times, 'torque', &
                 'A freewheel: it locks in one direction and overruns in the other.')]

  type(kind_rule_t), parameter, public :: joint_kinds(*) = [ &
    kind_rule_t('clutch', 'friction', 'friction of a capacity; it locks where its slip ends'), &
    kind_rule_t('clutch', 'dog',      'teeth that lock at once, by an impact if there is a slip, and hold any torque')]

  type(key_rule_t), parameter, public :: joint_keys(*) = [ &
    key_rule_t('clutch', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('clutch', 'bodies', body_or_ground, 2, '', required, anything, "the two bodies; one may be 'ground': a brake"), &
    key_rule_t('clutch', 'kind', a_selector, 1, '', "'friction'", anything, 'how it transmits its torque'), &
    key_rule_t('clutch', 'capacity', a_number, 1, 'N m', unset, not_negative, 'friction torque while it slips', 'friction'), &
    key_rule_t('clutch', 'table_slip', a_number, any_number, 'rad/s', unset, not_negative, &
      'speeds of slip of the points of a table of the capacity, from 0 on', 'friction', fewest=2, ascends=.true.), &
    key_rule_t('clutch', 'table_capacity', a_number, any_number, 'N m', unset, not_negative, &
      'friction torque at these speeds; beyond the last point as there', 'friction', fewest=2), &
    key_rule_t('clutch', 'static_capacity', a_number, 1, 'N m', unset, not_negative, &
      'largest torque while it is locked; the same as capacity if not given', 'friction'), &
    key_rule_t('clutch', 'times', a_number, any_number, 's', unset, anything, &
      'times at which the engagement changes; before the first it is 0', fewest=1, ascends=.true.), &
    key_rule_t('clutch', 'levels', a_number, any_number, '', unset, shares, &
      'engagement from each of these times on: its share of the capacities; dog: engaged if not 0', fewest=1), &
    key_rule_t('clutch', 'table_time', a_number, any_number, 's', unset, anything, &
      'times of the points of a table of the engagement, ascending', 'friction', fewest=2, ascends=.true.), &
    key_rule_t('clutch', 'table_level', a_number, any_number, '', unset, shares, &
      'engagement at these times', 'friction', fewest=2), &
    key_rule_t('clutch', 'interpolation', a_word, 1, '', linear, interpolations, &
      'between points: straight lines, or the monotone cubic of Fritsch and Butland', 'friction'), &
    key_rule_t('freewheel', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('freewheel', 'bodies', body_or_ground, 2, '', required, anything, &
      "driving and driven body; one may be 'ground': a backstop"), &
    key_rule_t('freewheel', 'direction', a_word, 1, '', "'forward'", directions, &
      'forward: the first body cannot overtake the second; backward: it cannot fall behind'), &
    key_rule_t('freewheel', 'capacity', a_number, 1, 'N m', unset, not_negative, &
      'torque above which it slips; it never does if not given')]

  type(relation_rule_t), parameter, public :: joint_relations(*) = [ &
    relation_rule_t('clutch', exactly_one, 'capacity', 'table_slip table_capacity'), &
    relation_rule_t('clutch', equal_lengths, 'table_slip table_capacity', ''), &
    relation_rule_t('clutch', at_most_one, 'times levels', 'table_time table_level'), &
    relation_rule_t('clutch', requires, 'interpolation', 'table_time table_slip'), &
    relation_rule_t('clutch', equal_lengths, 'times levels', ''), &
    relation_rule_t('clutch', equal_lengths, 'table_time table_level', '')]

  type(example_t), parameter, public :: joint_examples(*) = [ &
    example_t('clutch',    "name = 'engage'   bodies = 'motor', 'machine'  capacity = 120.0|" // &
              'static_capacity = 140.0  times = 0.5, 4.0  levels = 1, 0', .false.), &
    example_t('freewheel', "name = 'backstop' bodies = 'machine', 'ground'  direction = 'backward'", .false.)]

end module nocdyn_schema_joints
