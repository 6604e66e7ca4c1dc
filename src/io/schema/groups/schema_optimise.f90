!> Rows of the schema: what is made best, &objective, by which numbers, &design. An objective names one number of a machine with
!> the keys of &record.
module nocdyn_schema_optimise
  use nocdyn_schema_rules, only: a_number, a_text, a_word, allowed_t, any_number, any_times, anything, at_most_one, example_t, &
    group_rule_t, in_fits, key_rule_t, kind_rule_t, less_than, positive, relation_rule_t, required, requires, unset
  use nocdyn_schema_sweep, only: sweep_keys, sweep_kinds, sweep_relations
  implicit none (type, external)
  private

  type(allowed_t), parameter :: goals = allowed_t(words='minimise maximise')
  integer, parameter :: key = findloc(sweep_keys%group, 'record', dim=1), last_key = size(sweep_keys)
  integer, parameter :: trajectories = findloc(sweep_keys%name, 'trajectories', dim=1)   ! which an objective has not
  integer, parameter :: kind = findloc(sweep_kinds%group, 'record', dim=1), last_kind = size(sweep_kinds)
  integer, parameter :: curve = findloc(sweep_kinds%word, 'curve', dim=1)                 ! of more than one number
  integer, parameter :: relation = findloc(sweep_relations%group, 'record', dim=1)
  integer, parameter :: relations = count(sweep_relations%group == 'record')
  integer :: i

  type(group_rule_t), parameter, public :: optimise_groups(*) = [ &
    group_rule_t('objective', in_fits, any_times, '', &
                 "What 'nocdyn optimise' makes small or large; of several, the worst one."), &
    group_rule_t('design', in_fits, any_times, '', "A number that 'nocdyn optimise' may choose, or the size of a coupling.")]

  type(kind_rule_t), parameter, public :: optimise_kinds(*) = [ &
    (kind_rule_t('objective', sweep_kinds(i)%word, sweep_kinds(i)%help), i=kind, curve - 1), &
    (kind_rule_t('objective', sweep_kinds(i)%word, sweep_kinds(i)%help), i=curve + 1, last_kind)]

  type(key_rule_t), parameter, public :: optimise_keys(*) = [ &
    key_rule_t('objective', 'goal', a_word, 1, '', "'minimise'", goals, 'what is sought'), &
    key_rule_t('objective', 'scale', a_number, 1, '', '1', positive, &
      'size of the number, by which several objectives are compared'), &
    (key_rule_t('objective', sweep_keys(i)%name, sweep_keys(i)%value_type, sweep_keys(i)%count, sweep_keys(i)%unit, &
                sweep_keys(i)%default, sweep_keys(i)%allowed, sweep_keys(i)%help, sweep_keys(i)%only_if, &
                sweep_keys(i)%fewest), i=key, trajectories - 1), &
    (key_rule_t('objective', sweep_keys(i)%name, sweep_keys(i)%value_type, sweep_keys(i)%count, sweep_keys(i)%unit, &
                sweep_keys(i)%default, sweep_keys(i)%allowed, sweep_keys(i)%help, sweep_keys(i)%only_if, &
                sweep_keys(i)%fewest), i=trajectories + 1, last_key), &
    key_rule_t('design', 'target', a_text, 1, '', required, anything, &
      "the number, as of --set; a * in the name: the same value in all; or 'coupling.NAME.size'"), &
    key_rule_t('design', 'low', a_number, 1, '', unset, anything, 'lowest value, in the unit of the target'), &
    key_rule_t('design', 'high', a_number, 1, '', unset, anything, 'highest value'), &
    key_rule_t('design', 'start', a_number, 1, '', unset, anything, &
      'value from which the best one is sought; that of the input if not given'), &
    key_rule_t('design', 'step', a_number, 1, '', unset, positive, 'between the values from low on that can be had'), &
    key_rule_t('design', 'values', a_number, any_number, '', unset, anything, 'the values that can be had', fewest=1), &
    key_rule_t('design', 'sizes', a_text, any_number, '', unset, anything, &
      'the sizes of a catalogue that come into question; all if not given', fewest=1)]

  type(relation_rule_t), parameter, public :: optimise_relations(*) = [ &
    (relation_rule_t('objective', sweep_relations(i)%form, sweep_relations(i)%first, sweep_relations(i)%second), &
     i=relation, relation + relations - 1), &
    relation_rule_t('design', less_than, 'low', 'high'), &
    relation_rule_t('design', requires, 'low', 'high'), &
    relation_rule_t('design', requires, 'high', 'low'), &
    relation_rule_t('design', requires, 'step start', 'low'), &
    relation_rule_t('design', at_most_one, 'low', 'values sizes'), &
    relation_rule_t('design', at_most_one, 'values', 'sizes'), &
    relation_rule_t('design', at_most_one, 'step', 'start')]

  type(example_t), parameter, public :: optimise_examples(*) = [ &
    example_t('objective', "goal = 'minimise' response = 'coupling' statistic = 'peak'", is_in_template=.false.), &
    example_t('objective', "goal = 'maximise' mode = 1 order = 2 statistic = 'crossing_margin'", is_in_template=.false.), &
    example_t('design', "target = 'coupling.coupling.damping' low = 1.0 high = 50.0", is_in_template=.false.), &
    example_t('design', "target = 'gear.reducer.radii(2)' values = 2.5, 3.0, 3.5", is_in_template=.false.)]

end module nocdyn_schema_optimise
