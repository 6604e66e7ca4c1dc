!> Elastic couplings: the nonlinear spring of eqs. (2), (3) with viscous damping and a twist at which it rests.
module nocdyn_couplings
  use nocdyn_bank, only: bank_t, quantity_t, role_coupling
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_couplings

  !> M_el = -(K1 + k1 w^2) w on the second body, w = u - rest_twist; damping moment -d u'.
  type, extends(bank_t), public :: couplings_t
    real(wp), allocatable :: stiffness(:, :)         !! K1 [N m/rad], shape [lanes, couplings]
    real(wp), allocatable :: cubic_stiffness(:, :)   !! k1 [N m/rad3], of either sign
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

  !> Eqs. (3), (49), (50), in the restoring sense.
  subroutine evaluate(self, t)
    class(couplings_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp) :: w
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(t)
        w = self%angle(l, e) - self%rest_twist(l, e)
        self%restoring(l, e) = -(self%stiffness(l, e) + self%cubic_stiffness(l, e) * w * w) * w
        self%working(l, e) = -self%damping(l, e) * self%speed(l, e)
      end do
    end do
  end subroutine evaluate

  !> The tangent stiffness K1 + 3 k1 w^2 of eqs. (64)-(68), negative.
  subroutine differentiate(self, t)
    class(couplings_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp) :: w
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(t)
        w = self%angle(l, e) - self%rest_twist(l, e)
        self%restoring_angle(l, e) = -(self%stiffness(l, e) + 3.0_wp * self%cubic_stiffness(l, e) * w * w)
        self%restoring_curvature(l, e) = -6.0_wp * self%cubic_stiffness(l, e) * w
        self%working_speed(l, e) = -self%damping(l, e)
      end do
    end do
  end subroutine differentiate

  !> Stored energy K1 w^2 / 2 + k1 w^4 / 4 and the secant stiffness K12 of eq. (3).
  subroutine assess(self)
    class(couplings_t), intent(inout) :: self
    real(wp) :: w2
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(self%angle, 1)
        w2 = (self%angle(l, e) - self%rest_twist(l, e))**2
        self%secant(l, e) = self%stiffness(l, e) + self%cubic_stiffness(l, e) * w2
        self%stored(l, e) = (0.5_wp * self%stiffness(l, e) + 0.25_wp * self%cubic_stiffness(l, e) * w2) * w2
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
  pure subroutine observe(self, quantity, lane, values)
    class(couplings_t), intent(in) :: self
    integer, intent(in) :: quantity
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)

    select case (quantity)
    case (twist)
      values = self%angle(lane, :)
    case (moment)
      values = -self%restoring(lane, :)
    case default
      values = -self%working(lane, :)
    end select
  end subroutine observe

end module nocdyn_couplings
