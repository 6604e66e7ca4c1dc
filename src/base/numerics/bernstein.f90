!> The largest value of a polynomial on [0, 1]; no maximum is missed.
!>
!> In Bernstein form a polynomial is at most as large as the largest coefficient. Its derivative has as many roots as there are
!> sign changes in the differences of the coefficients, or fewer by an even number (R. T. Farouki, V. T. Rajan, CAGD 4 (1987)
!> 191-216; 5 (1988) 1-26). Parts of the interval with more than one sign change are halved.
module nocdyn_bernstein
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: make_bernstein_matrix, raise_to_maximum, shift_origin

  integer, parameter, public :: max_degree = 39
  integer, parameter :: rows = 4                    !! of the matrix that are multiplied together; divides 1 + max_degree
  integer, parameter :: max_halvings = 40
  integer, parameter :: max_newton_steps = 60      !! bisection alone would need as many
  real(wp), parameter :: last_change = 1.0e-8_wp    !! of Newton's method; the error is its square

contains

  !> The matrix from coefficients of powers to Bernstein coefficients: binomial(i, k) / binomial(n, k), k <= i.
  pure subroutine make_bernstein_matrix(n, matrix)
    integer, intent(in) :: n
    real(wp), intent(out) :: matrix(0:max_degree, 0:n)   !! [Bernstein coefficients and padding, powers]
    integer :: i, k

    matrix = 0.0_wp
    matrix(:n, 0) = 1.0_wp
    do k = 1, n
      do i = k, n
        matrix(i, k) = matrix(i, k - 1) * (i - k + 1) / (n - k + 1)
      end do
    end do
  end subroutine make_bernstein_matrix

  !> Raises `highest` to the largest value of c_0 + c_1 s + ... inside 0 < s < 1, if that is larger. The ends are not checked.
  pure subroutine raise_to_maximum(n, matrix, c, highest, position, found)
    integer, intent(in) :: n                            !! degree, 1 to `max_degree`
    real(wp), intent(in) :: matrix(0:max_degree, 0:n)   !! of `make_bernstein_matrix`
    real(wp), intent(in) :: c(0:n)                      !! coefficients of powers of s
    real(wp), intent(inout) :: highest                  !! largest value so far
    real(wp), intent(out) :: position                   !! of the maximum
    logical, intent(out) :: found                       !! whether `highest` has been raised by more than rounding
    real(wp) :: b(0:max_degree, max_halvings + 2)   ! of the parts that are left; the last one is next
    real(wp) :: left(max_halvings + 2), length(max_halvings + 2)
    integer :: parts, changes

    found = .false.
    position = 0.0_wp
    call multiply(n, matrix, c, b(:, 1))
    left(1) = 0.0_wp
    length(1) = 1.0_wp
    parts = 1
    do while (parts > 0)
      changes = 0
      if (can_exceed(n, b(:, parts), highest)) changes = sign_changes(n, b(:, parts))
      if (changes == 1 .and. b(1, parts) >= b(0, parts)) then
        call refine_maximum(n, c, left(parts), length(parts), real(maxloc(b(:n, parts), dim=1) - 1, wp) / n, highest, position, &
                            found)
      end if
      if (changes < 2 .or. parts > max_halvings) then
        parts = parts - 1
        cycle
      end if
      length(parts:parts + 1) = 0.5_wp * length(parts)
      left(parts + 1) = left(parts)
      left(parts) = left(parts) + length(parts)
      call halve(n, b(:, parts), b(:, parts + 1))
      if (b(0, parts) > highest) then
        highest = b(0, parts)
        position = left(parts)
        found = .true.
      end if
      parts = parts + 1
    end do
  end subroutine raise_to_maximum

  !> Whether the largest coefficient exceeds `highest` by more than rounding.
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

  !> b = matrix * c, `rows` rows at a time; the matrix is lower triangular.
  pure subroutine multiply(n, matrix, c, b)
    integer, intent(in) :: n
    real(wp), intent(in) :: matrix(0:max_degree, 0:n), c(0:n)
    real(wp), intent(out) :: b(0:max_degree)
    real(wp) :: sum(rows)
    integer :: i, k

    do i = 0, n, rows
      sum = 0.0_wp
      do k = 0, min(n, i + rows - 1)
        sum = sum + matrix(i:i + rows - 1, k) * c(k)
      end do
      b(i:i + rows - 1) = sum
    end do
  end subroutine multiply

  !> The number of sign changes of the differences of the coefficients, which bounds the number of roots of the derivative.
  pure integer function sign_changes(n, b)
    integer, intent(in) :: n
    real(wp), intent(in) :: b(0:n)
    real(wp) :: last
    integer :: i

    sign_changes = 0
    last = 0.0_wp
    do i = 1, n
      associate (difference => b(i) - b(i - 1))
        if (difference * last < 0) sign_changes = sign_changes + 1
        if (abs(difference) > 0) last = sign(1.0_wp, difference)
      end associate
    end do
  end function sign_changes

  !> Coefficients of both halves, by de Casteljau's algorithm; b becomes those of the right half.
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

  !> Raises `highest` to the single maximum in a part, by Newton's method on the derivative with bisection as safeguard.
  pure subroutine refine_maximum(n, c, left, length, guess, highest, position, found)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n)
    real(wp), intent(in) :: left, length
    real(wp), intent(in) :: guess        !! of the maximum in the part, 0 to 1
    real(wp), intent(inout) :: highest, position
    logical, intent(inout) :: found
    real(wp) :: above, below, change, curvature, d(0:max_degree), s, slope, value
    integer :: k, step

    do k = 1, n
      d(k - 1) = k * c(k)
    end do
    below = left
    above = left + length
    s = left + guess * length
    do step = 1, max_newton_steps
      call differentiate(n - 1, d, s, slope, curvature)
      if (slope > 0) then
        below = s
      else
        above = s
      end if
      change = 0.5_wp * (below + above) - s
      if (curvature < 0) then
        if (s - slope / curvature >= below .and. s - slope / curvature <= above) change = -slope / curvature
      end if
      s = s + change
      if (abs(change) <= last_change) exit
    end do
    value = c(n)
    do k = n - 1, 0, -1
      value = value * s + c(k)
    end do
    if (value <= highest) return
    highest = value
    position = s
    found = .true.
  end subroutine refine_maximum

  !> The value and the slope of a polynomial at s.
  pure subroutine differentiate(n, c, s, value, slope)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(0:n), s
    real(wp), intent(out) :: value, slope
    integer :: k

    value = c(n)
    slope = 0.0_wp
    do k = n - 1, 0, -1
      slope = slope * s + value
      value = value * s + c(k)
    end do
  end subroutine differentiate

  !> Replaces a polynomial on [start, until] by the same polynomial on [0, 1].
  pure subroutine shift_origin(n, c, start, until)
    integer, intent(in) :: n
    real(wp), intent(inout) :: c(0:n)   !! coefficients of powers
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
