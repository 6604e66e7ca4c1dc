!> Taylor series of the elements of a machine: of their angles, speeds and moments, on a block of lanes.
!>
!> Products of series are sums over pairs of coefficients, f_j g_(k-j); they are formed only for the elements whose laws
!> have such terms, which are copied beside each other. The sums begin in the middle, with the pairs that have been
!> known for longest, and end with the newest coefficients, so that a processor need not wait for those.
!>
!> All arrays are filled up with zeros to whole vectors: every number goes through the same operations wherever it stands.
module nocdyn_element_series
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: new_element_series, whole_vectors, expand_polynomials, add_moments, integrate_powers

  integer, parameter :: width = 4   !! of a vector

  !> The values that have a term of higher degree, beside each other.
  type :: power_t
    integer :: values = 0
    integer, allocatable :: place(:)               !! among all values, [values]
    real(wp), allocatable :: factor(:)             !! [values]
    real(wp), allocatable :: base(:, :)            !! series of what is raised, [whole vectors, 0:last]
    real(wp), allocatable :: square(:, :)          !! of its square
    real(wp), allocatable :: cube(:)               !! present coefficients of its cube, [whole vectors]
  end type power_t

  !> Column k of an array holds the coefficients number k: the k-th derivatives over k factorial.
  type, public :: element_series_t
    integer :: last = 0                            !! number of the last coefficients
    integer :: stride = 0                          !! lanes * elements in whole vectors
    real(wp), allocatable :: angle(:, :)           !! u, [stride, 0:last] as all these
    real(wp), allocatable :: speed(:, :)           !! u'
    real(wp), allocatable :: restoring(:, :)       !! as in `elements_t`
    real(wp), allocatable :: working(:, :)
    real(wp), allocatable :: external(:, :)        !! what of `working` depends on the time alone
    real(wp), allocatable :: moment(:)             !! present coefficients of the whole moments, [stride]
    real(wp), allocatable :: inverse(:)            !! 1 / k, [last + 1]
    real(wp), allocatable, private :: rest(:)      !! as in `polynomial_laws_t`, [stride]
    real(wp), allocatable, private :: linear(:)
    real(wp), allocatable, private :: by_speed(:)
    type(power_t), private :: cubed                !! terms by the cube of u - rest
    type(power_t), private :: squared              !! terms by the square of u'
  end type element_series_t

