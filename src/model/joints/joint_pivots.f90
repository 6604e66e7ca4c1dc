!> Modes of joints, teeth with losses among them, by linear complementarity (`nocdyn_linear_complementarity`).
!>
!> A joint at rest has a moment between two bounds: z is how far it is above the lower one, and what accelerates it backwards
!> where it is at the upper one; their complements are what accelerates it forwards, and how far it is below the upper one. Teeth
!> have bounds that grow with T, whose negative part is one more z, and its positive part the complement. The moments follow from
!> all z by the equations of rows that hold always, and x = -s (T + V x); so does M. All rows have the unit of
!> `joint_problem_t%roots`. Locks are a little flexible, so that redundant ones share their moment.
module nocdyn_joint_pivots
  use nocdyn_friction_joints, only: driven_backwards, driven_forwards, locked, slips_backwards, slips_forwards
  use nocdyn_joint_problem, only: joint_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_linear_complementarity, only: solve_linear_complementarity
  implicit none (type, external)
  private

  public :: pivot_modes

  !> The pairs of each joint, 0 where it has none.
  type :: pairs_t
    integer, allocatable :: torque(:), above(:), below(:)   ! of T, and of the lower and the upper bound, [joints]
    integer :: count = 0
  end type pairs_t

  !> Affine in all z: the moments, and the complements.
  type :: pivots_t
    real(wp), allocatable :: x(:, :)    ! [joints, 0:pairs]
    real(wp), allocatable :: w(:, :)    ! [pairs, 0:pairs]
    real(wp), allocatable :: root(:)    ! [joints]
  end type pivots_t

