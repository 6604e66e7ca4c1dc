!> The damped oscillations of a machine about a steady state at a held speed.
!>
!> They solve T(lambda) x = 0 with T(lambda) = sum of U_e^T D_e(lambda) U_e + lambda^2 M, where D_e(lambda) is the stiffness of
!> the forced response at the frequency -i lambda: of motors with their currents, fluxes and governors too. Relative damping is
!> that at the frequency of the mode. The eigenvalues of the first-order system are the start; each is refined by inverse
!> iteration on the band matrix T, with the root of x^T T(lambda) x as the next value: T is symmetric, so that x is the left
!> eigenvector too, and x^T T(lambda) x a two-sided Rayleigh functional.
module nocdyn_mode_pairs
  use nocdyn_dynamic_stiffness, only: band_work_t, new_band_work
  use nocdyn_eigenpairs, only: eigenpairs_t, find_eigenpairs
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_held_speeds, only: held_state_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_complex, only: complex_solve
  use nocdyn_linearisation, only: fill_matrix, linearisation_t, slopes_t, undamped_modes
  use nocdyn_relative_damping, only: add_loss
  implicit none (type, external)
  private

  public :: find_pairs, move_pairs, element_delay

  integer, parameter, public :: most_modes = 100   !! undamped ones that a large machine has, if the lines reach no further

  !> The oscillating modes at one state.
  type, public :: mode_pairs_t
    type(held_state_t) :: state
    type(linearisation_t) :: linear              !! the undamped modes there
    complex(wp), allocatable :: value(:)         !! eigenvalues, imaginary part > 0 [1/s], [modes]
    complex(wp), allocatable :: x(:, :)          !! coordinates, with x^T T'(lambda) x = 1, [coordinates, modes]
    complex(wp), allocatable :: twist(:, :)      !! [elements, modes]
    complex(wp), allocatable :: angle(:, :)      !! [bodies, modes]
    real(wp), allocatable :: undamped(:)         !! frequency of the most similar undamped mode [rad/s], [modes]
    integer, allocatable :: internal(:)          !! the internal state that the mode mostly is, or 0, [modes]
    real(wp) :: divergence = 0.0_wp              !! minus the growth of an elastic motion that does not oscillate; 0: none [1/s]
  end type mode_pairs_t

