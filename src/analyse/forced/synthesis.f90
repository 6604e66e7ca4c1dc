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
  integer, parameter :: most_parts = 240, most_multiple = 2000   ! of the common frequency
  integer, parameter :: samples_per_period = 6                   ! of the highest multiple

  !> Oscillations with whole ratios: multiples of one frequency.
  type :: periodic_t
    integer, allocatable :: line(:)         !! [lines]
    integer, allocatable :: multiple(:)     !! [lines]
    integer :: samples = 0
    real(wp), allocatable :: cosine(:, :)   !! of multiple * angle, [samples, lines]
    real(wp), allocatable :: sine(:, :)
  end type periodic_t

  type, public :: synthesis_t
    type(periodic_t), allocatable, private :: parts(:)
  contains
    procedure :: extremes
  end type synthesis_t

contains

  !> Groups oscillations by their frequencies.
  type(synthesis_t) function new_synthesis(frequency, family) result(self)
    real(wp), intent(in) :: frequency(:)   !! in any unit, positive, [lines]
    integer, intent(in) :: family(:)       !! only frequencies of one family have whole ratios, [lines]
    integer :: k
    logical :: is_left(size(frequency))
    type(periodic_t) :: part

    allocate (self%parts(0))
    is_left = .true.
    do while (any(is_left))
      call collect(frequency, is_left .and. family == family(findloc(is_left, .true., dim=1)), part)
      part%samples = max(16, samples_per_period * maxval(part%multiple))
      allocate (part%cosine(part%samples, size(part%line)), part%sine(part%samples, size(part%line)))
      do k = 1, size(part%line)
        part%cosine(:, k) = cos(2.0_wp * pi * modulo(part%multiple(k) * turns(part%samples), part%samples) / part%samples)
        part%sine(:, k) = sin(2.0_wp * pi * modulo(part%multiple(k) * turns(part%samples), part%samples) / part%samples)
      end do
      self%parts = [self%parts, part]
      is_left(part%line) = .false.
    end do
  end function new_synthesis

  pure function turns(samples)
    integer, intent(in) :: samples
    integer :: turns(samples), i

    turns = [(i - 1, i=1, samples)]
  end function turns

  !> The remaining lines that have whole ratios with the first one.
  subroutine collect(frequency, is_left, part)
    real(wp), intent(in) :: frequency(:)
    logical, intent(in) :: is_left(:)
    type(periodic_t), intent(out) :: part
    integer :: first, k, parts
    real(wp) :: base

    first = findloc(is_left, .true., dim=1)
    base = frequency(first)
    part%line = [first]
    do k = first + 1, size(frequency)
      if (.not. is_left(k)) cycle
      do parts = 1, most_parts   ! of the present base, which becomes smaller
        if (.not. is_whole(frequency(k) / (base / parts))) cycle
        if (max(maxval(frequency(part%line)), frequency(k)) / (base / parts) > most_multiple) exit
        base = base / parts
        part%line = [part%line, k]
        exit
      end do
    end do
    part%multiple = nint(frequency(part%line) / base)
  end subroutine collect

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

  pure subroutine periodic_extremes(part, amplitude, low, high)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(out) :: low, high
    real(wp) :: value(part%samples)
    integer :: k

    if (size(part%line) == 1) then
      high = abs(amplitude(part%line(1)))
      low = -high
      return
    end if
    value = 0.0_wp
    do k = 1, size(part%line)
      value = value + real(amplitude(part%line(k)), wp) * part%cosine(:, k) - aimag(amplitude(part%line(k))) * part%sine(:, k)
    end do
    high = refined(part, amplitude, value, 1.0_wp)
    low = -refined(part, amplitude, value, -1.0_wp)
  end subroutine periodic_extremes

  !> The largest value of sign * function, by Newton's method from all samples that may be next to it.
  pure real(wp) function refined(part, amplitude, value, sign)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: value(:)   !! samples
    real(wp), intent(in) :: sign       !! 1 or -1
    real(wp) :: bend, highest, threshold
    integer :: after, before, i

    highest = maxval(sign * value)
    refined = highest
    ! between samples the function rises by at most half the second derivative times the square of half a spacing
    bend = sum(abs(amplitude(part%line)) * part%multiple**2)
    threshold = highest - 0.5_wp * bend * (pi / part%samples)**2
    do i = 1, part%samples
      if (sign * value(i) < threshold) cycle
      before = modulo(i - 2, part%samples) + 1
      after = modulo(i, part%samples) + 1
      if (sign * value(i) < sign * value(before) .or. sign * value(i) < sign * value(after)) cycle
      refined = max(refined, climbed(part, amplitude, 2.0_wp * pi * (i - 1) / part%samples, sign))
    end do
  end function refined

  pure real(wp) function climbed(part, amplitude, start, sign)
    type(periodic_t), intent(in) :: part
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: start, sign
    integer, parameter :: steps = 8
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
      angle = angle - max(-pi / part%samples, min(pi / part%samples, first / second))
    end do
  end function climbed

end module nocdyn_synthesis