contains

  !> Room for the series of the elements with the given laws, and the constant torques.
  function new_element_series(laws, order) result(self)
    type(polynomial_laws_t), intent(in) :: laws
    integer, intent(in) :: order   !! of the series of the state
    type(element_series_t) :: self
    integer :: k

    self%last = order - 1
    self%stride = whole_vectors(size(laws%rest))
    allocate (self%angle(self%stride, 0:self%last), source=0.0_wp)
    allocate (self%speed, self%restoring, self%working, self%external, source=self%angle)
    allocate (self%moment(self%stride), source=0.0_wp)
    allocate (self%rest, self%linear, self%by_speed, source=self%moment)
    allocate (self%inverse(order))
    self%inverse(:) = [(1.0_wp / k, k=1, order)]
    associate (values => size(laws%rest))
      self%rest(:values) = reshape(laws%rest, [values])
      self%linear(:values) = reshape(laws%linear, [values])
      self%by_speed(:values) = reshape(laws%by_speed, [values])
      self%external(:values, 0) = reshape(laws%constant, [values])
    end associate
    self%cubed = new_power(laws%cubic, self%last)
    self%squared = new_power(laws%by_speed_squared, self%last)
  end function new_element_series

  !> The values of all lanes of the elements that have a coefficient in any lane.
  function new_power(coefficient, last) result(self)
    real(wp), intent(in) :: coefficient(:, :)   !! [lanes, elements]
    integer, intent(in) :: last
    type(power_t) :: self
    integer :: e, l

    allocate (self%place(count(any(abs(coefficient) > 0, dim=1)) * size(coefficient, 1)))
    allocate (self%factor(size(self%place)))
    do e = 1, size(coefficient, 2)
      if (.not. any(abs(coefficient(:, e)) > 0)) cycle
      do l = 1, size(coefficient, 1)
        self%values = self%values + 1
        self%place(self%values) = (e - 1) * size(coefficient, 1) + l
        self%factor(self%values) = coefficient(l, e)
      end do
    end do
    allocate (self%base(whole_vectors(self%values), 0:last), source=0.0_wp)
    allocate (self%square, source=self%base)
    allocate (self%cube(size(self%base, 1)), source=0.0_wp)
  end function new_power

  !> The length of so many numbers in whole vectors.
  pure integer function whole_vectors(values)
    integer, intent(in) :: values

    whole_vectors = width * ((values + width - 1) / width)
  end function whole_vectors

  !> The coefficients number k of the angles, unless k is 0, and of the moments by the polynomial laws, from the
  !> coefficients of the speeds up to k.
  subroutine expand_polynomials(series, k)
    type(element_series_t), intent(inout) :: series
    integer, intent(in) :: k

    associate (n => series%stride)
      if (k == 0) then
        call begin_moments(n, series%rest, series%linear, series%by_speed, series%external, series%angle, series%speed, &
                           series%restoring, series%working)
      else
        call linear_moments(n, k, series%inverse(k), series%linear, series%by_speed, series%external, series%speed, &
                            series%angle, series%restoring, series%working)
      end if
      if (series%cubed%values > 0) call add_cubes(series%cubed, n, k, series%rest, series%angle, series%restoring)
      if (series%squared%values > 0) call add_squares(series%squared, n, k, series%speed, series%working)
    end associate
  end subroutine expand_polynomials

  !> The moments themselves, without the terms of higher degree.
  pure subroutine begin_moments(n, rest, linear, by_speed, external, angle, speed, restoring, working)
    integer, intent(in) :: n
    real(wp), intent(in), dimension(n) :: rest, linear, by_speed, external, angle, speed
    real(wp), intent(inout) :: restoring(n), working(n)

    restoring = -linear * (angle - rest)
    working = external + by_speed * speed
  end subroutine begin_moments

  pure subroutine linear_moments(n, k, inverse, linear, by_speed, external, speed, angle, restoring, working)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: inverse   !! 1 / k
    real(wp), intent(in) :: linear(n), by_speed(n), external(n, 0:k), speed(n, 0:k)
    real(wp), intent(inout) :: angle(n, 0:k), restoring(n, 0:k), working(n, 0:k)
    integer :: i

    do i = 1, n, width
      associate (j => i + width - 1)
        angle(i:j, k) = inverse * speed(i:j, k - 1)
        restoring(i:j, k) = -linear(i:j) * angle(i:j, k)
        working(i:j, k) = external(i:j, k) + by_speed(i:j) * speed(i:j, k)
      end associate
    end do
  end subroutine linear_moments

  !> Adds -cubic (u - rest)^3.
  subroutine add_cubes(power, n, k, rest, angle, restoring)
    type(power_t), intent(inout) :: power
    integer, intent(in) :: n, k
    real(wp), intent(in) :: rest(n), angle(n, 0:k)
    real(wp), intent(inout) :: restoring(n, 0:k)
    integer :: i

    do i = 1, power%values
      power%base(i, k) = angle(power%place(i), k)
      if (k == 0) power%base(i, k) = power%base(i, k) - rest(power%place(i))
    end do
    call square(size(power%base, 1), k, power%base, power%square(1, k))
    call multiply(size(power%base, 1), k, power%base, power%square, power%cube)
    do i = 1, power%values
      restoring(power%place(i), k) = restoring(power%place(i), k) - power%factor(i) * power%cube(i)
    end do
  end subroutine add_cubes

  !> Adds by_speed_squared u'^2.
  subroutine add_squares(power, n, k, speed, working)
    type(power_t), intent(inout) :: power
    integer, intent(in) :: n, k
    real(wp), intent(in) :: speed(n, 0:k)
    real(wp), intent(inout) :: working(n, 0:k)
    integer :: i

    do i = 1, power%values
      power%base(i, k) = speed(power%place(i), k)
    end do
    call square(size(power%base, 1), k, power%base, power%square(1, k))
    do i = 1, power%values
      working(power%place(i), k) = working(power%place(i), k) + power%factor(i) * power%square(i, k)
    end do
  end subroutine add_squares

  !> The coefficients number k of f^2, each pair of different coefficients counted once and doubled.
  pure subroutine square(n, k, f, f2)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: f(n, 0:k)
    real(wp), intent(inout) :: f2(n)
    real(wp) :: sum(width)
    integer :: i, j

    do i = 1, n, width
      sum = 0.0_wp
      do j = (k + 1) / 2 - 1, 0, -1
        sum = sum + f(i:i + width - 1, j) * f(i:i + width - 1, k - j)
      end do
      sum = sum + sum
      if (modulo(k, 2) == 0) sum = sum + f(i:i + width - 1, k / 2) * f(i:i + width - 1, k / 2)
      f2(i:i + width - 1) = sum
    end do
  end subroutine square

  !> The coefficients number k of f g.
  pure subroutine multiply(n, k, f, g, fg)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: f(n, 0:k), g(n, 0:k)
    real(wp), intent(inout) :: fg(n)
    real(wp) :: sum(width)
    integer :: i, j

    do i = 1, n, width
      sum = 0.0_wp
      if (modulo(k, 2) == 0) sum = f(i:i + width - 1, k / 2) * g(i:i + width - 1, k / 2)
      do j = (k + 1) / 2 - 1, 0, -1
        sum = sum + (f(i:i + width - 1, j) * g(i:i + width - 1, k - j) + f(i:i + width - 1, k - j) * g(i:i + width - 1, j))
      end do
      fg(i:i + width - 1) = sum
    end do
  end subroutine multiply

  !> The coefficients number k of the whole moments.
  subroutine add_moments(series, k)
    type(element_series_t), intent(inout) :: series
    integer, intent(in) :: k

    call add(series%stride, series%restoring(1, k), series%working(1, k), series%moment)
  end subroutine add_moments

  pure subroutine add(n, x, y, sum)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), y(n)
    real(wp), intent(inout) :: sum(n)
    integer :: i

    do i = 1, n, width
      sum(i:i + width - 1) = x(i:i + width - 1) + y(i:i + width - 1)
    end do
  end subroutine add

  !> The coefficients number k + 1 of the works of the accounted elements, whose powers are `working` times the speed.
  pure subroutine integrate_powers(series, k, lanes, accounted, work)
    type(element_series_t), intent(in) :: series
    integer, intent(in) :: k, lanes
    integer, intent(in) :: accounted(:)   !! elements
    real(wp), intent(inout) :: work(lanes, size(accounted))
    integer :: a, first, j, l

    do a = 1, size(accounted)
      first = (accounted(a) - 1) * lanes
      do l = 1, lanes
        work(l, a) = 0.0_wp
      end do
      do j = 0, k
        do l = 1, lanes
          work(l, a) = work(l, a) + series%working(first + l, j) * series%speed(first + l, k - j)
        end do
      end do
      do l = 1, lanes
        work(l, a) = series%inverse(k + 1) * work(l, a)
      end do
    end do
  end subroutine integrate_powers

end module nocdyn_element_series
