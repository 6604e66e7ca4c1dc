!> Rows of the schema: joints whose ratio depends on the position, and prescribed motions: &cardan, &crank, &relation, &drive.
module nocdyn_schema_motions
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_body, a_file, a_name, a_number, a_selector, a_word, allowed_t, any_number, any_times, anything, &
    at_most_one, equal_lengths, example_t, group_rule_t, in_machine, in_torques, &
    interpolations, key_rule_t, kind_rule_t, positive, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  character(len=*), parameter :: linear = "'linear'"
  type(allowed_t), parameter :: below_right_angle = allowed_t(low=0.0_wp, high=1.57_wp)   ! [rad]

  type(group_rule_t), parameter, public :: motion_groups(*) = [ &
    group_rule_t('cardan', in_machine, any_times, 'torque', &
                 'A cardan joint (universal joint) of two bodies whose shafts meet at an angle.'), &
    group_rule_t('drive', in_torques, any_times, 'torque', &
                 'A prescribed motion of a body; the torque that it needs is a result.')]

  type(kind_rule_t), parameter, public :: motion_kinds(*) = [ &
    kind_rule_t('drive', 'speed', 'a speed: constant, over the time, oscillating; the sum of those given'), &
    kind_rule_t('drive', 'angle', 'an angle over the time, or oscillating, from that at the start on')]

  type(key_rule_t), parameter, public :: motion_keys(*) = [ &
    key_rule_t('cardan',     'name',            a_name,         1, '',            required,    anything, &
      'name in messages and results'), &
    key_rule_t('cardan',     'bodies',          a_body,         2, '',            required,    anything, &
      'driving and driven body'), &
    key_rule_t('cardan',     'angle',           a_number,       1, 'rad',         required,    below_right_angle, &
      'angle between the two shafts'), &
    key_rule_t('cardan',     'phase',           a_number,       1, 'rad',         '0',         anything, &
      'angle of the first fork out of the plane of the shafts where the angle of its body is 0'), &
    key_rule_t('drive',      'name',            a_name,         1, '',            required,    anything, &
      'name in messages and results'), &
    key_rule_t('drive',      'body',            a_body,         1, '',            required,    anything, &
      'the body that is moved'), &
    key_rule_t('drive',      'kind',            a_selector,     1, '',            "'speed'",   anything, &
      'what is prescribed'), &
    key_rule_t('drive',      'speed',           a_number,       1, 'rad/s',       '0',         anything, &
      'constant speed; 0 holds the body still', 'speed'), &
    key_rule_t('drive',      'table_time',      a_number,       any_number, 's',  unset,       anything, &
      'times of the points of a table, ascending', fewest=2, ascends=.true.), &
    key_rule_t('drive',      'table_speed',     a_number,       any_number, 'rad/s', unset,    anything, &
      'speed at these times: a ramp between two of them; constant before the first and after the last', 'speed', fewest=2), &
    key_rule_t('drive',      'table_angle',     a_number,       any_number, 'rad', unset,      anything, &
      'angle at these times; a monotone cubic between them, straight on beyond them', 'angle', fewest=2), &
    key_rule_t('drive',      'table_file',      a_file,         1, '',            unset,       anything, &
      'two columns, time [s] and speed [rad/s] or angle [rad]'), &
    key_rule_t('drive',      'interpolation',   a_word,         1, '',            linear,      interpolations, &
      'of the speed between points: straight lines, or the monotone cubic of Fritsch and Butland', 'speed'), &
    key_rule_t('drive',      'speed_amplitude', a_number,       1, 'rad/s',       unset,       anything, &
      'amplitude of a sine that is added', 'speed'), &
    key_rule_t('drive',      'angle_amplitude', a_number,       1, 'rad',         unset,       anything, &
      'amplitude of a sine that is added', 'angle'), &
    key_rule_t('drive',      'frequency',       a_number,       1, 'rad/s',       unset,       positive, &
      'frequency of the sine'), &
    key_rule_t('drive',      'phase',           a_number,       1, 'rad',         '0',         anything, &
      'phase of the sine at t = 0')]

  type(relation_rule_t), parameter, public :: motion_relations(*) = [ &
    relation_rule_t('drive', at_most_one, 'table_time table_speed', 'table_file'), &
    relation_rule_t('drive', at_most_one, 'table_time table_angle', 'table_file'), &
    relation_rule_t('drive', requires, 'interpolation', 'table_time table_file'), &
    relation_rule_t('drive', requires, 'speed_amplitude angle_amplitude', 'frequency'), &
    relation_rule_t('drive', requires, 'frequency phase', 'speed_amplitude angle_amplitude'), &
    relation_rule_t('drive', equal_lengths, 'table_time table_speed', 'table_file'), &
    relation_rule_t('drive', equal_lengths, 'table_time table_angle', 'table_file')]

  type(example_t), parameter, public :: motion_examples(*) = [ &
    example_t('cardan',    "name = 'joint'  bodies = 'motor', 'machine'  angle_deg = 20", .false.), &
    example_t('drive',     "name = 'run_up'  body = 'motor'|" // &
              'table_time = 0, 5  table_speed_rpm = 0, 1500', .false.)]

end module nocdyn_schema_motions
