!> Rows of the schema: the groups &sweep, &vary and &record with their keys.
module nocdyn_schema_sweep
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_file, a_number, a_selector, a_text, a_word, alias_t, allowed_t, an_integer, any_number, &
    any_times, anything, at_most_once, at_most_one, example_t, from_1, group_rule_t, in_sweeps, key_rule_t, kind_rule_t, &
    less_than, not_negative, positive, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: scales = allowed_t(words='absolute relative')
  type(allowed_t), parameter :: sample_counts = allowed_t(low=1.0_wp, high=2.0e9_wp)

  type(group_rule_t), parameter, public :: sweep_groups(*) = [ &
    group_rule_t('sweep', in_sweeps, at_most_once, '', 'Which variants a sweep computes. Other commands ignore it.'), &
    group_rule_t('vary', in_sweeps, any_times, '', 'A number of the input that a sweep varies.'), &
    group_rule_t('record', in_sweeps, any_times, '', &
                 'What a sweep stores of each variant: statistics, modes, responses, trajectories.')]

  type(kind_rule_t), parameter, public :: sweep_kinds(*) = [ &
    kind_rule_t('sweep',  'grid',    'every combination; the last &vary runs fastest'), &
    kind_rule_t('sweep',  'random',  'independent random numbers'), &
    kind_rule_t('sweep',  'latin',   'a Latin hypercube: one sample in each of as many equally probable intervals'), &
    kind_rule_t('sweep',  'sobol',   'a Sobol sequence, whose points fill the space evenly'), &
    kind_rule_t('sweep',  'list',    'the rows of a file, without &vary'), &
    kind_rule_t('vary',   'uniform', 'from low to high'), &
    kind_rule_t('vary',   'normal',  'the normal distribution, truncated at low and high if given'), &
    kind_rule_t('vary',   'lognormal', 'its logarithm is normal; truncated at low and high if given'), &
    kind_rule_t('record', 'final',   'value at the end'), &
    kind_rule_t('record', 'max',     'largest value of the continuous solution'), &
    kind_rule_t('record', 'min',     'smallest value'), &
    kind_rule_t('record', 'max_abs', 'largest magnitude'), &
    kind_rule_t('record', 'mean',    'mean over time'), &
    kind_rule_t('record', 'rms',     'square root of the mean of the square'), &
    kind_rule_t('record', 'time_of_max', 'when max is reached; beside max_abs without max: when max_abs is'), &
    kind_rule_t('record', 'time_of_min', 'when min is reached'), &
    kind_rule_t('record', 'time_of_max_abs', 'when max_abs is reached'), &
    kind_rule_t('record', 'settling_time', 'time after from until |x - x_end| stays <= band |x_from - x_end|'), &
    kind_rule_t('record', 'damage',        'of fatigue: by Miner''s rule, of one motion'), &
    kind_rule_t('record', 'cycles',        'of fatigue: number of cycles, where the damage is largest'), &
    kind_rule_t('record', 'frequency',     'of mode: with damping, about the steady state'), &
    kind_rule_t('record', 'damping_ratio', 'of mode'), &
    kind_rule_t('record', 'crossing',      'of mode: speed at which order meets it, in the speeds of &response'), &
    kind_rule_t('record', 'crossing_margin', 'of mode: distance of that speed to operation, as a share'), &
    kind_rule_t('record', 'peak', 'of response: amplitude of the order or half range of all; orbit: half range'), &
    kind_rule_t('record', 'peak_speed',    'of response: where the peak is'), &
    kind_rule_t('record', 'peak_frequency', 'of response over the frequency of a shaker: where the peak is'), &
    kind_rule_t('record', 'margin',        'of response: distance of the peak to the speeds in operation, as a share'), &
    kind_rule_t('record', 'ratio',         'of response: largest ratio to the limits of &limit over the speed'), &
    kind_rule_t('record', 'curve', 'of response: at each speed of &response; of mode: its frequency there'), &
    kind_rule_t('record', 'peak_value',    'of a signal of orbit: where its peak is'), &
    kind_rule_t('record', 'fold',          'of orbit = ''branch'': value of a fold, as orbit.json lists them'), &
    kind_rule_t('record', 'jump_up',       'of orbit = ''branch'': value of a fold at which a rising value jumps'), &
    kind_rule_t('record', 'jump_down',     'of orbit = ''branch'': at which a falling value jumps'), &
    kind_rule_t('record', 'folds',         'of orbit = ''branch'': their number'), &
    kind_rule_t('record', 'unstable_ranges', 'of orbit = ''branch'': number of ranges of unstable motions')]

  type(key_rule_t), parameter, public :: sweep_keys(*) = [ &
    key_rule_t('sweep', 'design', a_selector, 1, '', required, anything, 'how the variants are chosen'), &
    key_rule_t('sweep', 'samples', an_integer, 1, '', required, sample_counts, 'number of variants', 'random latin sobol'), &
    key_rule_t('sweep', 'seed', an_integer, 1, '', '0', not_negative, &
      'another seed gives other variants; sobol: 0 gives the published points, others shifted ones', 'random latin sobol'), &
    key_rule_t('sweep', 'file', a_file, 1, '', required, anything, &
      'CSV file: paths as in target in the first line, then a line of numbers for each variant', 'list'), &
    key_rule_t('vary', 'target', a_text, 1, '', required, anything, &
      'GROUP.NAME.KEY or run.KEY; * in NAME ties several; (2) for one value of a list'), &
    key_rule_t('vary', 'scale', a_word, 1, '', "'absolute'", scales, 'relative: the values multiply those of the input'), &
    key_rule_t('vary', 'low', a_number, 1, '', unset, anything, 'smallest value', required_if='uniform'), &
    key_rule_t('vary', 'high', a_number, 1, '', unset, anything, &
      'largest value, above low; equal to low is allowed with count = 1', required_if='uniform'), &
    key_rule_t('vary', 'count', an_integer, 1, '', unset, from_1, &
      "number of values from low to high, both included; 1: low alone; required by design = 'grid'"), &
    key_rule_t('vary', 'distribution', a_selector, 1, '', "'uniform'", anything, &
      'how the values are distributed; all numbers in the unit of the target'), &
    key_rule_t('vary', 'mean', a_number, 1, '', required, anything, &
      'mean of the distribution before it is truncated', 'normal'), &
    key_rule_t('vary', 'deviation', a_number, 1, '', required, positive, 'standard deviation', 'normal'), &
    key_rule_t('vary', 'median', a_number, 1, '', required, positive, &
      'median of the distribution before it is truncated', 'lognormal'), &
    key_rule_t('vary', 'log_deviation', a_number, 1, '', required, positive, &
      'standard deviation of the natural logarithm', 'lognormal'), &
    key_rule_t('record', 'quantity', a_text, 1, '', unset, anything, 'column of trajectory.csv, with or without its unit'), &
    key_rule_t('record', 'fatigue', a_text, 1, '', unset, anything, &
      'name of a &fatigue, whose cycles are counted from extremes_from on'), &
    key_rule_t('record', 'mode', an_integer, 1, '', unset, from_1, 'number of an oscillation, as nocdyn modes counts them'), &
    key_rule_t('record', 'response', a_text, 1, '', unset, anything, &
      'coupling, shaft or mesh, or a column of response.csv, in the forced response by &response'), &
    key_rule_t('record', 'order', a_number, 1, '', unset, positive, &
      'order of the response, all together if not given; or that meets a mode'), &
    key_rule_t('record', 'orbit', a_text, 1, '', unset, anything, &
      'signal of orbit.csv, in the periodic motions by &orbit; or ''branch'': their folds and jumps'), &
    key_rule_t('record', 'number', an_integer, 1, '', unset, from_1, &
      'which one of several folds or jumps, in the order of orbit.csv; 1 if not given'), &
    key_rule_t('record', 'path', a_text, any_number, '', unset, anything, &
               "numbers of reports: a command and what its report has, such as 'modes.modes[2].frequency_Hz'"), &
    key_rule_t('record', 'from', a_number, 1, 's', unset, anything, &
      'start of the time over which statistics are taken; t_start if not given'), &
    key_rule_t('record', 'trajectories', an_integer, any_number, '', unset, from_1, &
      'variants whose complete results are written, as those of a run', fewest=1), &
    key_rule_t('record', 'statistic', a_selector, any_number, '', unset, anything, &
      'statistics of the quantity that are stored', fewest=1), &
    key_rule_t('record', 'band', a_number, 1, '', unset, positive, &
      'tolerance band of the settling time; 0.02 if not given', 'settling_time')]

  type(relation_rule_t), parameter, public :: sweep_relations(*) = [ &
    relation_rule_t('record', at_most_one, 'quantity', 'fatigue mode response orbit path'), &
    relation_rule_t('record', at_most_one, 'fatigue', 'mode response orbit path'), &
    relation_rule_t('record', at_most_one, 'mode', 'response orbit path'), &
    relation_rule_t('record', at_most_one, 'response', 'orbit path'), &
    relation_rule_t('record', at_most_one, 'orbit', 'path'), &
    relation_rule_t('record', requires, 'quantity fatigue mode response orbit', 'statistic'), &
    relation_rule_t('record', requires, 'statistic', 'quantity fatigue mode response orbit'), &
    relation_rule_t('record', requires, 'number', 'orbit'), &
    relation_rule_t('record', requires, 'from', 'quantity'), &
    relation_rule_t('record', requires, 'order', 'response mode'), &
    relation_rule_t('vary', less_than, 'low', 'high', 'count')]

  type(alias_t), parameter, public :: sweep_aliases(*) = [ &
    alias_t('sweep',  'n variants count number',       'samples'), &
    alias_t('vary',   'sigma std sd stddev',     'deviation log_deviation'), &
    alias_t('vary',   'factor relative',               'scale'), &
    alias_t('vary',   'mu average loc',                'mean median'), &
    alias_t('vary',   'min minimum from start',        'low'), &
    alias_t('vary',   'max maximum to stop',           'high'), &
    alias_t('vary',   'n points steps samples', 'count'), &
    alias_t('record', 'column variable name',          'quantity'), &
    alias_t('record', 'start after t_start',           'from'), &
    alias_t('record', 'tolerance',                     'band')]

  type(example_t), parameter, public :: sweep_examples(*) = [ &
    example_t('sweep',  "design = 'random' samples = 100000 seed = 1", .false.), &
    example_t('sweep',  "design = 'list' file = 'variants.csv'", .false.), &
    example_t('vary',   "target = 'load.work.viscous' low = 50.0 high = 150.0", .false.), &
    example_t('vary', "target = 'gear.reducer.radii(2)' distribution = 'normal'|" // 'mean = 3.0 deviation = 0.001', .false.), &
    example_t('vary',   "target = 'coupling.*.stiffness' scale = 'relative' low = 0.9 high = 1.1", .false.), &
    example_t('record', "quantity = 'omega_motor'     statistic = 'final'", .false.), &
    example_t('record', "quantity = 'moment_coupling' statistic = 'max_abs', 'time_of_max_abs' from = 2.0", .false.), &
    example_t('record', "fatigue = 'life' statistic = 'damage', 'cycles'", .false.), &
    example_t('record', "mode = 2 statistic = 'frequency', 'damping_ratio'", .false.), &
    example_t('record', "response = 'coupling' order = 6 statistic = 'peak', 'peak_speed'", .false.), &
    example_t('record', "response = 'coupling' statistic = 'curve'", .false.), &
    example_t('record', "orbit = 'branch' statistic = 'jump_up', 'jump_down'", .false.), &
    example_t('record', "path = 'campbell.crossings[1].speed_rad_s'", .false.), &
    example_t('record', 'trajectories = 1, 17, 90', .false.)]

end module nocdyn_schema_sweep
