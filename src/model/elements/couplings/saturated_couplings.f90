!> Couplings whose elastic moment cannot exceed a limit: S tanh(K1 w / S) with w = u - rest_twist.
module nocdyn_saturated_couplings
  use nocdyn_couplings, only: coupling_common_t, couplings_t, new_couplings
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_vector_functions, only: tanh_of
  implicit none (type, external)
  private

  public :: new_saturated_couplings

  type, extends(couplings_t), public :: saturated_couplings_t
    real(wp), allocatable :: initial_stiffness(:, :)   !! K1 [N m/rad], positive, shape [lanes, couplings] as all parameters
    real(wp), allocatable :: saturation(:, :)          !! S [N m], positive
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
  end type saturated_couplings_t

contains

  !> Couplings with the elastic moment saturation * tanh(stiffness * w / saturation).
  function new_saturated_couplings(common, stiffness, saturation) result(bank)
    type(coupling_common_t), intent(in) :: common   !! names, bodies, damping, rest twists, friction
    real(wp), intent(in) :: stiffness(:, :)            !! K1 [N m/rad], positive, shape [lanes, couplings]
    real(wp), intent(in) :: saturation(:, :)           !! S [N m], positive, shape [lanes, couplings]
    type(saturated_couplings_t) :: bank
    integer :: e

    bank%couplings_t = new_couplings(common, 0.0_wp * stiffness, 0.0_wp * stiffness)
    bank%is_polynomial = .false.
    bank%has_polynomial_potential = .false.
    bank%has_paper_law = .false.
    allocate (bank%initial_stiffness, source=stiffness)
    allocate (bank%saturation, source=saturation)
    bank%elastic = [(e, e=1, size(bank%to))]
  end function new_saturated_couplings

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(saturated_couplings_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]

    call add_moments(self%values, self%initial_stiffness, self%saturation, self%rest_twist, angle, restoring)
    call self%couplings_t%evaluate(time, angle, speed, restoring, applied)
  end subroutine evaluate

  pure subroutine add_moments(n, stiffness, saturation, rest, angle, restoring)
    integer, intent(in) :: n
    real(wp), intent(in) :: stiffness(n), saturation(n), rest(n), angle(n)
    real(wp), intent(inout) :: restoring(n)
    integer :: i

    do i = 1, n
      restoring(i) = restoring(i) - saturation(i) * tanh_of(stiffness(i) * (angle(i) - rest(i)) / saturation(i))
    end do
  end subroutine add_moments

  subroutine differentiate(self, elements)
    class(saturated_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: part, tangent
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        associate (stiffness => self%initial_stiffness(l, e), saturation => self%saturation(l, e), &
                   curvature => elements%restoring_curvature(l, i))
          part = tanh_of(stiffness * (elements%angle(l, i) - self%rest_twist(l, e)) / saturation)
          tangent = stiffness * (1.0_wp - part**2)
          elements%restoring_angle(l, i) = elements%restoring_angle(l, i) - tangent
          curvature = curvature + 2.0_wp * part * tangent * stiffness / saturation
        end associate
      end do
    end do
    call self%couplings_t%differentiate(elements)
  end subroutine differentiate

  !> The energy S^2 / K1 ln cosh(K1 w / S).
  subroutine evaluate_energies(self, elements)
    class(saturated_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w, x
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        associate (stiffness => self%initial_stiffness(l, e), saturation => self%saturation(l, e))
          w = elements%angle(l, i) - self%rest_twist(l, e)
          x = abs(stiffness * w / saturation)
          elements%stored(l, i) = elements%stored(l, i) + saturation**2 / stiffness * log_cosh(x)
          if (x > 0) elements%secant(l, i) = elements%secant(l, i) + saturation * tanh_of(x) / abs(w)
        end associate
      end do
    end do
  end subroutine evaluate_energies

  !> ln cosh x for x >= 0; for small x by its series, x^2 / 2 - x^4 / 12 + x^6 / 45 - ..., as the formula would lose digits.
  pure real(wp) function log_cosh(x)
    real(wp), intent(in) :: x

    if (x < 0.01_wp) then
      log_cosh = x**2 * (0.5_wp + x**2 * (-1.0_wp / 12.0_wp + x**2 * (1.0_wp / 45.0_wp - x**2 * 17.0_wp / 2520.0_wp)))
    else
      log_cosh = x + log(0.5_wp * (1.0_wp + exp(-2.0_wp * x)))
    end if
  end function log_cosh

  subroutine list_parameters(self, parameters)
    class(saturated_couplings_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%list_common(parameters)
    call parameters%add_key('stiffness', self%initial_stiffness)
    call parameters%add_key('saturation', self%saturation)
  end subroutine list_parameters

end module nocdyn_saturated_couplings
