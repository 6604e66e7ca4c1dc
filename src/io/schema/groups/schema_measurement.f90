!> Rows of the schema: what was measured of the machine, &measurement.
module nocdyn_schema_measurement
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_file, a_name, a_number, a_selector, a_text, a_word, allowed_t, an_integer, any_number, &
    any_times, anything, exactly_one, example_t, from_1, group_rule_t, in_torsional, key_rule_t, kind_rule_t, less_than, &
    not_negative, not_zero, positive, records, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: statistics = allowed_t(words='half_range largest smallest mean')
  type(allowed_t), parameter :: alignments = allowed_t(words='given found drifting')
  type(allowed_t), parameter :: fractions = allowed_t(low=0.0_wp, high=1.0_wp)

  type(group_rule_t), parameter, public :: measurement_groups(*) = [ &
    group_rule_t('measurement', in_torsional, any_times, 'measurement', &
                 'What was measured, beside runs, responses and modes, or driving a run.')]

  type(kind_rule_t), parameter, public :: measurement_kinds(*) = [ &
    kind_rule_t('measurement', 'series',    'values over the time, compared with nocdyn run'), &
    kind_rule_t('measurement', 'order',     'amplitudes of an order over the speed, compared with nocdyn response'), &
    kind_rule_t('measurement', 'frequency', 'natural frequencies and dampings, compared with nocdyn modes'), &
    kind_rule_t('measurement', 'peak',      'one value of a motion, compared with nocdyn run or response')]

  type(key_rule_t), parameter, public :: measurement_keys(*) = [ &
    key_rule_t('measurement', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('measurement', 'kind', a_selector, 1, '', "'series'", anything, 'what was measured'), &
    key_rule_t('measurement', 'signal', a_text, 1, '', unset, anything, &
      "what was measured, as its column is named in results, e.g. 'total_moment_shaft'", 'series order peak'), &
    key_rule_t('measurement', 'times', a_number, any_number, 's', unset, anything, 'times of the values, ascending', &
      'series order', fewest=2, ascends=.true.), &
    key_rule_t('measurement', 'speeds', a_number, any_number, 'rad/s', unset, anything, &
      'speeds of the body of &response at the amplitudes, or at the times', 'order', fewest=1), &
    key_rule_t('measurement', 'pulses', a_number, any_number, '', unset, anything, &
      'signal of a pickup at the times, in place of speeds', 'order', fewest=4), &
    key_rule_t('measurement', 'values', a_number, any_number, '', unset, anything, &
      'measured values; of an order its amplitudes or, with times, the signal that has it', 'series order peak', &
      fewest=1), &
    key_rule_t('measurement', 'file', a_file, 1, '', unset, anything, &
      'file of a recorder in place of the lists: columns separated by ; , tabs or blanks', 'series order'), &
    key_rule_t('measurement', 'column', a_text, 1, '', unset, anything, &
      'column of the values in the file: its heading or number; the one after the time if not given', 'series order'), &
    key_rule_t('measurement', 'time_column', a_text, 1, '', unset, anything, &
      'column of the time; the first one of a series if not given', 'series order'), &
    key_rule_t('measurement', 'speed_column', a_text, 1, '', unset, anything, &
      'column of the speed; the first one if neither this nor time_column is given', 'order'), &
    key_rule_t('measurement', 'pulse_column', a_text, 1, '', unset, anything, 'column of the pulses', 'order'), &
    key_rule_t('measurement', 'time_unit', a_text, 1, '', unset, anything, &
      'unit of the time in the file; of its heading if not given, else s', 'series order'), &
    key_rule_t('measurement', 'speed_unit', a_text, 1, '', unset, anything, &
      'unit of the speed in the file; of its heading if not given, else rad/s', 'order'), &
    key_rule_t('measurement', 'gaps', an_integer, 1, '', unset, not_negative, &
      'rows of the file without a value, which are left out: it is counted', 'series order'), &
    key_rule_t('measurement', 'unit', a_text, 1, '', unset, anything, &
      "unit of the values, e.g. 'kN m'; of the heading if not given, else that of the signal", 'series order peak'), &
    key_rule_t('measurement', 'scale', a_number, 1, '', '1', not_zero, 'factor of the values', 'series order peak'), &
    key_rule_t('measurement', 'offset', a_number, 1, '', '0', anything, &
      'added to the values after their factor, in their unit', 'series order peak'), &
    key_rule_t('measurement', 'delay', a_number, 1, 's', '0', anything, &
      'added to the times: the time of the run at the time 0 of the recorder', 'series'), &
    key_rule_t('measurement', 'alignment', a_word, 1, '', "'given'", alignments, &
      'of the clocks: by delay; found near it by cross-correlation; drifting: for each interval', 'series'), &
    key_rule_t('measurement', 'largest_shift', a_number, 1, 's', unset, positive, &
      'largest correction of delay that is looked for; a tenth of the record if not given', 'series'), &
    key_rule_t('measurement', 'largest_drift', a_number, 1, 's', unset, positive, &
      'largest shift of an interval beside the common delay; 0.05 if not given', 'series'), &
    key_rule_t('measurement', 'drift_interval', a_number, 1, 's', unset, positive, &
      'time over which a drifting clock gets one shift; 1 if not given', 'series'), &
    key_rule_t('measurement', 'frequency_band', a_number, 2, 'rad/s', unset, not_negative, &
      'lowest and highest frequency that are compared; all if not given', 'series'), &
    key_rule_t('measurement', 'order', a_number, 1, '', unset, positive, &
      'oscillations per turn of the body of &response', 'order', required_if='order'), &
    key_rule_t('measurement', 'pulses_per_turn', a_number, 1, '', unset, positive, 'of the pickup', 'order'), &
    key_rule_t('measurement', 'turns', an_integer, 1, '', '8', from_1, &
      'turns of the body in one amplitude that is found from a record', 'order'), &
    key_rule_t('measurement', 'frequency', a_number, any_number, 'rad/s', unset, positive, 'natural frequencies, damped', &
      'frequency', fewest=1, required_if='frequency'), &
    key_rule_t('measurement', 'relative_damping', a_number, any_number, '', unset, fractions, &
      'damping ratios of these modes', 'frequency', fewest=1), &
    key_rule_t('measurement', 'modes', an_integer, any_number, '', unset, from_1, &
      'numbers of these modes; the nearest ones if not given', 'frequency', fewest=1), &
    key_rule_t('measurement', 'statistic', a_word, 1, '', "'half_range'", statistics, &
      'what the value is of: half the range, the largest or smallest value, the mean', 'peak'), &
    key_rule_t('measurement', 'speed', a_number, 1, 'rad/s', unset, not_zero, &
      'speed of the body of &response at which it was measured; if not given it is one of a run', 'peak'), &
    key_rule_t('measurement', 'deviation', a_number, 1, '', unset, positive, &
      'standard deviation of the values, in their unit; of frequencies relative to them'), &
    key_rule_t('measurement', 'damping_deviation', a_number, 1, '', unset, positive, &
      'standard deviation of relative_damping; the relative one of the frequencies if not given', 'frequency'), &
    key_rule_t('measurement', 'from', a_number, 1, 's', unset, anything, &
      'only values from this time of the run on', 'series peak'), &
    key_rule_t('measurement', 'until', a_number, 1, 's', unset, anything, 'only values up to this time', 'series'), &
    key_rule_t('measurement', 'speed_range', a_number, 2, 'rad/s', unset, anything, &
      'only amplitudes between these speeds', 'order')]

  type(relation_rule_t), parameter, public :: measurement_relations(*) = [ &
    relation_rule_t('measurement', exactly_one, 'speeds pulses values', 'file'), &
    relation_rule_t('measurement', exactly_one, 'times values', 'file'), &
    relation_rule_t('measurement', requires, 'column time_column speed_column', 'file'), &
    relation_rule_t('measurement', requires, 'pulse_column time_unit speed_unit', 'file'), &
    relation_rule_t('measurement', less_than, 'from', 'until'), &
    relation_rule_t('measurement', requires, 'damping_deviation', 'relative_damping'), &
    relation_rule_t('measurement', requires, 'largest_drift drift_interval', 'alignment', word='drifting'), &
    relation_rule_t('measurement', requires, 'pulses_per_turn', 'pulses pulse_column'), &
    relation_rule_t('measurement', records, 'times speeds pulses values', &
                    'file time_column speed_column pulse_column column time_unit speed_unit unit gaps')]

  type(example_t), parameter, public :: measurement_examples(*) = [ &
    example_t('measurement', "name = 'strain_gauge'  signal = 'total_moment_coupling'|" // &
                             'times = 0, 0.01, 0.02  values = 0, 12.5, 31.0  deviation = 2.0', .false.)]

end module nocdyn_schema_measurement
