!> Amplitudes of an order over the speed from a record over the time: computed order tracking.
!>
!> K. R. Fyfe, E. D. S. Munck, Analysis of computed order tracking, Mechanical Systems and Signal Processing 11 (1997) 187-205:
!> the record is sampled again at equal angles, by cubic polynomials, and its Fourier coefficients over some turns are the orders.
!> The turns come from a speed or from pulses. Each amplitude has a Hann window over its turns, and windows overlap by half.
module nocdyn_order_tracking
  use nocdyn_kinds, only: wp
  use nocdyn_resampling, only: sampled_at
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: track_order, turns_of_pulses

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter :: fewest_samples = 8   ! of the record in a period of the order

  !> What says how the body turns.
  type, public :: turning_t
    real(wp), allocatable :: speeds(:)          !! at the times of the record [rad/s]; empty: by pulses
    real(wp), allocatable :: pulses(:)          !! signal of a pickup at these times
    real(wp) :: pulses_per_turn = 1.0_wp
  end type turning_t

contains

  !> Finds the amplitudes.
  subroutine track_order(times, turning, values, order, turns, window_speeds, amplitudes, message)
    real(wp), intent(in) :: times(:)          !! ascending [s]
    type(turning_t), intent(in) :: turning
    real(wp), intent(in) :: values(:)         !! of the record
    real(wp), intent(in) :: order             !! oscillations per turn
    integer, intent(in) :: turns              !! in a window
    real(wp), allocatable, intent(out) :: window_speeds(:)      !! speeds in the windows, with their sign [rad/s]
    real(wp), allocatable, intent(out) :: amplitudes(:)         !! in the unit of the values
    character(len=:), allocatable, intent(out) :: message       !! why there are none; '': there are some
    real(wp), allocatable :: angles(:), at(:), beside(:), sample(:), window(:), wave(:)
    real(wp) :: ends(2), sense
    integer :: i, k, n, samples, windows

    message = ''
    sense = 1.0_wp
    if (size(turning%speeds) > 0) then
      if (any(turning%speeds > 0.0_wp) .and. any(turning%speeds < 0.0_wp)) then
        message = 'the speed changes its sign; orders need one direction'
        return
      end if
      if (any(turning%speeds < 0.0_wp)) sense = -1.0_wp
      call turns_of_speeds(times, abs(turning%speeds), beside, angles)
    else
      call turns_of_pulses(times, turning%pulses, beside)
      if (size(beside) < 4) then
        message = to_text(size(beside)) // ' pulses; needed: 4 at least'
        return
      end if
      allocate (angles(size(beside)))
      angles = [(turn * i / turning%pulses_per_turn, i=0, size(beside) - 1)]
    end if
    windows = int(2.0_wp * (angles(size(angles)) - angles(1)) / (turns * turn)) - 1
    if (windows < 1) then
      message = 'the record has ' // rounded_text((angles(size(angles)) - angles(1)) / turn, 3) // ' turns; needed: ' // &
                to_text(turns) // ' at least, by turns'
      return
    end if
    allocate (window_speeds(windows), amplitudes(windows))
    n = 0
    do k = 1, windows
      ends = angles(1) + 0.5_wp * turns * turn * [k - 1, k + 1]
      ends = sampled_at(angles, beside, ends)
      samples = count(times >= ends(1) .and. times < ends(2))
      if (samples < fewest_samples * order * turns) cycle   ! too fast for the record
      samples = max(2 * samples, 64)   ! more than the record has, which then has no alias
      allocate (at(samples), sample(samples), window(samples), wave(samples))
      wave = [(turns * turn * i / samples, i=0, samples - 1)]
      at = sampled_at(angles, beside, angles(1) + 0.5_wp * turns * turn * (k - 1) + wave)
      sample = sampled_at(times, values, at)
      window = 1.0_wp - cos(wave / turns)
      n = n + 1
      associate (step => wave(3) - wave(1), weight => window(2:samples - 1))   ! the speed has the same window
        window_speeds(n) = sense * sum(weight * step / (at(3:) - at(:samples - 2))) / sum(weight)
      end associate
      amplitudes(n) = 2.0_wp * hypot(sum(window * sample * cos(order * wave)), sum(window * sample * sin(order * wave))) / &
                      sum(window)
      deallocate (at, sample, window, wave)
    end do
    if (n == 0) message = 'the record has fewer than ' // to_text(fewest_samples) // ' values in a period of the order'
    window_speeds = window_speeds(:n)
    amplitudes = amplitudes(:n)
  end subroutine track_order

  !> The angles at those times at which it turns.
  subroutine turns_of_speeds(times, speeds, at, angles)
    real(wp), intent(in) :: times(:)    !! ascending [s]
    real(wp), intent(in) :: speeds(:)   !! not negative [rad/s]
    real(wp), allocatable, intent(out) :: at(:), angles(:)   !! ascending [s, rad]
    real(wp) :: sum_of(size(times))
    integer :: i
    logical :: turns(size(times))

    sum_of(1) = 0.0_wp
    turns(1) = .true.
    do i = 2, size(times)
      sum_of(i) = sum_of(i - 1) + 0.5_wp * (speeds(i - 1) + speeds(i)) * (times(i) - times(i - 1))
      turns(i) = sum_of(i) > sum_of(i - 1)
    end do
    allocate (at, source=pack(times, turns))
    allocate (angles, source=pack(sum_of, turns))
  end subroutine turns_of_speeds

  !> Times of the pulses: where the signal rises through its middle, after it was in its lower quarter.
  subroutine turns_of_pulses(times, signal, edges)
    real(wp), intent(in) :: times(:)      !! ascending [s]
    real(wp), intent(in) :: signal(:)     !! [times]
    real(wp), allocatable, intent(out) :: edges(:)   !! [s]
    real(wp) :: found(size(times)), low, middle
    integer :: i, n
    logical :: was_low

    middle = 0.5_wp * (minval(signal) + maxval(signal))
    low = 0.5_wp * (minval(signal) + middle)
    was_low = .false.
    n = 0
    do i = 2, size(times)
      was_low = was_low .or. signal(i - 1) < low
      if (.not. was_low .or. signal(i) < middle .or. signal(i - 1) >= middle) cycle
      n = n + 1
      found(n) = times(i - 1) + (times(i) - times(i - 1)) * (middle - signal(i - 1)) / (signal(i) - signal(i - 1))
      was_low = .false.
    end do
    allocate (edges, source=found(:n))
  end subroutine turns_of_pulses

end module nocdyn_order_tracking
