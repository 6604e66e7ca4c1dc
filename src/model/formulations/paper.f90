!> The paper's formulation, eq. (43): J_3 beta' = Q_3 + C_3 beta + K_3 beta with beta = [omega; phi; F], as written.
module nocdyn_paper
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_bank, only: role_coupling, role_excitation, role_load, role_motor
  use nocdyn_body_formulation, only: body_formulation_t, jacobian_of_bodies, observe_bodies, start_of_bodies
  use nocdyn_element_sets, only: coupling_elements
  use nocdyn_incidence, only: add_coefficient, add_moment
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_paper_matrices, only: append_zeros, constrained_inertia, constrained_matrix, constrained_vector, &
                                   damping_matrix, elastic_moments, extend_by_unit, extend_by_zero, inertia_matrix, &
                                   stiffness_2, stiffness_3, stiffness_matrix, tangent_matrix, torque_vector
  implicit none (type, external)
  private

  public :: new_paper

  !> Work space for the matrices of one lane with n bodies; index 1 has size n, index 2 has 2n, index 3 has 3n.
  type :: matrices_t
    real(wp), allocatable :: stiffness(:, :), stiffness_1(:, :), stiffness_2(:, :), stiffness_3(:, :)   !! K, K_1, K_2, K_3
    real(wp), allocatable :: damping(:, :), damping_1(:, :), damping_2(:, :), damping_3(:, :)           !! C, C_1, C_2, C_3
    real(wp), allocatable :: torque(:), torque_1(:), torque_2(:), torque_3(:)                           !! Q, Q_1, Q_2, Q_3
    real(wp), allocatable :: term(:)         !! one term of Q
    real(wp), allocatable :: tangent(:, :)   !! K_4
    real(wp), allocatable :: beta(:)         !! [omega; phi; F], then its derivative
  end type matrices_t

  !> A machine in the paper's formulation, with the factors of J_3.
  type, extends(body_formulation_t), public :: paper_t
    real(wp), allocatable, private :: complement(:, :, :)      !! L_tau, [n, freedoms, lanes]
    real(wp), allocatable, private :: factors(:, :, :)         !! LU of J_3, [3n, 3n, lanes]
    integer, allocatable, private :: pivots(:, :)              !! [3n, lanes]
    integer, allocatable, private :: couplings(:)              !! elements of the role coupling
    real(wp), allocatable, private :: moment_of_bodies(:, :)   !! coupling moments from body moments, [couplings, n]
    type(matrices_t), private :: work
  contains
    procedure :: derivative
    procedure :: jacobian
    procedure :: start
    procedure :: observe
    procedure :: reactions
  end type paper_t

