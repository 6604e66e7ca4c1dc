!> Near matches of misspelt names.
module nocdyn_near_words
  use nocdyn_text, only: lower_case, quoted, string_t
  implicit none (type, external)
  private

  public :: near_match, nearest_word

  integer, parameter :: longest_word = 256   ! that is compared with others

contains

  !> Index of the candidate nearest to a misspelt `word`, 0 if none is near.
  pure function nearest_word(word, candidates) result(nearest)
    character(len=*), intent(in) :: word
    type(string_t), intent(in) :: candidates(:)
    integer :: nearest, i, distance, smallest

    nearest = 0
    if (len(word) > longest_word) return
    smallest = max(1, len(word) / 3) + 1
    do i = 1, size(candidates)
      if (abs(len(word) - len(candidates(i)%text)) >= smallest) cycle
      distance = edit_distance(lower_case(word), lower_case(candidates(i)%text))
      if (distance < min(smallest, max(len(word), len(candidates(i)%text)))) then   ! else they share nothing
        smallest = distance
        nearest = i
      end if
    end do
  end function nearest_word

  !> E.g. "; did you mean 'omega_motor'?", '' if no candidate is near.
  pure function near_match(word, candidates) result(text)
    character(len=*), intent(in) :: word
    type(string_t), intent(in) :: candidates(:)
    character(len=:), allocatable :: text
    integer :: nearest

    text = ''
    nearest = nearest_word(word, candidates)
    if (nearest > 0) text = '; did you mean ' // quoted(candidates(nearest)%text) // '?'
  end function near_match

  !> Optimal string alignment distance, which counts insertions, deletions, substitutions and swaps of neighbours.
  pure function edit_distance(a, b) result(distance)
    character(len=*), intent(in) :: a, b
    integer :: distance, d(0:len(a), 0:len(b)), h, i, j, k

    d(:, 0) = [(i, i=0, len(a))]
    d(0, :) = [(j, j=0, len(b))]
    do j = 1, len(b)
      do i = 1, len(a)
        d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, d(i - 1, j - 1) + merge(0, 1, a(i:i) == b(j:j)))
        if (min(i, j) < 2) cycle
        h = i - 1
        k = j - 1
        if (a(i:i) == b(k:k) .and. a(h:h) == b(j:j)) d(i, j) = min(d(i, j), d(h - 1, k - 1) + 1)
      end do
    end do
    distance = d(len(a), len(b))
  end function edit_distance

end module nocdyn_near_words
