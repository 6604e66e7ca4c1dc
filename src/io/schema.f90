!> What an input file may hold: every group and every key once, with type, unit, default, allowed values and help.
!>
!> A new key is a new row of `key_rules`, a new group one of `group_rules` with its keys and an example; reading,
!> checking, help, template and reference follow from the rows.
module nocdyn_schema
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: group_rule_index, key_rule_index, first_key, last_key, is_single, holds_texts, words_of

  integer, parameter, public :: exactly_once = 1, at_most_once = 2, at_least_once = 3, any_times = 4

  integer, parameter, public :: a_text = 1, a_name = 2   !! a name: of an element, unique in its name space
  integer, parameter, public :: a_body = 3, body_or_ground = 4   !! name of a &body
  integer, parameter, public :: a_word = 5, a_number = 6, an_integer = 7, a_flag = 8

  integer, parameter, public :: any_number = 0   !! as `count`: a list of any length, possibly empty
  character(len=*), parameter, public :: required = '<required>', unset = '<unset>'   !! in place of a default
  character(len=*), parameter, public :: ground = 'ground'   !! stands for a body that does not turn
  integer, parameter, public :: longest_name = 63   !! bytes of an element's name

  !> The values that a key accepts.
  type, public :: allowed_t
    real(wp) :: low = -huge(1.0_wp)
    real(wp) :: high = huge(1.0_wp)
    logical :: excludes_low = .false.
    character(len=48) :: words = ''   !! separated by blanks, for `a_word`
  end type allowed_t

  !> One kind of group.
  type, public :: group_rule_t
    character(len=12) :: name
    integer :: occurrence
    character(len=12) :: name_space   !! elements of one name space have different names; '' where groups have no name
    character(len=96) :: help
  end type group_rule_t

  !> One key of a group.
  type, public :: key_rule_t
    character(len=12) :: group
    character(len=16) :: name
    integer :: kind                !! a_text ... a_flag
    integer :: count               !! how many values, or `any_number`
    character(len=12) :: unit
    character(len=12) :: default   !! of each value, as written in a file, or `required`, or `unset`
    type(allowed_t) :: allowed
    character(len=96) :: help
  end type key_rule_t

  !> Two keys of which a group has one: both given is a mistake; with none the one with a default stands, and if neither
  !> has a default one must be given.
  type, public :: alternative_t
    character(len=12) :: group
    character(len=16) :: first, second
  end type alternative_t

  !> Two keys of a group: `upper` must be greater than `lower`.
  type, public :: order_t
    character(len=12) :: group
    character(len=16) :: lower, upper
  end type order_t

  !> The inside of a group in the example machine of help and template.
  type, public :: example_t
    character(len=12) :: group
    character(len=112) :: text
  end type example_t

  type(allowed_t), parameter :: anything = allowed_t()
  type(allowed_t), parameter :: positive = allowed_t(low=0.0_wp, excludes_low=.true.)
  type(allowed_t), parameter :: not_negative = allowed_t(low=0.0_wp)
  type(allowed_t), parameter :: from_1 = allowed_t(low=1.0_wp)
  type(allowed_t), parameter :: steps = allowed_t(low=1.0_wp, high=1.0e8_wp)
  type(allowed_t), parameter :: from_2 = allowed_t(low=2.0_wp)
  type(allowed_t), parameter :: tolerance = allowed_t(low=1.0e-14_wp, high=0.1_wp)
  type(allowed_t), parameter :: methods = allowed_t(words='auto rk45 rk853 rosenbrock rodas4 rodas5p taylor')
  character(len=*), parameter :: default_method = "'auto'"
  type(allowed_t), parameter :: formulations = allowed_t(words='reduced paper multiplier')
  type(allowed_t), parameter :: complements = allowed_t(words='natural scaled negated')

  type(group_rule_t), parameter, public :: group_rules(*) = [ &
    group_rule_t('case',       at_most_once,  '',         'What the file is about.'), &
    group_rule_t('body',       at_least_once, 'body',     'A rigid body that turns about its axis.'), &
    group_rule_t('coupling',   any_times,     'coupling', 'An elastic coupling of two bodies, or of a body and the ground.'), &
    group_rule_t('gear',       any_times,     'gear',     'A rigid gear: R1 omega_1 + R2 omega_2 = 0, a minus if internal.'), &
    group_rule_t('motor',      any_times,     'torque',   'A driving torque a - b omega - c omega^2 on a body.'), &
    group_rule_t('load',       any_times,     'torque',   'A resisting torque -viscous omega on a body.'), &
    group_rule_t('excitation', any_times,     'torque',   'A torque amplitude sin(frequency t + phase) on a body.'), &
    group_rule_t('run',        exactly_once,  '',         'What is computed, and how.'), &
    group_rule_t('output',     at_most_once,  '',         'Which times are written, and where.')]

  type(key_rule_t), parameter, public :: key_rules(*) = [ &
    key_rule_t('case',       'title',           a_text,         1, '',            "''",        anything, &
      'one line that summaries and figures repeat'), &
    key_rule_t('body',       'name',            a_name,         1, '',            required,    anything, &
      'what couplings, gears, torques and results call it'), &
    key_rule_t('body',       'inertia',         a_number,       1, 'kg m2',       required,    positive, &
      'moment of inertia about the axis'), &
    key_rule_t('body',       'angle',           a_number,       1, 'rad',         '0',         anything, &
      'angle at the start'), &
    key_rule_t('body',       'speed',           a_number,       1, 'rad/s',       '0',         anything, &
      'speed at the start; geared bodies must start with speeds that fit the gears'), &
    key_rule_t('coupling',   'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('coupling',   'bodies',          body_or_ground, 2, '',            required,    anything, &
      "the two ends; twist = angle of the second - angle of the first; 'ground' does not turn"), &
    key_rule_t('coupling',   'stiffness',       a_number,       1, 'N m/rad',     '0',         not_negative, &
      'linear part of the elastic moment'), &
    key_rule_t('coupling',   'cubic_stiffness', a_number,       1, 'N m/rad3',    '0',         anything, &
      'cubic part of the elastic moment; negative softens'), &
    key_rule_t('coupling',   'damping',         a_number,       1, 'N m s/rad',   '0',         not_negative, &
      'moment per rate of twist'), &
    key_rule_t('coupling',   'rest_twist',      a_number,       1, 'rad',         '0',         anything, &
      'twist without elastic moment'), &
    key_rule_t('gear',       'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('gear',       'bodies',          a_body,         2, '',            required,    anything, &
      'the two wheels'), &
    key_rule_t('gear',       'radii',           a_number,       2, 'm',           unset,       positive, &
      'pitch radii, in the order of the bodies'), &
    key_rule_t('gear',       'teeth',           an_integer,     2, '',            unset,       from_1, &
      'numbers of teeth, in the order of the bodies'), &
    key_rule_t('gear',       'internal',        a_flag,         1, '',            '.false.',   anything, &
      'an internal gear: both wheels turn in the same direction'), &
    key_rule_t('motor',      'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('motor',      'body',            a_body,         1, '',            required,    anything, &
      'the body that it drives'), &
    key_rule_t('motor',      'a',               a_number,       1, 'N m',         required,    anything, &
      'torque at standstill'), &
    key_rule_t('motor',      'b',               a_number,       1, 'N m s/rad',   required,    anything, &
      'fall of the torque with the speed'), &
    key_rule_t('motor',      'c',               a_number,       1, 'N m s2/rad2', required,    anything, &
      'fall of the torque with the square of the speed'), &
    key_rule_t('load',       'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('load',       'body',            a_body,         1, '',            required,    anything, &
      'the body that it brakes'), &
    key_rule_t('load',       'viscous',         a_number,       1, 'N m s/rad',   '0',         not_negative, &
      'torque per speed'), &
    key_rule_t('excitation', 'name',            a_name,         1, '',            required,    anything, &
      'what results and messages call it'), &
    key_rule_t('excitation', 'body',            a_body,         1, '',            required,    anything, &
      'the body that it shakes'), &
    key_rule_t('excitation', 'amplitude',       a_number,       1, 'N m',         required,    anything, &
      'largest torque'), &
    key_rule_t('excitation', 'frequency',       a_number,       1, 'rad/s',       required,    not_negative, &
      'angular frequency'), &
    key_rule_t('excitation', 'phase',           a_number,       1, 'rad',         '0',         anything, &
      'phase at t = 0'), &
    key_rule_t('run',        't_start',         a_number,       1, 's',           '0',         anything, &
      'time of the start'), &
    key_rule_t('run',        't_end',           a_number,       1, 's',           required,    anything, &
      'time of the end, after t_start'), &
    key_rule_t('run',        'method',          a_word,         1, '',            default_method, methods, &
      'explicit: rk45, rk853, taylor; implicit: rodas4 = rosenbrock, rodas5p; auto: two of them'), &
    key_rule_t('run',        'rtol',            a_number,       1, '',            '1e-6',      tolerance, &
      'relative error tolerated in a step'), &
    key_rule_t('run',        'atol',            a_number,       1, '',            '1e-9',      positive, &
      'absolute error tolerated in a step, in the unit of the state'), &
    key_rule_t('run',        'formulation',     a_word,         1, '',            "'reduced'", formulations, &
      'equations that are integrated: the same motion, reduced is the fastest'), &
    key_rule_t('run',        'independent',     a_body,         any_number, '',   unset,       anything, &
      'bodies whose speeds are the coordinates; found if not given'), &
    key_rule_t('run',        'complement',      a_word,         1, '',            "'natural'", complements, &
      'which orthogonal complement of the gear constraints'), &
    key_rule_t('run',        'max_steps',       an_integer,     1, '',            '1000000',   steps, &
      'the run fails after this many steps'), &
    key_rule_t('output',     'interval',        a_number,       1, 's',           unset,       positive, &
      'time from row to row'), &
    key_rule_t('output',     'points',          an_integer,     1, '',            '1001',      from_2, &
      'number of rows from t_start to t_end'), &
    key_rule_t('output',     'directory',       a_text,         1, '',            "''",        anything, &
      "where results go; '' means results/ and the name of the input file")]

  type(alternative_t), parameter, public :: alternatives(*) = [ &
    alternative_t('gear',   'radii',    'teeth'), &
    alternative_t('output', 'interval', 'points')]

  type(order_t), parameter, public :: orders(*) = [ &
    order_t('run', 't_start', 't_end')]

  type(example_t), parameter, public :: examples(*) = [ &
    example_t('case',       "title = 'Paper, case 2: harmonic torque on the motor'"), &
    example_t('body',       "name = 'motor'    inertia = 10.0"), &
    example_t('body',       "name = 'pinion'   inertia = 5.0"), &
    example_t('body',       "name = 'machine'  inertia = 5.0"), &
    example_t('coupling',   "name = 'coupling' bodies = 'motor', 'pinion' stiffness = 100.0 cubic_stiffness = 10.0"), &
    example_t('gear',       "name = 'reducer'  bodies = 'pinion', 'machine' radii = 2.0, 3.0"), &
    example_t('motor',      "name = 'drive'    body = 'motor'    a = 200.0  b = 10.0  c = 1.0"), &
    example_t('load',       "name = 'work'     body = 'machine'  viscous = 100.0"), &
    example_t('excitation', "name = 'shaker'   body = 'motor'    amplitude = 20.0  frequency = 5.0"), &
    example_t('run',        "t_end = 10.0  method = 'rk45'  rtol = 1.0e-9  atol = 1.0e-9"), &
    example_t('output',     'interval = 0.01')]

