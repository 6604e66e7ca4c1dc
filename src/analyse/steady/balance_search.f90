!> Search for the speeds at which the torques on a machine balance.
!>
!> Unknowns without common equations are searched for separately. Of speeds that depend on each other all but one are eliminated.
!> This one is searched for over its whole range: every change of sign of the torque on a grid is refined, and every pair of
!> changes between two points of the grid. Where that need not find all solutions, or finds none, they are searched for from
!> many starts too.
module nocdyn_balance_search
  use nocdyn_balance_starts, only: search_from_starts
  use nocdyn_block_solutions, only: block_solutions_t, is_nearly_balanced
  use nocdyn_brackets, only: bracket_t, have_same_sign, new_bracket
  use nocdyn_eliminated_balance, only: eliminated_balance_t, new_eliminated_balance, new_speed_grid
  use nocdyn_kinds, only: wp
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: search_balance

  !> The torque left over along the speed that is set, at the points of a grid.
  type :: scan_t
    real(wp), allocatable :: grid(:)          !! [rad/s]
    real(wp), allocatable :: torque(:)        !! [N m], [grid]
    logical, allocatable :: is_balanced(:)    !! whether the torques along the other speeds balance, [grid]
    real(wp), allocatable :: speeds(:, :)     !! the speeds of the block [rad/s], [speeds, grid]
  end type scan_t

