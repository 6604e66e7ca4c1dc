!> Spectral elements of a uniform bar of length 1 that obeys (k phi')' = m phi'' (torsion, tension): nodes at the Gauss-Lobatto
!> points, lumped masses, and the strain at the Gauss points.
!>
!> With n Gauss points the stiffness of the polynomial of degree n through n + 1 nodes is integrated exactly. The masses are the
!> weights of the Gauss-Lobatto quadrature, so that the mass matrix is diagonal; the error falls exponentially with n.
module nocdyn_spectral_elements
  use nocdyn_kinds, only: wp
  use nocdyn_quadrature, only: gauss_legendre_rule, legendre_pair
  implicit none (type, external)
  private

  public :: new_spectral_element, least_order

  integer, parameter, public :: highest_order = 24   !! of elements that are good for all: longer bars are several ones

  type, public :: spectral_element_t
    integer :: order = 1                     !! n
    real(wp), allocatable :: node(:)         !! on [0, 1], ascending, 0 to n
    real(wp), allocatable :: mass(:)         !! of each node as a share of the mass of the bar, 0 to n
    real(wp), allocatable :: gauss(:)        !! on [0, 1], ascending, [n]
    real(wp), allocatable :: weight(:)       !! of the Gauss points, their sum is 1, [n]
    real(wp), allocatable :: row(:, :)       !! weight * strain at each Gauss point for the nodes, [n, 0 to n]
  contains
    procedure :: interpolation
    procedure :: error => condensed_error
  end type spectral_element_t

contains

  !> An element with n + 1 nodes.
  pure type(spectral_element_t) function new_spectral_element(order) result(self)
    integer, intent(in) :: order   !! n, from 1 on
    integer :: j, q

    self%order = order
    allocate (self%node(0:order), self%mass(0:order), self%gauss(order), self%weight(order), self%row(order, 0:order))
    call gauss_lobatto_rule(order, self%node, self%mass)
    call gauss_legendre_rule(order, self%gauss, self%weight)
    do q = 1, order
      do j = 0, order
        self%row(q, j) = self%weight(q) * slope_of(self%node, j, self%gauss(q))
      end do
      j = maxloc(abs(self%row(q, :)), dim=1) - 1
      self%row(q, j) = self%row(q, j) - sum(self%row(q, :))   ! a rotation is no strain
    end do
  end function new_spectral_element

  !> Nodes and weights on [0, 1] with both ends, which integrate polynomials of degree 2 n - 1 exactly.
  pure subroutine gauss_lobatto_rule(n, nodes, weights)
    integer, intent(in) :: n
    real(wp), intent(out) :: nodes(0:n)     !! ascending
    real(wp), intent(out) :: weights(0:n)   !! their sum is 1
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer, parameter :: newton_steps = 30   ! five to ten are needed
    real(wp) :: before, change, value, x
    integer :: i, step

    do i = 0, n
      x = -cos(pi * i / n)
      do step = 1, newton_steps
        call legendre_pair(n, x, value, before)
        if (i == 0 .or. i == n) exit
        change = (x * value - before) / ((n + 1) * value)
        x = x - change
        if (abs(change) <= epsilon(x)) exit
      end do
      call legendre_pair(n, x, value, before)
      nodes(i) = 0.5_wp * (1.0_wp + x)
      weights(i) = 1.0_wp / (n * (n + 1) * value**2)
    end do
  end subroutine gauss_lobatto_rule

  !> The slope of a Lagrange polynomial at a point that is no node.
  pure real(wp) function slope_of(node, j, x) result(slope)
    real(wp), intent(in) :: node(0:)
    integer, intent(in) :: j    !! the node at which the polynomial is 1
    real(wp), intent(in) :: x
    real(wp) :: total, value
    integer :: k

    value = 1.0_wp
    total = 0.0_wp
    do k = 0, ubound(node, 1)
      if (k == j) cycle
      value = value * ((x - node(k)) / (node(j) - node(k)))
      total = total + 1.0_wp / (x - node(k))
    end do
    slope = value * total
  end function slope_of

  !> The matrix from values at the Gauss points to values of the polynomial of degree n - 1 at other points, [points, n].
  pure function interpolation(self, points) result(matrix)
    class(spectral_element_t), intent(in) :: self
    real(wp), intent(in) :: points(:)   !! on [0, 1]
    real(wp) :: matrix(size(points), self%order)
    integer :: k, q

    matrix = 1.0_wp
    do q = 1, self%order
      do k = 1, self%order
        if (k /= q) matrix(:, q) = matrix(:, q) * ((points - self%gauss(k)) / (self%gauss(q) - self%gauss(k)))
      end do
    end do
  end function interpolation

  !> The least order at which the error of an element is at most `tolerance`; above highest_order if that does not suffice.
  pure integer function least_order(b, tolerance) result(order)
    real(wp), intent(in) :: b           !! highest frequency times the time that a wave takes through the bar [rad]
    real(wp), intent(in) :: tolerance   !! as of `error`
    type(spectral_element_t) :: element

    do order = 1, highest_order
      if (order + 1 < b) cycle   ! two nodes for a wave length and less resolve nothing
      element = new_spectral_element(order)
      if (element%error(b) <= tolerance) return
    end do
  end function least_order

  !> The error of the relation between the states (angle, moment) at both ends, which is exactly cos b and sin b / b. They follow
  !> from the dynamic stiffness [b cot b, -b / sin b] of the bar without its internal nodes.
  pure real(wp) function condensed_error(self, b) result(error)
    class(spectral_element_t), intent(in) :: self
    real(wp), intent(in) :: b   !! frequency times the time that a wave takes through the bar [rad]
    real(wp), parameter :: near_pole = 0.1_wp
    real(wp) :: at, stiffness(0:self%order, 0:self%order)
    integer :: j, k, q

    at = b
    if (abs(sin(b)) < near_pole .and. b > 1.0_wp) at = b + 2.0_wp * near_pole   ! the bar between fixed ends resonates there
    stiffness = 0.0_wp
    do j = 0, self%order
      do q = 1, self%order
        stiffness(:, j) = stiffness(:, j) + self%row(q, :) * (self%row(q, j) / self%weight(q))
      end do
      stiffness(j, j) = stiffness(j, j) - at**2 * self%mass(j)
    end do
    error = huge(error)
    do k = 1, self%order - 1   ! eliminates the internal nodes
      if (.not. abs(stiffness(k, k)) > 0.0_wp) return
      do j = 0, self%order
        if (j > 0 .and. j <= k) cycle
        stiffness(:, j) = stiffness(:, j) - stiffness(:, k) * (stiffness(k, j) / stiffness(k, k))
      end do
    end do
    associate (own => stiffness(0, 0), coupling => stiffness(0, self%order))
      error = abs(own / coupling + cos(at)) + abs(1.0_wp / coupling + sin(at) / at)
    end associate
  end function condensed_error

end module nocdyn_spectral_elements
