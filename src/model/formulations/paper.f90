!> The paper's formulation, eq. (43): J_3 beta' = Q_3 + C_3 beta + K_3 beta with beta = [omega; phi; F], as written.
module nocdyn_paper
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_body_formulation, only: body_formulation_t, jacobian_of_bodies, observe_bodies, start_of_bodies
  use nocdyn_element_sets, only: coupling_elements
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_lapack_lu, only: lu_factor
  use nocdyn_machine_state, only: machine_state_t, new_machine_state
  use nocdyn_paper_matrices, only: elastic_moments, inertia_matrices_t, new_paper_matrices, paper_matrices_t, tangent_matrix
  implicit none (type, external)
  private

  !> A machine in the paper's formulation, with the factors of J_3.
  type, extends(body_formulation_t), public :: paper_t
    real(wp), allocatable, private :: complement(:, :, :)      !! L_tau, [n, freedoms, lanes]
    real(wp), allocatable, private :: factors(:, :, :)         !! LU of J_3, [3n, 3n, lanes]
    integer, allocatable, private :: pivots(:, :)              !! [3n, lanes]
    integer, allocatable, private :: couplings(:)              !! elements of the role coupling
    real(wp), allocatable, private :: moment_of_bodies(:, :)   !! coupling moments from body moments, [couplings, n]
    real(wp), allocatable, private :: term(:)                  !! moments on the bodies [N m], [n], work space
    type(paper_matrices_t), private :: work
  contains
    procedure :: formulate, derivative, jacobian, start, observe, reactions
  end type paper_t

