!> The dynamic stiffness K + i Omega C - Omega^2 M of a linearised machine in its coordinates, as a complex band matrix.
!>
!> Every element e has a complex stiffness D_e(Omega) along its twist u_e = U_e q, so that the matrix is the sum of U_e^T D_e U_e
!> minus Omega^2 L_tau^T J L_tau. The coordinates are in an order that makes the band narrow: a chain needs time linear in its
!> bodies.
module nocdyn_dynamic_stiffness
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_complex, only: complex_band_factor, complex_band_solve, tridiagonal_factor, tridiagonal_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_t
  use nocdyn_stage_matrix, only: half_bandwidths
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: new_dynamic_stiffness, new_band_work

  real(wp), parameter :: most_entries = 4.0e7_wp   ! of a band, 0.6 GB

  !> Some products of ratios, and where they are added in the band as one array.
  type :: products_t
    integer, allocatable :: first(:)    !! first entry of each element, [elements + 1]
    integer, allocatable :: place(:)    !! [entries]
    real(wp), allocatable :: value(:)   !! [entries]
  end type products_t

  type, public :: dynamic_stiffness_t
    integer :: coordinates = 0
    integer :: width = 0                            !! number of diagonals on either side of the main one
    integer, allocatable :: position(:)             !! of each coordinate in the band, [coordinates]
    type(element_coordinates_t) :: incidence        !! U
    type(products_t), private :: stiffness          !! U_e^T U_e of each element
    type(products_t), private :: mass               !! entries of the mass matrix, one "element" [kg m2]
  contains
    procedure :: factor, factor_square, add_forces, solve, twist
  end type dynamic_stiffness_t

  !> Work space of one thread.
  type, public :: band_work_t
    complex(wp), allocatable :: band(:, :)         !! factors after `factor`, but for chains
    complex(wp), allocatable :: diagonals(:, :)    !! the factors of chains, whose band is tridiagonal
    complex(wp), allocatable :: x(:)               !! forces, then coordinates, in the order of the band
    integer, allocatable :: pivots(:)
  end type band_work_t

contains

  !> The pattern of a machine's matrices. A machine with too wide a band is refused.
  subroutine new_dynamic_stiffness(machine, incidence, self, error)
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: incidence   !! of its elements
    type(dynamic_stiffness_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(entries_t) :: entries
    integer, allocatable :: mass_row(:), mass_column(:)
    integer :: order(machine%coordinates%freedoms), c, upper

    self%coordinates = machine%coordinates%freedoms
    self%incidence = incidence
    call list_mass(machine, mass_row, mass_column, self%mass%value)
    call list_pairs(self%incidence, entries, self%stiffness)
    entries%row = [entries%row, mass_row]
    entries%column = [entries%column, mass_column]
    order = reverse_cuthill_mckee(self%coordinates, entries%row, entries%column)
    call half_bandwidths(order, entries, self%width, upper)
    self%width = max(self%width, upper)
    if ((3.0_wp * self%width + 1.0_wp) * self%coordinates > most_entries) then
      call raise(error, exit_input, 'the response needs a matrix of ' // to_text(3 * self%width + 1) // ' x ' // &
                 to_text(self%coordinates) // ' entries for this machine, whose couplings leave no narrower band')
      return
    end if
    allocate (self%position(self%coordinates))
    self%position(order) = [(c, c=1, self%coordinates)]
    self%stiffness%place = places(self, entries%row(:size(self%stiffness%value)), entries%column(:size(self%stiffness%value)))
    self%mass%place = places(self, mass_row, mass_column)
  end subroutine new_dynamic_stiffness

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

  !> The products of all pairs of ratios of each element.
  subroutine list_pairs(incidence, entries, products)
    type(element_coordinates_t), intent(in) :: incidence
    type(entries_t), intent(out) :: entries   !! their rows and columns
    type(products_t), intent(out) :: products
    integer :: e, i, k, n

    associate (first => incidence%first)
      n = sum((first(2:) - first(:size(first) - 1))**2)
      allocate (entries%row(n), entries%column(n), products%value(n), products%first(size(first)))
      n = 0
      do e = 1, size(first) - 1
        products%first(e) = n + 1
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

    allocate (work%band(3 * matrix%width + 1, matrix%coordinates), work%x(matrix%coordinates), &
              source=(0.0_wp, 0.0_wp))
    allocate (work%pivots(matrix%coordinates))
    if (matrix%width == 1) allocate (work%diagonals(matrix%coordinates, 4))
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

    call fill(self, size(work%band), square, stiffness, work%band)
    if (self%width == 1) then
      associate (n => self%coordinates)
        work%diagonals(:n - 1, 1) = work%band(4, :n - 1)
        work%diagonals(:, 2) = work%band(3, :)
        work%diagonals(:n - 1, 3) = work%band(2, 2:)
      end associate
      call tridiagonal_factor(work%diagonals, work%pivots, singular)
    else
      call complex_band_factor(self%width, self%width, work%band, work%pivots, singular)
    end if
  end subroutine factor_square

  !> Sets the matrix, as one array.
  pure subroutine fill(self, n, square, stiffness, band)
    type(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: n
    complex(wp), intent(in) :: square   ! Omega^2
    complex(wp), intent(in) :: stiffness(:)
    complex(wp), intent(out) :: band(n)
    integer :: e, k

    band = (0.0_wp, 0.0_wp)
    do e = 1, size(stiffness)
      do k = self%stiffness%first(e), self%stiffness%first(e + 1) - 1
        band(self%stiffness%place(k)) = band(self%stiffness%place(k)) + self%stiffness%value(k) * stiffness(e)
      end do
    end do
    do k = 1, size(self%mass%place)
      band(self%mass%place(k)) = band(self%mass%place(k)) - square * self%mass%value(k)
    end do
  end subroutine fill

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

  !> The twist of an element, after `solve` [rad].
  pure complex(wp) function twist(self, element, work)
    class(dynamic_stiffness_t), intent(in) :: self
    integer, intent(in) :: element
    type(band_work_t), intent(in) :: work
    integer :: k

    twist = (0.0_wp, 0.0_wp)
    do k = self%incidence%first(element), self%incidence%first(element + 1) - 1
      twist = twist + self%incidence%ratio(1, k) * work%x(self%position(self%incidence%coordinate(k)))
    end do
  end function twist

end module nocdyn_dynamic_stiffness
