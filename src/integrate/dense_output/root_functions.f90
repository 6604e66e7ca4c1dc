!> Roots of functions g(t, y) on the dense output: the event functions of an observer, the indicator functions of a system.
!>
!> The functions are evaluated at the ends of a few equal parts of every step. A change of sign between two of them is a bracket,
!> in which the root is found to the last bits of the time.
module nocdyn_root_functions
  use, intrinsic :: iso_c_binding, only: c_int
  use nocdyn_dense_output, only: batch, dense_output_t, sample, sample_batch
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: observer_t
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: allocate_root_functions, start_root_functions, set_start, scan_step, parts_of, part_end, part_bracket, &
    find_root, find_grazing, sign_of

  integer, parameter, public :: most_halvings = 14   !! of a part of a wave
  integer, parameter :: least_parts = 4   !! of a step; more for dense output of higher degree, whose steps are longer
  integer, parameter, public :: max_grazing_steps = 10
  real(wp), parameter, public :: promising = 0.5_wp   !! of the least value: a parabola with a higher minimum predicts no root
  real(wp), parameter, public :: least_distance = 1.0e-8_wp   !! in theta, of points on a parabola: rounding spoils closer ones

  type, public :: root_functions_t
    logical :: of_system = .false.                      !! indicator functions of the system, else events of the observer
    integer :: parts = least_parts                      !! number of parts of the last step
    integer(c_int), allocatable :: side(:, :)           !! sign of the last value, 0 after a zero; [lanes, functions]
    real(wp), allocatable :: values(:, :)               !! at their ends; [functions, 0:most parts]
    real(wp), allocatable :: last(:, :)                 !! values at the end of the last step; [functions, lanes]
    real(wp), allocatable :: g(:)                       !! values at one theta
    integer, allocatable :: first_side(:)               !! `side` of a lane at the start of its step
    real(wp), allocatable :: halves(:, :, :)            !! values at the ends of two parts, after so many halvings;
                                                        !! [functions, 3, 0:most halvings]
    real(wp), allocatable :: y(:)                       !! state at which the functions are evaluated
  end type root_functions_t

  !> Two values of theta between which a function changes its sign.
  type, public :: sign_change_t
    integer :: function = 0
    real(wp) :: before = 0.0_wp, after = 0.0_wp
    real(wp) :: g_before = 0.0_wp, g_after = 0.0_wp     !! values of the function there
  end type sign_change_t

