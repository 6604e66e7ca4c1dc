!> Sine, cosine, exponential and hyperbolic tangent of arrays, by the same operations for every element.
!>
!> A compiler's vector sine differs from its scalar sine in the last bits, so that the result of a lane would depend on its
!> index in the block. Here every argument goes through the same additions and multiplications, which IEEE arithmetic rounds
!> alike in vectors and scalars. The loops have no branch, so that compilers vectorise them.
!>
!> sin x = (-1)^k sin r with r = x - k pi in [-pi/2, pi/2]; pi is in three parts (W. J. Cody, W. Waite, Software Manual
!> for the Elementary Functions, 1980), the first two so short that their products with k are exact. The Taylor series
!> up to r^21 / 21! leaves less than 1.3e-18. The error is below 4 units in the last place.
!>
!> tanh x = E / (E + 2) for x >= 0 with E = exp(2 x) - 1 = 2^k (exp(r) - 1) + (2^k - 1), r = 2 x - k ln 2 in
!> [-ln 2 / 2, ln 2 / 2]; ln 2 is in two parts, the first of 32 bits, and the Taylor series up to r^14 / 14! leaves less than
!> 1e-19. The errors of this and of exp x = 2^k (1 + (exp(r) - 1)) are below 4 units in the last place too.
!>
!> The logarithm and the power to base 2 are for step sizes, which do not need all digits: their errors are below 1e-8.
!> log2 x = k + 1/2 + 2 / ln 2 artanh s with x = 2^k m, 1 <= m < 2, s = (m - sqrt 2) / (m + sqrt 2), |s| < 0.172.
module nocdyn_vector_functions
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: sine_of, cosine_of, sines, cosines, tanh_of, tanhs, exp_of, exps, log_cosh_of, log2s, exp2s

  real(wp), parameter :: pi_high = 3.1415926535846666_wp         ! 35 bits
  real(wp), parameter :: pi_middle = 5.1266883031679116e-12_wp   ! the next 35 bits
  real(wp), parameter :: pi_low = 2.1125998133974855e-23_wp
  real(wp), parameter :: inverse_pi = 0.31830988618379067_wp
  real(wp), parameter :: to_whole = 1.5_wp * 2.0_wp**52   ! adding and subtracting it rounds to a whole number
  real(wp), parameter :: largest = 4.0e5_wp   ! keeps k below 2^17; larger arguments use the intrinsic functions

  real(wp), parameter :: ln2_high = 0.693147180369123816490_wp   ! 32 bits, as in fdlibm
  real(wp), parameter :: ln2_low = 1.90821492927058770002e-10_wp
  real(wp), parameter :: inverse_ln2 = 1.4426950408889634_wp
  real(wp), parameter :: tanh_is_one = 22.0_wp   ! from here on, in double precision