contains

  !> Finds the solutions of every block.
  subroutine search_balance(balance, blocks)
    type(torque_balance_t), target, intent(inout) :: balance
    type(block_solutions_t), allocatable, intent(out) :: blocks(:)
    type(eliminated_balance_t) :: reduced
    integer :: block_of(balance%unknowns()), i, k, member

    block_of = balance%blocks()
    allocate (blocks(count(block_of == [(i, i=1, size(block_of))])))
    k = 0
    do i = 1, size(block_of)
      if (block_of(i) /= i) cycle
      k = k + 1
      blocks(k)%members = pack([(member, member=1, size(block_of))], block_of == i)
      allocate (blocks(k)%values(size(blocks(k)%members), 0), blocks(k)%is_range(0))
      call new_eliminated_balance(balance, blocks(k)%members, reduced)
      if (size(reduced%speeds) > 0) then
        call scan_along(reduced, blocks(k))
      else
        call balance%settle(reduced%z)
        call add_if_balanced(balance, reduced%z, .false., blocks(k))
      end if
      if (.not. blocks(k)%is_complete) call search_from_starts(reduced, blocks(k))
    end do
  end subroutine search_balance

  !> Scans a speed; if others are not determined by it, upwards and downwards, and the others likewise, as they follow from where
  !> they have been.
  subroutine scan_along(reduced, block)
    type(eliminated_balance_t), intent(inout) :: reduced
    type(block_solutions_t), intent(inout) :: block
    integer, parameter :: most_choices = 4
    type(eliminated_balance_t) :: other
    integer :: choice

    call scan(reduced, .false., block)
    block%is_complete = reduced%choices == 1
    if (block%is_complete) return
    call scan(reduced, .true., block)
    do choice = 2, min(most_choices, reduced%choices)
      call new_eliminated_balance(reduced%balance, block%members, other, choice)
      call scan(other, .false., block)
      call scan(other, .true., block)
    end do
  end subroutine scan_along

  !> Finds all values of the speed that is set at which the torque changes its sign.
  subroutine scan(reduced, is_downwards, block)
    type(eliminated_balance_t), intent(inout) :: reduced
    logical, intent(in) :: is_downwards   !! whether it begins at the highest speed
    type(block_solutions_t), intent(inout) :: block
    real(wp), parameter :: equal = 1.0e-9_wp   ! relative difference
    integer, parameter :: points_alone = 100, points = 25   ! per decade; of a speed alone, or with others to be found
    integer, parameter :: few_points = 5   ! with two others or more beside joints, whose sets are scanned one after the other
    type(scan_t) :: found
    real(wp) :: start, unit(size(reduced%balance%motions%free)), least
    integer :: density, i, k

    start = dot_product(reduced%row, reduced%z(reduced%speeds))
    unit = 0.0_wp
    unit(reduced%speeds) = reduced%basis(:, 1)
    density = merge(points_alone, points, size(reduced%speeds) == 1)
    if (size(reduced%speeds) > 2 .and. reduced%balance%joints%count > 0) density = few_points
    allocate (found%grid, source=new_speed_grid(density, 1.0_wp / maxval(abs(reduced%balance%body_speeds(unit))), reduced%knees))
    allocate (found%torque(size(found%grid)), found%is_balanced(size(found%grid)))
    allocate (found%speeds(size(reduced%speeds), size(found%grid)))
    do k = 1, size(found%grid)
      i = merge(size(found%grid) + 1 - k, k, is_downwards)
      call reduced%solve(found%grid(i))
      found%torque(i) = reduced%torque
      found%is_balanced(i) = reduced%is_balanced
      found%speeds(:, i) = reduced%z(reduced%speeds)
    end do
    if (any(found%is_balanced)) then
      ! the smallest imbalance of a scan; of equal ones that at the lowest speed
      least = minval(abs(found%torque), mask=found%is_balanced)
      i = minloc(abs(found%grid), dim=1, mask=found%is_balanced .and. abs(found%torque) <= (1.0_wp + equal) * least)
      block%least_torque = found%torque(i)
      block%least_speed = found%grid(i)
      block%is_level = maxval(abs(found%torque - found%torque(i)), mask=found%is_balanced) <= equal * least
    end if
    block%is_unloaded = all(abs(found%torque) <= 0.0_wp .and. found%is_balanced)
    do i = 1, merge(1, size(found%grid), block%is_unloaded)
      if (.not. found%is_balanced(i)) cycle
      reduced%z(reduced%speeds) = found%speeds(:, i)
      call search_interval(reduced, found, i, start, block)
    end do
    block%is_range = block%is_range .and. .not. block%is_unloaded
  end subroutine scan

  !> Finds the solutions between a point of the grid and the next, and near a minimum at the point.
  subroutine search_interval(reduced, found, i, start, block)
    type(eliminated_balance_t), intent(inout) :: reduced
    type(scan_t), intent(in) :: found
    integer, intent(in) :: i          !! point of the grid
    real(wp), intent(in) :: start     !! the speed at the start [rad/s]
    type(block_solutions_t), intent(inout) :: block
    real(wp) :: middle, top

    associate (grid => found%grid, torque => found%torque)
      if (abs(torque(i)) <= 0.0_wp) then
        call add_range(reduced, found, i, start, block)
      else if (i < size(grid)) then
        if (.not. found%is_balanced(i + 1)) return
        if (abs(torque(i + 1)) > 0.0_wp .and. .not. have_same_sign(torque(i), torque(i + 1))) then
          call solve_bracketed(reduced, grid(i:i + 1), torque(i:i + 1), block)
        else if (i > 1) then
          if (.not. (found%is_balanced(i - 1) .and. is_local_minimum(torque(max(1, i - 1):i + 1)))) return
          call minimise_torque(reduced, grid(i - 1), grid(i + 1), middle, top)
          if (have_same_sign(top, torque(i))) return
          call solve_bracketed(reduced, [grid(i - 1), middle], [torque(i - 1), top], block)
          call solve_bracketed(reduced, [middle, grid(i + 1)], [top, torque(i + 1)], block)
        end if
      end if
    end associate
  end subroutine search_interval

  !> Adds a point of the grid at which the torques balance, or, of a range that begins there, the speed nearest to `start`.
  subroutine add_range(reduced, found, i, start, block)
    type(eliminated_balance_t), intent(inout) :: reduced
    type(scan_t), intent(in) :: found
    integer, intent(in) :: i        !! point of the grid
    real(wp), intent(in) :: start   !! the speed at the start [rad/s]
    type(block_solutions_t), intent(inout) :: block
    integer :: last

    associate (is_zero => abs(found%torque) <= 0.0_wp .and. found%is_balanced)
      if (any(is_zero(max(1, i - 1):i - 1))) return
      last = i - 1 + findloc([is_zero(i + 1:), .false.], .false., dim=1)
    end associate
    call reduced%solve(max(found%grid(i), min(start, found%grid(last))))
    call add_if_balanced(reduced%balance, reduced%z, last > i, block)
  end subroutine add_range

  !> Whether the middle one of three torques of equal sign is the smallest.
  pure logical function is_local_minimum(torque)
    real(wp), intent(in) :: torque(3)   !! [N m]

    is_local_minimum = have_same_sign(torque(1), torque(2)) .and. have_same_sign(torque(3), torque(2)) .and. &
                       abs(torque(2)) <= abs(torque(1)) .and. abs(torque(2)) <= abs(torque(3))
  end function is_local_minimum

  !> Smallest torque between two speeds, by golden sections, until its sign changes or the interval is very small.
  subroutine minimise_torque(reduced, left, right, middle, torque)
    type(eliminated_balance_t), intent(inout) :: reduced
    real(wp), intent(in) :: left, right       !! [rad/s]
    real(wp), intent(out) :: middle, torque   !! speed [rad/s] and torque [N m] there
    real(wp), parameter :: golden = 0.6180339887498949_wp
    integer, parameter :: sections = 40   ! after 37 the torque at a minimum changes by rounding only
    real(wp) :: a, b, inside(2), value(2), sign_outside
    integer :: i

    a = left
    b = right
    sign_outside = sign(1.0_wp, imbalance(reduced, left))
    inside = [b - golden * (b - a), a + golden * (b - a)]
    value = [(imbalance(reduced, inside(i)), i=1, 2)]
    do i = 1, sections
      if (any(value * sign_outside <= 0.0_wp)) exit
      if (abs(value(1)) < abs(value(2))) then
        b = inside(2)
        inside = [b - golden * (b - a), inside(1)]
        value = [imbalance(reduced, inside(1)), value(1)]
      else
        a = inside(1)
        inside = [inside(2), a + golden * (b - a)]
        value = [value(2), imbalance(reduced, inside(2))]
      end if
    end do
    i = merge(1, 2, value(1) * sign_outside < value(2) * sign_outside)
    middle = inside(i)
    torque = value(i)
  end subroutine minimise_torque

  !> Torque left over at a speed [N m].
  real(wp) function imbalance(reduced, speed) result(torque)
    type(eliminated_balance_t), intent(inout) :: reduced
    real(wp), intent(in) :: speed   !! [rad/s]

    call reduced%solve(speed)
    torque = reduced%torque
  end function imbalance

  !> Adds the root between two speeds with torques of different sign. At a jump of the torque, as at the speed of a governor, the
  !> internal states are between those on its sides.
  subroutine solve_bracketed(reduced, speeds, torques, block)
    type(eliminated_balance_t), intent(inout) :: reduced
    real(wp), intent(in) :: speeds(2), torques(2)   !! [rad/s], [N m]
    type(block_solutions_t), intent(inout) :: block
    type(bracket_t) :: bracket
    real(wp) :: share, x, z(size(reduced%z))

    bracket = new_bracket(speeds, torques)
    do while (.not. bracket%is_narrow())
      x = bracket%next()
      call bracket%narrow(x, imbalance(reduced, x))
    end do
    call reduced%solve(bracket%x(1))
    z = reduced%z
    if (abs(bracket%value(1)) > 0.0_wp) then
      call reduced%solve(bracket%x(2))
      share = bracket%value(1) / (bracket%value(1) - bracket%value(2))
      z = z + share * (reduced%z - z)
    end if
    call add_if_balanced(reduced%balance, z, .false., block)
  end subroutine solve_bracketed

  !> Adds a solution, unless it is none: where a law jumps over zero.
  subroutine add_if_balanced(balance, z, is_range, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)       !! [unknowns]
    logical, intent(in) :: is_range    !! whether it represents a range of solutions
    type(block_solutions_t), intent(inout) :: block

    if (is_nearly_balanced(balance, block%members, z)) call block%add(z(block%members), is_range)
  end subroutine add_if_balanced

end module nocdyn_balance_search
