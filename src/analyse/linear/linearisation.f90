!> A machine linearised at a state: M q'' + C q' + K q = 0 in modal coordinates, and the internal states of its elements.
!>
!> K = U^T diag(k) U with the tangent stiffnesses k of the elements and the map U from coordinates to twists; M = R^T R.
!> The undamped modes are the right singular vectors of diag(sqrt(k)) U R^-1; the singular values are the natural
!> frequencies. Their error is a rounding of the highest frequency; with the eigenvalues of K and M the squares would have such an
!> error. The symmetric eigenproblem is solved only if a stiffness is negative.
!>
!> Joints that hold are rows u' = 0: the modes are those of the motions that leave these joints at rest. The moments of teeth with
!> losses that turn follow from those of all elements; with them the first-order matrix is made of the Jacobian of a run.
!>
!> The first-order states are p, the rates of the modal coordinates; e = natural frequency * modal coordinate, for the modes that
!> are not rigid; and the internal states. So |p|^2 and |e|^2 are twice the energies, and rigid rotation is not a state.
module nocdyn_linearisation
  use nocdyn_element_coordinates, only: element_coordinates_t, new_element_coordinates
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_formulation, only: formulation_t
  use nocdyn_friction_joints, only: locked
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: cholesky_factor, singular_vectors, solve_triangular, symmetric_eigenvectors
  use nocdyn_machine, only: machine_t
  use nocdyn_system, only: pattern_t
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: linearise, mass_matrix, tangent_stiffness, undamped_modes

  !> A mode is rigid if its natural frequency is below these shares of the highest one: the rounding of singular
  !> values and of eigenvalues, which are squares.
  real(wp), parameter :: rigid_share = 1.0e-12_wp, rigid_share_of_squares = 1.0e-13_wp

  !> The modes and the first-order matrix at one state.
  type, public :: linearisation_t
    real(wp), allocatable :: shapes(:, :)   !! modes in the coordinates q, M-normalised, [coordinates, modes]; as many modes
                                            !! as coordinates, less what joints hold
    real(wp), allocatable :: twists(:, :)   !! modes in the twists of all elements, [elements, modes]
    real(wp), allocatable :: natural(:)     !! natural frequencies, negative for diverging modes [rad/s], [modes]
    integer, allocatable :: flexible(:)     !! modes that are not rigid
    real(wp), allocatable :: stiffness(:)   !! k of all elements [N m/rad], [elements]
    real(wp), allocatable :: matrix(:, :)   !! matrix of the first-order system, [modes + flexible + internal states] squared
  end type linearisation_t

