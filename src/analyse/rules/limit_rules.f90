!> A rule with the numbers of one &limit: its limits over the speed, the ranges of speeds that it bars.
module nocdyn_limit_rules
  use nocdyn_built_in_texts, only: find_built_in
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_rule_expressions, only: formula_t
  use nocdyn_rule_files, only: continuous, hold, is_choice, is_range, is_symbol, is_value, lambda, n_c, order, read_rule, &
    refuse, rule_item_t, rule_t
  use nocdyn_text, only: append, joined, quoted, rounded_text, split_lines, string_t
  use nocdyn_units, only: from_si, in_si, unit_rpm
  implicit none (type, external)
  private

  public :: bind_rule, load_rule, margin_of

  real(wp), parameter :: least_limit = 1.0e-30_wp   ! in place of one that is not defined or not positive, which nothing keeps
  integer, parameter :: digits = 6                  ! of numbers in messages
  character(len=*), parameter :: limit_keys(*) = [character(len=16) :: 'tensile_strength', 'c_k']   ! that only some rules use

  type, public :: limit_rule_t
    type(rule_t) :: rule
    type(string_t), allocatable :: notes(:)        !! what is said of numbers outside of the rule's ranges
    real(wp), allocatable, private :: values(:)    ! of the symbols; the ones that follow the speed at the rated speed
    logical, allocatable, private :: follows(:)    ! the speed
    real(wp), private :: rated = 1.0_wp            ! [rad/s]
  contains
    procedure :: continuous_at, transient_at, bars_at, find_barred, write_place, write_unbarred, has_tolerance
    procedure, private :: values_at
  end type limit_rule_t

