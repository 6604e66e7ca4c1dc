!> Every matrix and vector of the paper for a machine at its start, labelled with equation numbers: the ones of
!> `nocdyn_paper_matrices`, and alpha, eqs. (41), (42), and beta, eqs. (45), (46), with phi' = omega, eqs. (32), (33).
module nocdyn_matrix_report
  use nocdyn_bank, only: role_coupling, role_excitation, role_motor, role_names, role_phase
  use nocdyn_complement, only: coordinate_selector, extended_constraint
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t, new_machine_state
  use nocdyn_paper_matrices, only: constrained_vector, elastic_moments, elastic_rates, inertia_matrices_t, new_paper_matrices, &
                                   paper_matrices_t, torque_vector, unit_matrix
  use nocdyn_text, only: append, joined, rounded_text, selected, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: matrix_report

  integer, parameter :: digits = 7   ! significant digits printed

  !> The matrices, and the report that they are written to.
  type :: equations_t
    type(machine_state_t) :: state   !! of the machine at its start
    type(inertia_matrices_t) :: inertias
    type(paper_matrices_t) :: matrices
    real(wp), allocatable :: complement(:, :)     !! L_tau
    real(wp), allocatable :: excitation(:), motor(:), rest(:)   !! Q_0, Q_m, the term of Q from rest twists
    type(text_buffer_t) :: report
    type(error_t), allocatable :: error   !! on the first matrix that has no finite numbers
  contains
    procedure :: put_matrix, put_vector
  end type equations_t

