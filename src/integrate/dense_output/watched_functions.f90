!> Functions g(t, y) whose signs are followed on the solution inside the steps: an observer's events, a system's switches.
!>
!> Their values are taken at the ends of a few equal parts of every step; a change of sign between two of them is followed to
!> the last bits of the time.
module nocdyn_watched_functions
  use nocdyn_dense_output, only: dense_output_t, sample
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: observer_t, system_t
  use nocdyn_trial, only: trial_t
  implicit none (type, external)
  private

  public :: allocate_watched, start_watched, scan_step, evaluate, place, part_of_step, find_root, find_dip, sign_of

  integer, parameter :: least_parts = 4                 !! of a step; more for solutions of higher degree, whose steps are longer
  integer, parameter :: most_dip_steps = 10
  real(wp), parameter :: promising = 0.5_wp             ! a parabola that goes no lower than this share says that there is no dip
  real(wp), parameter :: least_distance = 1.0e-8_wp     ! of places in a dip: closer ones say nothing about the curvature

  type, public :: watched_t
    logical :: of_system = .false.                      !! switches of the system, else events of the observer
    integer :: parts = least_parts                      !! of a step
    integer, allocatable :: side(:, :)                  !! sign of the last value, 0 after a zero; [lanes, functions]
    real(wp), allocatable :: values(:, :)               !! at the ends of the parts of the last step; [functions, 0:parts]
    real(wp), allocatable, private :: last(:, :)        !! at the end of the last step; [functions, lanes]
    real(wp), allocatable, private :: g(:)
    real(wp), allocatable, private :: y(:)              !! state at which the functions are taken
  end type watched_t

  !> Two places in a step between which a function changes its sign.
  type, public :: bracket_t
    integer :: function = 0
    real(wp) :: before = 0.0_wp, after = 0.0_wp
    real(wp) :: g_before = 0.0_wp, g_after = 0.0_wp     !! values there
  end type bracket_t

