!> Nonlinear least squares with bounds: the smallest sum of squares of residuals r(x) with low <= x <= high.
!>
!> Levenberg-Marquardt steps by the singular values of the Jacobian, damped as Nielsen does (K. Madsen, H. B. Nielsen,
!> O. Tingleff, Methods for Non-Linear Least Squares Problems, IMM 2004, algorithm 3.16). A variable at a bound that the gradient
!> pushes against stays there for the step; others are kept inside. Variables are scaled by their sizes. No library of Debian for
!> Fortran has least squares with bounds: MINPACK has no bounds, NLopt no least squares.
!>
!> The Jacobian is of differences: at first forward ones; at the end central ones of the fourth order over a small part of the
!> standard errors, with which the last steps are taken, so that the result is where the gradient of the residuals vanishes.
module nocdyn_least_squares
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: singular_vectors
  implicit none (type, external)
  private

  public :: solve_least_squares

  !> What is fitted.
  type, abstract, public :: residuals_t
    integer :: count = 0   !! of the residuals
  contains
    procedure(residuals_interface), deferred :: evaluate
  end type residuals_t

  abstract interface
    subroutine residuals_interface(self, x, r, error)
      import :: error_t, residuals_t, wp
      class(residuals_t), intent(inout) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: r(:)                       !! [count], each over its standard deviation
      type(error_t), allocatable, intent(out) :: error    !! there are none at x
    end subroutine residuals_interface
  end interface

  !> The variables, and what is known of them.
  type, public :: solution_t
    real(wp), allocatable :: x(:)
    real(wp), allocatable :: residuals(:)
    real(wp), allocatable :: jacobian(:, :)      !! by the variables, [residuals, variables]
    real(wp) :: cost = huge(1.0_wp)              !! half the sum of squares
    real(wp), allocatable :: covariance(:, :)    !! for residuals with deviations of 1, by the directions that are determined
    real(wp), allocatable :: undetermined(:, :)  !! relative changes that no residual sees, [variables, directions]
    logical, allocatable :: is_at_bound(:)
    integer :: evaluations = 0
    logical :: has_converged = .false.
  end type solution_t

  !> How steps are damped.
  type :: damping_t
    real(wp) :: lambda = -1.0_wp   ! added to the squares of the singular values; negative: not yet known
    real(wp) :: growth = 2.0_wp    ! of it, after a step that goes up
    real(wp) :: gain = 0.0_wp      ! the last fall of the cost, as a share of the one that linear residuals promise
    logical :: may_rise = .false.  ! whether rounding may hide that a step goes down
  end type damping_t

  real(wp), parameter :: no_effect = 1.0e-7_wp   ! singular value of a direction, as a share of the largest

