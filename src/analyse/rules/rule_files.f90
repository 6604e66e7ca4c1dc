!> Rules of class societies and standards as data: a line "key = value" for each thing that a rule says, # begins a comment.
!>
!> name, label, title, edition, source, url   texts
!> quantity = stress                          the quantity of the element that is limited
!> unit = N/mm2                               of the limits
!> symbol = d from diameter in mm             a number of &limit; without `from` one of `rule_symbols`; `default FORMULA`
!> choice = s default 800: shaft 800, ...     a number by the words of `choices`
!> value = c_D: 0.35 + 0.93 * d^(-0.2)        a number by a formula
!> range = sigma_B <= 800: hold               what happens outside: refuse, hold (the bound is taken), note
!> continuous, transient = FORMULA            limits of the half range
!> no_barred_range_from = 0.8                 speed ratio from which a range of speeds may not be barred
!> barred_from, barred_to = FORMULA           speeds to be barred about a critical speed n_c [rpm]
!> margin = 0.1                               separation margin of critical speeds, as a share of the speed
!>
!> Formulas use the symbols of the lines above them and lambda = speed / rated speed; `transient` uses continuous too,
!> `barred_...` n_c, and `margin` order.
module nocdyn_rule_files
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_ok, read_real
  use nocdyn_rule_expressions, only: formula_t, name_length, parse_expression
  use nocdyn_text, only: quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: read_rule

  integer, parameter, public :: lambda = 1, n_c = 2, order = 3, continuous = 4   !! symbols that every rule has
  character(len=*), parameter :: own_names(*) = [character(len=name_length) :: 'lambda', 'n_c', 'order', 'continuous']

  integer, parameter, public :: is_symbol = 1, is_choice = 2, is_value = 3, is_range = 4   !! kinds of items
  integer, parameter, public :: refuse = 1, hold = 2, note = 3                             !! outside of a range
  character(len=*), parameter :: actions(*) = [character(len=6) :: 'refuse', 'hold', 'note']

  !> A number of a rule or a range of one, in the order of the file.
  type, public :: rule_item_t
    integer :: kind = 0                      !! is_...
    integer :: line = 0
    integer :: symbol = 0                    !! that it gives or bounds
    character(len=name_length) :: key = ''   !! of &limit, '': one of `rule_symbols`
    real(wp) :: factor = 1.0_wp              !! SI unit in one of its unit
    character(len=8) :: unit = ''
    type(formula_t) :: formula            !! of the value, the default or the bound
    type(string_t), allocatable :: words(:)  !! of a choice
    real(wp), allocatable :: numbers(:)      !! of its words
    logical :: is_upper = .false.            !! whether the bound is the largest value
    integer :: action = 0
  end type rule_item_t

  type, public :: rule_t
    character(len=:), allocatable :: file      !! where it stands, as shown
    character(len=:), allocatable :: name, label, title, edition, source, url
    character(len=:), allocatable :: quantity, unit
    real(wp) :: factor = 1.0_wp                !! SI unit in one of `unit`
    character(len=name_length), allocatable :: names(:)   !! of the symbols
    type(rule_item_t), allocatable :: items(:)
    type(formula_t) :: continuous, transient, unbarred, barred_from, barred_to, margin
  end type rule_t

  type :: rule_unit_t
    character(len=8) :: name
    real(wp) :: factor
  end type rule_unit_t

  type(rule_unit_t), parameter :: units(*) = [ &
    rule_unit_t('1', 1.0_wp), rule_unit_t('Pa', 1.0_wp), rule_unit_t('MPa', 1.0e6_wp), rule_unit_t('N/mm2', 1.0e6_wp), &
    rule_unit_t('m', 1.0_wp), rule_unit_t('mm', 1.0e-3_wp), rule_unit_t('N', 1.0_wp), rule_unit_t('kN', 1.0e3_wp), &
    rule_unit_t('Nm', 1.0_wp), rule_unit_t('kNm', 1.0e3_wp), rule_unit_t('W', 1.0_wp), rule_unit_t('kW', 1.0e3_wp)]
  character(len=*), parameter :: keys_of_limit(*) = [character(len=16) :: 'tensile_strength', 'c_k', 'diameter']
  character(len=*), parameter :: keys(*) = [character(len=20) :: 'name', 'label', 'title', 'edition', 'source', 'url', &
    'quantity', 'unit', 'symbol', 'choice', 'value', 'range', 'continuous', 'transient', 'no_barred_range_from', &
    'barred_from', 'barred_to', 'margin']

