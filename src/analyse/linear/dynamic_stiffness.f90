!> The dynamic stiffness K + i Omega C - Omega^2 M of a linearised machine in its coordinates, as a complex band matrix.
!>
!> Every element e has a complex stiffness D_e(Omega) along its twist u_e = U_e q, so that the matrix is the sum of U_e^T D_e U_e
!> minus Omega^2 L_tau^T J L_tau. The coordinates are in an order that makes the band narrow: a chain needs time linear in its
!> bodies.
!>
!> An element that is much stiffer than the inertia beside it would take all digits of the others from the matrix, and its twist
!> would be a rounding. Its moment m is an unknown instead: U_e q - m / D_e = 0, and U_e^T m in place of U_e^T D_e U_e q.
module nocdyn_dynamic_stiffness
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_grouping, only: grouped, groups_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_complex, only: complex_band_factor, complex_band_solve, tridiagonal_factor, tridiagonal_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_t
  use nocdyn_stage_matrix, only: half_bandwidths
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: list_mass, new_dynamic_stiffness, new_band_work

  real(wp), parameter :: most_entries = 4.0e7_wp   ! of a band, 0.6 GB
  real(wp), parameter :: stiff = 1.0e8_wp          ! over Omega^2 times the inertia: half of the digits

  real(wp), parameter, public :: rigid_stiffness = 1.0e150_wp   !! of an element that does not turn [N m/rad]

  !> Some products of ratios, and where they are added in the band as one array.
  type :: products_t
    integer, allocatable :: first(:)    !! first entry of each element, [elements + 1]
    integer, allocatable :: place(:)    !! [entries]
    real(wp), allocatable :: value(:)   !! [entries]
  end type products_t

  type, public :: dynamic_stiffness_t
    integer :: coordinates = 0
    integer :: width = 0                            !! number of diagonals on either side of the main one
    integer, allocatable :: position(:)             !! in the band, of each coordinate and then of each moment, [unknowns]
    integer, allocatable, private :: unknown(:)     !! number of the moment of each element, 0: it is none, [elements]
    type(element_coordinates_t) :: incidence        !! U
    type(products_t), private :: stiffness          !! U_e^T U_e of each element
    type(products_t), private :: mass               !! entries of the mass matrix, one "element" [kg m2]
  contains
    procedure :: factor, factor_square, fill_real, positive_moments, add_forces, add_twist, solve, find_moment
  end type dynamic_stiffness_t

  !> Work space of one thread.
  type, public :: band_work_t
    complex(wp), allocatable :: band(:, :)         !! factors after `factor`, but for chains
    complex(wp), allocatable :: diagonals(:, :)    !! the factors of chains, whose band is tridiagonal
    complex(wp), allocatable :: x(:)               !! forces, then coordinates and scaled moments, in the order of the band
    real(wp), allocatable, private :: scale(:)     !! of the moments: unknown * scale [N m], [elements]
    integer, allocatable :: pivots(:)
  end type band_work_t

