!> Points of a branch of periodic motions, and the steps from one to the next.
module nocdyn_orbit_points
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_harmonic_basis, only: padded_series
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_corrector, only: correct, estimate_error, find_tangent, measured, weights_of
  use nocdyn_orbit_equations, only: orbit_equations_t, orbit_t
  use nocdyn_orbit_multipliers, only: find_multipliers
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: adapt_harmonics, add_multipliers, complete_point, distance_between, find_fault, interpolated, least_harmonics, &
    more_harmonics, settle_at, span, take_step

  character(len=*), parameter, public :: fold = 'fold', doubling = 'period_doubling', neimark_sacker = 'neimark_sacker', &
    branch_point = 'branch_point', torque_fold = 'torque_fold'

  type, public :: orbit_point_t
    type(orbit_t) :: orbit
    real(wp) :: direction = 0.0_wp                 !! change of the parameter along the branch, as a share of its range
    real(wp) :: error = 0.0_wp                     !! estimated, as a share of the motion
    integer :: harmonics = 0
    integer :: branch = 1
    integer :: crossed = 0                         !! a switch whose branches the motion changes, 0: none
    complex(wp), allocatable :: multipliers(:)     !! by descending modulus
    character(len=:), allocatable :: kind          !! of a special point, else ''
  contains
    procedure :: is_stable, unstable
  end type orbit_point_t

  type, public :: branch_t
    type(orbit_point_t), allocatable :: points(:)  !! along the branch
    integer :: count = 0
    logical :: is_closed = .false.                 !! whether it comes back to its first point
    logical :: has_begun = .false.                 !! whether Newton's method has found the first point
    character(len=:), allocatable :: ending        !! why it ends where it does not leave the range, else ''
  contains
    procedure :: add
  end type branch_t

  !> Where the continuation stands.
  type, public :: walk_t
    type(orbit_settings_t) :: settings
    real(wp) :: range = 1.0_wp                     !! of the parameter
    real(wp), allocatable :: x(:), tangent(:), weights(:)
    type(orbit_point_t) :: point
  contains
    procedure :: turn
  end type walk_t

  integer, parameter :: first_harmonics = 5
  integer, parameter :: most_harmonics = 200
  integer, parameter :: most_of_kinks = 60       ! where laws have kinks, more are of little use
  real(wp), parameter :: kinked = 1.0e-6_wp      ! error above which a motion across kinks is none
  real(wp), parameter :: unresolved = 1.0e-3_wp  ! error above which any motion is none
  real(wp), parameter :: straight = 0.97_wp      ! cosine between the tangents at both ends of a step
  real(wp), parameter :: neutral = 1.0e-8_wp     ! of a modulus above 1 by rounding

