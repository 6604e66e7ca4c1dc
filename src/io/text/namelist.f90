!> The contents of a namelist file: groups, assignments and values as texts, with the line of each.
module nocdyn_namelist
  use nocdyn_text, only: lower_case
  implicit none (type, external)
  private

  !> One value: a bare word, a quoted text, or a null value between two commas.
  type, public :: item_t
    integer :: first = 1, last = 0   !! positions in the source, quotes included
    integer :: line = 0
    logical :: is_quoted = .false.
    logical :: is_null = .false.
  end type item_t

  !> `key(first:last:stride) = items`.
  type, public :: assignment_t
    character(len=:), allocatable :: key   !! in lower case
    integer :: line = 0
    integer :: first = 1
    integer :: last = 0               !! 0 if it is as far as the values go
    integer :: stride = 1
    logical :: is_whole = .true.      !! without a subscript
    logical :: is_malformed = .false.   !! subscript or values cannot be read
    integer :: first_item = 1, last_item = 0   !! indices of the values
  end type assignment_t

  type, public :: namelist_group_t
    character(len=:), allocatable :: name   !! in lower case
    integer :: line = 0
    integer :: first_assignment = 1, last_assignment = 0   !! indices
    logical :: is_malformed = .false.   !! a part cannot be read; keys that seem to be missing may be in it
  end type namelist_group_t

  !> The assignments and items of all groups are consecutive in flat lists.
  type, public :: namelist_t
    character(len=:), allocatable :: source
    integer :: group_count = 0, assignment_count = 0, item_count = 0
    type(namelist_group_t), allocatable :: groups(:)
    type(assignment_t), allocatable :: assignments(:)
    type(item_t), allocatable :: items(:)
  contains
    procedure :: append_group, append_assignment, append_item
    procedure :: item_text, as_written
  end type namelist_t

contains

  !> Appends a group without assignments.
  subroutine append_group(self, name, line)
    class(namelist_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer, intent(in) :: line   !! where it begins
    type(namelist_group_t), allocatable :: longer(:)

    if (.not. allocated(self%groups)) allocate (self%groups(64))
    if (self%group_count == size(self%groups)) then
      allocate (longer(2 * self%group_count))
      longer(:self%group_count) = self%groups
      call move_alloc(longer, self%groups)
    end if
    self%group_count = self%group_count + 1
    associate (group => self%groups(self%group_count))
      group%name = lower_case(name)
      group%line = line
      group%first_assignment = self%assignment_count + 1
      group%last_assignment = self%assignment_count
    end associate
  end subroutine append_group

  !> Appends an assignment to the last group.
  subroutine append_assignment(self, assignment)
    class(namelist_t), intent(inout) :: self
    type(assignment_t), intent(in) :: assignment
    type(assignment_t), allocatable :: longer(:)

    if (.not. allocated(self%assignments)) allocate (self%assignments(64))
    if (self%assignment_count == size(self%assignments)) then
      allocate (longer(2 * self%assignment_count))
      longer(:self%assignment_count) = self%assignments
      call move_alloc(longer, self%assignments)
    end if
    self%assignment_count = self%assignment_count + 1
    self%assignments(self%assignment_count) = assignment
    self%groups(self%group_count)%last_assignment = self%assignment_count
  end subroutine append_assignment

  !> Appends a value.
  subroutine append_item(self, item)
    class(namelist_t), intent(inout) :: self
    type(item_t), intent(in) :: item

    if (.not. allocated(self%items)) allocate (self%items(64))
    if (self%item_count == size(self%items)) self%items = [self%items, self%items]
    self%item_count = self%item_count + 1
    self%items(self%item_count) = item
  end subroutine append_item

  !> The text of a value: of a quoted one without its quotes, with doubled quotes inside reduced to one.
  pure function item_text(self, item) result(text)
    class(namelist_t), intent(in) :: self
    type(item_t), intent(in) :: item
    character(len=:), allocatable :: text
    character(len=1) :: quote
    integer :: i, length

    text = self%source(item%first:item%last)
    if (.not. item%is_quoted) return

    quote = text(1:1)
    length = 0
    i = 2
    do while (i < item%last - item%first + 1)
      length = length + 1
      text(length:length) = text(i:i)
      i = i + merge(2, 1, text(i:i) == quote)
    end do
    text = text(:length)
  end function item_text

  !> A value as written in the file, quotes included.
  pure function as_written(self, item) result(text)
    class(namelist_t), intent(in) :: self
    type(item_t), intent(in) :: item
    character(len=:), allocatable :: text

    text = self%source(item%first:item%last)
  end function as_written

end module nocdyn_namelist
