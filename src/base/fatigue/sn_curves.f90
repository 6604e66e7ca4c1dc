!> S-N curves: how many cycles of an amplitude a part survives, by straight lines in logarithmic scales.
module nocdyn_sn_curves
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_sn_curve

  integer, parameter, public :: mean_none = 1         !! the mean does not count
  integer, parameter, public :: mean_strength = 2     !! amplitude / (1 - |mean| / strength): with the tensile strength Goodman's
                                                      !! line, with the yield strength Soderberg's
  integer, parameter, public :: mean_parabola = 3     !! amplitude / (1 - (mean / tensile strength)^2): Gerber's parabola
                                                      !! (S. Suresh, Fatigue of Materials, Cambridge 1998)

  real(wp), parameter :: longest = 600.0_wp   !! logarithm of the most cycles, and of the fewest

  type, public :: sn_curve_t
    real(wp), allocatable :: log_cycles(:), log_amplitude(:)   !! points of the curve, cycles ascending
    real(wp) :: first_slope = 0.0_wp, last_slope = 0.0_wp      !! k in cycles ~ amplitude^-k beyond the ends
    real(wp) :: endurance = 0.0_wp                             !! amplitudes up to this one do no damage
    integer :: mean_kind = mean_none                           !! mean_...
    real(wp) :: strength = 1.0_wp                              !! of the influence of the mean, in the unit of the amplitude
    real(wp) :: notch_factor = 1.0_wp                          !! of the amplitude
  contains
    procedure :: damage_of, fails_at_once
  end type sn_curve_t

contains

  !> A curve through points, straight on beyond them, or with other slopes.
  pure type(sn_curve_t) function new_sn_curve(cycles, amplitude, first_slope, last_slope) result(curve)
    real(wp), intent(in) :: cycles(:)      !! ascending
    real(wp), intent(in) :: amplitude(:)   !! descending
    real(wp), intent(in), optional :: first_slope, last_slope   !! needed with a single point
    integer :: n

    n = size(cycles)
    allocate (curve%log_cycles, source=log(cycles))
    allocate (curve%log_amplitude, source=log(amplitude))
    if (n > 1) then
      curve%first_slope = slope_between(curve, 1)
      curve%last_slope = slope_between(curve, n - 1)
    end if
    if (present(first_slope)) curve%first_slope = first_slope
    if (present(last_slope)) curve%last_slope = last_slope
  end function new_sn_curve

  !> k between two points.
  pure real(wp) function slope_between(curve, i) result(slope)
    type(sn_curve_t), intent(in) :: curve
    integer, intent(in) :: i   !! the first of them

    slope = (curve%log_cycles(i + 1) - curve%log_cycles(i)) / (curve%log_amplitude(i) - curve%log_amplitude(i + 1))
  end function slope_between

  !> Whether a mean leaves no strength for an amplitude.
  elemental logical function fails_at_once(self, mean)
    class(sn_curve_t), intent(in) :: self
    real(wp), intent(in) :: mean

    fails_at_once = self%mean_kind /= mean_none .and. abs(mean) >= self%strength
  end function fails_at_once

  !> The part of the life that one cycle takes, by Miner's rule; 1 if the part fails at once.
  pure real(wp) function damage_of(self, range, mean) result(damage)
    class(sn_curve_t), intent(in) :: self
    real(wp), intent(in) :: range   !! twice the amplitude
    real(wp), intent(in) :: mean
    real(wp) :: amplitude, level, log_life
    integer :: i, n

    damage = 1.0_wp
    if (self%fails_at_once(mean)) return
    amplitude = 0.5_wp * self%notch_factor * range
    if (self%mean_kind == mean_strength) amplitude = amplitude / (1.0_wp - abs(mean) / self%strength)
    if (self%mean_kind == mean_parabola) amplitude = amplitude / (1.0_wp - (mean / self%strength)**2)
    damage = 0.0_wp
    if (amplitude <= self%endurance .or. amplitude <= tiny(amplitude)) return
    level = log(amplitude)
    n = size(self%log_cycles)
    do i = 0, n - 1
      if (level >= self%log_amplitude(i + 1)) exit
    end do
    if (i == 0) then
      log_life = self%log_cycles(1) - self%first_slope * (level - self%log_amplitude(1))
    else if (i >= n) then
      log_life = self%log_cycles(n) + self%last_slope * (self%log_amplitude(n) - level)
    else
      log_life = self%log_cycles(i) + slope_between(self, i) * (self%log_amplitude(i) - level)
    end if
    damage = exp(-max(-longest, min(longest, log_life)))
  end function damage_of

end module nocdyn_sn_curves
