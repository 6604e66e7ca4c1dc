!> The types of the rows of the schema, and the values that they hold.
module nocdyn_schema_rules
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: is_out_of_range, is_too_small, size_limit

  !> Numbers of an input are at most so large in size, so that products and powers of a few of them stay finite. Those that are
  !> divided by, which are the ones that cannot be negative, cannot be 0 or ascend, are 0 or at least so large.
  real(wp), parameter :: largest_size = 1.0e50_wp, smallest_size = 1.0e-50_wp

  !> A topic of the help on an input.
  type, public :: topic_t
    character(len=12) :: name   !! the word of 'nocdyn help input', not the one of a group
    character(len=56) :: help
  end type topic_t

  ! Topic of a group.
  integer, parameter, public :: in_machine = 1, in_torques = 2, in_simulation = 3, in_torsional = 4, in_sweeps = 5
  integer, parameter, public :: in_fits = 6
  type(topic_t), parameter, public :: topics(6) = [ &   !! `in_machine` ... `in_fits`, in the order in which a user needs them
    topic_t('machine',    'bodies and what connects them'), &
    topic_t('torques',    'what drives and loads the machine'), &
    topic_t('simulation', 'the motion over time, and what is written'), &
    topic_t('torsional',  'vibrations over the speed, critical speeds, limits'), &
    topic_t('sweeps',     'many variants of a machine'), &
    topic_t('fits',       'numbers that are found: from measurements, or best ones')]

  ! Occurrence of a group.
  integer, parameter, public :: exactly_once = 1, at_most_once = 2, at_least_once = 3, any_times = 4
  character(len=19), parameter, public :: occurrence_texts(4) = &   !! of `exactly_once` ... `any_times`
    [character(len=19) :: 'once', 'at most once', 'at least once', 'any number of times']

  ! Type of the values of a key.
  integer, parameter, public :: a_text = 1, a_name = 2   !! a name: of an element, unique in its name space
  integer, parameter, public :: a_body = 3, body_or_ground = 4   !! name of a &body
  integer, parameter, public :: a_word = 5, a_number = 6, an_integer = 7, a_flag = 8
  integer, parameter, public :: a_selector = 9   !! a word of `kind_rules`, the kind of the group; at most one key of a group
  integer, parameter, public :: a_file = 10      !! path of a table file, relative to the folder of the input
  integer, parameter, public :: a_folder = 11    !! path of a folder
  integer, parameter, public :: a_document = 12  !! path of a file that other programs read, relative to the folder of the input
  integer, parameter, public :: a_line_file = 13 !! path of a text file whose lines are the next key, relative to that folder
  character(len=12), parameter, public :: type_nouns(13) = [character(len=12) :: &   !! of `a_text` ... `a_line_file`
    'text', 'name', 'body', 'body', 'word', 'number', 'whole number', 'logical', 'word', 'file', 'folder', 'file', 'file']

  ! Relations between two sets of keys, `first` and `second`.
  integer, parameter, public :: exactly_one = 1    !! keys of one set are given; the ones of the other lose their defaults
  integer, parameter, public :: at_most_one = 2    !! as `exactly_one`, or neither set is given
  integer, parameter, public :: requires = 3       !! `first` has values and defaults only beside one of `second`, but for a 0
  integer, parameter, public :: equal_lengths = 4  !! of the lists `first`; `second`: a file with two of them as columns, or ''
  integer, parameter, public :: less_than = 5      !! the number `first` is less than the number `second`
  integer, parameter, public :: columns = 6        !! as equal_lengths; `second`: a file that names its columns, other lists

  integer, parameter, public :: records = 7        !! lists of equal length; `second`: a file, and what says which are its columns

  integer, parameter, public :: any_number = 0   !! as `count`: a list of any length, possibly empty
  character(len=*), parameter, public :: required = '<required>', unset = '<unset>'   !! in place of a default
  character(len=*), parameter, public :: ground = 'ground'   !! the name of the body that does not turn
  integer, parameter, public :: longest_name = 63   !! bytes of an element's name

  !> The values that a key accepts.
  type, public :: allowed_t
    real(wp) :: low = -huge(1.0_wp)
    real(wp) :: high = huge(1.0_wp)
    logical :: excludes_low = .false.
    logical :: excludes_zero = .false.
    character(len=64) :: words = ''   !! separated by blanks, for `a_word`
  end type allowed_t

  !> One group.
  type, public :: group_rule_t
    character(len=12) :: name
    integer :: topic                  !! row of `topics`
    integer :: occurrence
    character(len=12) :: name_space   !! names are unique in a name space; '': groups without names
    character(len=96) :: help
  end type group_rule_t

  !> One kind of a group: a word of its selector key.
  type, public :: kind_rule_t
    character(len=12) :: group
    character(len=16) :: word
    character(len=80) :: help
  end type kind_rule_t

  !> One key of a group.
  type, public :: key_rule_t
    character(len=12) :: group
    character(len=22) :: name
    integer :: value_type          !! `a_text` ... `a_line_file`
    integer :: count               !! how many values, or `any_number`
    character(len=12) :: unit
    character(len=12) :: default   !! of each value, as written in a file, or `required`, or `unset`
    type(allowed_t) :: allowed
    character(len=96) :: help
    character(len=48) :: only_if = ''       !! kinds that have this key, separated by blanks; '': all
    integer :: fewest = 0                   !! least number of values of a list that is given
    character(len=12) :: required_if = ''   !! the kind with which this key must be given
    logical :: ascends = .false.            !! each value of the list is greater than the one before
    logical :: may_repeat = .false.         !! the list may name a body more than once
    logical :: follows = .false.            !! if not given, it may follow from other groups, and the default is not written
  end type key_rule_t

  !> A relation between keys of one group.
  type, public :: relation_rule_t
    character(len=12) :: group
    integer :: form                          !! `exactly_one` ... `records`
    character(len=144) :: first, second      !! keys, separated by blanks
    character(len=18) :: equal_if_one = ''   !! `less_than`: the numbers may be equal if this key is 1
    character(len=18) :: word = ''           !! `requires`: the only word of `second` that is enough; '': any value
  end type relation_rule_t

  !> Words that other programs use for keys. Both lists are separated by blanks.
  type, public :: alias_t
    character(len=12) :: group
    character(len=48) :: words, keys
  end type alias_t

  !> Words of the field for a group, separated by blanks.
  type, public :: group_alias_t
    character(len=48) :: words
    character(len=12) :: group
    character(len=40) :: addition = ''   !! what the group needs then
  end type group_alias_t

  !> An example of a group.
  type, public :: example_t
    character(len=12) :: group
    character(len=256) :: text   !! keys and values, with | where a line ends
    logical :: is_in_template = .true.   !! part of the example machine of help and template
  end type example_t

  type(allowed_t), parameter, public :: anything = allowed_t()
  type(allowed_t), parameter, public :: positive = allowed_t(low=0.0_wp, excludes_low=.true.)
  type(allowed_t), parameter, public :: not_negative = allowed_t(low=0.0_wp)
  type(allowed_t), parameter, public :: efficiencies = allowed_t(low=0.0_wp, high=1.0_wp, excludes_low=.true.)
  type(allowed_t), parameter, public :: reverse_efficiencies = allowed_t(low=-10.0_wp, high=1.0_wp)
  type(allowed_t), parameter, public :: not_zero = allowed_t(excludes_zero=.true.)
  type(allowed_t), parameter, public :: above_1 = allowed_t(low=1.0_wp, excludes_low=.true.)
  type(allowed_t), parameter, public :: from_1 = allowed_t(low=1.0_wp)
  type(allowed_t), parameter, public :: from_2 = allowed_t(low=2.0_wp)
  type(allowed_t), parameter, public :: from_0_to_1 = allowed_t(low=0.0_wp, high=1.0_wp)
  type(allowed_t), parameter, public :: interpolations = allowed_t(words='linear cubic')
  type(allowed_t), parameter, public :: strokes = allowed_t(low=2.0_wp, high=4.0_wp)
  type(allowed_t), parameter, public :: up_to_64 = allowed_t(low=0.0_wp, high=64.0_wp, excludes_low=.true.)
  type(allowed_t), parameter, public :: extrapolations = allowed_t(words='linear constant')
  character(len=*), parameter, public :: linear = "'linear'"   !! default of interpolations and extrapolations

