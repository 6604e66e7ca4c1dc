!> The entries of a Jacobian's pattern in the rows of the states and in those of the quadratures, and checks of a pattern.
module nocdyn_pattern_entries
  use nocdyn_grouping, only: grouped, groups_t
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: pattern_error, state_entries, quadrature_entries

  !> Length of the messages. They are not allocatable: gfortran 12 keeps the length of an allocatable function result in static
  !> memory, which all threads share.
  integer, parameter, public :: message_length = 50

  !> Some entries of a pattern.
  type, public :: entries_t
    integer, allocatable :: position(:)   !! indices in the pattern
    integer, allocatable :: row(:)
    integer, allocatable :: column(:)
  end type entries_t

contains

  !> The rule of the contract that a pattern breaks; empty if it breaks none.
  pure function pattern_error(pattern, states, quadratures) result(pattern_message)
    type(pattern_t), intent(in) :: pattern
    integer, intent(in) :: states, quadratures
    character(len=message_length) :: pattern_message

    pattern_message = ''
    if (size(pattern%row) /= size(pattern%column)) then
      pattern_message = 'a pattern has as many rows as columns'
    else if (any(pattern%row < 1 .or. pattern%row > states + quadratures)) then
      pattern_message = 'the rows of a pattern are states or quadratures'
    else if (any(pattern%column < 1 .or. pattern%column > states)) then
      pattern_message = 'the columns of a pattern are states'
    else if (has_duplicates(pattern, states, states + quadratures)) then
      pattern_message = 'a pattern has each position at most once'
    end if
  end function pattern_error

  !> Whether a pattern has a position more than once.
  pure function has_duplicates(pattern, columns, rows)
    type(pattern_t), intent(in) :: pattern
    integer, intent(in) :: columns, rows
    logical :: has_duplicates
    type(groups_t) :: rows_of
    integer :: seen_in(rows)
    integer :: i, column

    rows_of = grouped(columns, pattern%column, pattern%row)
    has_duplicates = .false.
    seen_in = 0
    do column = 1, columns
      do i = rows_of%start(column), rows_of%start(column + 1) - 1
        has_duplicates = has_duplicates .or. seen_in(rows_of%member(i)) == column
        seen_in(rows_of%member(i)) = column
      end do
    end do
  end function has_duplicates

  !> Entries in the rows of the states.
  pure function state_entries(pattern, states) result(entries)
    type(pattern_t), intent(in) :: pattern
    integer, intent(in) :: states
    type(entries_t) :: entries

    entries = chosen_entries(pattern, pattern%row <= states)
  end function state_entries

  !> Entries in the rows of the quadratures.
  pure function quadrature_entries(pattern, states) result(entries)
    type(pattern_t), intent(in) :: pattern
    integer, intent(in) :: states
    type(entries_t) :: entries

    entries = chosen_entries(pattern, pattern%row > states)
  end function quadrature_entries

  !> The entries of a pattern that are chosen by a mask.
  pure function chosen_entries(pattern, is_chosen) result(entries)
    type(pattern_t), intent(in) :: pattern
    logical, intent(in) :: is_chosen(:)
    type(entries_t) :: entries
    integer :: p, filled

    filled = count(is_chosen)
    allocate (entries%position(filled), entries%row(filled), entries%column(filled))
    filled = 0
    do p = 1, size(is_chosen)
      if (.not. is_chosen(p)) cycle
      filled = filled + 1
      entries%position(filled) = p
      entries%row(filled) = pattern%row(p)
      entries%column(filled) = pattern%column(p)
    end do
  end function chosen_entries

end module nocdyn_pattern_entries
