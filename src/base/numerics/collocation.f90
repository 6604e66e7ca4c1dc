!> Collocation at the points of Gauss and of Radau, and polynomials through given points.
!>
!> E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5: Gauss collocation with s stages has the order 2 s and
!> keeps the size of undamped oscillations, Radau IIA has 2 s - 1 and damps what is stiff.
module nocdyn_collocation
  use nocdyn_kinds, only: wp
  use nocdyn_quadrature, only: gauss_legendre_rule, legendre_pair
  implicit none (type, external)
  private

  public :: chebyshev_points, gauss_points, interpolation, new_collocation, radau_points

  integer, parameter, public :: stages = 6

  !> A collocation method with its step.
  type, public :: collocation_t
    real(wp) :: h = 0.0_wp                          !! step
    real(wp) :: c(stages) = 0.0_wp                  !! times of the stages in it
    real(wp) :: once(stages, stages) = 0.0_wp       !! integrals up to the stages, by the values at them
    real(wp) :: twice(stages, stages) = 0.0_wp      !! repeated integrals
    real(wp) :: end_once(stages) = 0.0_wp           !! integrals up to the end of the step
    real(wp) :: end_twice(stages) = 0.0_wp          !! repeated integrals
  end type collocation_t

contains

  !> The collocation method with these points.
  pure type(collocation_t) function new_collocation(points, h) result(rule)
    real(wp), intent(in) :: points(stages)    !! parts of a step
    real(wp), intent(in) :: h                 !! step
    real(wp) :: at(stages), node(stages), weight(stages), to_end(stages)
    integer :: i, j, k

    call gauss_legendre_rule(stages, node, weight)
    rule%h = h
    rule%c = h * points
    to_end = 0.0_wp
    do i = 1, stages
      do k = 1, stages
        at = lagrange(points, points(i) * node(k))
        rule%once(i, :) = rule%once(i, :) + h * points(i) * weight(k) * at
      end do
      to_end = to_end + h * weight(i) * lagrange(points, node(i))
    end do
    rule%twice = matmul(rule%once, rule%once)
    rule%end_once = to_end
    do j = 1, stages
      rule%end_twice(j) = dot_product(to_end, rule%once(:, j))
    end do
  end function new_collocation

  !> The values at a place of the polynomials that are 1 at one of the points and 0 at the others.
  pure function lagrange(points, place) result(values)
    real(wp), intent(in) :: points(:), place
    real(wp) :: values(size(points))
    integer :: i, j

    values = 1.0_wp
    do i = 1, size(points)
      do j = 1, size(points)
        if (j /= i) values(i) = values(i) * (place - points(j)) / (points(i) - points(j))
      end do
    end do
  end function lagrange

  !> Interpolation from points to places.
  pure function interpolation(points, places) result(weights)
    real(wp), intent(in) :: points(:), places(:)
    real(wp) :: weights(size(places), size(points))
    integer :: i

    do i = 1, size(places)
      weights(i, :) = lagrange(points, places(i))
    end do
  end function interpolation

  !> Chebyshev points between 0 and 1, ascending.
  pure function chebyshev_points(count) result(points)
    integer, intent(in) :: count
    real(wp) :: points(count)
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer :: i

    points = [(0.5_wp - 0.5_wp * cos(pi * (i - 0.5_wp) / count), i=1, count)]
  end function chebyshev_points

  !> The stages of Gauss collocation.
  pure function gauss_points() result(points)
    real(wp) :: points(stages)
    real(wp) :: weights(stages)

    call gauss_legendre_rule(stages, points, weights)
  end function gauss_points

  !> The stages of Radau IIA collocation: zeros of P_n - P_(n-1), the last one the end of the step.
  pure function radau_points() result(points)
    real(wp) :: points(stages)
    real(wp) :: high, low, middle
    integer :: i, k
    real(wp) :: gauss(stages)

    gauss = gauss_points()
    do i = 1, stages - 1   ! one between each two zeros of P_n
      low = gauss(i)
      high = gauss(i + 1)
      do k = 1, 60
        middle = 0.5_wp * (low + high)
        if (difference(middle) * difference(high) <= 0) then
          low = middle
        else
          high = middle
        end if
      end do
      points(i) = 0.5_wp * (low + high)
    end do
    points(stages) = 1.0_wp

  contains

    pure real(wp) function difference(place)
      real(wp), intent(in) :: place
      real(wp) :: before, value

      call legendre_pair(stages, 2 * place - 1, value, before)
      difference = value - before
    end function difference

  end function radau_points

end module nocdyn_collocation
