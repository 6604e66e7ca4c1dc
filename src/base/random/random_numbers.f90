!> Counter-based random numbers: each is a function of its seed, stream, item and index alone, so that the order of the calls does
!> not matter.
!>
!> Philox4x32-10 of J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, Parallel random numbers: as easy as 1, 2, 3, SC '11:
!> ten rounds of products and exclusive-ors make 128 random bits of a 128-bit counter and a 64-bit key. Words of 32 bits are
!> held in 64, so that no operation overflows.
module nocdyn_random_numbers
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: philox_4x32, random_words, random_number_at

  ! The uses of the numbers; the streams of one seed are independent.
  integer, parameter, public :: stream_values = 0         !! of variants
  integer, parameter, public :: stream_offsets = 1        !! inside strata
  integer, parameter, public :: stream_permutations = 2
  integer, parameter, public :: stream_shifts = 3         !! of Sobol points

  integer, parameter, public :: word_bits = 32
  integer(int64), parameter :: half_word = int(z'FFFF', int64)
  integer(int64), parameter, public :: largest_word = int(z'FFFFFFFF', int64)

  integer, parameter :: rounds = 10
  integer(int64), parameter :: multipliers(2) = [int(z'D2511F53', int64), int(z'CD9E8D57', int64)]
  integer(int64), parameter :: key_steps(2) = [int(z'9E3779B9', int64), int(z'BB67AE85', int64)]

contains

  !> A uniformly distributed number: an odd multiple of 2^-53 above 0 and below 1.
  pure real(wp) function random_number_at(seed, stream, item, index)
    integer, intent(in) :: seed     !! at least 0
    integer, intent(in) :: stream   !! one of `stream_...`
    integer, intent(in) :: item     !! at least 0
    integer, intent(in) :: index    !! at least 0
    integer(int64) :: words(4)

    words = random_words(seed, stream, item, index)
    random_number_at = (real(shiftl(words(1), 20) + shiftr(words(2), 12), wp) + 0.5_wp) * 2.0_wp**(-52)
  end function random_number_at

  !> Four words of 32 random bits.
  pure function random_words(seed, stream, item, index) result(words)
    integer, intent(in) :: seed, stream, item, index   !! as for `random_number_at`
    integer(int64) :: words(4)

    words = philox_4x32(int([index, item, stream, 0], int64), int([seed, 0], int64))
  end function random_words

  !> Philox4x32-10.
  pure function philox_4x32(counter, key) result(words)
    integer(int64), intent(in) :: counter(4), key(2)   !! words from 0 to 2^32 - 1
    integer(int64) :: words(4), high(2), low(2), round_key(2)
    integer :: i

    words = counter
    round_key = key
    do i = 1, rounds
      call multiply(multipliers(1), words(1), high(1), low(1))
      call multiply(multipliers(2), words(3), high(2), low(2))
      words = [ieor(ieor(high(2), words(2)), round_key(1)), low(2), ieor(ieor(high(1), words(4)), round_key(2)), low(1)]
      round_key = iand(round_key + key_steps, largest_word)
    end do
  end function philox_4x32

  !> The two words of the product of two words, by halves of the second: no product is beyond 2^48.
  elemental subroutine multiply(a, b, high, low)
    integer(int64), intent(in) :: a, b
    integer(int64), intent(out) :: high, low
    integer(int64) :: lower, upper

    lower = a * iand(b, half_word)
    upper = a * shiftr(b, 16) + shiftr(lower, 16)
    high = shiftr(upper, 16)
    low = ior(shiftl(iand(upper, half_word), 16), iand(lower, half_word))
  end subroutine multiply

end module nocdyn_random_numbers
