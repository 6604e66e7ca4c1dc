!> The damped oscillations of a machine about a steady state at a held speed.
!>
!> They solve T(lambda) x = 0 with T(lambda) = sum of U_e^T D_e(lambda) U_e + lambda^2 M, where D_e(lambda) is the stiffness of
!> the forced response at the frequency -i lambda: of motors with their currents, fluxes and governors too. Relative damping is
!> that at the frequency of the mode. The eigenvalues of the first-order system are the start; each is refined by inverse
!> iteration on the band matrix T, with the root of x^T T(lambda) x as the next value: T is symmetric, so that x is the left
!> eigenvector too, and x^T T(lambda) x a two-sided Rayleigh functional.
module nocdyn_mode_pairs
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, rigid_stiffness
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_slopes, only: slopes_t
  implicit none (type, external)
  private

  public :: angles_of, keep_pairs, masses_times, refine, set_motion, set_sizes

  !> The oscillating modes at one state.
  type, public :: mode_pairs_t
    real(wp) :: speed = 0.0_wp                   !! of the body whose speed is held [rad/s]
    type(slopes_t) :: slopes
    integer, allocatable :: locked(:)            !! elements that do not turn, whose moments are unknowns of the matrix; not
                                                 !! allocated: none
    real(wp) :: highest = 0.0_wp                 !! frequency of excitation: a large machine has no modes far above it [rad/s]
    type(linearisation_t) :: linear              !! the undamped modes
    integer :: numbers(2) = 0                    !! the first and the last of these, if band matrices find them; else 0
    integer :: below = 0                         !! modes of lower frequencies, which were left out at the first of several states
    complex(wp), allocatable :: value(:)         !! eigenvalues, imaginary part > 0 [1/s], [modes]
    complex(wp), allocatable :: x(:, :)          !! coordinates, with x^T T'(lambda) x = 1, [coordinates, modes]
    complex(wp), allocatable :: twist(:, :)      !! [elements, modes]
    complex(wp), allocatable :: angle(:, :)      !! [bodies, modes]
    real(wp), allocatable :: undamped(:)         !! frequency of the most similar undamped mode [rad/s], [modes]
    integer, allocatable :: internal(:)          !! the internal state that the mode mostly is, or 0, [modes]
    real(wp) :: divergence = 0.0_wp              !! minus the growth of an elastic motion that does not oscillate; 0: none [1/s]
  end type mode_pairs_t

