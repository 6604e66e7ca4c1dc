!> Where arrays lie in memory: vectors that cross from one line of the cache to the next take twice as long.
module nocdyn_alignment
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: numbers_to_multiple

  integer, parameter, public :: line = 8   !! numbers of a line of the cache, and of the longest vectors

contains

  !> Numbers before the first one of an array whose address is a multiple of the length of so many numbers.
  integer function numbers_to_multiple(array, of) result(numbers)
    real(wp), target, contiguous, intent(in) :: array(:)
    integer, intent(in) :: of   !! `line`, or the numbers of a vector
    integer(c_intptr_t) :: bytes, number

    number = storage_size(array) / 8
    bytes = transfer(c_loc(array), bytes)
    numbers = int(modulo(-bytes, of * number) / number)
  end function numbers_to_multiple

end module nocdyn_alignment