contains

  !> Assembles and factors J_3.
  subroutine formulate(self, with_energy_balance)
    class(paper_t), intent(inout) :: self
    logical, intent(in) :: with_energy_balance   !! as in `formulation_t`
    type(inertia_matrices_t) :: inertia
    real(wp), allocatable :: incidence(:, :)   ! moments on the bodies from the moments of the couplings
    integer :: l, n
    logical :: is_singular

    n = self%machine%bodies
    call self%set_bodies('paper', 3 * n, with_energy_balance)
    self%work = new_paper_matrices(n)
    allocate (self%term(n), source=0.0_wp)
    allocate (self%complement(n, self%machine%coordinates%freedoms, self%machine%lanes))
    allocate (self%factors(3 * n, 3 * n, self%machine%lanes), self%pivots(3 * n, self%machine%lanes))
    do l = 1, self%machine%lanes
      self%complement(:, :, l) = self%machine%coordinates%complement(l)
      call inertia%assemble(self%machine, l, self%complement(:, :, l))
      self%factors(:, :, l) = inertia%inertia_3
      call lu_factor(self%factors(:, :, l), self%pivots(:, l), is_singular)
      if (is_singular) self%factors(:, :, l) = ieee_value(1.0_wp, ieee_quiet_nan)   ! by rounding: the integration does not start
    end do
    allocate (self%couplings, source=coupling_elements(self%machine))
    allocate (incidence(n, size(self%couplings)), source=0.0_wp)
    do l = 1, size(self%couplings)
      call self%machine%elements%rows%add_moment(self%couplings(l), 1.0_wp, incidence(:, l))
    end do
    self%moment_of_bodies = pseudo_inverse(incidence, 1.0e-10_wp)
  end subroutine formulate

  !> beta at the start. F are the elastic moments at the start angles, eqs. (48)-(51).
  function start(self) result(y)
    class(paper_t), intent(in) :: self
    real(wp), allocatable :: y(:, :)
    type(machine_state_t) :: state
    real(wp) :: t(self%lanes), moments(self%machine%bodies)
    real(wp), dimension(self%lanes, 0:self%machine%bodies) :: phi, omega, torque
    integer :: l, n

    y = start_of_bodies(self)
    n = self%machine%bodies
    phi = 0.0_wp
    omega = 0.0_wp
    t = 0.0_wp
    phi(:, 1:) = self%machine%start_angle
    state = new_machine_state(self%machine)
    if (self%internal > 0) state%elements%internal%value = self%machine%start_internal()
    call state%elements%gather(self%machine%elements%rows, phi, omega)
    call state%choose_branches(self%machine, t)
    call state%evaluate(self%machine, t, phi, omega, torque)
    do l = 1, self%lanes
      call elastic_moments(self%machine, state%elements, l, moments)
      y(l, 2 * n + 1:3 * n) = moments
    end do
  end function start

  !> Assembles and solves eq. (43) for beta'.
  subroutine derivative(self, t, y, dydt, status)
    class(paper_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)                                         !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)         !! state
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)   !! its derivative
    integer, intent(inout) :: status(self%lanes)
    integer :: l, n

    n = self%machine%bodies
    call self%set_state(y)
    call self%state%evaluate(self%machine, t, self%phi, self%omega, self%torque)
    call self%state%differentiate_elements(self%machine, t)
    do l = 1, self%lanes
      call self%work%assemble(self%machine, self%state%elements, l, self%complement(:, :, l))
      self%work%beta(:) = y(l, :3 * n)
      call self%work%solve(self%factors(:, :, l), self%pivots(:, l))
      dydt(l, :3 * n) = self%work%beta
    end do
    if (self%internal > 0) dydt(:, self%mechanical + 1:self%states) = self%state%elements%internal%rate
    if (self%quadratures > 0) call self%state%power(self%machine, dydt(:, self%states + 1:))
    if (self%joints%count > 0) call self%hold_derivative(self%states + self%quadratures, t(1), dydt, status(1))
  end subroutine derivative

  !> The Jacobian of the bodies and the rows of F' = K_4 omega.
  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(paper_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)                                         !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)         !! state
    real(wp), contiguous, intent(inout) :: dfdy(:, :)                             !! [lanes, positions]
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)   !! derivative by the time
    integer, intent(inout) :: status(self%lanes)

    call jacobian_of_bodies(self, t, y, dfdy, dfdt, status)
    call fill_moment_rows(self, size(dfdt, 2), dfdy)
  end subroutine jacobian

  !> The derivatives of F' = K_4 omega by omega and phi.
  subroutine fill_moment_rows(self, components, dfdy)
    type(paper_t), intent(inout) :: self
    integer, intent(in) :: components                                      !! states + quadratures
    real(wp), intent(inout) :: dfdy(self%lanes, components, self%states)   !! derivative by the states
    integer :: e, l, n

    n = self%machine%bodies
    associate (elements => self%state%elements, rows => self%machine%elements%rows, pairs => self%machine%elements%cross)
      do l = 1, self%lanes
        call tangent_matrix(self%machine, self%state%elements, l, self%work%tangent)
        dfdy(l, 2 * n + 1:3 * n, :n) = self%work%tangent
        self%work%tangent(:, :) = 0.0_wp
        do e = 1, size(elements%applied, 2)
          call rows%add_coefficient(e, -elements%restoring_curvature(l, e) * elements%speed(l, e), self%work%tangent)
        end do
        associate (cross => elements%cross)
          do e = 1, pairs%count
            call rows%add_coefficient(pairs%element(e), -cross%mixed(l, e) * elements%speed(l, pairs%by(e)), self%work%tangent)
            call rows%add_product(pairs%element(e), pairs%by(e), cross%mixed(l, e) * elements%speed(l, pairs%element(e)) &
                                  + cross%curvature(l, e) * elements%speed(l, pairs%by(e)), self%work%tangent)
          end do
        end associate
        dfdy(l, 2 * n + 1:3 * n, n + 1:2 * n) = self%work%tangent
      end do
    end associate
  end subroutine fill_moment_rows

  !> Evaluates the machine at a state, with the moments of the couplings from the states F.
  !>
  !> Where the couplings form no loop, F determines their moments. Elsewhere the moments are those nearest to the laws' among all
  !> that add up to F on the bodies.
  subroutine observe(self, t, y, in_motion)
    class(paper_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! state, [lanes, states], at least
    logical, intent(in), optional :: in_motion    !! as in `observe_elements`
    integer :: b, i, l, n

    n = self%machine%bodies
    call observe_bodies(self, t, y, in_motion)
    do l = 1, self%lanes
      call elastic_moments(self%machine, self%state%elements, l, self%term)
      do i = 1, size(self%couplings)
        associate (moment => self%state%elements%restoring(l, self%couplings(i)))
          do b = 1, n
            moment = moment + self%moment_of_bodies(i, b) * (y(l, 2 * n + b) - self%term(b))
          end do
        end associate
      end do
    end do
  end subroutine observe

  !> lambda from eq. (12) with the accelerations of eq. (43).
  subroutine reactions(self, lane, lambda)
    class(paper_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: lambda(:)   !! [rows]

    self%term(:) = self%machine%inertia(lane, :) * self%slope(lane, :self%machine%bodies) - self%torque(lane, 1:)
    call self%machine%coordinates%reactions%find_reactions(lane, self%term, lambda)
  end subroutine reactions

end module nocdyn_paper
