!> Elastic couplings: the nonlinear spring of eqs. (2), (3) with viscous damping and a twist at which it rests.
module nocdyn_couplings
  use nocdyn_bank, only: bank_t, quantity_t, role_coupling
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_couplings

  !> M_el = -(K1 + k1 w^2) w on the second body, w = u - rest_twist; damping moment -d u'.
  type, extends(bank_t), public :: couplings_t
    real(wp), allocatable :: stiffness(:, :)         !! K1 [N m/rad], shape [lanes, couplings] as all parameters
    real(wp), allocatable :: cubic_stiffness(:, :)   !! k1 [N m/rad3], of either sign
    real(wp), allocatable :: damping(:, :)           !! d [N m s/rad]
    real(wp), allocatable :: rest_twist(:, :)        !! [rad]
  contains
    procedure :: evaluate
    procedure :: differentiate
    procedure :: assess
    procedure :: quantities
    procedure :: observe
  end type couplings_t

  integer, parameter :: twist = 1, moment = 2, damping_moment = 3   ! the order of `quantities`

contains

  !> A bank of couplings; those without damping in any lane are not accounted.
  function new_couplings(names, from, to, stiffness, cubic_stiffness, damping, rest_twist) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)              !! bodies, 0 = ground
    real(wp), intent(in) :: stiffness(:, :)            !! [N m/rad], shape [lanes, couplings] as all parameters
    real(wp), intent(in) :: cubic_stiffness(:, :)      !! [N m/rad3]
    real(wp), intent(in) :: damping(:, :)              !! [N m s/rad]
    real(wp), intent(in) :: rest_twist(:, :)           !! [rad]
    type(couplings_t) :: bank
    integer :: e

    call bank%connect(role_coupling, size(stiffness, 1), names, from, to)
    bank%stiffness = stiffness
    bank%cubic_stiffness = cubic_stiffness
    bank%damping = damping
    bank%rest_twist = rest_twist
    bank%accounted = pack([(e, e=1, size(to))], any(abs(damping) > 0.0_wp, dim=1))
  end function new_couplings

  subroutine evaluate(self, time, angle, speed, restoring, working)
    class(couplings_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), working(self%values)

    call spring_moments(self%values, self%stiffness, self%cubic_stiffness, self%damping, self%rest_twist, angle, speed, &
                        restoring, working)
  end subroutine evaluate

  !> Eqs. (3), (49), (50), in the restoring sense.
  pure subroutine spring_moments(n, stiffness, cubic_stiffness, damping, rest_twist, angle, speed, restoring, working)
    integer, intent(in) :: n
    real(wp), intent(in) :: stiffness(n), cubic_stiffness(n), damping(n), rest_twist(n), angle(n), speed(n)
    real(wp), intent(inout) :: restoring(n), working(n)
    real(wp) :: w
    integer :: i

    do i = 1, n
      w = angle(i) - rest_twist(i)
      restoring(i) = -(stiffness(i) + cubic_stiffness(i) * w * w) * w
      working(i) = -damping(i) * speed(i)
    end do
  end subroutine spring_moments

  !> The tangent stiffness K1 + 3 k1 w^2 of eqs. (64)-(68), negative.
  subroutine differentiate(self, elements)
    class(couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        w = elements%angle(l, i) - self%rest_twist(l, e)
        elements%restoring_angle(l, i) = -(self%stiffness(l, e) + 3.0_wp * self%cubic_stiffness(l, e) * w * w)
        elements%restoring_curvature(l, i) = -6.0_wp * self%cubic_stiffness(l, e) * w
        elements%working_speed(l, i) = -self%damping(l, e)
      end do
    end do
  end subroutine differentiate

  !> Stored energy K1 w^2 / 2 + k1 w^4 / 4 and the secant stiffness K12 of eq. (3).
  subroutine assess(self, elements)
    class(couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w2
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        w2 = (elements%angle(l, i) - self%rest_twist(l, e))**2
        elements%secant(l, i) = self%stiffness(l, e) + self%cubic_stiffness(l, e) * w2
        elements%stored(l, i) = (0.5_wp * self%stiffness(l, e) + 0.25_wp * self%cubic_stiffness(l, e) * w2) * w2
        elements%damping(l, i) = self%damping(l, e)
      end do
    end do
  end subroutine assess

  function quantities(self) result(columns)
    class(couplings_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(3))
    columns(twist) = quantity_t('twist', 'rad', [(e, e=1, size(self%to))])
    columns(moment) = quantity_t('moment', 'N m', [(e, e=1, size(self%to))])
    columns(damping_moment) = quantity_t('damping', 'N m', self%accounted)
  end function quantities

  !> Twist, and the moments that act on the first body: F1 of the paper and the damping moment.
  pure subroutine observe(self, elements, quantity, lane, values)
    class(couplings_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    integer, intent(in) :: quantity
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)

    select case (quantity)
    case (twist)
      values = elements%angle(lane, self%first:self%last())
    case (moment)
      values = -elements%restoring(lane, self%first:self%last())
    case default
      values = -elements%working(lane, self%first:self%last())
    end select
  end subroutine observe

end module nocdyn_couplings
