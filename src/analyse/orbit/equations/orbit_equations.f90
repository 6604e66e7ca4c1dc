!> The equations of a periodic motion in harmonics.
!>
!> The coordinates are q = r Omega t + series, the internal states series in tau = w t. The harmonics of w^2 q'' = f and w z' = g
!> vanish, with f and g of all samples of a period at once. In place of the mean angle of a rigid motion the series of its
!> coordinate begin with a mean acceleration that balances its mean torque, divided by w^2, which must vanish.
!> Where nothing prescribes the period, w is unknown too, and the motion is in phase with another one:
!> the integral of q times the rate of this vanishes over a period.
!>
!> The parameter of a conservative machine is an amplitude: half the difference of an angle between the begin and the middle of
!> the period, where the motion turns back; or the energy there. Its motions form families, so that one more unknown belongs to
!> this equation: a damping w d q', which comes out as zero (F. J. Munoz-Almaraz, E. Freire, J. Galan, E. Doedel,
!> A. Vanderbauwhede, Continuation of periodic orbits in conservative and Hamiltonian systems, Physica D 181 (2003) 1-38).
module nocdyn_orbit_equations
  use nocdyn_bordered_system, only: bordered_system_t, new_bordered_system
  use nocdyn_elimination, only: new_node_order, node_order_t
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: differentiated, harmonic_basis_t, new_harmonic_basis, padded_series, product_matrix
  use nocdyn_kinds, only: wp
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  implicit none (type, external)
  private

  public :: begin_of, samples_of

  type, extends(periodic_machine_t), public :: orbit_equations_t
    type(harmonic_basis_t) :: basis
    real(wp), allocatable, private :: phase(:, :)    !! rates of the motion whose phase holds, of norm 1, [length, nodes]
    real(wp) :: least_oscillation = 0.0_wp           !! from which sizes of changes are measured [rad]
    integer :: freedoms = 0                          !! coordinates; the first nodes
    integer :: nodes = 0                             !! coordinates and internal states
    type(node_order_t), private :: order             !! of their elimination
    integer, allocatable, private :: element(:)      !! of this order for each position of the Jacobian, 0: none
    integer, allocatable :: row_node(:), column_node(:)   !! of each position of the Jacobian; row 0: none
    logical, allocatable :: is_speed(:)     !! whether its column is a speed
    type(bordered_system_t) :: system
    real(wp), allocatable, private :: t(:), y(:, :), rates(:, :), slopes(:, :)
    real(wp), allocatable, private :: swing(:, :), drift(:, :)   !! samples of the series; of their rates by tau, of coordinates
  contains
    procedure :: prepare, set_harmonics, residual, fill_system, unknowns, first_unknown, put_together, take_apart
    procedure :: sample, scalars, anchor
    procedure, private :: add_slopes, add_inertia, compose_states, residual_at
  end type orbit_equations_t

