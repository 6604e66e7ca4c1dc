!> The keys of one group as the file and the overrides give them: texts that are not converted yet.
module nocdyn_raw_group
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_namelist, only: assignment_t, namelist_t
  use nocdyn_namelist_values, only: longest_list
  use nocdyn_schema, only: first_key, key_rules, last_key
  use nocdyn_schema_rules, only: any_number, key_rule_t, required, unset
  use nocdyn_schema_text, only: allowed_text
  use nocdyn_schema_units, only: name_in_unit, takes_units
  use nocdyn_text, only: listed, shortened, string_t, to_text
  implicit none (type, external)
  private

  public :: has_bare_unit, new_raw_group, new_raw_key

  !> One value of a key.
  type, public :: raw_value_t
    character(len=:), allocatable :: text      !! without quotes; not allocated: no value is given
    character(len=:), allocatable :: written   !! as in the file
    logical :: is_quoted = .false.
    logical :: is_assigned = .false.           !! by an assignment, perhaps with a null value
    integer :: line = 0
    integer :: unit = 0                        !! of a number: index of `units`, 0: the one of the schema
  end type raw_value_t

  !> One key.
  type, public :: raw_key_t
    integer :: rule = 0                   !! its row of `key_rules`
    integer :: line = 0                   !! of its first assignment in the file
    integer :: override = 0               !! the last override that sets it, 0: none
    integer :: unit = 0                   !! in which it is written last: index of `units`, 0: the one of the schema
    integer :: length = 0                 !! number of values that a default has
    integer :: last = 0                   !! index of the last value that is assigned
    logical :: is_written = .false.       !! the key occurs in the file or in an override
    logical :: has_whole_list = .false.   !! an assignment has no subscript
    logical :: is_malformed = .false.     !! its values cannot be read, which is reported
    logical :: may_be_missing = .false.   !! it is perhaps part of a text that cannot be read, which is reported
    logical :: is_required = .false.
    logical :: is_excluded = .false.      !! it has neither a value nor a default in this group
    logical :: is_superseded = .false.    !! the file gives it; an override replaces it by another key
    type(raw_value_t), allocatable :: values(:)   !! longer than `last` until `trim_values`
  contains
    procedure :: name
    procedure :: assign, override_with, trim_values, fill_defaults, exclude
    procedure :: count_given, is_given, has_value
  end type raw_key_t

  !> All keys of one group. Positions count them in the order of the schema.
  type, public :: raw_group_t
    integer :: index = 0                    !! of the group in the input
    integer :: rule = 0                     !! its row of `group_rules`
    integer :: line = 0
    type(raw_key_t), allocatable :: keys(:)
  contains
    procedure :: position, first_given, written_names, report
  end type raw_group_t