contains

  !> The pattern of a machine's matrices. A machine with too wide a band is refused.
  subroutine new_dynamic_stiffness(machine, incidence, frequency, stiffness, self, error, moments_follow)
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: incidence   !! of its elements
    real(wp), intent(in) :: frequency                      !! the lowest one [rad/s]
    real(wp), intent(in) :: stiffness(:)                   !! the largest |D_e| at low frequencies [N m/rad], [elements]
    type(dynamic_stiffness_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    logical, intent(in), optional :: moments_follow        !! whether each moment comes after the coordinates of its element, so
                                                           !! that pivots need no row interchanges
    type(entries_t) :: entries
    integer, allocatable :: mass_row(:), mass_column(:), order(:)
    integer :: c, unknowns, upper

    self%coordinates = machine%coordinates%freedoms
    self%incidence = incidence
    call list_mass(machine, mass_row, mass_column, self%mass%value)
    call choose_moments(self, mass_row, mass_column, frequency**2, stiffness)
    unknowns = self%coordinates + count(self%unknown > 0)
    call list_pairs(self, entries, self%stiffness)
    entries%row = [entries%row, mass_row]
    entries%column = [entries%column, mass_column]
    order = reverse_cuthill_mckee(unknowns, entries%row, entries%column)
    if (present(moments_follow)) call put_moments_back(self, mass_row, mass_column, order)
    call half_bandwidths(order, entries, self%width, upper)
    self%width = max(self%width, upper)
    if ((3.0_wp * self%width + 1.0_wp) * unknowns > most_entries) then
      call raise(error, exit_input, 'the response needs a matrix of ' // to_text(3 * self%width + 1) // ' x ' // &
                 to_text(unknowns) // ' entries for this machine, whose couplings leave no narrower band')
      return
    end if
    allocate (self%position(unknowns))
    self%position(order) = [(c, c=1, unknowns)]
    self%stiffness%place = places(self, entries%row(:size(self%stiffness%value)), entries%column(:size(self%stiffness%value)))
    self%mass%place = places(self, mass_row, mass_column)
  end subroutine new_dynamic_stiffness

  !> Orders the coordinates, and puts each moment behind the last coordinate of its element.
  subroutine put_moments_back(self, mass_row, mass_column, order)
    type(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: mass_row(:), mass_column(:)   !! of the entries of the mass matrix
    integer, allocatable, intent(inout) :: order(:)      !! unknown at each place
    type(dynamic_stiffness_t) :: plain
    type(entries_t) :: entries
    type(groups_t) :: places
    type(products_t) :: products
    integer, allocatable :: coordinates(:)
    integer :: behind(size(order)), c, e, position(self%coordinates)

    if (all(self%unknown == 0)) return
    plain%coordinates = self%coordinates
    plain%incidence = self%incidence
    allocate (plain%unknown(size(self%unknown)), source=0)
    call list_pairs(plain, entries, products)
    coordinates = reverse_cuthill_mckee(self%coordinates, [entries%row, mass_row], [entries%column, mass_column])
    position(coordinates) = [(c, c=1, size(coordinates))]
    behind(:self%coordinates) = position
    do e = 1, size(self%unknown)
      if (self%unknown(e) == 0) cycle
      associate (members => self%incidence%coordinate(self%incidence%first(e):self%incidence%first(e + 1) - 1))
        behind(self%unknown(e)) = maxval(position(members))
      end associate
    end do
    places = grouped(self%coordinates, behind, [(c, c=1, size(order))])   ! each coordinate before its moments
    order = places%member
  end subroutine put_moments_back

  !> Index of entries in the band as one array.
  pure function places(self, row, column) result(place)
    type(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: row(:), column(:)   !! coordinates
    integer, allocatable :: place(:)

    place = (3 * self%width + 1) * (self%position(column) - 1) + 2 * self%width + 1 + self%position(row) - self%position(column)
  end function places

  !> All entries of L_tau^T J L_tau, several for one position perhaps.
  subroutine list_mass(machine, row, column, value)
    type(machine_t), intent(in) :: machine
    integer, allocatable, intent(out) :: row(:), column(:)   !! coordinates
    real(wp), allocatable, intent(out) :: value(:)           !! [kg m2]
    integer :: b, i, k, n

    associate (map => machine%coordinates)
      n = sum((map%first(2:) - map%first(:machine%bodies))**2)
      allocate (row(n), column(n), value(n))
      n = 0
      do b = 1, machine%bodies
        do i = map%first(b), map%first(b + 1) - 1
          do k = map%first(b), map%first(b + 1) - 1
            n = n + 1
            row(n) = map%coordinate(k)
            column(n) = map%coordinate(i)
            value(n) = map%ratio(1, k) * machine%inertia(1, b) * map%ratio(1, i)
          end do
        end do
      end do
    end associate
  end subroutine list_mass

  !> Numbers the moments of the elements that are too stiff.
  subroutine choose_moments(self, row, column, square, stiffness)
    type(dynamic_stiffness_t), intent(inout) :: self
    integer, intent(in) :: row(:), column(:)   !! of the entries of the mass matrix
    real(wp), intent(in) :: square             !! of the lowest frequency [rad2/s2]
    real(wp), intent(in) :: stiffness(:)       !! |D_e| [N m/rad], [elements]
    integer :: e, k, n
    real(wp) :: inertia(self%coordinates), least

    inertia = 0.0_wp
    do k = 1, size(row)
      if (row(k) == column(k)) inertia(row(k)) = inertia(row(k)) + self%mass%value(k)
    end do
    allocate (self%unknown(size(stiffness)), source=0)
    n = self%coordinates
    do e = 1, size(stiffness)
      associate (members => self%incidence%coordinate(self%incidence%first(e):self%incidence%first(e + 1) - 1), &
                 ratios => self%incidence%ratio(1, self%incidence%first(e):self%incidence%first(e + 1) - 1))
        if (size(members) == 0) cycle
        least = minval(inertia(members) / ratios**2)
      end associate
      if (.not. stiffness(e) > stiff * square * least) cycle
      n = n + 1
      self%unknown(e) = n
    end do
  end subroutine choose_moments

  !> The products of all pairs of ratios of each element; of an element whose moment is an unknown, its ratios in the column and
  !> in the row of the moment, and the diagonal.
  subroutine list_pairs(self, entries, products)
    type(dynamic_stiffness_t), intent(in) :: self
    type(entries_t), intent(out) :: entries   !! their rows and columns
    type(products_t), intent(out) :: products
    integer :: e, i, k, n

    associate (incidence => self%incidence, first => self%incidence%first)
      n = sum(merge(2 * (first(2:) - first(:size(first) - 1)) + 1, (first(2:) - first(:size(first) - 1))**2, self%unknown > 0))
      allocate (entries%row(n), entries%column(n), products%value(n), products%first(size(first)))
      n = 0
      do e = 1, size(first) - 1
        products%first(e) = n + 1
        if (self%unknown(e) > 0) then
          associate (members => first(e + 1) - first(e), c => incidence%coordinate(first(e):first(e + 1) - 1))
            entries%row(n + 1:n + 2 * members + 1) = [c, spread(self%unknown(e), 1, members + 1)]
            entries%column(n + 1:n + 2 * members + 1) = [spread(self%unknown(e), 1, members), c, self%unknown(e)]
            products%value(n + 1:n + 2 * members) = [incidence%ratio(1, first(e):first(e + 1) - 1), &
                                                     incidence%ratio(1, first(e):first(e + 1) - 1)]
            n = n + 2 * members + 1
            products%value(n) = 1.0_wp
          end associate
          cycle
        end if
        do i = first(e), first(e + 1) - 1
          do k = first(e), first(e + 1) - 1
            n = n + 1
            entries%row(n) = incidence%coordinate(k)
            entries%column(n) = incidence%coordinate(i)
            products%value(n) = incidence%ratio(1, k) * incidence%ratio(1, i)
          end do
        end do
      end do
      products%first(size(first)) = n + 1
    end associate
  end subroutine list_pairs

  !> Work space for the matrices.
  function new_band_work(matrix) result(work)
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(band_work_t) :: work

    associate (unknowns => size(matrix%position))
      allocate (work%band(3 * matrix%width + 1, unknowns), work%x(unknowns), source=(0.0_wp, 0.0_wp))
      allocate (work%pivots(unknowns))
      allocate (work%scale(size(matrix%unknown)), source=0.0_wp)
      if (matrix%width == 1) allocate (work%diagonals(unknowns, 4))
    end associate
  end function new_band_work

  !> Sets and factors the matrix at a frequency.
  pure subroutine factor(self, frequency, stiffness, work, singular)
    class(dynamic_stiffness_t), intent(in) :: self
    real(wp), intent(in) :: frequency          !! Omega [rad/s]
    complex(wp), intent(in) :: stiffness(:)    !! D_e(Omega) [N m/rad], [elements]
    type(band_work_t), intent(inout) :: work
    logical, intent(out) :: singular           !! an undamped resonance, exactly

    call self%factor_square(cmplx(frequency**2, kind=wp), stiffness, work, singular)
  end subroutine factor

  !> Sets and factors the matrix at a complex frequency.
  pure subroutine factor_square(self, square, stiffness, work, singular)
    class(dynamic_stiffness_t), intent(in) :: self
    complex(wp), intent(in) :: square          !! Omega^2 [rad2/s2]
    complex(wp), intent(in) :: stiffness(:)    !! D_e(Omega) [N m/rad], [elements]
    type(band_work_t), intent(inout) :: work
    logical, intent(out) :: singular           !! a natural frequency, exactly

    call fill(self, size(work%band), square, stiffness, work%band, work%scale)
    if (self%width == 1) then
      associate (n => size(self%position))
        work%diagonals(:n - 1, 1) = work%band(4, :n - 1)
        work%diagonals(:, 2) = work%band(3, :)
        work%diagonals(:n - 1, 3) = work%band(2, 2:)
      end associate
      call tridiagonal_factor(work%diagonals, work%pivots, singular)
    else
      call complex_band_factor(self%width, self%width, work%band, work%pivots, singular)
    end if
  end subroutine factor_square

  !> Sets the real part of the matrix, without factoring it. It is symmetric.
  pure subroutine fill_real(self, square, stiffness, work, band)
    class(dynamic_stiffness_t), intent(in) :: self
    real(wp), intent(in) :: square             !! Omega^2, may be negative [rad2/s2]
    complex(wp), intent(in) :: stiffness(:)    !! D_e [N m/rad], [elements]
    type(band_work_t), intent(inout) :: work
    real(wp), intent(inout) :: band(:, :)      !! as of `band_factor`, [3 width + 1, unknowns]

    call fill(self, size(work%band), cmplx(square, kind=wp), stiffness, work%band, work%scale)
    band = real(work%band, wp)
  end subroutine fill_real

  !> The number of moments of elements with positive stiffness that are unknowns: each makes one eigenvalue of the matrix
  !> negative.
  pure integer function positive_moments(self, stiffness) result(moments)
    class(dynamic_stiffness_t), intent(in) :: self
    complex(wp), intent(in) :: stiffness(:)    !! D_e [N m/rad], [elements]

    moments = count(self%unknown > 0 .and. real(stiffness, wp) > 0)
  end function positive_moments

  !> Sets the matrix, as one array.
  pure subroutine fill(self, n, square, stiffness, band, scale)
    type(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: n
    complex(wp), intent(in) :: square   ! Omega^2
    complex(wp), intent(in) :: stiffness(:)
    complex(wp), intent(out) :: band(n)
    real(wp), intent(inout) :: scale(:)   !! of the moments that are unknowns
    real(wp), parameter :: above = 4.0_wp
    integer :: e, k
    real(wp) :: moment_scale

    band = (0.0_wp, 0.0_wp)
    do e = 1, size(stiffness)
      if (self%unknown(e) > 0) cycle
      do k = self%stiffness%first(e), self%stiffness%first(e + 1) - 1
        band(self%stiffness%place(k)) = band(self%stiffness%place(k)) + self%stiffness%value(k) * stiffness(e)
      end do
    end do
    do k = 1, size(self%mass%place)
      band(self%mass%place(k)) = band(self%mass%place(k)) - square * self%mass%value(k)
    end do
    do e = 1, size(stiffness)
      if (self%unknown(e) == 0) cycle
      ! A power of two above the entries beside a moment: the pivots are the ones of rigid rows, whose sums around a ring are
      ! exact
      moment_scale = tiny(1.0_wp)
      do k = self%incidence%first(e), self%incidence%first(e + 1) - 1
        associate (diagonal => (3 * self%width + 1) * (self%position(self%incidence%coordinate(k)) - 1) + 2 * self%width + 1)
          moment_scale = max(moment_scale, abs(band(diagonal)) / abs(self%incidence%ratio(1, k)))
        end associate
      end do
      moment_scale = 2.0_wp**exponent(above * moment_scale)
      scale(e) = moment_scale
      ! The column and the row of a moment m = scale * unknown, both times the scale. Without stiffness the moment is zero.
      associate (first => self%stiffness%first(e), last => self%stiffness%first(e + 1) - 1)
        do k = first, last - 1
          if (2 * (k - first) >= last - first .and. .not. abs(stiffness(e)) > 0) cycle
          band(self%stiffness%place(k)) = band(self%stiffness%place(k)) + self%stiffness%value(k) * scale(e)
        end do
        band(self%stiffness%place(last)) = scale(e)
        if (abs(stiffness(e)) > 0) band(self%stiffness%place(last)) = -scale(e) * (scale(e) / stiffness(e))
      end associate
    end do
  end subroutine fill

  !> Adds a twist in series with an element to the forces `work%x`, after `factor`.
  pure subroutine add_twist(self, element, stiffness, twist, work)
    class(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: element
    complex(wp), intent(in) :: stiffness    !! D_e [N m/rad]
    complex(wp), intent(in) :: twist        !! [rad]
    type(band_work_t), intent(inout) :: work

    if (self%unknown(element) == 0) then
      call self%add_forces(element, stiffness * twist, work)
    else if (abs(stiffness) > 0) then
      associate (x => work%x(self%position(self%unknown(element))))
        x = x + work%scale(element) * twist
      end associate
    end if
  end subroutine add_twist

  !> Adds the moment of an element to the forces `work%x`.
  pure subroutine add_forces(self, element, moment, work)
    class(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: element
    complex(wp), intent(in) :: moment   !! on `to` [N m]
    type(band_work_t), intent(inout) :: work
    integer :: k

    do k = self%incidence%first(element), self%incidence%first(element + 1) - 1
      associate (x => work%x(self%position(self%incidence%coordinate(k))))
        x = x + self%incidence%ratio(1, k) * moment
      end associate
    end do
  end subroutine add_forces

  !> Solves for the coordinates, after `factor` and `add_forces`.
  pure subroutine solve(self, work)
    class(dynamic_stiffness_t), intent(in) :: self
    type(band_work_t), intent(inout) :: work

    if (self%width == 1) then
      call tridiagonal_solve(work%diagonals, work%pivots, work%x)
    else
      call complex_band_solve(self%width, self%width, work%band, work%pivots, work%x)
    end if
  end subroutine solve

  !> The twist of an element without that in series, and its moment, after `solve`.
  pure subroutine find_moment(self, element, stiffness, series, work, twist, moment)
    class(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: element
    complex(wp), intent(in) :: stiffness   !! D_e [N m/rad]
    complex(wp), intent(in) :: series      !! twist in series [rad]
    type(band_work_t), intent(in) :: work
    complex(wp), intent(out) :: twist      !! u_e - series [rad]
    complex(wp), intent(out) :: moment     !! -D_e (u_e - series) [N m]
    integer :: k

    twist = (0.0_wp, 0.0_wp)
    if (self%unknown(element) > 0) then
      moment = -work%scale(element) * work%x(self%position(self%unknown(element)))
      if (abs(stiffness) > 0) twist = -moment / stiffness
      return
    end if
    do k = self%incidence%first(element), self%incidence%first(element + 1) - 1
      twist = twist + self%incidence%ratio(1, k) * work%x(self%position(self%incidence%coordinate(k)))
    end do
    twist = twist - series
    moment = -stiffness * twist
  end subroutine find_moment

end module nocdyn_dynamic_stiffness
