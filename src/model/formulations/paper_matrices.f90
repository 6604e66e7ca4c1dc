!> The matrices and vectors of the paper, eqs. (13)-(72), for any machine of n bodies.
!>
!> They belong to one lane, at the values of the elements after `evaluate_elements` and `differentiate_elements` of a state. The
!> parts of a law beyond -K12 u - c u' (the rest twist of a coupling, the torque of a motor) are terms of Q. Every procedure
!> overwrites its last argument and allocates nothing.
module nocdyn_paper_matrices
  use nocdyn_bank, only: bank_t, role_bearing, role_clutch, role_coupling, role_crank, role_excitation, role_freewheel, &
    role_load, role_loss, role_motor, role_phase
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_solve
  use nocdyn_machine, only: machine_t
  implicit none (type, external)
  private

  public :: new_paper_matrices
  public :: inertia_matrix, torque_vector, stiffness_matrix, damping_matrix, tangent_matrix, elastic_moments
  public :: constrained_inertia, constrained_matrix, constrained_vector
  public :: stiffness_2, stiffness_3, extend_by_unit, extend_by_zero, append_zeros
  public :: unit_matrix, elastic_rates

  !> The inertias of one lane with n bodies; index 1 has size n, index 2 has 2n, index 3 has 3n.
  type, public :: inertia_matrices_t
    real(wp), allocatable :: inertia(:, :), inertia_1(:, :), inertia_2(:, :), inertia_3(:, :)   !! J, J_1, J_2, J_3
    real(wp), allocatable :: constraint(:, :)                                                   !! L_lambda, independent rows
  contains
    procedure :: assemble => assemble_inertia
  end type inertia_matrices_t

  !> The other matrices of eq. (43), and those from which they are made.
  type, public :: paper_matrices_t
    real(wp), allocatable :: stiffness(:, :), stiffness_1(:, :), stiffness_2(:, :), stiffness_3(:, :)   !! K, K_1, K_2, K_3
    real(wp), allocatable :: damping(:, :), damping_1(:, :), damping_2(:, :), damping_3(:, :)           !! C, C_1, C_2, C_3
    real(wp), allocatable :: torque(:), torque_1(:), torque_2(:), torque_3(:)                           !! Q, Q_1, Q_2, Q_3
    real(wp), allocatable :: tangent(:, :)   !! K_4
    real(wp), allocatable :: beta(:)         !! [omega; phi; F], then its derivative
    real(wp), allocatable, private :: term(:)   !! one term of Q, work space
  contains
    procedure :: assemble, solve
  end type paper_matrices_t

