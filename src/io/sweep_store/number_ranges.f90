!> Ranges of integers: their order and the gaps between them.
module nocdyn_number_ranges
  implicit none (type, external)
  private

  public :: ascending_order, gaps

  !> From `first` to `last`, both included.
  type, public :: range_t
    integer :: first = 1, last = 0
  end type range_t

contains

  !> The permutation that sorts `ranges` by their first numbers, by merge sort.
  pure subroutine ascending_order(ranges, order)
    type(range_t), intent(in) :: ranges(:)
    integer, allocatable, intent(out) :: order(:)
    integer, allocatable :: merged(:)
    integer :: first, last, middle, width

    allocate (order(size(ranges)), merged(size(ranges)))
    order = [(first, first=1, size(ranges))]
    width = 1
    do while (width < size(ranges))
      do first = 1, size(ranges), 2 * width
        middle = min(first + width - 1, size(ranges))
        last = min(first + 2 * width - 1, size(ranges))
        call merge_runs(ranges, order(first:middle), order(middle + 1:last), merged(first:last))
      end do
      order = merged
      width = 2 * width
    end do
  end subroutine ascending_order

  pure subroutine merge_runs(ranges, left, right, merged)
    type(range_t), intent(in) :: ranges(:)
    integer, intent(in) :: left(:), right(:)   !! sorted indices into `ranges`
    integer, intent(out) :: merged(:)
    integer :: i, l, r
    logical :: takes_left

    l = 1
    r = 1
    do i = 1, size(merged)
      takes_left = r > size(right)
      if (.not. takes_left .and. l <= size(left)) takes_left = ranges(left(l))%first <= ranges(right(r))%first
      if (takes_left) then
        merged(i) = left(l)
        l = l + 1
      else
        merged(i) = right(r)
        r = r + 1
      end if
    end do
  end subroutine merge_runs

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
