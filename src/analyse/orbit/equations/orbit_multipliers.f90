!> Floquet multipliers of a periodic motion: the eigenvalues of the monodromy matrix, which the variational equations along the
!> motion give over one period.
!>
!> Multipliers that are 1 whatever the machine does are taken out: a shift of all angles of a free rotation, or of the time where
!> only orders or nothing excite it. The equations are integrated by DOP853 with even steps.
module nocdyn_orbit_multipliers
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_explicit_tables, only: dormand_prince_8, explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_harmonic_basis, only: differentiated
  use nocdyn_lapack_eigen, only: eigenvectors
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_periodic_machine, only: orbit_t
  implicit none (type, external)
  private

  public :: deflate, find_monodromy, find_multipliers, multipliers_of, scale_speeds, steps_of

  integer, parameter :: stages = 12            ! of DOP853 without its dense output
  real(wp), parameter :: longest = 0.5_wp      ! step times a bound of the eigenvalues of the Jacobian
  integer, parameter :: fewest = 4             ! steps for each harmonic

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
    complex(wp), allocatable :: values(:), vectors(:, :)
    integer :: k, largest
    logical :: has_failed
    logical, allocatable :: is_left(:)

    call scale_speeds(freedoms, matrix, known)
    do k = 1, size(known, 2)
      call deflate(matrix, known)
    end do
    associate (n => size(matrix, 1))
      allocate (values(n), vectors(n, n), multipliers(n))
      call eigenvectors(matrix, values, vectors, has_failed)
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

  !> Derivatives of the state after one period by the state at its begin, [states, states].
  subroutine find_monodromy(equations, orbit, matrix, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: orbit
    real(wp), allocatable, intent(out) :: matrix(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    type(explicit_table_t) :: table
    real(wp), allocatable :: slopes(:, :), k(:, :, :), y(:, :)
    real(wp) :: h
    integer :: first, i, j, n, s, steps, together

    call equations%set_value(orbit, error)
    if (allocated(error)) return
    table = dormand_prince_8()
    n = equations%machine%states
    steps = steps_of(equations, orbit)
    h = turn / orbit%rate / steps
    together = max(1, equations%machine%samples / stages)
    allocate (matrix(n, n), source=0.0_wp)
    do i = 1, n
      matrix(i, i) = 1.0_wp
    end do
    allocate (k(n, n, stages), y(n, n))
    do i = 0, steps - 1
      first = modulo(i, together)
      if (first == 0) call slopes_along(equations, orbit, table%c(:stages), i, min(together, steps - i), h, slopes)
      do s = 1, stages
        y = matrix
        do j = 1, s - 1
          if (abs(table%a(s, j)) > 0) y = y + (h * table%a(s, j)) * k(:, :, j)
        end do
        call vary(equations, slopes(first * stages + s, :), y, k(:, :, s))
      end do
      do s = 1, stages
        if (abs(table%b(s)) > 0) matrix = matrix + (h * table%b(s)) * k(:, :, s)
      end do
    end do
  end subroutine find_monodromy

  !> The number of steps over a period: many where a machine has stiff parts, as they are explicit.
  integer function steps_of(equations, orbit) result(steps)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(in) :: orbit
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    real(wp), allocatable :: slopes(:, :)
    real(wp) :: angles(equations%freedoms), speeds(equations%freedoms), internal(equations%machine%states), bound
    integer :: k

    call slopes_along(equations, orbit, [0.0_wp], 0, equations%machine%samples, &
                      turn / orbit%rate / equations%machine%samples, slopes)
    angles = 0.0_wp
    speeds = 0.0_wp
    internal = 0.0_wp
    associate (f => equations%freedoms, pattern => equations%machine%pattern)
      do k = 1, size(pattern%row)
        if (pattern%row(k) > 2 * f) then
          internal(pattern%row(k)) = internal(pattern%row(k)) + &
                                     merge(maxval(abs(slopes(:, k))), 0.0_wp, pattern%column(k) > 2 * f)
        else if (pattern%row(k) <= f .and. pattern%column(k) <= f) then
          speeds(pattern%row(k)) = speeds(pattern%row(k)) + maxval(abs(slopes(:, k)))
        else if (pattern%row(k) <= f .and. pattern%column(k) <= 2 * f) then
          angles(pattern%row(k)) = angles(pattern%row(k)) + maxval(abs(slopes(:, k)))
        end if
      end do
    end associate
    bound = max(sqrt(maxval(angles)), maxval(speeds), maxval(internal))
    steps = max(fewest * equations%basis%harmonics, ceiling(turn / orbit%rate * bound / longest))
  end function steps_of

  !> The Jacobian at the stages of some steps, [steps times stages, positions].
  subroutine slopes_along(equations, orbit, c, first, steps, h, slopes)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: c(:)                 !! parts of a step, of the stages
    integer, intent(in) :: first, steps          !! steps before the first one; their number
    real(wp), intent(in) :: h                    !! [s]
    real(wp), allocatable, intent(out) :: slopes(:, :)
    real(wp) :: t(equations%machine%samples), y(equations%machine%samples, equations%machine%states)
    integer :: i, s

    t = 0.0_wp
    do i = 0, steps - 1
      do s = 1, size(c)
        t(i * size(c) + s) = (first + i + c(s)) * h
      end do
    end do
    call states_at(equations, orbit, t, y)
    allocate (slopes(size(t), size(equations%machine%pattern%row)))
    call equations%machine%slopes(t, y, slopes)
  end subroutine slopes_along

  !> States of an orbit at some times.
  subroutine states_at(equations, orbit, t, y)
    type(orbit_equations_t), intent(in) :: equations
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: t(:)              !! [s]
    real(wp), intent(out) :: y(:, :)          !! [times, states]
    real(wp) :: values(size(t), size(orbit%series, 1)), series(size(orbit%series, 1), equations%nodes)
    real(wp) :: steady(equations%freedoms)
    integer :: c, k

    values(:, 1) = 1.0_wp
    do k = 1, size(values, 2) / 2
      values(:, 2 * k) = cos(k * (orbit%rate * t))
      values(:, 2 * k + 1) = sin(k * (orbit%rate * t))
    end do
    series = orbit%series
    series(1, equations%free) = 0.0_wp
    steady = matmul(equations%rigid, orbit%speed)
    associate (f => equations%freedoms)
      y(:, :f) = matmul(values, orbit%rate * differentiated(series(:, :f)))
      y(:, f + 1:) = matmul(values, series)
      do c = 1, f
        y(:, c) = y(:, c) + steady(c)
        y(:, f + c) = y(:, f + c) + steady(c) * t
      end do
    end associate
  end subroutine states_at

  !> The rates of variations of the state, the columns of a matrix.
  pure subroutine vary(equations, slopes, y, rates)
    type(orbit_equations_t), intent(in) :: equations
    real(wp), intent(in) :: slopes(:)    !! [positions]
    real(wp), intent(in) :: y(:, :)
    real(wp), intent(out) :: rates(:, :)
    integer :: j, k

    associate (f => equations%freedoms, row => equations%machine%pattern%row, column => equations%machine%pattern%column)
      do j = 1, size(y, 2)
        rates(:, j) = 0.0_wp
        do k = 1, size(row)
          rates(row(k), j) = rates(row(k), j) + slopes(k) * y(column(k), j)
        end do
        rates(f + 1:2 * f, j) = y(:f, j)
      end do
    end associate
  end subroutine vary

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
