!> The smallest largest one of several functions of a few variables between 0 and 1, where others are to be at most 0:
!> minimise t with f_i(x) <= t, c_j(x) <= 0. With t as a variable the corners, at which two functions are equal, are no obstacle.
!>
!> By sequential least squares programming (D. Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28,
!> 1988), as NLopt has it. Gradients are central differences; all points of one are computed at the same time. A solution is
!> polled: where a small step along one variable is better, the search goes on from there.
module nocdyn_minimax
  use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_positive_inf, ieee_value
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_funloc, c_int, c_loc, c_null_char, c_ptr
  use nocdyn_kinds, only: wp
  use nocdyn_nlopt, only: nlopt_add_inequality_mconstraint, nlopt_algorithm_from_string, nlopt_create, nlopt_destroy, &
    nlopt_optimize, nlopt_set_ftol_rel, nlopt_set_lower_bounds, nlopt_set_maxeval, nlopt_set_min_objective, &
    nlopt_set_upper_bounds, nlopt_set_xtol_abs1
  implicit none (type, external)
  private

  public :: is_better, minimise_worst

  real(wp), parameter, public :: kept = 1.0e-6_wp   !! a limit is kept up to this

  !> The functions.
  type, abstract, public :: worst_problem_t
    integer :: goals = 1    !! functions of which the largest counts
    integer :: limits = 0   !! functions that are to be at most 0
  contains
    procedure(evaluate_interface), deferred :: evaluate
    procedure(renew_interface), deferred :: renew
  end type worst_problem_t

  !> A point with its functions.
  type, public :: worst_point_t
    real(wp), allocatable :: x(:)        !! between 0 and 1
    real(wp), allocatable :: goal(:)     !! [goals]
    real(wp), allocatable :: limit(:)    !! [limits]
    logical :: is_valid = .false.        !! whether there are such functions
  contains
    procedure :: worst, excess
  end type worst_point_t

  abstract interface

    !> The functions at some points, which are independent of one another.
    subroutine evaluate_interface(self, x, points)
      import :: worst_point_t, worst_problem_t, wp
      class(worst_problem_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)                              !! [variables, points]
      type(worst_point_t), allocatable, intent(out) :: points(:)   !! [points]
    end subroutine evaluate_interface

    !> Lets a problem have functions that are smoother near a point; the largest of them is the same.
    subroutine renew_interface(self, x, has_changed)
      import :: worst_problem_t, wp
      class(worst_problem_t), intent(inout) :: self
      real(wp), intent(in) :: x(:)
      logical, intent(out) :: has_changed
    end subroutine renew_interface

  end interface

  !> What the functions of NLopt know: the problem, and the last point with its gradients.
  type :: worst_search_t
    class(worst_problem_t), pointer :: problem => null()
    real(wp) :: scale = 1.0_wp               ! of the goals
    type(worst_point_t) :: here, best
    real(wp), allocatable :: slope(:, :)     ! [variables, goals and limits]
    integer :: evaluations = 0
  end type worst_search_t

  real(wp), parameter :: difference = 1.0e-4_wp        ! of gradients
  real(wp), parameter :: far = 1.0e3_wp                ! a goal where there is none, over the scale