contains

  !> Matrices of n bodies, not yet set.
  type(paper_matrices_t) function new_paper_matrices(n) result(self)
    integer, intent(in) :: n

    allocate (self%stiffness(n, n), self%damping(n, n), self%torque(n), self%term(n), self%tangent(n, n))
    allocate (self%stiffness_1(n, n), self%damping_1(n, n), self%torque_1(n))
    allocate (self%stiffness_2(2 * n, 2 * n), self%damping_2(2 * n, 2 * n), self%torque_2(2 * n))
    allocate (self%stiffness_3(3 * n, 3 * n), self%damping_3(3 * n, 3 * n), self%torque_3(3 * n), self%beta(3 * n))
  end function new_paper_matrices

  !> J_1 to J_3, eqs. (13), (25), (35), (44), of one lane.
  subroutine assemble_inertia(self, machine, lane, complement)
    class(inertia_matrices_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    real(wp), intent(in) :: complement(:, :)   !! L_tau, [n, freedoms]
    integer :: b, g

    if (.not. allocated(self%inertia)) then
      associate (n => machine%bodies)
        allocate (self%inertia(n, n), self%inertia_1(n, n), self%inertia_2(2 * n, 2 * n), self%inertia_3(3 * n, 3 * n))
      end associate
    end if
    self%constraint = machine%constraints%block(lane, [(machine%groups(g)%kept, g=1, size(machine%groups))], &
                                                [(b, b=1, machine%bodies)])
    call inertia_matrix(machine, lane, self%inertia)
    call constrained_inertia(complement, self%inertia, self%constraint, self%inertia_1)
    call extend_by_unit(self%inertia_1, self%inertia_2)
    call extend_by_unit(self%inertia_2, self%inertia_3)
  end subroutine assemble_inertia

  !> The matrices of eqs. (16)-(72) of one lane, up to the matrices of eq. (43).
  subroutine assemble(self, machine, values, lane, complement)
    class(paper_matrices_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: values   !! of its elements
    integer, intent(in) :: lane
    real(wp), intent(in) :: complement(:, :)   !! L_tau, [n, freedoms]
    integer, parameter :: roles(*) = [role_coupling, role_load, role_motor, role_excitation, role_phase, role_clutch, &
                                   role_freewheel, role_crank, role_bearing, role_loss]
    integer :: i

    self%torque(:) = 0.0_wp
    do i = 1, size(roles)
      call torque_vector(machine, values, lane, roles(i), self%term)
      self%torque(:) = self%torque + self%term
    end do
    call stiffness_matrix(machine, values, lane, self%stiffness)
    call damping_matrix(machine, values, lane, self%damping)
    call tangent_matrix(machine, values, lane, self%tangent)
    call constrained_vector(complement, self%torque, self%torque_1)
    call constrained_matrix(complement, self%damping, self%damping_1)
    call constrained_matrix(complement, self%stiffness, self%stiffness_1)
    call append_zeros(self%torque_1, self%torque_2)
    call extend_by_zero(self%damping_1, self%damping_2)
    call stiffness_2(self%stiffness_1, self%stiffness_2)
    call append_zeros(self%torque_2, self%torque_3)
    call extend_by_zero(self%damping_2, self%damping_3)
    call stiffness_3(self%stiffness_2, self%tangent, self%stiffness_3)
  end subroutine assemble

  !> Eq. (43): replaces beta by its derivative.
  subroutine solve(self, factors, pivots)
    class(paper_matrices_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: factors(:, :)   !! LU factors of J_3, [3n, 3n]
    integer, contiguous, intent(in) :: pivots(:)        !! [3n]
    integer :: j

    do j = 1, size(self%beta)
      self%torque_3(:) = self%torque_3 + (self%damping_3(:, j) + self%stiffness_3(:, j)) * self%beta(j)
    end do
    self%beta(:) = self%torque_3
    call lu_solve(factors, pivots, self%beta)
  end subroutine solve

  !> J of eq. (13), [n, n].
  subroutine inertia_matrix(machine, lane, inertia)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    real(wp), intent(inout) :: inertia(:, :)   !! J [kg m2]
    integer :: b

    inertia = 0.0_wp
    do b = 1, machine%bodies
      inertia(b, b) = machine%inertia(lane, b)
    end do
  end subroutine inertia_matrix

  !> The terms of Q, eq. (16), from the banks of one role, [n]: Q_0 of eq. (17) from the excitations, Q_m of eqs. (18), (20)
  !> from the motors, and from couplings and loads the parts beyond K phi and C omega, and the moments of slipping joints.
  subroutine torque_vector(machine, values, lane, role, torque)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: values   !! of its elements
    integer, intent(in) :: lane
    integer, intent(in) :: role            !! role_... of nocdyn_bank
    real(wp), intent(inout) :: torque(:)   !! [N m]
    integer :: e, i

    torque = 0.0_wp
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%role /= role) cycle
        do e = bank%first, bank%last()
          call machine%elements%rows%add_moment(e, (values%restoring(lane, e) + secant(bank, values, lane, e) &
                                                                                * values%angle(lane, e)) &
                                                + (values%applied(lane, e) + viscous(bank, values, lane, e) &
                                                                             * values%speed(lane, e)), torque)
        end do
      end associate
    end do
  end subroutine torque_vector

  !> K of eq. (21) from the secant stiffnesses K12 of eq. (3), [n, n].
  subroutine stiffness_matrix(machine, values, lane, stiffness)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: values   !! of its elements
    integer, intent(in) :: lane
    real(wp), intent(inout) :: stiffness(:, :)   !! K [N m/rad]

    call sum_coefficients(machine, values, lane, secant, stiffness)
  end subroutine stiffness_matrix

  !> The matrix of all bodies of a coefficient of each element, which its moment has in proportion to its motion.
  subroutine sum_coefficients(machine, values, lane, coefficient, matrix)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: values   !! of its elements
    integer, intent(in) :: lane
    procedure(secant) :: coefficient
    real(wp), intent(inout) :: matrix(:, :)   !! [n, n]
    integer :: e, i

    matrix = 0.0_wp
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        do e = bank%first, bank%last()
          call machine%elements%rows%add_coefficient(e, coefficient(bank, values, lane, e), matrix)
        end do
      end associate
    end do
  end subroutine sum_coefficients

  !> K12 of eq. (3) of an element of a bank: the elastic moment of a coupling over its twist from rest; the derivative at rest,
  !> and of meshes whose teeth have errors [N m/rad].
  pure real(wp) function secant(bank, elements, lane, e)
    class(bank_t), intent(in) :: bank
    type(element_values_t), intent(in) :: elements
    integer, intent(in) :: lane, e             !! number of the element in the machine
    integer :: rest
    real(wp) :: twist

    secant = 0.0_wp
    if (bank%role /= role_coupling) return
    secant = -elements%restoring_angle(lane, e)
    rest = bank%number_of('rest_twist')
    twist = elements%angle(lane, e)
    if (rest > 0) twist = twist - bank%parameters(rest)%value(lane, e - bank%first + 1)
    if (abs(twist) > 0.0_wp .and. bank%ports == 1) secant = -elements%restoring(lane, e) / twist
  end function secant

  !> c of eq. (5) of an element of a bank: minus the derivative of the moment of a coupling or load by the speed [N m s/rad].
  pure real(wp) function viscous(bank, elements, lane, e)
    class(bank_t), intent(in) :: bank
    type(element_values_t), intent(in) :: elements
    integer, intent(in) :: lane, e             !! number of the element in the machine

    viscous = 0.0_wp
    if (any(bank%role == [role_coupling, role_load])) viscous = -elements%applied_speed(lane, e)
  end function viscous

  !> C of eq. (22) from loads and the damping of couplings, [n, n].
  subroutine damping_matrix(machine, values, lane, damping)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: values   !! of its elements
    integer, intent(in) :: lane
    real(wp), intent(inout) :: damping(:, :)   !! C [N m s/rad]

    call sum_coefficients(machine, values, lane, viscous, damping)
  end subroutine damping_matrix

  !> K_4 of eqs. (62)-(72) from the tangent stiffnesses K1 + 3 k1 w^2, [n, n]; the derivative of the elastic moments is
  !> F' = K_4 omega, eqs. (47), (52)-(56).
  subroutine tangent_matrix(machine, values, lane, tangent)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: values   !! of its elements
    integer, intent(in) :: lane
    real(wp), intent(inout) :: tangent(:, :)   !! K_4 [N m/rad]
    integer :: i

    tangent = 0.0_wp
    call machine%elements%rows%add_coefficients(-1.0_wp, values%restoring_angle(lane, :), tangent)
    associate (cross => machine%elements%cross)
      do i = 1, cross%count
        call machine%elements%rows%add_product(cross%element(i), cross%by(i), values%cross%restoring_angle(lane, i), tangent)
      end do
    end associate
  end subroutine tangent_matrix

  !> F of eqs. (48)-(51): the elastic moment on each body [N m], [n].
  subroutine elastic_moments(machine, values, lane, moments)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: values   !! of its elements
    integer, intent(in) :: lane
    real(wp), intent(inout) :: moments(:)   !! F [N m]
    integer :: e

    moments = 0.0_wp
    do e = 1, machine%elements%count
      call machine%elements%rows%add_moment(e, values%restoring(lane, e), moments)
    end do
  end subroutine elastic_moments

  !> F' of eqs. (47), (52)-(57): K_4 omega, [n].
  subroutine elastic_rates(tangent, omega, rates)
    real(wp), intent(in) :: tangent(:, :)   !! K_4, [n, n]
    real(wp), intent(in) :: omega(:)        !! [rad/s], [n]
    real(wp), intent(inout) :: rates(:)     !! F' [N m/s]
    integer :: j

    rates = 0.0_wp
    do j = 1, size(omega)
      rates = rates + tangent(:, j) * omega(j)
    end do
  end subroutine elastic_rates

  !> J_1 of eq. (25): [L_tau^T J; L_lambda], [n, n].
  subroutine constrained_inertia(complement, inertia, constraint, inertia_1)
    real(wp), intent(in) :: complement(:, :)     !! L_tau, [n, freedoms]
    real(wp), intent(in) :: inertia(:, :)        !! J, [n, n]
    real(wp), intent(in) :: constraint(:, :)     !! L_lambda, [n - freedoms, n]
    real(wp), intent(inout) :: inertia_1(:, :)   !! J_1

    call constrained_matrix(complement, inertia, inertia_1)
    inertia_1(size(complement, 2) + 1:, :) = constraint
  end subroutine constrained_inertia

  !> C_1 of eq. (29) and K_1 of eq. (30): [L_tau^T M; 0], [n, n].
  subroutine constrained_matrix(complement, matrix, matrix_1)
    real(wp), intent(in) :: complement(:, :)    !! L_tau, [n, freedoms]
    real(wp), intent(in) :: matrix(:, :)        !! C or K, [n, n]
    real(wp), intent(inout) :: matrix_1(:, :)   !! C_1 or K_1
    integer :: j

    do j = 1, size(matrix, 2)
      call constrained_vector(complement, matrix(:, j), matrix_1(:, j))
    end do
  end subroutine constrained_matrix

  !> Q_1, Q_0^1, Q_m^1 of eqs. (26)-(28): [L_tau^T Q; 0], [n].
  subroutine constrained_vector(complement, vector, vector_1)
    real(wp), intent(in) :: complement(:, :)   !! L_tau, [n, freedoms]
    real(wp), intent(in) :: vector(:)          !! Q, Q_0 or Q_m [N m], [n]
    real(wp), intent(inout) :: vector_1(:)     !! Q_1, Q_0^1 or Q_m^1 [N m]
    integer :: i

    vector_1 = 0.0_wp
    do i = 1, size(complement, 2)
      vector_1(i) = dot_product(complement(:, i), vector)
    end do
  end subroutine constrained_vector

  !> I of eq. (36).
  subroutine unit_matrix(matrix)
    real(wp), intent(inout) :: matrix(:, :)   !! [n, n]
    integer :: i

    matrix = 0.0_wp
    do i = 1, size(matrix, 1)
      matrix(i, i) = 1.0_wp
    end do
  end subroutine unit_matrix

  !> diag(block, I): J_2 = diag(J_1, I) of eq. (35), [2n, 2n], and J_3 = diag(J_2, I) of eq. (44), [3n, 3n].
  pure subroutine extend_by_unit(block, matrix)
    real(wp), intent(in) :: block(:, :)   !! J_1 or J_2
    real(wp), intent(inout) :: matrix(:, :)   !! J_2 or J_3
    integer :: i

    call extend_by_zero(block, matrix)
    do i = size(block, 1) + 1, size(matrix, 1)
      matrix(i, i) = 1.0_wp
    end do
  end subroutine extend_by_unit

  !> diag(block, 0) with the zero matrix of eq. (37): C_2 of eq. (38), [2n, 2n], and C_3 of eq. (60), [3n, 3n].
  pure subroutine extend_by_zero(block, matrix)
    real(wp), intent(in) :: block(:, :)   !! C_1 or C_2
    real(wp), intent(inout) :: matrix(:, :)   !! C_2 or C_3

    matrix = 0.0_wp
    matrix(:size(block, 1), :size(block, 2)) = block
  end subroutine extend_by_zero

  !> [upper; 0] with the zero vector of eq. (59): Q_2 of eq. (40), [2n], and Q_3 of eq. (58), [3n].
  pure subroutine append_zeros(upper, vector)
    real(wp), intent(in) :: upper(:)   !! Q_1 or Q_2
    real(wp), intent(inout) :: vector(:)   !! Q_2 or Q_3

    vector = 0.0_wp
    vector(:size(upper)) = upper
  end subroutine append_zeros

  !> K_2 of eq. (39): [0, K_1; I, 0], [2n, 2n].
  subroutine stiffness_2(stiffness_1, matrix)
    real(wp), intent(in) :: stiffness_1(:, :)   !! K_1, [n, n]
    real(wp), intent(inout) :: matrix(:, :)   !! K_2, [2n, 2n]
    integer :: i, n

    n = size(stiffness_1, 1)
    matrix = 0.0_wp
    matrix(:n, n + 1:) = stiffness_1
    do i = 1, n
      matrix(n + i, i) = 1.0_wp
    end do
  end subroutine stiffness_2

  !> K_3 of eq. (61): [K_2, 0; (K_4, 0), 0], K_4 acting on omega, [3n, 3n].
  subroutine stiffness_3(matrix_2, tangent, matrix)
    real(wp), intent(in) :: matrix_2(:, :)   !! K_2, [2n, 2n]
    real(wp), intent(in) :: tangent(:, :)    !! K_4, [n, n]
    real(wp), intent(inout) :: matrix(:, :)   !! K_3, [3n, 3n]

    call extend_by_zero(matrix_2, matrix)
    matrix(size(matrix_2, 1) + 1:, :size(tangent, 2)) = tangent
  end subroutine stiffness_3

end module nocdyn_paper_matrices
