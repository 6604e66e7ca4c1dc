!> The shift in time between two records of one quantity, whose clocks differ.
module nocdyn_clock_alignment
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: find_shift

contains

  !> The number of intervals by which the second record comes later than the first one, with its fraction: where their correlation
  !> is largest, by a parabola through three values. Shifts at which less than half of the first record has a partner do not count.
  pure subroutine find_shift(first, second, offset, most, shift, correlation)
    real(wp), intent(in) :: first(:), second(:)   !! values at equal intervals
    integer, intent(in) :: offset                 !! first(i) is said to be at the time of second(i + offset)
    integer, intent(in) :: most                   !! largest shift, in intervals
    real(wp), intent(out) :: shift                !! in intervals
    real(wp), intent(out) :: correlation          !! there, at the whole number of intervals
    real(wp) :: correlations(-most - 1:most + 1)
    integer :: best, k
    real(wp) :: bend

    do k = -most - 1, most + 1
      correlations(k) = correlation_at(k)
    end do
    best = maxloc(correlations(-most:most), dim=1) - most - 1
    correlation = correlations(best)
    bend = correlations(best - 1) - 2.0_wp * correlations(best) + correlations(best + 1)
    shift = real(best, wp)
    if (bend < 0.0_wp) shift = shift + min(0.5_wp, max(-0.5_wp, 0.5_wp * (correlations(best - 1) - correlations(best + 1)) / bend))

  contains

    !> Correlation of the first record with the second one `k` intervals later.
    pure real(wp) function correlation_at(k) result(value)
      integer, intent(in) :: k
      integer :: begin, end

      begin = max(1, 1 - k - offset)
      end = min(size(first), size(second) - k - offset)
      value = 0.0_wp
      if (end - begin < 2 .or. 2 * (end - begin + 1) < size(first)) return
      associate (a => first(begin:end), b => second(begin + k + offset:end + k + offset))
        value = sum((a - sum(a) / size(a)) * (b - sum(b) / size(b)))
        value = value / max(tiny(value), sqrt(sum((a - sum(a) / size(a))**2) * sum((b - sum(b) / size(b))**2)))
      end associate
    end function correlation_at

  end subroutine find_shift

end module nocdyn_clock_alignment
