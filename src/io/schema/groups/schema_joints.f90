!> Rows of the schema: the rigid joints &gear, &planetary, &differential and &constraint; the joints that lock, &clutch and
!> &freewheel; joints whose ratio depends on the position and prescribed motions, &cardan, &crank, &relation and &drive.
module nocdyn_schema_joints
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_body, a_file, a_flag, a_name, a_number, a_selector, a_text, a_word, allowed_t, an_integer, &
    any_number, any_times, anything, at_most_one, body_or_ground, columns, efficiencies, equal_lengths, exactly_one, example_t, &
    from_0_to_1, from_1, group_rule_t, in_machine, in_torques, interpolations, key_rule_t, kind_rule_t, less_than, linear, &
    not_negative, not_zero, positive, relation_rule_t, required, requires, reverse_efficiencies, strokes, unset, up_to_64
  implicit none (type, external)
  private

  type(allowed_t), parameter :: directions = allowed_t(words='forward backward')
  type(allowed_t), parameter :: spline_shapes = allowed_t(words='spline dwells cubic')
  type(allowed_t), parameter :: drive_shapes = allowed_t(words='linear spline dwells cubic')
  type(allowed_t), parameter :: below_right_angle = allowed_t(low=0.0_wp, high=1.57_wp)   ! [rad]

  type(group_rule_t), parameter, public :: joint_groups(*) = [ &
    group_rule_t('gear', in_machine, any_times, 'constraint', &
                 'A rigid gear: R1 omega_1 + R2 omega_2 = 0, a minus if internal.'), &
    group_rule_t('planetary', in_machine, any_times, 'constraint', &
                 'A planetary gear set (Willis): z_s omega_s + z_r omega_r = (z_s + z_r) omega_c.'), &
    group_rule_t('differential', in_machine, any_times, 'constraint', 'A differential: omega_1 + omega_2 = 2 omega_case.'), &
    group_rule_t('constraint', in_machine, any_times, 'constraint', 'Any rigid relation: the sum of coefficient * speed is 0.'), &
    group_rule_t('clutch', in_machine, any_times, 'torque', 'A friction clutch, which locks and slips; on the ground a brake.'), &
    group_rule_t('freewheel', in_machine, any_times, 'torque', &
                 'A freewheel: it locks in one direction and overruns in the other.'), &
    group_rule_t('cardan', in_machine, any_times, 'torque', &
                 'A cardan joint (universal joint) of two bodies whose shafts meet at an angle.'), &
    group_rule_t('crank', in_machine, any_times, 'torque', &
                 'A slider-crank: a piston, its rod and the force on it, on the crank of a body.'), &
    group_rule_t('relation', in_machine, any_times, 'torque', &
                 'A table of the angle of one body over that of another: a cam, non-circular gears.'), &
    group_rule_t('drive', in_torques, any_times, 'torque', &
                 'A prescribed motion of a body; the torque that it needs is a result.')]

  type(kind_rule_t), parameter, public :: joint_kinds(*) = [ &
    kind_rule_t('clutch', 'friction', 'friction of a capacity; it locks where its slip ends'), &
    kind_rule_t('clutch', 'dog',      'teeth that lock at once, by an impact if there is a slip, and hold any torque'), &
    kind_rule_t('relation', 'cam',   'a table over one turn, or any span, that returns and repeats'), &
    kind_rule_t('relation', 'gear',  'the same that advances, always in one direction: non-circular gears'), &
    kind_rule_t('relation', 'lever', 'a table that does not repeat; it goes on straight beyond its ends'), &
    kind_rule_t('drive', 'speed', 'a speed: constant, over the time, oscillating; the sum of those given'), &
    kind_rule_t('drive', 'angle', 'an angle over the time, or oscillating, from that at the start on')]

  type(key_rule_t), parameter, public :: joint_keys(*) = [ &
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
    key_rule_t('constraint', 'coefficients', a_number, any_number, '', required, not_zero, &
      'as many numbers as bodies', fewest=1), &
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
    key_rule_t('clutch', 'levels', a_number, any_number, '', unset, from_0_to_1, &
      'engagement from each of these times on: its share of the capacities; dog: engaged if not 0', fewest=1), &
    key_rule_t('clutch', 'table_time', a_number, any_number, 's', unset, anything, &
      'times of the points of a table of the engagement, ascending', 'friction', fewest=2, ascends=.true.), &
    key_rule_t('clutch', 'table_level', a_number, any_number, '', unset, from_0_to_1, &
      'engagement at these times', 'friction', fewest=2), &
    key_rule_t('clutch', 'interpolation', a_word, 1, '', linear, interpolations, &
      'between points: straight lines, or the monotone cubic of Fritsch and Butland', 'friction'), &
    key_rule_t('freewheel', 'name', a_name, 1, '', required, anything, 'name in messages and results'), &
    key_rule_t('freewheel', 'bodies', body_or_ground, 2, '', required, anything, &
      "driving and driven body; one may be 'ground': a backstop"), &
    key_rule_t('freewheel', 'direction', a_word, 1, '', "'forward'", directions, &
      'forward: the first body cannot overtake the second; backward: it cannot fall behind'), &
    key_rule_t('freewheel', 'capacity', a_number, 1, 'N m', unset, not_negative, &
      'torque above which it slips; it never does if not given'), &
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
    key_rule_t('drive', 'measurement', a_text, 1, '', unset, anything, &
      'in place of the table: name of a &measurement of a speed, or an angle, over the time'), &
    key_rule_t('drive', 'interpolation', a_word, 1, '', unset, drive_shapes, &
      'as of &relation; if not given straight lines between speeds and a spline through angles'), &
    key_rule_t('drive', 'speed_amplitude', a_number, 1, 'rad/s', unset, anything, 'amplitude of a sine that is added', 'speed'), &
    key_rule_t('drive', 'angle_amplitude', a_number, 1, 'rad', unset, anything, 'amplitude of a sine that is added', 'angle'), &
    key_rule_t('drive', 'frequency', a_number, 1, 'rad/s', unset, positive, 'frequency of the sine'), &
    key_rule_t('drive', 'phase', a_number, 1, 'rad', '0', anything, 'phase of the sine at t = 0')]

  type(relation_rule_t), parameter, public :: joint_relations(*) = [ &
    relation_rule_t('gear', exactly_one, 'radii', 'teeth'), &
    relation_rule_t('gear', at_most_one, 'efficiency reverse_efficiency', 'table_speed table_efficiency'), &
    relation_rule_t('gear', requires, 'reverse_efficiency', 'efficiency'), &
    relation_rule_t('gear', requires, 'table_reverse', 'table_efficiency'), &
    relation_rule_t('gear', equal_lengths, 'table_speed table_efficiency', ''), &
    relation_rule_t('planetary', at_most_one, 'efficiency reverse_efficiency', 'table_speed table_efficiency'), &
    relation_rule_t('planetary', requires, 'reverse_efficiency', 'efficiency'), &
    relation_rule_t('planetary', requires, 'table_reverse', 'table_efficiency'), &
    relation_rule_t('planetary', equal_lengths, 'table_speed table_efficiency', ''), &
    relation_rule_t('constraint', equal_lengths, 'bodies coefficients', ''), &
    relation_rule_t('clutch', exactly_one, 'capacity', 'table_slip table_capacity'), &
    relation_rule_t('clutch', equal_lengths, 'table_slip table_capacity', ''), &
    relation_rule_t('clutch', at_most_one, 'times levels', 'table_time table_level'), &
    relation_rule_t('clutch', requires, 'interpolation', 'table_time table_slip'), &
    relation_rule_t('clutch', equal_lengths, 'times levels', ''), &
    relation_rule_t('clutch', equal_lengths, 'table_time table_level', ''), &
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
    relation_rule_t('drive', at_most_one, 'table_time table_speed', 'table_file measurement'), &
    relation_rule_t('drive', at_most_one, 'table_time table_angle', 'table_file measurement'), &
    relation_rule_t('drive', at_most_one, 'table_file', 'measurement'), &
    relation_rule_t('drive', requires, 'interpolation', 'table_time table_file measurement'), &
    relation_rule_t('drive', requires, 'speed_amplitude angle_amplitude', 'frequency'), &
    relation_rule_t('drive', requires, 'frequency phase', 'speed_amplitude angle_amplitude'), &
    relation_rule_t('drive', equal_lengths, 'table_time table_speed', 'table_file'), &
    relation_rule_t('drive', equal_lengths, 'table_time table_angle', 'table_file')]

  type(example_t), parameter, public :: joint_examples(*) = [ &
    example_t('gear',         "name = 'reducer'  bodies = 'pinion', 'machine' radii = 2.0, 3.0"), &
    example_t('planetary',    "name = 'stage'    sun = 'pinion' ring = 'ground' carrier = 'machine' teeth = 20, 70", .false.), &
    example_t('differential', "name = 'axle'     sides = 'left', 'right' case = 'machine'", .false.), &
    example_t('constraint',   "name = 'summing'  bodies = 'motor', 'pinion', 'machine' coefficients = 1, 0.5, -2", .false.), &
    example_t('clutch',    "name = 'engage'   bodies = 'motor', 'machine'  capacity = 120.0|" // &
              'static_capacity = 140.0  times = 0.5, 4.0  levels = 1, 0', .false.), &
    example_t('freewheel', "name = 'backstop' bodies = 'machine', 'ground'  direction = 'backward'", .false.), &
    example_t('cardan',    "name = 'joint'  bodies = 'motor', 'machine'  angle_deg = 20", .false.), &
    example_t('crank',     "name = 'piston'  body = 'motor'  crank_radius = 0.05  rod_length = 0.2|" // &
              'piston_mass = 1.0', .false.), &
    example_t('relation',  "name = 'cam'  bodies = 'motor', 'machine'|" // &
              'table_angle_deg = 0, 90, 180, 270, 360  table_driven_deg = 0, 10, 20, 10, 0', .false.), &
    example_t('drive', "name = 'run_up'  body = 'motor'|" // 'table_time = 0, 5  table_speed_rpm = 0, 1500', .false.)]

end module nocdyn_schema_joints
