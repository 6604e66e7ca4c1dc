!> The largest value of a polynomial on [0, 1], which none of its maxima escapes.
!>
!> In Bernstein form a polynomial lies below the largest of its coefficients, and its derivative has as many roots as the
!> differences of the coefficients have changes of sign, or fewer by an even number (R. T. Farouki, V. T. Rajan, CAGD 4 (1987)
!> 191-216; 5 (1988) 1-26). Parts of the interval that can hold more than one root are halved.
module nocdyn_bernstein
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: raise_to_maximum, shift_origin

  integer, parameter, public :: most_degrees = 39
  integer, parameter :: most_halvings = 40
  integer, parameter :: most_newton_steps = 60      !! bisection alone would need as many
  real(wp), parameter :: last_change = 1.0e-8_wp    !! of a place by Newton's method, which then leaves its square

contains

  !> Raises `highest` to the largest value of c_0 + c_1 s + ... between s = 0 and 1 if that is larger; the ends are not looked at.
  pure subroutine raise_to_maximum(n, c, highest, place, found)
    integer, intent(in) :: n         !! degree, 1 to `most_degrees`
    real(wp), intent(in) :: c(0:n)
    real(wp), intent(inout) :: highest
    real(wp), intent(out) :: place   !! of the maximum
    logical, intent(out) :: found    !! whether `highest` has been raised by more than rounding
    real(wp) :: b(0:most_degrees, most_halvings + 2)   ! of the parts that are left; the last of them is next
    real(wp) :: left(most_halvings + 2), length(most_halvings + 2)
    integer :: parts, turns

    found = .false.
    place = 0.0_wp
    if (does_not_turn(n, c)) return
    call to_bernstein(n, c, b(:, 1))
    left(1) = 0.0_wp
    length(1) = 1.0_wp
    parts = 1
    do while (parts > 0)
      turns = 0
      if (can_exceed(n, b(:, parts), highest)) turns = turning_points(n, b(:, parts))
      if (turns == 1 .and. b(1, parts) >= b(0, parts)) then
        call climb(n, c, left(parts), left(parts) + length(parts), highest, place, found)
      end if
      if (turns < 2 .or. parts > most_halvings) then
        parts = parts - 1
        cycle
      end if
      length(parts:parts + 1) = 0.5_wp * length(parts)
      left(parts + 1) = left(parts)
      left(parts) = left(parts) + length(parts)
      call halve(n, b(:, parts), b(:, parts + 1))
      if (b(0, parts) > highest) then
        highest = b(0, parts)
        place = left(parts)
        found = .true.
      end if
      parts = parts + 1
    end do
  end subroutine raise_to_maximum

  !> Whether the largest coefficient is higher by more than rounding.
  pure logical function can_exceed(n, b, highest)
    integer, intent(in) :: n
    real(wp), intent(in) :: b(0:n), highest
    real(wp) :: largest, size
    integer :: i

    largest = b(0)
    size = abs(b(0))
    do i = 1, n
      largest = max(largest, b(i))
      size = max(size, abs(b(i)))
    end do
    can_exceed = largest - n * epsilon(size) * size > highest
  end function can_exceed

  !> Whether the bounds of the derivative on [0, 1] have one sign.
  pure logical function does_not_turn(n, c)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n)
    real(wp) :: least, most
    integer :: k

    least = c(1)
    most = c(1)
    do k = 2, n
      least = least + min(k * c(k), 0.0_wp)
      most = most + max(k * c(k), 0.0_wp)
    end do
    does_not_turn = least > 0 .or. most < 0
  end function does_not_turn

  !> b_i = sum over k <= i of binomial(i, k) / binomial(n, k) c_k.
  pure subroutine to_bernstein(n, c, b)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n)
    real(wp), intent(out) :: b(0:n)
    real(wp) :: binomial
    integer :: i, k

    binomial = 1.0_wp
    do k = 0, n
      b(k) = c(k) / binomial
      binomial = binomial * (n - k) / (k + 1)
    end do
    do k = 1, n
      do i = n, k, -1
        b(i) = b(i) + b(i - 1)
      end do
    end do
  end subroutine to_bernstein

  !> Changes of sign of the differences of the coefficients, which bound the roots of the derivative.
  pure integer function turning_points(n, b)
    integer, intent(in) :: n
    real(wp), intent(in) :: b(0:n)
    real(wp) :: last
    integer :: i

    turning_points = 0
    last = 0.0_wp
    do i = 1, n
      associate (difference => b(i) - b(i - 1))
        if (difference * last < 0) turning_points = turning_points + 1
        if (abs(difference) > 0) last = sign(1.0_wp, difference)
      end associate
    end do
  end function turning_points

  !> de Casteljau's algorithm: b becomes that of the right half.
  pure subroutine halve(n, b, left)
    integer, intent(in) :: n
    real(wp), intent(inout) :: b(0:n)
    real(wp), intent(out) :: left(0:n)
    integer :: i, k

    do k = 0, n
      left(k) = b(0)
      do i = 0, n - k - 1
        b(i) = 0.5_wp * (b(i) + b(i + 1))
      end do
    end do
  end subroutine halve

  !> Raises `highest` to the single maximum between two places, by Newton's method on the derivative with bisection as safeguard.
  pure subroutine climb(n, c, low, high, highest, place, found)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n)
    real(wp), intent(in) :: low, high
    real(wp), intent(inout) :: highest, place
    logical, intent(inout) :: found
    real(wp) :: above, below, change, curvature, s, slope, value
    integer :: step

    below = low
    above = high
    s = 0.5_wp * (low + high)
    do step = 1, most_newton_steps
      call differentiate(n, c, s, value, slope, curvature)
      if (slope > 0) then
        below = s
      else
        above = s
      end if
      change = 0.5_wp * (below + above) - s
      if (curvature < 0) then
        if (s - slope / curvature > below .and. s - slope / curvature < above) change = -slope / curvature
      end if
      s = s + change
      if (abs(change) <= last_change) exit
    end do
    call differentiate(n, c, s, value, slope, curvature)
    if (value <= highest) return
    highest = value
    place = s
    found = .true.
  end subroutine climb

  pure subroutine differentiate(n, c, s, value, slope, curvature)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n), s
    real(wp), intent(out) :: value, slope, curvature
    integer :: k

    value = c(n)
    slope = 0.0_wp
    curvature = 0.0_wp
    do k = n - 1, 0, -1
      curvature = curvature * s + slope
      slope = slope * s + value
      value = value * s + c(k)
    end do
    curvature = 2 * curvature
  end subroutine differentiate

  !> The polynomial on [start, until] becomes one on [0, 1].
  pure subroutine shift_origin(n, c, start, until)
    integer, intent(in) :: n
    real(wp), intent(inout) :: c(0:n)
    real(wp), intent(in) :: start, until
    real(wp) :: power
    integer :: i, k

    do k = 0, n - 1
      do i = n - 1, k, -1
        c(i) = c(i) + start * c(i + 1)
      end do
    end do
    power = 1.0_wp
    do k = 1, n
      power = power * (until - start)
      c(k) = power * c(k)
    end do
  end subroutine shift_origin

end module nocdyn_bernstein
