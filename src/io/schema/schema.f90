!> The schema of an input file: every group and every key once, with type, unit, default, allowed values and help.
!>
!> A new key is a new row of `key_rules`; a new group is a row of `group_rules` with its topic, its keys and an example.
!> Reading, checking, help, template and reference use the rows. The rows of large groups are in modules of their own.
module nocdyn_schema
  use nocdyn_kinds, only: wp
  use nocdyn_schema_couplings, only: conditions, coupling_examples, coupling_groups, coupling_keys, coupling_kinds, &
    coupling_relations
  use nocdyn_schema_dampers, only: damper_aliases, damper_examples, damper_groups, damper_keys, damper_kinds, damper_relations
  use nocdyn_schema_fit, only: fit_examples, fit_groups, fit_keys, fit_relations
  use nocdyn_schema_joints, only: joint_examples, joint_groups, joint_keys, joint_kinds, joint_relations
  use nocdyn_schema_measurement, only: measurement_examples, measurement_groups, measurement_keys, measurement_kinds, &
    measurement_relations
  use nocdyn_schema_optimise, only: optimise_examples, optimise_groups, optimise_keys, optimise_kinds, optimise_relations
  use nocdyn_schema_response, only: response_examples, response_groups, response_keys, response_relations
  use nocdyn_schema_rules, only: a_body, a_document, a_flag, a_folder, a_name, a_number, a_selector, a_text, a_word, alias_t, &
    allowed_t, an_integer, any_number, any_times, anything, at_least_once, at_most_once, at_most_one, exactly_once, example_t, &
    from_2, group_alias_t, group_rule_t, in_machine, in_simulation, key_rule_t, kind_rule_t, less_than, not_negative, not_zero, &
    positive, relation_rule_t, required, requires, unset
  use nocdyn_schema_sweep, only: sweep_aliases, sweep_examples, sweep_groups, sweep_keys, sweep_kinds, sweep_relations
  use nocdyn_schema_torques, only: engine_keys, engine_relations, torque_examples, torque_groups, torque_keys, torque_kinds, &
    torque_relations
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: group_rule_index, key_rule_index, selector_name, key_name, holds_texts, has_word, words_in, words_of

  type(allowed_t), parameter :: steps = allowed_t(low=1.0_wp, high=1.0e8_wp)
  type(allowed_t), parameter :: tolerance = allowed_t(low=1.0e-14_wp, high=0.1_wp)
  type(allowed_t), parameter :: methods = allowed_t(words='auto rk45 rk853 rosenbrock rodas4 rodas5p taylor')
  character(len=*), parameter :: default_method = "'auto'"
  type(allowed_t), parameter :: formulations = allowed_t(words='reduced paper multiplier')
  type(allowed_t), parameter :: complements = allowed_t(words='natural scaled negated')
  type(allowed_t), parameter :: output_units = allowed_t(words='rpm Hz deg')
  type(allowed_t), parameter :: formats = allowed_t(words='csv netcdf')
  type(allowed_t), parameter :: analyses = allowed_t(words='run response campbell modes equilibrium transit orbit')
  type(allowed_t), parameter :: starts = allowed_t(words='given projected equilibrium')

  type(group_rule_t), parameter, public :: group_rules(*) = [ &
    group_rule_t('case',       in_machine,    at_most_once,  '',         'What the file is about.'), &
    group_rule_t('body',       in_machine,    at_least_once, 'body',     'A rigid body that turns about its axis.'), &
    coupling_groups, damper_groups, joint_groups, torque_groups, &
    group_rule_t('run',        in_simulation, exactly_once,  '',         'What is computed, and how.'), &
    group_rule_t('load_case',  in_simulation, any_times,     'load_case', &
                 'A start, a fault or a load: nocdyn run does one load case after the other.'), &
    group_rule_t('output',     in_simulation, at_most_once,  '',         'What is written, in which form, and where.'), &
    response_groups, measurement_groups, sweep_groups, fit_groups, optimise_groups]

  type(key_rule_t), parameter :: frame_keys(*) = [ &
    key_rule_t('case', 'title', a_text, 1, '', "''", anything, 'title of summaries and figures, one line'), &
    key_rule_t('case', 'author', a_text, 1, '', "''", anything, 'who made the calculation, for the report'), &
    key_rule_t('case', 'customer', a_text, 1, '', "''", anything, 'for whom it is made, for the report'), &
    key_rule_t('case', 'revision', a_text, 1, '', "''", anything, 'of the calculation, for the report'), &
    key_rule_t('case', 'notes_file', a_document, 1, '', unset, anything, &
      'file with the author''s own text of the report, in Markdown'), &
    key_rule_t('body', 'name', a_name, 1, '', required, anything, 'name in couplings, gears, torques and results'), &
    key_rule_t('body', 'inertia', a_number, 1, 'kg m2', required, not_negative, &
      'moment of inertia about the axis; 0 where a body with an inertia is geared to it'), &
    key_rule_t('body', 'entrained', a_number, 1, '', unset, not_negative, &
      'inertia of the water that moves with it, as a share of inertia, e.g. of a propeller'), &
    key_rule_t('body', 'bearing_friction', a_number, 1, 'N m', '0', not_negative, &
      'dry friction of its bearings: against the motion, and up to as much at rest'), &
    key_rule_t('body', 'angle', a_number, 1, 'rad', '0', anything, 'angle at the start'), &
    key_rule_t('body', 'speed', a_number, 1, 'rad/s', '0', anything, &
      'speed at the start; if not given it follows through gears and couplings from others, else 0', follows=.true.), &
    key_rule_t('run', 't_start', a_number, 1, 's', '0', anything, 'time of the start'), &
    key_rule_t('run', 't_end', a_number, 1, 's', required, anything, 'time of the end, after t_start'), &
    key_rule_t('run', 'method', a_word, 1, '', default_method, methods, &
      'explicit: rk45, rk853, taylor; implicit: rodas4 = rosenbrock, rodas5p; auto: two of them'), &
    key_rule_t('run', 'rtol', a_number, 1, '', '1e-6', tolerance, &
      'error of a step, relative to twists, their rates, internal states and rigid motions'), &
    key_rule_t('run', 'atol', a_number, 1, '', '1e-9', positive, &
      'error of a step that is allowed however small these are [rad, rad/s, unit of the state]'), &
    key_rule_t('run', 'formulation', a_word, 1, '', "'reduced'", formulations, &
      'equations that are integrated: they give the same motion, reduced is the fastest'), &
    key_rule_t('run', 'independent', a_body, any_number, '', unset, anything, &
      'bodies whose speeds are the coordinates; found if not given'), &
    key_rule_t('run', 'complement', a_word, 1, '', "'natural'", complements, 'orthogonal complement of the gear constraints'), &
    key_rule_t('run', 'start', a_word, 1, '', "'given'", starts, &
      'given speeds; projected: after an impact if they violate gears; equilibrium: steady'), &
    key_rule_t('run', 'start_speed', a_number, 1, 'rad/s', unset, not_zero, &
      'speed of start_body at which the start is in equilibrium, by the number that free names'), &
    key_rule_t('run', 'start_body', a_body, 1, '', unset, anything, 'body that has start_speed'), &
    key_rule_t('run', 'free', a_text, 1, '', unset, anything, &
      "number that is found for it, e.g. 'load.water.quadratic'; if not given a constant torque"), &
    key_rule_t('run', 'max_steps', an_integer, 1, '', '1000000', steps, 'the run fails after this many steps'), &
    key_rule_t('run', 'load_case', a_text, 1, '', unset, anything, &
      'load case whose run it is; if not given, that of all cases without a &run of their own'), &
    key_rule_t('load_case', 'name', a_name, 1, '', required, anything, &
      'name in results and messages, and of the folder of its results'), &
    key_rule_t('load_case', 'title', a_text, 1, '', "''", anything, 'title in tables and reports, one line'), &
    key_rule_t('load_case', 'repeats', a_number, 1, '', '1', positive, &
      'how often it occurs in the life of the machine, for the damage'), &
    key_rule_t('load_case', 'set', a_text, any_number, '', unset, anything, &
      "values that differ from the file, PATH=VALUE as of --set, e.g. 'load.work.viscous=80'", fewest=1), &
    key_rule_t('load_case', 'with', a_text, any_number, '', unset, anything, &
      'names of elements that only the cases have which name them here', fewest=1), &
    key_rule_t('load_case', 'without', a_text, any_number, '', unset, anything, &
      'names of elements that it leaves out', fewest=1), &
    key_rule_t('load_case', 'rubber', a_word, 1, '', unset, conditions, &
      'condition of all couplings of kind rubber: cold, warm, steady'), &
    key_rule_t('load_case', 'misfire', an_integer, 1, '', unset, not_negative, &
      'cylinder of each &engine that does not fire, as misfire there'), &
    key_rule_t('load_case', 'analyses', a_word, any_number, '', unset, analyses, &
      'commands of it: run, response, campbell, modes, equilibrium, transit, orbit; default: all', fewest=1), &
    key_rule_t('output', 'interval', a_number, 1, 's', unset, positive, 'time from row to row'), &
    key_rule_t('output', 'points', an_integer, 1, '', '1001', from_2, &
      'number of rows; with neither interval nor points more where an excitation is fast'), &
    key_rule_t('output', 'columns', a_text, any_number, '', unset, anything, &
      "columns that are written: names, or patterns with *, e.g. 'total_moment_*'; all if not given", fewest=1), &
    key_rule_t('output', 'format', a_word, 1, '', "'csv'", formats, &
      'trajectory.csv, or trajectory.nc, which nocdyn-sweep writes'), &
    key_rule_t('output', 'extremes_from', a_number, 1, 's', unset, anything, &
      'start of the time over which extremes are taken; t_start if not given'), &
    key_rule_t('output', 'units', a_word, any_number, '', unset, output_units, &
      'units of speeds (rpm or Hz) and of angles (deg) in results; those of SI if not given', fewest=1), &
    key_rule_t('output', 'directory', a_folder, 1, '', "''", anything, &
      "folder of the results; '' means results/ and the name of the input file")]

  type(kind_rule_t), parameter, public :: kind_rules(*) = [coupling_kinds, damper_kinds, joint_kinds, torque_kinds, &
    measurement_kinds, sweep_kinds, optimise_kinds]

  type(key_rule_t), parameter, public :: key_rules(*) = &
    [frame_keys, coupling_keys, damper_keys, joint_keys, torque_keys, engine_keys, response_keys, measurement_keys, sweep_keys, &
     fit_keys, optimise_keys]

  type(relation_rule_t), parameter, public :: relation_rules(*) = [ &
    relation_rule_t('run', less_than, 't_start', 't_end'), &
    relation_rule_t('run', requires, 'start_speed', 'start_body'), &
    relation_rule_t('run', requires, 'start_body free', 'start_speed'), &
    relation_rule_t('output', at_most_one, 'interval', 'points'), &
    coupling_relations, damper_relations, joint_relations, torque_relations, engine_relations, response_relations, &
    measurement_relations, sweep_relations, fit_relations, optimise_relations]

  type(alias_t), parameter, public :: aliases(*) = sweep_aliases

  !> Words that readers of other programs may try.
  type(group_alias_t), parameter, public :: group_aliases(*) = [ &
    group_alias_t('brake retarder',                           'clutch', "'ground' as one of its bodies"), &
    group_alias_t('dog dog_clutch synchronizer',              'clutch', "kind = 'dog'"), &
    group_alias_t('backstop holdback',                        'freewheel', "'ground' as one of its bodies"), &
    group_alias_t('overrunning_clutch one_way_clutch sprag',  'freewheel'), &
    group_alias_t('joint universal_joint hooke_joint',        'cardan'), &
    group_alias_t('cam',                                      'relation', "kind = 'cam'"), &
    group_alias_t('lever linkage',                            'relation', "kind = 'lever'"), &
    group_alias_t('piston slider_crank',                      'crank'), &
    group_alias_t('motion prescribed_motion hold',            'drive'), &
    group_alias_t('worm bevel spur pinion',                   'gear'), &
    group_alias_t('spring torsion_spring',                    'coupling'), &
    damper_aliases]

  type(example_t), parameter, public :: examples(*) = [ &
    example_t('case',       "title = 'Paper, case 2: harmonic torque on the motor'"), &
    example_t('body',       "name = 'motor'    inertia = 10.0"), &
    example_t('body',       "name = 'pinion'   inertia = 5.0"), &
    example_t('body',       "name = 'machine'  inertia = 5.0"), &
    example_t('run',        "t_end = 10.0  method = 'rk45'  rtol = 1.0e-9  atol = 1.0e-9"), &
    example_t('output',     'interval = 0.01'), &
    example_t('load_case',  "name = 'misfire'  misfire = 3", .false.), &
    example_t('load_case',  "name = 'half_load'  repeats = 5000  set = 'load.work.viscous=50'", .false.), &
    coupling_examples, damper_examples, joint_examples, torque_examples, response_examples, measurement_examples, &
    sweep_examples, fit_examples, optimise_examples]

  ! One value for each row of `group_rules`. The rows of `key_rules` of a group are consecutive.
  integer :: rule   ! index of the lists below
  integer, parameter, public :: first_key(*) = &   !! first row of `key_rules`
    [(findloc(key_rules%group, group_rules(rule)%name, dim=1), rule=1, size(group_rules))]
  integer, parameter, public :: last_key(*) = &   !! last row of `key_rules`
    [(findloc(key_rules%group, group_rules(rule)%name, dim=1, back=.true.), rule=1, size(group_rules))]
  integer, parameter, public :: selector_rule(*) = &   !! row of `key_rules` of the selector key, 0 if the group has none
    [(findloc(key_rules%group == group_rules(rule)%name .and. key_rules%value_type == a_selector, .true., dim=1), &
      rule=1, size(group_rules))]
  logical, parameter, public :: is_single(*) = &   !! the group occurs at most once: paths to its keys need no name
    group_rules%occurrence == exactly_once .or. group_rules%occurrence == at_most_once