contains

  !> Leaves only some modes, in this order.
  subroutine keep_pairs(kept, self)
    integer, intent(in) :: kept(:)   !! modes
    type(mode_pairs_t), intent(inout) :: self

    self%value = self%value(kept)
    self%x = self%x(:, kept)
    self%twist = self%twist(:, kept)
    self%angle = self%angle(:, kept)
    self%undamped = self%undamped(kept)
    self%internal = self%internal(kept)
  end subroutine keep_pairs

  !> Allocates the arrays of the modes, after `slopes` is set.
  subroutine set_sizes(machine, matrix, modes, self)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix   !! of it
    integer, intent(in) :: modes                      !! their number
    type(mode_pairs_t), intent(inout) :: self

    allocate (self%value(modes), self%undamped(modes), self%x(matrix%coordinates, modes), &
              self%twist(size(self%slopes%stiffness), modes), self%angle(machine%bodies, modes))
  end subroutine set_sizes

  !> Refines a mode, and sets all that belongs to it but `undamped`. What is mostly an internal state may have no motion at all,
  !> and stays as it is; so does a mode whose iteration goes astray, and one that does not oscillate where there is relative
  !> damping, or whose eigenvalue is zero; `has_failed` tells it.
  subroutine refine(machine, matrix, work, self, m, has_failed)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(band_work_t), intent(inout) :: work
    type(mode_pairs_t), intent(inout) :: self   !! with `slopes`, and with `value`, `x` and `internal` of the mode
    integer, intent(in) :: m   !! mode
    logical, intent(out), optional :: has_failed
    real(wp), parameter :: alike = 0.5_wp
    complex(wp) :: start, x(size(self%x, 1)), norm
    logical :: is_found
    real(wp) :: size_of_norm

    start = self%value(m)
    x = self%x(:, m)
    call set_motion(machine, matrix, self, m)
    is_found = self%internal(m) == 0 .and. abs(start) > 0
    if (is_found .and. .not. aimag(start) > 0) is_found = .not. any(abs(self%slopes%loss) > 0)
    if (is_found) call iterate(machine, matrix, work, self, m, is_found)
    if (is_found) is_found = similarity(machine, x, self%x(:, m)) > alike
    if (.not. is_found) then
      self%value(m) = start
      self%x(:, m) = x
      call set_motion(machine, matrix, self, m)
    end if
    if (present(has_failed)) has_failed = .not. is_found
    call find_norm(machine, self, m, norm, size_of_norm)
    if (abs(norm) > epsilon(1.0_wp) * size_of_norm) then
      self%x(:, m) = self%x(:, m) / sqrt(norm)
      call set_motion(machine, matrix, self, m)
    end if
  end subroutine refine

  !> Inverse iteration.
  subroutine iterate(machine, matrix, work, self, m, is_found)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(band_work_t), intent(inout) :: work
    type(mode_pairs_t), intent(inout) :: self
    integer, intent(in) :: m
    logical, intent(out) :: is_found
    integer, parameter :: most_steps = 25
    real(wp), parameter :: accuracy = 1.0e-12_wp, beside = 1.0e-13_wp
    complex(wp), dimension(size(self%twist, 1)) :: held, slope, stiffness
    complex(wp) :: change, inertia
    integer :: step
    logical :: oscillates, singular

    is_found = .false.
    oscillates = aimag(self%value(m)) > 0
    associate (value => self%value(m), twist => self%twist, angle => self%angle)
      call self%slopes%find_stiffness(machine%elements%internal, value, stiffness, slope)
      do step = 1, most_steps
        inertia = sum(machine%inertia(1, :) * angle(:, m)**2)
        change = sum(slope * twist(:, m)**2) + 2.0_wp * value * inertia
        if (.not. abs(change) > 0) return
        change = -(sum(stiffness * twist(:, m)**2) + value**2 * inertia) / change
        value = value + change
        if ((aimag(value) > 0 .neqv. oscillates) .or. .not. abs(value) < huge(1.0_wp)) return
        is_found = step > 1 .and. abs(change) <= accuracy * abs(value)
        if (is_found) return
        call self%slopes%find_stiffness(machine%elements%internal, value, stiffness, slope)
        held = stiffness
        if (allocated(self%locked)) held(self%locked) = rigid_stiffness
        call matrix%factor_square(-value**2, held, work, singular)
        if (singular) call matrix%factor_square(-(value * (1.0_wp + beside))**2, held, work, singular)
        if (singular) then   ! the value is exact
          is_found = abs(change) <= accuracy * abs(value)
          return
        end if
        work%x(:) = (0.0_wp, 0.0_wp)   ! also of the moments of very stiff elements
        work%x(matrix%position(:matrix%coordinates)) = masses_times(machine, self%x(:, m))
        call matrix%solve(work)
        self%x(:, m) = work%x(matrix%position(:matrix%coordinates))
        self%x(:, m) = self%x(:, m) / self%x(maxloc(square_of(self%x(:, m)), dim=1), m)
        if (.not. all(square_of(self%x(:, m)) <= 4.0_wp)) return   ! not a number
        call set_motion(machine, matrix, self, m)
      end do
    end associate
  end subroutine iterate

  !> Sets twists and angles of a mode from its coordinates.
  subroutine set_motion(machine, matrix, self, m)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix   !! of it
    type(mode_pairs_t), intent(inout) :: self         !! with `x` of the mode
    integer, intent(in) :: m                          !! mode
    complex(wp) :: twist
    integer :: e, i

    associate (incidence => matrix%incidence)
      do e = 1, size(self%twist, 1)
        twist = (0.0_wp, 0.0_wp)
        do i = incidence%first(e), incidence%first(e + 1) - 1
          twist = twist + incidence%ratio(1, i) * self%x(incidence%coordinate(i), m)
        end do
        self%twist(e, m) = twist
      end do
    end associate
    self%angle(:, m) = angles_of(machine, self%x(:, m))
  end subroutine set_motion

  !> The angles of the bodies in a motion of coordinates.
  pure function angles_of(machine, x) result(angle)
    type(machine_t), intent(in) :: machine
    complex(wp), intent(in) :: x(:)        !! [coordinates]
    complex(wp) :: angle(machine%bodies)
    complex(wp) :: sum_of_parts
    integer :: b, k

    associate (map => machine%coordinates)
      do b = 1, size(angle)
        sum_of_parts = (0.0_wp, 0.0_wp)
        do k = map%first(b), map%first(b + 1) - 1
          sum_of_parts = sum_of_parts + map%ratio(1, k) * x(map%coordinate(k))
        end do
        angle(b) = sum_of_parts
      end do
    end associate
  end function angles_of

  !> M x.
  pure function masses_times(machine, x) result(product)
    type(machine_t), intent(in) :: machine
    complex(wp), intent(in) :: x(:)     !! [coordinates]
    complex(wp) :: product(size(x))     !! [coordinates]
    complex(wp) :: angle(machine%bodies)
    integer :: b, k

    angle = angles_of(machine, x)
    product = (0.0_wp, 0.0_wp)
    associate (map => machine%coordinates)
      do b = 1, size(angle)
        do k = map%first(b), map%first(b + 1) - 1
          product(map%coordinate(k)) = product(map%coordinate(k)) + map%ratio(1, k) * machine%inertia(1, b) * angle(b)
        end do
      end do
    end associate
  end function masses_times

  !> Modal assurance criterion with the masses, 0 to 1.
  pure real(wp) function similarity(machine, x, y)
    type(machine_t), intent(in) :: machine
    complex(wp), intent(in) :: x(:), y(:)

    associate (mx => masses_times(machine, x), my => masses_times(machine, y))
      similarity = abs(sum(conjg(x) * my))**2 / max(tiny(1.0_wp), real(sum(conjg(x) * mx), wp) * real(sum(conjg(y) * my), wp))
    end associate
  end function similarity

  !> x^T T'(lambda) x, and the sum of the sizes of its terms.
  subroutine find_norm(machine, self, m, norm, size_of_norm)
    type(machine_t), intent(in) :: machine
    type(mode_pairs_t), intent(in) :: self
    integer, intent(in) :: m
    complex(wp), intent(out) :: norm
    real(wp), intent(out) :: size_of_norm
    complex(wp), dimension(size(self%twist, 1)) :: slope, stiffness

    associate (value => self%value(m), twist => self%twist(:, m), angle => self%angle(:, m))
      call self%slopes%find_stiffness(machine%elements%internal, value, stiffness, slope)
      norm = sum(slope * twist**2) + 2.0_wp * value * sum(machine%inertia(1, :) * angle**2)
      size_of_norm = sum((abs(real(slope, wp)) + abs(aimag(slope))) * square_of(twist)) &
                     + 2.0_wp * abs(value) * sum(machine%inertia(1, :) * square_of(angle))
    end associate
  end subroutine find_norm

  !> The square of the magnitude, without the care of `abs` for numbers near the end of their range.
  elemental real(wp) function square_of(z)
    complex(wp), intent(in) :: z

    square_of = real(z, wp)**2 + aimag(z)**2
  end function square_of

end module nocdyn_mode_pairs
