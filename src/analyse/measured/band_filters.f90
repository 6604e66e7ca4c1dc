!> The part of a record in a band of frequencies, without a shift in time.
!>
!> Butterworth filters of second order by the bilinear transform, forward and backward, as scipy.signal.sosfiltfilt.
module nocdyn_band_filters
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: filter_band

  !> y(i) = b0 x(i) + b1 x(i-1) + b2 x(i-2) - a1 y(i-1) - a2 y(i-2).
  type :: section_t
    real(wp) :: b(0:2) = 0.0_wp, a(2) = 0.0_wp
  end type section_t

contains

  !> Leaves the band in a record of evenly spaced values.
  pure subroutine filter_band(values, interval, band)
    real(wp), intent(inout) :: values(:)
    real(wp), intent(in) :: interval   !! from value to value [s]
    real(wp), intent(in) :: band(2)    !! lowest and highest frequency [rad/s]; 0: no lowest; beyond half the rate: no highest

    if (band(1) > 0.0_wp) call filter_both_ways(butterworth(band(1) * interval, is_high=.true.), values)
    if (band(2) * interval < acos(-1.0_wp)) call filter_both_ways(butterworth(band(2) * interval, is_high=.false.), values)
  end subroutine filter_band

  !> A Butterworth filter of second order.
  pure type(section_t) function butterworth(corner, is_high) result(section)
    real(wp), intent(in) :: corner     !! angle of the corner frequency between two values [rad], below pi
    logical, intent(in) :: is_high     !! whether frequencies above it pass
    real(wp) :: k, norm

    k = tan(0.5_wp * corner)
    norm = 1.0_wp / (1.0_wp + sqrt(2.0_wp) * k + k**2)
    section%b = norm * k**2 * [1.0_wp, 2.0_wp, 1.0_wp]
    if (is_high) section%b = norm * [1.0_wp, -2.0_wp, 1.0_wp]
    section%a = norm * [2.0_wp * (k**2 - 1.0_wp), 1.0_wp - sqrt(2.0_wp) * k + k**2]
  end function butterworth

  !> Filters forward, then backward; at the ends the record goes on as its image turned by 180 degrees about the end.
  pure subroutine filter_both_ways(section, values)
    type(section_t), intent(in) :: section
    real(wp), intent(inout) :: values(:)
    real(wp), allocatable :: longer(:)
    integer :: n, pad

    n = size(values)
    pad = n - 1
    allocate (longer(n + 2 * pad))
    longer(:pad) = 2.0_wp * values(1) - values(n:2:-1)
    longer(pad + 1:pad + n) = values
    longer(pad + n + 1:) = 2.0_wp * values(n) - values(n - 1:1:-1)
    call filter(section, longer)
    longer = longer(size(longer):1:-1)
    call filter(section, longer)
    longer = longer(size(longer):1:-1)
    values = longer(pad + 1:pad + n)
  end subroutine filter_both_ways

  !> Filters forward, from the steady state of the first value.
  pure subroutine filter(section, values)
    type(section_t), intent(in) :: section
    real(wp), intent(inout) :: values(:)
    real(wp) :: new, x1, x2, y1, y2
    integer :: i

    x1 = values(1)
    x2 = x1
    y1 = x1 * sum(section%b) / (1.0_wp + sum(section%a))
    y2 = y1
    do i = 1, size(values)
      new = section%b(0) * values(i) + section%b(1) * x1 + section%b(2) * x2 - section%a(1) * y1 - section%a(2) * y2
      x2 = x1
      x1 = values(i)
      y2 = y1
      y1 = new
      values(i) = new
    end do
  end subroutine filter

end module nocdyn_band_filters
