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
    first = differentiated(self%series(:, column:column))
    slopes(:n - 1) = [(value_of(first(:, 1), turn * i / n), i=0, n - 1)]
    slopes(n) = slopes(0)
    allocate (turning(0))
    do i = 0, n - 1
      if (slopes(i) * slopes(i + 1) > 0 .or. .not. abs(slopes(i + 1)) > 0) cycle
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

  !> The highest value: samples near to the highest one are followed to the maximum beside them.
  pure real(wp) function highest_of(samples, series) result(highest)
    real(wp), intent(in) :: samples(:), series(:)
    real(wp) :: first(size(series), 1), second(size(series), 1), slope, step, tau
    integer :: i, k, n

    n = size(samples)
    highest = maxval(samples)
    if (.not. highest > minval(samples)) return
    first = differentiated(reshape(series, [size(series), 1]))
    second = differentiated(first)
    associate (bound => highest - near * (highest - minval(samples)))
      do i = 1, n
        if (samples(i) < bound .or. samples(i) < samples(modulo(i, n) + 1) .or. samples(i) < samples(modulo(i - 2, n) + 1)) cycle
        tau = turn * (i - 1) / n
        do k = 1, iterations
          slope = value_of(second(:, 1), tau)
          if (.not. slope < 0) exit
          step = -value_of(first(:, 1), tau) / slope
          tau = tau + min(max(step, -turn / n), turn / n)
        end do
        highest = max(highest, value_of(series, tau))
      end do
    end associate
  end function highest_of

  !> The value of a series.
  pure real(wp) function value_of(series, tau) result(value)
    real(wp), intent(in) :: series(:), tau
    integer :: k

    value = series(1)
    do k = 1, size(series) / 2
      value = value + series(2 * k) * cos(k * tau) + series(2 * k + 1) * sin(k * tau)
    end do
  end function value_of

end module nocdyn_signal_samples
