!> Random numbers that are the same with every compiler.
module nocdyn_test_random
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: random_stream

  integer(int64), parameter :: factor = 48271_int64, modulus = 2147483647_int64   ! Park and Miller, CACM 36 (1993) 105-110

  type, public :: random_stream_t
    integer(int64), private :: state = 1_int64
  contains
    procedure :: number
    procedure :: whole
  end type random_stream_t

contains

  !> Streams of different seeds have nothing in common that a test would notice.
  function random_stream(seed) result(stream)
    integer, intent(in) :: seed   !! at least 0
    type(random_stream_t) :: stream
    real(wp) :: dropped
    integer :: i

    stream%state = 1_int64 + modulo(int(seed, int64) * 7919_int64, modulus - 1_int64)
    do i = 1, 4
      dropped = stream%number(0.0_wp, 1.0_wp)
    end do
    if (dropped < 0.0_wp) error stop 'nocdyn_test_random: a number is out of its range'
  end function random_stream

  !> Evenly distributed between `low` and `high`.
  function number(self, low, high)
    class(random_stream_t), intent(inout) :: self
    real(wp), intent(in) :: low, high
    real(wp) :: number

    self%state = mod(self%state * factor, modulus)
    number = low + (high - low) * real(self%state, wp) / real(modulus, wp)
  end function number

  !> A whole number from `low` to `high`.
  function whole(self, low, high)
    class(random_stream_t), intent(inout) :: self
    integer, intent(in) :: low, high
    integer :: whole

    whole = low + int(self%number(0.0_wp, real(high - low + 1, wp)))
  end function whole

end module nocdyn_test_random