contains

  !> Samples that series up to a harmonic need, with room for those of laws and for the stages of a step of the multipliers.
  pure integer function samples_of(harmonics)
    integer, intent(in) :: harmonics

    samples_of = max(16, 8 * ((4 * harmonics + 2 + 7) / 8))
  end function samples_of

  !> Orders the unknowns of the machine.
  subroutine prepare(self)
    class(orbit_equations_t), intent(inout) :: self
    integer, allocatable :: column(:), row(:)
    integer :: k
    logical :: stays(self%machine%states - self%machine%freedoms)

    self%freedoms = self%machine%freedoms
    self%nodes = self%machine%states - self%freedoms
    associate (f => self%freedoms, pattern => self%machine%pattern)
      allocate (self%row_node, source=merge(pattern%row, pattern%row - f, pattern%row <= f))
      where (pattern%row > f .and. pattern%row <= 2 * f) self%row_node = 0
      allocate (self%is_speed, source=pattern%column <= f)
      allocate (self%column_node, source=merge(pattern%column, pattern%column - f, pattern%column <= f))
    end associate
    allocate (row, source=pack(self%row_node, self%row_node > 0))
    allocate (column, source=pack(self%column_node, self%row_node > 0))
    stays = .false.
    self%order = new_node_order(self%nodes, row, column, stays)
    stays(self%order%pivot(self%nodes)) = .true.
    self%order = new_node_order(self%nodes, row, column, stays)
    allocate (self%element(size(self%row_node)), source=0)
    do k = 1, size(self%element)
      if (self%row_node(k) > 0) self%element(k) = self%order%element(self%row_node(k), self%column_node(k))
    end do
  end subroutine prepare

  !> Changes the number of harmonics; `samples`, if present, is a least number of samples.
  subroutine set_harmonics(self, harmonics, error, samples)
    class(orbit_equations_t), intent(inout) :: self
    integer, intent(in) :: harmonics
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: samples
    integer :: n

    n = samples_of(harmonics)
    if (present(samples)) n = max(n, 4 * ((samples + 3) / 4))
    if (self%basis%harmonics == harmonics .and. self%basis%samples == n) return
    call self%machine%set_samples(n, error)
    if (allocated(error)) return
    self%basis = new_harmonic_basis(harmonics, n)
    if (allocated(self%t)) deallocate (self%t, self%y, self%rates, self%slopes, self%swing, self%drift)
    allocate (self%t(n), self%y(n, self%machine%states), self%rates(n, self%machine%states), &
              self%slopes(n, size(self%machine%pattern%row)), source=0.0_wp)
    allocate (self%swing(n, self%nodes), self%drift(n, self%freedoms), source=0.0_wp)
    self%system = new_bordered_system(self%order, harmonics, self%scalars() + 1)
  end subroutine set_harmonics

  !> The number of unknowns without the parameter.
  pure integer function unknowns(self)
    class(orbit_equations_t), intent(in) :: self

    unknowns = self%nodes * self%basis%length + self%scalars()
  end function unknowns

  !> The number of unknowns beside the series, which follow them: mean speeds or a torque, the damping of a conservative machine,
  !> and w if it is unknown.
  pure integer function scalars(self)
    class(orbit_equations_t), intent(in) :: self

    scalars = size(self%border) + merge(1, 0, allocated(self%travel)) + merge(1, 0, self%rate_is_unknown)
  end function scalars

  !> Motions are in phase with an orbit from now on.
  subroutine anchor(self, orbit)
    class(orbit_equations_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit   !! it oscillates

    self%phase = differentiated(orbit%series)
    self%phase(:, self%freedoms + 1:) = 0.0_wp
    self%phase = self%phase / norm2(self%phase)
  end subroutine anchor

  !> The place of the mean value of a node among the unknowns; its harmonics follow.
  pure integer function first_unknown(self, node)
    class(orbit_equations_t), intent(in) :: self
    integer, intent(in) :: node

    first_unknown = (node - 1) * self%basis%length + 1
  end function first_unknown

  !> The unknowns of an orbit, and its parameter.
  function put_together(self, orbit) result(x)
    class(orbit_equations_t), intent(in) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp) :: x(self%unknowns() + 1)
    integer :: i, n

    do n = 1, self%nodes
      i = self%first_unknown(n)
      x(i:i + self%basis%length - 1) = orbit%series(:, n)
    end do
    i = self%nodes * self%basis%length
    x(i + 1:i + size(self%border)) = self%put_border(orbit)
    if (allocated(self%travel)) x(size(x) - 2) = orbit%damping
    if (self%rate_is_unknown) x(size(x) - 1) = orbit%rate
    x(size(x)) = orbit%value
  end function put_together

  !> The orbit of unknowns.
  subroutine take_apart(self, x, orbit)
    class(orbit_equations_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    type(orbit_t), intent(inout) :: orbit   !! with speeds
    integer :: i, n

    if (allocated(orbit%series)) deallocate (orbit%series)
    allocate (orbit%series(self%basis%length, self%nodes))
    do n = 1, self%nodes
      i = self%first_unknown(n)
      orbit%series(:, n) = x(i:i + self%basis%length - 1)
    end do
    i = self%nodes * self%basis%length
    if (allocated(self%travel)) orbit%damping = x(size(x) - 2)
    if (self%rate_is_unknown) orbit%rate = x(size(x) - 1)
    call self%take_border(x(i + 1:i + size(self%border)), x(size(x)), orbit)
  end subroutine take_apart

  !> Times and states of an orbit at the samples of some basis.
  pure subroutine sample(self, orbit, basis, t, y)
    class(orbit_equations_t), intent(in) :: self
    type(orbit_t), intent(in) :: orbit
    type(harmonic_basis_t), intent(in) :: basis
    real(wp), intent(out) :: t(:), y(:, :)       !! [samples], [samples, states]
    real(wp) :: swing(basis%samples, self%nodes), drift(basis%samples, self%freedoms)

    call sample_series(orbit%series, basis, swing, drift)
    call self%compose_states(orbit, swing, drift, t, y)
  end subroutine sample

  !> Samples of series, and of the rates by tau of the first ones.
  pure subroutine sample_series(series, basis, values, rates)
    real(wp), intent(in) :: series(:, :)
    type(harmonic_basis_t), intent(in) :: basis
    real(wp), intent(out) :: values(:, :), rates(:, :)
    real(wp) :: padded(basis%length, size(series, 2))

    padded = padded_series(series, basis%length)
    values = basis%values_of(padded)
    rates = basis%values_of(differentiated(padded(:, :size(rates, 2))))
  end subroutine sample_series

  !> Times and states of an orbit by samples of its series.
  pure subroutine compose_states(self, orbit, swing, drift, t, y)
    class(orbit_equations_t), intent(in) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: swing(:, :), drift(:, :)   !! as of `sample_series`
    real(wp), intent(out) :: t(:), y(:, :)             !! [samples], [samples, states]
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    real(wp) :: steady(self%freedoms)
    integer :: c, i

    t = [(turn * i / size(t), i=0, size(t) - 1)] / orbit%rate
    steady = matmul(self%rigid, orbit%speed)
    associate (f => self%freedoms)
      y(:, :f) = orbit%rate * drift
      y(:, f + 1:) = swing
      do c = 1, size(self%free)
        y(:, f + self%free(c)) = y(:, f + self%free(c)) - orbit%series(1, self%free(c))   ! a mean acceleration, no angle
      end do
      do c = 1, f
        if (.not. abs(steady(c)) > 0) cycle
        y(:, c) = y(:, c) + steady(c)
        y(:, f + c) = y(:, f + c) + steady(c) * t
      end do
    end associate
  end subroutine compose_states

  !> The harmonics of the equations and the mean accelerations that must vanish.
  subroutine residual(self, orbit, r, error)
    class(orbit_equations_t), intent(inout) :: self
    type(orbit_t), intent(inout) :: orbit
    real(wp), intent(out) :: r(:)   !! [unknowns]
    type(error_t), allocatable, intent(out) :: error

    call sample_series(orbit%series, self%basis, self%swing, self%drift)
    call self%residual_at(orbit, r, error)
  end subroutine residual

  !> The same of an orbit whose series have been sampled.
  subroutine residual_at(self, orbit, r, error)
    class(orbit_equations_t), intent(inout) :: self
    type(orbit_t), intent(inout) :: orbit
    real(wp), intent(out) :: r(:)   !! [unknowns]
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: harmonics(self%basis%length, self%nodes), series(self%basis%length, self%nodes)
    real(wp) :: energy
    integer :: i, n, shared

    call self%set_value(orbit, error)
    if (allocated(error)) return
    call self%compose_states(orbit, self%swing, self%drift, self%t, self%y)
    call self%machine%rates(self%t, self%y, self%rates, error)
    if (allocated(error)) return
    series = padded_series(orbit%series, self%basis%length)
    associate (f => self%freedoms, free => self%free, w => orbit%rate)
      harmonics(:, :f) = self%basis%coefficients_of(self%rates(:, :f), self%basis%harmonics) / (-w**2)
      harmonics(:, f + 1:) = self%basis%coefficients_of(self%rates(:, 2 * f + 1:), self%basis%harmonics) / (-w)
      harmonics(:, :f) = harmonics(:, :f) + differentiated(differentiated(series(:, :f)))
      if (abs(orbit%damping) > 0) harmonics(:, :f) = harmonics(:, :f) + orbit%damping * differentiated(series(:, :f))
      harmonics(:, f + 1:) = harmonics(:, f + 1:) + differentiated(series(:, f + 1:))
      harmonics(1, free) = harmonics(1, free) + series(1, free)
    end associate
    harmonics(1, :self%freedoms) = harmonics(1, :self%freedoms) - self%holding_acceleration(orbit%torque) / orbit%rate**2
    do n = 1, self%nodes
      i = self%first_unknown(n)
      r(i:i + self%basis%length - 1) = harmonics(:, n)
    end do
    i = self%nodes * self%basis%length
    r(i + 1:i + size(self%border)) = series(1, self%free(self%border))
    if (self%is_over_energy) then
      call self%conservative_energy(self%origin, begin_of(series(:, :self%freedoms), self%free), energy, error)
      if (allocated(error)) return
      r(size(r) - 1) = (energy - orbit%value) / self%bounds(2)
    else if (allocated(self%travel)) then
      r(size(r) - 1) = amplitude(self%travel, series(:, :self%freedoms)) - orbit%value
    end if
    if (self%rate_is_unknown) then
      shared = min(size(self%phase, 1), self%basis%length)
      r(size(r)) = sum(self%phase(:shared, :) * series(:shared, :))
    end if
  end subroutine residual_at

  !> Fills the matrix of the equations about an orbit, with the last row for the parameter left to the caller. The columns of mean
  !> speeds, the holding torque, w and the parameter are central differences; those of the parameter do not leave its range.
  subroutine fill_system(self, orbit, steps, error)
    class(orbit_equations_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: steps(:)   !! of the differences, [scalars + 1]
    type(error_t), allocatable, intent(out) :: error
    real(wp), dimension(self%unknowns() + 1) :: x
    real(wp), dimension(self%unknowns()) :: before, after
    type(orbit_t) :: other
    real(wp) :: ends(2)
    integer :: k, n, place, shared

    call self%system%clear()
    other = orbit
    call self%set_value(other, error)
    if (allocated(error)) return
    call sample_series(other%series, self%basis, self%swing, self%drift)   ! all differences below have the same
    call self%compose_states(other, self%swing, self%drift, self%t, self%y)
    call self%machine%slopes(self%t, self%y, self%slopes)
    call self%add_slopes(other%rate)
    call self%add_inertia(other%damping)
    do k = 1, size(steps)
      place = self%nodes * self%basis%length + k
      x = self%put_together(orbit)
      ends = x(place) + [-steps(k), steps(k)]
      if (place == size(x) .and. ends(1) < self%bounds(1)) ends(1) = x(place)
      if (place == size(x) .and. ends(2) > self%bounds(2)) ends(2) = x(place)
      x(place) = ends(1)
      call self%take_apart(x, other)
      call self%residual_at(other, before, error)
      if (allocated(error)) return
      x(place) = ends(2)
      call self%take_apart(x, other)
      call self%residual_at(other, after, error)
      if (allocated(error)) return
      self%system%right(:size(after), k) = (after - before) / (ends(2) - ends(1))
    end do
    do k = 1, size(self%border)
      self%system%below(k, self%first_unknown(self%free(self%border(k)))) = 1.0_wp
    end do
    if (self%is_over_energy) then
      other = orbit
      call self%compose_states(other, self%swing, self%drift, self%t, self%y)
      call self%machine%rates(self%t, self%y, self%rates, error)
      if (allocated(error)) return
      associate (slopes => self%energy_slopes(self%rates(1, :self%freedoms)) / self%bounds(2))
        do n = 1, self%freedoms
          k = self%first_unknown(n)
          if (.not. any(n == self%free)) self%system%below(self%scalars() - 1, k) = slopes(n)
          self%system%below(self%scalars() - 1, k + 1:k + self%basis%length - 2:2) = slopes(n)
        end do
      end associate
    else if (allocated(self%travel)) then
      do n = 1, self%freedoms
        do k = 1, self%basis%harmonics, 2
          self%system%below(self%scalars() - 1, self%first_unknown(n) + 2 * k - 1) = self%travel(n)
        end do
      end do
    end if
    if (.not. self%rate_is_unknown) return
    shared = min(size(self%phase, 1), self%basis%length)
    do n = 1, self%nodes
      k = self%first_unknown(n)
      self%system%below(self%scalars(), k:k + shared - 1) = self%phase(:shared, n)
    end do
  end subroutine fill_system

  !> Angles of the coordinates at the begin of the period, rigid motions without their mean [rad].
  pure function begin_of(series, free) result(angles)
    real(wp), intent(in) :: series(:, :)   !! [length, coordinates]
    integer, intent(in) :: free(:)         !! coordinate of each rigid motion
    real(wp) :: angles(size(series, 2))

    angles = series(1, :)
    angles(free) = 0.0_wp
    angles = angles + sum(series(2::2, :), dim=1)
  end function begin_of

  !> Half the travel of an angle from the begin to the middle of the period: its cosines of odd harmonics.
  pure real(wp) function amplitude(travel, series)
    real(wp), intent(in) :: travel(:)      !! the angle by the coordinates, [coordinates]
    real(wp), intent(in) :: series(:, :)   !! [length, coordinates]

    amplitude = dot_product(travel, sum(series(2::4, :), dim=1))
  end function amplitude

  !> Adds what the laws contribute: products of their slopes with the series.
  subroutine add_slopes(self, w)
    class(orbit_equations_t), intent(inout) :: self
    real(wp), intent(in) :: w   !! [rad/s]
    real(wp), dimension(self%basis%length, self%basis%length) :: block, product
    complex(wp) :: factor(0:self%basis%harmonics)
    real(wp) :: g(4 * self%basis%harmonics + 1, 1), scale
    logical :: is_free
    integer :: h, k

    associate (harmonics => self%basis%harmonics)
      do k = 1, size(self%row_node)
        if (self%row_node(k) == 0) cycle
        if (.not. any(abs(self%slopes(:, k)) > 0)) cycle
        scale = -1.0_wp / merge(w**2, w, self%row_node(k) <= self%freedoms)
        is_free = any(self%column_node(k) == self%free)
        factor = scale
        if (self%is_speed(k)) factor = [(cmplx(0.0_wp, scale * w * h, wp), h=0, harmonics)]
        if (is_free) factor(0) = 0.0_wp
        associate (own => self%system%blocks(self%element(k)))
          if (.not. any(abs(self%slopes(:, k) - self%slopes(1, k)) > 0)) then   ! as of linear laws
            own%constant(:) = own%constant + self%slopes(1, k) * factor
            cycle
          end if
          g = self%basis%coefficients_of(self%slopes(:, k:k), 2 * harmonics)
          own%constant(:) = own%constant + g(1, 1) * factor
          g(1, 1) = 0.0_wp
          call product_matrix(harmonics, g(:, 1), product)
          block = product
          if (self%is_speed(k)) then
            do h = 1, harmonics
              block(:, 2 * h) = -(w * h) * product(:, 2 * h + 1)
              block(:, 2 * h + 1) = (w * h) * product(:, 2 * h)
            end do
          end if
          if (self%is_speed(k) .or. is_free) block(:, 1) = 0.0_wp
          call own%add_full(scale * block)
        end associate
      end do
    end associate
  end subroutine add_slopes

  !> Adds second derivatives of the coordinates, first ones of the internal states, and the mean accelerations.
  subroutine add_inertia(self, damping)
    class(orbit_equations_t), intent(inout) :: self
    real(wp), intent(in) :: damping   !! of an orbit
    complex(wp) :: constant(0:self%basis%harmonics)
    integer :: h, n

    do n = 1, self%nodes
      if (n <= self%freedoms) then
        constant = [(cmplx(-real(h, wp)**2, damping * h, wp), h=0, self%basis%harmonics)]
      else
        constant = [(cmplx(0.0_wp, real(h, wp), wp), h=0, self%basis%harmonics)]
      end if
      if (any(n == self%free)) constant(0) = 1.0_wp
      associate (own => self%system%blocks(self%order%diagonal(n)))
        own%constant(:) = own%constant + constant
      end associate
    end do
  end subroutine add_inertia

end module nocdyn_orbit_equations
