!> Where a nonlinear normal mode begins: a linear mode of the conservative machine about its steady state.
!>
!> Nonlinear normal modes are families of periodic motions of the conservative machine (G. Kerschen, M. Peeters, J. C. Golinval,
!> A. F. Vakakis, Nonlinear normal modes, part I, Mechanical Systems and Signal Processing 23 (2009) 170-194).
module nocdyn_backbone_start
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvectors
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_text, only: counted, to_text
  implicit none (type, external)
  private

  public :: start_backbone

contains

  !> Prepares a machine for the motions of a mode, and guesses the first one.
  subroutine start_backbone(mode, periodic, guess, body, linear_rate, error)
    integer, intent(in) :: mode                     !! 1 is the lowest one that oscillates
    type(periodic_machine_t), intent(inout) :: periodic   !! conservative, with its rigid motions
    type(orbit_t), intent(inout) :: guess           !! the steady state and the first amplitude [rad] or energy [J]; then the
                                                    !! linear motion
    integer, intent(out) :: body                    !! that moves most in the mode, whose amplitude is meant
    real(wp), intent(out) :: linear_rate            !! frequency of the mode [rad/s]
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: shape(:)
    real(wp) :: amplitude, angle, largest
    integer :: b, k

    if (periodic%machine%states > 2 * periodic%machine%freedoms) then
      call raise(error, exit_failed, 'a machine with internal states has no nonlinear normal modes: ' // &
                 periodic%machine%formulation%machine%internal_name(1))
      return
    end if
    periodic%rate_is_unknown = .true.
    allocate (periodic%period%multiples(0), periodic%border(0))
    allocate (periodic%floating_speed(size(periodic%free)), source=0.0_wp)
    guess%speed = periodic%floating_speed
    periodic%origin = guess%series(1, :)
    call periodic%machine%balance_at(guess%series(1, :), error)
    if (.not. allocated(error)) call find_mode(periodic, guess%series(1, :), mode, shape, linear_rate, error)
    if (allocated(error)) return
    largest = 0.0_wp
    associate (coordinates => periodic%machine%formulation%machine%coordinates)
      do b = 1, periodic%machine%formulation%machine%bodies
        angle = body_angle(periodic, b, shape)
        if (abs(angle) <= (1.0_wp + 1.0e-9_wp) * abs(largest)) cycle
        largest = angle
        body = b
      end do
      allocate (periodic%travel(periodic%machine%freedoms), source=0.0_wp)
      do k = coordinates%first(body), coordinates%first(body + 1) - 1
        periodic%travel(coordinates%coordinate(k)) = coordinates%ratio(1, k)
      end do
    end associate
    guess%rate = linear_rate
    shape = shape / largest
    amplitude = guess%value
    if (periodic%is_over_energy) then
      associate (slopes => -periodic%energy_slopes(shape))   ! inertias times the shape
        amplitude = sqrt(2.0_wp * guess%value / (linear_rate**2 * dot_product(shape, slopes)))
      end associate
    end if
    guess%series = reshape([guess%series(1, :), amplitude * shape, 0.0_wp * shape], [3, size(shape)], order=[2, 1])
  end subroutine start_backbone

  !> The angle of a body by the ones of the coordinates [rad].
  pure real(wp) function body_angle(periodic, body, angles) result(angle)
    type(periodic_machine_t), intent(in) :: periodic
    integer, intent(in) :: body
    real(wp), intent(in) :: angles(:)   !! [rad]
    integer :: k

    angle = 0.0_wp
    associate (coordinates => periodic%machine%formulation%machine%coordinates)
      do k = coordinates%first(body), coordinates%first(body + 1) - 1
        angle = angle + coordinates%ratio(1, k) * angles(coordinates%coordinate(k))
      end do
    end associate
  end function body_angle

  !> A linear mode about some angles: shape and frequency.
  subroutine find_mode(periodic, angles, mode, shape, rate, error)
    type(periodic_machine_t), intent(inout) :: periodic
    real(wp), intent(in) :: angles(:)          !! of the coordinates [rad]
    integer, intent(in) :: mode
    real(wp), allocatable, intent(out) :: shape(:)
    real(wp), intent(out) :: rate              !! [rad/s]
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: rigid = 1.0e-9_wp   ! square of a frequency, as a share of the largest one
    real(wp) :: slopes(periodic%machine%samples, size(periodic%machine%pattern%row))
    real(wp) :: t(periodic%machine%samples), y(periodic%machine%samples, periodic%machine%states)
    real(wp) :: matrix(size(angles), size(angles))
    complex(wp) :: values(size(angles)), vectors(size(angles), size(angles))
    integer :: i, k
    logical :: has_failed, is_left(size(angles))

    t = 0.0_wp
    y = 0.0_wp
    matrix = 0.0_wp
    associate (f => size(angles), pattern => periodic%machine%pattern)
      y(:, f + 1:) = spread(angles, 1, size(t))
      call periodic%machine%slopes(t, y, slopes)
      do k = 1, size(pattern%row)
        if (pattern%row(k) > f .or. pattern%column(k) <= f) cycle
        associate (element => matrix(pattern%row(k), pattern%column(k) - f))
          element = element + slopes(1, k)
        end associate
      end do
    end associate
    call eigenvectors(-matrix, values, vectors, has_failed)
    is_left = real(values, wp) > rigid * maxval(abs(values))
    if (has_failed .or. count(is_left) < mode) then
      call raise(error, exit_failed, 'mode = ' // to_text(mode) // ' in &orbit: the conservative machine has ' // &
                 counted(count(is_left), 'mode that oscillates', 'modes that oscillate'))
      return
    end if
    do i = 1, mode
      k = minloc(real(values, wp), dim=1, mask=is_left)
      is_left(k) = .false.
    end do
    rate = sqrt(real(values(k), wp))
    shape = real(vectors(:, k), wp)
  end subroutine find_mode

end module nocdyn_backbone_start
