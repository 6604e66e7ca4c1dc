!> Floquet multipliers of a periodic motion: the eigenvalues of the monodromy matrix, which the variational equations along the
!> motion give over one period.
!>
!> Multipliers that are 1 whatever the machine does are taken out: a shift of all angles of a free rotation, or of the time where
!> only orders or nothing excite it.
module nocdyn_orbit_multipliers
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvalues
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_orbit_variations, only: find_monodromy, states_at
  use nocdyn_periodic_machine, only: orbit_t
  implicit none (type, external)
  private

  public :: deflate, find_multipliers, multipliers_of, scale_speeds

contains

  !> The multipliers by descending modulus.
  subroutine find_multipliers(equations, orbit, multipliers, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: orbit
    complex(wp), allocatable, intent(out) :: multipliers(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: matrix(:, :), known(:, :)

    call find_monodromy(equations, orbit, matrix, error)
    if (allocated(error)) return
    call known_vectors(equations, orbit, known, error)
    if (.not. allocated(error)) call multipliers_of(equations%freedoms, matrix, known, multipliers, error)
  end subroutine find_multipliers

  !> The eigenvalues of a monodromy matrix by descending modulus, without those of known eigenvectors, which are 1.
  subroutine multipliers_of(freedoms, matrix, known, multipliers, error)
    integer, intent(in) :: freedoms                         !! coordinates
    real(wp), allocatable, intent(inout) :: matrix(:, :)    !! [states, states], on return without these
    real(wp), allocatable, intent(inout) :: known(:, :)     !! [states, vectors], on return none
    complex(wp), allocatable, intent(out) :: multipliers(:)
    type(error_t), allocatable, intent(out) :: error
    complex(wp), allocatable :: values(:)
    integer :: k, largest
    logical :: has_failed
    logical, allocatable :: is_left(:)

    call scale_speeds(freedoms, matrix, known)
    do k = 1, size(known, 2)
      call deflate(matrix, known)
    end do
    associate (n => size(matrix, 1))
      allocate (values(n), multipliers(n))
      call eigenvalues(matrix, values, has_failed)
    end associate
    if (has_failed) then
      call raise(error, exit_failed, 'the multipliers of the orbit were not found')
      return
    end if
    allocate (is_left(size(values)), source=.true.)
    do k = 1, size(values)
      largest = maxloc(abs(values), dim=1, mask=is_left)
      is_left(largest) = .false.
      multipliers(k) = values(largest)
    end do
  end subroutine multipliers_of

  !> Variations that return as they are: of the time or of the angles of a free rotation, and of a speed that nothing brakes.
  subroutine known_vectors(equations, orbit, known, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(in) :: orbit
    real(wp), allocatable, intent(out) :: known(:, :)   !! [states, vectors]
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: t(equations%machine%samples)
    real(wp), dimension(equations%machine%samples, equations%machine%states) :: rates, y
    integer :: floating, m, n

    floating = size(equations%free) - size(equations%border)
    n = size(equations%free)
    allocate (known(equations%machine%states, n + floating + merge(1, 0, equations%rate_is_unknown)), source=0.0_wp)
    t = 0.0_wp
    do m = 1, size(equations%free)
      associate (f => equations%freedoms)
        if (m == equations%period%motion) then
          call states_at(equations, orbit, t, y)
          call equations%machine%rates(t, y, rates, error)
          if (allocated(error)) return
          known(:, m) = rates(1, :)
          known(:f, m) = known(:f, m) + equations%holding_acceleration(orbit%torque)
        else
          known(f + 1:2 * f, m) = equations%rigid(:, m)
        end if
        if (any(equations%border == m)) cycle
        n = n + 1
        known(:f, n) = equations%rigid(:, m)
      end associate
    end do
    if (.not. equations%rate_is_unknown) return
    call states_at(equations, orbit, t, y)
    call equations%machine%rates(t, y, rates, error)
    if (allocated(error)) return
    associate (f => equations%freedoms)
      rates(1, f + 1:2 * f) = rates(1, f + 1:2 * f) - matmul(equations%rigid, orbit%speed)
    end associate
    known(:, n + 1) = rates(1, :)
    associate (f => equations%freedoms)
      known(:f, n + 1) = known(:f, n + 1) + equations%holding_acceleration(orbit%torque)
    end associate
  end subroutine known_vectors

  !> Divides speeds by a frequency that makes them as large as angles: else reflections mix numbers of very different sizes.
  pure subroutine scale_speeds(f, matrix, known)
    integer, intent(in) :: f   !! number of coordinates
    real(wp), intent(inout) :: matrix(:, :), known(:, :)
    real(wp) :: scale

    scale = sqrt(norm2(matrix(:f, f + 1:2 * f)) / max(norm2(matrix(f + 1:2 * f, :f)), tiny(scale)))
    if (.not. (scale > 0 .and. scale < huge(scale))) return
    matrix(:f, :) = matrix(:f, :) / scale
    matrix(:, :f) = matrix(:, :f) * scale
    known(:f, :) = known(:f, :) / scale
  end subroutine scale_speeds

  !> Takes an eigenvector out of a matrix and out of other vectors, by a reflection that turns it to the first axis.
  subroutine deflate(matrix, known)
    real(wp), allocatable, intent(inout) :: matrix(:, :)
    real(wp), allocatable, intent(inout) :: known(:, :)   !! the first column is an eigenvector
    real(wp) :: v(size(matrix, 1))
    integer :: j

    v = known(:, 1) / norm2(known(:, 1))
    v(1) = v(1) + sign(1.0_wp, v(1))
    v = v * (sqrt(2.0_wp) / norm2(v))
    do j = 1, size(matrix, 2)
      matrix(:, j) = matrix(:, j) - v * dot_product(v, matrix(:, j))
    end do
    do j = 1, size(matrix, 1)
      matrix(j, :) = matrix(j, :) - v * dot_product(v, matrix(j, :))
    end do
    do j = 1, size(known, 2)
      known(:, j) = known(:, j) - v * dot_product(v, known(:, j))
    end do
    matrix = matrix(2:, 2:)
    known = known(2:, 2:)
  end subroutine deflate

end module nocdyn_orbit_multipliers
