!> Sorting of texts and binary search in them.
module nocdyn_text_sort
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: argsort, sorted_position

contains

  !> Permutation that sorts `texts`, by a stable bottom-up merge sort.
  pure subroutine argsort(texts, order)
    type(string_t), intent(in) :: texts(:)
    integer, allocatable, intent(out) :: order(:)   !! `texts(order)` is sorted
    integer, allocatable :: merged(:)
    integer :: first, middle, last, width

    allocate (order(size(texts)), merged(size(texts)))
    order = [(first, first=1, size(texts))]
    width = 1
    do while (width < size(texts))
      do first = 1, size(texts), 2 * width
        middle = min(first + width - 1, size(texts))
        last = min(first + 2 * width - 1, size(texts))
        call merge_runs(texts, order(first:middle), order(middle + 1:last), merged(first:last))
      end do
      order = merged
      width = 2 * width
    end do
  end subroutine argsort

  !> Merges two sorted lists.
  pure subroutine merge_runs(texts, left, right, merged)
    type(string_t), intent(in) :: texts(:)
    integer, intent(in) :: left(:), right(:)   !! indices of `texts`, each list sorted
    integer, intent(out) :: merged(:)          !! both lists, sorted
    integer :: i, l, r
    logical :: takes_left

    l = 1
    r = 1
    do i = 1, size(merged)
      takes_left = r > size(right)
      if (.not. takes_left .and. l <= size(left)) takes_left = texts(left(l))%text <= texts(right(r))%text
      if (takes_left) then
        merged(i) = left(l)
        l = l + 1
      else
        merged(i) = right(r)
        r = r + 1
      end if
    end do
  end subroutine merge_runs

  !> Index of the first of `texts` that equals `text`, 0 if there is none.
  pure integer function sorted_position(text, texts, order) result(position)
    character(len=*), intent(in) :: text
    type(string_t), intent(in) :: texts(:)
    integer, intent(in) :: order(:)   !! of `argsort`
    integer :: low, high, middle

    low = 1
    high = size(order) + 1
    do while (low < high)
      middle = (low + high) / 2
      if (texts(order(middle))%text < text) then
        low = middle + 1
      else
        high = middle
      end if
    end do

    position = 0
    if (low > size(order)) return
    if (texts(order(low))%text == text .and. len(texts(order(low))%text) == len(text)) position = order(low)
  end function sorted_position

end module nocdyn_text_sort