contains

  !> Row of `group_rules`, 0 if there is no such group.
  pure integer function group_rule_index(name) result(rule)
    character(len=*), intent(in) :: name   !! in lower case

    do rule = size(group_rules), 1, -1
      if (group_rules(rule)%name == name) return
    end do
  end function group_rule_index

  !> First row of `key_rules` of a group; the rows of a group stand together.
  pure integer function first_key(group_rule) result(key)
    integer, intent(in) :: group_rule

    do key = 1, size(key_rules)
      if (key_rules(key)%group == group_rules(group_rule)%name) return
    end do
  end function first_key

  !> Last row of `key_rules` of a group.
  pure integer function last_key(group_rule) result(key)
    integer, intent(in) :: group_rule

    do key = size(key_rules), 1, -1
      if (key_rules(key)%group == group_rules(group_rule)%name) return
    end do
  end function last_key

  !> Row of `key_rules`, 0 if the group has no such key.
  pure integer function key_rule_index(group_rule, name) result(key)
    integer, intent(in) :: group_rule
    character(len=*), intent(in) :: name   !! in lower case

    do key = first_key(group_rule), last_key(group_rule)
      if (key_rules(key)%name == name) return
    end do
    key = 0
  end function key_rule_index

  !> Whether a group occurs at most once, so that its kind alone identifies it.
  pure logical function is_single(group_rule)
    integer, intent(in) :: group_rule

    is_single = any(group_rules(group_rule)%occurrence == [exactly_once, at_most_once])
  end function is_single

  !> Whether values of this kind are written in quotes.
  pure logical function holds_texts(kind)
    integer, intent(in) :: kind

    holds_texts = any(kind == [a_text, a_name, a_body, body_or_ground, a_word])
  end function holds_texts

  !> The words that a key of the kind `a_word` accepts.
  pure function words_of(allowed) result(words)
    type(allowed_t), intent(in) :: allowed
    type(string_t), allocatable :: words(:)
    integer :: first, length

    allocate (words(0))
    first = 1
    do while (len_trim(allowed%words(first:)) > 0)
      length = index(allowed%words(first:) // ' ', ' ') - 1
      call append(words, allowed%words(first:first + length - 1))
      first = first + length + 1
      if (first > len(allowed%words)) exit
    end do
  end function words_of

end module nocdyn_schema
