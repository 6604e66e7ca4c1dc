!> Eigenvalues of a machine about a steady state that has been found as a motion without harmonics.
!>
!> The ones that are 0 whatever the machine does are taken out: the angles of its free rotations, and speeds that nothing brakes.
module nocdyn_orbit_eigenvalues
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvectors
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_orbit_multipliers, only: deflate, scale_speeds
  use nocdyn_periodic_machine, only: orbit_t
  implicit none (type, external)
  private

  public :: find_eigenvalues, find_oscillation

contains

  !> The eigenvalues by descending real part.
  subroutine find_eigenvalues(equations, orbit, values, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: orbit                !! steady
    complex(wp), allocatable, intent(out) :: values(:)   !! [1/s]
    type(error_t), allocatable, intent(out) :: error
    complex(wp), allocatable :: found(:), vectors(:, :)
    real(wp), allocatable :: known(:, :), matrix(:, :)
    logical, allocatable :: is_left(:)
    integer :: k, largest, m, n

    call differentiate(equations, orbit, matrix, error)
    if (allocated(error)) return
    associate (f => equations%freedoms, motions => size(equations%free))
      allocate (known(size(matrix, 1), 2 * motions - size(equations%border)), source=0.0_wp)
      n = motions
      do m = 1, motions
        known(f + 1:2 * f, m) = equations%rigid(:, m)
        if (any(equations%border == m)) cycle
        n = n + 1
        known(:f, n) = equations%rigid(:, m)
      end do
      call scale_speeds(f, matrix, known)
    end associate
    do k = 1, size(known, 2)
      call deflate(matrix, known)
    end do
    n = size(matrix, 1)
    allocate (found(n), vectors(n, n), values(n), is_left(n))
    call solve_eigenproblem(matrix, found, vectors, error)
    if (allocated(error)) return
    is_left = .true.
    do k = 1, n
      largest = maxloc(real(found, wp), dim=1, mask=is_left)
      is_left(largest) = .false.
      values(k) = found(largest)
    end do
  end subroutine find_eigenvalues

  !> The motion of an eigenvalue: cosine and sine of each node, [2, nodes]; the largest coordinate is a cosine of size 1.
  subroutine find_oscillation(equations, orbit, value, oscillation, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: orbit   !! steady
    complex(wp), intent(in) :: value        !! [1/s]
    real(wp), allocatable, intent(out) :: oscillation(:, :)
    type(error_t), allocatable, intent(out) :: error
    complex(wp), allocatable :: values(:), vectors(:, :)
    real(wp), allocatable :: matrix(:, :)
    integer :: n

    call differentiate(equations, orbit, matrix, error)
    if (allocated(error)) return
    n = size(matrix, 1)
    allocate (values(n), vectors(n, n))
    call solve_eigenproblem(matrix, values, vectors, error)
    if (allocated(error)) return
    associate (f => equations%freedoms, vector => vectors(:, minloc(abs(values - value), dim=1)))
      vector = vector / vector(f + maxloc(abs(vector(f + 1:2 * f)), dim=1))
      allocate (oscillation(2, equations%nodes))
      oscillation(1, :) = real(vector(f + 1:), wp)
      oscillation(2, :) = -aimag(vector(f + 1:))
    end associate
  end subroutine find_oscillation

  subroutine solve_eigenproblem(matrix, values, vectors, error)
    real(wp), intent(in) :: matrix(:, :)
    complex(wp), intent(out) :: values(:), vectors(:, :)
    type(error_t), allocatable, intent(out) :: error
    logical :: has_failed

    call eigenvectors(matrix, values, vectors, has_failed)
    if (has_failed) call raise(error, exit_failed, 'the eigenvalues of the steady state were not found')
  end subroutine solve_eigenproblem

  !> The derivatives of the rates by the state.
  subroutine differentiate(equations, orbit, matrix, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: orbit
    real(wp), allocatable, intent(out) :: matrix(:, :)   !! [states, states]
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: t(equations%machine%samples), y(equations%machine%samples, equations%machine%states)
    real(wp), allocatable :: slopes(:, :)
    integer :: i, k

    call equations%set_value(orbit, error)
    if (allocated(error)) return
    call equations%sample(orbit, equations%basis, t, y)
    associate (pattern => equations%machine%pattern, f => equations%freedoms, states => equations%machine%states)
      allocate (slopes(size(t), size(pattern%row)), matrix(states, states))
      call equations%machine%slopes(t, y, slopes)
      matrix = 0.0_wp
      do k = 1, size(pattern%row)
        matrix(pattern%row(k), pattern%column(k)) = matrix(pattern%row(k), pattern%column(k)) + slopes(1, k)
      end do
      matrix(f + 1:2 * f, :) = 0.0_wp
      do i = 1, f
        matrix(f + i, i) = 1.0_wp
      end do
    end associate
  end subroutine differentiate

end module nocdyn_orbit_eigenvalues
