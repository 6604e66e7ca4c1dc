!> Ranges of integers: their order and the gaps between them.
module nocdyn_number_ranges
  use nocdyn_text, only: string_t
  use nocdyn_text_sort, only: argsort
  implicit none (type, external)
  private

  public :: ascending_order, gaps

  !> From `first` to `last`, both included.
  type, public :: range_t
    integer :: first = 1, last = 0
  end type range_t

contains

  !> The permutation that sorts `ranges` by their first numbers.
  pure subroutine ascending_order(ranges, order)
    type(range_t), intent(in) :: ranges(:)   !! of numbers that are not negative
    integer, allocatable, intent(out) :: order(:)
    type(string_t), allocatable :: keys(:)
    character(len=10) :: digits
    integer :: i

    allocate (keys(size(ranges)))
    do i = 1, size(ranges)
      write (digits, '(i10.10)') ranges(i)%first
      keys(i)%text = digits
    end do
    call argsort(keys, order)
  end subroutine ascending_order

  !> The parts of `whole` that none of `ranges` covers, in ascending order.
  pure subroutine gaps(ranges, whole, open_ranges)
    type(range_t), intent(in) :: ranges(:)
    type(range_t), intent(in) :: whole
    type(range_t), allocatable, intent(out) :: open_ranges(:)
    integer, allocatable :: order(:)
    integer :: found, i, next

    call ascending_order(ranges, order)
    allocate (open_ranges(size(ranges) + 1))
    found = 0
    next = whole%first
    do i = 1, size(ranges)
      associate (range => ranges(order(i)))
        if (range%first > next) then
          found = found + 1
          open_ranges(found) = range_t(next, range%first - 1)
        end if
        next = max(next, range%last + 1)
      end associate
    end do
    if (next <= whole%last) then
      found = found + 1
      open_ranges(found) = range_t(next, whole%last)
    end if
    open_ranges = open_ranges(:found)
  end subroutine gaps

end module nocdyn_number_ranges
