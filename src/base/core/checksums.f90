!> CRC-32C (Castagnoli), the checksum of iSCSI, ext4 and LevelDB: it detects all errors within 32 neighbouring bits, and all but
!> one in 4e9 of the others. Eight tables process eight bytes at a time (Kounavis and Berry, ISCC 2005), about one cycle per byte.
module nocdyn_checksums
  use, intrinsic :: iso_fortran_env, only: int32
  implicit none (type, external)
  private

  public :: checksum_digits, make_checksum_table

  integer(int32), parameter :: polynomial = int(z'82F63B78', int32)   ! bits reflected
  integer, parameter :: slices = 8

  type, public :: checksum_table_t
    integer(int32), private :: entries(0:255, slices) = 0
  contains
    procedure :: checksum
  end type checksum_table_t

contains

  !> Computes the tables, in some microseconds.
  pure subroutine make_checksum_table(table)
    type(checksum_table_t), intent(out) :: table
    integer(int32) :: value
    integer :: bit, byte, slice

    do byte = 0, 255
      value = int(byte, int32)
      do bit = 1, 8
        value = ieor(shiftr(value, 1), merge(polynomial, 0_int32, btest(value, 0)))
      end do
      table%entries(byte, 1) = value
    end do
    do slice = 2, slices
      table%entries(:, slice) = ieor(shiftr(table%entries(:, slice - 1), 8), &
                                     table%entries(iand(table%entries(:, slice - 1), 255_int32), 1))
    end do
  end subroutine make_checksum_table

  !> CRC-32C of the bytes: 'E3069283' for '123456789' (RFC 3720, B.4, has more examples).
  pure integer(int32) function checksum(self, bytes)
    class(checksum_table_t), intent(in) :: self
    character(len=*), intent(in) :: bytes
    integer(int32) :: value
    integer :: i, last

    last = len(bytes) - modulo(len(bytes), slices)
    value = not(0_int32)
    do i = 1, last, slices
      value = ieor(value, int(ior(ior(code(bytes(i:i)), shiftl(code(bytes(i + 1:i + 1)), 8)), &
                                  ior(shiftl(code(bytes(i + 2:i + 2)), 16), shiftl(code(bytes(i + 3:i + 3)), 24))), int32))
      value = ieor(ieor(ieor(self%entries(iand(value, 255_int32), 8), self%entries(iand(shiftr(value, 8), 255_int32), 7)), &
                        ieor(self%entries(iand(shiftr(value, 16), 255_int32), 6), self%entries(shiftr(value, 24), 5))), &
                   ieor(ieor(self%entries(code(bytes(i + 4:i + 4)), 4), self%entries(code(bytes(i + 5:i + 5)), 3)), &
                        ieor(self%entries(code(bytes(i + 6:i + 6)), 2), self%entries(code(bytes(i + 7:i + 7)), 1))))
    end do
    do i = last + 1, len(bytes)
      value = ieor(shiftr(value, 8), self%entries(iand(ieor(value, code(bytes(i:i))), 255_int32), 1))
    end do
    checksum = not(value)
  end function checksum

  !> CRC-32C of one text as eight hexadecimal digits.
  pure function checksum_digits(text) result(digits)
    character(len=*), intent(in) :: text
    character(len=8) :: digits
    type(checksum_table_t) :: table

    call make_checksum_table(table)
    write (digits, '(z8.8)') table%checksum(text)
  end function checksum_digits

  !> The value of a byte, 0 to 255.
  elemental integer(int32) function code(byte)
    character(len=1), intent(in) :: byte

    code = ichar(byte, int32)
  end function code

end module nocdyn_checksums
