!> Elastic couplings: the nonlinear spring of eqs. (2), (3) with viscous damping and a twist at which it rests.
module nocdyn_couplings
  use nocdyn_bank, only: bank_t, quantity_t, role_coupling
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_laws, only: polynomial_laws_t
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
    procedure :: polynomials
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
    bank%elastic = pack([(e, e=1, size(to))], any(abs(stiffness) > 0.0_wp .or. abs(cubic_stiffness) > 0.0_wp, dim=1))
  end function new_couplings

  subroutine polynomials(self, laws)
    class(couplings_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    associate (first => self%first, last => self%last())
      laws%rest(:, first:last) = self%rest_twist
      laws%linear(:, first:last) = self%stiffness
      laws%cubic(:, first:last) = self%cubic_stiffness
      laws%by_speed(:, first:last) = -self%damping
      laws%damping(:, first:last) = self%damping
    end associate
  end subroutine polynomials

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