contains

  !> Linearises a formulation of one lane without work integrals.
  subroutine linearise(formulation, t, y, self, error)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [1, states]
    type(linearisation_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if a number is not finite, or LAPACK does not converge
    type(element_coordinates_t) :: incidence
    type(pattern_t) :: pattern
    real(wp), allocatable :: slopes(:, :), stiffness(:)
    integer :: e

    pattern = formulation%jacobian_pattern()
    call differentiate(formulation, t, y, size(pattern%row), slopes)
    incidence = new_element_coordinates(formulation%machine%elements, formulation%machine%coordinates)
    stiffness = differentiated_stiffness(formulation%machine)
    call refuse_not_finite(formulation%machine, stiffness, error)
    if (.not. allocated(error)) call undamped_modes(formulation%machine, incidence, stiffness, self, error, &
                                                    held_elements(formulation))
    if (allocated(error)) return
    call assemble(formulation, self)
    if (formulation%internal > 0) call add_internal(formulation, pattern, slopes(1, :), self)
    associate (teeth => formulation%joints%teeth)
      if (teeth%count > 0 .and. .not. any([(carries_nothing(formulation, teeth%joint(e)), e=1, teeth%count)])) then
        call follow_losses(formulation, pattern, slopes(1, :), self)
      end if
    end associate
  end subroutine linearise

  !> The elements of joints that hold.
  function held_elements(formulation) result(elements)
    class(formulation_t), intent(in) :: formulation   !! started in its state
    integer, allocatable :: elements(:)
    integer :: j

    allocate (elements(0))
    do j = 1, formulation%joints%locking
      if (formulation%joints%mode(j) /= locked .or. carries_nothing(formulation, j)) cycle
      elements = [elements, formulation%joints%element(j)]
    end do
  end function held_elements

  !> Whether a joint is one of teeth at rest that carry no torque, so that their friction holds nothing.
  pure logical function carries_nothing(formulation, joint)
    class(formulation_t), intent(in) :: formulation   !! started in its state
    integer, intent(in) :: joint
    real(wp), parameter :: rounding = 1.0e-9_wp       ! of the moments of the elements

    carries_nothing = .false.
    associate (teeth => formulation%joints%teeth, elements => formulation%machine%elements)
      if (teeth%loss_of(joint) == 0 .or. formulation%joints%mode(joint) /= locked) return
      carries_nothing = abs(teeth%load(teeth%loss_of(joint))) <= rounding * &
                        maxval([tiny(rounding), abs(elements%restoring(1, :)), abs(elements%applied(1, :))])
    end associate
  end function carries_nothing

  !> Tangent stiffness and damping of all elements at a state of a formulation of one lane without work integrals.
  subroutine tangent_stiffness(formulation, t, y, stiffness, damping)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t                          !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)        !! [1, states]
    real(wp), allocatable, intent(out) :: stiffness(:) !! [N m/rad], [elements]
    real(wp), allocatable, intent(out) :: damping(:)   !! [N m s/rad], [elements]
    type(pattern_t) :: pattern
    real(wp), allocatable :: slopes(:, :)

    pattern = formulation%jacobian_pattern()
    call differentiate(formulation, t, y, size(pattern%row), slopes)
    stiffness = differentiated_stiffness(formulation%machine)
    damping = -formulation%machine%elements%applied_speed(1, :)
  end subroutine tangent_stiffness

  !> Differentiates the laws of all elements, and the equations of motion.
  subroutine differentiate(formulation, t, y, entries, slopes)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t                        !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)      !! [1, states]
    integer, intent(in) :: entries                   !! of the pattern of the Jacobian
    real(wp), allocatable, intent(out) :: slopes(:, :)   !! Jacobian, [1, entries]
    real(wp) :: dfdt(1, formulation%states)
    integer :: status(1)

    allocate (slopes(1, entries))
    status = 0
    call formulation%start_lane(1, t, reshape(y, [size(y)]))
    call formulation%jacobian([t], y, slopes, dfdt, status)
  end subroutine differentiate

  !> Of all elements [N m/rad].
  pure function differentiated_stiffness(machine) result(stiffness)
    type(machine_t), intent(in) :: machine   !! differentiated
    real(wp), allocatable :: stiffness(:)

    stiffness = -(machine%elements%restoring_angle(1, :) + machine%elements%applied_angle(1, :))
  end function differentiated_stiffness

  subroutine refuse_not_finite(machine, stiffness, error)
    type(machine_t), intent(in) :: machine   !! differentiated
    real(wp), intent(in) :: stiffness(:)     !! of all elements [N m/rad]
    type(error_t), allocatable, intent(out) :: error
    integer :: e

    do e = 1, size(stiffness)
      if (is_finite(stiffness(e)) .and. is_finite(machine%elements%applied_speed(1, e))) cycle
      call raise(error, exit_failed, 'the stiffness or damping of ' // quoted(machine%element_name(e)) // &
                 ' in this state is not a finite number')
      return
    end do
  end subroutine refuse_not_finite

  !> The undamped modes of a machine: all of `self` but `matrix`.
  subroutine undamped_modes(machine, incidence, stiffness, self, error, held)
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: incidence   !! of its elements
    real(wp), intent(in) :: stiffness(:)                   !! of all elements [N m/rad]
    type(linearisation_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    integer, intent(in), optional :: held(:)           !! elements that do not turn; absent: none
    real(wp), allocatable :: factor(:, :), flexibility(:, :), free(:, :)
    logical :: has_failed
    integer :: e, i

    self%stiffness = stiffness
    associate (f => machine%coordinates%freedoms, elastic => pack([(e, e=1, size(self%stiffness))], &
                                                                              abs(self%stiffness) > 0.0_wp))
      factor = mass_matrix(machine)
      call cholesky_factor(factor, has_failed)
      if (has_failed) then
        call raise(error, exit_failed, 'rounding makes the mass matrix of this machine singular: its inertias differ too much')
        return
      end if
      flexibility = scaled_rates(incidence, elastic, sqrt(abs(self%stiffness(elastic))), factor)
      has_failed = .false.
      if (present(held)) then
        if (size(held) > 0) call find_free(scaled_rates(incidence, held, spread(1.0_wp, 1, size(held)), factor), free, has_failed)
      end if
      if (allocated(free)) flexibility = matmul(flexibility, free)
      associate (modes => size(flexibility, 2))
        allocate (self%shapes(modes, modes), self%natural(modes), source=0.0_wp)
      end associate
      if (.not. has_failed) call solve_undamped(flexibility, self%stiffness(elastic), self, has_failed)
      if (has_failed) then
        call raise(error, exit_failed, 'the natural frequencies were not found: they are not finite, or LAPACK did not converge')
        return
      end if
      if (allocated(free)) self%shapes = matmul(free, self%shapes)
      if (size(self%natural) > 0) call solve_triangular(factor, self%shapes, from_right=.false.)
    end associate
    allocate (self%twists(size(self%stiffness), size(self%natural)), source=0.0_wp)
    do e = 1, size(self%stiffness)
      do i = incidence%first(e), incidence%first(e + 1) - 1
        self%twists(e, :) = self%twists(e, :) + incidence%ratio(1, i) * self%shapes(incidence%coordinate(i), :)
      end do
    end do
  end subroutine undamped_modes

  !> The rates of elements by the coordinates x = R q, times a factor each, [elements, coordinates].
  function scaled_rates(incidence, elements, scale, factor) result(rates)
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(in) :: elements(:)
    real(wp), intent(in) :: scale(:)                 !! [elements]
    real(wp), contiguous, intent(in) :: factor(:, :) !! R, [coordinates, coordinates]
    real(wp) :: rates(size(elements), size(factor, 1))
    integer :: e, i

    rates = 0.0_wp
    do i = 1, size(elements)
      do e = incidence%first(elements(i)), incidence%first(elements(i) + 1) - 1
        rates(i, incidence%coordinate(e)) = incidence%ratio(1, e) * scale(i)
      end do
    end do
    if (size(elements) > 0) call solve_triangular(factor, rates, from_right=.true.)
  end function scaled_rates

  !> Orthonormal motions that leave joints at rest, [coordinates, motions].
  subroutine find_free(rates, free, has_failed)
    real(wp), intent(in) :: rates(:, :)                   !! of the joints, [joints, coordinates]
    real(wp), allocatable, intent(out) :: free(:, :)
    logical, intent(out) :: has_failed                    !! LAPACK has not converged
    real(wp), parameter :: rounding = 1.0e-10_wp          ! relative to the largest singular value
    real(wp) :: rows(size(rates, 1), size(rates, 2)), values(size(rates, 2)), vectors(size(rates, 2), size(rates, 2))
    integer :: j

    do j = 1, size(rates, 1)
      rows(j, :) = rates(j, :) / max(norm2(rates(j, :)), tiny(1.0_wp))
    end do
    call singular_vectors(rows, values, vectors, has_failed)
    allocate (free, source=vectors(:, 1 + count(values > rounding * maxval([tiny(1.0_wp), values])):))
  end subroutine find_free

  !> Natural frequencies, ascending, and orthonormal modes of B^T diag(sign of k) B.
  subroutine solve_undamped(b, stiffness, self, has_failed)
    real(wp), contiguous, intent(in) :: b(:, :)   !! B = diag(sqrt(|k|)) U R^-1, [elastic elements, coordinates]
    real(wp), intent(in) :: stiffness(:)          !! k [N m/rad], [elastic elements]
    type(linearisation_t), intent(inout) :: self
    logical, intent(out) :: has_failed   !! whether LAPACK did not converge
    logical :: is_rigid(size(self%natural))
    integer :: i

    associate (natural => self%natural, n => size(self%natural))
      has_failed = .false.
      allocate (self%flexible(0))
      if (n == 0) return
      if (all(stiffness >= 0.0_wp)) then
        call singular_vectors(b, natural, self%shapes, has_failed)
        natural = natural(n:1:-1)
        self%shapes = self%shapes(:, n:1:-1)
        is_rigid = natural <= rigid_share * natural(n)
      else
        call symmetric_eigenvectors(matmul(transpose(b), spread(sign(1.0_wp, stiffness), 2, n) * b), natural, &
                                    self%shapes, has_failed)
        is_rigid = abs(natural) <= rigid_share_of_squares * maxval(abs(natural))
        natural = sign(sqrt(abs(natural)), natural)
      end if
      where (is_rigid) natural = 0.0_wp
      self%flexible = pack([(i, i=1, n)], .not. is_rigid)
    end associate
  end subroutine solve_undamped

  !> L_tau^T J L_tau [kg m2], [coordinates, coordinates].
  function mass_matrix(machine) result(mass)
    type(machine_t), intent(in) :: machine
    real(wp), allocatable :: mass(:, :)
    integer :: b, i, k

    associate (map => machine%coordinates)
      allocate (mass(map%freedoms, map%freedoms), source=0.0_wp)
      do b = 1, machine%bodies
        do i = map%first(b), map%first(b + 1) - 1
          do k = map%first(b), map%first(b + 1) - 1
            associate (entry => mass(map%coordinate(k), map%coordinate(i)))
              entry = entry + map%ratio(1, k) * machine%inertia(1, b) * map%ratio(1, i)
            end associate
          end do
        end do
      end do
    end associate
  end function mass_matrix

  !> Fills the matrix for p' = -C p - sign(natural) |natural| e and e' = |natural| p. C is not symmetric where a torque follows
  !> the mean speed of a cycle: the rigid motions change it, and it acts on all modes.
  subroutine assemble(formulation, self)
    class(formulation_t), intent(in) :: formulation
    type(linearisation_t), intent(inout) :: self
    integer, allocatable :: damped(:)   ! elements with damping
    real(wp), allocatable :: rates(:, :)
    integer :: e, i, n, states

    n = size(self%natural)
    states = n + size(self%flexible) + formulation%internal
    allocate (self%matrix(states, states), source=0.0_wp)
    associate (damping => formulation%machine%elements%applied_speed(1, :))
      damped = pack([(e, e=1, size(damping))], abs(damping) > 0.0_wp)
      allocate (rates(size(damped), n))
      do i = 1, n
        rates(:, i) = damping(damped) * self%twists(damped, i)
      end do
    end associate
    call leave_out_oscillations(formulation%machine, damped, self%flexible, rates)
    self%matrix(:n, :n) = matmul(transpose(self%twists(damped, :)), rates)
    do i = 1, size(self%flexible)
      associate (natural => self%natural(self%flexible(i)))
        self%matrix(self%flexible(i), n + i) = -natural
        self%matrix(n + i, self%flexible(i)) = abs(natural)
      end associate
    end do
  end subroutine assemble

  !> Torques that follow the mean speed of a cycle change with the rigid motions only.
  subroutine leave_out_oscillations(machine, elements, flexible, rates)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: elements(:)
    integer, intent(in) :: flexible(:)         !! modes
    real(wp), intent(inout) :: rates(:, :)     !! derivatives of the torques by the rates of the modes, [elements, modes]
    logical :: follows(machine%elements%count)
    integer :: i

    follows = machine%follows_mean_speed()
    do i = 1, size(flexible)
      where (follows(elements)) rates(:, flexible(i)) = 0.0_wp
    end do
  end subroutine leave_out_oscillations

  !> Fills the rows and columns of the internal states. No internal state depends on a rigid rotation.
  subroutine add_internal(formulation, pattern, slopes, self)
    class(formulation_t), intent(in) :: formulation
    type(pattern_t), intent(in) :: pattern   !! positions of the Jacobian
    real(wp), intent(in) :: slopes(:)        !! values at these positions
    type(linearisation_t), intent(inout) :: self
    real(wp), allocatable :: by_state(:, :), by_speed(:, :), by_angle(:, :)
    integer :: before, f, i, n, p

    f = formulation%machine%coordinates%freedoms
    n = size(self%natural)
    before = n + size(self%flexible)
    associate (internal => formulation%internal)
      allocate (by_state(f, internal), by_speed(internal, f), by_angle(internal, f), source=0.0_wp)
    end associate
    do p = 1, size(slopes)
      associate (row => pattern%row(p), column => pattern%column(p))
        if (row <= f .and. column > 2 * f) then
          by_state(row, column - 2 * f) = slopes(p)
        else if (row > 2 * f .and. column <= f) then
          by_speed(row - 2 * f, column) = slopes(p)
        else if (row > 2 * f .and. column <= 2 * f) then
          by_angle(row - 2 * f, column - f) = slopes(p)
        else if (row > 2 * f) then
          self%matrix(before + row - 2 * f, before + column - 2 * f) = slopes(p)
        end if
      end associate
    end do
    self%matrix(:n, before + 1:) = matmul(transpose(self%shapes), matmul(mass_matrix(formulation%machine), by_state))
    self%matrix(before + 1:, :n) = matmul(by_speed, self%shapes)
    do i = 1, size(self%flexible)
      associate (mode => self%flexible(i))
        self%matrix(before + 1:, n + i) = matmul(by_angle, self%shapes(:, mode)) / abs(self%natural(mode))
      end associate
    end do
  end subroutine add_internal

  !> Replaces the accelerations by the speeds and twists by those with the losses of teeth.
  subroutine follow_losses(formulation, pattern, slopes, self)
    class(formulation_t), intent(in) :: formulation
    type(pattern_t), intent(in) :: pattern   !! positions of the Jacobian
    real(wp), intent(in) :: slopes(:)        !! values at these positions
    type(linearisation_t), intent(inout) :: self
    real(wp), allocatable :: by_speed(:, :), by_angle(:, :), left(:, :)
    integer :: f, i, n, p

    f = formulation%machine%coordinates%freedoms
    n = size(self%natural)
    allocate (by_speed(f, f), by_angle(f, f), source=0.0_wp)
    do p = 1, size(slopes)
      associate (row => pattern%row(p), column => pattern%column(p))
        if (row > f .or. column > 2 * f) cycle
        if (column <= f) by_speed(row, column) = slopes(p)
        if (column > f) by_angle(row, column - f) = slopes(p)
      end associate
    end do
    left = matmul(transpose(self%shapes), mass_matrix(formulation%machine))
    self%matrix(:n, :n) = matmul(left, matmul(by_speed, self%shapes))
    do i = 1, size(self%flexible)
      associate (mode => self%flexible(i))
        self%matrix(:n, n + i) = matmul(left, matmul(by_angle, self%shapes(:, mode))) / abs(self%natural(mode))
      end associate
    end do
  end subroutine follow_losses

end module nocdyn_linearisation
