!> Packing of numbers and texts into bytes and unpacking, in the representation that they have in memory.
module nocdyn_bytes
  use, intrinsic :: iso_c_binding, only: c_char, c_ptr, c_size_t
  use, intrinsic :: iso_fortran_env, only: int32
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: put_integers, put_reals, put_text, widen

  integer, parameter, public :: integer_bytes = 4, real_bytes = 8

  !> Unpacks values in the order in which they were packed. Where too few bytes are left, it sets `is_short` and returns zeros or
  !> ''.
  type, public :: byte_reader_t
    integer :: next = 1            !! position of the next byte
    logical :: is_short = .false.
  contains
    procedure :: take_integers, take_reals, take_text
    procedure, private :: has
  end type byte_reader_t

  interface
    type(c_ptr) function c_copy_in(target, source, length) bind(c, name='memcpy')
      import :: c_char, c_ptr, c_size_t
      character(kind=c_char), intent(inout) :: target(*)
      type(*), intent(in) :: source(*)
      integer(c_size_t), value, intent(in) :: length
    end function c_copy_in

    type(c_ptr) function c_copy_out(target, source, length) bind(c, name='memcpy')
      import :: c_char, c_ptr, c_size_t
      type(*), intent(inout) :: target(*)
      character(kind=c_char), intent(in) :: source(*)
      integer(c_size_t), value, intent(in) :: length
    end function c_copy_out
  end interface

contains

  !> Packs integers, four bytes each.
  subroutine put_integers(bytes, used, values)
    character(len=:), allocatable, intent(inout) :: bytes   !! buffer, which is made longer if needed
    integer, intent(inout) :: used              !! number of bytes in use
    integer(int32), contiguous, intent(in) :: values(:)
    type(c_ptr) :: same

    call widen(bytes, used + integer_bytes * size(values))
    if (size(values) > 0) same = c_copy_in(bytes(used + 1:), values, int(integer_bytes * size(values), c_size_t))
    used = used + integer_bytes * size(values)
  end subroutine put_integers

  !> Packs reals, eight bytes each.
  subroutine put_reals(bytes, used, values)
    character(len=:), allocatable, intent(inout) :: bytes
    integer, intent(inout) :: used
    real(wp), contiguous, intent(in) :: values(:, :)   !! in array element order
    type(c_ptr) :: same

    call widen(bytes, used + real_bytes * size(values))
    if (size(values) > 0) same = c_copy_in(bytes(used + 1:), values, int(real_bytes * size(values), c_size_t))
    used = used + real_bytes * size(values)
  end subroutine put_reals

  !> Packs the length of a text, then its characters.
  subroutine put_text(bytes, used, text)
    character(len=:), allocatable, intent(inout) :: bytes
    integer, intent(inout) :: used
    character(len=*), intent(in) :: text

    call put_integers(bytes, used, [len(text)])
    call widen(bytes, used + len(text))
    bytes(used + 1:used + len(text)) = text
    used = used + len(text)
  end subroutine put_text

  !> Makes a buffer longer than needed if it is too short, so that appending takes amortised constant time for each byte.
  subroutine widen(bytes, needed)
    character(len=:), allocatable, intent(inout) :: bytes
    integer, intent(in) :: needed   !! [bytes]
    character(len=:), allocatable :: wider
    integer, parameter :: least = 256

    if (.not. allocated(bytes)) allocate (character(len=least) :: bytes)
    if (needed <= len(bytes)) return
    allocate (character(len=2 * needed) :: wider)
    wider(:len(bytes)) = bytes
    call move_alloc(wider, bytes)
  end subroutine widen

  !> Unpacks integers.
  subroutine take_integers(self, bytes, values)
    class(byte_reader_t), intent(inout) :: self
    character(len=*), intent(in) :: bytes
    integer(int32), contiguous, intent(inout) :: values(:)
    type(c_ptr) :: same

    values = 0
    if (.not. self%has(bytes, integer_bytes, size(values))) return
    if (size(values) > 0) same = c_copy_out(values, bytes(self%next:), int(integer_bytes * size(values), c_size_t))
    self%next = self%next + integer_bytes * size(values)
  end subroutine take_integers

  !> Unpacks reals.
  subroutine take_reals(self, bytes, values)
    class(byte_reader_t), intent(inout) :: self
    character(len=*), intent(in) :: bytes
    real(wp), contiguous, intent(inout) :: values(:, :)
    type(c_ptr) :: same

    values = 0.0_wp
    if (.not. self%has(bytes, real_bytes, size(values))) return
    if (size(values) > 0) same = c_copy_out(values, bytes(self%next:), int(real_bytes * size(values), c_size_t))
    self%next = self%next + real_bytes * size(values)
  end subroutine take_reals

  !> Unpacks a text.
  subroutine take_text(self, bytes, text)
    class(byte_reader_t), intent(inout) :: self
    character(len=*), intent(in) :: bytes
    character(len=:), allocatable, intent(out) :: text
    integer :: length(1)

    call self%take_integers(bytes, length)
    text = ''
    if (.not. self%has(bytes, 1, length(1))) return
    text = bytes(self%next:self%next + length(1) - 1)
    self%next = self%next + length(1)
  end subroutine take_text

  !> Whether `count` values of `each` bytes are left; if not, sets `is_short`.
  logical function has(self, bytes, each, count)
    class(byte_reader_t), intent(inout) :: self
    character(len=*), intent(in) :: bytes
    integer, intent(in) :: each, count

    if (count < 0) then
      self%is_short = .true.
    else if (count > (len(bytes) - self%next + 1) / each) then
      self%is_short = .true.
    end if
    has = .not. self%is_short
  end function has

end module nocdyn_bytes
