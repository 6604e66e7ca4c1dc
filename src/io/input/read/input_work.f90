!> The keys of one group on their way from texts to values.
module nocdyn_input_work
  use nocdyn_input_draft, only: draft_t
  use nocdyn_schema, only: first_key, key_rules, last_key
  use nocdyn_schema_rules, only: key_rule_t, required, unset
  implicit none (type, external)
  private

  public :: new_work

  !> The drafts of one group. Positions count its keys in the order of the schema.
  type, public :: work_t
    integer :: index = 0                        !! of the group in the input
    integer :: rule = 0
    integer :: line = 0                         !! of the group
    integer :: first = 0                        !! row of its first key
    type(draft_t), allocatable :: drafts(:)
    logical, allocatable :: may_miss(:)         !! perhaps part of what was not understood, which was reported
    logical, allocatable :: is_out(:)           !! has no value here, nor a default
    logical, allocatable :: is_needed(:)        !! must be given
    logical, allocatable :: is_displaced(:)     !! was in the file; an override put something else in its place
    integer, allocatable :: length(:)           !! how many values a default has
  contains
    procedure :: key
    procedure :: first_said
    procedure :: has_value
    procedure :: is_overridden
    procedure :: rule_out
  end type work_t

contains

  !> A group of which no key has been read.
  pure function new_work(index, rule, line, is_damaged) result(work)
    integer, intent(in) :: index, rule, line
    logical, intent(in) :: is_damaged   !! the group has parts that were not understood
    type(work_t) :: work
    integer :: keys

    work%index = index
    work%rule = rule
    work%line = line
    work%first = first_key(rule)
    keys = last_key(rule) - work%first + 1
    allocate (work%drafts(keys))
    allocate (work%may_miss(keys), source=is_damaged)
    allocate (work%is_out(keys), work%is_displaced(keys), source=.false.)
    allocate (work%is_needed(keys), source=key_rules(work%first:work%first + keys - 1)%default == required)
    allocate (work%length(keys), source=key_rules(work%first:work%first + keys - 1)%count)
  end function new_work

  !> Row of the schema of a key.
  pure type(key_rule_t) function key(self, position)
    class(work_t), intent(in) :: self
    integer, intent(in) :: position

    key = key_rules(self%first + position - 1)
  end function key

  !> The first of these positions with a value from the file or an override, 0 if there is none; overrides come before the file.
  pure integer function first_said(self, positions) result(said)
    class(work_t), intent(in) :: self
    integer, intent(in) :: positions(:)
    integer :: i

    said = 0
    do i = size(positions), 1, -1
      if (.not. self%drafts(positions(i))%is_said()) cycle
      if (said > 0) then
        if (self%is_overridden(said) .and. .not. self%is_overridden(positions(i))) cycle
      end if
      said = positions(i)
    end do
  end function first_said

  !> Whether a key has a value, be it its default.
  pure logical function has_value(self, position)
    class(work_t), intent(in) :: self
    integer, intent(in) :: position

    has_value = self%drafts(position)%is_said()
    if (.not. has_value) has_value = .not. self%is_out(position) .and. key_rules(self%first + position - 1)%default /= unset
  end function has_value

  pure logical function is_overridden(self, position)
    class(work_t), intent(in) :: self
    integer, intent(in) :: position

    is_overridden = self%drafts(position)%override > 0
  end function is_overridden

  !> Forgets what is said about a key.
  pure subroutine rule_out(self, position)
    class(work_t), intent(inout) :: self
    integer, intent(in) :: position

    self%drafts(position) = draft_t()
    self%is_out(position) = .true.
  end subroutine rule_out

end module nocdyn_input_work