contains

  !> sin(x), with the bits that `sines` gives.
  elemental real(wp) function sine_of(x)
    real(wp), intent(in) :: x

    if (abs(x) <= largest) then
      sine_of = sine(x)
    else
      sine_of = sin(x)
    end if
  end function sine_of

  !> cos(x), with the bits that `cosines` gives.
  elemental real(wp) function cosine_of(x)
    real(wp), intent(in) :: x

    if (abs(x) <= largest) then
      cosine_of = cosine(x)
    else
      cosine_of = cos(x)
    end if
  end function cosine_of

  !> Replaces each x by sin(x).
  pure subroutine sines(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    integer :: i

    if (all_moderate(n, x)) then
      do i = 1, n
        x(i) = sine(x(i))
      end do
    else
      !GCC$ novector
      do i = 1, n
        x(i) = sine_of(x(i))
      end do
    end if
  end subroutine sines

  !> Replaces each x by cos(x).
  pure subroutine cosines(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    integer :: i

    if (all_moderate(n, x)) then
      do i = 1, n
        x(i) = cosine(x(i))
      end do
    else
      !GCC$ novector
      do i = 1, n
        x(i) = cosine_of(x(i))
      end do
    end if
  end subroutine cosines

  !> Whether no argument is larger than `largest` in size.
  pure logical function all_moderate(n, x)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)

    if (n == 1) then
      all_moderate = abs(x(1)) <= largest
    else
      all_moderate = count(abs(x) > largest) == 0
    end if
  end function all_moderate

  pure real(wp) function sine(x)
    real(wp), intent(in) :: x
    real(wp) :: k

    k = (x * inverse_pi + to_whole) - to_whole
    sine = signed_sine(x, k, k)
  end function sine

  !> The sine of x + pi/2.
  pure real(wp) function cosine(x)
    real(wp), intent(in) :: x
    real(wp) :: k

    k = ((x * inverse_pi + 0.5_wp) + to_whole) - to_whole
    cosine = signed_sine(x, k - 0.5_wp, k)
  end function cosine

  !> (-1)^k sin(x - turns pi); the terms of the series are added in independent pairs.
  pure real(wp) function signed_sine(x, turns, k)
    real(wp), intent(in) :: x
    real(wp), intent(in) :: turns   !! multiple of 1/2 with x - turns pi in [-pi/2, pi/2]
    real(wp), intent(in) :: k       !! whole number
    real(wp), parameter :: a3 = -1.0_wp / 6.0_wp, a5 = -a3 / 20.0_wp, a7 = -a5 / 42.0_wp, a9 = -a7 / 72.0_wp
    real(wp), parameter :: a11 = -a9 / 110.0_wp, a13 = -a11 / 156.0_wp, a15 = -a13 / 210.0_wp
    real(wp), parameter :: a17 = -a15 / 272.0_wp, a19 = -a17 / 342.0_wp, a21 = -a19 / 420.0_wp
    real(wp) :: r, r2, r4, r8, series

    r = ((x - turns * pi_high) - turns * pi_middle) - turns * pi_low
    r2 = r * r
    r4 = r2 * r2
    r8 = r4 * r4
    series = ((a3 + a5 * r2) + (a7 + a9 * r2) * r4) + ((a11 + a13 * r2) + (a15 + a17 * r2) * r4 + (a19 + a21 * r2) * r8) * r8
    signed_sine = (r + r * (r2 * series)) * real(1 - 2 * iand(int(k), 1), wp)
  end function signed_sine

  !> tanh(x).
  elemental real(wp) function tanh_of(x)
    real(wp), intent(in) :: x
    real(wp) :: e, k, r, two_to_k

    call reduce(2.0_wp * min(abs(x), tanh_is_one), k, r)
    two_to_k = real(shiftl(1_int64, int(k)), wp)
    e = two_to_k * exp_minus_1(r) + (two_to_k - 1.0_wp)
    tanh_of = sign(e / (e + 2.0_wp), x)
  end function tanh_of

  !> Replaces each x by tanh(x).
  pure subroutine tanhs(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    integer :: i

    do i = 1, n
      x(i) = tanh_of(x(i))
    end do
  end subroutine tanhs

  !> Replaces each x by exp(x).
  pure subroutine exps(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    integer :: i

    do i = 1, n
      x(i) = exp_of(x(i))
    end do
  end subroutine exps

  !> exp(x), with the bits that a loop over an array gives; x is limited to -700 to 700.
  elemental real(wp) function exp_of(x)
    real(wp), intent(in) :: x
    real(wp), parameter :: largest_exponent = 700.0_wp
    real(wp) :: k, r

    call reduce(max(-largest_exponent, min(x, largest_exponent)), k, r)
    exp_of = (1.0_wp + exp_minus_1(r)) * transfer(shiftl(int(k, int64) + 1023_int64, 52), 1.0_wp)
  end function exp_of

  !> Splits x into k ln 2 + r.
  elemental subroutine reduce(x, k, r)
    real(wp), intent(in) :: x
    real(wp), intent(out) :: k   !! whole number
    real(wp), intent(out) :: r   !! within ln 2 / 2 of zero

    k = (x * inverse_ln2 + to_whole) - to_whole
    r = (x - k * ln2_high) - k * ln2_low
  end subroutine reduce

  !> exp(r) - 1.
  elemental real(wp) function exp_minus_1(r)
    real(wp), intent(in) :: r   !! within ln 2 / 2 of zero
    real(wp), parameter :: b2 = 1.0_wp / 2.0_wp, b3 = b2 / 3.0_wp, b4 = b3 / 4.0_wp, b5 = b4 / 5.0_wp, b6 = b5 / 6.0_wp
    real(wp), parameter :: b7 = b6 / 7.0_wp, b8 = b7 / 8.0_wp, b9 = b8 / 9.0_wp, b10 = b9 / 10.0_wp, b11 = b10 / 11.0_wp
    real(wp), parameter :: b12 = b11 / 12.0_wp, b13 = b12 / 13.0_wp, b14 = b13 / 14.0_wp
    real(wp) :: r2, r4, r8, series

    r2 = r * r
    r4 = r2 * r2
    r8 = r4 * r4
    series = ((b2 + b3 * r) + (b4 + b5 * r) * r2) + ((b6 + b7 * r) + (b8 + b9 * r) * r2) * r4 &
             + ((b10 + b11 * r) + (b12 + b13 * r + b14 * r2) * r2) * r8
    exp_minus_1 = r + r2 * series
  end function exp_minus_1

  !> ln cosh x; for small x by its series, x^2 / 2 - x^4 / 12 + x^6 / 45 - ..., as the formula would lose digits.
  elemental real(wp) function log_cosh_of(x)
    real(wp), intent(in) :: x

    if (abs(x) < 0.01_wp) then
      log_cosh_of = x**2 * (0.5_wp + x**2 * (-1.0_wp / 12.0_wp + x**2 * (1.0_wp / 45.0_wp - x**2 * 17.0_wp / 2520.0_wp)))
    else
      log_cosh_of = abs(x) + log(0.5_wp * (1.0_wp + exp(-2.0_wp * abs(x))))
    end if
  end function log_cosh_of

  !> Replaces each x, a normal positive number, by log2(x) with an error below 1e-8.
  pure subroutine log2s(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    integer :: i

    do i = 1, n
      x(i) = log2_of(x(i))
    end do
  end subroutine log2s

  pure real(wp) function log2_of(x)
    real(wp), intent(in) :: x
    integer(int64), parameter :: mantissa = shiftl(1_int64, 52) - 1
    integer(int64), parameter :: exponent_of_one = shiftl(1023_int64, 52), exponent_of_whole = shiftl(1075_int64, 52)
    real(wp), parameter :: bias = 2.0_wp**52 + 1023.0_wp
    real(wp), parameter :: root_2 = 1.4142135623730950_wp
    real(wp), parameter :: c1 = 2.8853900817779268_wp, c3 = c1 / 3.0_wp, c5 = c1 / 5.0_wp, c7 = c1 / 7.0_wp, c9 = c1 / 9.0_wp
    integer(int64) :: bits
    real(wp) :: k, m, s, s2, s4

    bits = transfer(x, bits)
    k = transfer(ior(shiftr(bits, 52), exponent_of_whole), k) - bias
    m = transfer(ior(iand(bits, mantissa), exponent_of_one), m)
    s = (m - root_2) / (m + root_2)
    s2 = s * s
    s4 = s2 * s2
    log2_of = (k + 0.5_wp) + s * ((c1 + c3 * s2) + ((c5 + c7 * s2) + c9 * s4) * s4)
  end function log2_of

  !> Replaces each x by 2^x with a relative error below 1e-8; x is limited to -1000 to 1000.
  pure subroutine exp2s(n, x)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(n)
    integer :: i

    do i = 1, n
      x(i) = exp2_of(x(i))
    end do
  end subroutine exp2s

  pure real(wp) function exp2_of(x)
    real(wp), intent(in) :: x
    real(wp), parameter :: largest_exponent = 1000.0_wp
    real(wp), parameter :: to_exponent = to_whole + 1023.0_wp   ! leaves the bits of the exponent at the end
    ! ln(2)^n / n!, written out: compilers round powers of constants differently
    real(wp), parameter :: b1 = 0.69314718055994531_wp, b2 = 0.24022650695910069_wp, b3 = 0.055504108664821576_wp
    real(wp), parameter :: b4 = 0.0096181291076284769_wp, b5 = 0.0013333558146428441_wp
    real(wp), parameter :: b6 = 0.00015403530393381606_wp, b7 = 1.5252733804059838e-05_wp
    real(wp) :: moderate, r, r2, r4, shifted, two_to_k

    moderate = max(-largest_exponent, min(x, largest_exponent))
    shifted = moderate + to_exponent
    r = moderate - (shifted - to_exponent)
    r2 = r * r
    r4 = r2 * r2
    two_to_k = transfer(shiftl(transfer(shifted, 1_int64), 52), two_to_k)
    exp2_of = (((1.0_wp + b1 * r) + (b2 + b3 * r) * r2) + ((b4 + b5 * r) + (b6 + b7 * r) * r2) * r4) * two_to_k
  end function exp2_of

end module nocdyn_vector_functions
