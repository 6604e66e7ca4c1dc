!> Every matrix and vector of the paper for a machine at its start, labelled with equation numbers.
module nocdyn_matrix_report
  use nocdyn_bank, only: role_coupling, role_excitation, role_load, role_motor
  use nocdyn_complement, only: coordinate_selector, extended_constraint
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_paper_matrices, only: constrained_inertia, constrained_matrix, constrained_vector, damping_2, damping_3, &
                                   damping_matrix, elastic_moments, inertia_2, inertia_3, inertia_matrix, stiffness_2, &
                                   stiffness_3, stiffness_matrix, tangent_matrix, torque_2, torque_3, torque_vector
  use nocdyn_text, only: joined, rounded_text, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none
  private

  public :: matrix_report

  integer, parameter :: digits = 7   ! significant digits printed

contains

  !> The report as lines of text; the machine is at its start angles and speeds, the time is `t_start`.
  function matrix_report(machine, t_start) result(text)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t_start   !! [s]
    character(len=:), allocatable :: text
    type(machine_t) :: placed
    type(text_buffer_t) :: report
    real(wp), dimension(machine%bodies, machine%bodies) :: inertia, damping, stiffness, tangent
    real(wp), dimension(machine%bodies) :: torque

    placed = machine
    call place(placed, t_start)
    call report%append_line('Bodies 1 to ' // to_text(machine%bodies) // ': ' // joined(machine%names, ', '))
    call report%append_line('Coordinates: ' // joined(machine%names(machine%coordinates%body), ', '))
    call report%append_line('At the start: t = ' // rounded_text(t_start, digits) // ' s')
    call inertia_matrix(placed, 1, inertia)
    call damping_matrix(placed, 1, damping)
    call stiffness_matrix(placed, 1, stiffness)
    call tangent_matrix(placed, 1, tangent)
    call report_free_bodies(report, placed, inertia, damping, stiffness, torque)
    call report_constraints(report, placed)
    call report_constrained(report, placed, inertia, damping, stiffness, tangent, torque)
    text = report%text()
  end function matrix_report

  !> Brings all elements of the machine to the start.
  subroutine place(machine, t_start)
    type(machine_t), intent(inout) :: machine
    real(wp), intent(in) :: t_start
    real(wp), dimension(1, 0:machine%bodies) :: phi, omega
    integer :: i

    phi = 0.0_wp
    omega = 0.0_wp
    phi(:, 1:) = machine%start_angle
    omega(:, 1:) = machine%start_speed
    call machine%differentiate([t_start], phi, omega)
    do i = 1, size(machine%banks)
      call machine%banks(i)%bank%assess()
    end do
  end subroutine place

  !> Section 4, the bodies before the constraints: eqs. (13)-(23).
  subroutine report_free_bodies(report, machine, inertia, damping, stiffness, torque)
    type(text_buffer_t), intent(inout) :: report
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: inertia(:, :), damping(:, :), stiffness(:, :)
    real(wp), intent(inout) :: torque(:)   !! the whole Q
    real(wp) :: term(machine%bodies)

    call put_matrix(report, '(13) J [kg m2]', inertia)
    call put_vector(report, '(15) omega [rad/s]', machine%start_speed(1, :))
    torque = 0.0_wp
    call torque_vector(machine, 1, role_excitation, term)
    call put_vector(report, '(17) Q_0, excitations [N m]', term)
    torque = torque + term
    call torque_vector(machine, 1, role_motor, term)
    call put_vector(report, '(18), (20) Q_m, motors [N m]', term)
    torque = torque + term
    call torque_vector(machine, 1, role_coupling, term)
    call put_vector(report, 'K12 * rest twist of the couplings, a further term of Q [N m]', term)
    torque = torque + term
    call torque_vector(machine, 1, role_load, term)
    torque = torque + term
    call put_vector(report, '(16) Q [N m]', torque)
    call put_vector(report, '(19) phi [rad]', machine%start_angle(1, :))
    call put_matrix(report, '(21) K, secant stiffness [N m/rad]', stiffness)
    call put_matrix(report, '(22) C [N m s/rad]', damping)
  end subroutine report_free_bodies

  !> Section 5: L_lambda and how the complement comes from it, eqs. (23), (31), (73)-(82).
  subroutine report_constraints(report, machine)
    type(text_buffer_t), intent(inout) :: report
    type(machine_t), intent(in) :: machine
    real(wp) :: constraint(machine%bodies - machine%coordinates%freedoms, machine%bodies)

    constraint = kept_constraint(machine)
    call put_matrix(report, '(23), (74) L_lambda, independent rows', constraint)
    call put_matrix(report, '(78) L_lambda^ext', extended_constraint(constraint, machine%coordinates%body))
    call put_matrix(report, '(79) l_lambda', coordinate_selector(machine%bodies, machine%coordinates%freedoms))
    call put_matrix(report, '(31), (81)-(83) L_tau', machine%coordinates%complement(1))
  end subroutine report_constraints

  function kept_constraint(machine) result(constraint)
    type(machine_t), intent(in) :: machine
    real(wp) :: constraint(machine%bodies - machine%coordinates%freedoms, machine%bodies)
    integer :: b, g

    constraint = machine%constraints%block(1, [(machine%groups(g)%kept, g=1, size(machine%groups))], &
                                           [(b, b=1, machine%bodies)])
  end function kept_constraint

  !> The projected system and the first-order systems that follow from it, eqs. (24)-(72).
  subroutine report_constrained(report, machine, inertia, damping, stiffness, tangent, torque)
    type(text_buffer_t), intent(inout) :: report
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: inertia(:, :), damping(:, :), stiffness(:, :), tangent(:, :), torque(:)
    real(wp) :: complement(machine%bodies, machine%coordinates%freedoms)
    real(wp), dimension(machine%bodies, machine%bodies) :: inertia_of_1, damping_of_1, stiffness_of_1
    real(wp), dimension(machine%bodies) :: torque_of_1, moments

    complement = machine%coordinates%complement(1)
    call constrained_inertia(complement, inertia, kept_constraint(machine), inertia_of_1)
    call constrained_matrix(complement, damping, damping_of_1)
    call constrained_matrix(complement, stiffness, stiffness_of_1)
    call constrained_vector(complement, torque, torque_of_1)
    call put_matrix(report, '(25) J_1', inertia_of_1)
    call put_vector(report, '(26)-(28) Q_1', torque_of_1)
    call put_matrix(report, '(29) C_1', damping_of_1)
    call put_matrix(report, '(30) K_1', stiffness_of_1)
    call report_first_order(report, inertia_of_1, damping_of_1, stiffness_of_1, torque_of_1, tangent)
    call elastic_moments(machine, 1, moments)
    call put_vector(report, '(48)-(51) F, elastic moments on the bodies [N m]', moments)
    call put_vector(report, "(47), (52)-(56) F' = K_4 omega [N m/s]", matmul(tangent, machine%start_speed(1, :)))
    call put_matrix(report, '(62)-(72) K_4, tangent stiffness [N m/rad]', tangent)
  end subroutine report_constrained

  !> Eqs. (34)-(40) for alpha = [omega; phi] and (43)-(61) for beta = [omega; phi; F].
  subroutine report_first_order(report, inertia, damping, stiffness, torque, tangent)
    type(text_buffer_t), intent(inout) :: report
    real(wp), intent(in) :: inertia(:, :), damping(:, :), stiffness(:, :), torque(:), tangent(:, :)
    real(wp), dimension(2 * size(torque), 2 * size(torque)) :: inertia_of_2, damping_of_2, stiffness_of_2
    real(wp), dimension(3 * size(torque), 3 * size(torque)) :: matrix
    real(wp) :: torque_of_2(2 * size(torque)), vector(3 * size(torque))

    call inertia_2(inertia, inertia_of_2)
    call damping_2(damping, damping_of_2)
    call stiffness_2(stiffness, stiffness_of_2)
    call torque_2(torque, torque_of_2)
    call put_matrix(report, '(35) J_2', inertia_of_2)
    call put_matrix(report, '(38) C_2', damping_of_2)
    call put_matrix(report, '(39) K_2', stiffness_of_2)
    call put_vector(report, '(40) Q_2', torque_of_2)
    call inertia_3(inertia_of_2, matrix)
    call put_matrix(report, '(44) J_3', matrix)
    call torque_3(torque_of_2, vector)
    call put_vector(report, '(58) Q_3', vector)
    call damping_3(damping_of_2, matrix)
    call put_matrix(report, '(60) C_3', matrix)
    call stiffness_3(stiffness_of_2, tangent, matrix)
    call put_matrix(report, '(61) K_3', matrix)
  end subroutine report_first_order

  subroutine put_vector(report, label, vector)
    type(text_buffer_t), intent(inout) :: report
    character(len=*), intent(in) :: label
    real(wp), intent(in) :: vector(:)

    call put_matrix(report, label // ', transposed', reshape(vector, [1, size(vector)]))
  end subroutine put_vector

  !> A blank line, the label with the shape, and the rows with their columns aligned.
  subroutine put_matrix(report, label, matrix)
    type(text_buffer_t), intent(inout) :: report
    character(len=*), intent(in) :: label
    real(wp), intent(in) :: matrix(:, :)
    integer :: i, j, width
    character(len=:), allocatable :: number

    call report%append_line('')
    call report%append_line(label // ' (' // to_text(size(matrix, 1)) // ' x ' // to_text(size(matrix, 2)) // ')')
    width = 0
    do j = 1, size(matrix, 2)
      do i = 1, size(matrix, 1)
        width = max(width, len(rounded_text(matrix(i, j), digits)))
      end do
    end do
    do i = 1, size(matrix, 1)
      do j = 1, size(matrix, 2)
        number = rounded_text(matrix(i, j), digits)
        call report%append(repeat(' ', width + 2 - len(number)) // number)
      end do
      call report%append_line('')
    end do
  end subroutine put_matrix

end module nocdyn_matrix_report
