!> A machine linearised at a state: M q'' + C q' + K q = 0 in modal coordinates, and the internal states of its elements.
!>
!> K = U^T diag(k) U with the tangent stiffnesses k of the elements and the map U from coordinates to twists; M = R^T R.
!> The undamped modes are the right singular vectors of diag(sqrt(k)) U R^-1; the singular values are the natural
!> frequencies. Their error is a rounding of the highest frequency; with the eigenvalues of K and M the squares would have such an
!> error. The symmetric eigenproblem is solved only if a stiffness is negative.
!>
!> Joints that hold are rows u' = 0: the modes are the ones of the motions that leave these joints at rest. The moments of teeth
!> with losses that turn follow from the ones of all elements; with them the first-order matrix is made of the Jacobian of a run.
!>
!> The first-order states are p, the rates of the modal coordinates; e = natural frequency * modal coordinate, for the modes that
!> are not rigid; and the internal states. So |p|^2 and |e|^2 are twice the energies, and rigid rotation is not a state.
module nocdyn_linearisation
  use nocdyn_element_coordinates, only: element_coordinates_t, new_element_coordinates
  use nocdyn_elements, only: elements_t, internal_states_t
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_friction_joints, only: locked
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank
  use nocdyn_lapack_eigen, only: cholesky_factor, singular_vectors, solve_triangular, symmetric_eigenvectors
  use nocdyn_machine, only: machine_t
  use nocdyn_slopes, only: new_slopes, slopes_t
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: fill_matrix, find_slopes, has_turning_losses, held_elements, linearise, mass_matrix, undamped_loss, undamped_modes

  !> With negative stiffnesses, a mode is rigid if the square of its natural frequency is below this share of the highest one.
  real(wp), parameter :: rigid_share_of_squares = 1.0e-13_wp

  !> The modes and the first-order matrix at one state.
  type, public :: linearisation_t
    real(wp), allocatable :: shapes(:, :)   !! modes in the coordinates q, M-normalised, [coordinates, modes]; as many modes
                                            !! as coordinates, less what joints hold
    real(wp), allocatable :: twists(:, :)   !! modes in the twists of all elements, [elements, modes]
    real(wp), allocatable :: natural(:)     !! natural frequencies, negative for diverging modes [rad/s], [modes]
    integer, allocatable :: flexible(:)     !! modes that are not rigid
    integer :: below = 0                    !! modes that are not rigid and are left out, of lower frequencies
    real(wp), allocatable :: stiffness(:)   !! k of all elements [N m/rad], [elements]
    real(wp), allocatable :: loss(:)        !! the imaginary part of k [N m/rad], [elements]
    integer, allocatable :: held(:)         !! elements of joints that hold
    real(wp), allocatable :: matrix(:, :)   !! matrix of the first-order system, [modes + flexible + internal states] squared,
                                            !! with the relative damping of undamped modes
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
    type(slopes_t) :: slopes
    real(wp), allocatable :: jacobian(:, :)
    integer, allocatable :: held(:)

    call differentiate(formulation, t, y, pattern, jacobian)
    incidence = new_element_coordinates(formulation%machine%elements, formulation%machine%coordinates)
    call new_slopes(formulation%machine, formulation%state%elements, slopes, error)
    if (allocated(error)) return
    allocate (held, source=held_elements(formulation))
    call undamped_modes(formulation%machine, incidence, slopes%stiffness, self, error, held)
    if (allocated(error)) return
    call move_alloc(held, self%held)
    call fill_matrix(formulation%machine%elements%internal, slopes, self)
    if (has_turning_losses(formulation)) call follow_losses(formulation, slopes, pattern, jacobian(1, :), self)
  end subroutine linearise

  !> Whether the moments of teeth with losses follow from the ones of all elements.
  pure logical function has_turning_losses(formulation)
    class(formulation_t), intent(in) :: formulation   !! started in its state
    integer :: e

    associate (teeth => formulation%joints%teeth)
      has_turning_losses = teeth%count > 0
      do e = 1, teeth%count
        has_turning_losses = has_turning_losses .and. .not. carries_nothing(formulation, teeth%joint(e))
      end do
    end associate
  end function has_turning_losses

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
    associate (teeth => formulation%joints%teeth, elements => formulation%state%elements)
      if (teeth%loss_of(joint) == 0 .or. formulation%joints%mode(joint) /= locked) return
      carries_nothing = abs(teeth%load(teeth%loss_of(joint))) <= rounding * &
                        maxval([tiny(rounding), abs(elements%restoring(1, :)), abs(elements%applied(1, :))])
    end associate
  end function carries_nothing

  !> The slopes of all elements at a state of a formulation of one lane without work integrals.
  subroutine find_slopes(formulation, t, y, slopes, error)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t                          !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)        !! [1, states]
    type(slopes_t), intent(out) :: slopes
    type(error_t), allocatable, intent(out) :: error   !! if a number is not finite
    type(pattern_t) :: pattern
    real(wp), allocatable :: jacobian(:, :)

    call differentiate(formulation, t, y, pattern, jacobian)
    call new_slopes(formulation%machine, formulation%state%elements, slopes, error)
  end subroutine find_slopes

  !> Differentiates the laws of all elements, and the equations of motion.
  subroutine differentiate(formulation, t, y, pattern, jacobian)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t                        !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)      !! [1, states]
    type(pattern_t), intent(out) :: pattern          !! positions of the Jacobian
    real(wp), allocatable, intent(out) :: jacobian(:, :)   !! [1, positions]
    real(wp) :: dfdt(1, formulation%states)
    integer :: status(1)

    pattern = formulation%jacobian_pattern()
    allocate (jacobian(1, size(pattern%row)))
    status = 0
    call formulation%start_lane(1, t, reshape(y, [size(y)]))
    call formulation%jacobian([t], y, jacobian, dfdt, status)
  end subroutine differentiate

  !> The undamped modes of a machine: all of `self` but `matrix`.
  subroutine undamped_modes(machine, incidence, stiffness, self, error, held)
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: incidence   !! of its elements
    real(wp), intent(in) :: stiffness(:)                   !! of all elements [N m/rad]
    type(linearisation_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    integer, intent(in), optional :: held(:)           !! elements that do not turn; absent: none
    real(wp), allocatable :: factor(:, :), flexibility(:, :), free(:, :), rates(:, :)
    integer, allocatable :: rows(:)   ! elements that keep a motion from being rigid
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
      flexibility = scaled_rates(incidence, elastic, sqrt(abs(self%stiffness(elastic))), f)
      if (size(elastic) > 0) call solve_triangular(factor, flexibility, from_right=.true.)
      rows = elastic
      has_failed = .false.
      if (present(held)) then
        rows = [elastic, held]
        if (size(held) > 0) then
          rates = scaled_rates(incidence, held, spread(1.0_wp, 1, size(held)), f)
          call solve_triangular(factor, rates, from_right=.true.)
          call find_free(rates, free, has_failed)
        end if
      end if
      if (allocated(free)) flexibility = matmul(flexibility, free)
      associate (modes => size(flexibility, 2))
        allocate (self%shapes(modes, modes), self%natural(modes), source=0.0_wp)
      end associate
      if (.not. has_failed) call solve_undamped(flexibility, self%stiffness(elastic), &
                                                f - rank_of(scaled_rates(incidence, rows, spread(1.0_wp, 1, size(rows)), f)), &
                                                self, has_failed)
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

  !> The rates of elements by the coordinates, times a factor each, [elements, coordinates].
  function scaled_rates(incidence, elements, scale, coordinates) result(rates)
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(in) :: elements(:)
    real(wp), intent(in) :: scale(:)                 !! [elements]
    integer, intent(in) :: coordinates
    real(wp) :: rates(size(elements), coordinates)
    integer :: e, i

    rates = 0.0_wp
    do i = 1, size(elements)
      do e = incidence%first(elements(i)), incidence%first(elements(i) + 1) - 1
        rates(i, incidence%coordinate(e)) = incidence%ratio(1, e) * scale(i)
      end do
    end do
  end function scaled_rates

  !> The number of independent rates.
  integer function rank_of(rates) result(rank)
    real(wp), intent(in) :: rates(:, :)             !! [elements, coordinates]
    real(wp), parameter :: rounding = 1.0e-10_wp    ! relative
    integer :: pivots(size(rates, 2))

    rank = 0
    if (size(rates) > 0) call pivoted_rank(rates / spread(max(norm2(rates, 2), tiny(1.0_wp)), 2, size(rates, 2)), rounding, &
                                           rank, pivots)
  end function rank_of

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
  subroutine solve_undamped(b, stiffness, rigid, self, has_failed)
    real(wp), contiguous, intent(in) :: b(:, :)   !! B = diag(sqrt(|k|)) U R^-1, [elastic elements, coordinates]
    real(wp), intent(in) :: stiffness(:)          !! k [N m/rad], [elastic elements]
    integer, intent(in) :: rigid                  !! number of the motions without any twist
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
        is_rigid = [(i <= rigid, i=1, n)] .or. natural <= 0
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

  !> Fills the matrix for p' = -C p - sign(natural) |natural| e + the moments of the internal states, e' = |natural| p, and the
  !> rates of the internal states, which depend on the speeds and not on the angles of their elements. C is not symmetric where a
  !> torque follows the mean speed of a cycle: the rigid motions change it, and it acts on all modes. C has the relative damping
  !> at the frequencies of the undamped modes, and between two of them at the mean of their frequencies.
  subroutine fill_matrix(internal, slopes, self)
    type(internal_states_t), intent(in) :: internal   !! of the machine
    type(slopes_t), intent(in) :: slopes
    type(linearisation_t), intent(inout) :: self      !! with the undamped modes
    integer, allocatable :: damped(:)   ! elements with damping
    real(wp), allocatable :: rates(:, :)
    integer :: before, e, i, n, s

    n = size(self%natural)
    before = n + size(self%flexible)
    if (allocated(self%matrix)) deallocate (self%matrix)
    allocate (self%matrix(before + internal%count, before + internal%count), source=0.0_wp)
    damped = pack([(e, e=1, size(slopes%damping))], abs(slopes%damping) + abs(slopes%mean_damping) > 0.0_wp)
    allocate (rates(size(damped), n))
    do i = 1, n
      rates(:, i) = -slopes%damping(damped)
      if (.not. any(self%flexible == i)) rates(:, i) = rates(:, i) - slopes%mean_damping(damped)
      rates(:, i) = rates(:, i) * self%twists(damped, i)
    end do
    self%matrix(:n, :n) = matmul(transpose(self%twists(damped, :)), rates)
    self%loss = slopes%loss
    if (any(abs(self%loss) > 0)) self%matrix(:n, :n) = self%matrix(:n, :n) - undamped_loss(self)
    do i = 1, size(self%flexible)
      associate (natural => self%natural(self%flexible(i)))
        self%matrix(self%flexible(i), n + i) = -natural
        self%matrix(n + i, self%flexible(i)) = abs(natural)
      end associate
    end do
    do s = 1, internal%count
      associate (twists => self%twists(internal%element(s), :), first => internal%first(s), members => internal%members(s))
        self%matrix(:n, before + s) = twists * slopes%by_internal(s)
        self%matrix(before + s, :n) = twists * slopes%rate_speed(s)
        self%matrix(before + s, before + first:before + first + members - 1) = slopes%rate_internal(:members, s)
      end associate
    end do
  end subroutine fill_matrix

  !> The relative damping of the undamped modes, [modes, modes].
  function undamped_loss(self) result(matrix)
    type(linearisation_t), intent(in) :: self
    real(wp) :: matrix(size(self%natural), size(self%natural))
    real(wp) :: scaled(size(self%loss), size(self%natural))
    integer :: m

    do m = 1, size(self%natural)
      scaled(:, m) = 0.0_wp
      if (abs(self%natural(m)) > 0) scaled(:, m) = self%twists(:, m) / sqrt(abs(self%natural(m)))
    end do
    matrix = matmul(transpose(scaled), spread(self%loss, 2, size(self%natural)) * scaled)
  end function undamped_loss

  !> Replaces the accelerations by the speeds and twists by those with the losses of teeth.
  subroutine follow_losses(formulation, slopes, pattern, jacobian, self)
    class(formulation_t), intent(in) :: formulation
    type(slopes_t), intent(in) :: slopes
    type(pattern_t), intent(in) :: pattern   !! positions of the Jacobian
    real(wp), intent(in) :: jacobian(:)      !! values at these positions
    type(linearisation_t), intent(inout) :: self
    real(wp), allocatable :: by_speed(:, :), by_angle(:, :), left(:, :)
    integer :: f, i, n, p

    f = formulation%machine%coordinates%freedoms
    n = size(self%natural)
    allocate (by_speed(f, f), by_angle(f, f), source=0.0_wp)
    do p = 1, size(jacobian)
      associate (row => pattern%row(p), column => pattern%column(p))
        if (row > f .or. column > 2 * f) cycle
        if (column <= f) by_speed(row, column) = jacobian(p)
        if (column > f) by_angle(row, column - f) = jacobian(p)
      end associate
    end do
    left = matmul(transpose(self%shapes), mass_matrix(formulation%machine))
    self%matrix(:n, :n) = matmul(left, matmul(by_speed, self%shapes)) - undamped_loss(self) &
                          + matmul(transpose(self%twists), spread(slopes%stand_in, 2, n) * self%twists)
    do i = 1, size(self%flexible)
      associate (mode => self%flexible(i))
        self%matrix(:n, n + i) = matmul(left, matmul(by_angle, self%shapes(:, mode))) / abs(self%natural(mode))
      end associate
    end do
  end subroutine follow_losses

end module nocdyn_linearisation
