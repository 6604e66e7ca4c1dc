!> Rows of the schema: what a sweep varies and what it keeps, &sweep, &vary and &record.
module nocdyn_schema_sweep
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: a_file, a_kind, a_number, a_text, allowed_t, an_integer, any_number, any_times, anything, &
    at_most_once, example_t, from_1, group_rule_t, key_rule_t, kind_rule_t, need_t, not_negative, order_t, positive, required, &
    synonym_t, unset
  implicit none (type, external)
  private

  type(allowed_t), parameter :: sample_counts = allowed_t(low=1.0_wp, high=2.0e9_wp)

  type(group_rule_t), parameter, public :: sweep_groups(*) = [ &
    group_rule_t('sweep',  at_most_once, '', 'Which variants a sweep computes. Other commands take the machine as it is.'), &
    group_rule_t('vary',   any_times,    '', 'A number of the input that a sweep varies.'), &
    group_rule_t('record', any_times,    '', 'What a sweep keeps of each variant: numbers of a column, or trajectories.')]

  type(kind_rule_t), parameter, public :: sweep_kinds(*) = [ &
    kind_rule_t('sweep',  'grid',    'every combination; the last &vary runs fastest'), &
    kind_rule_t('sweep',  'random',  'independent random numbers'), &
    kind_rule_t('sweep',  'latin',   'a Latin hypercube: one sample in each of as many equally probable slices'), &
    kind_rule_t('sweep',  'sobol',   'the points of Sobol, which fill the space evenly'), &
    kind_rule_t('sweep',  'list',    'the rows of a file, and no &vary'), &
    kind_rule_t('vary',   'uniform', 'from low to high'), &
    kind_rule_t('vary',   'normal',  'the normal distribution, within low and high if these are given'), &
    kind_rule_t('vary',   'lognormal', 'the logarithm is normal; within low and high if these are given'), &
    kind_rule_t('record', 'final',   'value at the end'), &
    kind_rule_t('record', 'max',     'largest value of the continuous solution'), &
    kind_rule_t('record', 'min',     'smallest value'), &
    kind_rule_t('record', 'max_abs', 'largest magnitude'), &
    kind_rule_t('record', 'mean',    'integral over the time, by the length of the time'), &
    kind_rule_t('record', 'rms',     'square root of the mean of the square'), &
    kind_rule_t('record', 'time_of_max', 'when the largest value occurs'), &
    kind_rule_t('record', 'settling_time', 'time after from until |x - x_end| <= band |x_from - x_end| for good')]

  type(key_rule_t), parameter, public :: sweep_keys(*) = [ &
    key_rule_t('sweep',      'design',          a_kind,         1, '',            required,    anything, &
      'how the variants are chosen'), &
    key_rule_t('sweep',      'samples',         an_integer,     1, '',            required,    sample_counts, &
      'number of variants', 'random latin sobol'), &
    key_rule_t('sweep',      'seed',            an_integer,     1, '',            '0',         not_negative, &
      'another seed gives other variants; sobol: 0 for the published points, else shifted ones', 'random latin sobol'), &
    key_rule_t('sweep',      'file',            a_file,         1, '',            required,    anything, &
      'CSV: paths as in target in its first line, then a line of numbers for each variant', 'list'), &
    key_rule_t('vary',       'target',          a_text,         1, '',            required,    anything, &
      'GROUP.NAME.KEY, run.KEY; with a place (2) where the key is a list; whole numbers are rounded'), &
    key_rule_t('vary',       'low',             a_number,       1, '',            unset,       anything, &
      'smallest value', needed_by='uniform'), &
    key_rule_t('vary',       'high',            a_number,       1, '',            unset,       anything, &
      'largest value, above low; low itself with count = 1', needed_by='uniform'), &
    key_rule_t('vary',       'count',           an_integer,     1, '',            unset,       from_1, &
      "how many values from low to high, both included; 1: low alone; design = 'grid' needs it"), &
    key_rule_t('vary',       'distribution',    a_kind,         1, '',            "'uniform'", anything, &
      'how the values are distributed; all numbers in the unit of the target'), &
    key_rule_t('vary',       'mean',            a_number,       1, '',            required,    anything, &
      'mean of the distribution before low and high cut it', 'normal'), &
    key_rule_t('vary',       'deviation',       a_number,       1, '',            required,    positive, &
      'standard deviation', 'normal'), &
    key_rule_t('vary',       'median',          a_number,       1, '',            required,    positive, &
      'half of the values are below it before low and high cut the distribution', 'lognormal'), &
    key_rule_t('vary',       'log_deviation',   a_number,       1, '',            required,    positive, &
      'standard deviation of the natural logarithm', 'lognormal'), &
    key_rule_t('record',     'quantity',        a_text,         1, '',            unset,       anything, &
      'column of trajectory.csv, with or without its unit'), &
    key_rule_t('record',     'from',            a_number,       1, 's',           unset,       anything, &
      'time from which the quantity counts; t_start if not given'), &
    key_rule_t('record',     'trajectories',    an_integer,     any_number, '',   unset,       from_1, &
      'numbers of variants whose results are written as those of a run', least=1), &
    key_rule_t('record',     'statistic',       a_kind,         any_number, '',   unset,       anything, &
      'what is kept of the quantity', least=1), &
    key_rule_t('record',     'band',            a_number,       1, '',            unset,       positive, &
      '0.02 if not given', 'settling_time')]

  type(need_t), parameter, public :: sweep_needs(*) = [ &
    need_t('record', 'quantity', 'statistic'), &
    need_t('record', 'statistic from', 'quantity')]

  type(order_t), parameter, public :: sweep_orders(*) = [ &
    order_t('vary', 'low', 'high', alone='count')]

  type(synonym_t), parameter, public :: sweep_synonyms(*) = [ &
    synonym_t('sweep',  'n variants count number',       'samples'), &
    synonym_t('vary',   'sigma std sd stddev scale',     'deviation log_deviation'), &
    synonym_t('vary',   'mu average loc',                'mean median'), &
    synonym_t('vary',   'min minimum from start',        'low'), &
    synonym_t('vary',   'max maximum to stop',           'high'), &
    synonym_t('vary',   'n points steps samples', 'count'), &
    synonym_t('record', 'column variable name',          'quantity'), &
    synonym_t('record', 'start after t_start',           'from'), &
    synonym_t('record', 'tolerance',                     'band')]

  type(example_t), parameter, public :: sweep_examples(*) = [ &
    example_t('sweep',  "design = 'random' samples = 100000 seed = 1", .false.), &
    example_t('sweep',  "design = 'list' file = 'variants.csv'", .false.), &
    example_t('vary',   "target = 'load.work.viscous' low = 50.0 high = 150.0", .false.), &
    example_t('vary',   "target = 'gear.reducer.radii(2)' distribution = 'normal'|" // &
                        'mean = 3.0 deviation = 0.001', .false.), &
    example_t('record', "quantity = 'omega_motor'     statistic = 'final'", .false.), &
    example_t('record', "quantity = 'moment_coupling' statistic = 'max_abs', 'time_of_max' from = 2.0", .false.), &
    example_t('record', 'trajectories = 1, 17, 90', .false.)]

end module nocdyn_schema_sweep
