!> Some entries of a Jacobian's pattern, such as those in the rows of the states, and checks of a pattern.
module nocdyn_pattern_entries
  use nocdyn_grouping, only: grouped, groups_t
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: pattern_error, entries_in_rows

  !> Length of the messages. They are not allocatable: gfortran 12 keeps the length of an allocatable function result in static
  !> memory, which all threads share.
  integer, parameter, public :: message_length = 50

  !> Some entries of a pattern.
  type, public :: entries_t
    integer, allocatable :: position(:)   !! indices in the pattern
    integer, allocatable :: row(:), column(:)
  end type entries_t

contains

  !> The rule of the contract that a pattern breaks; empty if it breaks none.
  pure function pattern_error(pattern, states, quadratures) result(pattern_message)
    type(pattern_t), intent(in) :: pattern
    integer, intent(in) :: states, quadratures
    character(len=message_length) :: pattern_message
    type(groups_t) :: rows_of
    integer :: seen_in(states + quadratures), i, column

    pattern_message = ''
    if (size(pattern%row) /= size(pattern%column)) then
      pattern_message = 'a pattern has as many rows as columns'
    else if (any(pattern%row < 1 .or. pattern%row > states + quadratures)) then
      pattern_message = 'the rows of a pattern are states or quadratures'
    else if (any(pattern%column < 1 .or. pattern%column > states)) then
      pattern_message = 'the columns of a pattern are states'
    end if
    if (pattern_message /= '') return
    rows_of = grouped(states, pattern%column, pattern%row)
    seen_in = 0
    do column = 1, states
      do i = rows_of%start(column), rows_of%start(column + 1) - 1
        if (seen_in(rows_of%member(i)) == column) pattern_message = 'a pattern has each position at most once'
        seen_in(rows_of%member(i)) = column
      end do
    end do
  end function pattern_error

  !> The entries of a pattern in the rows from `first` to `last`.
  pure function entries_in_rows(pattern, first, last) result(entries)
    type(pattern_t), intent(in) :: pattern
    integer, intent(in) :: first, last
    type(entries_t) :: entries
    logical :: is_chosen(size(pattern%row))
    integer :: p

    is_chosen = pattern%row >= first .and. pattern%row <= last
    entries = entries_t(pack([(p, p=1, size(is_chosen))], is_chosen), pack(pattern%row, is_chosen), &
                        pack(pattern%column, is_chosen))
  end function entries_in_rows

end module nocdyn_pattern_entries
