!> Laws of elements that are polynomials, in one vector loop over the elements of all banks.
!>
!> restoring = -(linear + cubic w^2) w with w = u - rest, working = constant + (by_speed + by_speed_squared u') u'.
module nocdyn_polynomial_laws
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_polynomial_laws

  !> The coefficients of all elements, shape [lanes, elements]; zero where a law has no such term.
  type, public :: polynomial_laws_t
    real(wp), allocatable :: rest(:, :)               !! [rad]
    real(wp), allocatable :: linear(:, :)             !! [N m/rad]
    real(wp), allocatable :: cubic(:, :)              !! [N m/rad3]
    real(wp), allocatable :: constant(:, :)           !! [N m]
    real(wp), allocatable :: by_speed(:, :)           !! [N m s/rad]
    real(wp), allocatable :: by_speed_squared(:, :)   !! [N m s2/rad2]
    real(wp), allocatable :: damping(:, :)            !! what of -by_speed is in C, eq. (22) [N m s/rad]
  contains
    procedure :: evaluate
    procedure :: differentiate
    procedure :: assess
  end type polynomial_laws_t

contains

  !> Laws without any moment.
  function new_polynomial_laws(lanes, elements) result(self)
    integer, intent(in) :: lanes, elements
    type(polynomial_laws_t) :: self

    allocate (self%rest(lanes, elements), source=0.0_wp)
    allocate (self%linear, self%cubic, self%constant, self%by_speed, self%by_speed_squared, self%damping, source=self%rest)
  end function new_polynomial_laws

  !> Eqs. (3), (49), (50) in the restoring sense; eqs. (5) and (20). Sets the moments of all elements.
  subroutine evaluate(self, elements)
    class(polynomial_laws_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements

    call moments(size(self%rest), self%rest, self%linear, self%cubic, self%constant, self%by_speed, self%by_speed_squared, &
                 elements%angle, elements%speed, elements%restoring, elements%working)
  end subroutine evaluate

  pure subroutine moments(n, rest, linear, cubic, constant, by_speed, by_speed_squared, angle, speed, restoring, working)
    integer, intent(in) :: n   !! lanes * elements
    real(wp), intent(in), dimension(n) :: rest, linear, cubic, constant, by_speed, by_speed_squared, angle, speed
    real(wp), intent(inout) :: restoring(n), working(n)
    real(wp) :: w
    integer :: i

    do i = 1, n
      w = angle(i) - rest(i)
      restoring(i) = -(linear(i) + cubic(i) * w * w) * w
      working(i) = constant(i) + (by_speed(i) + by_speed_squared(i) * speed(i)) * speed(i)
    end do
  end subroutine moments

  !> Sets the derivatives of the moments: the tangent stiffness K1 + 3 k1 w^2 of eqs. (64)-(68), negative, and the others.
  subroutine differentiate(self, elements)
    class(polynomial_laws_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, l

    do e = 1, size(self%rest, 2)
      do l = 1, size(self%rest, 1)
        w = elements%angle(l, e) - self%rest(l, e)
        elements%restoring_angle(l, e) = -(self%linear(l, e) + 3.0_wp * self%cubic(l, e) * w * w)
        elements%restoring_curvature(l, e) = -6.0_wp * self%cubic(l, e) * w
        elements%working_angle(l, e) = 0.0_wp
        elements%working_speed(l, e) = self%by_speed(l, e) + 2.0_wp * self%by_speed_squared(l, e) * elements%speed(l, e)
        elements%working_time(l, e) = 0.0_wp
      end do
    end do
  end subroutine differentiate

  !> Sets the stored energies linear w^2 / 2 + cubic w^4 / 4, the secant stiffnesses K12 of eq. (3) and the dampings.
  subroutine assess(self, elements)
    class(polynomial_laws_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w2
    integer :: e, l

    do e = 1, size(self%rest, 2)
      do l = 1, size(self%rest, 1)
        w2 = (elements%angle(l, e) - self%rest(l, e))**2
        elements%secant(l, e) = self%linear(l, e) + self%cubic(l, e) * w2
        elements%stored(l, e) = (0.5_wp * self%linear(l, e) + 0.25_wp * self%cubic(l, e) * w2) * w2
        elements%damping(l, e) = self%damping(l, e)
      end do
    end do
  end subroutine assess

end module nocdyn_polynomial_laws
