!> Pseudo-random permutations of 0 .. n - 1 whose elements can be computed one by one.
!>
!> A Feistel network on pairs of digits (J. Black, P. Rogaway, Ciphers with arbitrary finite domains, CT-RSA 2002): a number
!> below s^2 >= n is left s + right, and a round replaces it by (right, left + f(right) modulo s), which is invertible for any f.
!> The network is repeated while the result is not below n; this is rare, as s^2 is hardly more than n.
module nocdyn_permutations
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_random_numbers, only: largest_word, random_words, stream_permutations, word_bits
  implicit none (type, external)
  private

  public :: random_permutation

  ! Four are enough for a random f (M. Luby, C. Rackoff, SIAM J. Comput. 17 (1988) 373-386); this f is not quite random.
  integer, parameter :: rounds = 8
  integer(int64), parameter :: multiplier = int(z'045D9F3B', int64)

  type, public :: permutation_t
    private
    integer :: length
    integer(int64) :: side          !! least whole number with side^2 >= length
    integer(int64) :: keys(rounds)
  contains
    procedure :: image
  end type permutation_t

contains

  !> The permutation of a seed and an item; permutations of other seeds or items are independent of it.
  pure function random_permutation(length, seed, item) result(permutation)
    integer, intent(in) :: length   !! at least 1
    integer, intent(in) :: seed     !! at least 0
    integer, intent(in) :: item     !! at least 0
    type(permutation_t) :: permutation
    integer :: i

    permutation%length = length
    permutation%side = int(sqrt(real(length)), int64)
    do while (permutation%side**2 > length)
      permutation%side = permutation%side - 1
    end do
    do while (permutation%side**2 < length)
      permutation%side = permutation%side + 1
    end do
    do i = 1, rounds / 4
      permutation%keys(4 * i - 3:4 * i) = random_words(seed, stream_permutations, item, i)
    end do
  end function random_permutation

  !> The image of a position under the permutation.
  pure integer function image(self, position)
    class(permutation_t), intent(in) :: self
    integer, intent(in) :: position   !! 0 to length - 1
    integer(int64) :: left, right, sum
    integer :: i

    image = position
    do
      left = image / self%side
      right = image - left * self%side
      do i = 1, rounds
        sum = left + shiftr(mixed(ieor(right, self%keys(i))) * self%side, word_bits)
        left = right
        right = sum - merge(self%side, 0_int64, sum >= self%side)
      end do
      image = int(left * self%side + right)
      if (image < self%length) return
    end do
  end function image

  !> A hash of a word: each bit depends on every bit of the word.
  pure integer(int64) function mixed(word)
    integer(int64), intent(in) :: word

    mixed = iand(ieor(word, shiftr(word, 16)) * multiplier, largest_word)
    mixed = iand(ieor(mixed, shiftr(mixed, 16)) * multiplier, largest_word)
    mixed = ieor(mixed, shiftr(mixed, 16))
  end function mixed

end module nocdyn_permutations