contains

  !> Goes downhill from x.
  subroutine solve_least_squares(problem, start, low, high, scale, solution, error)
    class(residuals_t), intent(inout) :: problem
    real(wp), intent(in) :: start(:), low(:), high(:)
    real(wp), intent(in) :: scale(:)                     !! sizes of the variables
    type(solution_t), intent(out) :: solution
    type(error_t), allocatable, intent(out) :: error     !! the residuals at the start
    integer, parameter :: most_steps = 100, polish_steps = 6
    real(wp), parameter :: small_step = 1.0e-8_wp, tiny_step = 1.0e-12_wp   ! as shares of the sizes
    real(wp), parameter :: small_gain = 1.0e-8_wp                           ! as a share of the cost
    real(wp), parameter :: curved = 1.5_wp                                  ! gain by which residuals are not linear
    real(wp), parameter :: of_error = 1.0e-7_wp                             ! a step that is none, as a share of standard errors
    type(damping_t) :: damping
    real(wp) :: step(size(start))
    logical :: has_moved
    integer :: i, k

    solution%x = min(high, max(low, start))
    allocate (solution%residuals(problem%count), solution%jacobian(problem%count, size(start)))
    call problem%evaluate(solution%x, solution%residuals, error)
    if (allocated(error)) return
    solution%evaluations = 1
    solution%cost = 0.5_wp * sum(solution%residuals**2)
    do i = 1, most_steps
      call differentiate_forward(problem, low, high, scale, solution)
      do
        call find_step(solution, low, high, scale, damping%lambda, step)
        solution%has_converged = all(abs(step) <= small_step * scale) .or. promise(solution, step) <= small_gain * solution%cost
        if (solution%has_converged) exit
        call try_step(problem, step, low, high, solution, damping, has_moved)
        if (.not. has_moved) cycle
        if (damping%gain > curved) call extend_step(problem, step, low, high, solution)
        exit
      end do
      if (solution%has_converged) exit
    end do
    do i = 1, polish_steps
      call differentiate_centrally(problem, low, high, scale, solution)
      damping%lambda = 0.0_wp
      call find_step(solution, low, high, scale, damping%lambda, step)
      if (all(abs(step) <= max(tiny_step * scale, of_error * [(sqrt(solution%covariance(k, k)), k=1, size(step))]))) exit
      damping%may_rise = .true.
      call try_step(problem, step, low, high, solution, damping, has_moved)
      if (.not. has_moved) exit
    end do
    call conclude(low, high, scale, solution)
  end subroutine solve_least_squares

  !> By how much the cost falls in a step if the residuals are linear.
  real(wp) function promise(solution, step)
    type(solution_t), intent(in) :: solution
    real(wp), intent(in) :: step(:)
    real(wp) :: expected(size(solution%residuals))

    expected = matmul(solution%jacobian, step)
    promise = solution%cost - 0.5_wp * sum((solution%residuals + expected)**2)
  end function promise

  !> Which variables a step may move: not those that the gradient pushes against their bounds.
  function free_variables(solution, low, high) result(free)
    type(solution_t), intent(in) :: solution
    real(wp), intent(in) :: low(:), high(:)
    logical :: free(size(low))
    real(wp) :: gradient(size(low))

    gradient = matmul(transpose(solution%jacobian), solution%residuals)
    free = .not. ((solution%x <= low .and. gradient > 0) .or. (solution%x >= high .and. gradient < 0))
  end function free_variables

  !> The damped step. Directions that nothing sees are left.
  subroutine find_step(solution, low, high, scale, lambda, step)
    type(solution_t), intent(in) :: solution
    real(wp), intent(in) :: low(:), high(:), scale(:)
    real(wp), intent(inout) :: lambda    !! not yet known if negative
    real(wp), intent(out) :: step(:)
    real(wp), parameter :: first = 1.0e-3_wp   ! of the largest square of a singular value
    real(wp), allocatable :: part(:), scaled(:, :), values(:), vectors(:, :)
    integer, allocatable :: chosen(:)
    integer :: k
    logical :: has_failed

    step = 0.0_wp
    allocate (chosen, source=pack([(k, k=1, size(step))], free_variables(solution, low, high)))
    if (size(chosen) == 0) return
    allocate (scaled(size(solution%residuals), size(chosen)), values(size(chosen)), vectors(size(chosen), size(chosen)))
    do k = 1, size(chosen)
      scaled(:, k) = solution%jacobian(:, chosen(k)) * scale(chosen(k))
    end do
    call singular_vectors(scaled, values, vectors, has_failed)
    if (has_failed .or. .not. values(1) > 0) return
    if (lambda < 0) lambda = first * values(1)**2
    part = matmul(transpose(vectors), matmul(transpose(scaled), solution%residuals))
    do k = 1, size(part)
      if (values(k) <= no_effect * values(1)) then
        part(k) = 0.0_wp
      else
        part(k) = -part(k) / (values(k)**2 + lambda)
      end if
    end do
    step(chosen) = scale(chosen) * matmul(vectors, part)
  end subroutine find_step

  !> Takes a step if it goes down, and sets the damping of the next one.
  subroutine try_step(problem, step, low, high, solution, damping, has_moved)
    class(residuals_t), intent(inout) :: problem
    real(wp), intent(in) :: step(:), low(:), high(:)
    type(solution_t), intent(inout) :: solution
    type(damping_t), intent(inout) :: damping
    logical, intent(out) :: has_moved
    real(wp), parameter :: rounding = 1.0e-9_wp, most = 1.0e6_wp   ! gain, where nothing is promised at bounds
    type(error_t), allocatable :: error
    real(wp) :: change(size(step)), cost, promised, r(problem%count), x(size(step))

    x = min(high, max(low, solution%x + step))
    call problem%evaluate(x, r, error)
    solution%evaluations = solution%evaluations + 1
    cost = huge(cost)
    if (.not. allocated(error)) cost = 0.5_wp * sum(r**2)
    change = x - solution%x
    promised = promise(solution, change)
    damping%gain = 0.0_wp
    has_moved = cost < solution%cost
    if (damping%may_rise) has_moved = has_moved .or. cost <= (1.0_wp + rounding) * solution%cost
    if (has_moved) then
      if (solution%cost - cost < most * promised) then
        damping%gain = (solution%cost - cost) / promised
      else if (solution%cost > cost) then
        damping%gain = most
      end if
      damping%lambda = damping%lambda * max(1.0_wp / 3.0_wp, 1.0_wp - (2.0_wp * min(damping%gain, 2.0_wp) - 1.0_wp)**3)
      damping%growth = 2.0_wp
      solution%x = x
      solution%residuals = r
      solution%cost = cost
    else
      damping%lambda = damping%lambda * damping%growth
      damping%growth = 2.0_wp * damping%growth
    end if
  end subroutine try_step

  !> Goes on along a step that went down by more than linear residuals promise, in doubled strides.
  subroutine extend_step(problem, step, low, high, solution)
    class(residuals_t), intent(inout) :: problem
    real(wp), intent(in) :: step(:), low(:), high(:)
    type(solution_t), intent(inout) :: solution
    integer, parameter :: most_strides = 20
    type(error_t), allocatable :: error
    real(wp) :: begin(size(step)), cost, r(problem%count), x(size(step))
    integer :: i

    begin = solution%x - step
    do i = 1, most_strides
      x = min(high, max(low, begin + 2.0_wp**i * step))
      call problem%evaluate(x, r, error)
      solution%evaluations = solution%evaluations + 1
      if (allocated(error)) return
      cost = 0.5_wp * sum(r**2)
      if (cost >= solution%cost) return
      solution%x = x
      solution%residuals = r
      solution%cost = cost
    end do
  end subroutine extend_step

  !> The Jacobian by differences on the side that is inside of the bounds.
  subroutine differentiate_forward(problem, low, high, scale, solution)
    class(residuals_t), intent(inout) :: problem
    real(wp), intent(in) :: low(:), high(:), scale(:)
    type(solution_t), intent(inout) :: solution
    real(wp), parameter :: relative = 1.0e-6_wp
    type(error_t), allocatable :: error
    real(wp) :: r(problem%count), step, x(size(low))
    integer :: k

    do k = 1, size(low)
      step = relative * scale(k)
      if (solution%x(k) + step > high(k)) step = -step
      x = solution%x
      x(k) = x(k) + step
      call problem%evaluate(x, r, error)
      solution%evaluations = solution%evaluations + 1
      solution%jacobian(:, k) = 0.0_wp
      if (.not. allocated(error)) solution%jacobian(:, k) = (r - solution%residuals) / (x(k) - solution%x(k))
    end do
  end subroutine differentiate_forward

  !> The Jacobian by central differences of the fourth order, over a twentieth of the standard errors.
  subroutine differentiate_centrally(problem, low, high, scale, solution)
    class(residuals_t), intent(inout) :: problem
    real(wp), intent(in) :: low(:), high(:), scale(:)
    type(solution_t), intent(inout) :: solution
    real(wp), parameter :: of_error = 0.05_wp, least = 1.0e-6_wp, most = 1.0e-3_wp, weight(-2:2) = [1, -8, 0, 8, -1] / 12.0_wp
    type(error_t), allocatable :: error
    real(wp) :: change(problem%count), r(problem%count), step, x(size(low))
    integer :: k, p

    call find_covariance(low, high, scale, solution)
    do k = 1, size(low)
      step = min(most * scale(k), max(least * scale(k), of_error * sqrt(max(0.0_wp, solution%covariance(k, k)))))
      if (solution%x(k) + 2 * step > high(k) .or. solution%x(k) - 2 * step < low(k)) cycle   ! the forward one stays
      change = 0.0_wp
      do p = -2, 2
        if (p == 0) cycle
        x = solution%x
        x(k) = x(k) + p * step
        call problem%evaluate(x, r, error)
        solution%evaluations = solution%evaluations + 1
        if (allocated(error)) exit
        change = change + weight(p) * r
      end do
      if (.not. allocated(error)) solution%jacobian(:, k) = change / step
    end do
  end subroutine differentiate_centrally

  !> The covariance of the variables that are not at their bounds, and the directions that nothing determines.
  subroutine find_covariance(low, high, scale, solution)
    real(wp), intent(in) :: low(:), high(:), scale(:)
    type(solution_t), intent(inout) :: solution
    real(wp), allocatable :: scaled(:, :), values(:), vectors(:, :)   ! of the free variables
    real(wp) :: inverse(size(low), size(low))
    integer, allocatable :: free(:)
    integer :: k, n
    logical :: has_failed

    allocate (free, source=pack([(k, k=1, size(low))], free_variables(solution, low, high)))
    allocate (scaled(size(solution%residuals), size(free)), values(size(free)), vectors(size(free), size(free)))
    do k = 1, size(free)
      scaled(:, k) = solution%jacobian(:, free(k)) * scale(free(k))
    end do
    n = 0
    if (size(free) > 0) then
      call singular_vectors(scaled, values, vectors, has_failed)
      n = count(values > no_effect * maxval(values))
      if (has_failed) n = 0
    end if
    inverse = 0.0_wp
    do k = 1, n
      inverse(free, free) = inverse(free, free) + &
                            spread(vectors(:, k), 2, size(free)) * spread(vectors(:, k), 1, size(free)) / values(k)**2
    end do
    solution%covariance = inverse * spread(scale, 2, size(low)) * spread(scale, 1, size(low))
    if (allocated(solution%undetermined)) deallocate (solution%undetermined)
    allocate (solution%undetermined(size(low), size(free) - n), source=0.0_wp)
    do k = 1, size(free) - n
      solution%undetermined(free, k) = vectors(:, n + k)
      where (abs(solution%x) > 0) solution%undetermined(:, k) = solution%undetermined(:, k) * scale / abs(solution%x)
    end do
  end subroutine find_covariance

  subroutine conclude(low, high, scale, solution)
    real(wp), intent(in) :: low(:), high(:), scale(:)
    type(solution_t), intent(inout) :: solution

    solution%is_at_bound = .not. free_variables(solution, low, high)
    call find_covariance(low, high, scale, solution)
  end subroutine conclude

end module nocdyn_least_squares