contains

  !> Finds all from nothing.
  subroutine find_pairs(response, state, self, error, known)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(mode_pairs_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    type(mode_pairs_t), intent(in), optional :: known   !! whose undamped modes serve again if the stiffnesses are the same
    type(eigenpairs_t) :: pairs
    integer, allocatable :: kept(:)
    type(band_work_t) :: work
    integer :: m

    call prepare(response, state, self, error, known)
    if (allocated(error)) return
    call find_start(response, self, pairs, error)
    if (allocated(error)) return
    kept = pack([(m, m=1, size(pairs%value))], aimag(pairs%value) > 0)
    kept = kept(ascending(aimag(pairs%value(kept))))
    call set_sizes(response, size(kept), self)
    self%internal = pairs%internal(kept)
    self%divergence = divergence_of(self%linear, pairs)
    work = new_band_work(response%matrix)
    do m = 1, size(kept)
      self%value(m) = pairs%value(kept(m))
      self%x(:, m) = pairs%speeds(:, kept(m))
      call refine(response, work, self, m)
    end do
  end subroutine find_pairs

  !> Finds those that go on from two other states, between which this one is.
  subroutine move_pairs(response, state, before, after, other, share, self, has_failed)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(mode_pairs_t), intent(in) :: before, after
    integer, intent(in) :: other(:)      !! mode of `after` that goes on from each of `before`
    real(wp), intent(in) :: share        !! of `after` in the start, 0 to 1
    type(mode_pairs_t), intent(out) :: self
    logical, intent(out) :: has_failed   !! whether a mode was not found
    type(error_t), allocatable :: error
    type(band_work_t) :: work
    integer :: m
    real(wp) :: turn

    call prepare(response, state, self, error, before)
    has_failed = allocated(error)
    if (has_failed) return
    call set_sizes(response, size(before%value), self)
    self%internal = before%internal
    self%divergence = min(0.0_wp, minval(self%linear%natural))
    work = new_band_work(response%matrix)
    do m = 1, size(before%value)
      turn = sign(1.0_wp, sum(real(before%x(:, m) * conjg(after%x(:, other(m))), wp)))
      self%value(m) = (1.0_wp - share) * before%value(m) + share * after%value(other(m))
      self%x(:, m) = (1.0_wp - share) * before%x(:, m) + share * turn * after%x(:, other(m))
      call refine(response, work, self, m, has_failed)
      if (has_failed) return
    end do
  end subroutine move_pairs

  !> The undamped modes of a state.
  subroutine prepare(response, state, self, error, known)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(mode_pairs_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(mode_pairs_t), intent(in), optional :: known
    logical :: is_known

    self%state = state
    is_known = present(known)
    if (is_known) is_known = all(abs(known%state%stiffness - state%stiffness) <= 0)
    if (is_known) then
      self%linear = known%linear
    else
      call undamped_modes(response%machine, response%matrix%incidence, state%stiffness, self%linear, error)
      if (.not. allocated(error)) call leave_out_highest(response, self%linear)
    end if
  end subroutine prepare

  !> Leaves out the highest modes of a large machine.
  subroutine leave_out_highest(response, linear)
    type(forced_response_t), intent(in) :: response
    type(linearisation_t), intent(inout) :: linear
    real(wp), parameter :: beyond = 1.5_wp   ! of the highest frequency of the lines
    integer :: n
    real(wp) :: highest

    highest = 0.0_wp
    if (size(response%points) > 0) highest = maxval([0.0_wp, response%points(size(response%points))%frequency])
    n = max(most_modes, count(linear%natural <= beyond * highest))
    if (n >= size(linear%natural)) return
    linear%shapes = linear%shapes(:, :n)
    linear%twists = linear%twists(:, :n)
    linear%natural = linear%natural(:n)
    linear%flexible = pack(linear%flexible, linear%flexible <= n)
  end subroutine leave_out_highest

  subroutine set_sizes(response, modes, self)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: modes
    type(mode_pairs_t), intent(inout) :: self

    allocate (self%value(modes), self%undamped(modes), self%x(response%matrix%coordinates, modes), &
              self%twist(size(self%state%stiffness), modes), self%angle(response%machine%bodies, modes))
  end subroutine set_sizes

  !> The eigenvalues of the first-order system.
  subroutine find_start(response, self, pairs, error)
    type(forced_response_t), intent(in) :: response
    type(mode_pairs_t), intent(inout) :: self
    type(eigenpairs_t), intent(out) :: pairs
    type(error_t), allocatable, intent(out) :: error
    type(slopes_t) :: slopes

    associate (state => self%state, linear => self%linear)
      slopes%damping = state%damping - response%loss_damping
      slopes%mean_damping = -state%mean_slope
      slopes%by_internal = state%by_internal
      slopes%rate_speed = state%rate_speed
      slopes%rate_internal = state%rate_internal
      call fill_matrix(response%machine%elements%internal, slopes, linear)
      call add_loss(state%stiffness * response%loss_factor, linear)
      call find_eigenpairs(linear, pairs, error, state%stiffness * response%loss_factor)
    end associate
  end subroutine find_start

  !> The growth of what does not oscillate, by a negative stiffness or a strong negative damping: of positive real eigenvalues
  !> whose motion has elastic energy. A motion of the whole machine is held.
  pure real(wp) function divergence_of(linear, pairs) result(divergence)
    type(linearisation_t), intent(in) :: linear
    type(eigenpairs_t), intent(in) :: pairs
    real(wp), parameter :: least = 0.05_wp   ! of the kinetic energy
    integer :: m
    real(wp) :: elastic

    divergence = min(0.0_wp, minval(linear%natural))
    do m = 1, size(pairs%value)
      if (aimag(pairs%value(m)) > 0 .or. .not. real(pairs%value(m), wp) > 0 .or. pairs%internal(m) > 0) cycle
      associate (n => size(linear%natural))
        elastic = sum(abs(pairs%vector(n + 1:n + size(linear%flexible), m))**2)
        if (elastic > least * sum(abs(pairs%vector(:n, m))**2)) divergence = min(divergence, -real(pairs%value(m), wp))
      end associate
    end do
  end function divergence_of

  pure function ascending(values) result(order)
    real(wp), intent(in) :: values(:)
    integer :: order(size(values))
    integer :: i, rank

    do i = 1, size(values)
      rank = 1 + count(values < values(i)) + count(abs(values(:i - 1) - values(i)) <= 0)
      order(rank) = i
    end do
  end function ascending

  !> Refines a mode, and sets all that belongs to it. What is mostly an internal state may have no motion at all, and stays as it
  !> is; so does a mode whose iteration goes astray, unless `has_failed` is there to tell it.
  subroutine refine(response, work, self, m, has_failed)
    type(forced_response_t), intent(in) :: response
    type(band_work_t), intent(inout) :: work
    type(mode_pairs_t), intent(inout) :: self
    integer, intent(in) :: m   !! mode
    logical, intent(out), optional :: has_failed
    real(wp), parameter :: alike = 0.5_wp
    complex(wp) :: start, x(size(self%x, 1)), norm
    logical :: is_found
    real(wp) :: size_of_norm

    start = self%value(m)
    x = self%x(:, m)
    call set_motion(response, self, m)
    is_found = self%internal(m) == 0
    if (is_found) call iterate(response, work, self, m, is_found)
    if (is_found) is_found = similarity(response, x, self%x(:, m)) > alike
    if (.not. is_found) then
      self%value(m) = start
      self%x(:, m) = x
      call set_motion(response, self, m)
    end if
    if (present(has_failed)) has_failed = .not. is_found
    call find_norm(response, self, m, norm, size_of_norm)
    if (abs(norm) > epsilon(1.0_wp) * size_of_norm) then
      self%x(:, m) = self%x(:, m) / sqrt(norm)
      call set_motion(response, self, m)
    end if
    self%undamped(m) = undamped_of(response, self, m)
  end subroutine refine

  !> Inverse iteration.
  subroutine iterate(response, work, self, m, is_found)
    type(forced_response_t), intent(in) :: response
    type(band_work_t), intent(inout) :: work
    type(mode_pairs_t), intent(inout) :: self
    integer, intent(in) :: m
    logical, intent(out) :: is_found
    integer, parameter :: most_steps = 25
    real(wp), parameter :: accuracy = 1.0e-12_wp, beside = 1.0e-13_wp
    complex(wp), dimension(size(self%twist, 1)) :: slope, stiffness
    complex(wp) :: change, inertia
    integer :: step
    logical :: singular

    is_found = .false.
    associate (value => self%value(m), twist => self%twist, angle => self%angle)
      do step = 1, most_steps
        call set_stiffness(response, self%state, value, stiffness, slope)
        inertia = sum(response%machine%inertia(1, :) * angle(:, m)**2)
        change = sum(slope * twist(:, m)**2) + 2.0_wp * value * inertia
        if (.not. abs(change) > 0) return
        change = -(sum(stiffness * twist(:, m)**2) + value**2 * inertia) / change
        value = value + change
        if (.not. aimag(value) > 0 .or. .not. abs(value) < huge(1.0_wp)) return
        is_found = step > 1 .and. abs(change) <= accuracy * abs(value)
        if (is_found) return
        call set_stiffness(response, self%state, value, stiffness, slope)
        call response%matrix%factor_square(-value**2, stiffness, work, singular)
        if (singular) call response%matrix%factor_square(-(value * (1.0_wp + beside))**2, stiffness, work, singular)
        work%x(:) = (0.0_wp, 0.0_wp)   ! also of the moments of very stiff elements
        work%x(response%matrix%position(:response%matrix%coordinates)) = masses_times(response, self%x(:, m))
        call response%matrix%solve(work)
        self%x(:, m) = work%x(response%matrix%position(:response%matrix%coordinates))
        self%x(:, m) = self%x(:, m) / self%x(maxloc(abs(self%x(:, m)), dim=1), m)
        if (.not. all(abs(self%x(:, m)) <= 2.0_wp)) return   ! not a number
        call set_motion(response, self, m)
      end do
    end associate
  end subroutine iterate

  !> Stiffnesses D_e(lambda), and their derivatives, in which the relative damping stays as it is.
  subroutine set_stiffness(response, state, value, stiffness, slope)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    complex(wp), intent(in) :: value   !! lambda [1/s]
    complex(wp), intent(out) :: stiffness(:), slope(:)
    complex(wp) :: moment, moment_slope
    integer :: s

    slope = state%damping - response%loss_damping + state%stiffness * response%loss_factor / aimag(value)
    stiffness = state%stiffness + value * slope
    associate (internal => response%machine%elements%internal)
      do s = 1, internal%count
        if (internal%first(s) /= s) cycle
        call element_delay(response, state, s, value, moment, moment_slope)
        associate (e => internal%element(s))
          stiffness(e) = stiffness(e) - moment
          slope(e) = slope(e) - moment_slope
        end associate
      end do
    end associate
  end subroutine set_stiffness

  !> The moment h^T (lambda - A)^-1 b lambda of the internal states of an element per unit of its twist, and its derivative by
  !> lambda.
  subroutine element_delay(response, state, first, value, moment, slope)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    integer, intent(in) :: first        !! the first of the states
    complex(wp), intent(in) :: value    !! lambda [1/s]
    complex(wp), intent(out) :: moment, slope
    complex(wp), dimension(response%machine%elements%internal%members(first)) :: z, z_slope
    complex(wp) :: matrix(size(z), size(z)), again(size(z), size(z))
    integer :: i

    do i = 1, size(z)
      matrix(i, :) = -state%rate_internal(:size(z), first + i - 1)
      matrix(i, i) = matrix(i, i) + value
    end do
    z = cmplx(state%rate_speed(first:first + size(z) - 1), kind=wp)
    again = matrix
    call complex_solve(again, z)
    z_slope = z
    call complex_solve(matrix, z_slope)
    associate (by_internal => state%by_internal(first:first + size(z) - 1))
      moment = value * sum(by_internal * z)
      slope = sum(by_internal * z) - value * sum(by_internal * z_slope)
    end associate
  end subroutine element_delay

  !> Sets twists and angles of a mode from its coordinates.
  subroutine set_motion(response, self, m)
    type(forced_response_t), intent(in) :: response
    type(mode_pairs_t), intent(inout) :: self
    integer, intent(in) :: m
    integer :: e, i

    associate (incidence => response%matrix%incidence)
      do e = 1, size(self%twist, 1)
        self%twist(e, m) = (0.0_wp, 0.0_wp)
        do i = incidence%first(e), incidence%first(e + 1) - 1
          self%twist(e, m) = self%twist(e, m) + incidence%ratio(1, i) * self%x(incidence%coordinate(i), m)
        end do
      end do
    end associate
    self%angle(:, m) = angles_of(response, self%x(:, m))
  end subroutine set_motion

  pure function angles_of(response, x) result(angle)
    type(forced_response_t), intent(in) :: response
    complex(wp), intent(in) :: x(:)   !! coordinates
    complex(wp) :: angle(response%machine%bodies)
    integer :: b, k

    associate (map => response%machine%coordinates)
      do b = 1, size(angle)
        angle(b) = (0.0_wp, 0.0_wp)
        do k = map%first(b), map%first(b + 1) - 1
          angle(b) = angle(b) + map%ratio(1, k) * x(map%coordinate(k))
        end do
      end do
    end associate
  end function angles_of

  !> M x.
  pure function masses_times(response, x) result(product)
    type(forced_response_t), intent(in) :: response
    complex(wp), intent(in) :: x(:)   !! coordinates
    complex(wp) :: product(size(x))
    complex(wp) :: angle(response%machine%bodies)
    integer :: b, k

    angle = angles_of(response, x)
    product = (0.0_wp, 0.0_wp)
    associate (map => response%machine%coordinates)
      do b = 1, size(angle)
        do k = map%first(b), map%first(b + 1) - 1
          product(map%coordinate(k)) = product(map%coordinate(k)) + map%ratio(1, k) * response%machine%inertia(1, b) * angle(b)
        end do
      end do
    end associate
  end function masses_times

  !> Modal assurance criterion with the masses, 0 to 1.
  pure real(wp) function similarity(response, x, y)
    type(forced_response_t), intent(in) :: response
    complex(wp), intent(in) :: x(:), y(:)

    associate (mx => masses_times(response, x), my => masses_times(response, y))
      similarity = abs(sum(conjg(x) * my))**2 / max(tiny(1.0_wp), real(sum(conjg(x) * mx), wp) * real(sum(conjg(y) * my), wp))
    end associate
  end function similarity

  !> x^T T'(lambda) x, and the sum of the sizes of its terms.
  subroutine find_norm(response, self, m, norm, size_of_norm)
    type(forced_response_t), intent(in) :: response
    type(mode_pairs_t), intent(in) :: self
    integer, intent(in) :: m
    complex(wp), intent(out) :: norm
    real(wp), intent(out) :: size_of_norm
    complex(wp), dimension(size(self%twist, 1)) :: slope, stiffness

    associate (value => self%value(m), twist => self%twist(:, m), angle => self%angle(:, m))
      call set_stiffness(response, self%state, value, stiffness, slope)
      norm = sum(slope * twist**2) + 2.0_wp * value * sum(response%machine%inertia(1, :) * angle**2)
      size_of_norm = sum(abs(slope) * abs(twist)**2) + 2.0_wp * abs(value) * sum(response%machine%inertia(1, :) * abs(angle)**2)
    end associate
  end subroutine find_norm

  !> The natural frequency of the undamped mode with most of the kinetic energy.
  real(wp) function undamped_of(response, self, m) result(natural)
    type(forced_response_t), intent(in) :: response
    type(mode_pairs_t), intent(in) :: self
    integer, intent(in) :: m
    complex(wp) :: momentum(size(self%x, 1))
    integer :: k
    real(wp) :: largest, part

    momentum = masses_times(response, self%x(:, m))
    natural = 0.0_wp
    largest = -1.0_wp
    do k = 1, size(self%linear%natural)
      part = abs(sum(self%linear%shapes(:, k) * momentum))
      if (part <= largest) cycle
      largest = part
      natural = self%linear%natural(k)
    end do
  end function undamped_of

end module nocdyn_mode_pairs
