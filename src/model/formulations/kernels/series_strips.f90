!> The recurrence of Taylor series on a strip of lanes, with the same bits as that of `nocdyn_reduced_series`.
!>
!> A strip has a constant length, so that each loop over its lanes becomes a few vector instructions. The whole recurrence is in
!> this module, so that compilers inline it into one loop over the orders. Coefficients that were computed long ago come first:
!> restoring moments before those that depend on the speed, and sums of products from the middle. So the processor does not
!> wait for the newest values.
!>
!> The procedures have up to 27 arguments. Their arrays have explicit shapes and are no components of types: gfortran then knows
!> that they are contiguous and do not overlap, and vectorises every loop over a strip.
module nocdyn_series_strips
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: gather, gather_laws, begin_strip, expand_strip

  integer, parameter, public :: strip = 32   !! lanes that are expanded together; the lanes of a block must be a multiple

  !> Index of a parameter in `law`.
  integer, parameter, public :: constant = 1, by_speed = 2, by_speed_squared = 3, linear = 4, cubic = 5

contains

  !> Copies the columns of a strip of lanes.
  pure subroutine gather(lanes, l, columns, x, y)
    integer, intent(in) :: lanes, l, columns       !! lanes of the block, first lane of the strip
    real(wp), intent(in) :: x(lanes, columns)      !! all lanes of the block
    real(wp), intent(inout) :: y(strip, columns)   !! the strip
    integer :: c

    do c = 1, columns
      y(:, c) = x(l:l + strip - 1, c)
    end do
  end subroutine gather

  !> Copies the laws of a strip of lanes.
  pure subroutine gather_laws(lanes, l, elements, constants, by_speeds, by_speeds_squared, linears, cubics, law)
    integer, intent(in) :: lanes, l, elements   !! lanes of the block, first lane of the strip
    real(wp), intent(in), dimension(lanes, elements) :: constants, by_speeds, by_speeds_squared, linears, cubics   !! of all lanes
    real(wp), intent(inout) :: law(strip, 5, elements)   !! of the strip
    integer :: e

    do e = 1, elements
      associate (m => l + strip - 1)
        law(:, constant, e) = constants(l:m, e)
        law(:, by_speed, e) = by_speeds(l:m, e)
        law(:, by_speed_squared, e) = by_speeds_squared(l:m, e)
        law(:, linear, e) = linears(l:m, e)
        law(:, cubic, e) = cubics(l:m, e)
      end associate
    end do
  end subroutine gather_laws

  !> Computes u' and w = u - rest of the elements at the start.
  pure subroutine begin_strip(l, lanes, freedoms, elements, order, entries, first, column, ratio, q_rate, q, start_twist, rest, &
                              speed, angle)
    integer, intent(in) :: l, lanes, freedoms, elements, order, entries   !! `l` is the first lane of the strip
    integer, intent(in) :: first(elements + 1), column(entries)   !! first entry of each element and coordinate of each entry of U
    real(wp), intent(in) :: ratio(strip, entries)   !! of the entries of U
    real(wp), intent(in) :: q_rate(strip, freedoms), q(lanes, freedoms)   !! q', q
    real(wp), intent(in), dimension(strip, elements) :: start_twist, rest   !! [rad]
    real(wp), intent(inout), dimension(strip, 0:order, elements) :: speed, angle   !! u', w
    integer :: e, i, k

    do e = 1, elements
      do i = 1, strip
        speed(i, 0, e) = 0.0_wp
        angle(i, 0, e) = start_twist(i, e)
      end do
      do k = first(e), first(e + 1) - 1
        associate (c => column(k))
          do i = 1, strip
            speed(i, 0, e) = speed(i, 0, e) + ratio(i, k) * q_rate(i, c)
            angle(i, 0, e) = angle(i, 0, e) + ratio(i, k) * q(l + i - 1, c)
          end do
        end associate
      end do
      do i = 1, strip
        angle(i, 0, e) = angle(i, 0, e) - rest(i, e)
      end do
    end do
  end subroutine begin_strip

  !> Computes the coefficients number 1 to `order` of q', and in y those of q' and q, which follow one another there.
  pure subroutine expand_strip(l, lanes, freedoms, elements, order, is_time_only, has_angle, has_cubic, has_square, entries, &
                               first, column, ratio, responses, first_response, element, response, law, external, speed, &
                               angle, square, restoring, moment, q, columns, y)
    integer, intent(in) :: l, lanes, freedoms, elements, order   !! `l` is the first lane of the strip
    logical, intent(in), dimension(elements) :: is_time_only, has_angle, has_cubic, has_square   !! as in `lane_terms_t`
    integer, intent(in) :: entries, first(elements + 1), column(entries)   !! of U
    real(wp), intent(in) :: ratio(strip, entries)   !! of the entries of U
    integer, intent(in) :: responses, first_response(freedoms + 1), element(responses)   !! of R
    real(wp), intent(in) :: response(strip, responses)   !! of the entries of R
    real(wp), intent(in) :: law(strip, 5, elements)   !! parameters of the laws
    real(wp), intent(in) :: external(lanes, elements, 0:order)   !! moments of the time-only elements
    real(wp), intent(inout), dimension(strip, 0:order, elements) :: speed, angle, square   !! u', w and w^2
    real(wp), intent(inout), dimension(strip, elements) :: restoring, moment   !! present coefficients; zero at the start
    real(wp), intent(inout) :: q(strip, freedoms, 0:order)   !! q'
    integer, intent(in) :: columns   !! components of the state
    real(wp), intent(inout) :: y(lanes, columns, 0:order)   !! coefficients of the state
    real(wp) :: inverse
    integer :: e, i, k

    do k = 0, order - 1
      inverse = 1.0_wp / max(k, 1)
      do e = 1, elements
        if (has_cubic(e)) then
          call find_cubic(k, inverse, law(1, linear, e), law(1, cubic, e), speed(1, max(k - 1, 0), e), angle(1, 0, e), &
                          square(1, 0, e), restoring(1, e))
        else if (has_angle(e)) then
          call find_linear(k, inverse, law(1, linear, e), speed(1, max(k - 1, 0), e), angle(1, k, e), restoring(1, e))
        end if
      end do
      do e = 1, elements
        if (is_time_only(e)) then
          call copy(external(l, e, k), moment(1, e))
          cycle
        end if
        if (k == 0) then
          call begin_moments(law(1, constant, e), law(1, by_speed, e), speed(1, 0, e), restoring(1, e), moment(1, e))
        else
          call find_moments(freedoms, entries, first(e), first(e + 1) - 1, column, ratio, q(1, 1, k), law(1, by_speed, e), &
                            restoring(1, e), speed(1, k, e), moment(1, e))
        end if
        if (has_square(e)) then
          call find_moments_of_squares(k, law(1, constant, e), law(1, by_speed, e), law(1, by_speed_squared, e), speed(1, 0, e), &
                                       restoring(1, e), moment(1, e))
        end if
      end do
      inverse = 1.0_wp / (k + 1)
      do i = 1, freedoms
        call accelerate(elements, responses, first_response(i), first_response(i + 1) - 1, element, response, inverse, moment, &
                        q(1, i, k), q(1, i, k + 1), y(l, i, k + 1), y(l, freedoms + i, k + 1))
      end do
    end do
  end subroutine expand_strip

  !> Copies a strip, by address.
  pure subroutine copy(x, y)
    real(wp), intent(in) :: x(strip)
    real(wp), intent(inout) :: y(strip)

    y = x
  end subroutine copy

  !> Moments number 0, without the terms in the square of the speed.
  pure subroutine begin_moments(constant, by_speed, speed, restoring, moment)
    real(wp), intent(in), dimension(strip) :: constant, by_speed, speed, restoring   !! law, u', restoring moments
    real(wp), intent(inout) :: moment(strip)                                         !! [N m]

    moment = restoring + (constant + by_speed * speed)
  end subroutine begin_moments

  !> Computes the speeds of an element number k > 0, from the entries `begin` to `end` of U, and its moments, without the terms in
  !> the square of the speed.
  pure subroutine find_moments(freedoms, entries, begin, end, column, ratio, q, by_speed, restoring, speed, moment)
    integer, intent(in) :: freedoms, entries, begin, end
    integer, intent(in) :: column(entries)                                          !! of the entries of U
    real(wp), intent(in) :: ratio(strip, entries)                                   !! of the entries of U
    real(wp), intent(in) :: q(strip, freedoms), by_speed(strip), restoring(strip)   !! q' number k; of the element
    real(wp), intent(inout) :: speed(strip), moment(strip)                          !! u', moments
    real(wp) :: v
    integer :: c, d, i, k

    select case (end - begin)
    case (0)
      c = column(begin)
      do i = 1, strip
        v = ratio(i, begin) * q(i, c)
        speed(i) = v
        moment(i) = restoring(i) + by_speed(i) * v
      end do
    case (1)
      c = column(begin)
      d = column(end)
      do i = 1, strip
        v = ratio(i, begin) * q(i, c) + ratio(i, end) * q(i, d)
        speed(i) = v
        moment(i) = restoring(i) + by_speed(i) * v
      end do
    case default
      do i = 1, strip
        speed(i) = 0.0_wp
      end do
      do k = begin, end
        c = column(k)
        do i = 1, strip
          speed(i) = speed(i) + ratio(i, k) * q(i, c)
        end do
      end do
      do i = 1, strip
        moment(i) = restoring(i) + by_speed(i) * speed(i)
      end do
    end select
  end subroutine find_moments

  !> Computes coefficient k of w, from coefficient k - 1 of the speed if k > 0, and of -linear w.
  pure subroutine find_linear(k, inverse, linear, speed, w, restoring)
    integer, intent(in) :: k
    real(wp), intent(in) :: inverse                         !! 1 / k
    real(wp), intent(in) :: linear(strip), speed(strip)     !! law, u'
    real(wp), intent(inout) :: w(strip), restoring(strip)   !! u - rest, moments

    if (k > 0) w = inverse * speed
    restoring = -linear * w
  end subroutine find_linear

  !> Computes coefficient k of w, from coefficient k - 1 of the speed if k > 0, of w2 = w^2 and of -(linear + cubic w^2) w. The
  !> products with w2 are added up in the same loop as those of w.
  pure subroutine find_cubic(k, inverse, linear, cubic, speed, w, w2, restoring)
    integer, intent(in) :: k
    real(wp), intent(in) :: inverse                                              !! 1 / k
    real(wp), intent(in) :: linear(strip), cubic(strip), speed(strip)            !! law, u'
    real(wp), intent(inout) :: w(strip, 0:k), w2(strip, 0:k), restoring(strip)   !! column k is set
    real(wp) :: sum(strip), sum_of_cubes(strip)
    integer :: j, middle

    if (k == 0) then
      w2(:, 0) = 0.0_wp + w(:, 0) * w(:, 0)
      restoring = -linear * w(:, 0) - cubic * (w(:, 0) * w2(:, 0))
      return
    end if
    w(:, k) = inverse * speed
    if (k < 3) then
      sum = 0.0_wp + w(:, 0) * w(:, k)
      sum_of_cubes = 0.0_wp
      if (k == 2) sum_of_cubes = w(:, 1) * w2(:, 1)
    else
      middle = (k - 1) / 2
      sum = 0.0_wp + w(:, middle) * w(:, k - middle)
      sum_of_cubes = w(:, middle) * w2(:, k - middle) + w(:, k - middle) * w2(:, middle)
      if (modulo(k, 2) == 0) sum_of_cubes = w(:, k / 2) * w2(:, k / 2) + sum_of_cubes
      do j = middle - 1, 1, -1
        sum = sum + w(:, j) * w(:, k - j)
        sum_of_cubes = sum_of_cubes + (w(:, j) * w2(:, k - j) + w(:, k - j) * w2(:, j))
      end do
      sum = sum + w(:, 0) * w(:, k)
    end if
    if (modulo(k, 2) == 0) then
      w2(:, k) = (sum + sum) + w(:, k / 2) * w(:, k / 2)
    else
      w2(:, k) = sum + sum
    end if
    restoring = -linear * w(:, k) - cubic * (sum_of_cubes + (w(:, 0) * w2(:, k) + w(:, k) * w2(:, 0)))
  end subroutine find_cubic

  !> Moments number k of an element with a term in the square of the speed v.
  pure subroutine find_moments_of_squares(k, constant, by_speed, by_speed_squared, v, restoring, moment)
    integer, intent(in) :: k
    real(wp), intent(in), dimension(strip) :: constant, by_speed, by_speed_squared, restoring   !! law, restoring moments
    real(wp), intent(in) :: v(strip, 0:k)                                                       !! u'
    real(wp), intent(inout) :: moment(strip)                                                    !! [N m]
    real(wp) :: sum(strip)
    integer :: j

    if (k == 0) then
      moment = restoring + ((constant + by_speed * v(:, 0)) + by_speed_squared * (0.0_wp + v(:, 0) * v(:, 0)))
      return
    end if
    sum = 0.0_wp + v(:, (k - 1) / 2) * v(:, k - (k - 1) / 2)
    do j = (k - 1) / 2 - 1, 0, -1
      sum = sum + v(:, j) * v(:, k - j)
    end do
    if (modulo(k, 2) == 0) then
      moment = restoring + (by_speed * v(:, k) + by_speed_squared * ((sum + sum) + v(:, k / 2) * v(:, k / 2)))
    else
      moment = restoring + (by_speed * v(:, k) + by_speed_squared * (sum + sum))
    end if
  end subroutine find_moments_of_squares

  !> Computes the next coefficients of a coordinate and of its speed, from the entries `begin` to `end` of R and the moments
  !> number k.
  pure subroutine accelerate(elements, entries, begin, end, element, response, inverse, moment, speed, next_speed, y_speed, &
                             y_angle)
    integer, intent(in) :: elements, entries, begin, end
    integer, intent(in) :: element(entries)                                     !! of the entries of R
    real(wp), intent(in) :: response(strip, entries)                            !! of the entries of R
    real(wp), intent(in) :: inverse                                             !! 1 / (k + 1)
    real(wp), intent(in) :: moment(strip, elements), speed(strip)               !! moments and q' number k
    real(wp), intent(inout), dimension(strip) :: next_speed, y_speed, y_angle   !! number k + 1: q'; q' and q in y
    real(wp) :: v
    integer :: a, b, c, i, k

    select case (end - begin)
    case (1)
      a = element(begin)
      b = element(end)
      do i = 1, strip
        v = inverse * (response(i, begin) * moment(i, a) + response(i, end) * moment(i, b))
        next_speed(i) = v
        y_speed(i) = v
        y_angle(i) = inverse * speed(i)
      end do
    case (2)
      a = element(begin)
      b = element(begin + 1)
      c = element(end)
      do i = 1, strip
        v = inverse * (response(i, begin) * moment(i, a) + response(i, begin + 1) * moment(i, b) &
                       + response(i, end) * moment(i, c))
        next_speed(i) = v
        y_speed(i) = v
        y_angle(i) = inverse * speed(i)
      end do
    case default
      do i = 1, strip
        next_speed(i) = 0.0_wp
      end do
      do k = begin, end
        a = element(k)
        do i = 1, strip
          next_speed(i) = next_speed(i) + response(i, k) * moment(i, a)
        end do
      end do
      do i = 1, strip
        next_speed(i) = inverse * next_speed(i)
        y_speed(i) = next_speed(i)
        y_angle(i) = inverse * speed(i)
      end do
    end select
  end subroutine accelerate

end module nocdyn_series_strips