contains

  !> Allocates the data of the functions of an observer or a system.
  subroutine allocate_root_functions(roots, functions, of_system, degree, attempt)
    type(root_functions_t), intent(out) :: roots
    integer, intent(in) :: functions
    logical, intent(in) :: of_system
    integer, intent(in) :: degree   !! the largest of the dense output
    type(step_attempt_t), intent(in) :: attempt

    roots%of_system = of_system
    roots%parts = parts_of(degree)
    allocate (roots%side(attempt%lanes, functions), roots%first_side(functions), source=0)
    allocate (roots%halves(functions, 3, 0:most_halvings))
    allocate (roots%values(functions, 0:roots%parts), roots%last(functions, attempt%lanes), roots%g(functions), &
              roots%y(attempt%components), source=0.0_wp)
  end subroutine allocate_root_functions

  !> Evaluates the functions and their signs at the present state of a lane.
  subroutine start_root_functions(roots, system, observer, attempt, lane)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(step_attempt_t), intent(in) :: attempt
    integer, intent(in) :: lane

    roots%y(:) = attempt%y(lane, :attempt%components)
    call evaluate_at(roots%of_system, system, observer, lane, attempt%t(lane), roots%y, roots%last(:, lane))
    roots%side(lane, :) = sign_of(roots%last(:, lane))
  end subroutine start_root_functions

  !> Starts the functions of a lane from known values.
  pure subroutine set_start(roots, lane, g)
    type(root_functions_t), intent(inout) :: roots
    integer, intent(in) :: lane
    real(wp), intent(in) :: g(:)   !! [functions]

    roots%last(:, lane) = g
    roots%side(lane, :) = sign_of(g)
  end subroutine set_start

  !> Evaluates the functions at the ends of the parts of a lane's last step.
  subroutine scan_step(roots, system, observer, dense, theta_end)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp), intent(in) :: theta_end              !! end of the step: 1, or less where it has been cut
    integer :: i, part
    real(wp) :: theta(batch)

    roots%parts = parts_of(dense%degree)
    roots%values(:, 0) = roots%last(:, dense%lane)
    do part = 0, roots%parts - 1, batch
      theta(:) = [(part_end(roots, min(part + i, roots%parts), theta_end), i=1, batch)]
      call sample_batch(dense, theta)
      do i = 1, min(batch, roots%parts - part)
        call evaluate_at(roots%of_system, system, observer, dense%lane, dense%t + theta(i) * dense%h, &
                         dense%states(:size(roots%y), i), roots%values(:, part + i))
      end do
    end do
    roots%last(:, dense%lane) = roots%values(:, roots%parts)
  end subroutine scan_step

  !> The number of parts of a step.
  elemental integer function parts_of(degree)
    integer, intent(in) :: degree   !! of its dense output

    parts_of = max(least_parts, degree / 2)
  end function parts_of

  !> Theta at the end of a part of a step.
  pure real(wp) function part_end(roots, part, theta_end)
    type(root_functions_t), intent(in) :: roots
    integer, intent(in) :: part
    real(wp), intent(in) :: theta_end   !! end of the step

    part_end = theta_end * part / roots%parts
  end function part_end

  !> One part of a step as a bracket of one function.
  pure type(sign_change_t) function part_bracket(roots, function, part, theta_end)
    type(root_functions_t), intent(in) :: roots
    integer, intent(in) :: function, part
    real(wp), intent(in) :: theta_end   !! end of the step

    part_bracket%function = function
    part_bracket%before = part_end(roots, part - 1, theta_end)
    part_bracket%after = part_end(roots, part, theta_end)
    part_bracket%g_before = roots%values(function, part - 1)
    part_bracket%g_after = roots%values(function, part)
  end function part_bracket

  !> The sign of a value: -1, 0 or 1; 0 also for a value that is not finite.
  elemental integer function sign_of(g)
    real(wp), intent(in) :: g

    sign_of = 0
    if (is_finite(g)) sign_of = merge(1, 0, g > 0) - merge(1, 0, g < 0)
  end function sign_of

  !> Evaluates one function at theta: sets its element of `g`.
  subroutine evaluate(roots, system, observer, dense, function, theta)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    integer, intent(in) :: function
    real(wp), intent(in) :: theta

    call sample(dense, theta, roots%y)
    associate (t => dense%t + theta * dense%h)
      if (roots%of_system) then
        call system%set_indicator(function, dense%lane, t, roots%y, roots%g)
      else
        call observer%event_values(dense%lane, t, roots%y, roots%g)
      end if
    end associate
  end subroutine evaluate

  !> Evaluates the functions at a state.
  subroutine evaluate_at(of_system, system, observer, lane, t, y, g)
    logical, intent(in) :: of_system
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state there
    real(wp), contiguous, intent(inout) :: g(:)   !! [functions]

    if (of_system) then
      call system%indicator_values(lane, t, y, g)
    else
      call observer%event_values(lane, t, y, g)
    end if
  end subroutine evaluate_at

  !> The root of one function in a bracket, to the spacing of the times there: the theta where the function is zero, or the end
  !> of the last bracket, just beyond the change of sign. T. R. Chandrupatla, Adv. Eng. Software 28 (1997) 145-149.
  subroutine find_root(roots, system, observer, dense, bracket, root)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    type(sign_change_t), intent(in) :: bracket
    real(wp), intent(out) :: root   !! theta
    real(wp) :: a, b, c, ga, gb, gc   ! newest point, best point of the other sign, the point that they replaced
    real(wp) :: fraction, least, tolerance, x

    tolerance = max(spacing(abs(dense%t) + dense%h) / dense%h, epsilon(a))
    a = bracket%after
    b = bracket%before
    ga = bracket%g_after
    gb = bracket%g_before
    fraction = ga / (ga - gb)
    if (.not. is_finite(fraction)) fraction = 0.5_wp
    least = min(0.5_wp, tolerance / abs(b - a))
    fraction = min(1 - least, max(least, fraction))
    do while (abs(ga) > 0 .and. abs(b - a) > 2 * tolerance)
      x = a + fraction * (b - a)
      call evaluate(roots, system, observer, dense, bracket%function, x)
      if (sign_of(roots%g(bracket%function)) == sign_of(ga)) then
        c = a
        gc = ga
      else
        c = b
        gc = gb
        b = a
        gb = ga
      end if
      a = x
      ga = roots%g(bracket%function)
      least = min(0.5_wp, tolerance / abs(b - a))
      fraction = min(1 - least, max(least, next_fraction(a, b, c, ga, gb, gc)))
    end do
    root = a
    if (abs(ga) > 0) root = max(a, b)
  end subroutine find_root

  !> The next point as a fraction from a to b: inverse quadratic interpolation where it converges, else the middle.
  pure real(wp) function next_fraction(a, b, c, ga, gb, gc)
    real(wp), intent(in) :: a, b, c, ga, gb, gc   !! ga and gc differ from gb in sign, or a is the root
    real(wp) :: position, share

    next_fraction = 0.5_wp
    position = (a - b) / (c - b)
    share = (ga - gb) / (gc - gb)
    if (share**2 >= position .or. (1 - share)**2 >= 1 - position) return
    next_fraction = ga / (gb - ga) * (gc / (gb - gc)) + (c - a) / (b - a) * (ga / (gc - ga)) * (gb / (gc - gb))
  end function next_fraction

  !> Searches between three ends of parts, at which a function is positive, for a theta where it is not: by minima of parabolas
  !> through the three lowest points, as long as these predict one.
  subroutine find_grazing(roots, system, observer, dense, function, middle, bracket, found)
    type(root_functions_t), intent(inout) :: roots
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    integer, intent(in) :: function
    integer, intent(in) :: middle               !! index of the part that ends at the middle point
    type(sign_change_t), intent(inout) :: bracket   !! of the fall through zero, set if it is found
    logical, intent(out) :: found
    real(wp) :: x(3), g(3), lowest
    logical :: is_promising
    integer :: i, left, step

    found = .false.
    x(:) = [(part_end(roots, middle - 1 + i, 1.0_wp), i=0, 2)]
    g(:) = roots%values(function, middle - 1:middle + 1)
    do step = 1, max_grazing_steps
      call guess_minimum(x, g, lowest, is_promising)
      if (.not. is_promising) return
      call evaluate(roots, system, observer, dense, function, lowest)
      if (.not. is_finite(roots%g(function))) return
      left = merge(2, 1, lowest > x(2))
      found = roots%g(function) <= 0
      if (found) exit
      call keep_lowest_three(x, g, left, lowest, roots%g(function))
    end do
    if (found) bracket = sign_change_t(function, x(left), lowest, g(left), roots%g(function))
  end subroutine find_grazing

  !> The vertex of the parabola through three points.
  pure subroutine guess_minimum(x, g, vertex, is_promising)
    real(wp), intent(in) :: x(3), g(3)     !! x ascending, g positive
    real(wp), intent(out) :: vertex
    logical, intent(out) :: is_promising   !! whether it is a minimum between the points and far below them
    real(wp) :: curvature, slope

    vertex = x(2)
    is_promising = .false.
    slope = (g(2) - g(1)) / (x(2) - x(1))
    curvature = ((g(3) - g(2)) / (x(3) - x(2)) - slope) / (x(3) - x(1))
    if (curvature <= 0) return
    slope = slope + curvature * (x(2) - x(1))
    if (abs(slope) >= 2 * curvature * (x(3) - x(1))) return
    if (g(2) - 0.25_wp * slope * (slope / curvature) > promising * minval(g)) return
    vertex = x(2) - 0.5_wp * slope / curvature
    is_promising = vertex > x(1) .and. vertex < x(3) .and. minval(abs(vertex - x)) > least_distance
  end subroutine guess_minimum

  !> Inserts a point after point `left` and keeps the three points around the lowest.
  pure subroutine keep_lowest_three(x, g, left, x_new, g_new)
    real(wp), intent(inout) :: x(3), g(3)
    integer, intent(in) :: left
    real(wp), intent(in) :: x_new, g_new
    real(wp) :: places(4), values(4)
    integer :: first

    places(:3) = x
    values(:3) = g
    places(left + 2:) = x(left + 1:)
    values(left + 2:) = g(left + 1:)
    places(left + 1) = x_new
    values(left + 1) = g_new
    first = merge(1, 2, minloc(values, dim=1) <= 2)
    x = places(first:first + 2)
    g = values(first:first + 2)
  end subroutine keep_lowest_three

end module nocdyn_root_functions
