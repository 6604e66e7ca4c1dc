!> Short texts that tell whether two long ones are the same.
module nocdyn_fingerprints
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: fingerprint

  integer(int64), parameter :: word = 4294967295_int64   ! 32 bits
  integer(int64), parameter :: low_prime = 435           ! the prime is 2^40 + 435
  integer(int64), parameter :: offset_high = int(z'CBF29CE4', int64), offset_low = int(z'84222325', int64)

contains

  !> The 64-bit FNV-1a hash of the bytes (Fowler, Noll, Vo), 16 hexadecimal digits; in halves of 32 bits, which never overflow.
  pure function fingerprint(text) result(digits)
    character(len=*), intent(in) :: text
    character(len=16) :: digits
    integer(int64) :: high, low, product
    integer :: i

    high = offset_high
    low = offset_low
    do i = 1, len(text)
      low = ieor(low, int(iachar(text(i:i)), int64))
      product = low * low_prime
      high = iand(high * low_prime + shiftr(product, 32) + shiftl(low, 8), word)
      low = iand(product, word)
    end do
    write (digits, '(z8.8, z8.8)') high, low
  end function fingerprint

end module nocdyn_fingerprints
