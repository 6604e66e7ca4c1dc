!> The turning points of a sum of oscillations over the time.
module nocdyn_turning_points
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: list_turning_points

  real(wp), parameter :: pi = acos(-1.0_wp)
  integer, parameter :: samples_per_period = 24   ! of the highest frequency: two turns between samples differ by 1e-3 of it
  integer, parameter :: most_samples = 100000
  integer, parameter :: samples_in_a_row = 256    ! before the phase is computed anew

contains

  !> The turning points of the sum of Re(amplitude exp(i frequency t)) for t from 0 to the duration. The duration is shortened if
  !> it has too many periods of the highest frequency. A period begins and ends with its largest value.
  subroutine list_turning_points(frequency, amplitude, is_period, duration, turns)
    real(wp), intent(in) :: frequency(:)      !! positive [rad/s], [lines]
    complex(wp), intent(in) :: amplitude(:)   !! [lines]
    logical, intent(in) :: is_period          !! whether the sum repeats after the duration
    real(wp), intent(inout) :: duration       !! [s]
    real(wp), allocatable, intent(out) :: turns(:)
    real(wp), allocatable :: list(:), value(:)
    real(wp) :: step
    integer :: count, i, samples

    samples = max(samples_per_period, ceiling(min(1.0_wp * most_samples, &
                                                  samples_per_period * duration * maxval(frequency) / (2.0_wp * pi))))
    if (.not. is_period) duration = min(duration, samples * 2.0_wp * pi / (samples_per_period * maxval(frequency)))
    step = duration / samples
    allocate (value(-1:samples + 1), list(samples + 1))
    call sample(frequency, amplitude, step, value)
    count = 0
    do i = 0, samples - 1
      if ((value(i) - value(i - 1)) * (value(i + 1) - value(i)) > 0) cycle
      if (.not. abs(value(i) - value(i - 1)) > 0) cycle
      count = count + 1
      list(count) = turn_near(frequency, amplitude, i * step, step, value(i - 1:i + 1))
    end do
    allocate (turns, source=list(:count))
    if (.not. is_period .or. count == 0) return
    turns = cshift(turns, maxloc(turns, dim=1) - 1)
    turns = [turns, turns(1)]
  end subroutine list_turning_points

  !> The sum at equal steps from one before the start on.
  pure subroutine sample(frequency, amplitude, step, value)
    real(wp), intent(in) :: frequency(:)
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: step         !! [s]
    real(wp), intent(out) :: value(-1:)
    complex(wp) :: oscillation, rotation
    integer :: first, i, l

    value = 0.0_wp
    do l = 1, size(frequency)
      rotation = exp(cmplx(0.0_wp, frequency(l) * step, wp))
      do first = -1, ubound(value, 1), samples_in_a_row
        oscillation = amplitude(l) * exp(cmplx(0.0_wp, frequency(l) * first * step, wp))
        do i = first, min(first + samples_in_a_row - 1, ubound(value, 1))
          value(i) = value(i) + real(oscillation, wp)
          oscillation = oscillation * rotation
        end do
      end do
    end do
  end subroutine sample

  !> The extreme next to a sample, by Newton's method from the vertex of the parabola through the sample and its neighbours.
  pure real(wp) function turn_near(frequency, amplitude, time, step, value) result(turn)
    real(wp), intent(in) :: frequency(:)
    complex(wp), intent(in) :: amplitude(:)
    real(wp), intent(in) :: time, step   !! of the sample [s]
    real(wp), intent(in) :: value(3)     !! before, at and after it
    integer, parameter :: most_steps = 4
    real(wp), parameter :: near = 1.0e-6_wp   ! in steps: the error of the turn is of its square
    complex(wp) :: term
    real(wp) :: bend, change, first, second, t
    integer :: k, l

    turn = value(2)
    bend = value(1) - 2.0_wp * value(2) + value(3)
    if (.not. abs(bend) > 0) return
    t = time + 0.5_wp * step * (value(1) - value(3)) / bend
    do k = 1, most_steps
      turn = 0.0_wp
      first = 0.0_wp
      second = 0.0_wp
      do l = 1, size(frequency)
        term = amplitude(l) * exp(cmplx(0.0_wp, frequency(l) * t, wp))
        turn = turn + real(term, wp)
        first = first - frequency(l) * aimag(term)
        second = second - frequency(l)**2 * real(term, wp)
      end do
      if (.not. second * bend > 0) return
      change = -first / second
      if (abs(change) <= near * step) return
      t = max(time - step, min(time + step, t + change))
    end do
  end function turn_near

end module nocdyn_turning_points
