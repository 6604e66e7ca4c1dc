!> Rows of the schema: keys of &motor, &load and &excitation and how they go together.
module nocdyn_schema_torques
  use nocdyn_schema_rules, only: a_body, a_file, a_kind, a_name, a_number, a_word, alternative_t, an_integer, any_number, &
    anything, columns_t, example_t, extrapolations, from_0_to_1, from_1, interpolations, key_rule_t, kind_rule_t, need_t, &
    not_negative, not_zero, positive, required, unset
  implicit none (type, external)
  private

  character(len=*), parameter :: linear = "'linear'"

  type(kind_rule_t), parameter, public :: torque_kinds(*) = [ &
    kind_rule_t('motor',      'quadratic', 'a - b omega - c omega^2'), &
    kind_rule_t('motor',      'constant',  'the same torque at every speed'), &
    kind_rule_t('motor',      'table',     'torque over speed from a table'), &
    kind_rule_t('motor',      'induction', '2 T_k / (s/s_k + s_k/s), slip s = 1 - omega/synchronous_speed (Kloss)'), &
    kind_rule_t('motor',      'dc',        'flux_constant i; inductance di/dt = voltage - resistance i - flux_constant omega'), &
    kind_rule_t('excitation', 'harmonic',  'amplitude sin(frequency t + phase)'), &
    kind_rule_t('excitation', 'orders',    'the sum of amplitude_k sin(order_k phi + phase_k), phi the angle of the body'), &
    kind_rule_t('excitation', 'table',     'torque over time from a table, whose end values hold outside'), &
    kind_rule_t('excitation', 'step',      '0 before time, amplitude from then on'), &
    kind_rule_t('excitation', 'ramp',      'from 0 at time to amplitude in a straight line, which holds after duration'), &
    kind_rule_t('excitation', 'pulse',     'half a sine of height amplitude from time to time + duration'), &
    kind_rule_t('excitation', 'startup',   'amplitude sin(2 (frequency t - pole_pairs phi) + phase), synchronous motor')]

  type(key_rule_t), parameter, public :: motor_keys(*) = [ &
    key_rule_t('motor',      'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('motor',      'body',            a_body,         1, '',            required,    anything, &
      'the body that it drives'), &
    key_rule_t('motor',      'kind',            a_kind,         1, '',            "'quadratic'", anything, &
      'which law the torque follows; omega is the speed of the body'), &
    key_rule_t('motor',      'a',               a_number,       1, 'N m',         required,    anything, &
      'torque at standstill', 'quadratic'), &
    key_rule_t('motor',      'b',               a_number,       1, 'N m s/rad',   required,    anything, &
      'fall of the torque with the speed', 'quadratic'), &
    key_rule_t('motor',      'c',               a_number,       1, 'N m s2/rad2', required,    anything, &
      'fall of the torque with the square of the speed', 'quadratic'), &
    key_rule_t('motor',      'torque',          a_number,       1, 'N m',         required,    anything, &
      'the torque', 'constant'), &
    key_rule_t('motor',      'table_speed',     a_number,       any_number, 'rad/s', unset,    anything, &
      'speeds of the points of a table, ascending', 'table', least=2), &
    key_rule_t('motor',      'table_torque',    a_number,       any_number, 'N m', unset,      anything, &
      'torque at these speeds', 'table', least=2), &
    key_rule_t('motor',      'table_file',      a_file,         1, '',            unset,       anything, &
      'file with the table: two columns, speed [rad/s] and torque [N m]', 'table'), &
    key_rule_t('motor',      'interpolation',   a_word,         1, '',            linear,      interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland', 'table'), &
    key_rule_t('motor',      'extrapolation',   a_word,         1, '',            linear,      extrapolations, &
      'beyond the table: its end slope goes on, or its end value holds', 'table'), &
    key_rule_t('motor',      'breakdown_torque', a_number,      1, 'N m',         required,    not_zero, &
      'T_k, the largest torque; it has the sign of synchronous_speed', 'induction'), &
    key_rule_t('motor',      'breakdown_slip',  a_number,       1, '',            required,    positive, &
      's_k, the slip of the largest torque', 'induction'), &
    key_rule_t('motor',      'synchronous_speed', a_number,     1, 'rad/s',       required,    not_zero, &
      'speed without slip', 'induction'), &
    key_rule_t('motor',      'voltage',         a_number,       1, 'V',           required,    anything, &
      'voltage of the supply', 'dc'), &
    key_rule_t('motor',      'resistance',      a_number,       1, 'Ohm',         required,    positive, &
      'resistance of the armature', 'dc'), &
    key_rule_t('motor',      'flux_constant',   a_number,       1, 'V s/rad',     required,    not_zero, &
      'torque per current, which is voltage per speed', 'dc'), &
    key_rule_t('motor',      'inductance',      a_number,       1, 'H',           '0',         not_negative, &
      'inductance of the armature; 0: the current follows at once', 'dc'), &
    key_rule_t('motor',      'governor_speed',  a_number,       1, 'rad/s',       unset,       anything, &
      'speed that a PI governor keeps by a throttle from 0 to 1 on the torque (dc: on the voltage)'), &
    key_rule_t('motor',      'governor_gain',   a_number,       1, 's/rad',       unset,       not_zero, &
      'throttle = z + governor_gain (governor_speed - omega); gain < 0 if the motor turns backwards'), &
    key_rule_t('motor',      'governor_time',   a_number,       1, 's',           unset,       positive, &
      'integral time: z'' = (throttle - z) / governor_time'), &
    key_rule_t('motor',      'governor_start',  a_number,       1, '',            '1',         from_0_to_1, &
      'throttle at the start')]

  type(key_rule_t), parameter, public :: load_keys(*) = [ &
    key_rule_t('load',       'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('load',       'body',            a_body,         1, '',            required,    anything, &
      'the body that it brakes'), &
    key_rule_t('load',       'viscous',         a_number,       1, 'N m s/rad',   '0',         not_negative, &
      'torque per speed'), &
    key_rule_t('load',       'quadratic',       a_number,       1, 'N m s2/rad2', '0',         not_negative, &
      'torque per square of the speed, against the motion: fan, propeller'), &
    key_rule_t('load',       'constant',        a_number,       1, 'N m',         '0',         not_negative, &
      'torque against the motion: constant tanh(omega / constant_speed)'), &
    key_rule_t('load',       'constant_speed',  a_number,       1, 'rad/s',       '0.01',      positive, &
      'speed at which the constant torque has 76 % of its full value'), &
    key_rule_t('load',       'table_speed',     a_number,       any_number, 'rad/s', unset,    anything, &
      'speeds of the points of a table, ascending', least=2), &
    key_rule_t('load',       'table_torque',    a_number,       any_number, 'N m', unset,      anything, &
      'resisting torque at these speeds; positive resists a positive speed', least=2), &
    key_rule_t('load',       'table_file',      a_file,         1, '',            unset,       anything, &
      'file with the table: two columns, speed [rad/s] and resisting torque [N m]'), &
    key_rule_t('load',       'interpolation',   a_word,         1, '',            linear,      interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland'), &
    key_rule_t('load',       'extrapolation',   a_word,         1, '',            linear,      extrapolations, &
      'beyond the table: its end slope goes on, or its end value holds')]

  type(key_rule_t), parameter, public :: excitation_keys(*) = [ &
    key_rule_t('excitation', 'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('excitation', 'body',            a_body,         1, '',            required,    anything, &
      'the body that it shakes'), &
    key_rule_t('excitation', 'kind',            a_kind,         1, '',            "'harmonic'", anything, &
      'which law the torque follows'), &
    key_rule_t('excitation', 'amplitude',       a_number,       1, 'N m',         required,    anything, &
      'largest torque', 'harmonic step ramp pulse startup'), &
    key_rule_t('excitation', 'frequency',       a_number,       1, 'rad/s',       required,    not_negative, &
      'angular frequency; that of the mains for a start-up', 'harmonic startup'), &
    key_rule_t('excitation', 'phase',           a_number,       1, 'rad',         '0',         anything, &
      'phase at t = 0', 'harmonic startup'), &
    key_rule_t('excitation', 'orders',          a_number,       any_number, '',   required,    positive, &
      'oscillations per turn of the body, e.g. 0.5, 1, 1.5 of a four-stroke engine', 'orders', 1), &
    key_rule_t('excitation', 'amplitudes',      a_number,       any_number, 'N m', required,   anything, &
      'largest torque of each order', 'orders', 1), &
    key_rule_t('excitation', 'phases',          a_number,       any_number, 'rad', '0',        anything, &
      'phase of each order at phi = 0', 'orders', 1), &
    key_rule_t('excitation', 'table_time',      a_number,       any_number, 's',  unset,       anything, &
      'times of the points of a table, ascending', 'table', least=2), &
    key_rule_t('excitation', 'table_torque',    a_number,       any_number, 'N m', unset,      anything, &
      'torque at these times', 'table', least=2), &
    key_rule_t('excitation', 'table_file',      a_file,         1, '',            unset,       anything, &
      'file with the table: two columns, time [s] and torque [N m]', 'table'), &
    key_rule_t('excitation', 'interpolation',   a_word,         1, '',            linear,      interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland', 'table'), &
    key_rule_t('excitation', 'time',            a_number,       1, 's',           required,    anything, &
      'when it begins', 'step ramp pulse'), &
    key_rule_t('excitation', 'duration',        a_number,       1, 's',           required,    positive, &
      'how long the ramp rises, how long the pulse lasts', 'ramp pulse'), &
    key_rule_t('excitation', 'pole_pairs',      an_integer,     1, '',            required,    from_1, &
      'pole pairs of the motor', 'startup')]

  type(alternative_t), parameter, public :: torque_alternatives(*) = [ &
    alternative_t('motor',      'table_speed table_torque', 'table_file', is_needed=.true.), &
    alternative_t('load',       'table_speed table_torque', 'table_file'), &
    alternative_t('excitation', 'table_time table_torque',  'table_file', is_needed=.true.)]

  type(need_t), parameter, public :: torque_needs(*) = [ &
    need_t('motor', 'governor_speed', 'governor_gain'), &
    need_t('motor', 'governor_speed', 'governor_time'), &
    need_t('motor', 'governor_gain governor_time governor_start', 'governor_speed'), &
    need_t('load',  'constant_speed', 'constant'), &
    need_t('load',  'interpolation extrapolation', 'table_speed table_file')]

  type(columns_t), parameter, public :: torque_columns(*) = [ &
    columns_t('motor',      'table_speed table_torque', 'table_file'), &
    columns_t('load',       'table_speed table_torque', 'table_file'), &
    columns_t('excitation', 'table_time table_torque',  'table_file'), &
    columns_t('excitation', 'orders amplitudes phases')]

  type(example_t), parameter, public :: torque_examples(*) = [ &
    example_t('motor',      "name = 'drive'    body = 'motor'    a = 200.0  b = 10.0  c = 1.0"), &
    example_t('motor',      "name = 'mains'    body = 'motor'    kind = 'induction'|" // &
                            'breakdown_torque = 100.0  breakdown_slip = 0.2  synchronous_speed = 157.08', .false.), &
    example_t('motor',      "name = 'diesel'   body = 'motor'    kind = 'table'|" // &
                            'table_speed = 60, 120, 180  table_torque = 250, 310, 270|' // &
                            'governor_speed = 150.0  governor_gain = 0.1  governor_time = 2.0', .false.), &
    example_t('load',       "name = 'work'     body = 'machine'  viscous = 100.0"), &
    example_t('load',       "name = 'fan'      body = 'machine'  quadratic = 0.01  constant = 2.0", .false.), &
    example_t('excitation', "name = 'shaker'   body = 'motor'    amplitude = 20.0  frequency = 5.0"), &
    example_t('excitation', "name = 'engine'   body = 'motor'    kind = 'orders'|" // &
                            'orders = 2, 4, 6  amplitudes = 90.0, 40.0, 15.0', .false.), &
    example_t('excitation', "name = 'blow'     body = 'machine'  kind = 'pulse'|" // &
                            'amplitude = -500.0  time = 2.0  duration = 0.05', .false.)]

end module nocdyn_schema_torques
