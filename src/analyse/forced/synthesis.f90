!> The largest and the smallest value of a sum of oscillations: the synthesis of orders in time.
!>
!> Frequencies with whole ratios are one periodic function, whose extremes are found on one period. Functions whose frequencies
!> have no whole ratios reach any combination of their values at some time, so that their extremes add up.
module nocdyn_synthesis
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_synthesis

  real(wp), parameter :: pi = acos(-1.0_wp)
  integer, parameter :: most_multiple = 2000     ! of the common frequency
  integer, parameter :: samples_per_period = 6                   ! of the highest multiple

  !> Oscillations with whole ratios: multiples of one frequency.
  type :: periodic_t
    integer, allocatable :: line(:)         !! [lines]
    integer, allocatable :: multiple(:)     !! [lines]
    integer :: samples = 0                  !! of a period, an even number
    real(wp), allocatable :: cosine(:, :)   !! of multiple * angle, in the first half of the period, [samples / 2, lines]
    real(wp), allocatable :: sine(:, :)
  end type periodic_t

  type, public :: synthesis_t
    type(periodic_t), allocatable, private :: parts(:)
  contains
    procedure :: extremes, find_period, find_slopes
  end type synthesis_t

contains

  !> Groups oscillations by their frequencies: the simplest ratios first, so that a frequency without a simple ratio to others
  !> does not separate these.
  type(synthesis_t) function new_synthesis(frequency, family) result(self)
    real(wp), intent(in) :: frequency(:)   !! in any unit, positive, [lines]
    integer, intent(in) :: family(:)       !! only frequencies of one family have whole ratios, [lines]
    integer, parameter :: limits(*) = [16, 32, 64, 125, 250, 500, 1000, most_multiple]
    real(wp) :: base(size(frequency))      ! the common frequency of each part
    integer :: i, n, part_of(size(frequency))
    integer, allocatable :: members(:)
    type(periodic_t) :: part

    part_of = [(i, i=1, size(frequency))]
    base = frequency
    do n = 1, size(limits)
      call join_parts(frequency, family, limits(n), part_of, base)
    end do
    allocate (self%parts(0))
    do n = 1, size(frequency)
      members = pack([(i, i=1, size(frequency))], part_of == n)
      if (size(members) == 0) cycle
      call new_part(members, nint(frequency(members) / base(n)), part)
      self%parts = [self%parts, part]
    end do
  end function new_synthesis

  !> Joins parts as long as no oscillation is more than a multiple of the common frequency.
  pure subroutine join_parts(frequency, family, most, part_of, base)
    real(wp), intent(in) :: frequency(:)
    integer, intent(in) :: family(:), most
    integer, intent(inout) :: part_of(:)   !! number of the part of each oscillation: its first one
    real(wp), intent(inout) :: base(:)     !! of each part
    integer :: divisor, first, second
    real(wp) :: highest
    logical :: has_changed

    has_changed = .true.
    do while (has_changed)
      has_changed = .false.
      do first = 1, size(frequency)
        if (part_of(first) /= first) cycle
        do second = first + 1, size(frequency)
          if (part_of(second) /= second .or. family(first) /= family(second)) cycle
          highest = maxval(frequency, mask=part_of == first .or. part_of == second)
          do divisor = 1, int(most * base(first) / highest + 0.5_wp)   ! of the base, which becomes smaller
            if (.not. is_whole(base(second) / (base(first) / divisor))) cycle
            base(first) = base(first) / divisor
            where (part_of == second) part_of = first
            has_changed = .true.
            exit
          end do
        end do
      end do
    end do
  end subroutine join_parts

  !> The oscillations of a part, and their values at its samples.
  subroutine new_part(line, multiple, part)
    integer, intent(in) :: line(:), multiple(:)
    type(periodic_t), intent(out) :: part
    integer :: i, k
    real(wp) :: angle

    allocate (part%line, source=line)
    allocate (part%multiple, source=multiple)
    part%samples = max(16, samples_per_period * maxval(multiple))
    allocate (part%cosine(part%samples / 2, size(line)), part%sine(part%samples / 2, size(line)))
    do k = 1, size(line)
      do i = 1, part%samples / 2
        angle = 2.0_wp * pi * modulo(multiple(k) * (i - 1), part%samples) / part%samples
        part%cosine(i, k) = cos(angle)
        part%sine(i, k) = sin(angle)
      end do
    end do
  end subroutine new_part

  elemental logical function is_whole(ratio)
    real(wp), intent(in) :: ratio
    real(wp), parameter :: rounding = 1.0e-9_wp

    is_whole = abs(ratio - anint(ratio)) <= rounding * ratio .and. ratio > 0.5_wp
  end function is_whole

  !> The extremes of the sum of Re(amplitude exp(i frequency t)) over all times.
  pure subroutine extremes(self, amplitude, lowest, highest)
    class(synthesis_t), intent(in) :: self
    complex(wp), intent(in) :: amplitude(:)   !! [lines]
    real(wp), intent(out) :: lowest, highest
    integer :: p
    real(wp) :: angle(2), low, high

    lowest = 0.0_wp
    highest = 0.0_wp
    do p = 1, size(self%parts)
      call periodic_extremes(self%parts(p), amplitude, low, high, angle)
      lowest = lowest + low
      highest = highest + high
    end do
  end subroutine extremes

  !> The period of the sum at given frequencies in the same ratios; without a common one, the longest of its parts.
  pure subroutine find_period(self, frequency, is_common, period)
    class(synthesis_t), intent(in) :: self
    real(wp), intent(in) :: frequency(:)   !! [rad/s], [lines]
    logical, intent(out) :: is_common
    real(wp), intent(out) :: period        !! [s]
    integer :: p

    is_common = size(self%parts) == 1
    period = 0.0_wp
    do p = 1, size(self%parts)
      associate (part => self%parts(p))
        period = max(period, 2.0_wp * pi * part%multiple(1) / frequency(part%line(1)))
      end associate
    end do
  end subroutine find_period

  pure subroutine periodic_extremes(part, amplitude, low, high, angle)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(out) :: low, high
    real(wp), intent(out) :: angle(2)   !! of the common frequency where they are, if there are several oscillations [rad]
    real(wp) :: half(part%samples / 2, 0:1)
    real(wp) :: value(0:part%samples + 1)   ! one more at each end
    integer :: i, k, parity
    real(wp) :: imaginary, real_part

    if (size(part%line) == 1) then
      high = abs(amplitude(part%line(1)))
      low = -high
      angle = 0.0_wp
      return
    end if
    half = 0.0_wp   ! of the even and of the odd multiples, which change their sign from one half to the other
    do k = 1, size(part%line)
      real_part = real(amplitude(part%line(k)), wp)
      imaginary = aimag(amplitude(part%line(k)))
      parity = modulo(part%multiple(k), 2)
      do i = 1, size(half, 1)
        half(i, parity) = half(i, parity) + (real_part * part%cosine(i, k) - imaginary * part%sine(i, k))
      end do
    end do
    value(1:size(half, 1)) = half(:, 0) + half(:, 1)
    value(size(half, 1) + 1:part%samples) = half(:, 0) - half(:, 1)
    value(0) = value(part%samples)
    value(part%samples + 1) = value(1)
    call refine(part, amplitude, value, 1.0_wp, high, angle(2))
    call refine(part, amplitude, value, -1.0_wp, low, angle(1))
    low = -low
  end subroutine periodic_extremes

  !> The largest value of sign * function, by Newton's method from all samples that may be next to it.
  pure subroutine refine(part, amplitude, value, sign, refined, angle)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: value(0:)  !! samples, [0 to samples + 1]
    real(wp), intent(in) :: sign       !! 1 or -1
    real(wp), intent(out) :: refined
    real(wp), intent(out) :: angle     !! of the common frequency there [rad]
    real(wp), dimension(part%samples) :: top, vertex   ! of the parabola through a maximum and its neighbours
    real(wp) :: at, beside, bend, climbed, error, highest, slope
    integer :: i, k, n

    i = maxloc(sign * value, dim=1) - 1
    refined = sign * value(i)
    angle = 2.0_wp * pi * (i - 1) / part%samples
    ! the largest value is within half a sample of one that is lower by this at most, for the curvature is bounded
    beside = 0.5_wp * sum(size_of(amplitude(part%line)) * part%multiple**2) * (pi / part%samples)**2
    n = 0
    highest = refined
    do i = 1, part%samples
      if (sign * value(i) < refined - beside) cycle
      associate (before => sign * value(i - 1), here => sign * value(i), after => sign * value(i + 1))
        if (here < before .or. here < after) cycle
        n = n + 1
        slope = 0.5_wp * (after - before)
        bend = 2.0_wp * here - before - after
        vertex(n) = real(i - 1, wp)
        top(n) = here
        if (bend > 0) then
          vertex(n) = vertex(n) + slope / bend
          top(n) = here + 0.5_wp * slope**2 / bend
        end if
        highest = max(highest, top(n))
      end associate
    end do
    ! a parabola through three samples errs by h^3 / (9 sqrt(3)) of the third derivative at most, which is bounded too
    error = sum(size_of(amplitude(part%line)) * real(part%multiple, wp)**3) * (2.0_wp * pi / part%samples)**3 &
            / (9.0_wp * sqrt(3.0_wp))
    do k = 1, n
      if (top(k) + error < max(refined, highest - error)) cycle
      at = 2.0_wp * pi * vertex(k) / part%samples
      call climb(part, amplitude, sign, at, climbed)
      if (climbed <= refined) cycle
      refined = climbed
      angle = at
    end do
  end subroutine refine

  !> The magnitude of an amplitude, without the care of `abs` for numbers near the end of their range.
  elemental real(wp) function size_of(amplitude)
    complex(wp), intent(in) :: amplitude

    size_of = sqrt(real(amplitude, wp)**2 + aimag(amplitude)**2)
  end function size_of

  !> Goes from an angle to the maximum beside it.
  pure subroutine climb(part, amplitude, sign, angle, climbed)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: sign
    real(wp), intent(inout) :: angle   !! of the common frequency [rad]
    real(wp), intent(out) :: climbed   !! the value there
    integer, parameter :: steps = 8
    real(wp), parameter :: near = 1.0e-4_wp   ! of the top, as a share of the shortest wave's radian: a parabola errs by its cube
    real(wp) :: before, derivative(0:2)
    integer :: n

    climbed = -huge(climbed)
    before = angle
    do n = 1, steps
      derivative = sign * derivatives_at(part, amplitude, angle)
      if (derivative(0) <= climbed) then
        angle = before
        return
      end if
      climbed = derivative(0)
      if (.not. derivative(2) < 0) return
      before = angle
      if (abs(derivative(1)) * maxval(part%multiple) <= near * abs(derivative(2))) then
        climbed = derivative(0) - 0.5_wp * derivative(1)**2 / derivative(2)
        return
      end if
      angle = angle - max(-pi / part%samples, min(pi / part%samples, derivative(1) / derivative(2)))
    end do
    angle = before
  end subroutine climb

  !> The sum of the oscillations of a part, and its first two derivatives by the angle.
  pure function derivatives_at(part, amplitude, angle) result(derivative)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: angle      !! of the common frequency [rad]
    real(wp) :: derivative(0:2)
    complex(wp) :: power(0:maxval(part%multiple)), term
    integer :: k

    power(0) = 1.0_wp
    power(1) = cmplx(cos(angle), sin(angle), wp)
    do k = 2, ubound(power, 1)
      power(k) = power(k - 1) * power(1)
    end do
    derivative = 0.0_wp
    do k = 1, size(part%line)
      term = amplitude(part%line(k)) * power(part%multiple(k))
      derivative = derivative + [real(term, wp), -part%multiple(k) * aimag(term), -part%multiple(k)**2 * real(term, wp)]
    end do
  end function derivatives_at

  !> The derivatives of the half range by the amplitudes: it grows by Re(sum of slope * growth of amplitude). The times of the
  !> extremes may stay where they are, as the sum does not change with them.
  pure subroutine find_slopes(self, amplitude, slope)
    class(synthesis_t), intent(in) :: self
    complex(wp), intent(in) :: amplitude(:)   !! [lines]
    complex(wp), intent(out) :: slope(:)      !! [lines]
    integer, parameter :: rounds = 3          ! of Newton's method, from angles that are right to a ten-thousandth
    real(wp) :: angle(2), derivative(0:2), low, high
    integer :: i, k, n, p

    slope = (0.0_wp, 0.0_wp)
    do p = 1, size(self%parts)
      associate (part => self%parts(p))
        if (size(part%line) == 1) then
          associate (one => amplitude(part%line(1)))
            if (abs(one) > 0) slope(part%line(1)) = conjg(one) / abs(one)
          end associate
          cycle
        end if
        call periodic_extremes(part, amplitude, low, high, angle)
        do i = 1, 2
          do n = 1, rounds
            derivative = derivatives_at(part, amplitude, angle(i))
            if (abs(derivative(2)) > 0) angle(i) = angle(i) - derivative(1) / derivative(2)
          end do
        end do
        do k = 1, size(part%line)
          associate (turn => part%multiple(k) * angle)
            slope(part%line(k)) = 0.5_wp * cmplx(cos(turn(2)) - cos(turn(1)), sin(turn(2)) - sin(turn(1)), wp)
          end associate
        end do
      end associate
    end do
  end subroutine find_slopes

end module nocdyn_synthesis
