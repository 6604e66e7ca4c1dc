!> Modes of joints with friction beside teeth whose modes are chosen, by linear complementarity
!> (`nocdyn_linear_complementarity`).
!>
!> A joint at rest has a moment between two bounds: z is how far it is above the lower one, and what accelerates it backwards
!> where it is at the upper one; their complements are what accelerates it forwards, and how far it is below the upper one. The
!> moments follow from all z by the equations of the teeth and of rows that hold always. All rows have the unit of
!> `joint_problem_t%roots`.
module nocdyn_joint_pivots
  use nocdyn_friction_joints, only: locked, slips_backwards, slips_forwards
  use nocdyn_joint_problem, only: flexibility, joint_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_linear_complementarity, only: solve_linear_complementarity
  implicit none (type, external)
  private

  public :: pivot_modes

contains

  !> Chooses the modes of friction at rest where `is_found`. The modes of all other joints are given.
  subroutine pivot_modes(problem, is_found)
    class(joint_problem_t), intent(inout) :: problem
    logical, intent(out) :: is_found
    integer, dimension(size(problem%mode)) :: above, below   ! pairs of the lower and the upper bound, 0: there is none
    logical, allocatable :: is_basic(:)
    real(wp), allocatable :: w(:, :), x(:, :), z(:)   ! complements and moments, affine in all z: [pairs or joints, 0:pairs]
    integer :: i, pairs
    logical :: is_above, is_below

    call number_pairs(problem, above, below, pairs)
    allocate (x(size(above), 0:pairs), w(pairs, 0:pairs), source=0.0_wp)
    call find_moments_of_pairs(problem, above, below, x, is_found)
    if (.not. is_found) return
    call find_complements(problem, above, below, x, w)
    allocate (z(pairs), is_basic(pairs))
    call solve_linear_complementarity(w(:, 1:), w(:, 0), z, is_basic, is_found)
    if (is_found) then
      ! the modes by the pairs whose z are in the basis
      do i = 1, size(above)
        if (max(above(i), below(i)) == 0) cycle
        is_above = .true.
        if (above(i) > 0) is_above = is_basic(above(i))
        is_below = .true.
        if (below(i) > 0) is_below = is_basic(below(i)) .neqv. above(i) > 0
        problem%mode(i) = locked
        if (.not. is_above .and. is_below) problem%mode(i) = slips_forwards
        if (is_above .and. .not. is_below) problem%mode(i) = slips_backwards
      end do
    end if
  end subroutine pivot_modes

  !> Numbers the pairs of all joints.
  subroutine number_pairs(problem, above, below, pairs)
    class(joint_problem_t), intent(in) :: problem
    integer, intent(out) :: above(:), below(:)
    integer, intent(out) :: pairs   !! their number
    integer :: i
    logical :: may_hold(size(above))

    above = 0
    below = 0
    pairs = 0
    may_hold = problem%is_at_rest .and. .not. problem%has_teeth .and. problem%least < problem%most
    do i = 1, size(above)
      if (may_hold(i) .and. problem%least(i) > -huge(1.0_wp)) then
        pairs = pairs + 1
        above(i) = pairs
      end if
      if (may_hold(i) .and. problem%most(i) < huge(1.0_wp)) then
        pairs = pairs + 1
        below(i) = pairs
      end if
    end do
  end subroutine number_pairs

  !> The moments of all joints by the z.
  subroutine find_moments_of_pairs(problem, above, below, x, is_found)
    class(joint_problem_t), intent(inout) :: problem
    integer, intent(in) :: above(:), below(:)
    real(wp), contiguous, intent(inout) :: x(:, 0:)
    logical, intent(out) :: is_found
    integer :: i, k, order(size(above))
    logical :: is_friction(size(above)), is_singular
    real(wp) :: matrix(size(above), size(above)), root(size(above))

    root = problem%roots()
    is_friction = problem%is_at_rest .and. .not. (problem%has_teeth .or. problem%holds_always())
    where (is_friction) problem%mode = slips_forwards
    call problem%scaled_equations(matrix, x(:, 0))
    do i = 1, size(above)
      if (.not. is_friction(i)) cycle
      x(i, 0) = root(i) * merge(problem%most(i), problem%least(i), above(i) == 0 .and. below(i) > 0)
      if (above(i) > 0) then
        x(i, above(i)) = 1.0_wp
      else if (below(i) > 0) then
        x(i, below(i)) = -1.0_wp
      end if
    end do
    call lu_factor(matrix, order, is_singular)
    is_found = .not. is_singular
    if (is_singular) return
    do k = 0, size(x, 2) - 1
      call lu_solve(matrix, order, x(:, k))
    end do
  end subroutine find_moments_of_pairs

  !> The complements by the z.
  pure subroutine find_complements(problem, above, below, x, w)
    class(joint_problem_t), intent(in) :: problem
    integer, intent(in) :: above(:), below(:)
    real(wp), intent(in) :: x(:, 0:)
    real(wp), intent(inout) :: w(:, 0:)
    integer :: i
    real(wp) :: acceleration(0:size(x, 2) - 1), root(size(above))

    root = problem%roots()
    do i = 1, size(above)
      acceleration = matmul(problem%w(i, :) / (root(i) * root), x) + flexibility * x(i, :)
      acceleration(0) = acceleration(0) + problem%rate(i) / root(i)
      if (above(i) > 0) w(above(i), :) = acceleration
      if (below(i) == 0) cycle
      if (above(i) == 0) then
        w(below(i), :) = -acceleration
      else
        w(above(i), below(i)) = w(above(i), below(i)) + 1.0_wp
        w(below(i), above(i)) = -1.0_wp
        w(below(i), 0) = root(i) * (problem%most(i) - problem%least(i))
      end if
    end do
  end subroutine find_complements

end module nocdyn_joint_pivots
