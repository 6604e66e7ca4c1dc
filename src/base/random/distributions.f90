!> Probability distributions by their quantiles: uniform, normal and lognormal; the last two may be truncated. The standard normal
!> distribution and its inverse.
module nocdyn_distributions
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: uniform_distribution, normal_distribution, lognormal_distribution, normal_probability, normal_quantile

  ! Quotients of polynomials, lowest power first, around 1/2, in the tails and far out in them.
  real(wp), parameter :: centre_top(8) = [3.3871328727963666080e0_wp, 1.3314166789178437745e2_wp, &
    1.9715909503065514427e3_wp, 1.3731693765509461125e4_wp, 4.5921953931549871457e4_wp, 6.7265770927008700853e4_wp, &
    3.3430575583588128105e4_wp, 2.5090809287301226727e3_wp]
  real(wp), parameter :: centre_bottom(8) = [1.0_wp, 4.2313330701600911252e1_wp, 6.8718700749205790830e2_wp, &
    5.3941960214247511077e3_wp, 2.1213794301586595867e4_wp, 3.9307895800092710610e4_wp, 2.8729085735721942674e4_wp, &
    5.2264952788528545610e3_wp]
  real(wp), parameter :: tail_top(8) = [1.42343711074968357734e0_wp, 4.63033784615654529590e0_wp, &
    5.76949722146069140550e0_wp, 3.64784832476320460504e0_wp, 1.27045825245236838258e0_wp, 2.41780725177450611770e-1_wp, &
    2.27238449892691845833e-2_wp, 7.74545014278341407640e-4_wp]
  real(wp), parameter :: tail_bottom(8) = [1.0_wp, 2.05319162663775882187e0_wp, 1.67638483018380384940e0_wp, &
    6.89767334985100004550e-1_wp, 1.48103976427480074590e-1_wp, 1.51986665636164571966e-2_wp, &
    5.47593808499534494600e-4_wp, 1.05075007164441684324e-9_wp]
  real(wp), parameter :: far_top(8) = [6.65790464350110377720e0_wp, 5.46378491116411436990e0_wp, &
    1.78482653991729133580e0_wp, 2.96560571828504891230e-1_wp, 2.65321895265761230930e-2_wp, 1.24266094738807843860e-3_wp, &
    2.71155556874348757815e-5_wp, 2.01033439929228813265e-7_wp]
  real(wp), parameter :: far_bottom(8) = [1.0_wp, 5.99832206555887937690e-1_wp, 1.36929880922735805310e-1_wp, &
    1.48753612908506148525e-2_wp, 7.86869131145613259100e-4_wp, 1.84631831751005468180e-5_wp, 1.42151175831644588870e-7_wp, &
    2.04426310338993978564e-15_wp]

  integer, parameter :: shape_uniform = 1, shape_normal = 2, shape_lognormal = 3
  !> In standard deviations from the mean: the probability beyond it is 0 in double precision.
  real(wp), parameter, public :: tail_end = 40.0_wp

  type, public :: distribution_t
    private
    real(wp), public :: probability   !! of low to high without truncation; no number can be drawn if it is 0
    integer :: shape
    real(wp) :: low, high             !! ends of the range
    real(wp) :: middle                !! mean or median
    real(wp) :: deviation             !! standard deviation of the number or of its natural logarithm
    real(wp) :: below, above          !! probabilities outside low to high without truncation
  contains
    procedure :: quantile
  end type distribution_t

