!> A machine linearised at a state: M q'' + C q' + K q = 0 in modal coordinates, and the internal states of its elements.
!>
!> K = U^T diag(k) U with the tangent stiffnesses k of the elements and the map U from coordinates to twists; M = R^T R.
!> The undamped modes are the right singular vectors of diag(sqrt(k)) U R^-1; the singular values are the natural
!> frequencies. Their error is a rounding of the highest frequency; with the eigenvalues of K and M the squares would have such an
!> error. The symmetric eigenproblem is solved only if a stiffness is negative.
!>
!> The first-order states are p, the rates of the modal coordinates; e = natural frequency * modal coordinate, for the modes that
!> are not rigid; and the internal states. So |p|^2 and |e|^2 are twice the energies, and rigid rotation is not a state.
module nocdyn_linearisation
  use nocdyn_element_coordinates, only: element_coordinates_t, new_element_coordinates
  use nocdyn_elements, only: elements_t, internal_states_t
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: cholesky_factor, singular_vectors, solve_triangular, symmetric_eigenvectors
  use nocdyn_machine, only: machine_t
  use nocdyn_system, only: pattern_t
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: fill_matrix, linearise, mass_matrix, tangent_stiffness, undamped_modes

  !> A mode is rigid if its natural frequency is below these shares of the highest one: the rounding of singular
  !> values and of eigenvalues, which are squares.
  real(wp), parameter :: rigid_share = 1.0e-12_wp, rigid_share_of_squares = 1.0e-13_wp

  !> How the moments of the elements and the rates of their internal states change beside the stiffness.
  type, public :: slopes_t
    real(wp), allocatable :: damping(:)            !! minus the derivatives by the rates of twist [N m s/rad], [elements]
    real(wp), allocatable :: by_internal(:)        !! derivatives of the moments by internal states, [internal states]
    real(wp), allocatable :: rate_speed(:)         !! derivatives of their rates by the speed of the element, the same
    real(wp), allocatable :: rate_internal(:, :)   !! derivatives of the rates by the states of the element, [members, the same]
  end type slopes_t

  !> The modes and the first-order matrix at one state.
  type, public :: linearisation_t
    real(wp), allocatable :: shapes(:, :)   !! modes in the coordinates q, M-normalised, [coordinates, modes]
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
    type(slopes_t) :: slopes
    real(wp), allocatable :: stiffness(:)

    call differentiate(formulation, t, y)
    incidence = new_element_coordinates(formulation%machine%elements, formulation%machine%coordinates)
    stiffness = differentiated_stiffness(formulation%machine)
    call refuse_not_finite(formulation%machine, stiffness, error)
    if (.not. allocated(error)) call undamped_modes(formulation%machine, incidence, stiffness, self, error)
    if (allocated(error)) return
    call copy_slopes(formulation%machine%elements, slopes)
    call fill_matrix(formulation%machine%elements%internal, slopes, self)
  end subroutine linearise

  !> Tangent stiffness and damping of all elements at a state of a formulation of one lane without work integrals.
  subroutine tangent_stiffness(formulation, t, y, stiffness, damping)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t                          !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)        !! [1, states]
    real(wp), allocatable, intent(out) :: stiffness(:) !! [N m/rad], [elements]
    real(wp), allocatable, intent(out) :: damping(:)   !! [N m s/rad], [elements]

    call differentiate(formulation, t, y)
    stiffness = differentiated_stiffness(formulation%machine)
    damping = -formulation%machine%elements%applied_speed(1, :)
  end subroutine tangent_stiffness

  !> Differentiates the laws of all elements.
  subroutine differentiate(formulation, t, y)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t                        !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)      !! [1, states]
    real(wp) :: dfdt(1, formulation%states)
    real(wp), allocatable :: slopes(:, :)
    type(pattern_t) :: pattern
    integer :: status(1)

    pattern = formulation%jacobian_pattern()
    allocate (slopes(1, size(pattern%row)))
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
  subroutine undamped_modes(machine, incidence, stiffness, self, error)
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: incidence   !! of its elements
    real(wp), intent(in) :: stiffness(:)                   !! of all elements [N m/rad]
    type(linearisation_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    real(wp), allocatable :: factor(:, :), flexibility(:, :)
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
      allocate (flexibility(size(elastic), f), self%shapes(f, f), self%natural(f), source=0.0_wp)
      do i = 1, size(elastic)
        do e = incidence%first(elastic(i)), incidence%first(elastic(i) + 1) - 1
          flexibility(i, incidence%coordinate(e)) = incidence%ratio(1, e) * sqrt(abs(self%stiffness(elastic(i))))
        end do
      end do
      if (size(elastic) > 0) call solve_triangular(factor, flexibility, from_right=.true.)
      call solve_undamped(flexibility, self%stiffness(elastic), self, has_failed)
      if (has_failed) then
        call raise(error, exit_failed, 'the natural frequencies were not found: they are not finite, or LAPACK did not converge')
        return
      end if
      call solve_triangular(factor, self%shapes, from_right=.false.)
    end associate
    allocate (self%twists(size(self%stiffness), size(self%natural)), source=0.0_wp)
    do e = 1, size(self%stiffness)
      do i = incidence%first(e), incidence%first(e + 1) - 1
        self%twists(e, :) = self%twists(e, :) + incidence%ratio(1, i) * self%shapes(incidence%coordinate(i), :)
      end do
    end do
  end subroutine undamped_modes

  !> Natural frequencies, ascending, and orthonormal modes of B^T diag(sign of k) B.
  subroutine solve_undamped(b, stiffness, self, has_failed)
    real(wp), contiguous, intent(in) :: b(:, :)   !! B = diag(sqrt(|k|)) U R^-1, [elastic elements, coordinates]
    real(wp), intent(in) :: stiffness(:)          !! k [N m/rad], [elastic elements]
    type(linearisation_t), intent(inout) :: self
    logical, intent(out) :: has_failed   !! whether LAPACK did not converge
    logical :: is_rigid(size(self%natural))
    integer :: i

    associate (natural => self%natural, n => size(self%natural))
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

  !> The slopes of all elements of a machine, in its first lane.
  subroutine copy_slopes(elements, slopes)
    type(elements_t), intent(in) :: elements   !! differentiated
    type(slopes_t), intent(out) :: slopes

    slopes%damping = -elements%applied_speed(1, :)
    slopes%by_internal = elements%internal%applied(1, :)
    slopes%rate_speed = elements%internal%rate_speed(1, :)
    slopes%rate_internal = elements%internal%rate_internal(1, :, :)
  end subroutine copy_slopes

  !> Fills the matrix for p' = -C p - sign(natural) |natural| e + the moments of the internal states, e' = |natural| p, and the
  !> rates of the internal states, which depend on the speeds and not on the angles of their elements.
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
    damped = pack([(e, e=1, size(slopes%damping))], abs(slopes%damping) > 0.0_wp)
    allocate (rates(size(damped), n))
    do i = 1, n
      rates(:, i) = -slopes%damping(damped) * self%twists(damped, i)
    end do
    self%matrix(:n, :n) = matmul(transpose(self%twists(damped, :)), rates)
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

end module nocdyn_linearisation