contains

  !> The largest goal.
  pure real(wp) function worst(self)
    class(worst_point_t), intent(in) :: self

    worst = maxval(self%goal)
  end function worst

  !> By how much the worst limit is exceeded, 0 if all are kept.
  pure real(wp) function excess(self)
    class(worst_point_t), intent(in) :: self

    excess = max(0.0_wp, maxval([0.0_wp, self%limit]))
    if (excess <= kept) excess = 0.0_wp
  end function excess

  !> Whether a point is better than another one: valid, with limits less exceeded, with a smaller worst goal.
  pure logical function is_better(first, second)
    type(worst_point_t), intent(in) :: first, second

    is_better = first%is_valid
    if (.not. (first%is_valid .and. second%is_valid)) return
    is_better = first%excess() < second%excess()
    if (abs(first%excess() - second%excess()) <= 0.0_wp) is_better = first%worst() < second%worst()
  end function is_better

  !> Searches from a point.
  subroutine minimise_worst(problem, start, best, evaluations)
    class(worst_problem_t), target, intent(inout) :: problem
    real(wp), intent(in) :: start(:)
    type(worst_point_t), intent(out) :: best
    integer, intent(inout) :: evaluations   !! counted on
    integer, parameter :: most_rounds = 12
    real(wp), parameter :: gain = 1.0e-6_wp, poll_steps(*) = [1.0e-2_wp, 1.0e-3_wp]
    type(worst_search_t), target :: search
    real(wp) :: before
    integer :: round, step
    logical :: has_changed, has_found

    search%problem => problem
    search%best%x = start
    call differentiate(search, start)
    if (search%here%is_valid) search%best = search%here
    do round = 1, most_rounds
      if (.not. search%best%is_valid) exit
      before = search%best%worst()
      call descend(search)
      has_found = .false.
      do step = 1, size(poll_steps)
        call poll(search, poll_steps(step), has_found)
        if (has_found) exit
      end do
      call problem%renew(search%best%x, has_changed)
      if (has_changed) then
        deallocate (search%here%x)
        call differentiate(search, search%best%x)
        search%best = search%here
      end if
      if (.not. (has_found .or. has_changed .or. before - search%best%worst() > gain * abs(before))) exit
    end do
    best = search%best
    evaluations = evaluations + search%evaluations
  end subroutine minimise_worst

  !> Goes downhill from the best point.
  subroutine descend(search)
    type(worst_search_t), target, intent(inout) :: search
    integer, parameter :: most_evaluations = 40
    real(c_double), parameter :: step = 1.0e-8_c_double, fall = 1.0e-10_c_double, tolerance = 1.0e-9_c_double
    integer(c_int) :: status
    real(c_double), dimension(size(search%best%x) + 1) :: high, low, x
    real(c_double) :: value
    type(c_ptr) :: opt

    associate (n => size(search%best%x))
      search%scale = max(abs(search%best%worst()), tiny(1.0_wp))
      low(:n) = 0.0_c_double
      high(:n) = 1.0_c_double
      low(n + 1) = ieee_value(1.0_c_double, ieee_negative_inf)
      high(n + 1) = ieee_value(1.0_c_double, ieee_positive_inf)
      x(:n) = search%best%x
      x(n + 1) = search%best%worst() / search%scale
      opt = nlopt_create(nlopt_algorithm_from_string(c_text('LD_SLSQP')), int(n + 1, c_int))
      status = nlopt_set_lower_bounds(opt, low)
      status = nlopt_set_upper_bounds(opt, high)
      status = nlopt_set_min_objective(opt, c_funloc(bound_value), c_loc(search))
      associate (m => search%problem%goals + search%problem%limits)
        status = nlopt_add_inequality_mconstraint(opt, int(m, c_int), c_funloc(constraint_values), c_loc(search), &
                                                  spread(tolerance, 1, m))
      end associate
      status = nlopt_set_maxeval(opt, int(most_evaluations, c_int))
      status = nlopt_set_xtol_abs1(opt, step)
      status = nlopt_set_ftol_rel(opt, fall)
      status = nlopt_optimize(opt, x, value)   ! a failure leaves the best point so far
      call nlopt_destroy(opt)
    end associate
  end subroutine descend

  pure function c_text(text) result(characters)
    character(len=*), intent(in) :: text
    character(kind=c_char) :: characters(len(text) + 1)
    integer :: i

    do i = 1, len(text)
      characters(i) = text(i:i)
    end do
    characters(len(text) + 1) = c_null_char
  end function c_text

  !> The bound t, which is the last variable.
  real(c_double) function bound_value(n, x, gradient, data) bind(c) result(value)
    integer(c_int), value, intent(in) :: n
    real(c_double), intent(in) :: x(n)
    type(c_ptr), value, intent(in) :: gradient, data
    real(c_double), pointer :: slope(:)

    value = x(n)
    if (.not. c_associated(gradient) .or. .not. c_associated(data)) return
    call c_f_pointer(gradient, slope, [n])
    slope = 0.0_c_double
    slope(n) = 1.0_c_double
  end function bound_value

  !> The goals without the bound, and the limits.
  subroutine constraint_values(m, values, n, x, gradient, data) bind(c)
    integer(c_int), value, intent(in) :: m, n
    real(c_double), intent(out) :: values(m)
    real(c_double), intent(in) :: x(n)
    type(c_ptr), value, intent(in) :: gradient, data
    type(worst_search_t), pointer :: search
    real(c_double), pointer :: slope(:, :)

    call c_f_pointer(data, search)
    call differentiate(search, real(x(:n - 1), wp))
    associate (goals => search%problem%goals, here => search%here)
      if (here%is_valid) then
        values(:goals) = here%goal / search%scale - x(n)
        values(goals + 1:) = here%limit
      else
        values(:goals) = far
        values(goals + 1:) = 0.0_c_double
      end if
      if (.not. c_associated(gradient)) return
      call c_f_pointer(gradient, slope, [n, m])
      slope(n, :goals) = -1.0_c_double
      slope(n, goals + 1:) = 0.0_c_double
      slope(:n - 1, :goals) = search%slope(:, :goals) / search%scale
      slope(:n - 1, goals + 1:) = search%slope(:, goals + 1:)
    end associate
  end subroutine constraint_values

  !> Finds the functions and their gradients at a point, unless they are known.
  subroutine differentiate(search, x)
    type(worst_search_t), intent(inout) :: search
    real(wp), intent(in) :: x(:)
    type(worst_point_t), allocatable :: points(:)
    real(wp) :: around(size(x), 0:2 * size(x))
    integer :: k

    if (allocated(search%here%x)) then
      if (all(abs(search%here%x - x) <= 0.0_wp)) return
    end if
    around = spread(x, 2, size(around, 2))
    do k = 1, size(x)
      around(k, 2 * k - 1) = max(0.0_wp, x(k) - difference)
      around(k, 2 * k) = min(1.0_wp, x(k) + difference)
    end do
    call search%problem%evaluate(around, points)
    search%evaluations = search%evaluations + size(points)
    search%here = points(1)
    search%here%x = x
    associate (goals => search%problem%goals, limits => search%problem%limits)
      if (allocated(search%slope)) deallocate (search%slope)
      allocate (search%slope(size(x), goals + limits), source=0.0_wp)
      if (.not. search%here%is_valid) return
      do k = 1, size(x)
        associate (below => points(2 * k), above => points(2 * k + 1))
          if (below%is_valid .and. above%is_valid) then
            search%slope(k, :goals) = (above%goal - below%goal) / (around(k, 2 * k) - around(k, 2 * k - 1))
            search%slope(k, goals + 1:) = (above%limit - below%limit) / (around(k, 2 * k) - around(k, 2 * k - 1))
          end if
        end associate
      end do
    end associate
    if (is_better(search%here, search%best)) search%best = search%here
  end subroutine differentiate

  !> Looks at steps of one size along each variable.
  subroutine poll(search, step, has_found)
    type(worst_search_t), intent(inout) :: search
    real(wp), intent(in) :: step
    logical, intent(out) :: has_found   !! a better point, by more than rounding
    real(wp), parameter :: least = 1.0e-9_wp
    type(worst_point_t), allocatable :: points(:)
    real(wp) :: around(size(search%best%x), 2 * size(search%best%x)), limit
    integer :: k

    around = spread(search%best%x, 2, size(around, 2))
    do k = 1, size(search%best%x)
      around(k, 2 * k - 1) = max(0.0_wp, around(k, 2 * k - 1) - step)
      around(k, 2 * k) = min(1.0_wp, around(k, 2 * k) + step)
    end do
    call search%problem%evaluate(around, points)
    search%evaluations = search%evaluations + size(points)
    has_found = .false.
    limit = search%best%worst() - least * abs(search%best%worst())
    do k = 1, size(points)
      if (.not. is_better(points(k), search%best)) cycle
      if (points(k)%worst() > limit .and. .not. points(k)%excess() < search%best%excess()) cycle
      search%best = points(k)
      search%best%x = around(:, k)
      has_found = .true.
    end do
  end subroutine poll

end module nocdyn_minimax
