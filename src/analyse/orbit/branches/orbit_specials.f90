!> What lies between two points of a branch: special points, and points at even distances of the parameter.
!>
!> Special points are where a function changes its sign from one point to the other; they are found in planes across the tangent
!> of the first one.
module nocdyn_orbit_specials
  use nocdyn_brackets, only: bracket_t, new_bracket
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_points, only: add_multipliers, branch_t, complete_point, settle_at, span, walk_t
  use nocdyn_orbit_problem, only: branch_point, fold, hopf, neimark_sacker, orbit_problem_t
  use nocdyn_text, only: rounded_text
  implicit none (type, external)
  private

  public :: add_between

contains

  !> Special points and points at even distances between two points.
  subroutine add_between(problem, walk, next, branch, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(in) :: walk, next
    type(branch_t), intent(inout) :: branch
    type(error_t), allocatable, intent(out) :: error
    type(branch_t) :: found
    type(walk_t) :: at
    real(wp), allocatable :: places(:)
    character(len=:), allocatable :: crossing
    integer :: k, least, most
    logical :: has_fold

    allocate (found%points(0), places(0))
    associate (last => size(walk%x), length => span(walk, next))
      has_fold = walk%tangent(last) * next%tangent(last) < 0
      if (has_fold) then
        call locate(problem, walk, next, length, 0, at, error)
        if (allocated(error)) return
        call note(fold)
      end if
      least = min(walk%point%unstable(), next%point%unstable())
      most = max(walk%point%unstable(), next%point%unstable())
      k = least + 1
      do while (k <= most)
        call locate(problem, walk, next, length, k, at, error)
        if (allocated(error)) return
        crossing = problem%kind_of(at%point, k)
        if (crossing /= branch_point .or. .not. has_fold) call note(crossing)
        k = k + merge(2, 1, crossing == neimark_sacker .or. crossing == hopf)
      end do
    end associate
    call add_even(problem, walk, next, found, places, branch, error)

  contains

    subroutine note(kind)
      character(len=*), intent(in) :: kind

      at%point%kind = kind
      call found%add(at%point)
      places = [places, span(walk, at)]
    end subroutine note

  end subroutine add_between

  !> Adds points found between two others in their order along the branch, and points at even distances between all of these.
  subroutine add_even(problem, walk, next, found, places, branch, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(in) :: walk, next
    type(branch_t), intent(in) :: found
    real(wp), intent(in) :: places(:)   !! of these along the tangent
    type(branch_t), intent(inout) :: branch
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: begin, end
    integer :: i, k
    logical :: is_left(size(places))

    is_left = .true.
    begin = walk
    do i = 1, size(places) + 1
      end = next
      if (i <= size(places)) then
        k = minloc(places, dim=1, mask=is_left)
        is_left(k) = .false.
        end%point = found%points(k)
        end%x = problem%put_together(end%point%orbit)
      end if
      if (walk%settings%count > 0) call add_grid(problem, begin, end, branch, error)
      if (allocated(error)) return
      if (i <= size(places)) call branch%add(end%point)
      begin = end
    end do
  end subroutine add_even

  !> Points at even distances between two points.
  subroutine add_grid(problem, begin, end, branch, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(in) :: begin, end
    type(branch_t), intent(inout) :: branch
    type(error_t), allocatable, intent(out) :: error
    type(walk_t) :: middle
    real(wp) :: value
    integer :: i, k

    associate (settings => begin%settings, first => begin%x(size(begin%x)), second => end%x(size(end%x)))
      do i = 2, settings%count - 1
        k = i
        if ((second - first) * (settings%to - settings%from) < 0) k = settings%count + 1 - i
        value = settings%from + (settings%to - settings%from) * (k - 1) / (settings%count - 1)
        if ((value - first) * (value - second) >= 0) cycle
        call settle_at(problem, begin, end, value, middle, error)
        if (allocated(error)) return
        call add_multipliers(problem, middle%settings, middle%point, error)
        if (allocated(error)) return
        call branch%add(middle%point)
      end do
    end associate
  end subroutine add_grid

  !> Finds where the parameter turns back (`number` 0), or where the multiplier of a number has the modulus 1, between two points.
  subroutine locate(problem, walk, next, length, number, at, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(walk_t), intent(in) :: walk, next
    real(wp), intent(in) :: length         !! distance of the points along the tangent
    integer, intent(in) :: number
    type(walk_t), intent(inout) :: at
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most = 60            ! evaluations
    real(wp), parameter :: exact = 1.0e-11_wp, near = 1.0e-5_wp
    type(walk_t) :: nearest
    type(bracket_t) :: bracket
    real(wp) :: place, row(size(walk%x))
    integer :: i, iterations
    logical :: has_converged

    bracket = new_bracket([0.0_wp, length], [test_value(walk), test_value(next)])
    row = walk%weights**2 * walk%tangent
    at%settings = walk%settings
    at%range = walk%range
    nearest = walk
    do i = 1, most
      place = bracket%next()
      at%x = walk%x + (place / length) * (next%x - walk%x)
      call problem%correct(row, dot_product(row, walk%x) + place, at%x, iterations, has_converged, error)
      if (allocated(error)) return
      if (.not. has_converged) then
        at = nearest   ! the equations are singular where other branches of the same period begin
        if (abs(test_value(nearest)) > near) call raise(error, exit_failed, 'no convergence at a special point of the ' // &
                                                        'branch near ' // rounded_text(walk%x(size(walk%x)), 8))
        return
      end if
      call complete_point(problem, at, error)
      if (.not. allocated(error)) call add_multipliers(problem, at%settings, at%point, error)
      if (allocated(error)) return
      call bracket%narrow(place, test_value(at))
      if (abs(test_value(at)) < abs(test_value(nearest))) nearest = at
      if (abs(test_value(at)) <= exact .or. abs(bracket%x(2) - bracket%x(1)) <= exact * length) return
    end do

  contains

    pure real(wp) function test_value(there)
      type(walk_t), intent(in) :: there

      if (number == 0) then
        test_value = there%tangent(size(there%tangent)) / there%range
      else
        test_value = log(max(abs(there%point%multipliers(number)), tiny(1.0_wp)))
      end if
    end function test_value

  end subroutine locate

end module nocdyn_orbit_specials
