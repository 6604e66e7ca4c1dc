!> Rows of the schema: joints whose ratio depends on the position, and prescribed motions: &cardan, &crank, &relation, &drive.
module nocdyn_schema_motions
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_body, a_file, a_name, a_number, a_selector, a_word, allowed_t, an_integer, any_number, &
    any_times, anything, at_most_one, columns, equal_lengths, example_t, exactly_one, group_rule_t, in_machine, in_torques, &
    key_rule_t, kind_rule_t, less_than, not_negative, positive, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: spline_shapes = allowed_t(words='spline dwells cubic')
  type(allowed_t), parameter :: drive_shapes = allowed_t(words='linear spline dwells cubic')
  type(allowed_t), parameter :: below_right_angle = allowed_t(low=0.0_wp, high=1.57_wp)   ! [rad]

  type(allowed_t), parameter :: strokes = allowed_t(low=2.0_wp, high=4.0_wp)
  type(allowed_t), parameter :: up_to_64 = allowed_t(low=0.0_wp, high=64.0_wp, excludes_low=.true.)

  type(group_rule_t), parameter, public :: motion_groups(*) = [ &
    group_rule_t('cardan', in_machine, any_times, 'torque', &
                 'A cardan joint (universal joint) of two bodies whose shafts meet at an angle.'), &
    group_rule_t('crank', in_machine, any_times, 'torque', &
                 'A slider-crank: a piston, its rod and the force on it, on the crank of a body.'), &
    group_rule_t('relation', in_machine, any_times, 'torque', &
                 'A table of the angle of one body over that of another: a cam, non-circular gears.'), &
    group_rule_t('drive', in_torques, any_times, 'torque', &
                 'A prescribed motion of a body; the torque that it needs is a result.')]

  type(kind_rule_t), parameter, public :: motion_kinds(*) = [ &
    kind_rule_t('relation', 'cam',   'a table over one turn, or any span, that returns and repeats'), &
    kind_rule_t('relation', 'gear',  'the same that advances, always in one direction: non-circular gears'), &
    kind_rule_t('relation', 'lever', 'a table that does not repeat; it goes on straight beyond its ends'), &
    kind_rule_t('drive', 'speed', 'a speed: constant, over the time, oscillating; the sum of those given'), &
    kind_rule_t('drive', 'angle', 'an angle over the time, or oscillating, from that at the start on')]

  type(key_rule_t), parameter, public :: motion_keys(*) = [ &
    key_rule_t('cardan', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('cardan', 'bodies', a_body, 2, '', required, anything, 'driving and driven body'), &
    key_rule_t('cardan', 'angle', a_number, 1, 'rad', required, below_right_angle, 'angle between the two shafts'), &
    key_rule_t('cardan', 'phase', a_number, 1, 'rad', '0', anything, &
      'angle of the first fork out of the plane of the shafts where the angle of its body is 0'), &
    key_rule_t('crank', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('crank', 'body', a_body, 1, '', required, anything, 'the body with the crank'), &
    key_rule_t('crank', 'crank_radius', a_number, 1, 'm', required, positive, 'half the travel of the piston'), &
    key_rule_t('crank', 'rod_length', a_number, 1, 'm', required, positive, &
      'length of the connecting rod, more than crank_radius and offset together'), &
    key_rule_t('crank', 'offset', a_number, 1, 'm', '0', anything, &
      "distance of the piston's line from the axis of the crank, to the side of a quarter turn"), &
    key_rule_t('crank', 'phase', a_number, 1, 'rad', '0', anything, &
      'angle of the crank where the angle of its body is 0; at 0 it points to the piston'), &
    key_rule_t('crank', 'piston_mass', a_number, 1, 'kg', required, positive, 'mass of piston, pin and what moves with them'), &
    key_rule_t('crank', 'rod_mass', a_number, 1, 'kg', '0', not_negative, 'mass of the connecting rod'), &
    key_rule_t('crank', 'rod_center', a_number, 1, 'm', unset, not_negative, &
      'distance of its centre of mass from the crank pin'), &
    key_rule_t('crank', 'rod_inertia', a_number, 1, 'kg m2', unset, positive, &
      'its moment of inertia about the centre of mass; if not given, its mass is on its ends'), &
    key_rule_t('crank', 'stroke', an_integer, 1, '', '2', strokes, 'the force repeats; 2: every turn; 4: every other turn'), &
    key_rule_t('crank', 'crank_angles', a_number, any_number, 'rad', unset, anything, &
      'angles of the crank over one cycle, ascending; at 0 it points to the piston', fewest=8, ascends=.true.), &
    key_rule_t('crank', 'pressures', a_number, any_number, 'Pa', unset, anything, &
      'pressure on the piston at these angles', fewest=8), &
    key_rule_t('crank', 'pressure_file', a_file, 1, '', unset, anything, 'file with the columns crank_angle_deg, pressure'), &
    key_rule_t('crank', 'crankcase_pressure', a_number, 1, 'Pa', '0', not_negative, &
      'pressure below the piston; 0 if pressures are above that of the atmosphere'), &
    key_rule_t('crank', 'bore', a_number, 1, 'm', unset, positive, 'diameter of the piston'), &
    key_rule_t('crank', 'forces', a_number, any_number, 'N', unset, anything, &
      'in place of pressures: force on the piston at these angles, towards the crank', fewest=8), &
    key_rule_t('crank', 'harmonics_up_to', a_number, 1, '', '24', up_to_64, &
      'highest order of the crank that is taken from pressures or forces'), &
    key_rule_t('relation', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('relation', 'bodies', a_body, 2, '', required, anything, 'driving and driven body'), &
    key_rule_t('relation', 'kind', a_selector, 1, '', "'cam'", anything, 'what the table is'), &
    key_rule_t('relation', 'table_angle', a_number, any_number, 'rad', unset, anything, &
      'angles of the first body, ascending; a spline lies between them', fewest=3, ascends=.true.), &
    key_rule_t('relation', 'table_driven', a_number, any_number, 'rad', unset, anything, 'angles of the second body', fewest=3), &
    key_rule_t('relation', 'table_file', a_file, 1, '', unset, anything, 'two columns, the angles of both [rad]'), &
    key_rule_t('relation', 'interpolation', a_word, 1, '', "'spline'", spline_shapes, &
      'a spline; splines between dwells, which stay; or a monotone cubic, whose accelerations jump'), &
    key_rule_t('drive', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('drive', 'body', a_body, 1, '', required, anything, 'the body that is moved'), &
    key_rule_t('drive', 'kind', a_selector, 1, '', "'speed'", anything, 'what is prescribed'), &
    key_rule_t('drive', 'speed', a_number, 1, 'rad/s', '0', anything, 'constant speed; 0 holds the body still', 'speed'), &
    key_rule_t('drive', 'table_time', a_number, any_number, 's', unset, anything, &
      'times of the points of a table, ascending', fewest=2), &
    key_rule_t('drive', 'table_speed', a_number, any_number, 'rad/s', unset, anything, &
      'speed at these times, with ramps between them; constant before the first and after the last', 'speed', fewest=2), &
    key_rule_t('drive', 'table_angle', a_number, any_number, 'rad', unset, anything, &
      'angle at these times; a spline between them, straight on beyond them', 'angle', fewest=2), &
    key_rule_t('drive', 'table_file', a_file, 1, '', unset, anything, 'two columns, time [s] and speed [rad/s] or angle [rad]'), &
    key_rule_t('drive', 'interpolation', a_word, 1, '', unset, drive_shapes, &
      'as of &relation; if not given straight lines between speeds and a spline through angles'), &
    key_rule_t('drive', 'speed_amplitude', a_number, 1, 'rad/s', unset, anything, 'amplitude of a sine that is added', 'speed'), &
    key_rule_t('drive', 'angle_amplitude', a_number, 1, 'rad', unset, anything, 'amplitude of a sine that is added', 'angle'), &
    key_rule_t('drive', 'frequency', a_number, 1, 'rad/s', unset, positive, 'frequency of the sine'), &
    key_rule_t('drive', 'phase', a_number, 1, 'rad', '0', anything, 'phase of the sine at t = 0')]

  type(relation_rule_t), parameter, public :: motion_relations(*) = [ &
    relation_rule_t('crank', less_than, 'crank_radius', 'rod_length'), &
    relation_rule_t('crank', less_than, 'rod_center', 'rod_length'), &
    relation_rule_t('crank', requires, 'rod_center rod_inertia', 'rod_mass'), &
    relation_rule_t('crank', requires, 'rod_inertia', 'rod_center'), &
    relation_rule_t('crank', at_most_one, 'pressures pressure_file bore', 'forces'), &
    relation_rule_t('crank', at_most_one, 'pressure_file', 'crank_angles pressures'), &
    relation_rule_t('crank', requires, 'pressures pressure_file', 'bore'), &
    relation_rule_t('crank', requires, 'bore crankcase_pressure', 'pressures pressure_file'), &
    relation_rule_t('crank', requires, 'harmonics_up_to stroke', 'pressures pressure_file forces'), &
    relation_rule_t('crank', requires, 'forces', 'crank_angles'), &
    relation_rule_t('crank', equal_lengths, 'crank_angles forces', ''), &
    relation_rule_t('crank', columns, 'crank_angles pressures', 'pressure_file'), &
    relation_rule_t('relation', exactly_one, 'table_angle table_driven', 'table_file'), &
    relation_rule_t('relation', equal_lengths, 'table_angle table_driven', 'table_file'), &
    relation_rule_t('drive', at_most_one, 'table_time table_speed', 'table_file'), &
    relation_rule_t('drive', at_most_one, 'table_time table_angle', 'table_file'), &
    relation_rule_t('drive', requires, 'interpolation', 'table_time table_file'), &
    relation_rule_t('drive', requires, 'speed_amplitude angle_amplitude', 'frequency'), &
    relation_rule_t('drive', requires, 'frequency phase', 'speed_amplitude angle_amplitude'), &
    relation_rule_t('drive', equal_lengths, 'table_time table_speed', 'table_file'), &
    relation_rule_t('drive', equal_lengths, 'table_time table_angle', 'table_file')]

  type(example_t), parameter, public :: motion_examples(*) = [ &
    example_t('cardan',    "name = 'joint'  bodies = 'motor', 'machine'  angle_deg = 20", .false.), &
    example_t('crank',     "name = 'piston'  body = 'motor'  crank_radius = 0.05  rod_length = 0.2|" // &
              'piston_mass = 1.0', .false.), &
    example_t('relation',  "name = 'cam'  bodies = 'motor', 'machine'|" // &
              'table_angle_deg = 0, 90, 180, 270, 360  table_driven_deg = 0, 10, 20, 10, 0', .false.), &
    example_t('drive', "name = 'run_up'  body = 'motor'|" // 'table_time = 0, 5  table_speed_rpm = 0, 1500', .false.)]

end module nocdyn_schema_motions