contains

  !> Whether a key does not accept a number.
  pure logical function is_out_of_range(value, allowed)
    real(wp), intent(in) :: value
    type(allowed_t), intent(in) :: allowed

    is_out_of_range = value < allowed%low .or. value > allowed%high
    if (allowed%excludes_low) is_out_of_range = is_out_of_range .or. .not. value > allowed%low
    if (allowed%excludes_zero) is_out_of_range = is_out_of_range .or. abs(value) <= 0.0_wp
  end function is_out_of_range

  !> Whether a number is not 0 but so near to it that nothing is to be divided by it.
  elemental logical function is_too_small(value)
    real(wp), intent(in) :: value

    is_too_small = abs(value) > 0 .and. abs(value) < smallest_size
  end function is_too_small

  !> The limit on its size that a number breaks, '' if it breaks none.
  pure function size_limit(value, allowed, ascends) result(text)
    real(wp), intent(in) :: value
    type(allowed_t), intent(in) :: allowed   !! values of the key
    logical, intent(in) :: ascends           !! whether the number is one of an ascending list
    character(len=:), allocatable :: text

    text = ''
    if (abs(value) > largest_size) then
      text = ', at most 1e50 in size'
    else if (is_too_small(value) .and. (ascends .or. allowed%excludes_zero .or. abs(allowed%low) <= 0)) then
      text = ', at least 1e-50 in size'
      if (.not. is_out_of_range(0.0_wp, allowed)) text = text // ' unless 0'
    end if
  end function size_limit

end module nocdyn_schema_rules