contains

  !> Reads the rule that a group names, built in or of a file of the user.
  subroutine load_rule(input, index, prefix, rule, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index             !! of the group
    character(len=*), intent(in) :: prefix   !! of its keys: '' or 'margin_'
    type(rule_t), intent(out) :: rule
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text
    type(string_t), allocatable :: lines(:), names(:)

    associate (group => input%groups(index))
      if (group%has_value(prefix // 'rule_file')) then
        allocate (lines, source=group%texts(prefix // 'rule_lines'))
        call read_rule(group%text(prefix // 'rule_file'), lines, rule, error)
      else
        call find_built_in('rule', group%text(prefix // 'rule'), text, names)
        if (.not. allocated(text)) error stop 'nocdyn_limit_rules: the schema allows a rule that there is not'
        call split_lines(text, lines)
        call read_rule('rule ' // group%text(prefix // 'rule'), lines, rule, error)
      end if
      if (allocated(error)) return
      if (prefix == '' .and. .not. rule%continuous%is_given()) then
        call raise(error, exit_input, input%location(index) // ': ' // rule%label // ' has no limits; allowed: as ' // &
                   'margin_rule of &response')
      else if (prefix /= '' .and. .not. rule%margin%is_given()) then
        call raise(error, exit_input, input%location(index) // ': ' // rule%label // ' has no margin; allowed: a rule with ' // &
                   'a line "margin = FORMULA"')
      end if
    end associate
  end subroutine load_rule

  !> The separation margin that a rule asks for at a critical speed, as a share of the speed.
  pure real(wp) function margin_of(rule, of_order)
    type(rule_t), intent(in) :: rule
    real(wp), intent(in) :: of_order   !! of the excitation
    real(wp) :: values(size(rule%names))
    logical :: is_defined
    integer :: i

    values = 0.0_wp
    values(order) = of_order
    do i = 1, size(rule%items)
      associate (item => rule%items(i))
        if (item%kind == is_range .or. .not. item%formula%is_given()) cycle
        call item%formula%evaluate(values, values(item%symbol), is_defined)
      end associate
    end do
    call rule%margin%evaluate(values, margin_of, is_defined)
  end function margin_of

  !> Takes the numbers of a group &limit.
  subroutine bind_rule(input, index, diameter, self, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index           !! of the group
    real(wp), intent(in) :: diameter       !! of the element [m], 0: unknown
    type(limit_rule_t), intent(inout) :: self   !! with its rule
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: problem
    real(wp) :: at_rated

    associate (group => input%groups(index))
      allocate (self%notes(0), self%values(size(self%rule%names)), self%follows(size(self%rule%names)))
      self%values = 0.0_wp
      self%values(lambda) = 1.0_wp
      self%follows = .false.
      self%follows(lambda) = .true.
      self%rated = abs(group%number('rated_speed', absent=0.0_wp))
      problem = ''
      call check_given(group, self%rule, problem)
      if (problem == '') call take_numbers(group, diameter, input%place(index, ''), self, problem)
      if (problem == '' .and. uses_speed(self) .and. .not. self%rated > 0) then
        problem = 'needs rated_speed [rad/s] or rated_speed_rpm'
      end if
      if (problem == '') then
        at_rated = self%continuous_at(self%rated)
        if (at_rated <= least_limit * self%rule%factor) problem = 'has no positive limit at lambda = 1 with these numbers'
      end if
      if (problem == '') return
      call raise(error, exit_input, input%location(index) // ': the rule ' // self%rule%label // ' ' // problem)
    end associate
  end subroutine bind_rule

  !> Whether a speed is in the limits.
  pure logical function uses_speed(self)
    type(limit_rule_t), intent(in) :: self
    integer :: i

    uses_speed = self%rule%unbarred%is_given() .or. self%rule%barred_from%is_given()
    do i = 1, size(self%follows)
      if (self%follows(i)) uses_speed = uses_speed .or. self%rule%continuous%uses(i) .or. self%rule%transient%uses(i)
    end do
  end function uses_speed

  !> Numbers and words that the rule does not know.
  subroutine check_given(group, rule, problem)
    type(group_t), intent(in) :: group   !! &limit
    type(rule_t), intent(in) :: rule
    character(len=:), allocatable, intent(inout) :: problem
    type(string_t), allocatable :: choices(:), free(:), symbols(:), words(:)
    integer :: i, k

    allocate (free(0), words(0))
    do i = 1, size(rule%items)
      associate (item => rule%items(i))
        if (item%kind == is_symbol .and. item%key == '') call append(free, trim(rule%names(item%symbol)))
        if (item%kind /= is_choice) cycle
        do k = 1, size(item%words)
          if (.not. is_in(item%words(k)%text, words)) call append(words, item%words(k)%text)
        end do
      end associate
    end do
    do i = 1, size(limit_keys)
      if (.not. group%has_value(trim(limit_keys(i))) .or. any(rule%items%key == limit_keys(i))) cycle
      problem = 'does not use ' // trim(limit_keys(i))
    end do
    allocate (symbols, source=group%texts('rule_symbols'))
    do i = 1, size(symbols)
      if (.not. is_in(symbols(i)%text, free)) problem = 'has no symbol ' // quoted(symbols(i)%text) // allowed(free)
    end do
    allocate (choices, source=group%texts('choices'))
    do i = 1, size(choices)
      if (.not. is_in(choices(i)%text, words)) problem = 'has no choice ' // quoted(choices(i)%text) // allowed(words)
    end do
  end subroutine check_given

  !> "; allowed: a, b"
  function allowed(list) result(text)
    type(string_t), intent(in) :: list(:)
    character(len=:), allocatable :: text

    text = '; allowed: none'
    if (size(list) > 0) text = '; allowed: ' // joined(list, ', ')
  end function allowed

  pure logical function is_in(text, list)
    character(len=*), intent(in) :: text
    type(string_t), intent(in) :: list(:)
    integer :: i

    is_in = any([(list(i)%text == text, i=1, size(list))])
  end function is_in

  !> Goes through the symbols and ranges of the rule.
  subroutine take_numbers(group, diameter, place, self, problem)
    type(group_t), intent(in) :: group       !! &limit
    real(wp), intent(in) :: diameter         !! of the element [m], 0: unknown
    character(len=*), intent(in) :: place    !! of the group, for notes
    type(limit_rule_t), intent(inout) :: self
    character(len=:), allocatable, intent(inout) :: problem
    logical :: is_defined
    integer :: i, k

    do i = 1, size(self%rule%items)
      associate (item => self%rule%items(i))
        if (item%kind == is_symbol) then
          call take_symbol(group, diameter, item, self, problem)
        else if (item%kind == is_choice) then
          call take_choice(group, item, self, problem)
        else if (item%kind == is_value) then
          self%follows(item%symbol) = any([(self%follows(k) .and. item%formula%uses(k), k=1, size(self%follows))])
          call item%formula%evaluate(self%values, self%values(item%symbol), is_defined)
          if (.not. is_defined) problem = 'has no value of ' // trim(self%rule%names(item%symbol)) // ' with these numbers'
        else if (item%symbol /= lambda) then
          call apply_range(item, place, self, problem)
        end if
      end associate
      if (problem /= '') return
    end do
  end subroutine take_numbers

  !> A number of the input, in the unit of the rule.
  subroutine take_symbol(group, diameter, item, self, problem)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: diameter
    type(rule_item_t), intent(in) :: item
    type(limit_rule_t), intent(inout) :: self
    character(len=:), allocatable, intent(inout) :: problem
    type(string_t), allocatable :: names(:)
    real(wp), allocatable :: numbers(:)
    character(len=:), allocatable :: name
    logical :: is_found
    integer :: i
    real(wp) :: value

    name = trim(self%rule%names(item%symbol))
    is_found = .false.
    if (item%key /= '') then
      is_found = group%has_value(trim(item%key))
      value = group%number(trim(item%key), absent=0.0_wp)
      if (item%key == 'diameter' .and. .not. is_found) then
        is_found = diameter > 0
        value = diameter
      end if
      value = value / item%factor
    else
      allocate (names, source=group%texts('rule_symbols'))
      allocate (numbers, source=group%numbers('rule_values'))
      do i = 1, size(names)
        if (names(i)%text /= name) cycle
        is_found = .true.
        value = numbers(i)
      end do
    end if
    if (.not. is_found .and. item%formula%is_given()) call item%formula%evaluate(self%values, value, is_found)
    if (is_found) then
      self%values(item%symbol) = value
    else if (item%key == 'diameter') then
      problem = 'needs a diameter [m], of &limit or of the element'
    else if (item%key /= '') then
      problem = 'needs ' // trim(item%key)
    else
      problem = 'needs ' // quoted(name) // ' among rule_symbols, with its number in rule_values'
    end if
  end subroutine take_symbol

  !> The number of a word.
  subroutine take_choice(group, item, self, problem)
    type(group_t), intent(in) :: group
    type(rule_item_t), intent(in) :: item
    type(limit_rule_t), intent(inout) :: self
    character(len=:), allocatable, intent(inout) :: problem
    type(string_t), allocatable :: given(:)
    logical :: is_defined
    integer :: i, found

    allocate (given, source=group%texts('choices'))
    found = 0
    do i = 1, size(item%words)
      if (.not. is_in(item%words(i)%text, given)) cycle
      if (found > 0) then
        problem = 'takes one of the choices ' // quoted(item%words(found)%text) // ' and ' // quoted(item%words(i)%text) // &
                  ' only'
        return
      end if
      found = i
    end do
    if (found > 0) then
      self%values(item%symbol) = item%numbers(found)
    else if (item%formula%is_given()) then
      call item%formula%evaluate(self%values, self%values(item%symbol), is_defined)
    else
      problem = 'needs one of the choices ' // joined(item%words, ', ')
    end if
  end subroutine take_choice

  !> What a number outside of a range of the rule leads to.
  subroutine apply_range(item, place, self, problem)
    type(rule_item_t), intent(in) :: item
    character(len=*), intent(in) :: place
    type(limit_rule_t), intent(inout) :: self
    character(len=:), allocatable, intent(inout) :: problem
    character(len=:), allocatable :: bound_text, text
    real(wp) :: bound
    logical :: is_defined

    call item%formula%evaluate(self%values, bound, is_defined)
    associate (value => self%values(item%symbol))
      if (is_inside(item, value, bound) .or. .not. is_defined) return
      bound_text = rounded_text(bound, digits)
      text = trim(self%rule%names(item%symbol)) // ' = ' // rounded_text(value, digits)
      if (item%action == refuse) then
        problem = 'allows ' // trim(self%rule%names(item%symbol)) // merge(' <= ', ' >= ', item%is_upper) // bound_text // &
                  '; it is ' // rounded_text(value, digits)
      else if (item%action == hold) then
        call append(self%notes, place // ': ' // self%rule%label // ': ' // text // ' is taken as ' // bound_text // ', the ' // &
                    trim(merge('most ', 'least', item%is_upper)) // ' that the rule takes')
        value = bound
      else
        call append(self%notes, place // ': ' // self%rule%label // ': ' // text // ' is outside of the range of the rule, ' // &
                    merge('<= ', '>= ', item%is_upper) // bound_text)
      end if
    end associate
  end subroutine apply_range

  pure logical function is_inside(item, value, bound)
    type(rule_item_t), intent(in) :: item
    real(wp), intent(in) :: value, bound

    is_inside = merge(value <= bound, value >= bound, item%is_upper)
  end function is_inside

  !> The symbols at a speed.
  pure function values_at(self, speed) result(values)
    class(limit_rule_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp) :: values(size(self%values))
    real(wp) :: bound
    logical :: is_defined
    integer :: i

    values = self%values
    if (.not. self%rated > 0) return
    values(lambda) = abs(speed) / self%rated
    do i = 1, size(self%rule%items)
      associate (item => self%rule%items(i))
        if (item%kind == is_range .and. item%symbol == lambda .and. item%action == hold) then
          call item%formula%evaluate(values, bound, is_defined)
          if (is_defined .and. .not. is_inside(item, values(lambda), bound)) values(lambda) = bound
        else if (item%kind == is_value) then
          if (self%follows(item%symbol)) call item%formula%evaluate(values, values(item%symbol), is_defined)
        end if
      end associate
    end do
    values(continuous) = positive_value(self%rule%continuous, values)
  end function values_at

  !> A limit, in the unit of the rule.
  pure real(wp) function positive_value(formula, values)
    type(formula_t), intent(in) :: formula
    real(wp), intent(in) :: values(:)
    logical :: is_defined

    call formula%evaluate(values, positive_value, is_defined)
    if (.not. is_defined .or. positive_value < least_limit) positive_value = least_limit
  end function positive_value

  !> The limit of the half range in continuous operation, in the SI unit.
  elemental real(wp) function continuous_at(self, speed)
    class(limit_rule_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]

    continuous_at = self%rule%factor * positive_value(self%rule%continuous, self%values_at(speed))
  end function continuous_at

  !> The limit while a speed is passed, if the rule has one.
  elemental real(wp) function transient_at(self, speed)
    class(limit_rule_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp) :: values(size(self%values))

    values = self%values_at(speed)
    values(continuous) = positive_value(self%rule%continuous, values)
    transient_at = self%rule%factor * positive_value(self%rule%transient, values)
  end function transient_at

  !> Whether the rule lets a range of speeds be barred there.
  elemental logical function bars_at(self, speed)
    class(limit_rule_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp) :: share
    logical :: is_defined

    bars_at = .true.
    if (.not. self%rule%unbarred%is_given()) return
    call self%rule%unbarred%evaluate(self%values, share, is_defined)
    if (is_defined) bars_at = abs(speed) < share * self%rated
  end function bars_at

  !> Whether the rule says which speeds about a critical one are to be barred.
  elemental logical function has_tolerance(self)
    class(limit_rule_t), intent(in) :: self

    has_tolerance = self%rule%barred_from%is_given()
  end function has_tolerance

  !> Widens a range that exceeds the limit to the one that the rule bars about its critical speed.
  pure subroutine find_barred(self, critical, from, to)
    class(limit_rule_t), intent(in) :: self
    real(wp), intent(in) :: critical       !! speed of the largest stress in the range [rad/s]
    real(wp), intent(inout) :: from, to    !! [rad/s]
    real(wp) :: values(size(self%values)), first, last
    logical :: has_first, has_last

    values = self%values_at(critical)
    values(n_c) = from_si(abs(critical), unit_rpm)
    call self%rule%barred_from%evaluate(values, first, has_first)
    call self%rule%barred_to%evaluate(values, last, has_last)
    if (.not. (has_first .and. has_last)) return
    from = sign(min(abs(from), in_si(first, unit_rpm)), from)
    to = sign(max(abs(to), in_si(last, unit_rpm)), to)
  end subroutine find_barred

  !> "lambda 0.84", '' if the rule knows no rated speed.
  pure subroutine write_place(self, speed, text)
    class(limit_rule_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    character(len=:), allocatable, intent(out) :: text
    real(wp) :: bound
    logical :: is_defined
    integer :: i

    text = ''
    if (.not. self%rated > 0) return
    text = 'lambda ' // rounded_text(abs(speed) / self%rated, 2)
    do i = 1, size(self%rule%items)
      associate (item => self%rule%items(i))
        if (item%kind /= is_range .or. item%symbol /= lambda) cycle
        call item%formula%evaluate(self%values, bound, is_defined)
        if (is_inside(item, abs(speed) / self%rated, bound)) cycle
        text = text // ', outside of the range of the rule'
        return
      end associate
    end do
  end subroutine write_place

  !> "0.8", the speed ratio from which no range of speeds may be barred; '' without one.
  pure subroutine write_unbarred(self, text)
    class(limit_rule_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text
    real(wp) :: share
    logical :: is_defined

    text = ''
    if (.not. self%rule%unbarred%is_given()) return
    call self%rule%unbarred%evaluate(self%values, share, is_defined)
    if (is_defined) text = rounded_text(share, digits)
  end subroutine write_unbarred

end module nocdyn_limit_rules
