!> Complementarity with bounds: the forces x between given bounds that belong to a = W x + b, where a(i) is zero unless x(i) is
!> at a bound, at least zero where it is the lower one and at most zero where it is the upper one.
!>
!> These are the conditions for the least of x^T W x / 2 + b^T x, with W symmetric and positive semidefinite; a is unique, and
!> the forces that are not at their bounds have the least norm. The active set changes by one force at a time:
!> J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., algorithm 16.3. Joints with dry friction at rest are of this kind:
!> Ch. Glocker, F. Pfeiffer, Nonlinear Dynamics 4 (1993) 465-480.
module nocdyn_bounded_complementarity
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_semidefinite, only: null_tolerance
  implicit none (type, external)
  private

  public :: solve_bounded_complementarity, solve_scaled_complementarity

  integer, parameter, public :: is_free = 0, at_lower = -1, at_upper = 1   !! where a force is
  real(wp), parameter :: rounding = 1.0e-12_wp                             ! of a, relative to the sum of its terms
  real(wp), parameter :: mixed = 1.0e-2_wp                                 ! of the largest terms in the sums of all a
  real(wp), parameter :: inconsistent = 1.0e-7_wp                          ! a of free forces that none can make zero, likewise
  real(wp), parameter :: far = 1.0e30_wp                                   ! beyond all bounds that are not huge

contains

  !> Solves the problem. Bounds may be huge.
  subroutine solve_bounded_complementarity(w, b, lower, upper, x, a, state, is_solved)
    real(wp), intent(in) :: w(:, :)              !! [n, n], in any unit
    real(wp), intent(in) :: b(:)                 !! [n], offset of a
    real(wp), intent(in) :: lower(:), upper(:)   !! bounds of x, lower <= upper, [n]
    real(wp), intent(out) :: x(:), a(:)          !! [n]
    integer, intent(out) :: state(:)             !! is_free, at_lower or at_upper, [n]
    logical, intent(out) :: is_solved            !! false without such forces, or after too many changes of the active set
    integer :: change, worst
    logical :: is_endless
    real(wp) :: wrong(size(b))

    x = min(max(0.0_wp, lower), upper)
    state = is_free
    where (upper <= lower) state = at_lower
    is_solved = .false.
    do change = 1, 50 * (size(b) + 1)
      call move_free(w, b, lower, upper, x, state, is_endless)
      a = matmul(w, x) + b
      if (is_endless) return
      wrong = 0.0_wp
      where (state == at_lower) wrong = -a
      where (state == at_upper) wrong = a
      where (upper <= lower) wrong = 0.0_wp
      where (wrong <= rounding * sizes_of_terms(w, b, x)) wrong = 0.0_wp
      is_solved = all(wrong <= 0)
      if (is_solved) return
      worst = maxloc(wrong, dim=1)
      state(worst) = is_free
    end do
  end subroutine solve_bounded_complementarity

  !> Solves the problem where x / scale is to have the least norm.
  subroutine solve_scaled_complementarity(w, b, scale, bounds, x, a, state, is_solved)
    real(wp), intent(in) :: w(:, :), b(:)    !! as in `solve_bounded_complementarity`, also what follows
    real(wp), intent(in) :: scale(:)         !! positive, [n]
    real(wp), intent(in) :: bounds(:, :)     !! lower and upper ones, [n, 2]
    real(wp), intent(out) :: x(:), a(:)
    integer, intent(out) :: state(:)
    logical, intent(out) :: is_solved
    real(wp) :: scaled_bounds(size(b), 2), scaled_w(size(b), size(b))
    integer :: i, k

    do k = 1, 2
      where (abs(bounds(:, k)) < huge(1.0_wp))
        scaled_bounds(:, k) = bounds(:, k) / scale
      else where
        scaled_bounds(:, k) = bounds(:, k)
      end where
    end do
    do k = 1, size(b)
      scaled_w(:, k) = [(scale(i) * scale(k) * w(i, k), i=1, size(b))]
    end do
    call solve_bounded_complementarity(scaled_w, scale * b, scaled_bounds(:, 1), scaled_bounds(:, 2), x, a, state, is_solved)
    x = scale * x
    a = a / scale
  end subroutine solve_scaled_complementarity

  !> The sizes of the terms of all a, of which their rounding errors are parts. The forces come from equations that mix them:
  !> those without a load have errors of the largest ones, by the square roots of the diagonal of W, in which units cancel.
  pure function sizes_of_terms(w, b, x) result(sizes)
    real(wp), intent(in) :: w(:, :), b(:), x(:)   !! as in `solve_bounded_complementarity`
    real(wp) :: sizes(size(b))
    integer :: i
    real(wp) :: root(size(b))

    root = [(sqrt(max(w(i, i), tiny(1.0_wp))), i=1, size(b))]
    sizes = [(abs(b(i)) + sum(abs(w(i, :) * x)), i=1, size(b))]
    if (size(b) > 0) sizes = max(sizes, mixed * root * maxval(sizes / root))
  end function sizes_of_terms

  !> Moves the free forces to where their a is zero; those that reach a bound on the way stay there.
  subroutine move_free(w, b, lower, upper, x, state, is_endless)
    real(wp), intent(in) :: w(:, :), b(:), lower(:), upper(:)   !! as in `solve_bounded_complementarity`
    real(wp), intent(inout) :: x(:)
    integer, intent(inout) :: state(:)
    logical, intent(out) :: is_endless   !! whether no forces make the a of the free ones zero
    integer, allocatable :: bound(:), free(:)
    real(wp), allocatable :: rest(:), wanted(:)
    real(wp) :: share, sizes(size(b)), step
    integer :: first, i

    is_endless = .false.
    do
      free = pack([(i, i=1, size(x))], state == is_free)
      is_endless = .false.
      if (size(free) == 0) return
      bound = pack([(i, i=1, size(x))], state /= is_free)
      wanted = -matmul(pseudo_inverse(w(free, free), null_tolerance), matmul(w(free, bound), x(bound)) + b(free))
      rest = matmul(w(free, free), wanted) + matmul(w(free, bound), x(bound)) + b(free)
      sizes = sizes_of_terms(w, b, x)
      is_endless = maxval(abs(rest)) > inconsistent * (maxval(abs(b(free))) + maxval(abs(matmul(w(free, bound), x(bound))))) &
                   .and. any(abs(rest) > rounding * sizes(free))
      if (is_endless) wanted = x(free) - far * rest / maxval(abs(rest))   ! without resistance a force grows up to a bound
      step = 1.0_wp
      first = 0
      do i = 1, size(free)
        associate (limit => merge(upper(free(i)), lower(free(i)), wanted(i) > x(free(i))))
          if (wanted(i) >= lower(free(i)) .and. wanted(i) <= upper(free(i))) cycle
          share = (limit - x(free(i))) / (wanted(i) - x(free(i)))
        end associate
        if (first > 0 .and. share >= step) cycle
        step = share
        first = i
      end do
      if (first == 0 .and. is_endless) return
      x(free) = x(free) + step * (wanted - x(free))
      if (first == 0) return
      i = free(first)
      state(i) = merge(at_upper, at_lower, wanted(first) > upper(i))
      x(i) = merge(upper(i), lower(i), state(i) == at_upper)
    end do
  end subroutine move_free

end module nocdyn_bounded_complementarity
