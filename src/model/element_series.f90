!> Taylor series of the elements of a machine: of their angles, speeds and moments, on a block of lanes.
!>
!> Products of series are sums over pairs of coefficients, f_j g_(k-j); they are formed only for the elements whose laws
!> have such terms, which are copied beside each other. The sums begin in the middle, with the pairs that have been
!> known for longest, and end with the newest coefficients, so that a processor need not wait for those.
module nocdyn_element_series
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: new_element_series, polynomial_series, integrate_powers

  !> Column k of the arrays holds the coefficients number k: the k-th derivative over k factorial.
  type, public :: element_series_t
    integer :: values = 0                          !! lanes * elements
    real(wp), allocatable :: angle(:, :)           !! u, [values, 0:order - 1] as all these
    real(wp), allocatable :: speed(:, :)           !! u'
    real(wp), allocatable :: restoring(:, :)       !! as in `elements_t`
    real(wp), allocatable :: working(:, :)
    real(wp), allocatable :: inverse(:)            !! 1 / k, [order]
    integer, allocatable, private :: cubed(:)      !! places of the values with a cubic term
    real(wp), allocatable, private :: w(:, :)      !! their u - rest, [cubed, 0:order - 1]
    real(wp), allocatable, private :: w2(:, :)     !! its square
    real(wp), allocatable, private :: w3(:)        !! the present coefficients of its cube
    integer, allocatable, private :: squared(:)    !! places of the values with a term by the square of the speed
    real(wp), allocatable, private :: s(:, :)      !! their u', [squared, 0:order - 1]
    real(wp), allocatable, private :: s2(:)        !! the present coefficients of its square
  end type element_series_t

