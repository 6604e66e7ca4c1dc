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
    procedure :: extremes, find_period
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
    real(wp) :: low, high

    lowest = 0.0_wp
    highest = 0.0_wp
    do p = 1, size(self%parts)
      call periodic_extremes(self%parts(p), amplitude, low, high)
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

  pure subroutine periodic_extremes(part, amplitude, low, high)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(out) :: low, high
    real(wp) :: half(part%samples / 2, 0:1)
    real(wp) :: value(0:part%samples + 1)   ! one more at each end
    integer :: i, k, parity
    real(wp) :: imaginary, real_part

    if (size(part%line) == 1) then
      high = abs(amplitude(part%line(1)))
      low = -high
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
    high = refined(part, amplitude, value, 1.0_wp)
    low = -refined(part, amplitude, value, -1.0_wp)
  end subroutine periodic_extremes

  !> The largest value of sign * function, by Newton's method from all samples that may be next to it.
  pure real(wp) function refined(part, amplitude, value, sign)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: value(0:)  !! samples, [0 to samples + 1]
    real(wp), intent(in) :: sign       !! 1 or -1
    real(wp), dimension(part%samples) :: top, vertex   ! of the parabola through a maximum and its neighbours
    real(wp) :: beside, bend, error, highest, slope
    integer :: i, k, n

    refined = maxval(sign * value)
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
      refined = max(refined, climbed(part, amplitude, 2.0_wp * pi * vertex(k) / part%samples, sign))
    end do
  end function refined

  !> The magnitude of an amplitude, without the care of `abs` for numbers near the end of their range.
  elemental real(wp) function size_of(amplitude)
    complex(wp), intent(in) :: amplitude

    size_of = sqrt(real(amplitude, wp)**2 + aimag(amplitude)**2)
  end function size_of

  pure real(wp) function climbed(part, amplitude, start, sign)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: start, sign
    integer, parameter :: steps = 8
    real(wp), parameter :: near = 1.0e-4_wp   ! of the top, as a share of the shortest wave's radian: a parabola errs by its cube
    complex(wp) :: power(0:maxval(part%multiple)), term
    real(wp) :: angle, first, second, value
    integer :: k, n

    angle = start
    climbed = -huge(climbed)
    do n = 1, steps
      value = 0.0_wp
      first = 0.0_wp
      second = 0.0_wp
      power(0) = sign
      power(1) = cmplx(cos(angle), sin(angle), wp)
      do k = 2, ubound(power, 1)
        power(k) = power(k - 1) * power(1)
      end do
      power(1:) = sign * power(1:)
      do k = 1, size(part%line)
        term = amplitude(part%line(k)) * power(part%multiple(k))
        value = value + real(term, wp)
        first = first - part%multiple(k) * aimag(term)
        second = second - part%multiple(k)**2 * real(term, wp)
      end do
      if (value <= climbed) return
      climbed = value
      if (.not. second < 0) return
      if (abs(first) * maxval(part%multiple) <= near * abs(second)) then
        climbed = value - 0.5_wp * first**2 / second
        return
      end if
      angle = angle - max(-pi / part%samples, min(pi / part%samples, first / second))
    end do
  end function climbed

end module nocdyn_synthesis
