!> Rows of the schema: torsional vibration dampers, &damper.
module nocdyn_schema_dampers
  use nocdyn_schema_rules, only: a_body, a_name, a_number, a_selector, any_times, anything, at_most_one, exactly_one, example_t, &
    group_alias_t, group_rule_t, in_machine, key_rule_t, kind_rule_t, less_than, not_negative, positive, relation_rule_t, &
    required, requires, unset
  implicit none (type, external)
  private

  type(group_rule_t), parameter, public :: damper_groups(*) = [ &
    group_rule_t('damper', in_machine, any_times, 'body', 'A torsional vibration damper: a ring on a body, by its data sheet.')]

  type(kind_rule_t), parameter, public :: damper_kinds(*) = [ &
    kind_rule_t('damper', 'viscous', 'a ring in silicone oil, without a spring'), &
    kind_rule_t('damper', 'rubber', 'a ring on rubber, with relative damping'), &
    kind_rule_t('damper', 'viscous_spring', 'a ring on springs, with viscous damping of oil between them')]

  type(key_rule_t), parameter, public :: damper_keys(*) = [ &
    key_rule_t('damper', 'name', a_name, 1, '', required, anything, &
      'name of its ring, a body, and of the coupling to it, in results and messages'), &
    key_rule_t('damper', 'kind', a_selector, 1, '', "'viscous'", anything, 'how the ring is coupled'), &
    key_rule_t('damper', 'body', a_body, 1, '', required, anything, 'body on which it is fixed'), &
    key_rule_t('damper', 'ring_inertia', a_number, 1, 'kg m2', required, positive, 'moment of inertia of the ring'), &
    key_rule_t('damper', 'housing_inertia', a_number, 1, 'kg m2', '0', not_negative, &
      'moment of inertia of the housing or the inner part, which is added to that of the body'), &
    key_rule_t('damper', 'damping', a_number, 1, 'N m s/rad', unset, not_negative, &
      'moment per rate of twist between ring and housing', 'viscous viscous_spring'), &
    key_rule_t('damper', 'viscosity', a_number, 1, 'Pa s', unset, positive, &
      'dynamic viscosity of the oil, from which damping follows by the gaps about the ring', 'viscous'), &
    key_rule_t('damper', 'outer_radius', a_number, 1, 'm', unset, positive, 'outer radius of the ring', 'viscous'), &
    key_rule_t('damper', 'inner_radius', a_number, 1, 'm', unset, positive, 'inner radius of the ring', 'viscous'), &
    key_rule_t('damper', 'width', a_number, 1, 'm', unset, positive, 'width of the ring along the shaft', 'viscous'), &
    key_rule_t('damper', 'radial_gap', a_number, 1, 'm', unset, positive, 'clearance at the outer cylinder', 'viscous'), &
    key_rule_t('damper', 'inner_gap', a_number, 1, 'm', unset, positive, &
      'clearance at the inner cylinder; as radial_gap if not given', 'viscous'), &
    key_rule_t('damper', 'lateral_gap', a_number, 1, 'm', unset, positive, 'clearance on each side of the ring', 'viscous'), &
    key_rule_t('damper', 'stiffness', a_number, 1, 'N m/rad', unset, positive, &
      'of the spring between ring and housing', 'rubber viscous_spring'), &
    key_rule_t('damper', 'tuning_frequency', a_number, 1, 'rad/s', unset, positive, &
      'in place of stiffness: natural frequency of the ring on a held housing', 'rubber viscous_spring'), &
    key_rule_t('damper', 'relative_damping', a_number, 1, '', unset, not_negative, &
      'psi of data sheets: energy lost in a cycle by the largest elastic energy', 'rubber'), &
    key_rule_t('damper', 'loss_factor', a_number, 1, '', unset, not_negative, &
      'psi / (2 pi); of viscous_spring damping * frequency / stiffness at the tuning frequency', 'rubber viscous_spring'), &
    key_rule_t('damper', 'damping_ratio', a_number, 1, '', unset, not_negative, &
      'damping / (2 sqrt(stiffness * ring_inertia))', 'viscous_spring'), &
    key_rule_t('damper', 'damping_frequency', a_number, 1, 'rad/s', unset, positive, &
      'frequency at which viscous damping stands for it over the time; as tuned if not given', 'rubber')]

  type(relation_rule_t), parameter, public :: damper_relations(*) = [ &
    relation_rule_t('damper', exactly_one, 'damping', &
                    'viscosity outer_radius inner_radius width radial_gap inner_gap lateral_gap loss_factor damping_ratio'), &
    relation_rule_t('damper', at_most_one, 'damping_ratio', 'loss_factor'), &
    relation_rule_t('damper', exactly_one, 'stiffness', 'tuning_frequency'), &
    relation_rule_t('damper', exactly_one, 'relative_damping', 'loss_factor'), &
    relation_rule_t('damper', requires, 'viscosity', 'outer_radius'), &
    relation_rule_t('damper', requires, 'viscosity', 'inner_radius'), &
    relation_rule_t('damper', requires, 'viscosity', 'width'), &
    relation_rule_t('damper', requires, 'viscosity', 'radial_gap'), &
    relation_rule_t('damper', requires, 'viscosity', 'lateral_gap'), &
    relation_rule_t('damper', requires, 'outer_radius inner_radius width radial_gap inner_gap lateral_gap', 'viscosity'), &
    relation_rule_t('damper', less_than, 'inner_radius', 'outer_radius')]

  !> Words that users of dampers may try.
  type(group_alias_t), parameter, public :: damper_aliases(*) = [ &
    group_alias_t('viscous_damper houdaille tvd', 'damper'), &
    group_alias_t('rubber_damper', 'damper', "kind = 'rubber'"), &
    group_alias_t('spring_damper', 'damper', "kind = 'viscous_spring'")]

  type(example_t), parameter, public :: damper_examples(*) = [ &
    example_t('damper', "name = 'ring'  body = 'motor'  ring_inertia = 2.0|" // &
      'housing_inertia = 0.5  damping = 30.0', .false.), &
    example_t('damper', "name = 'rubber_ring'  body = 'motor'  kind = 'rubber'|" // &
      'ring_inertia = 2.0  tuning_frequency_hz = 4.0  relative_damping = 1.2', .false.)]

end module nocdyn_schema_dampers
