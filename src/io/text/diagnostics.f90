!> The errors in an input, collected so that all are reported together.
module nocdyn_diagnostics
  use nocdyn_errors, only: exit_input
  use nocdyn_text, only: string_t
  use nocdyn_text_sort, only: argsort
  implicit none (type, external)
  private

  integer, parameter, public :: most_shown = 50   !! errors of a file that are shown; the others are counted
  integer, parameter, public :: no_line = huge(1)   !! of an error in the file as a whole; sorted last

  !> One error. File, line and group are put before its text when the names of all groups are known.
  type, public :: diagnostic_t
    integer :: line = no_line
    integer :: group = 0           !! index in the file, 0: outside groups
    integer :: override = 0        !! index of the wrong override, 0: the file is wrong
    integer :: code = exit_input   !! exit code of the program
    character(len=:), allocatable :: text   !! what is wrong, and what is allowed
    character(len=:), allocatable :: hint   !! "; did you mean 'motor'?", perhaps ''
  end type diagnostic_t

  type, public :: diagnostics_t
    integer :: count = 0
    type(diagnostic_t), allocatable :: list(:)   !! the first `count` are in use
  contains
    procedure :: add, sort_by_line, worst_code
  end type diagnostics_t

contains

  !> Adds one error; the arguments are the components of `diagnostic_t`.
  subroutine add(self, line, group, text, override, code, hint)
    class(diagnostics_t), intent(inout) :: self
    integer, intent(in) :: line, group             !! line of the file or `no_line`, index of the group or 0
    character(len=*), intent(in) :: text
    integer, optional, intent(in) :: override, code   !! if absent, 0 and `exit_input`
    character(len=*), optional, intent(in) :: hint    !! '' if absent
    type(diagnostic_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(self%list)) allocate (self%list(16))
    if (present(override)) then
      do i = 1, merge(self%count, 0, override > 0)   ! one for all groups that it sets
        if (self%list(i)%override == override .and. self%list(i)%text == text) return
      end do
    end if
    if (self%count == size(self%list)) then
      allocate (longer(2 * self%count))
      longer(:self%count) = self%list
      call move_alloc(longer, self%list)
    end if
    self%count = self%count + 1
    associate (diagnostic => self%list(self%count))
      diagnostic%line = line
      diagnostic%group = group
      if (present(override)) diagnostic%override = override
      if (present(code)) diagnostic%code = code
      diagnostic%text = text
      diagnostic%hint = ''
      if (present(hint)) diagnostic%hint = hint
    end associate
  end subroutine add

  !> Indices in the list, sorted by line; errors on one line stay in their order, the ones of overrides come last.
  subroutine sort_by_line(self, order)
    class(diagnostics_t), intent(in) :: self
    integer, allocatable, intent(out) :: order(:)   !! indices of `list`
    type(string_t), allocatable :: keys(:)
    character(len=24) :: key
    integer :: i

    allocate (keys(self%count))
    do i = 1, self%count
      write (key, '(i12.12, i12.12)') self%list(i)%override, self%list(i)%line
      keys(i)%text = key
    end do
    call argsort(keys, order)
  end subroutine sort_by_line

  !> The largest exit code of all errors.
  pure integer function worst_code(self)
    class(diagnostics_t), intent(in) :: self

    worst_code = exit_input
    if (self%count > 0) worst_code = maxval(self%list(:self%count)%code)
  end function worst_code

end module nocdyn_diagnostics