contains

  !> The report as lines of text, for the machine at its start angles and speeds.
  subroutine matrix_report(machine, t_start, text, error)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t_start   !! time [s]
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error   !! a number is not finite
    type(equations_t) :: equations
    type(string_t), allocatable :: names(:)
    integer :: i, role

    call set_start_state(machine, t_start, equations%state)
    call assemble(machine, equations)
    call equations%report%append_line('Bodies 1 to ' // to_text(machine%bodies) // ': ' // joined(machine%names, ', '))
    call equations%report%append_line('Coordinates: ' // joined(selected(machine%names, machine%coordinates%body), ', '))
    call equations%report%append_line('At the start: t = ' // rounded_text(t_start, digits) // ' s')
    if (.not. all([(machine%banks(i)%bank%has_paper_law, i=1, size(machine%banks))])) then
      ! lists the elements whose laws are not the ones of the paper, and says what the matrices contain for them
      do role = 1, size(role_names)
        call collect_other_laws(machine, role, names)
        if (size(names) == 0) cycle
        call equations%report%append_line('Other laws than those of the paper: ' // trim(role_names(role)) // ' ' // &
                                          joined(names, ', '))
      end do
      call equations%report%append_line('For these K holds the elastic moment divided by the twist, K_4 its derivative, C minus')
      call equations%report%append_line('the derivative by the speed, Q the rest, all at the start. Currents and governors are')
      call equations%report%append_line('not in beta.')
    end if
    ! The bodies before the constraints: eqs. (13)-(22).
    call equations%put_matrix('(13) J [kg m2]', equations%inertias%inertia)
    call equations%put_vector('(15) omega [rad/s]', machine%start_speed(1, :))
    call equations%put_vector('(17) Q_0, excitations [N m]', equations%excitation)
    call equations%put_vector('(18), (20) Q_m, motors [N m]', equations%motor)
    call equations%put_vector('K12 * rest twist of the couplings, a further term of Q [N m]', equations%rest)
    call equations%put_vector('(16) Q [N m]', equations%matrices%torque)
    call equations%put_vector('(19) phi [rad]', machine%start_angle(1, :))
    call equations%put_matrix('(21) K, secant stiffness [N m/rad]', equations%matrices%stiffness)
    call equations%put_matrix('(22) C [N m s/rad]', equations%matrices%damping)
    call report_constraints(machine, equations)
    call report_projection(machine, equations)
    call report_first_order(machine, equations)
    call report_moments_as_states(machine, equations)
    text = equations%report%text()
    call move_alloc(equations%error, error)
  end subroutine matrix_report

  subroutine collect_other_laws(machine, role, names)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: role
    type(string_t), allocatable, intent(out) :: names(:)
    integer :: e, i

    allocate (names(0))
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%has_paper_law .or. bank%role /= role) cycle
        do e = 1, size(bank%names)
          call append(names, bank%names(e)%text)
        end do
      end associate
    end do
  end subroutine collect_other_laws

  !> Evaluates all elements at the start.
  subroutine set_start_state(machine, t_start, state)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t_start   !! [s]
    type(machine_state_t), intent(out) :: state
    real(wp), dimension(1, 0:machine%bodies) :: phi, omega

    phi = 0.0_wp
    omega = 0.0_wp
    phi(:, 1:) = machine%start_angle
    omega(:, 1:) = machine%start_speed
    state = new_machine_state(machine)
    state%elements%internal%value = machine%start_internal()
    call state%elements%gather(machine%elements%rows, phi, omega)
    call state%choose_branches(machine, [t_start])
    call state%evaluate_elements(machine, [t_start])
    call state%differentiate_elements(machine, [t_start])
  end subroutine set_start_state

  subroutine assemble(machine, equations)
    type(machine_t), intent(in) :: machine
    type(equations_t), intent(inout) :: equations
    real(wp) :: of_phases(machine%bodies)

    allocate (equations%complement, source=machine%coordinates%complement(1))
    call equations%inertias%assemble(machine, 1, equations%complement)
    equations%matrices = new_paper_matrices(machine%bodies)
    call equations%matrices%assemble(machine, equations%state%elements, 1, equations%complement)
    allocate (equations%excitation(machine%bodies), equations%motor(machine%bodies), equations%rest(machine%bodies))
    call torque_vector(machine, equations%state%elements, 1, role_excitation, equations%excitation)
    call torque_vector(machine, equations%state%elements, 1, role_motor, equations%motor)
    call torque_vector(machine, equations%state%elements, 1, role_coupling, equations%rest)
    call torque_vector(machine, equations%state%elements, 1, role_phase, of_phases)
    equations%rest = equations%rest + of_phases
  end subroutine assemble

  !> L_lambda and the complement that follows from it: eqs. (23), (31), (73)-(83).
  subroutine report_constraints(machine, equations)
    type(machine_t), intent(in) :: machine
    type(equations_t), intent(inout) :: equations
    real(wp) :: coordinate_speed(machine%coordinates%freedoms)

    associate (coordinates => machine%coordinates, &
               constraint => equations%inertias%constraint)
      call equations%put_matrix('(23), (74) L_lambda, independent rows', constraint)
      call coordinates%project(1, machine%inertia(1, :), machine%start_speed(1, :), coordinate_speed)
      call equations%put_vector("(77) q' [rad/s]", coordinate_speed)
      call equations%put_matrix('(78) L_lambda^ext', extended_constraint(constraint, coordinates%body))
      call equations%put_matrix('(79) l_lambda', coordinate_selector(machine%bodies, coordinates%freedoms))
      call equations%put_matrix('(31), (81)-(83) L_tau', equations%complement)
    end associate
  end subroutine report_constraints

  !> The projected system: eqs. (24)-(30).
  subroutine report_projection(machine, equations)
    type(machine_t), intent(in) :: machine
    type(equations_t), intent(inout) :: equations
    real(wp) :: projected(machine%bodies)

    call equations%put_matrix('(25) J_1', equations%inertias%inertia_1)
    call equations%put_vector('(26) Q_1', equations%matrices%torque_1)
    call constrained_vector(equations%complement, equations%excitation, projected)
    call equations%put_vector('(27) Q_0^1', projected)
    call constrained_vector(equations%complement, equations%motor, projected)
    call equations%put_vector('(28) Q_m^1', projected)
    call equations%put_matrix('(29) C_1', equations%matrices%damping_1)
    call equations%put_matrix('(30) K_1', equations%matrices%stiffness_1)
  end subroutine report_projection

  !> The system of first order for alpha = [omega; phi]: eqs. (34)-(42).
  subroutine report_first_order(machine, equations)
    type(machine_t), intent(in) :: machine
    type(equations_t), intent(inout) :: equations
    real(wp) :: block(machine%bodies, machine%bodies)

    call equations%put_matrix('(35) J_2', equations%inertias%inertia_2)
    call unit_matrix(block)
    call equations%put_matrix('(36) I', block)
    block = 0.0_wp
    call equations%put_matrix('(37) 0', block)
    call equations%put_matrix('(38) C_2', equations%matrices%damping_2)
    call equations%put_matrix('(39) K_2', equations%matrices%stiffness_2)
    call equations%put_vector('(40) Q_2', equations%matrices%torque_2)
    call equations%put_vector('(42) alpha', [machine%start_speed(1, :), machine%start_angle(1, :)])
  end subroutine report_first_order

  !> The generalised system for beta = [omega; phi; F] and its solution: eqs. (43)-(72).
  subroutine report_moments_as_states(machine, equations)
    type(machine_t), intent(in) :: machine
    type(equations_t), intent(inout) :: equations
    real(wp) :: moments(machine%bodies)

    associate (matrices => equations%matrices)
      call equations%put_matrix('(44) J_3', equations%inertias%inertia_3)
      call elastic_moments(machine, equations%state%elements, 1, moments)
      call equations%put_vector('(48)-(51) F, elastic moments on the bodies [N m]', moments)
      matrices%beta(:) = [machine%start_speed(1, :), machine%start_angle(1, :), moments]
      call equations%put_vector('(46) beta', matrices%beta)
      call equations%put_vector('(58), (59) Q_3', matrices%torque_3)
      call equations%put_matrix('(60) C_3', matrices%damping_3)
      call equations%put_matrix('(61) K_3', matrices%stiffness_3)
      call equations%put_matrix('(62)-(72) K_4, tangent stiffness [N m/rad]', matrices%tangent)
    end associate
    call report_derivatives(machine, equations)
  end subroutine report_moments_as_states

  !> beta' from eq. (43), and its parts: eqs. (14), (33), (41), (45), (47).
  subroutine report_derivatives(machine, equations)
    type(machine_t), intent(in) :: machine
    type(equations_t), intent(inout) :: equations
    real(wp) :: rates(machine%bodies)
    integer :: pivots(3 * machine%bodies)
    logical :: is_singular

    call lu_factor(equations%inertias%inertia_3, pivots, is_singular)
    if (is_singular) then
      call raise(equations%error, exit_failed, '(44) J_3 is singular by rounding: the inertias differ too much')
      return
    end if
    associate (n => machine%bodies, slope => equations%matrices%beta, matrices => equations%matrices)
      slope = matrices%torque_3 + matmul(matrices%stiffness_3 + matrices%damping_3, slope)
      call lu_solve(equations%inertias%inertia_3, pivots, slope)
      call equations%put_vector("(14) omega' [rad/s2]", slope(:n))
      call equations%put_vector("(33) phi' = omega [rad/s]", slope(n + 1:2 * n))
      call equations%put_vector("(41) alpha'", slope(:2 * n))
      call elastic_rates(matrices%tangent, machine%start_speed(1, :), rates)
      call equations%put_vector("(47), (52)-(57) F' = K_4 omega [N m/s]", rates)
      call equations%put_vector("(45) beta'", slope)
    end associate
  end subroutine report_derivatives

  !> Appends a vector as a row.
  subroutine put_vector(self, label, vector)
    class(equations_t), intent(inout) :: self
    character(len=*), intent(in) :: label
    real(wp), intent(in) :: vector(:)

    call self%put_matrix(label // ', transposed', reshape(vector, [1, size(vector)]))
  end subroutine put_vector

  !> Appends a blank line, the label with the shape, and the rows with aligned columns.
  subroutine put_matrix(self, label, matrix)
    class(equations_t), intent(inout) :: self
    character(len=*), intent(in) :: label
    real(wp), intent(in) :: matrix(:, :)
    character(len=:), allocatable :: number
    integer :: i, j, width

    if (allocated(self%error)) return
    if (.not. all(is_finite(matrix))) then
      call raise(self%error, exit_failed, label // ' has an element that is not a finite number')
      return
    end if
    call self%report%append_line('')
    call self%report%append_line(label // ' (' // to_text(size(matrix, 1)) // ' x ' // to_text(size(matrix, 2)) // ')')
    width = maxval([((len(rounded_text(matrix(i, j), digits)), i=1, size(matrix, 1)), j=1, size(matrix, 2))])
    do i = 1, size(matrix, 1)
      do j = 1, size(matrix, 2)
        number = rounded_text(matrix(i, j), digits)
        call self%report%append(repeat(' ', width + 2 - len(number)) // number)
      end do
      call self%report%append_line('')
    end do
  end subroutine put_matrix

end module nocdyn_matrix_report