contains

  !> Row of `group_rules`, 0 if there is no such group.
  pure integer function group_rule_index(name) result(rule)
    character(len=*), intent(in) :: name   !! in lower case

    do rule = size(group_rules), 1, -1
      if (group_rules(rule)%name == name) return
    end do
  end function group_rule_index

  !> Row of `key_rules`, 0 if the group has no such key.
  pure integer function key_rule_index(group_rule, name) result(key)
    integer, intent(in) :: group_rule      !! row of `group_rules`
    character(len=*), intent(in) :: name   !! in lower case

    do key = first_key(group_rule), last_key(group_rule)
      if (key_rules(key)%name == name) return
    end do
    key = 0
  end function key_rule_index

  !> Name of a key of a group.
  pure function key_name(group_rule, position) result(name)
    integer, intent(in) :: group_rule   !! row of `group_rules`
    integer, intent(in) :: position     !! of the key among the keys of the group
    character(len=:), allocatable :: name

    name = trim(key_rules(first_key(group_rule) + position - 1)%name)
  end function key_name

  !> Name of the selector key: "kind", "design" ...
  pure function selector_name(group_rule) result(name)
    integer, intent(in) :: group_rule   !! row of `group_rules`, of a group that has a selector key
    character(len=:), allocatable :: name

    name = trim(key_rules(selector_rule(group_rule))%name)
  end function selector_name

  !> Whether values of a type are written in quotes.
  pure logical function holds_texts(value_type)
    integer, intent(in) :: value_type   !! a_text ... a_document

    holds_texts = all(value_type /= [a_number, an_integer, a_flag])
  end function holds_texts

  !> Whether a word is one of a list that is separated by blanks.
  pure logical function has_word(list, word)
    character(len=*), intent(in) :: list, word

    has_word = index(' ' // list // ' ', ' ' // trim(word) // ' ') > 0
  end function has_word

  !> The words of a list that is separated by blanks.
  pure function words_in(list) result(words)
    character(len=*), intent(in) :: list
    type(string_t), allocatable :: words(:)
    integer :: first, last

    allocate (words(0))
    first = verify(list // '.', ' ')
    do while (first <= len(list))
      last = first - 2 + scan(list(first:) // ' ', ' ')
      call append(words, list(first:last))
      first = last + verify(list(last + 1:) // '.', ' ')
    end do
  end function words_in

  !> The words that a key of the type `a_word` or `a_selector` accepts.
  pure function words_of(rule) result(words)
    type(key_rule_t), intent(in) :: rule
    type(string_t), allocatable :: words(:)
    integer :: i

    if (rule%value_type /= a_selector) then
      words = words_in(rule%allowed%words)
      return
    end if
    allocate (words(0))
    do i = 1, size(kind_rules)
      if (kind_rules(i)%group == rule%group) call append(words, trim(kind_rules(i)%word))
    end do
  end function words_of

end module nocdyn_schema
