!> Couplings whose elastic moment is a polynomial of the twist, of any order.
module nocdyn_polynomial_couplings
  use nocdyn_couplings, only: coupling_common_t, couplings_t, new_couplings
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  implicit none (type, external)
  private

  public :: new_polynomial_couplings, elastic_coefficients
  public :: elastic_moment, elastic_slope, elastic_curvature, elastic_energy

  !> M_el = -(p_1 w + p_2 w^2 + ...) on the second body, w = u - rest_twist; eqs. (2), (3) are p_1 and p_3.
  type, extends(couplings_t), public :: polynomial_couplings_t
    integer :: order = 1
    real(wp), allocatable :: coefficient(:, :, :)   !! p_k [N m/rad^k], shape [order, lanes, couplings]
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
  end type polynomial_couplings_t

contains

  !> Couplings with the elastic moment sum p_k w^k.
  function new_polynomial_couplings(common, coefficient) result(bank)
    type(coupling_common_t), intent(in) :: common   !! names, bodies, damping, rest twists, friction
    real(wp), intent(in) :: coefficient(:, :, :)       !! p_k [N m/rad^k], shape [order, lanes, couplings]
    type(polynomial_couplings_t) :: bank
    integer :: e

    bank%couplings_t = new_couplings(common, 0.0_wp * common%damping, 0.0_wp * common%damping)
    bank%is_polynomial = .false.
    bank%has_polynomial_potential = .false.
    bank%has_paper_law = .false.
    bank%order = size(coefficient, 1)
    allocate (bank%coefficient, source=coefficient)
    bank%elastic = pack([(e, e=1, size(bank%to))], [(any(abs(coefficient(:, :, e)) > 0.0_wp), e=1, size(bank%to))])
  end function new_polynomial_couplings

  !> p_1, p_2, ...: the sum of both stiffnesses and of further coefficients, of order 3 at least.
  pure function elastic_coefficients(stiffness, cubic_stiffness, further) result(coefficient)
    real(wp), intent(in) :: stiffness, cubic_stiffness   !! [N m/rad], [N m/rad3]
    real(wp), intent(in) :: further(:)                   !! [N m/rad^k]
    real(wp) :: coefficient(max(3, size(further)))

    coefficient = 0.0_wp
    coefficient(:size(further)) = further
    coefficient(1) = coefficient(1) + stiffness
    coefficient(3) = coefficient(3) + cubic_stiffness
  end function elastic_coefficients

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(polynomial_couplings_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]

    call add_terms(self%values, self%order, self%coefficient, self%rest_twist, angle, restoring)
    call self%couplings_t%evaluate(time, angle, speed, restoring, applied)
  end subroutine evaluate

  !> Adds -sum p_k w^k, w = angle - rest.
  pure subroutine add_terms(n, order, coefficient, rest, angle, restoring)
    integer, intent(in) :: n, order
    real(wp), intent(in) :: coefficient(order, n), rest(n), angle(n)
    real(wp), intent(inout) :: restoring(n)
    integer :: i

    do i = 1, n
      restoring(i) = restoring(i) - elastic_moment(coefficient(:, i), angle(i) - rest(i))
    end do
  end subroutine add_terms

  subroutine differentiate(self, elements)
    class(polynomial_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        w = elements%angle(l, i) - self%rest_twist(l, e)
        elements%restoring_angle(l, i) = elements%restoring_angle(l, i) - elastic_slope(self%coefficient(:, l, e), w)
        elements%restoring_curvature(l, i) = elements%restoring_curvature(l, i) - elastic_curvature(self%coefficient(:, l, e), w)
      end do
    end do
    call self%couplings_t%differentiate(elements)
  end subroutine differentiate

  subroutine evaluate_energies(self, elements)
    class(polynomial_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        w = elements%angle(l, i) - self%rest_twist(l, e)
        elements%stored(l, i) = elements%stored(l, i) + elastic_energy(self%coefficient(:, l, e), w)
        elements%secant(l, i) = elements%secant(l, i) + self%coefficient(1, l, e) + elastic_moment(self%coefficient(2:, l, e), w)
      end do
    end do
  end subroutine evaluate_energies

  !> p_1 w + p_2 w^2 + ...
  pure real(wp) function elastic_moment(p, w) result(moment)
    real(wp), intent(in) :: p(:), w   !! [N m/rad^k], [rad]
    integer :: k

    moment = 0.0_wp
    do k = size(p), 1, -1
      moment = (moment + p(k)) * w
    end do
  end function elastic_moment

  !> d/dw of sum p_k w^k.
  pure real(wp) function elastic_slope(p, w) result(slope)
    real(wp), intent(in) :: p(:), w   !! [N m/rad^k], [rad]
    integer :: k

    slope = 0.0_wp
    do k = size(p), 1, -1
      slope = slope * w + k * p(k)
    end do
  end function elastic_slope

  !> d2/dw2 of sum p_k w^k.
  pure real(wp) function elastic_curvature(p, w) result(curvature)
    real(wp), intent(in) :: p(:), w   !! [N m/rad^k], [rad]
    integer :: k

    curvature = 0.0_wp
    do k = size(p), 2, -1
      curvature = curvature * w + k * (k - 1) * p(k)
    end do
  end function elastic_curvature

  !> sum p_k w^(k+1) / (k + 1).
  pure real(wp) function elastic_energy(p, w) result(energy)
    real(wp), intent(in) :: p(:), w   !! [N m/rad^k], [rad]
    integer :: k

    energy = 0.0_wp
    do k = size(p), 1, -1
      energy = (energy + p(k) / (k + 1)) * w
    end do
    energy = energy * w
  end function elastic_energy

  subroutine list_parameters(self, parameters)
    class(polynomial_couplings_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%list_common(parameters)
    call parameters%add('coefficient', self%coefficient)
  end subroutine list_parameters

end module nocdyn_polynomial_couplings
