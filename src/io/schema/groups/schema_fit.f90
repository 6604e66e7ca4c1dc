!> Rows of the schema: what is fitted to measurements, &unknown.
module nocdyn_schema_fit
  use nocdyn_schema_rules, only: a_number, a_text, any_times, anything, example_t, group_rule_t, in_fits, key_rule_t, less_than, &
    positive, relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  type(group_rule_t), parameter, public :: fit_groups(*) = [ &
    group_rule_t('unknown', in_fits, any_times, '', &
                 "A number that 'nocdyn fit' finds, so that the machine does what &measurement says.")]

  type(key_rule_t), parameter, public :: fit_keys(*) = [ &
    key_rule_t('unknown', 'target', a_text, 1, '', required, anything, &
      "the number, e.g. 'coupling.rubber.stiffness'; a * in the name: the same value in all"), &
    key_rule_t('unknown', 'low', a_number, 1, '', required, anything, 'lowest value, in the unit of the target'), &
    key_rule_t('unknown', 'high', a_number, 1, '', required, anything, 'highest value'), &
    key_rule_t('unknown', 'start', a_number, 1, '', unset, anything, &
      'value from which it is sought; that of the input if not given'), &
    key_rule_t('unknown', 'prior', a_number, 1, '', unset, anything, 'value that is expected'), &
    key_rule_t('unknown', 'deviation', a_number, 1, '', unset, positive, 'standard deviation of the expected value')]

  type(relation_rule_t), parameter, public :: fit_relations(*) = [ &
    relation_rule_t('unknown', less_than, 'low', 'high'), &
    relation_rule_t('unknown', requires, 'prior', 'deviation'), &
    relation_rule_t('unknown', requires, 'deviation', 'prior')]

  type(example_t), parameter, public :: fit_examples(*) = [ &
    example_t('unknown', "target = 'coupling.coupling.stiffness' low = 50.0 high = 200.0", is_in_template=.false.)]

end module nocdyn_schema_fit
