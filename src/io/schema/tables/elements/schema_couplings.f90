!> Rows of the schema: the keys of &coupling and the relations between them.
module nocdyn_schema_couplings
  use nocdyn_schema_rules, only: a_file, a_name, a_number, a_word, any_number, anything, at_most_one, body_or_ground, &
    equal_lengths, example_t, extrapolations, interpolations, key_rule_t, less_than, not_negative, positive, relation_rule_t, &
    required, requires, unset
  implicit none (type, external)
  private

  character(len=*), parameter :: linear = "'linear'"

  type(key_rule_t), parameter, public :: coupling_keys(*) = [ &
    key_rule_t('coupling', 'name', a_name, 1, '', required, anything, 'name in results and messages'), &
    key_rule_t('coupling', 'bodies', body_or_ground, 2, '', required, anything, &
      "the two ends; twist = angle of the second - angle of the first; 'ground' does not turn"), &
    key_rule_t('coupling', 'stiffness', a_number, 1, 'N m/rad', '0', not_negative, 'linear part of the elastic moment'), &
    key_rule_t('coupling', 'cubic_stiffness', a_number, 1, 'N m/rad3', '0', anything, &
      'cubic part of the elastic moment; negative softens'), &
    key_rule_t('coupling', 'polynomial', a_number, any_number, 'N m/rad^k', unset, anything, &
      'p_1, p_2, ...: p_k w^k, w = twist - rest_twist, are added to the elastic moment', fewest=1), &
    key_rule_t('coupling', 'damping', a_number, 1, 'N m s/rad', '0', not_negative, &
      'moment per rate of twist; with a gap only in contact, at most as large as the elastic moment'), &
    key_rule_t('coupling', 'relative_damping', a_number, 1, '', unset, not_negative, &
      'psi of data sheets: energy lost in a cycle by the largest elastic energy; at every frequency'), &
    key_rule_t('coupling', 'magnifier', a_number, 1, '', unset, positive, &
      'M of data sheets, 2 pi / psi, in place of relative_damping'), &
    key_rule_t('coupling', 'damping_frequency', a_number, 1, 'rad/s', unset, positive, &
      'frequency at which a viscous damping stands for relative_damping over the time (run, sweep)'), &
    key_rule_t('coupling', 'section_modulus', a_number, 1, 'm3', unset, positive, &
      'section modulus against torsion of the weakest section: stress = moment / section_modulus'), &
    key_rule_t('coupling', 'diameter', a_number, 1, 'm', unset, positive, &
      'diameter of a round section, in place of section_modulus'), &
    key_rule_t('coupling', 'bore', a_number, 1, 'm', unset, not_negative, 'diameter of its bore; 0 if not given'), &
    key_rule_t('coupling', 'rest_twist', a_number, 1, 'rad', '0', anything, 'twist without elastic moment'), &
    key_rule_t('coupling', 'gap', a_number, 1, 'rad', '0', not_negative, &
      'total play: no moment within +- gap/2 of rest_twist, beyond it contact, which never pulls'), &
    key_rule_t('coupling', 'saturation', a_number, 1, 'N m', unset, positive, &
      'bounds the elastic moment M smoothly: saturation tanh(M / saturation)'), &
    key_rule_t('coupling', 'friction', a_number, 1, 'N m', '0', not_negative, &
      'moment of a slipping clutch: friction tanh(rate of twist / friction_speed)'), &
    key_rule_t('coupling', 'friction_speed', a_number, 1, 'rad/s', '0.01', positive, &
      'rate of twist at which the friction has 76 % of its full moment'), &
    key_rule_t('coupling', 'maxwell_stiffness', a_number, any_number, 'N m/rad', unset, positive, &
      'stiffness of springs in series with dampers, parallel to the spring, as of rubber', fewest=1), &
    key_rule_t('coupling', 'maxwell_time', a_number, any_number, 's', unset, positive, &
      'relaxation time of each of them: damping / maxwell_stiffness', fewest=1), &
    key_rule_t('coupling', 'table_twist', a_number, any_number, 'rad', unset, anything, &
      'twist - rest_twist of the points of a table, ascending', fewest=2, ascends=.true.), &
    key_rule_t('coupling', 'table_moment', a_number, any_number, 'N m', unset, anything, &
      'elastic moment at these points', fewest=2), &
    key_rule_t('coupling', 'table_file', a_file, 1, '', unset, anything, &
      'file with the table: two columns, twist - rest_twist [rad] and moment [N m]'), &
    key_rule_t('coupling', 'interpolation', a_word, 1, '', linear, interpolations, &
      'between the points: straight lines, or the monotone cubic of Fritsch and Butland'), &
    key_rule_t('coupling', 'extrapolation', a_word, 1, '', linear, extrapolations, &
      'beyond the table: straight on with the end slope, or constant')]

  type(relation_rule_t), parameter, public :: coupling_relations(*) = [ &
    relation_rule_t('coupling', at_most_one, 'table_twist table_moment', 'table_file'), &
    relation_rule_t('coupling', at_most_one, 'table_twist table_moment table_file', &
                    'stiffness cubic_stiffness polynomial gap saturation'), &
    relation_rule_t('coupling', at_most_one, 'saturation', 'cubic_stiffness polynomial gap'), &
    relation_rule_t('coupling', at_most_one, 'maxwell_stiffness maxwell_time', &
                    'polynomial gap saturation table_twist table_file relative_damping magnifier'), &
    relation_rule_t('coupling', requires, 'maxwell_stiffness', 'maxwell_time'), &
    relation_rule_t('coupling', requires, 'maxwell_time', 'maxwell_stiffness'), &
    relation_rule_t('coupling', equal_lengths, 'maxwell_stiffness maxwell_time', ''), &
    relation_rule_t('coupling', requires, 'gap', 'stiffness cubic_stiffness polynomial'), &
    relation_rule_t('coupling', requires, 'saturation', 'stiffness'), &
    relation_rule_t('coupling', requires, 'friction_speed', 'friction'), &
    relation_rule_t('coupling', at_most_one, 'relative_damping', 'magnifier'), &
    relation_rule_t('coupling', requires, 'damping_frequency', 'relative_damping magnifier'), &
    relation_rule_t('coupling', at_most_one, 'section_modulus', 'diameter bore'), &
    relation_rule_t('coupling', requires, 'bore', 'diameter'), &
    relation_rule_t('coupling', less_than, 'bore', 'diameter'), &
    relation_rule_t('coupling', requires, 'interpolation extrapolation', 'table_twist table_file'), &
    relation_rule_t('coupling', equal_lengths, 'table_twist table_moment', 'table_file')]

  type(example_t), parameter, public :: coupling_examples(*) = [ &
    example_t('coupling', "name = 'coupling' bodies = 'motor', 'pinion' stiffness = 100.0 cubic_stiffness = 10"), &
    example_t('coupling', "name = 'splines' bodies = 'motor', 'pinion'|" // &
                          'stiffness = 1.0e5 gap = 0.02 damping = 5.0', .false.), &
    example_t('coupling', "name = 'clutch'   bodies = 'motor', 'pinion' friction = 50.0", .false.), &
    example_t('coupling', "name = 'rubber'   bodies = 'motor', 'pinion'|" // &
                          "table_twist = -0.2, 0, 0.2  table_moment = -90, 0, 60  interpolation = 'cubic'", .false.)]

end module nocdyn_schema_couplings