contains

  !> Chooses modes, where `is_found`. For teeth that turn, `sense` may tell the sign of T in advance, where a search for it fails.
  subroutine pivot_modes(problem, sense, is_found)
    class(joint_problem_t), intent(inout) :: problem
    integer, intent(in) :: sense(:)   !! -1 or 1, 0: it is sought, [joints]
    logical, intent(out) :: is_found
    type(pairs_t) :: pairs
    type(pivots_t) :: pivots
    logical, allocatable :: is_basic(:)
    real(wp), allocatable :: z(:)

    call number_pairs(problem, sense, pairs)
    pivots%root = problem%roots()
    call find_moments_of_pairs(problem, sense, pairs, pivots, is_found)
    if (.not. is_found) return
    call find_complements(problem, pairs, pivots)
    allocate (z(pairs%count), is_basic(pairs%count))
    call solve_linear_complementarity(pivots%w(:, 1:), pivots%w(:, 0), z, is_basic, is_found)
    if (is_found) call take_modes(problem, sense, pairs, is_basic)
  end subroutine pivot_modes

  !> Numbers the pairs of all joints.
  subroutine number_pairs(problem, sense, pairs)
    class(joint_problem_t), intent(in) :: problem
    integer, intent(in) :: sense(:)
    type(pairs_t), intent(out) :: pairs
    integer :: i

    allocate (pairs%torque(size(sense)), pairs%above(size(sense)), pairs%below(size(sense)), source=0)
    do i = 1, size(sense)
      if (problem%has_teeth(i)) then
        if (sense(i) == 0) call add(pairs%torque(i))
        if (.not. problem%is_at_rest(i)) cycle
        call add(pairs%above(i))
        call add(pairs%below(i))
      else if (problem%is_at_rest(i) .and. problem%least(i) < problem%most(i)) then
        if (problem%least(i) > -huge(1.0_wp)) call add(pairs%above(i))
        if (problem%most(i) < huge(1.0_wp)) call add(pairs%below(i))
      end if
    end do

  contains

    subroutine add(pair)
      integer, intent(out) :: pair

      pairs%count = pairs%count + 1
      pair = pairs%count
    end subroutine add

  end subroutine number_pairs

  !> The moments of all joints by the z.
  subroutine find_moments_of_pairs(problem, sense, pairs, pivots, is_found)
    class(joint_problem_t), intent(in) :: problem
    integer, intent(in) :: sense(:)
    type(pairs_t), intent(in) :: pairs
    type(pivots_t), intent(inout) :: pivots
    logical, intent(out) :: is_found
    real(wp), parameter :: flexibility = 1.0e-9_wp   ! relative to the diagonal of W
    integer :: i, k, order(size(sense))
    logical :: is_singular
    real(wp) :: matrix(size(sense), size(sense)), s

    allocate (pivots%x(size(sense), 0:pairs%count), source=0.0_wp)
    matrix = 0.0_wp
    associate (x => pivots%x, root => pivots%root)
      do i = 1, size(sense)
        if (problem%has_teeth(i)) then
          s = problem%driven(i)
          if (is_backwards(problem, i)) s = problem%driving(i)
          if (sense(i) /= 0) s = merge(problem%driven(i), problem%driving(i), sense(i) > 0 .neqv. is_backwards(problem, i))
          matrix(i, :) = root(i) * s * problem%v(i, :) / root
          x(i, 0) = -root(i) * s * problem%load(i)
          if (pairs%torque(i) > 0) x(i, pairs%torque(i)) = (problem%driven(i) - problem%driving(i)) &
                                                           * merge(1.0_wp, -1.0_wp, is_backwards(problem, i))
          if (pairs%above(i) > 0) x(i, pairs%above(i)) = 1.0_wp
        else if (.not. problem%is_at_rest(i)) then
          cycle
        else if (pairs%above(i) > 0 .or. problem%least(i) >= problem%most(i)) then
          x(i, 0) = root(i) * problem%least(i)
          if (pairs%above(i) > 0) x(i, pairs%above(i)) = 1.0_wp
        else if (pairs%below(i) > 0) then
          x(i, 0) = root(i) * problem%most(i)
          x(i, pairs%below(i)) = -1.0_wp
        else
          matrix(i, :) = problem%w(i, :) / (root(i) * root)
          x(i, 0) = -problem%rate(i) / root(i)
          matrix(i, i) = matrix(i, i) + flexibility - 1.0_wp
        end if
      end do
      do i = 1, size(sense)
        matrix(i, i) = matrix(i, i) + 1.0_wp
      end do
      call lu_factor(matrix, order, is_singular)
      is_found = .not. is_singular
      if (is_singular) return
      do k = 0, pairs%count
        call lu_solve(matrix, order, x(:, k))
      end do
    end associate
  end subroutine find_moments_of_pairs

  !> Whether teeth turn backwards.
  pure logical function is_backwards(problem, i)
    class(joint_problem_t), intent(in) :: problem
    integer, intent(in) :: i

    is_backwards = .not. problem%is_at_rest(i) .and. problem%slip(i) <= 0
  end function is_backwards

  !> The complements by the z.
  pure subroutine find_complements(problem, pairs, pivots)
    class(joint_problem_t), intent(in) :: problem
    type(pairs_t), intent(in) :: pairs
    type(pivots_t), intent(inout) :: pivots
    real(wp), parameter :: flexibility = 1.0e-9_wp
    integer :: i
    real(wp), dimension(0:pairs%count) :: acceleration, torque
    real(wp) :: width

    allocate (pivots%w(pairs%count, 0:pairs%count), source=0.0_wp)
    associate (root => pivots%root, x => pivots%x, w => pivots%w)
      do i = 1, size(root)
        acceleration = matmul(problem%w(i, :) / (root(i) * root), x) + flexibility * x(i, :)
        acceleration(0) = acceleration(0) + problem%rate(i) / root(i)
        if (pairs%torque(i) > 0) then
          torque = matmul(root(i) * problem%v(i, :) / root, x)
          torque(0) = torque(0) + root(i) * problem%load(i)
          torque(pairs%torque(i)) = torque(pairs%torque(i)) + 1.0_wp   ! its positive part
          w(pairs%torque(i), :) = torque
          torque(pairs%torque(i)) = torque(pairs%torque(i)) + 1.0_wp   ! its magnitude
        end if
        if (pairs%above(i) > 0) then
          w(pairs%above(i), :) = acceleration
          if (pairs%below(i) == 0) cycle
          w(pairs%above(i), pairs%below(i)) = w(pairs%above(i), pairs%below(i)) + 1.0_wp
          if (problem%has_teeth(i)) then
            width = problem%driven(i) - problem%driving(i)
            w(pairs%below(i), :) = width * torque
          else
            w(pairs%below(i), 0) = root(i) * (problem%most(i) - problem%least(i))
          end if
          w(pairs%below(i), pairs%above(i)) = w(pairs%below(i), pairs%above(i)) - 1.0_wp
        else if (pairs%below(i) > 0) then
          w(pairs%below(i), :) = -acceleration
        end if
      end do
    end associate
  end subroutine find_complements

  !> The modes by the pairs whose z are in the basis.
  pure subroutine take_modes(problem, sense, pairs, is_basic)
    class(joint_problem_t), intent(inout) :: problem
    integer, intent(in) :: sense(:)
    type(pairs_t), intent(in) :: pairs
    logical, intent(in) :: is_basic(:)   ! [pairs]
    integer :: direction, i
    logical :: is_above, is_below, is_positive

    do i = 1, size(sense)
      direction = 0
      if (problem%is_at_rest(i)) then
        is_above = .true.
        if (pairs%above(i) > 0) is_above = is_basic(pairs%above(i))
        is_below = .true.
        if (pairs%below(i) > 0 .and. pairs%above(i) > 0) is_below = .not. is_basic(pairs%below(i))
        if (pairs%below(i) > 0 .and. pairs%above(i) == 0) is_below = is_basic(pairs%below(i))
        if (.not. is_below) direction = -1
        if (.not. is_above) direction = 1
        if (.not. (is_above .or. is_below)) direction = 0
        if (.not. problem%has_teeth(i) .and. problem%least(i) >= problem%most(i)) direction = merge(1, -1, problem%rate(i) > 0)
        problem%mode(i) = locked
        if (direction > 0) problem%mode(i) = slips_forwards
        if (direction < 0) problem%mode(i) = slips_backwards
      else
        direction = merge(1, -1, problem%slip(i) > 0)
      end if
      if (.not. problem%has_teeth(i) .or. direction == 0) cycle
      is_positive = sense(i) > 0
      if (sense(i) == 0) is_positive = .not. is_basic(pairs%torque(i))
      if (direction > 0) problem%mode(i) = merge(slips_forwards, driven_forwards, is_positive)
      if (direction < 0) problem%mode(i) = merge(driven_backwards, slips_backwards, is_positive)
    end do
  end subroutine take_modes

end module nocdyn_joint_pivots