contains

  !> Reads a rule from the lines of its file. The error has a line for each mistake.
  subroutine read_rule(file, lines, rule, error)
    character(len=*), intent(in) :: file      !! as shown in messages
    type(string_t), intent(in) :: lines(:)
    type(rule_t), intent(out) :: rule
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: problem, messages
    integer :: i

    rule%file = file
    rule%name = ''
    rule%label = ''
    rule%title = ''
    rule%edition = ''
    rule%source = ''
    rule%url = ''
    rule%quantity = 'stress'
    rule%unit = ''
    rule%names = own_names
    allocate (rule%items(0))
    messages = ''
    do i = 1, size(lines)
      call read_line(lines(i)%text, i, rule, problem)
      if (problem /= '') messages = messages // new_line('a') // file // ':' // to_text(i) // ': ' // problem
    end do
    if (messages == '') call check_rule(rule, messages)
    if (messages /= '') call raise(error, exit_input, messages(2:))
  end subroutine read_rule

  !> What a rule lacks as a whole.
  subroutine check_rule(rule, messages)
    type(rule_t), intent(inout) :: rule
    character(len=:), allocatable, intent(inout) :: messages

    if (rule%label == '') rule%label = rule%name
    if (rule%label == '') call miss('a line "label = ..." or "name = ..."')
    if (.not. (rule%continuous%is_given() .or. rule%margin%is_given())) then
      call miss('a line "continuous = FORMULA" or "margin = FORMULA"')
    end if
    if (rule%continuous%is_given() .and. rule%unit == '') call miss('a line "unit = ..."')
    if (rule%transient%is_given() .and. .not. rule%continuous%is_given()) call miss('a line "continuous = FORMULA"')
    if (rule%barred_from%is_given() .neqv. rule%barred_to%is_given()) call miss('both "barred_from = ..." and "barred_to = ..."')

  contains

    subroutine miss(what)
      character(len=*), intent(in) :: what

      messages = messages // new_line('a') // rule%file // ': the rule is not complete; required: ' // what
    end subroutine miss

  end subroutine check_rule

  subroutine read_line(line, number, rule, problem)
    character(len=*), intent(in) :: line
    integer, intent(in) :: number
    type(rule_t), intent(inout) :: rule
    character(len=:), allocatable, intent(out) :: problem
    character(len=:), allocatable :: key, text
    integer :: equals

    problem = ''
    call clean(line, text)
    if (text == '') return
    equals = index(text, '=')
    key = trim(text(:max(equals - 1, 0)))
    text = trim(adjustl(text(equals + 1:)))
    if (.not. any(keys == key)) then
      problem = quoted(key) // ' is no key of a rule; allowed: ' // list_of(keys)
      if (equals == 0) problem = 'there is no "="; required: KEY = VALUE with one of ' // list_of(keys)
    else if (text == '') then
      problem = key // ': there is no value'
    else
      call take_value(key, text, number, rule, problem)
    end if
  end subroutine read_line

  subroutine take_value(key, text, number, rule, problem)
    character(len=*), intent(in) :: key, text
    integer, intent(in) :: number   !! of the line
    type(rule_t), intent(inout) :: rule
    character(len=:), allocatable, intent(inout) :: problem
    type(rule_item_t) :: item

    item%line = number
    select case (key)
    case ('name')
      rule%name = text
    case ('label')
      rule%label = text
    case ('title')
      rule%title = text
    case ('edition')
      rule%edition = text
    case ('source')
      rule%source = text
    case ('url')
      rule%url = text
    case ('quantity')
      rule%quantity = text
    case ('unit')
      rule%unit = text
      call find_unit(text, rule%factor, problem)
    case ('symbol')
      item%kind = is_symbol
      call read_symbol(text, rule, item, problem)
    case ('choice')
      item%kind = is_choice
      call read_choice(text, rule, item, problem)
    case ('value')
      item%kind = is_value
      call read_named(text, rule, item, problem)
    case ('range')
      item%kind = is_range
      call read_range(text, rule, item, problem)
    case ('continuous')
      call read_formula(text, rule, [lambda], rule%continuous, problem)
    case ('transient')
      call read_formula(text, rule, [lambda, continuous], rule%transient, problem)
    case ('no_barred_range_from')
      call read_formula(text, rule, [integer ::], rule%unbarred, problem)
    case ('barred_from')
      call read_formula(text, rule, [lambda, n_c], rule%barred_from, problem)
    case ('barred_to')
      call read_formula(text, rule, [lambda, n_c], rule%barred_to, problem)
    case default   ! margin
      call read_formula(text, rule, [order], rule%margin, problem)
    end select
    if (problem /= '') then
      problem = key // ': ' // problem
    else if (item%kind > 0) then
      call add_item(item, rule)
    end if
  end subroutine take_value

  !> "NAME from KEY in UNIT default FORMULA"
  subroutine read_symbol(text, rule, item, problem)
    character(len=*), intent(in) :: text
    type(rule_t), intent(inout) :: rule
    type(rule_item_t), intent(inout) :: item
    character(len=:), allocatable, intent(inout) :: problem
    character(len=:), allocatable :: rest, value, word

    rest = text
    call take_word(rest, word)
    call add_name(word, rule, item%symbol, problem)
    do while (problem == '' .and. rest /= '')
      call take_word(rest, word)
      if (word == 'default') then
        call read_formula(rest, rule, [integer ::], item%formula, problem)
        exit
      end if
      call take_word(rest, value)
      if (word == 'from' .and. any(keys_of_limit == value)) then
        item%key = value
      else if (word == 'from') then
        problem = quoted(value) // ' is no key of &limit that a rule can use; allowed: ' // list_of(keys_of_limit)
      else if (word == 'in') then
        call find_unit(value, item%factor, problem)
        item%unit = value
      else
        problem = quoted(word) // ' is not expected; allowed: NAME from KEY in UNIT default FORMULA'
      end if
    end do
  end subroutine read_symbol

  !> "NAME default FORMULA: WORD NUMBER, WORD NUMBER"
  subroutine read_choice(text, rule, item, problem)
    character(len=*), intent(in) :: text
    type(rule_t), intent(inout) :: rule
    type(rule_item_t), intent(inout) :: item
    character(len=:), allocatable, intent(inout) :: problem
    character(len=:), allocatable :: list, rest, word
    integer :: comma, status
    real(wp) :: value

    call split(text, ':', rest, list)
    call take_word(rest, word)
    call add_name(word, rule, item%symbol, problem)
    if (problem == '' .and. rest /= '') then
      call take_word(rest, word)
      if (word /= 'default') problem = quoted(word) // ' is not expected; allowed: NAME default FORMULA: WORD NUMBER, ...'
      if (problem == '') call read_formula(rest, rule, [integer ::], item%formula, problem)
    end if
    allocate (item%words(0), item%numbers(0))
    do while (problem == '' .and. list /= '')
      comma = index(list // ',', ',')
      rest = adjustl(list(:comma - 1))
      list = list(min(comma + 1, len(list) + 1):)
      call take_word(rest, word)
      call read_real(rest, value, status)
      if (status /= literal_ok .or. word == '') then
        problem = 'a word and its number are required between commas: WORD NUMBER, WORD NUMBER'
      else
        item%words = [item%words, string_t(word)]
        item%numbers = [item%numbers, value]
      end if
    end do
    if (problem == '' .and. size(item%words) == 0) problem = 'there are no words; required: NAME: WORD NUMBER, WORD NUMBER'
  end subroutine read_choice

  !> "NAME: FORMULA"
  subroutine read_named(text, rule, item, problem)
    character(len=*), intent(in) :: text
    type(rule_t), intent(inout) :: rule
    type(rule_item_t), intent(inout) :: item
    character(len=:), allocatable, intent(inout) :: problem
    character(len=:), allocatable :: formula, name

    call split(text, ':', name, formula)
    if (formula == '') problem = 'there is no formula; required: NAME: FORMULA'
    if (problem == '') call read_formula(formula, rule, [lambda], item%formula, problem)
    if (problem == '') call add_name(name, rule, item%symbol, problem)
  end subroutine read_named

  !> "NAME <= FORMULA: ACTION"
  subroutine read_range(text, rule, item, problem)
    character(len=*), intent(in) :: text
    type(rule_t), intent(inout) :: rule
    type(rule_item_t), intent(inout) :: item
    character(len=:), allocatable, intent(inout) :: problem
    character(len=:), allocatable :: action, rest, word

    call split(text, ':', rest, action)
    call take_word(rest, word)
    item%symbol = max(findloc(rule%names, word, dim=1), 0)
    if (item%symbol == 0 .or. any(item%symbol == [n_c, order, continuous])) then
      problem = 'there is no symbol ' // quoted(word) // ' above; required: SYMBOL <= FORMULA: ACTION'
      return
    end if
    item%is_upper = index(rest, '<=') == 1
    if (.not. (item%is_upper .or. index(rest, '>=') == 1)) then
      problem = 'after ' // word // ' <= or >= is required: SYMBOL <= FORMULA: ACTION'
      return
    end if
    item%action = findloc(actions, action, dim=1)
    if (item%action == 0) problem = quoted(action) // ' is no action outside of a range; allowed: ' // list_of(actions)
    if (item%symbol == lambda .and. item%action == refuse) then
      problem = 'a speed cannot be refused; allowed for lambda: hold, note'
    end if
    if (problem == '') call read_formula(rest(3:), rule, [integer ::], item%formula, problem)
  end subroutine read_range

  !> Reads a formula that may use some of the symbols of every rule, and all others.
  subroutine read_formula(text, rule, allowed, formula, problem)
    character(len=*), intent(in) :: text
    type(rule_t), intent(in) :: rule
    integer, intent(in) :: allowed(:)   !! of `lambda` ... `continuous`
    type(formula_t), intent(out) :: formula
    character(len=:), allocatable, intent(inout) :: problem
    character(len=name_length) :: names(size(rule%names))
    integer :: i

    names = rule%names
    do i = 1, size(own_names)
      if (all(allowed /= i)) names(i) = ''
    end do
    call parse_expression(text, names, formula, problem)
  end subroutine read_formula

  !> Adds the name of a symbol.
  subroutine add_name(name, rule, symbol, problem)
    character(len=*), intent(in) :: name
    type(rule_t), intent(inout) :: rule
    integer, intent(out) :: symbol
    character(len=:), allocatable, intent(inout) :: problem
    character(len=name_length) :: padded
    character(len=*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_'

    symbol = 0
    if (name == '' .or. verify(trim(name), letters // '0123456789') > 0 .or. verify(name(:min(1, len(name))), letters) > 0 .or. &
        len(name) > name_length) then
      problem = quoted(name) // ' is no name of a symbol; allowed: up to ' // to_text(name_length) // &
                ' letters, digits and _, first a letter'
    else if (any(rule%names == name) .or. any(name == [character(len=4) :: 'min', 'max', 'sqrt', 'abs', 'if'])) then
      problem = 'the symbol ' // quoted(name) // ' is there already'
    else
      padded = name
      rule%names = [rule%names, padded]
      symbol = size(rule%names)
    end if
  end subroutine add_name

  subroutine add_item(item, rule)
    type(rule_item_t), intent(in) :: item
    type(rule_t), intent(inout) :: rule
    type(rule_item_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(size(rule%items) + 1))
    do i = 1, size(rule%items)
      longer(i) = rule%items(i)
    end do
    longer(size(longer)) = item
    call move_alloc(longer, rule%items)
  end subroutine add_item

  subroutine find_unit(name, factor, problem)
    character(len=*), intent(in) :: name
    real(wp), intent(inout) :: factor
    character(len=:), allocatable, intent(inout) :: problem
    integer :: i

    i = findloc(units%name, name, dim=1)
    if (i > 0) factor = units(i)%factor
    if (i == 0) problem = quoted(name) // ' is no unit of a rule; allowed: ' // list_of(units%name)
  end subroutine find_unit

  !> A line without its comment, tabs, and blanks at its ends.
  pure subroutine clean(line, text)
    character(len=*), intent(in) :: line
    character(len=:), allocatable, intent(out) :: text
    integer :: i

    text = line(:index(line // '#', '#') - 1)
    do i = 1, len(text)
      if (iachar(text(i:i)) < 32) text(i:i) = ' '
    end do
    text = trim(adjustl(text))
  end subroutine clean

  !> Splits a text at a character; the second part is '' without it.
  pure subroutine split(text, separator, first, second)
    character(len=*), intent(in) :: text
    character(len=1), intent(in) :: separator
    character(len=:), allocatable, intent(out) :: first, second
    integer :: place

    place = index(text // separator, separator)
    first = trim(adjustl(text(:place - 1)))
    second = trim(adjustl(text(min(place + 1, len(text) + 1):)))
  end subroutine split

  !> Takes the first word of a text.
  pure subroutine take_word(text, word)
    character(len=:), allocatable, intent(inout) :: text
    character(len=:), allocatable, intent(out) :: word
    integer :: blank

    blank = index(text // ' ', ' ')
    word = text(:blank - 1)
    text = trim(adjustl(text(min(blank + 1, len(text) + 1):)))
  end subroutine take_word

  pure function list_of(words) result(list)
    character(len=*), intent(in) :: words(:)
    character(len=:), allocatable :: list
    integer :: i

    list = trim(words(1))
    do i = 2, size(words)
      list = list // ', ' // trim(words(i))
    end do
  end function list_of

end module nocdyn_rule_files
