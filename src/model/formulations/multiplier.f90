!> The multiplier formulation: [J, -L_lambda^T; L_lambda, 0] [omega'; lambda] = [Q + C omega + K phi; 0], states omega, phi.
module nocdyn_multiplier
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_body_formulation, only: body_formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  implicit none (type, external)
  private

  !> A machine in the multiplier formulation, with the factors of its constant matrix.
  type, extends(body_formulation_t), public :: multiplier_t
    integer, allocatable :: kept(:)             !! independent constraint rows, which alone are in the system
    real(wp), allocatable :: factors(:, :, :)   !! LU factors of the constant matrix, [n + kept, n + kept, lanes]
    integer, allocatable :: pivots(:, :)        !! of the LU factors, [n + kept, lanes]
    real(wp), allocatable :: solution(:, :)     !! omega' [rad/s2] and lambda of the kept rows, [n + kept, lanes]
  contains
    procedure :: formulate, derivative, reactions
  end type multiplier_t

contains

  !> Factors the constant matrix.
  subroutine formulate(self, with_energy_balance)
    class(multiplier_t), intent(inout) :: self
    logical, intent(in) :: with_energy_balance   !! as in `formulation_t`
    integer :: b, g, l, order
    logical :: is_singular

    call self%set_bodies('multiplier', 2 * self%machine%bodies, with_energy_balance)
    associate (machine => self%machine, n => self%machine%bodies)
      self%kept = [(machine%groups(g)%kept, g=1, size(machine%groups))]
      order = n + size(self%kept)
      allocate (self%factors(order, order, machine%lanes), source=0.0_wp)
      allocate (self%pivots(order, machine%lanes), self%solution(order, machine%lanes))
      do l = 1, machine%lanes
        do b = 1, n
          self%factors(b, b, l) = machine%inertia(l, b)
        end do
        associate (constraint => machine%constraints%block(l, self%kept, [(b, b=1, n)]))
          self%factors(n + 1:, :n, l) = constraint
          self%factors(:n, n + 1:, l) = -transpose(constraint)
        end associate
        call lu_factor(self%factors(:, :, l), self%pivots(:, l), is_singular)
        if (is_singular) self%factors(:, :, l) = ieee_value(1.0_wp, ieee_quiet_nan)   ! by rounding: it does not start
      end do
    end associate
  end subroutine formulate

  !> Solves for omega' and the multipliers.
  subroutine derivative(self, t, y, dydt, status)
    class(multiplier_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)                                         !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)         !! state
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)   !! its derivative
    integer, intent(inout) :: status(self%lanes)
    integer :: l, n

    n = self%machine%bodies
    call self%set_state(y)
    call self%state%evaluate(self%machine, t, self%phi, self%omega, self%torque)
    do l = 1, self%lanes
      self%solution(:n, l) = self%torque(l, 1:)
      self%solution(n + 1:, l) = 0.0_wp
      call lu_solve(self%factors(:, :, l), self%pivots(:, l), self%solution(:, l))
      dydt(l, :n) = self%solution(:n, l)
    end do
    dydt(:, n + 1:2 * n) = y(:, :n)
    if (self%internal > 0) dydt(:, self%mechanical + 1:self%states) = self%state%elements%internal%rate
    if (self%quadratures > 0) call self%state%power(self%machine, dydt(:, self%states + 1:))
    if (self%joints%count > 0) call self%hold_derivative(self%states + self%quadratures, t(1), dydt, status(1))
  end subroutine derivative

  !> The multipliers of the last evaluation, shared with redundant rows.
  subroutine reactions(self, lane, lambda)
    class(multiplier_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: lambda(:)   !! [rows]
    integer :: i

    if (self%joints%count > 0) then   ! with the moments of the joints that hold
      self%solution(:self%machine%bodies, lane) = self%torque(lane, 1:)
      self%solution(self%machine%bodies + 1:, lane) = 0.0_wp
      call lu_solve(self%factors(:, :, lane), self%pivots(:, lane), self%solution(:, lane))
    end if
    lambda = 0.0_wp
    do i = 1, size(self%kept)
      lambda(self%kept(i)) = self%solution(self%machine%bodies + i, lane)
    end do
    call self%machine%coordinates%reactions%load_sharing%minimise_norm(lane, lambda)
  end subroutine reactions

end module nocdyn_multiplier
