!> The shift in time between two records of one quantity, whose clocks differ.
module nocdyn_clock_alignment
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: add_drift, find_drift, find_shift

contains

  !> The shifts of the pieces of a record, each as by `find_shift`: clocks that drift.
  pure subroutine find_drift(first, second, offset, piece, most, middles, shifts)
    real(wp), intent(in) :: first(:), second(:)   !! values at equal intervals
    integer, intent(in) :: offset                 !! first(i) is said to be at the time of second(i + offset)
    integer, intent(in) :: piece                  !! number of values in a piece
    integer, intent(in) :: most                   !! largest shift, in intervals
    real(wp), allocatable, intent(out) :: middles(:)   !! of the pieces: indices of the first record
    real(wp), allocatable, intent(out) :: shifts(:)    !! [pieces]
    real(wp) :: correlation
    integer :: begin, i, pieces

    pieces = max(1, size(first) / piece)
    allocate (middles(pieces), shifts(pieces))
    do i = 1, pieces
      begin = 1 + (i - 1) * piece
      middles(i) = begin + 0.5_wp * (piece - 1)
      call find_shift(first(begin:min(size(first), begin + piece - 1)), second, offset + begin - 1, most, shifts(i), correlation)
    end do
  end subroutine find_drift

  !> Adds a drift to times: straight between the middles of the pieces, constant beyond them.
  pure subroutine add_drift(middles, shifts, times)
    real(wp), intent(in) :: middles(:), shifts(:)   !! [s], ascending; [s]
    real(wp), intent(inout) :: times(:)             !! ascending [s]
    integer :: i, s
    real(wp) :: part

    s = 1
    do i = 1, size(times)
      do while (s < size(middles) - 1)
        if (times(i) < middles(s + 1)) exit
        s = s + 1
      end do
      if (size(middles) == 1) then
        times(i) = times(i) + shifts(1)
      else
        part = min(1.0_wp, max(0.0_wp, (times(i) - middles(s)) / (middles(s + 1) - middles(s))))
        times(i) = times(i) + (1.0_wp - part) * shifts(s) + part * shifts(s + 1)
      end if
    end do
  end subroutine add_drift

  !> The number of intervals by which the second record comes later than the first one, with its fraction: where their
  !> correlation is largest, by a parabola through three values. Shifts at which less than half of the first record has a
  !> partner do not count.
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
    if (bend >= 0.0_wp) return
    shift = shift + min(0.5_wp, max(-0.5_wp, 0.5_wp * (correlations(best - 1) - correlations(best + 1)) / bend))

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
