!> Columns of signals sampled at even times over one period of a motion, and the trigonometric polynomials through them.
module nocdyn_signal_samples
  use nocdyn_brackets, only: bracket_t, new_bracket
  use nocdyn_harmonic_basis, only: differentiated
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  type, public :: signal_samples_t
    real(wp), allocatable :: t(:)           !! [s], [samples]
    real(wp), allocatable :: values(:, :)   !! angles without the mean rotation, [samples, columns], in SI units
    real(wp), allocatable :: rotation(:)    !! mean speed of the columns that are angles, else 0 [rad/s]
    real(wp), allocatable :: series(:, :)   !! coefficients as of `harmonic_basis_t`, [length, columns]
    integer :: harmonics = 0                !! that are told of; there may be more coefficients
    logical :: has_kinks = .false.          !! whether columns may have kinks and jumps, which polynomials overshoot
  contains
    procedure :: find_extremes, amplitude, list_turning_values
  end type signal_samples_t

  integer, parameter :: iterations = 6        ! at an extreme
  real(wp), parameter :: near = 0.1_wp        ! samples so near to the extreme, as a share of the range, may be beside it
  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)

contains

  !> The lowest and the highest value of a column.
  subroutine find_extremes(self, column, lowest, highest)
    class(signal_samples_t), intent(in) :: self
    integer, intent(in) :: column
    real(wp), intent(out) :: lowest, highest

    associate (values => self%values(:, column), series => self%series(:, column))
      highest = highest_of(values, series)
      lowest = -highest_of(-values, -series)
    end associate
  end subroutine find_extremes

  !> The amplitude of a harmonic of a column.
  pure real(wp) function amplitude(self, column, harmonic)
    class(signal_samples_t), intent(in) :: self
    integer, intent(in) :: column, harmonic   !! from 1 on

    amplitude = 0.0_wp
    if (2 * harmonic < size(self%series, 1)) amplitude = hypot(self%series(2 * harmonic, column), &
                                                               self%series(2 * harmonic + 1, column))
  end function amplitude

  !> The values at which a column turns over one period, from the largest one to itself: whole cycles.
  subroutine list_turning_values(self, column, turning)
    class(signal_samples_t), intent(in) :: self
    integer, intent(in) :: column
    real(wp), allocatable, intent(out) :: turning(:)
    real(wp) :: first(size(self%series, 1), 1), slopes(0:size(self%t))
    integer :: i, n

    n = size(self%t)
    allocate (turning(0))
    if (self%has_kinks) then
      slopes = [self%values(:, column), self%values(1, column)] - [self%values(n, column), self%values(:, column)]
    else
      first = differentiated(self%series(:, column:column))
      slopes(:n - 1) = [(value_of(first(:, 1), turn * i / n), i=0, n - 1)]
      slopes(n) = slopes(0)
    end if
    do i = 0, n - 1
      if (slopes(i) * slopes(i + 1) > 0 .or. .not. abs(slopes(i + 1)) > 0) cycle
      if (self%has_kinks) then
        turning = [turning, self%values(i + 1, column)]
        cycle
      end if
      turning = [turning, value_of(self%series(:, column), turning_place(first(:, 1), turn * i / n, turn / n, slopes(i:i + 1)))]
    end do
    if (size(turning) == 0) turning = [self%series(1, column)]
    i = maxloc(turning, dim=1)
    turning = [turning(i:), turning(:i)]
  end subroutine list_turning_values

  !> Where a slope vanishes between two samples.
  pure real(wp) function turning_place(first, from, width, slopes) result(tau)
    real(wp), intent(in) :: first(:)       !! series of the slope
    real(wp), intent(in) :: from, width    !! [rad]
    real(wp), intent(in) :: slopes(2)      !! at both samples, of different signs
    type(bracket_t) :: bracket
    integer :: k

    bracket = new_bracket([from, from + width], slopes)
    do k = 1, iterations
      if (bracket%is_narrow()) exit
      tau = bracket%next()
      call bracket%narrow(tau, value_of(first, tau))
    end do
    tau = bracket%root()
  end function turning_place

  !> The highest value: samples near to the highest one are followed to the maximum beside them, if a parabola through them and
  !> their neighbours is about as high as what has been found.
  pure real(wp) function highest_of(samples, series) result(highest)
    real(wp), intent(in) :: samples(:), series(:)
    real(wp), parameter :: settled = 1.0e-9_wp   ! the next step is about its square [rad]
    real(wp), parameter :: doubt = 2.0_wp        ! the height above the sample may be so many times that of the parabola
    real(wp) :: bend, course(0:2), gain, place, slope, step, tau
    integer :: first, i, k, n, offset

    n = size(samples)
    first = maxloc(samples, dim=1)
    highest = samples(first)
    if (.not. highest > minval(samples)) return
    associate (bound => highest - near * (highest - minval(samples)))
      do offset = 0, n - 1
        i = modulo(first - 1 + offset, n) + 1
        if (samples(i) < bound) cycle
        associate (before => samples(modulo(i - 2, n) + 1), after => samples(modulo(i, n) + 1))
          if (samples(i) < before .or. samples(i) < after) cycle
          slope = 0.5_wp * (after - before)
          bend = 2.0_wp * samples(i) - before - after
        end associate
        place = 0.0_wp
        gain = 0.0_wp
        if (bend > 0) then
          place = slope / bend
          gain = 0.5_wp * slope * place
        end if
        if (offset > 0 .and. samples(i) + doubt * gain < highest) cycle
        tau = turn * (i - 1 + place) / n
        do k = 1, iterations
          course = course_of(series, tau)
          highest = max(highest, course(0))
          if (.not. course(2) < 0) exit
          step = min(max(-course(1) / course(2), -turn / n), turn / n)
          if (abs(step) < settled) exit
          tau = tau + step
        end do
      end do
    end associate
  end function highest_of

  !> The value of a series.
  pure real(wp) function value_of(series, tau) result(value)
    real(wp), intent(in) :: series(:), tau
    complex(wp) :: turned, unit
    integer :: k

    unit = cmplx(cos(tau), sin(tau), wp)
    turned = 1.0_wp
    value = series(1)
    do k = 1, size(series) / 2
      turned = turned * unit
      value = value + series(2 * k) * turned%re + series(2 * k + 1) * turned%im
    end do
  end function value_of

  !> The value, the slope and the curvature of a series.
  pure function course_of(series, tau) result(course)
    real(wp), intent(in) :: series(:), tau
    real(wp) :: course(0:2)
    complex(wp) :: turned, unit
    real(wp) :: value
    integer :: k

    unit = cmplx(cos(tau), sin(tau), wp)
    turned = 1.0_wp
    course = [series(1), 0.0_wp, 0.0_wp]
    do k = 1, size(series) / 2
      turned = turned * unit
      value = series(2 * k) * turned%re + series(2 * k + 1) * turned%im
      course(0) = course(0) + value
      course(1) = course(1) + k * (series(2 * k + 1) * turned%re - series(2 * k) * turned%im)
      course(2) = course(2) - k**2 * value
    end do
  end function course_of

end module nocdyn_signal_samples
