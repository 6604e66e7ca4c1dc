!> Newton's method on the equations of a periodic motion and one more row, which fixes the parameter or the place along a branch.
!> The matrix is factored where it begins, and again where changes by former factors do not become small fast enough.
!>
!> Sizes of changes are measured by weights: coordinates by the largest oscillation of all, internal states by their own, mean
!> speeds and an unknown rate by themselves, the parameter by its range.
module nocdyn_orbit_corrector
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_periodic_machine, only: orbit_t
  implicit none (type, external)
  private

  public :: correct, estimate_error, find_null_direction, find_tangent, measured, oscillation, set_least_oscillation, weights_of

  integer, parameter :: most_iterations = 14            ! with new factors
  integer, parameter :: most_changes = 60
  integer, parameter :: most_growths = 3
  real(wp), parameter :: converged_change = 1.0e-8_wp   ! the next change is about its square
  real(wp), parameter :: settled = 1.0e-13_wp           ! what is left of a change by former factors
  real(wp), parameter :: slow = 0.2_wp                  ! a change by former factors, as a share of the one before
  real(wp), parameter :: difference = 1.0e-6_wp         ! steps of the central differences, in weighted size
  real(wp), parameter :: silent = 1.0e-30_wp            ! a machine that does not oscillate yet

contains

  !> Solves the equations with row x = target for x, the unknowns and the parameter.
  subroutine correct(equations, range, row, target, x, iterations, has_converged, error)
    type(orbit_equations_t), intent(inout) :: equations
    real(wp), intent(in) :: range             !! width of the range of the parameter
    real(wp), intent(in) :: row(:)            !! [unknowns + 1]
    real(wp), intent(in) :: target
    real(wp), intent(inout) :: x(:)           !! [unknowns + 1], a guess, on return the solution
    integer, intent(out) :: iterations        !! with new factors, and one more
    logical, intent(out) :: has_converged
    type(error_t), allocatable, intent(out) :: error
    type(orbit_t) :: orbit
    real(wp), dimension(size(x)) :: change
    real(wp) :: former, length
    integer :: changes, growths
    logical :: has_factors, is_singular
    logical :: is_exact   ! whether the factors are those of the matrix about x

    has_converged = .false.
    has_factors = .false.
    former = 1.0_wp
    growths = 0
    iterations = 1
    allocate (orbit%speed, source=equations%floating_speed)
    do changes = 1, most_changes
      call equations%take_apart(x, orbit)
      call equations%residual(orbit, change(:size(x) - 1), error)
      if (allocated(error)) return
      change(size(x)) = target - dot_product(row, x)
      change(:size(x) - 1) = -change(:size(x) - 1)
      is_exact = .not. has_factors
      if (is_exact) then
        iterations = iterations + 1
        call fill_about(equations, range, row, x, orbit, error)
        if (allocated(error)) return
        call equations%system%factor(iterations == 2, is_singular)
        if (is_singular) return
        is_exact = equations%system%is_whole
        has_factors = .true.
      end if
      call equations%system%substitute(change)
      x = x + change
      length = measured(change, weights_of(equations, x, range))
      has_converged = length <= converged_change .and. (is_exact .or. length**2 <= settled * former)
      if (has_converged) exit
      if (changes > 1 .and. 0.5_wp * length > former) growths = growths + 1
      if (.not. length < huge(length) .or. growths > most_growths .or. iterations > most_iterations) return
      has_factors = length <= slow * former
      former = length
    end do
    if (.not. has_converged) return
    call equations%take_apart(x, orbit)
    call fill_about(equations, range, row, x, orbit, error)
  end subroutine correct

  !> Fills the matrix about an orbit.
  subroutine fill_about(equations, range, row, x, orbit, error)
    type(orbit_equations_t), intent(inout) :: equations
    real(wp), intent(in) :: range
    real(wp), intent(in) :: row(:), x(:)
    type(orbit_t), intent(in) :: orbit
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: steps(equations%scalars() + 1), weights(size(x))

    associate (inner => equations%system%inner, border => equations%system%border)
      weights = weights_of(equations, x, range)
      steps = difference / weights(inner + 1:)
      call equations%fill_system(orbit, steps, error)
      equations%system%below(border, :) = row(:inner)
      equations%system%right(inner + border, :) = row(inner + 1:)
    end associate
  end subroutine fill_about

  !> The tangent of the branch at a solution that `correct` has found, with row tangent > 0 and weighted length 1.
  subroutine find_tangent(equations, weights, tangent)
    type(orbit_equations_t), intent(inout) :: equations
    real(wp), intent(in) :: weights(:)
    real(wp), contiguous, intent(out) :: tangent(:)

    tangent = 0.0_wp
    tangent(size(tangent)) = 1.0_wp
    call equations%system%solve(tangent)
    tangent = tangent / measured(tangent, weights)
  end subroutine find_tangent

  !> The direction that the matrix about a singular solution takes to zero, by inverse iteration; it vanishes in the row.
  subroutine find_null_direction(equations, range, row, x, direction, error)
    type(orbit_equations_t), intent(inout) :: equations
    real(wp), intent(in) :: range           !! width of the range of the parameter
    real(wp), intent(in) :: row(:), x(:)    !! [unknowns + 1]
    real(wp), contiguous, intent(out) :: direction(:)   !! of weighted length 1
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: iterations = 3
    type(orbit_t) :: orbit
    real(wp) :: weights(size(x))
    integer :: i
    logical :: is_singular

    direction = 0.0_wp
    allocate (orbit%speed, source=equations%floating_speed)
    call equations%take_apart(x, orbit)
    call fill_about(equations, range, row, x, orbit, error)
    if (allocated(error)) return
    call equations%system%factor(.false., is_singular)
    if (is_singular) then
      call raise(error, exit_failed, 'the matrix of the equations is exactly singular')
      return
    end if
    weights = weights_of(equations, x, range)
    direction = [(sin(real(i, wp)), i=1, size(x))] / weights   ! any that has a share of all
    do i = 1, iterations
      direction(size(x)) = 0.0_wp
      call equations%system%solve(direction)
      direction = direction / measured(direction, weights)
    end do
  end subroutine find_null_direction

  !> The size of a change.
  pure real(wp) function measured(change, weights)
    real(wp), intent(in) :: change(:), weights(:)

    measured = norm2(weights * change)
  end function measured

  !> The largest harmonic of the coordinates, or what counts as the least [rad].
  pure real(wp) function oscillation(equations, x)
    type(orbit_equations_t), intent(in) :: equations
    real(wp), intent(in) :: x(:)
    integer :: i, n

    oscillation = max(silent, equations%least_oscillation)
    do n = 1, equations%freedoms
      i = equations%first_unknown(n)
      oscillation = max(oscillation, maxval(abs(x(i + 1:i + equations%basis%length - 1))))
    end do
  end function oscillation

  !> Where nothing oscillates at the first value, the least oscillation is a part of what would be at the last one if the machine
  !> were linear; 0 if nothing would.
  subroutine set_least_oscillation(equations, x, range)
    type(orbit_equations_t), intent(inout) :: equations   !! just corrected
    real(wp), intent(in) :: x(:)
    real(wp), intent(in) :: range
    real(wp), parameter :: part = 0.01_wp
    real(wp) :: tangent(size(x)), weights(size(x))

    equations%least_oscillation = 0.0_wp
    if (oscillation(equations, x) > silent) return
    weights = 0.0_wp
    weights(size(x)) = 1.0_wp / range
    call find_tangent(equations, weights, tangent)
    equations%least_oscillation = part * oscillation(equations, tangent)
    if (equations%least_oscillation <= part * silent) equations%least_oscillation = 0.0_wp
  end subroutine set_least_oscillation

  !> The weights of the unknowns and of the parameter.
  pure function weights_of(equations, x, range) result(weights)
    type(orbit_equations_t), intent(in) :: equations
    real(wp), intent(in) :: x(:)
    real(wp), intent(in) :: range
    real(wp) :: weights(size(x))
    real(wp) :: largest, response, scale
    integer :: i, k, n

    largest = oscillation(equations, x)
    associate (length => equations%basis%length, machine => equations%machine%formulation%machine, last => size(x))
      do n = 1, equations%nodes
        i = equations%first_unknown(n)
        scale = largest
        if (n > equations%freedoms) scale = max(maxval(abs(x(i:i + length - 1))), silent)
        weights(i:i + length - 1) = 1.0_wp / (scale * sqrt(real(equations%nodes, wp)))
      end do
      do k = 1, size(equations%border)
        i = equations%nodes * length + k
        scale = abs(x(i))
        if (equations%border(k) == equations%held_motion) then
          response = maxval(abs(machine%coordinates%response(1, machine%coordinates%first(equations%held): &
                                                             machine%coordinates%first(equations%held + 1) - 1)))
          scale = max(scale, largest * x(last)**2 / response)
        end if
        weights(i) = 1.0_wp / max(scale, sqrt(epsilon(scale)))
      end do
      if (allocated(equations%travel)) weights(last - 2) = 1.0_wp
      if (equations%rate_is_unknown) weights(last - 1) = 1.0_wp / abs(x(last - 1))
      weights(last) = 1.0_wp / range
    end associate
  end function weights_of

  !> The change of the motion, as a share of its largest harmonic, that harmonics up to twice as many ask for in equations with
  !> twice the samples. The harmonics left out are estimated by their accelerations, the others by the factors of the last
  !> correction.
  subroutine estimate_error(equations, finer, x, orbit, share, error)
    type(orbit_equations_t), intent(inout) :: equations   !! just corrected
    type(orbit_equations_t), intent(inout) :: finer       !! of twice the harmonics
    real(wp), intent(in) :: x(:)                          !! unknowns and the parameter
    type(orbit_t), intent(inout) :: orbit                 !! the motion of these
    real(wp), intent(out) :: share
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: r(:)
    real(wp) :: change(size(x)), largest
    integer :: first, h, i, n

    share = huge(share)
    if (finer%basis%harmonics /= 2 * equations%basis%harmonics) then
      call finer%set_harmonics(2 * equations%basis%harmonics, error)
      if (allocated(error)) return
    end if
    allocate (r(finer%unknowns()))
    call finer%residual(orbit, r, error)
    if (allocated(error)) return
    change = 0.0_wp
    share = 0.0_wp
    largest = oscillation(equations, x)
    associate (length => equations%basis%length, inner => equations%system%inner)
      do n = 1, equations%nodes
        i = equations%first_unknown(n)
        first = finer%first_unknown(n)
        change(i:i + length - 1) = -r(first:first + length - 1)
        do h = equations%basis%harmonics + 1, 2 * equations%basis%harmonics
          associate (rest => norm2(r(first + 2 * h - 1:first + 2 * h)))
            if (n <= equations%freedoms) then
              share = max(share, rest / h**2 / largest)
            else
              share = max(share, rest / h / max(maxval(abs(x(i:i + length - 1))), tiny(largest)))
            end if
          end associate
        end do
      end do
      change(inner + 1:size(x) - 1) = -r(finer%system%inner + 1:)
      call equations%system%substitute(change)
      do n = 1, equations%freedoms
        i = equations%first_unknown(n)
        share = max(share, maxval(abs(change(i + 1:i + length - 1))) / largest)
      end do
    end associate
  end subroutine estimate_error

end module nocdyn_orbit_corrector
