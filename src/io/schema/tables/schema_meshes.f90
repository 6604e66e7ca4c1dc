!> Rows of the schema: the group &mesh with its keys.
module nocdyn_schema_meshes
  use nocdyn_schema_rules, only: a_flag, a_name, a_number, an_integer, any_number, any_times, anything, body_or_ground, &
    exactly_one, example_t, from_1, group_rule_t, in_machine, key_rule_t, not_negative, positive, &
    relation_rule_t, required, requires, unset
  implicit none (type, external)
  private

  type(group_rule_t), parameter, public :: mesh_groups(*) = [ &
    group_rule_t('mesh', in_machine, any_times, 'coupling', 'An elastic mesh of two wheels.')]

  type(key_rule_t), parameter, public :: mesh_keys(*) = [ &
    key_rule_t('mesh',       'name',            a_name,         1, '',            required,    anything, &
      'name in messages and results'), &
    key_rule_t('mesh',       'bodies',          body_or_ground, 2, '',            required,    anything, &
      'the two wheels'), &
    key_rule_t('mesh',       'radii',           a_number,       2, 'm',           unset,       positive, &
      'radii at which the force acts, in the order of the bodies: those of the base circles'), &
    key_rule_t('mesh',       'teeth',           an_integer,     2, '',            unset,       from_1, &
      'numbers of teeth, in the order of the bodies; the radii are module * teeth / 2'), &
    key_rule_t('mesh',       'module',          a_number,       1, 'm',           unset,       positive, &
      'module of the teeth'), &
    key_rule_t('mesh',       'internal',        a_flag,         1, '',            '.false.',   anything, &
      'an internal gear: both wheels turn in the same direction'), &
    key_rule_t('mesh',       'stiffness',       a_number,       1, 'N/m',         required,    positive, &
      'mean stiffness of the mesh along the line of action'), &
    key_rule_t('mesh',       'damping',         a_number,       1, 'N s/m',       '0',         not_negative, &
      'force per rate of deformation; with backlash in contact only, at most the elastic force'), &
    key_rule_t('mesh',       'backlash',        a_number,       1, 'm',           '0',         not_negative, &
      'play between both flanks along the line of action; no force inside'), &
    key_rule_t('mesh',       'transmission_error', a_number,    any_number, 'm',  unset,       not_negative, &
      'amplitudes of the deviation from equal motion, along the line of action', fewest=1), &
    key_rule_t('mesh',       'error_orders',    a_number,       any_number, '',   unset,       positive, &
      'order of each in turns of the first body; if not given 1, 2, ... times its teeth', fewest=1), &
    key_rule_t('mesh',       'error_phases',    a_number,       any_number, 'rad', unset,      anything, &
      'phase of each: amplitude * sin(order * angle + phase)', fewest=1)]

  type(relation_rule_t), parameter, public :: mesh_relations(*) = [ &
    relation_rule_t('mesh', exactly_one, 'radii', 'teeth'), &
    relation_rule_t('mesh', requires, 'module', 'teeth'), &
    relation_rule_t('mesh', requires, 'teeth', 'module'), &
    relation_rule_t('mesh', requires, 'error_orders error_phases', 'transmission_error')]

  type(example_t), parameter, public :: mesh_examples(*) = [ &
    example_t('mesh', "name = 'teeth'  bodies = 'pinion', 'machine'  radii = 2.0, 3.0|" // &
      'stiffness = 1.0e8  damping = 1.0e4', .false.)]

end module nocdyn_schema_meshes