contains

  !> The uniform distribution from low to high.
  pure function uniform_distribution(low, high) result(distribution)
    real(wp), intent(in) :: low, high   !! ends of the range
    type(distribution_t) :: distribution

    distribution = distribution_t(probability=1.0_wp, shape=shape_uniform, low=low, high=high, &
                                  middle=0.5_wp * low + 0.5_wp * high, deviation=0.0_wp, below=0.0_wp, above=0.0_wp)
  end function uniform_distribution

  !> The normal distribution, truncated to low to high.
  pure function normal_distribution(mean, deviation, low, high) result(distribution)
    real(wp), intent(in) :: mean
    real(wp), intent(in) :: deviation   !! standard deviation, above 0
    real(wp), intent(in) :: low, high   !! range of the numbers; -huge to huge: no truncation
    type(distribution_t) :: distribution
    real(wp) :: ends(2)

    ends = [low, high]
    where (abs(0.5_wp * ends - 0.5_wp * mean) / tail_end < 0.5_wp * deviation)   ! halves of huge numbers do not overflow
      ends = (ends - mean) / deviation
    else where
      ends = sign(tail_end, 0.5_wp * ends - 0.5_wp * mean)
    end where
    distribution = truncated(shape_normal, mean, deviation, low, high, ends)
  end function normal_distribution

  !> The lognormal distribution, truncated to low to high.
  pure function lognormal_distribution(median, log_deviation, low, high) result(distribution)
    real(wp), intent(in) :: median          !! above 0
    real(wp), intent(in) :: log_deviation   !! of the natural logarithm, above 0 and at most 10
    real(wp), intent(in) :: low, high       !! as for `normal_distribution`
    type(distribution_t) :: distribution
    real(wp) :: ends(2)

    ends = log(max([low, high], tiny(low))) - log(median)
    ends = max(-tail_end, min(ends / log_deviation, tail_end))
    distribution = truncated(shape_lognormal, median, log_deviation, low, high, ends)
  end function lognormal_distribution

  !> A truncated distribution.
  pure function truncated(shape, middle, deviation, low, high, ends) result(distribution)
    integer, intent(in) :: shape
    real(wp), intent(in) :: middle, deviation, low, high
    real(wp), intent(in) :: ends(2)   !! low and high, in standard deviations from the middle
    type(distribution_t) :: distribution
    real(wp) :: probability

    if (ends(1) > 0.0_wp) then   ! in the upper tail the complementary probabilities have more digits
      probability = normal_probability(-ends(1)) - normal_probability(-ends(2))
    else
      probability = normal_probability(ends(2)) - normal_probability(ends(1))
    end if
    distribution = distribution_t(probability=probability, shape=shape, low=low, high=high, middle=middle, &
                                  deviation=deviation, below=normal_probability(ends(1)), above=normal_probability(-ends(2)))
  end function truncated

  !> The quantile of u: the number below which the probability is u, within low to high.
  pure real(wp) function quantile(self, u) result(x)
    class(distribution_t), intent(in) :: self
    real(wp), intent(in) :: u   !! above 0 and below 1

    select case (self%shape)
    case (shape_uniform)
      x = self%low + (self%high - self%low) * u
    case (shape_normal)
      x = self%middle + self%deviation * standard_quantile(self, u)
    case default
      x = self%middle * exp(self%deviation * standard_quantile(self, u))
    end select
    x = max(self%low, min(x, self%high))
  end function quantile

  !> The quantile in standard deviations from the middle, computed from the nearer tail.
  pure real(wp) function standard_quantile(self, u) result(z)
    class(distribution_t), intent(in) :: self
    real(wp), intent(in) :: u
    real(wp) :: lower_tail

    lower_tail = self%below + u * self%probability
    if (lower_tail <= 0.5_wp) then
      z = normal_quantile(lower_tail)
    else
      z = -normal_quantile(self%above + (1.0_wp - u) * self%probability)
    end if
  end function standard_quantile

  !> The probability of a value below x.
  pure real(wp) function normal_probability(x)
    real(wp), intent(in) :: x

    normal_probability = 0.5_wp * erfc(-x * sqrt(0.5_wp))
  end function normal_probability

  !> The value below which the probability is p: PPND16 of M. J. Wichura, Algorithm AS 241, Appl. Statist. 37 (1988) 477-484.
  !>
  !> The relative error is about 1e-16. Above 1/2, where p itself has lost digits, -normal_quantile(1 - p) is as exact as 1 - p.
  pure real(wp) function normal_quantile(p) result(x)
    real(wp), intent(in) :: p   !! above 0 and below 1
    real(wp) :: q, r

    q = p - 0.5_wp
    if (abs(q) <= 0.425_wp) then
      x = q * quotient(0.180625_wp - q * q, centre_top, centre_bottom)
      return
    end if
    r = sqrt(-log(min(p, 1.0_wp - p)))
    if (r <= 5.0_wp) then
      x = sign(quotient(r - 1.6_wp, tail_top, tail_bottom), q)
    else
      x = sign(quotient(r - 5.0_wp, far_top, far_bottom), q)
    end if
  end function normal_quantile

  !> The quotient of two polynomials of degree 7 at x.
  pure real(wp) function quotient(x, top, bottom)
    real(wp), intent(in) :: x, top(8), bottom(8)
    real(wp) :: denominator, numerator
    integer :: i

    numerator = top(8)
    denominator = bottom(8)
    do i = 7, 1, -1
      numerator = numerator * x + top(i)
      denominator = denominator * x + bottom(i)
    end do
    quotient = numerator / denominator
  end function quotient

end module nocdyn_distributions
