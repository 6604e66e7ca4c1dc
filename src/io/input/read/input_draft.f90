!> What a file and its overrides say about one key, before it is known whether that makes sense.
module nocdyn_input_draft
  use nocdyn_namelist, only: assignment_t, namelist_t
  use nocdyn_schema_rules, only: any_number, key_rule_t, required, unset
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  !> One value of a key; `text` is not allocated where nothing is said.
  type, public :: slot_t
    character(len=:), allocatable :: text      !! without quotes
    character(len=:), allocatable :: written   !! as in the file
    logical :: is_quoted = .false.
    logical :: is_assigned = .false.           !! perhaps with a null value
    integer :: line = 0
  end type slot_t

  type, public :: draft_t
    logical :: is_written = .false.   !! the key occurs
    logical :: is_whole = .false.     !! without a subscript
    logical :: is_damaged = .false.   !! its values could not be understood, which was reported
    integer :: line = 0
    integer :: override = 0           !! which override came last, 0: none
    type(slot_t), allocatable :: slots(:)
  contains
    procedure :: assign
    procedure :: replace
    procedure :: fill_default
    procedure :: values_said
    procedure :: is_said
  end type draft_t

contains

  !> Takes over one assignment of the file.
  subroutine assign(self, namelist, assignment, rule, message)
    class(draft_t), intent(inout) :: self
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    type(key_rule_t), intent(in) :: rule
    character(len=:), allocatable, intent(out) :: message   !! '' if all is well
    integer :: last

    if (self%is_written .and. (self%is_whole .or. assignment%is_whole)) then
      message = doubled(self, trim(rule%name))
    else
      call find_last(namelist, assignment, rule, last, message)
    end if
    if (.not. self%is_written) self%line = assignment%line
    self%is_written = .true.
    self%is_whole = self%is_whole .or. assignment%is_whole
    self%is_damaged = self%is_damaged .or. assignment%is_damaged .or. message /= ''
    if (self%is_damaged) return

    call widen(self, last)
    if (any(self%slots(assignment%first:last:assignment%stride)%is_assigned)) then
      message = doubled(self, trim(rule%name))
      self%is_damaged = .true.
    else
      call fill(self, namelist, assignment, last)
    end if
  end subroutine assign

  !> Takes over an override, which wins over the file and over earlier overrides.
  subroutine replace(self, namelist, assignment, rule, override, message)
    class(draft_t), intent(inout) :: self
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: override
    character(len=:), allocatable, intent(out) :: message   !! '' if all is well
    integer :: last

    self%is_written = .true.
    self%override = override
    if (assignment%is_whole) then
      self%slots = [slot_t ::]
      self%is_damaged = .false.
    end if
    call find_last(namelist, assignment, rule, last, message)
    self%is_damaged = self%is_damaged .or. assignment%is_damaged .or. message /= ''
    if (self%is_damaged) return
    call widen(self, last)
    call fill(self, namelist, assignment, last)
  end subroutine replace

  pure function doubled(draft, key) result(text)
    type(draft_t), intent(in) :: draft
    character(len=*), intent(in) :: key
    character(len=:), allocatable :: text

    text = key // ' is given twice, first on line ' // to_text(draft%line)
  end function doubled

  !> Index of the last value that an assignment can reach.
  subroutine find_last(namelist, assignment, rule, last, message)
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    type(key_rule_t), intent(in) :: rule
    integer, intent(out) :: last
    character(len=:), allocatable, intent(out) :: message
    integer :: items

    items = assignment%last_item - assignment%first_item + 1
    last = assignment%last
    if (last == 0) last = rule%count
    if (last == 0) last = assignment%first + (items - 1) * assignment%stride

    message = ''
    if (rule%count == 1 .and. .not. assignment%is_whole) then
      message = trim(rule%name) // ' is a single value and takes no subscript'
    else if (rule%count /= any_number .and. max(last, assignment%first) > rule%count) then
      message = 'the subscript of ' // trim(rule%name) // ' is out of range; allowed: 1 to ' // to_text(rule%count)
    else if (items > (last - assignment%first) / assignment%stride + 1) then
      message = trim(rule%name) // ' has ' // to_text(items) // ' values (' // found_values(namelist, assignment) &
        // '); allowed: ' // to_text((last - assignment%first) / assignment%stride + 1)
    end if
  end subroutine find_last

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
      if (.not. namelist%items(i)%is_null) text = text // namelist%as_written(namelist%items(i))
    end do
    if (assignment%last_item - assignment%first_item >= few) text = text // ' ...'
  end function found_values

  subroutine widen(draft, last)
    type(draft_t), intent(inout) :: draft
    integer, intent(in) :: last
    type(slot_t), allocatable :: wider(:)

    if (.not. allocated(draft%slots)) allocate (draft%slots(max(0, last)))
    if (size(draft%slots) >= last) return
    allocate (wider(last))
    wider(:size(draft%slots)) = draft%slots
    call move_alloc(wider, draft%slots)
  end subroutine widen

  subroutine fill(draft, namelist, assignment, last)
    type(draft_t), intent(inout) :: draft
    type(namelist_t), intent(in) :: namelist
    type(assignment_t), intent(in) :: assignment
    integer, intent(in) :: last
    integer :: i, item

    item = assignment%first_item
    do i = assignment%first, last, assignment%stride
      draft%slots(i)%is_assigned = .true.
      if (item > assignment%last_item) cycle
      if (.not. namelist%items(item)%is_null) then
        draft%slots(i)%text = namelist%item_text(namelist%items(item))
        draft%slots(i)%written = namelist%as_written(namelist%items(item))
        draft%slots(i)%is_quoted = namelist%items(item)%is_quoted
        draft%slots(i)%line = namelist%items(item)%line
      end if
      item = item + 1
    end do
  end subroutine fill

  !> Each value of which nothing is said becomes the default, if there is one.
  subroutine fill_default(self, rule, length)
    class(draft_t), intent(inout) :: self
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: length   !! how many values the key has at least
    integer :: i

    call widen(self, length)
    if (rule%default == required .or. rule%default == unset) return
    do i = 1, size(self%slots)
      if (allocated(self%slots(i)%text)) cycle
      self%slots(i)%written = trim(rule%default)
      self%slots(i)%is_quoted = rule%default(1:1) == "'"
      self%slots(i)%text = self%slots(i)%written
      if (self%slots(i)%is_quoted) self%slots(i)%text = rule%default(2:len_trim(rule%default) - 1)
    end do
  end subroutine fill_default

  !> How many values are known.
  pure integer function values_said(self)
    class(draft_t), intent(in) :: self
    integer :: i

    values_said = 0
    if (.not. allocated(self%slots)) return
    do i = 1, size(self%slots)
      if (allocated(self%slots(i)%text)) values_said = values_said + 1
    end do
  end function values_said

  !> Whether a value is known, or was meant.
  pure logical function is_said(self)
    class(draft_t), intent(in) :: self

    is_said = self%is_damaged .or. self%values_said() > 0
  end function is_said

end module nocdyn_input_draft