contains

  !> Room for the series of the elements with the given laws.
  function new_element_series(laws, order) result(self)
    type(polynomial_laws_t), intent(in) :: laws
    integer, intent(in) :: order   !! of the series of the state
    type(element_series_t) :: self
    integer :: k

    self%values = size(laws%rest)
    allocate (self%angle(self%values, 0:order - 1), source=0.0_wp)
    allocate (self%speed, self%restoring, self%working, source=self%angle)
    allocate (self%inverse(order))
    self%inverse(:) = [(1.0_wp / k, k=1, order)]
    self%cubed = values_of(laws%cubic)
    self%squared = values_of(laws%by_speed_squared)
    allocate (self%w(size(self%cubed), 0:order - 1), self%w2(size(self%cubed), 0:order - 1), self%w3(size(self%cubed)), &
              self%s(size(self%squared), 0:order - 1), self%s2(size(self%squared)), source=0.0_wp)
  end function new_element_series

  !> The places of all lanes of the elements that have a coefficient in any lane.
  function values_of(coefficient) result(places)
    real(wp), intent(in) :: coefficient(:, :)   !! [lanes, elements]
    integer, allocatable :: places(:)
    integer :: e, l

    allocate (places(0))
    do e = 1, size(coefficient, 2)
      if (.not. any(abs(coefficient(:, e)) > 0)) cycle
      places = [places, [((e - 1) * size(coefficient, 1) + l, l=1, size(coefficient, 1))]]
    end do
  end function values_of

  !> The coefficients number k of the moments by the polynomial laws, from those of angles and speeds up to k.
  subroutine polynomial_series(laws, k, series)
    type(polynomial_laws_t), intent(in) :: laws
    integer, intent(in) :: k
    type(element_series_t), intent(inout) :: series

    if (k == 0) then
      call begin_moments(series%values, laws%rest, laws%linear, laws%constant, laws%by_speed, series%angle, series%speed, &
                         series%restoring, series%working)
    else
      call linear_moments(series%values, laws%linear, laws%by_speed, series%angle(1, k), series%speed(1, k), &
                          series%restoring(1, k), series%working(1, k))
    end if
    if (size(series%cubed) > 0) then
      call add_cubes(series%values, size(series%cubed), k, series%cubed, laws%rest, laws%cubic, series%angle(1, k), &
                     series%w, series%w2, series%w3, series%restoring(1, k))
    end if
    if (size(series%squared) > 0) then
      call add_squares(series%values, size(series%squared), k, series%squared, laws%by_speed_squared, series%speed(1, k), &
                       series%s, series%s2, series%working(1, k))
    end if
  end subroutine polynomial_series

  !> The moments themselves without the terms of higher degree.
  pure subroutine begin_moments(n, rest, linear, constant, by_speed, angle, speed, restoring, working)
    integer, intent(in) :: n   !! lanes * elements
    real(wp), intent(in), dimension(n) :: rest, linear, constant, by_speed, angle, speed
    real(wp), intent(inout) :: restoring(n), working(n)
    integer :: i

    do i = 1, n
      restoring(i) = -linear(i) * (angle(i) - rest(i))
      working(i) = constant(i) + by_speed(i) * speed(i)
    end do
  end subroutine begin_moments

  pure subroutine linear_moments(n, linear, by_speed, angle, speed, restoring, working)
    integer, intent(in) :: n   !! lanes * elements
    real(wp), intent(in), dimension(n) :: linear, by_speed, angle, speed
    real(wp), intent(inout) :: restoring(n), working(n)
    integer :: i

    do i = 1, n
      restoring(i) = -linear(i) * angle(i)
      working(i) = by_speed(i) * speed(i)
    end do
  end subroutine linear_moments

  !> Adds -cubic w^3.
  pure subroutine add_cubes(values, n, k, place, rest, cubic, angle, w, w2, w3, restoring)
    integer, intent(in) :: values, n, k
    integer, intent(in) :: place(n)
    real(wp), intent(in) :: rest(values), cubic(values), angle(values)
    real(wp), intent(inout) :: w(n, 0:k), w2(n, 0:k), w3(n)
    real(wp), intent(inout) :: restoring(values)
    integer :: i

    do i = 1, n
      w(i, k) = angle(place(i))
      if (k == 0) w(i, k) = w(i, k) - rest(place(i))
    end do
    call square(n, k, w, w2(:, k))
    call multiply(n, k, w, w2, w3)
    do i = 1, n
      restoring(place(i)) = restoring(place(i)) - cubic(place(i)) * w3(i)
    end do
  end subroutine add_cubes

  !> Adds by_speed_squared u'^2.
  pure subroutine add_squares(values, n, k, place, by_speed_squared, speed, s, s2, working)
    integer, intent(in) :: values, n, k
    integer, intent(in) :: place(n)
    real(wp), intent(in) :: by_speed_squared(values), speed(values)
    real(wp), intent(inout) :: s(n, 0:k), s2(n)
    real(wp), intent(inout) :: working(values)
    integer :: i

    do i = 1, n
      s(i, k) = speed(place(i))
    end do
    call square(n, k, s, s2)
    do i = 1, n
      working(place(i)) = working(place(i)) + by_speed_squared(place(i)) * s2(i)
    end do
  end subroutine add_squares

  !> The coefficients number k of f^2, each pair of different coefficients counted once and doubled.
  pure subroutine square(n, k, f, f2)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: f(n, 0:k)
    real(wp), intent(inout) :: f2(n)
    real(wp) :: sum
    integer :: i, j

    if (n == 1) then
      sum = 0.0_wp
      do j = (k + 1) / 2 - 1, 0, -1
        sum = sum + f(1, j) * f(1, k - j)
      end do
      f2(1) = 2 * sum
      if (modulo(k, 2) == 0) f2(1) = f2(1) + f(1, k / 2)**2
      return
    end if
    f2 = 0.0_wp
    do j = (k + 1) / 2 - 1, 0, -1
      do i = 1, n
        f2(i) = f2(i) + f(i, j) * f(i, k - j)
      end do
    end do
    f2 = 2 * f2
    if (modulo(k, 2) == 0) f2 = f2 + f(:, k / 2)**2
  end subroutine square

  !> The coefficients number k of f g.
  pure subroutine multiply(n, k, f, g, fg)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: f(n, 0:k), g(n, 0:k)
    real(wp), intent(inout) :: fg(n)
    real(wp) :: sum
    integer :: i, j

    if (n == 1) then
      sum = 0.0_wp
      if (modulo(k, 2) == 0) sum = f(1, k / 2) * g(1, k / 2)
      do j = (k + 1) / 2 - 1, 0, -1
        sum = sum + (f(1, j) * g(1, k - j) + f(1, k - j) * g(1, j))
      end do
      fg(1) = sum
      return
    end if
    fg = 0.0_wp
    if (modulo(k, 2) == 0) fg = f(:, k / 2) * g(:, k / 2)
    do j = (k + 1) / 2 - 1, 0, -1
      do i = 1, n
        fg(i) = fg(i) + (f(i, j) * g(i, k - j) + f(i, k - j) * g(i, j))
      end do
    end do
  end subroutine multiply

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