contains

  !> The number of multipliers outside the unit circle.
  pure integer function unstable(self)
    class(orbit_point_t), intent(in) :: self

    unstable = count(abs(self%multipliers) > 1.0_wp + neutral)
  end function unstable

  !> Whether disturbances decay.
  pure logical function is_stable(self)
    class(orbit_point_t), intent(in) :: self

    is_stable = self%unstable() == 0
  end function is_stable

  !> Adds a point at the end.
  subroutine add(self, point)
    class(branch_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    type(orbit_point_t), allocatable :: longer(:)
    integer :: i

    if (self%count == size(self%points)) then
      allocate (longer(2 * self%count + 8))
      do i = 1, self%count
        longer(i) = self%points(i)
      end do
      call move_alloc(longer, self%points)
    end if
    self%count = self%count + 1
    self%points(self%count) = point
  end subroutine add

  !> The harmonics with which a branch begins: those of the excitation and one more.
  pure integer function least_harmonics(equations)
    type(orbit_equations_t), intent(in) :: equations

    least_harmonics = max(first_harmonics, (maxval([0, equations%period%multiples]) + 1) * equations%subharmonic)
  end function least_harmonics

  !> A larger number of harmonics, unless it is the largest already.
  pure integer function more_harmonics(harmonics, crossed)
    integer, intent(in) :: harmonics
    integer, intent(in) :: crossed   !! as of a point

    more_harmonics = max(harmonics, min(merge(most_of_kinks, most_harmonics, crossed > 0), harmonics + max(2, harmonics / 3)))
  end function more_harmonics

  !> Why a point is not good enough, '' if it is.
  subroutine find_fault(equations, point, fault)
    type(orbit_equations_t), intent(in) :: equations
    type(orbit_point_t), intent(in) :: point
    character(len=:), allocatable, intent(out) :: fault

    fault = ''
    if (point%crossed > 0 .and. point%error > kinked) then
      fault = 'the motion crosses the ' // equations%machine%formulation%switch_name(point%crossed) // ', a kink or jump of ' // &
              'its law that ' // to_text(point%harmonics) // ' harmonics do not describe (error ' // &
              rounded_text(point%error, 2) // ' of the motion)'
    else if (point%error > unresolved) then
      fault = to_text(point%harmonics) // ' harmonics do not describe the motion (error ' // rounded_text(point%error, 2) // &
              ' of it)'
    end if
  end subroutine find_fault

  !> Tangent, weights, orbit and error of a point that has just been corrected.
  subroutine complete_point(equations, finer, walk, error)
    type(orbit_equations_t), intent(inout) :: equations, finer
    type(walk_t), intent(inout) :: walk
    type(error_t), allocatable, intent(out) :: error

    walk%weights = weights_of(equations, walk%x, walk%range)
    if (allocated(walk%tangent)) deallocate (walk%tangent)
    allocate (walk%tangent(size(walk%x)))
    call find_tangent(equations, walk%weights, walk%tangent)
    walk%point%orbit%speed = equations%floating_speed
    call equations%take_apart(walk%x, walk%point%orbit)
    call equations%set_value(walk%point%orbit, error)
    if (allocated(error)) return
    walk%point%direction = walk%tangent(size(walk%x)) / walk%range
    walk%point%harmonics = equations%basis%harmonics
    walk%point%kind = ''
    call estimate_error(equations, finer, walk%x, walk%point%orbit, walk%point%error, error)
    walk%point%crossed = finer%machine%crossed_switch()
  end subroutine complete_point

  !> The multipliers of a point, none without stability.
  subroutine add_multipliers(equations, settings, point, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error

    if (settings%has_stability) then
      call find_multipliers(equations, point%orbit, point%multipliers, error)
    else
      point%multipliers = [complex(wp) ::]
    end if
  end subroutine add_multipliers

  !> Turns the direction round.
  subroutine turn(self)
    class(walk_t), intent(inout) :: self

    self%tangent = -self%tangent
    self%point%direction = -self%point%direction
  end subroutine turn

  !> A point at a distance along the tangent, or at the end of the range if this is nearer.
  subroutine take_step(equations, walk, step, next, iterations, is_good, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(walk_t), intent(in) :: walk
    real(wp), intent(in) :: step
    type(walk_t), intent(inout) :: next
    integer, intent(out) :: iterations
    logical, intent(out) :: is_good
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: along(size(walk%x)), row(size(walk%x)), tangent(size(walk%x)), value

    next%settings = walk%settings
    next%range = walk%range
    along = walk%weights**2 * walk%tangent
    next%x = walk%x + step * walk%tangent
    row = along
    associate (last => size(row), bounds => equations%bounds)
      value = min(max(next%x(last), bounds(1)), bounds(2))
      if (abs(value - next%x(last)) > 0) then
        next%x = walk%x + (value - walk%x(last)) / walk%tangent(last) * walk%tangent
        next%x(last) = value
        row = 0.0_wp
        row(last) = 1.0_wp
      end if
    end associate
    call correct(equations, walk%range, row, dot_product(row, next%x), next%x, iterations, is_good, error)
    if (allocated(error) .or. .not. is_good) return
    call find_tangent(equations, walk%weights, tangent)
    is_good = abs(dot_product(along, tangent)) >= straight .and. measured(next%x - walk%x, walk%weights) < 2 * step
  end subroutine take_step

  !> A point between two others at a value of the parameter.
  subroutine settle_at(equations, finer, walk, next, value, middle, error)
    type(orbit_equations_t), intent(inout) :: equations, finer
    type(walk_t), intent(in) :: walk, next
    real(wp), intent(in) :: value
    type(walk_t), intent(inout) :: middle
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: ahead, row(size(walk%x)), share
    integer :: iterations
    logical :: has_converged

    associate (last => size(walk%x))
      ahead = next%x(last) - walk%x(last)
      share = (value - walk%x(last)) / ahead
      row = 0.0_wp
      row(last) = 1.0_wp
      middle%settings = walk%settings
      middle%range = walk%range
      middle%x = walk%x + share * (next%x - walk%x)
      call correct(equations, walk%range, row, value, middle%x, iterations, has_converged, error)
      if (allocated(error)) return
      if (.not. has_converged) then
        call raise(error, exit_failed, 'no convergence at ' // rounded_text(value, 8) // ' between two points of the branch')
        return
      end if
      call complete_point(equations, finer, middle, error)
      if (ahead * middle%tangent(last) < 0) call middle%turn()
    end associate
  end subroutine settle_at

  !> The distance of a point along the tangent of another.
  pure real(wp) function span(walk, next)
    type(walk_t), intent(in) :: walk, next

    span = dot_product(walk%weights**2 * walk%tangent, next%x - walk%x)
  end function span

  !> Gives a point more harmonics if its error is too large, and fewer if it is very small; the point before keeps step.
  subroutine adapt_harmonics(equations, finer, walk, next, error)
    type(orbit_equations_t), intent(inout) :: equations, finer
    type(walk_t), intent(inout) :: walk, next
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: spare = 1.0e-4_wp   ! of the tolerance
    integer :: harmonics, least

    least = least_harmonics(equations)
    do
      harmonics = equations%basis%harmonics
      if (next%point%error > walk%settings%tolerance) then
        harmonics = more_harmonics(harmonics, next%point%crossed)
      else if (next%point%error < spare * walk%settings%tolerance) then
        harmonics = max(least, harmonics - max(1, harmonics / 6))
      end if
      if (harmonics == equations%basis%harmonics) return
      call change_harmonics(equations, finer, harmonics, walk, next, error)
      if (allocated(error)) return
      if (next%point%error <= walk%settings%tolerance) return
    end do
  end subroutine adapt_harmonics

  !> Corrects a point, and the one before, with other harmonics, each at its place of the branch.
  subroutine change_harmonics(equations, finer, harmonics, walk, next, error)
    type(orbit_equations_t), intent(inout) :: equations, finer
    integer, intent(in) :: harmonics
    type(walk_t), intent(inout) :: walk, next
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: former, latter

    former = walk
    latter = next
    call equations%set_harmonics(harmonics, error)
    if (allocated(error)) return
    call resettle(equations, finer, former, walk, error)
    if (allocated(error)) return
    walk%point%multipliers = former%point%multipliers
    call resettle(equations, finer, latter, next, error)
  end subroutine change_harmonics

  !> Corrects a point with the present harmonics across its former tangent, which keeps its direction.
  subroutine resettle(equations, finer, former, walk, error)
    type(orbit_equations_t), intent(inout) :: equations, finer
    type(walk_t), intent(in) :: former
    type(walk_t), intent(inout) :: walk
    type(error_t), allocatable, intent(out) :: error
    type(orbit_t) :: along, orbit
    real(wp), allocatable :: row(:)
    integer :: iterations
    logical :: has_converged

    orbit = former%point%orbit
    orbit%series = padded_series(orbit%series, equations%basis%length)
    walk%x = equations%put_together(orbit)
    call spread_tangent(equations, former, along)
    row = equations%put_together(along)
    associate (scalars => equations%scalars())
      row(size(row) - scalars:) = former%tangent(size(former%tangent) - scalars:)
    end associate
    row = weights_of(equations, walk%x, walk%range)**2 * row
    call correct(equations, walk%range, row, dot_product(row, walk%x), walk%x, iterations, has_converged, error)
    if (allocated(error)) return
    if (.not. has_converged) then
      call raise(error, exit_failed, 'no convergence at ' // rounded_text(former%x(size(former%x)), 8) // ' with ' // &
                 to_text(equations%basis%harmonics) // ' harmonics in place of ' // to_text(former%point%harmonics) // &
                 '; what helps: a larger tolerance, or a number of harmonics')
      return
    end if
    call complete_point(equations, finer, walk, error)
  end subroutine resettle

  !> The tangent of a point of other harmonics as series.
  subroutine spread_tangent(equations, former, along)
    type(orbit_equations_t), intent(in) :: equations
    type(walk_t), intent(in) :: former
    type(orbit_t), intent(inout) :: along
    real(wp) :: series(2 * former%point%harmonics + 1, equations%nodes)
    integer :: i, n

    do n = 1, equations%nodes
      i = (equations%place(n) - 1) * size(series, 1)
      series(:, n) = former%tangent(i + 1:i + size(series, 1))
    end do
    along%speed = equations%floating_speed
    along%series = padded_series(series, equations%basis%length)
  end subroutine spread_tangent

  !> The series between two motions at the value of another one, with as many harmonics as this.
  pure function interpolated(orbit, before, after) result(series)
    type(orbit_t), intent(in) :: orbit, before, after
    real(wp) :: series(size(orbit%series, 1), size(orbit%series, 2))
    real(wp) :: share

    share = (orbit%value - before%value) / (after%value - before%value)
    series = (1.0_wp - share) * padded_series(before%series, size(series, 1)) + &
             share * padded_series(after%series, size(series, 1))
  end function interpolated

  !> The distance of the oscillation of a motion from those between two others at its value, as a share of it.
  pure real(wp) function distance_between(orbit, before, after) result(distance)
    type(orbit_t), intent(in) :: orbit, before, after
    real(wp) :: series(size(orbit%series, 1), size(orbit%series, 2))

    series = interpolated(orbit, before, after)
    distance = norm2(series(2:, :) - orbit%series(2:, :)) / max(norm2(orbit%series(2:, :)), tiny(distance))
  end function distance_between

end module nocdyn_orbit_points
