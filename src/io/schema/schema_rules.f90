!> What the rows of the schema are made of.
module nocdyn_schema_rules
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: is_outside

  integer, parameter, public :: exactly_once = 1, at_most_once = 2, at_least_once = 3, any_times = 4

  integer, parameter, public :: a_text = 1, a_name = 2   !! a name: of an element, unique in its name space
  integer, parameter, public :: a_body = 3, body_or_ground = 4   !! name of a &body
  integer, parameter, public :: a_word = 5, a_number = 6, an_integer = 7, a_flag = 8
  integer, parameter, public :: a_kind = 9   !! a word of `kind_rules`, which says what keys the group has; one in a group
  integer, parameter, public :: a_file = 10  !! path of a table file, relative to the folder of the input

  integer, parameter, public :: any_number = 0   !! as `count`: a list of any length, possibly empty
  character(len=*), parameter, public :: required = '<required>', unset = '<unset>'   !! in place of a default
  character(len=*), parameter, public :: ground = 'ground'   !! stands for a body that does not turn
  integer, parameter, public :: longest_name = 63   !! bytes of an element's name

  !> The values that a key accepts.
  type, public :: allowed_t
    real(wp) :: low = -huge(1.0_wp)
    real(wp) :: high = huge(1.0_wp)
    logical :: excludes_low = .false.
    logical :: excludes_zero = .false.
    character(len=48) :: words = ''   !! separated by blanks, for `a_word`
  end type allowed_t

  !> One kind of group.
  type, public :: group_rule_t
    character(len=12) :: name
    integer :: occurrence
    character(len=12) :: name_space   !! elements of one name space have different names; '' where groups have no name
    character(len=96) :: help
  end type group_rule_t

  !> One word of a group's key of the kind `a_kind`.
  type, public :: kind_rule_t
    character(len=12) :: group
    character(len=16) :: word
    character(len=80) :: help
  end type kind_rule_t

  !> One key of a group.
  type, public :: key_rule_t
    character(len=12) :: group
    character(len=18) :: name
    integer :: kind                !! a_text ... a_file
    integer :: count               !! how many values, or `any_number`
    character(len=12) :: unit
    character(len=12) :: default   !! of each value, as written in a file, or `required`, or `unset`
    type(allowed_t) :: allowed
    character(len=96) :: help
    character(len=48) :: kinds = ''   !! words of `kind_rules` that have this key, separated by blanks; '': all
    integer :: least = 0              !! fewest values of a list that is given
    character(len=12) :: needed_by = ''   !! the word of `kind_rules` with which this key must be given
  end type key_rule_t

  !> Two sets of keys, separated by blanks, of which a group has one: keys of both given are a mistake; the defaults of a
  !> set do not stand beside the other.
  type, public :: alternative_t
    character(len=12) :: group
    character(len=64) :: first, second
    logical :: is_needed = .false.   !! one of them must be given
  end type alternative_t

  !> Each of `keys` must not be given without one of `needed`, and has its default only beside a value of one of these. Both
  !> are separated by blanks. A zero needs nothing.
  type, public :: need_t
    character(len=12) :: group
    character(len=48) :: keys, needed
  end type need_t

  !> Lists that have the same length and need each other; a list of numbers with a default may be absent.
  type, public :: columns_t
    character(len=12) :: group
    character(len=48) :: keys          !! separated by blanks
    character(len=12) :: file = ''     !! the key of a file that may hold the two lists as columns; the first one ascends then
  end type columns_t

  !> Two keys of a group: `upper` must be greater than `lower`.
  type, public :: order_t
    character(len=12) :: group
    character(len=18) :: lower, upper
    character(len=18) :: alone = ''   !! a key with which both may be equal if it is 1; if it is not, the sweep judges that
  end type order_t

  !> Words that stand for keys in other programs. Both are separated by blanks.
  type, public :: synonym_t
    character(len=12) :: group
    character(len=48) :: words, keys
  end type synonym_t

  !> The inside of a group as an example.
  type, public :: example_t
    character(len=12) :: group
    character(len=192) :: text   !! with | where a line ends
    logical :: is_in_template = .true.   !! part of the example machine of help and template
  end type example_t

  type(allowed_t), parameter, public :: anything = allowed_t()
  type(allowed_t), parameter, public :: positive = allowed_t(low=0.0_wp, excludes_low=.true.)
  type(allowed_t), parameter, public :: not_negative = allowed_t(low=0.0_wp)
  type(allowed_t), parameter, public :: not_zero = allowed_t(excludes_zero=.true.)
  type(allowed_t), parameter, public :: from_1 = allowed_t(low=1.0_wp)
  type(allowed_t), parameter, public :: from_2 = allowed_t(low=2.0_wp)
  type(allowed_t), parameter, public :: from_0_to_1 = allowed_t(low=0.0_wp, high=1.0_wp)
  type(allowed_t), parameter, public :: interpolations = allowed_t(words='linear cubic')
  type(allowed_t), parameter, public :: extrapolations = allowed_t(words='linear constant')

contains

  !> Whether a number is none that a key accepts.
  pure logical function is_outside(value, allowed)
    real(wp), intent(in) :: value
    type(allowed_t), intent(in) :: allowed

    is_outside = value < allowed%low .or. value > allowed%high
    if (allowed%excludes_low) is_outside = is_outside .or. .not. value > allowed%low
    if (allowed%excludes_zero) is_outside = is_outside .or. abs(value) <= 0.0_wp
  end function is_outside

end module nocdyn_schema_rules
