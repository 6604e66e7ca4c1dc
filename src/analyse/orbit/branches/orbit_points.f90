!> Points of a branch of periodic motions, and the steps from one to the next.
module nocdyn_orbit_points
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_harmonic_basis, only: padded_series
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_problem, only: measured, orbit_point_t, orbit_problem_t
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_periodic_machine, only: orbit_t
  use nocdyn_text, only: rounded_text
  implicit none (type, external)
  private

  public :: adapt_resolution, add_multipliers, complete_point, distance_between, interpolated, settle_at, span, take_step

  type, public :: branch_t
    type(orbit_point_t), allocatable :: points(:)  !! along the branch
    integer :: count = 0
    logical :: is_closed = .false.                 !! whether it comes back to its first point
    logical :: has_begun = .false.                 !! whether Newton's method has found the first point
    logical :: is_back = .false.                   !! whether it ends where it meets the branch that it has left
    character(len=:), allocatable :: ending        !! why it ends where it does not leave the range, else ''
  contains
    procedure :: add, add_branch, add_reversed, next_number
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

  real(wp), parameter :: straight = 0.97_wp      ! cosine between the tangents at both ends of a step

contains

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

  !> Adds the points of another branch.
  subroutine add_branch(self, other, number)
    class(branch_t), intent(inout) :: self
    type(branch_t), intent(in) :: other
    integer, intent(in) :: number   !! which they get
    integer :: i

    do i = 1, other%count
      call self%add(other%points(i))
      self%points(self%count)%branch = number
    end do
  end subroutine add_branch

  !> Adds the points of another branch from its last one back, with the direction in which they are passed then.
  subroutine add_reversed(self, other, last, number)
    class(branch_t), intent(inout) :: self
    type(branch_t), intent(in) :: other
    integer, intent(in) :: last     !! point of the other branch that is added last
    integer, intent(in) :: number   !! which they get
    integer :: i

    do i = other%count, last, -1
      call self%add(other%points(i))
      associate (added => self%points(self%count))
        added%branch = number
        added%direction = -added%direction
      end associate
    end do
  end subroutine add_reversed

  !> The number of a branch that is not among the points.
  pure integer function next_number(self)
    class(branch_t), intent(in) :: self

    next_number = maxval(self%points(:self%count)%branch) + 1
  end function next_number

  !> Tangent, weights, orbit and error of a point that has just been corrected.
  subroutine complete_point(problem, walk, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(inout) :: walk
    type(error_t), allocatable, intent(out) :: error

    walk%weights = problem%weights_of(walk%x)
    if (allocated(walk%tangent)) deallocate (walk%tangent)
    allocate (walk%tangent(size(walk%x)))
    call problem%find_tangent(walk%weights, walk%tangent)
    call problem%complete(walk%x, walk%point, error)
    walk%point%direction = walk%tangent(size(walk%x)) / walk%range
    walk%point%kind = ''
  end subroutine complete_point

  !> The multipliers of a point, none without stability.
  subroutine add_multipliers(problem, settings, point, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error

    if (settings%has_stability) then
      call problem%find_multipliers(point%orbit, point%multipliers, error)
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
  subroutine take_step(problem, walk, step, next, iterations, is_good, error)
    class(orbit_problem_t), intent(inout) :: problem
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
    associate (last => size(row), bounds => problem%periodic%bounds)
      value = min(max(next%x(last), bounds(1)), bounds(2))
      if (abs(value - next%x(last)) > 0) then
        next%x = walk%x + (value - walk%x(last)) / walk%tangent(last) * walk%tangent
        next%x(last) = value
        row = 0.0_wp
        row(last) = 1.0_wp
      end if
    end associate
    call problem%correct(row, dot_product(row, next%x), next%x, iterations, is_good, error)
    if (allocated(error) .or. .not. is_good) return
    call problem%find_tangent(walk%weights, tangent)
    is_good = abs(dot_product(along, tangent)) >= straight .and. measured(next%x - walk%x, walk%weights) < 2 * step
  end subroutine take_step

  !> A point between two others at a value of the parameter.
  subroutine settle_at(problem, walk, next, value, middle, error)
    class(orbit_problem_t), intent(inout) :: problem
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
      call problem%correct(row, value, middle%x, iterations, has_converged, error)
      if (allocated(error)) return
      if (.not. has_converged) then
        call raise(error, exit_failed, 'no convergence at ' // rounded_text(value, 8) // ' between two points of the branch')
        return
      end if
      call complete_point(problem, middle, error)
      if (ahead * middle%tangent(last) < 0) call middle%turn()
    end associate
  end subroutine settle_at

  !> The distance of a point along the tangent of another.
  pure real(wp) function span(walk, next)
    type(walk_t), intent(in) :: walk, next

    span = dot_product(walk%weights**2 * walk%tangent, next%x - walk%x)
  end function span

  !> Gives a point the resolution that its error asks for; the point before keeps step.
  subroutine adapt_resolution(problem, walk, next, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(inout) :: walk, next
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: former, latter
    logical :: has_changed

    do
      call problem%adapt(next%point, has_changed, error)
      if (allocated(error) .or. .not. has_changed) return
      former = walk
      latter = next
      call resettle(problem, former, walk, error)
      if (allocated(error)) return
      walk%point%multipliers = former%point%multipliers
      call resettle(problem, latter, next, error)
      if (allocated(error)) return
      if (next%point%error <= problem%tolerance) return
    end do
  end subroutine adapt_resolution

  !> Corrects a point in the present resolution across its former tangent, which keeps its direction.
  subroutine resettle(problem, former, walk, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(in) :: former
    type(walk_t), intent(inout) :: walk
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: row(:)
    integer :: iterations
    logical :: has_converged

    walk%x = problem%put_together(former%point%orbit)
    row = problem%weights_of(walk%x)**2 * problem%recast(former%point, former%tangent)
    call problem%correct(row, dot_product(row, walk%x), walk%x, iterations, has_converged, error)
    if (allocated(error)) return
    if (.not. has_converged) then
      call raise(error, exit_failed, 'no convergence at ' // rounded_text(former%x(size(former%x)), 8) // ' with ' // &
                 problem%resolution() // '; what helps: a larger tolerance, or a number of harmonics')
      return
    end if
    call complete_point(problem, walk, error)
  end subroutine resettle

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
