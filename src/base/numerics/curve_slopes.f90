!> Slopes at points, between which Hermite's cubics lie: twice differentiable splines, splines that keep dwells, monotone cubics.
!>
!> The monotone cubic has the slopes of F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300-304: between points
!> it is monotone wherever the points are, by the criterion of F. N. Fritsch, R. E. Carlson, SIAM J. Numer. Anal. 17 (1980)
!> 238-246. At the ends the three-point formula is limited likewise, as in PCHIM of SLATEC and in SciPy. Its second derivative
!> jumps at the points: at an extreme by about twice its size, however dense they are.
!>
!> At an end that is not clamped a spline has the slope of the polynomial of degree 5 through the next six points, after
!> B. K. Swartz, R. S. Varga, J. Approx. Theory 6 (1972) 6-49, who take degree 3. The error of a second derivative is then about
!> h^2 / 12 times the fourth one, up to the ends. If the points there are few or not smooth, the third derivative is continuous at
!> the next point instead (not-a-knot, C. de Boor, A Practical Guide to Splines, 1978, chapter IV), which follows a jump in the
!> data less.
module nocdyn_curve_slopes
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: spline_slopes, dwell_slopes, monotone_slopes, has_dwell

contains

  !> Slopes of a spline; those at clamped ends are 0. Few segments with free ends are one polynomial.
  pure function spline_slopes(h, secant, is_clamped) result(slope)
    real(wp), intent(in) :: h(:), secant(:)        !! widths and slopes of the segments, at least 1
    logical, intent(in) :: is_clamped(2)           !! at the first and at the last point
    real(wp) :: slope(size(h) + 1)
    real(wp), dimension(size(h) + 1) :: above, diagonal, right   ! `above`: coefficient of the next slope
    real(wp) :: below, ends(2)
    logical :: is_known(2)
    integer :: i, n

    n = size(h)
    if (n < 3 .and. .not. all(is_clamped)) then
      if (n == 1) slope = merge(0.0_wp, merge(2.0_wp, 1.0_wp, any(is_clamped)) * secant(1), is_clamped)
      if (n == 2 .and. .not. any(is_clamped)) slope = parabola_slopes(h, secant)
      if (n == 1 .or. .not. any(is_clamped)) return
    end if
    call find_end_slope(h, secant, is_clamped(1), ends(1), is_known(1))
    call find_end_slope(h(n:1:-1), secant(n:1:-1), is_clamped(2), ends(2), is_known(2))
    diagonal = 1.0_wp
    above = 0.0_wp
    right = [ends(1), (0.0_wp, i=2, n), ends(2)]
    if (.not. is_known(1)) call set_free_end(h(1), h(2), secant(1), secant(2), diagonal(1), above(1), right(1))
    do i = 2, n
      below = h(i) / diagonal(i - 1)
      above(i) = h(i - 1)
      diagonal(i) = 2.0_wp * (h(i - 1) + h(i)) - below * above(i - 1)
      right(i) = 3.0_wp * (h(i) * secant(i - 1) + h(i - 1) * secant(i)) - below * right(i - 1)
    end do
    slope(n + 1) = ends(2)
    if (.not. is_known(2)) then
      call set_free_end(h(n), h(n - 1), secant(n), secant(n - 1), diagonal(n + 1), below, right(n + 1))
      below = below / diagonal(n)
      slope(n + 1) = (right(n + 1) - below * right(n)) / (diagonal(n + 1) - below * above(n))
    end if
    do i = n, 1, -1
      slope(i) = (right(i) - above(i) * slope(i + 1)) / diagonal(i)
    end do
  end function spline_slopes

  !> The slope at an end: 0 if it is clamped, else the polynomial's through six points, by Newton's divided differences. It is
  !> not known if there are fewer points, or if the last term is not small.
  pure subroutine find_end_slope(h, secant, is_clamped, slope, is_known)
    real(wp), intent(in) :: h(:), secant(:)   !! from the end inwards
    logical, intent(in) :: is_clamped
    real(wp), intent(out) :: slope
    logical, intent(out) :: is_known
    integer, parameter :: degree = 5
    real(wp), parameter :: small = 0.1_wp     ! of the largest secant
    real(wp) :: difference(degree), factor, place(0:degree)
    integer :: i, k

    slope = 0.0_wp
    is_known = is_clamped
    if (is_clamped .or. size(h) < degree) return
    place(0) = 0.0_wp
    do i = 1, degree
      place(i) = place(i - 1) + h(i)
    end do
    difference = secant(:degree)
    slope = difference(1)
    factor = 1.0_wp
    do k = 2, degree
      do i = 1, degree - k + 1
        difference(i) = (difference(i + 1) - difference(i)) / (place(i + k - 1) - place(i - 1))
      end do
      factor = -factor * place(k - 1)
      slope = slope + factor * difference(1)
    end do
    is_known = abs(factor * difference(1)) <= small * maxval(abs(secant(:degree)))
  end subroutine find_end_slope

  !> The equation of the slope at an end that is not clamped: diagonal * slope + beside * slope at the next point = right.
  pure subroutine set_free_end(h, next_h, secant, next_secant, diagonal, beside, right)
    real(wp), intent(in) :: h, next_h, secant, next_secant   !! from the end inwards
    real(wp), intent(out) :: diagonal, beside, right

    diagonal = next_h
    beside = h + next_h
    right = ((h + 2.0_wp * beside) * next_h * secant + h**2 * next_secant) / beside
  end subroutine set_free_end

  pure function parabola_slopes(h, secant) result(slope)
    real(wp), intent(in) :: h(2), secant(2)
    real(wp) :: slope(3)

    slope(2) = (h(2) * secant(1) + h(1) * secant(2)) / (h(1) + h(2))
    slope(1) = 2.0_wp * secant(1) - slope(2)
    slope(3) = 2.0_wp * secant(2) - slope(2)
  end function parabola_slopes

  !> Whether the points of a segment have the same value.
  elemental logical function has_dwell(secant)
    real(wp), intent(in) :: secant

    has_dwell = .not. abs(secant) > 0
  end function has_dwell

  !> Slopes of splines between the dwells of a table, which stay as they are: 0 at their points.
  pure function dwell_slopes(h, secant, repeats) result(slope)
    real(wp), intent(in) :: h(:), secant(:)   !! widths and slopes of the segments
    logical, intent(in) :: repeats            !! after the last point comes the first one; there is a dwell then
    real(wp) :: slope(size(h) + 1)
    real(wp), dimension(size(h)) :: widths, secants
    integer :: begin, end, n, shift

    n = size(h)
    shift = 0
    if (repeats) shift = findloc(has_dwell(secant), .true., dim=1) - 1
    widths = cshift(h, shift)
    secants = cshift(secant, shift)
    slope = 0.0_wp
    begin = 1
    do while (begin <= n)
      end = begin
      if (.not. has_dwell(secants(begin))) then
        do while (end < n)
          if (has_dwell(secants(end + 1))) exit
          end = end + 1
        end do
        slope(begin:end + 1) = spline_slopes(widths(begin:end), secants(begin:end), [begin > 1, end < n .or. repeats])
      end if
      begin = end + 1
    end do
    if (.not. repeats) return
    slope(:n) = cshift(slope(:n), -shift)
    slope(n + 1) = slope(1)
  end function dwell_slopes

  !> Slopes of a monotone cubic: weighted harmonic means of the adjacent secants, 0 at extremes.
  pure function monotone_slopes(h, secant) result(slope)
    real(wp), intent(in) :: h(:), secant(:)   !! widths and slopes of the segments, [points - 1], at least 2
    real(wp) :: slope(size(h) + 1), after, before
    integer :: i, n

    n = size(h)
    slope(1) = end_slope(h(1), h(2), secant(1), secant(2))
    slope(n + 1) = end_slope(h(n), h(n - 1), secant(n), secant(n - 1))
    do i = 2, n
      slope(i) = 0.0_wp
      if (have_same_sign(secant(i - 1), secant(i))) then
        before = 2.0_wp * h(i) + h(i - 1)
        after = h(i) + 2.0_wp * h(i - 1)
        slope(i) = (before + after) / (before / secant(i - 1) + after / secant(i))
      end if
    end do
  end function monotone_slopes

  !> The slope at an end of the parabola through three points, limited so that the curve keeps the shape of the points.
  pure function end_slope(h, next_h, secant, next_secant) result(slope)
    real(wp), intent(in) :: h, next_h, secant, next_secant   !! from the end inwards
    real(wp) :: slope

    slope = ((2.0_wp * h + next_h) * secant - h * next_secant) / (h + next_h)
    if (.not. have_same_sign(slope, secant)) then
      slope = 0.0_wp
    else if (.not. have_same_sign(secant, next_secant) .and. abs(slope) > 3.0_wp * abs(secant)) then
      slope = 3.0_wp * secant
    end if
  end function end_slope

  !> Zero has no sign, nor has a slope that is next to it: its inverse would overflow.
  pure logical function have_same_sign(a, b)
    real(wp), intent(in) :: a, b
    real(wp), parameter :: least = 1.0e-150_wp

    have_same_sign = (a > least .and. b > least) .or. (a < -least .and. b < -least)
  end function have_same_sign

end module nocdyn_curve_slopes