contains

  !> Room for the functions of an observer or a system.
  subroutine allocate_watched(watched, functions, of_system, degree, trial)
    type(watched_t), intent(out) :: watched
    integer, intent(in) :: functions
    logical, intent(in) :: of_system
    integer, intent(in) :: degree   !! of the solution inside the step
    type(trial_t), intent(in) :: trial

    watched%of_system = of_system
    watched%parts = max(least_parts, degree / 2)
    allocate (watched%side(trial%lanes, functions), source=0)
    allocate (watched%values(functions, 0:watched%parts), watched%last(functions, trial%lanes), watched%g(functions), &
              watched%y(trial%components), source=0.0_wp)
  end subroutine allocate_watched

  !> Takes the signs where a lane starts.
  subroutine start_watched(watched, system, observer, trial, lane)
    type(watched_t), intent(inout) :: watched
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(trial_t), intent(in) :: trial
    integer, intent(in) :: lane

    watched%y(:) = trial%y(lane, :trial%components)
    if (watched%of_system) then
      call system%switch_values(lane, trial%t(lane), watched%y, watched%last(:, lane))
    else
      call observer%event_values(lane, trial%t(lane), watched%y, watched%last(:, lane))
    end if
    watched%side(lane, :) = sign_of(watched%last(:, lane))
  end subroutine start_watched

  !> Takes the values at the ends of the parts of a lane's last step.
  subroutine scan_step(watched, system, observer, dense, until)
    type(watched_t), intent(inout) :: watched
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense   !! of the lane
    real(wp), intent(in) :: until                  !! end of the step, 1 if it has not been cut
    integer :: part

    watched%values(:, 0) = watched%last(:, dense%lane)
    do part = 1, watched%parts
      call evaluate(watched%of_system, system, observer, dense, place(watched, part, until), watched%y, &
                    watched%values(:, part))
    end do
    watched%last(:, dense%lane) = watched%values(:, watched%parts)
  end subroutine scan_step

  !> Place of the end of a part in a step.
  pure real(wp) function place(watched, part, until)
    type(watched_t), intent(in) :: watched
    integer, intent(in) :: part
    real(wp), intent(in) :: until

    place = until * part / watched%parts
  end function place

  !> One part of a step as a bracket of one function.
  pure type(bracket_t) function part_of_step(watched, function, part, until)
    type(watched_t), intent(in) :: watched
    integer, intent(in) :: function, part
    real(wp), intent(in) :: until

    part_of_step%function = function
    part_of_step%before = place(watched, part - 1, until)
    part_of_step%after = place(watched, part, until)
    part_of_step%g_before = watched%values(function, part - 1)
    part_of_step%g_after = watched%values(function, part)
  end function part_of_step

  !> 0 also for what is not finite.
  elemental integer function sign_of(g)
    real(wp), intent(in) :: g

    sign_of = 0
    if (is_finite(g)) sign_of = merge(1, 0, g > 0) - merge(1, 0, g < 0)
  end function sign_of

  !> The functions at a place in the step.
  subroutine evaluate(of_system, system, observer, dense, theta, y, g)
    logical, intent(in) :: of_system
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: theta
    real(wp), contiguous, intent(inout) :: y(:)   !! the state there
    real(wp), contiguous, intent(inout) :: g(:)

    call sample(dense, theta, y)
    if (of_system) then
      call system%switch_values(dense%lane, dense%t + theta * dense%h, y, g)
    else
      call observer%event_values(dense%lane, dense%t + theta * dense%h, y, g)
    end if
  end subroutine evaluate

  !> Root of one function in a bracket, to the spacing of the times there: the place where it is zero, or the first one
  !> found beyond its change of sign. T. R. Chandrupatla, Adv. Eng. Software 28 (1997) 145-149.
  subroutine find_root(watched, system, observer, dense, bracket, root)
    type(watched_t), intent(inout) :: watched
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    type(bracket_t), intent(in) :: bracket
    real(wp), intent(out) :: root
    real(wp) :: a, b, c, ga, gb, gc   ! the newest place, the best one of the other sign, the one that they have replaced
    real(wp) :: fraction, least, tolerance, x

    tolerance = max(spacing(abs(dense%t) + dense%h) / dense%h, epsilon(a))
    a = bracket%after
    b = bracket%before
    ga = bracket%g_after
    gb = bracket%g_before
    fraction = 0.5_wp
    do while (abs(ga) > 0 .and. abs(b - a) > 2 * tolerance)
      x = a + fraction * (b - a)
      call evaluate(watched%of_system, system, observer, dense, x, watched%y, watched%g)
      if (sign_of(watched%g(bracket%function)) == sign_of(ga)) then
        c = a
        gc = ga
      else
        c = b
        gc = gb
        b = a
        gb = ga
      end if
      a = x
      ga = watched%g(bracket%function)
      least = min(0.5_wp, tolerance / abs(b - a))
      fraction = min(1 - least, max(least, next_fraction(a, b, c, ga, gb, gc)))
    end do
    root = a
    if (abs(ga) > 0) root = max(a, b)
  end subroutine find_root

  !> Where to look next between a (0) and b (1): inverse quadratic interpolation where it can be trusted, else the middle.
  pure real(wp) function next_fraction(a, b, c, ga, gb, gc)
    real(wp), intent(in) :: a, b, c, ga, gb, gc   !! ga and gc differ from gb in sign, or a is the root
    real(wp) :: place, share

    next_fraction = 0.5_wp
    place = (a - b) / (c - b)
    share = (ga - gb) / (gc - gb)
    if (share**2 >= place .or. (1 - share)**2 >= 1 - place) return
    next_fraction = ga / (gb - ga) * (gc / (gb - gc)) + (c - a) / (b - a) * (ga / (gc - ga)) * (gb / (gc - gb))
  end function next_fraction

  !> Looks between three ends of parts, at which a function is positive, for a place where it is not: by parabolas through the
  !> three places around the lowest value, as long as these promise one.
  subroutine find_dip(watched, system, observer, dense, function, middle, bracket, found)
    type(watched_t), intent(inout) :: watched
    class(system_t), intent(inout) :: system
    class(observer_t), intent(inout) :: observer
    type(dense_output_t), intent(inout) :: dense
    integer, intent(in) :: function
    integer, intent(in) :: middle               !! part whose end is between the other two
    type(bracket_t), intent(inout) :: bracket   !! of the function's fall, if there is one
    logical, intent(out) :: found
    real(wp) :: x(3), g(3), lowest
    logical :: is_promising
    integer :: i, left, step

    found = .false.
    x(:) = [(place(watched, middle - 1 + i, 1.0_wp), i=0, 2)]
    g(:) = watched%values(function, middle - 1:middle + 1)
    do step = 1, most_dip_steps
      call guess_dip(x, g, lowest, is_promising)
      if (.not. is_promising) return
      call evaluate(watched%of_system, system, observer, dense, lowest, watched%y, watched%g)
      if (.not. is_finite(watched%g(function))) return
      left = merge(2, 1, lowest > x(2))
      found = watched%g(function) <= 0
      if (found) exit
      call narrow(x, g, left, lowest, watched%g(function))
    end do
    if (found) bracket = bracket_t(function, x(left), lowest, g(left), watched%g(function))
  end subroutine find_dip

  !> The vertex of the parabola through three points.
  pure subroutine guess_dip(x, g, vertex, is_promising)
    real(wp), intent(in) :: x(3), g(3)     !! x ascending, g positive
    real(wp), intent(out) :: vertex
    logical, intent(out) :: is_promising   !! it is a minimum between the points and far below them
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
  end subroutine guess_dip

  !> Adds a point behind number `left` and keeps the three around the lowest.
  pure subroutine narrow(x, g, left, x_new, g_new)
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
  end subroutine narrow

end module nocdyn_watched_functions