contains

  !> The formulation of a machine. J_3 is assembled and factored here.
  function new_paper(machine, with_energy_balance) result(self)
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: with_energy_balance   !! whether the powers of the elements `machine%with_work` are integrated
    type(paper_t) :: self
    integer :: b, g, l, n
    logical :: is_singular
    real(wp) :: inertia(machine%bodies, machine%bodies), inertia_of_1(machine%bodies, machine%bodies)
    real(wp) :: inertia_of_2(2 * machine%bodies, 2 * machine%bodies)

    n = machine%bodies
    call self%set_machine('paper', machine, 3 * n, with_energy_balance)
    call allocate_matrices(n, self%work)
    allocate (self%complement(n, machine%coordinates%freedoms, machine%lanes))
    allocate (self%factors(3 * n, 3 * n, machine%lanes), self%pivots(3 * n, machine%lanes))
    do l = 1, machine%lanes
      self%complement(:, :, l) = machine%coordinates%complement(l)
      call inertia_matrix(machine, l, inertia)
      call constrained_inertia(self%complement(:, :, l), inertia, &
                               machine%constraints%block(l, [(machine%groups(g)%kept, g=1, size(machine%groups))], &
                                                         [(b, b=1, n)]), inertia_of_1)
      call extend_by_unit(inertia_of_1, inertia_of_2)
      call extend_by_unit(inertia_of_2, self%factors(:, :, l))
      call lu_factor(self%factors(:, :, l), self%pivots(:, l), is_singular)
      if (is_singular) self%factors(:, :, l) = ieee_value(1.0_wp, ieee_quiet_nan)   ! by rounding: the integration does not start
    end do
    allocate (self%couplings, source=coupling_elements(machine))
    self%moment_of_bodies = pseudo_inverse(coupling_incidence(machine, self%couplings), 1.0e-10_wp)
  end function new_paper

  !> Allocates the work space.
  subroutine allocate_matrices(n, work)
    integer, intent(in) :: n   !! bodies
    type(matrices_t), intent(inout) :: work

    allocate (work%stiffness(n, n), work%damping(n, n), work%torque(n), work%term(n), work%tangent(n, n))
    allocate (work%stiffness_1(n, n), work%damping_1(n, n), work%torque_1(n))
    allocate (work%stiffness_2(2 * n, 2 * n), work%damping_2(2 * n, 2 * n), work%torque_2(2 * n))
    allocate (work%stiffness_3(3 * n, 3 * n), work%damping_3(3 * n, 3 * n), work%torque_3(3 * n), work%beta(3 * n))
  end subroutine allocate_matrices

  !> Matrix that gives the moments on the bodies from the restoring moments of the couplings, [n, couplings].
  function coupling_incidence(machine, couplings) result(incidence)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: couplings(:)   !! numbers of the elements
    real(wp) :: incidence(machine%bodies, size(couplings))
    integer :: i

    incidence = 0.0_wp
    do i = 1, size(couplings)
      call add_moment(machine%elements%from(couplings(i)), machine%elements%to(couplings(i)), 1.0_wp, incidence(:, i))
    end do
  end function coupling_incidence

  !> beta at the start. F are the elastic moments at the start angles, eqs. (48)-(51).
  function start(self) result(y)
    class(paper_t), intent(in) :: self
    real(wp), allocatable :: y(:, :)
    type(machine_t) :: machine
    real(wp) :: t(self%lanes), moments(self%machine%bodies)
    real(wp), dimension(self%lanes, 0:self%machine%bodies) :: phi, omega, torque
    integer :: l, n

    y = start_of_bodies(self)
    n = self%machine%bodies
    phi = 0.0_wp
    omega = 0.0_wp
    t = 0.0_wp
    phi(:, 1:) = self%machine%start_angle
    machine = self%machine
    if (self%internal > 0) machine%elements%internal%value = machine%start_internal()
    call machine%elements%gather(phi, omega)
    call machine%choose_branches(t)
    call machine%evaluate(t, phi, omega, torque)
    do l = 1, self%lanes
      call elastic_moments(machine, l, moments)
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
    call self%machine%evaluate(t, self%phi, self%omega, self%torque)
    call self%machine%evaluate_energies()
    call self%machine%differentiate_elements(t)
    do l = 1, self%lanes
      call assemble(self%machine, l, self%complement(:, :, l), self%work)
      self%work%beta(:) = y(l, :3 * n)
      call solve_generalised_system(self%factors(:, :, l), self%pivots(:, l), self%work)
      dydt(l, :3 * n) = self%work%beta
    end do
    if (self%internal > 0) dydt(:, self%mechanical + 1:self%states) = self%machine%elements%internal%rate
    if (self%quadratures > 0) call self%machine%power(dydt(:, self%states + 1:))
  end subroutine derivative

  !> The matrices of eqs. (16)-(72) of one lane, up to those of eq. (43).
  subroutine assemble(machine, lane, complement, work)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    real(wp), intent(in) :: complement(:, :)   !! L_tau, [n, freedoms]
    type(matrices_t), intent(inout) :: work
    integer, parameter :: roles(4) = [role_coupling, role_load, role_motor, role_excitation]
    integer :: i

    work%torque(:) = 0.0_wp
    do i = 1, size(roles)
      call torque_vector(machine, lane, roles(i), work%term)
      work%torque(:) = work%torque + work%term
    end do
    call stiffness_matrix(machine, lane, work%stiffness)
    call damping_matrix(machine, lane, work%damping)
    call tangent_matrix(machine, lane, work%tangent)
    call constrained_vector(complement, work%torque, work%torque_1)
    call constrained_matrix(complement, work%damping, work%damping_1)
    call constrained_matrix(complement, work%stiffness, work%stiffness_1)
    call append_zeros(work%torque_1, work%torque_2)
    call extend_by_zero(work%damping_1, work%damping_2)
    call stiffness_2(work%stiffness_1, work%stiffness_2)
    call append_zeros(work%torque_2, work%torque_3)
    call extend_by_zero(work%damping_2, work%damping_3)
    call stiffness_3(work%stiffness_2, work%tangent, work%stiffness_3)
  end subroutine assemble

  !> Eq. (43): replaces beta by its derivative.
  subroutine solve_generalised_system(factors, pivots, work)
    real(wp), contiguous, intent(in) :: factors(:, :)   !! LU factors of J_3, [3n, 3n]
    integer, contiguous, intent(in) :: pivots(:)        !! [3n]
    type(matrices_t), intent(inout) :: work
    integer :: j

    do j = 1, size(work%beta)
      work%torque_3(:) = work%torque_3 + (work%damping_3(:, j) + work%stiffness_3(:, j)) * work%beta(j)
    end do
    work%beta(:) = work%torque_3
    call lu_solve(factors, pivots, work%beta)
  end subroutine solve_generalised_system

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
    associate (elements => self%machine%elements)
      do l = 1, self%lanes
        call tangent_matrix(self%machine, l, self%work%tangent)
        dfdy(l, 2 * n + 1:3 * n, :n) = self%work%tangent
        self%work%tangent(:, :) = 0.0_wp
        do e = 1, size(elements%to)
          call add_coefficient(elements%from(e), elements%to(e), -elements%restoring_curvature(l, e) * elements%speed(l, e), &
                               self%work%tangent)
        end do
        dfdy(l, 2 * n + 1:3 * n, n + 1:2 * n) = self%work%tangent
      end do
    end associate
  end subroutine fill_moment_rows

  !> Evaluates the machine at a state, with the moments of the couplings from the states F.
  !>
  !> Where the couplings form no loop, F determines their moments. Elsewhere the moments are those nearest to the laws' among all
  !> that add up to F on the bodies.
  subroutine observe(self, t, y)
    class(paper_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! state, [lanes, states], at least
    integer :: b, i, l, n

    n = self%machine%bodies
    call observe_bodies(self, t, y)
    do l = 1, self%lanes
      call elastic_moments(self%machine, l, self%work%term)
      do i = 1, size(self%couplings)
        associate (moment => self%machine%elements%restoring(l, self%couplings(i)))
          do b = 1, n
            moment = moment + self%moment_of_bodies(i, b) * (y(l, 2 * n + b) - self%work%term(b))
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

    self%work%term(:) = self%machine%inertia(lane, :) * self%slope(lane, :self%machine%bodies) - self%torque(lane, 1:)
    call self%machine%coordinates%reactions_of_imbalances(lane, self%work%term, lambda)
  end subroutine reactions

end module nocdyn_paper
