!> Probability distributions by their quantiles: uniform, normal and lognormal; the last two may be truncated.
module nocdyn_distributions
  use nocdyn_kinds, only: wp
  use nocdyn_normal_quantiles, only: normal_probability, normal_quantile
  implicit none (type, external)
  private

  public :: uniform_distribution, normal_distribution, lognormal_distribution

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

end module nocdyn_distributions
