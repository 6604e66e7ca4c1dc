!> The recurrence of Taylor series on blocks of lanes, element by element and row by row: the loops of `lane_series_t`.
!>
!> The sums of products begin in the middle, with the pairs of coefficients that have been known for longest, as those of
!> `nocdyn_reduced_series` do. Their strips of lanes stay in registers; in a module of their own compilers do not mix these
!> loops with those that call them.
module nocdyn_series_products
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: begin_speeds, continue_speeds, add_linear, add_cubic, add_square, accelerate_row

  integer, parameter, public :: strip = 32   !! lanes that stay in registers; their number is a multiple of it

contains

  !> The moments that depend on the speed, number 0.
  pure subroutine begin_speeds(lanes, constant, by_speed, speed, moment)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: constant(lanes), by_speed(lanes), speed(lanes)
    real(wp), intent(inout) :: moment(lanes)
    integer :: l

    do l = 1, lanes
      moment(l) = constant(l) + by_speed(l) * speed(l)
    end do
  end subroutine begin_speeds

  !> The speeds of an element, from the entries `first` to `last` of U, and the moments that depend on them, number k > 0.
  pure subroutine continue_speeds(lanes, freedoms, entries, first, last, column, ratio, q, by_speed, speed, moment)
    integer, intent(in) :: lanes, freedoms, entries, first, last
    integer, intent(in) :: column(entries)
    real(wp), intent(in) :: ratio(lanes, entries)
    real(wp), intent(in) :: q(lanes, freedoms)   !! coefficients of q'
    real(wp), intent(in) :: by_speed(lanes)
    real(wp), intent(inout) :: speed(lanes), moment(lanes)
    integer :: c, d, k, l

    select case (last - first)
    case (0)
      c = column(first)
      do l = 1, lanes
        speed(l) = ratio(l, first) * q(l, c)
        moment(l) = by_speed(l) * speed(l)
      end do
    case (1)
      c = column(first)
      d = column(last)
      do l = 1, lanes
        speed(l) = ratio(l, first) * q(l, c) + ratio(l, last) * q(l, d)
        moment(l) = by_speed(l) * speed(l)
      end do
    case default
      speed = 0.0_wp
      do k = first, last
        c = column(k)
        speed = speed + ratio(:, k) * q(:, c)
      end do
      moment = by_speed * speed
    end select
  end subroutine continue_speeds

  !> Coefficient k of w, for k > 0 from coefficient k - 1 of the speed, and what -linear w adds to the moments.
  pure subroutine add_linear(lanes, k, inverse, linear, speed, w, moment)
    integer, intent(in) :: lanes, k
    real(wp), intent(in) :: inverse   !! 1 / k
    real(wp), intent(in) :: linear(lanes), speed(lanes)
    real(wp), intent(inout) :: w(lanes), moment(lanes)

    if (k > 0) w = inverse * speed
    moment = moment - linear * w
  end subroutine add_linear

  !> The same, with what -(linear + cubic w^2) w adds to the moments, and coefficient k of w^2.
  pure subroutine add_cubic(lanes, k, inverse, linear, cubic, speed, w, w2, moment)
    integer, intent(in) :: lanes, k
    real(wp), intent(in) :: inverse
    real(wp), intent(in) :: linear(lanes), cubic(lanes), speed(lanes)
    real(wp), intent(inout) :: w(lanes, 0:k), w2(lanes, 0:k), moment(lanes)
    real(wp) :: sum(strip)
    integer :: i, j

    if (k > 0) w(:, k) = inverse * speed
    do i = 1, lanes, strip
      associate (l => i + strip - 1)
        sum = 0.0_wp
        do j = (k + 1) / 2 - 1, 0, -1
          sum = sum + w(i:l, j) * w(i:l, k - j)
        end do
        sum = sum + sum
        if (modulo(k, 2) == 0) sum = sum + w(i:l, k / 2) * w(i:l, k / 2)
        w2(i:l, k) = sum
        sum = 0.0_wp
        if (modulo(k, 2) == 0) sum = w(i:l, k / 2) * w2(i:l, k / 2)
        do j = (k + 1) / 2 - 1, 0, -1
          sum = sum + (w(i:l, j) * w2(i:l, k - j) + w(i:l, k - j) * w2(i:l, j))
        end do
        moment(i:l) = (-linear(i:l) * w(i:l, k) - cubic(i:l) * sum) + moment(i:l)
      end associate
    end do
  end subroutine add_cubic

  !> Adds by_speed_squared times coefficient k of v^2.
  pure subroutine add_square(lanes, elements, k, by_speed_squared, v, moment)
    integer, intent(in) :: lanes
    integer, intent(in) :: elements   !! of the speeds, of which this is the first
    integer, intent(in) :: k
    real(wp), intent(in) :: by_speed_squared(lanes), v(lanes, elements, 0:k)
    real(wp), intent(inout) :: moment(lanes)
    real(wp) :: sum(strip)
    integer :: i, j

    do i = 1, lanes, strip
      associate (l => i + strip - 1)
        sum = 0.0_wp
        do j = (k + 1) / 2 - 1, 0, -1
          sum = sum + v(i:l, 1, j) * v(i:l, 1, k - j)
        end do
        sum = sum + sum
        if (modulo(k, 2) == 0) sum = sum + v(i:l, 1, k / 2) * v(i:l, 1, k / 2)
        moment(i:l) = moment(i:l) + by_speed_squared(i:l) * sum
      end associate
    end do
  end subroutine add_square

  !> The next coefficients of a coordinate, from the entries `first` to `last` of R and the moments number k, and from its
  !> speed.
  pure subroutine accelerate_row(lanes, freedoms, columns, elements, entries, first, last, element, response, inverse, moment, y)
    integer, intent(in) :: lanes, freedoms, columns, elements, entries, first, last
    integer, intent(in) :: element(entries)
    real(wp), intent(in) :: response(lanes, entries)
    real(wp), intent(in) :: inverse   !! 1 / (k + 1)
    real(wp), intent(in) :: moment(lanes, elements)
    real(wp), intent(inout) :: y(lanes, columns, 2)   !! coefficients number k and k + 1, of which this is the first column
    integer :: a, b, c, k, l

    select case (last - first)
    case (1)
      a = element(first)
      b = element(last)
      do l = 1, lanes
        y(l, 1, 2) = inverse * (response(l, first) * moment(l, a) + response(l, last) * moment(l, b))
        y(l, 1 + freedoms, 2) = inverse * y(l, 1, 1)
      end do
    case (2)
      a = element(first)
      b = element(first + 1)
      c = element(last)
      do l = 1, lanes
        y(l, 1, 2) = inverse * (response(l, first) * moment(l, a) + response(l, first + 1) * moment(l, b) &
                                + response(l, last) * moment(l, c))
        y(l, 1 + freedoms, 2) = inverse * y(l, 1, 1)
      end do
    case default
      y(:, 1, 2) = 0.0_wp
      do k = first, last
        a = element(k)
        y(:, 1, 2) = y(:, 1, 2) + response(:, k) * moment(:, a)
      end do
      y(:, 1, 2) = inverse * y(:, 1, 2)
      y(:, 1 + freedoms, 2) = inverse * y(:, 1, 1)
    end select
  end subroutine accelerate_row

end module nocdyn_series_products