contains

  !> A group without values.
  pure function new_raw_group(index, rule, line, is_malformed) result(group)
    integer, intent(in) :: index, rule, line   !! as in `raw_group_t`
    logical, intent(in) :: is_malformed   !! parts of the group cannot be read, which is reported
    type(raw_group_t) :: group
    integer :: i

    group%index = index
    group%rule = rule
    group%line = line
    allocate (group%keys(last_key(rule) - first_key(rule) + 1))
    do i = 1, size(group%keys)
      group%keys(i) = new_raw_key(first_key(rule) + i - 1)
      group%keys(i)%may_be_missing = is_malformed
    end do
  end function new_raw_group

  !> A key without values.
  pure function new_raw_key(rule) result(key)
    integer, intent(in) :: rule   !! its row of `key_rules`
    type(raw_key_t) :: key

    key%rule = rule
    key%length = key_rules(rule)%count
    key%is_required = key_rules(rule)%default == required
  end function new_raw_key

  !> Name of the key in the unit in which it is written.
  pure function name(self)
    class(raw_key_t), intent(in) :: self
    character(len=:), allocatable :: name

    name = name_in_unit(key_rules(self%rule), self%unit)
  end function name

  !> Takes over one assignment of the file.
  subroutine assign(self, namelist, assignment, unit, message)
    class(raw_key_t), intent(inout) :: self
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    integer, intent(in) :: unit                             !! of the numbers: index of `units`, 0: the one of the schema
    character(len=:), allocatable, intent(out) :: message   !! '': the assignment is valid
    integer :: last

    if (self%is_written .and. self%unit /= unit) then
      message = self%name() // ' on line ' // to_text(self%line) // ' and ' // name_in_unit(key_rules(self%rule), unit) // &
                ' on line ' // to_text(assignment%line) // ' are both given; allowed: one of them'
    else if (self%is_written .and. (self%has_whole_list .or. assignment%is_whole)) then
      message = duplicate_message(self)
    else
      self%unit = unit
      call find_last(namelist, assignment, self, last, message)
    end if
    if (.not. self%is_written) self%line = assignment%line
    self%is_written = .true.
    self%has_whole_list = self%has_whole_list .or. assignment%is_whole
    self%is_malformed = self%is_malformed .or. assignment%is_malformed .or. message /= ''
    if (self%is_malformed) return

    call grow(self, last)
    if (any(self%values(assignment%first:last:assignment%stride)%is_assigned)) then
      message = duplicate_message(self)
      self%is_malformed = .true.
    else
      call take_items(self, namelist, assignment, last)
    end if
  end subroutine assign

  !> Takes over an override, which replaces the values of the file and of earlier overrides.
  subroutine override_with(self, namelist, assignment, unit, override, message)
    class(raw_key_t), intent(inout) :: self
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    integer, intent(in) :: unit                             !! of the numbers: index of `units`, 0: the one of the schema
    integer, intent(in) :: override                         !! index of the override
    character(len=:), allocatable, intent(out) :: message   !! '': the override is valid
    integer :: last

    self%is_written = .true.
    self%override = override
    self%unit = unit
    if (assignment%is_whole) then
      self%values = [raw_value_t ::]
      self%last = 0
      self%is_malformed = .false.
    end if
    call find_last(namelist, assignment, self, last, message)
    self%is_malformed = self%is_malformed .or. assignment%is_malformed .or. message /= ''
    if (self%is_malformed) return
    call grow(self, last)
    call take_items(self, namelist, assignment, last)
  end subroutine override_with

  pure function duplicate_message(key) result(message)
    type(raw_key_t), intent(in) :: key
    character(len=:), allocatable :: message

    message = key%name() // ' is given twice, first on line ' // to_text(key%line)
  end function duplicate_message

  !> Index of the last value that an assignment can set.
  subroutine find_last(namelist, assignment, key, last, message)
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    type(raw_key_t), intent(in) :: key   !! with the unit of the assignment
    integer, intent(out) :: last   !! if the message is empty
    character(len=:), allocatable, intent(out) :: message   !! '': the assignment fits the key
    type(key_rule_t) :: rule
    integer :: items
    logical :: is_null

    rule = key_rules(key%rule)
    items = assignment%last_item - assignment%first_item + 1
    last = assignment%last
    if (last == 0) last = rule%count
    if (last == 0) last = int(min(assignment%first + (items - 1) * int(assignment%stride, int64), longest_list + 1_int64))

    message = ''
    is_null = all(namelist%items(assignment%first_item:assignment%last_item)%is_null)
    if (items > longest_list) then   ! the scanner has reported it
      return
    else if (.not. assignment%is_malformed .and. (items == 0 .or. (is_null .and. rule%default == unset))) then
      message = key%name() // ' has no value; needed: ' // allowed_text(rule, key%unit)
    else if (rule%count == 1 .and. .not. assignment%is_whole) then
      message = key%name() // ' is a single value and takes no subscript'
    else if (rule%count /= any_number .and. max(last, assignment%first) > rule%count) then
      message = 'the subscript of ' // key%name() // ' is out of range; allowed: 1 to ' // to_text(rule%count)
    else if (last > longest_list) then
      message = key%name() // ' has too many values; allowed: at most ' // to_text(longest_list)
    else if (items > (last - assignment%first) / assignment%stride + 1) then
      message = key%name() // ' has ' // to_text(items) // ' values (' // found_values(namelist, assignment) &
        // '); allowed: ' // to_text((last - assignment%first) / assignment%stride + 1)
    end if
  end subroutine find_last

  !> Whether a word without quotes follows the first value of a single number, as its unit.
  pure logical function has_bare_unit(key, namelist, assignment) result(has)
    type(raw_key_t), intent(in) :: key
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment

    has = takes_units(key_rules(key%rule), key%unit) .and. assignment%last_item > assignment%first_item
    if (.not. has) return
    associate (item => namelist%items(assignment%first_item + 1))
      has = .not. (item%is_quoted .or. item%is_null)
      if (has) has = verify(namelist%item_text(item), '0123456789+-.') == 1
    end associate
  end function has_bare_unit

  !> The first few values as they are written.
  pure function found_values(namelist, assignment) result(text)
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    character(len=:), allocatable :: text
    integer, parameter :: few = 5
    integer :: i

    text = ''
    do i = assignment%first_item, min(assignment%last_item, assignment%first_item + few - 1)
      if (i > assignment%first_item) text = text // ', '
      if (namelist%items(i)%is_null) text = text // 'nothing'
      if (.not. namelist%items(i)%is_null) text = text // shortened(namelist%as_written(namelist%items(i)))
    end do
    if (assignment%last_item - assignment%first_item >= few) text = text // ' ...'
  end function found_values

  !> Makes room for `length` values at least, in amortised constant time for each.
  subroutine grow(key, length)
    type(raw_key_t), intent(inout) :: key
    integer, intent(in) :: length

    key%last = max(key%last, length)
    if (.not. allocated(key%values)) allocate (key%values(max(0, length)))
    if (size(key%values) < length) call resize(key, max(length, 2 * size(key%values)))
  end subroutine grow

  !> Gives back the room that is not used.
  subroutine trim_values(self)
    class(raw_key_t), intent(inout) :: self

    if (.not. allocated(self%values)) return
    if (size(self%values) > self%last) call resize(self, self%last)
  end subroutine trim_values

  subroutine resize(key, length)
    class(raw_key_t), intent(inout) :: key
    integer, intent(in) :: length   !! at least `last`
    type(raw_value_t), allocatable :: values(:)
    integer :: i, kept

    allocate (values(length))
    kept = min(length, size(key%values))
    do i = 1, kept
      call move_alloc(key%values(i)%text, values(i)%text)
      call move_alloc(key%values(i)%written, values(i)%written)
    end do
    values(:kept)%is_quoted = key%values(:kept)%is_quoted
    values(:kept)%is_assigned = key%values(:kept)%is_assigned
    values(:kept)%line = key%values(:kept)%line
    values(:kept)%unit = key%values(:kept)%unit
    call move_alloc(values, key%values)
  end subroutine resize

  !> Takes over the values of an assignment.
  subroutine take_items(key, namelist, assignment, last)
    type(raw_key_t), intent(inout) :: key
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    integer, intent(in) :: last   !! index of the last value that the assignment can set
    integer :: i, item

    item = assignment%first_item
    do i = assignment%first, last, assignment%stride
      key%values(i)%is_assigned = .true.
      if (item > assignment%last_item) cycle
      if (.not. namelist%items(item)%is_null) then
        key%values(i)%text = namelist%item_text(namelist%items(item))
        key%values(i)%written = namelist%as_written(namelist%items(item))
        key%values(i)%is_quoted = namelist%items(item)%is_quoted
        key%values(i)%line = namelist%items(item)%line
        key%values(i)%unit = key%unit
      end if
      item = item + 1
    end do
  end subroutine take_items

  !> Gives the default, if there is one, to every value that is not given.
  subroutine fill_defaults(self)
    class(raw_key_t), intent(inout) :: self
    character(len=len(key_rules%default)) :: default
    integer :: i

    call grow(self, self%length)
    call self%trim_values()
    default = key_rules(self%rule)%default
    if (default == required .or. default == unset) return
    do i = 1, size(self%values)
      if (allocated(self%values(i)%text)) cycle
      self%values(i)%written = trim(default)
      self%values(i)%is_quoted = default(1:1) == "'"
      self%values(i)%text = self%values(i)%written
      if (self%values(i)%is_quoted) self%values(i)%text = default(2:len_trim(default) - 1)
    end do
  end subroutine fill_defaults

  !> Number of the values that are given.
  pure integer function count_given(self)
    class(raw_key_t), intent(in) :: self
    integer :: i

    count_given = 0
    if (.not. allocated(self%values)) return
    do i = 1, size(self%values)
      if (allocated(self%values(i)%text)) count_given = count_given + 1
    end do
  end function count_given

  !> Whether the user gives a value, perhaps one that cannot be read.
  pure logical function is_given(self)
    class(raw_key_t), intent(in) :: self

    is_given = self%is_malformed .or. self%count_given() > 0
  end function is_given

  !> Whether the key has a value, given or by default.
  pure logical function has_value(self)
    class(raw_key_t), intent(in) :: self

    has_value = self%is_given()
    if (.not. has_value) has_value = .not. self%is_excluded .and. key_rules(self%rule)%default /= unset
  end function has_value

  !> Removes the values of the key and its default.
  pure subroutine exclude(self)
    class(raw_key_t), intent(inout) :: self

    self%is_written = .false.
    self%has_whole_list = .false.
    self%is_malformed = .false.
    self%line = 0
    self%override = 0
    self%unit = 0
    self%last = 0
    if (allocated(self%values)) deallocate (self%values)
    self%is_excluded = .true.
  end subroutine exclude

  !> Position of the key with this row of `key_rules`.
  pure integer function position(self, rule)
    class(raw_group_t), intent(in) :: self
    integer, intent(in) :: rule   !! row of `key_rules`

    position = rule - first_key(self%rule) + 1
  end function position

  !> The first of these positions whose key is given, 0 if none is; keys of overrides come before the ones of the file.
  pure integer function first_given(self, positions) result(given)
    class(raw_group_t), intent(in) :: self
    integer, intent(in) :: positions(:)   !! of the keys
    integer :: i

    given = 0
    do i = size(positions), 1, -1
      if (.not. self%keys(positions(i))%is_given()) cycle
      if (given > 0) then
        if (self%keys(given)%override > 0 .and. self%keys(positions(i))%override == 0) cycle
      end if
      given = positions(i)
    end do
  end function first_given

  !> Names of keys as they are written: "table_twist_deg and gap".
  pure function written_names(self, positions, conjunction) result(text)
    class(raw_group_t), intent(in) :: self
    integer, intent(in) :: positions(:)           !! of the keys
    character(len=*), intent(in) :: conjunction   !! ' or ', ' and '
    character(len=:), allocatable :: text
    type(string_t) :: names(size(positions))
    integer :: i

    do i = 1, size(positions)
      names(i)%text = self%keys(positions(i))%name()
    end do
    text = listed(names, conjunction)
  end function written_names

  !> Adds an error at the last of some keys, or at the group if there are none.
  subroutine report(self, positions, text, diagnostics)
    class(raw_group_t), intent(in) :: self
    integer, intent(in) :: positions(:)   !! of the keys
    character(len=*), intent(in) :: text
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: line

    line = maxval([0, self%keys(positions)%line])
    if (line == 0) line = self%line
    call diagnostics%add(line, self%index, text, maxval([0, self%keys(positions)%override]))
  end subroutine report

end module nocdyn_raw_group
