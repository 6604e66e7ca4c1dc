!> Search for the speeds at which the torques on a machine balance.
!>
!> Unknowns without common equations are searched for separately. A single speed is searched for over its whole range: every
!> change of sign of the torque on a grid is refined, and every pair of changes between two points of the grid.
!> Several unknowns are searched for by Newton's method from many starts.
module nocdyn_balance_search
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: search_balance

  integer, parameter :: decades = 6              ! speeds of the fastest body from 1e-6 to 1e6 rad/s, in both directions
  integer, parameter :: points_per_decade = 100
  integer, parameter :: most_solutions = 64      ! of a block
  real(wp), parameter :: rounding = 8 * epsilon(1.0_wp)   ! a sum below this share of its terms is zero
  real(wp), parameter :: same = 1.0e-7_wp        ! relative distance below which two solutions are one

  !> All solutions of one block of unknowns, and the smallest imbalance for the message if there is none.
  type, public :: block_solutions_t
    integer, allocatable :: members(:)        !! unknowns
    real(wp), allocatable :: values(:, :)     !! [members, solutions]
    logical, allocatable :: is_range(:)       !! whether a solution represents a range of solutions, [solutions]
    logical :: is_unloaded = .false.          !! no torque acts: any speed is steady, and that of the start is taken
    real(wp) :: least_torque = huge(1.0_wp)   !! smallest imbalance found, with its sign [N m]
    real(wp) :: least_speed = 0.0_wp          !! speed of the smallest imbalance [rad/s]
  end type block_solutions_t

contains

  !> Finds the solutions of every block.
  subroutine search_balance(balance, blocks)
    type(torque_balance_t), intent(inout) :: balance
    type(block_solutions_t), allocatable, intent(out) :: blocks(:)
    integer :: block_of(balance%unknowns()), i, k, member
    real(wp) :: z(balance%unknowns())

    block_of = balance%blocks()
    z = balance%start()
    allocate (blocks(count(block_of == [(i, i=1, size(block_of))])))
    k = 0
    do i = 1, size(block_of)
      if (block_of(i) /= i) cycle
      k = k + 1
      blocks(k)%members = pack([(member, member=1, size(block_of))], block_of == i)
      allocate (blocks(k)%values(size(blocks(k)%members), 0), blocks(k)%is_range(0))
      if (size(blocks(k)%members) == 1 .and. i <= balance%motions%freedoms()) then
        call scan(balance, z, blocks(k))
      else
        call search_from_starts(balance, z, blocks(k))
      end if
    end do
  end subroutine search_balance

  !> Finds all speeds of a single rigid motion at which the torque changes its sign.
  subroutine scan(balance, z, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)   !! the other unknowns, [unknowns]
    type(block_solutions_t), intent(inout) :: block
    real(wp), dimension(4 * decades * points_per_decade + 3) :: grid, torque
    integer :: i

    call fill_speed_grid(balance, block%members(1), grid)
    do i = 1, size(grid)
      torque(i) = imbalance(balance, z, block%members(1), grid(i))
      if (abs(torque(i)) < abs(block%least_torque)) then
        block%least_torque = torque(i)
        block%least_speed = grid(i)
      end if
    end do
    block%is_unloaded = all(abs(torque) <= 0.0_wp)
    if (block%is_unloaded) then
      call add(z(block%members), block)
      return
    end if
    do i = 1, size(grid)
      call search_interval(balance, z, grid, torque, i, block)
    end do
  end subroutine scan

  !> Speeds of a rigid motion that grow geometrically on both sides of zero.
  subroutine fill_speed_grid(balance, freedom, grid)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: freedom
    real(wp), intent(out) :: grid(:)   !! [rad/s]
    real(wp) :: unit(balance%motions%freedoms()), fastest
    integer :: i, middle

    unit = 0.0_wp
    unit(freedom) = 1.0_wp
    fastest = maxval(abs(balance%body_speeds(unit)))
    middle = (size(grid) + 1) / 2
    grid(middle) = 0.0_wp
    do i = 1, middle - 1
      grid(middle + i) = 10.0_wp**(real(i - 1, wp) / points_per_decade - decades) / fastest
      grid(middle - i) = -grid(middle + i)
    end do
  end subroutine fill_speed_grid

  !> Finds the solutions between a point of the grid and the next, and near a minimum at the point.
  subroutine search_interval(balance, z, grid, torque, i, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)                 !! the other unknowns, [unknowns]
    real(wp), intent(in) :: grid(:), torque(:)   !! [rad/s], [N m]
    integer, intent(in) :: i                     !! point of the grid
    type(block_solutions_t), intent(inout) :: block
    real(wp) :: middle, top

    associate (member => block%members(1))
      if (abs(torque(i)) <= 0.0_wp) then
        call add_range(z(member), grid, torque, i, block)
      else if (i < size(grid)) then
        if (torque(i) * torque(i + 1) < 0.0_wp) then
          call solve_bracketed(balance, z, grid(i), grid(i + 1), torque(i), block)
        else if (i > 1) then
          if (.not. is_local_minimum(torque(i - 1:i + 1))) return
          call minimise_torque(balance, z, member, grid(i - 1), grid(i + 1), middle, top)
          if (abs(top) <= 0.0_wp) then
            call add([middle], block)
          else if (top * torque(i) < 0.0_wp) then
            call solve_bracketed(balance, z, grid(i - 1), middle, torque(i - 1), block)
            call solve_bracketed(balance, z, middle, grid(i + 1), top, block)
          end if
        end if
      end if
    end associate
  end subroutine search_interval

  !> Adds a point of the grid at which the torques balance, or, of a range that begins there, the speed nearest to `start`.
  subroutine add_range(start, grid, torque, i, block)
    real(wp), intent(in) :: start                !! [rad/s]
    real(wp), intent(in) :: grid(:), torque(:)   !! [rad/s], [N m]
    integer, intent(in) :: i                     !! point of the grid
    type(block_solutions_t), intent(inout) :: block
    integer :: last

    if (any(abs(torque(max(1, i - 1):i - 1)) <= 0.0_wp)) return
    do last = i, size(grid) - 1
      if (abs(torque(last + 1)) > 0.0_wp) exit
    end do
    call add([max(grid(i), min(start, grid(last)))], block)
    if (last > i) block%is_range(size(block%is_range)) = .true.
  end subroutine add_range

  !> Whether the middle one of three torques of equal sign is the smallest.
  pure logical function is_local_minimum(torque)
    real(wp), intent(in) :: torque(3)   !! [N m]

    is_local_minimum = torque(1) * torque(2) > 0.0_wp .and. torque(3) * torque(2) > 0.0_wp .and. &
             abs(torque(2)) <= abs(torque(1)) .and. abs(torque(2)) <= abs(torque(3))
  end function is_local_minimum

  !> Torque along a rigid motion at a speed; zero if it is rounding.
  real(wp) function imbalance(balance, z, member, speed) result(torque)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)    !! the other unknowns, [unknowns]
    integer, intent(in) :: member   !! number of the rigid motion
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp) :: point(size(z))

    point = z
    point(member) = speed
    call balance%evaluate(point)
    torque = balance%residual(member)
    if (abs(torque) <= rounding * balance%scale(member)) torque = 0.0_wp
  end function imbalance

  !> Smallest torque between two speeds, by golden sections, until its sign changes or the interval is very small.
  subroutine minimise_torque(balance, z, member, left, right, middle, torque)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)              !! the other unknowns, [unknowns]
    integer, intent(in) :: member             !! number of the rigid motion
    real(wp), intent(in) :: left, right       !! [rad/s]
    real(wp), intent(out) :: middle, torque   !! speed [rad/s] and torque [N m] there
    real(wp), parameter :: golden = 0.6180339887498949_wp
    integer, parameter :: sections = 40   ! after 37 the torque at a minimum changes by rounding only
    real(wp) :: a, b, inside(2), value(2), sign_outside
    integer :: i

    a = left
    b = right
    sign_outside = imbalance(balance, z, member, left)
    inside = [b - golden * (b - a), a + golden * (b - a)]
    value = [(imbalance(balance, z, member, inside(i)), i=1, 2)]
    do i = 1, sections
      if (any(value * sign_outside <= 0.0_wp)) exit
      if (abs(value(1)) < abs(value(2))) then
        b = inside(2)
        inside = [b - golden * (b - a), inside(1)]
        value = [imbalance(balance, z, member, inside(1)), value(1)]
      else
        a = inside(1)
        inside = [inside(2), a + golden * (b - a)]
        value = [value(2), imbalance(balance, z, member, inside(2))]
      end if
    end do
    i = merge(1, 2, value(1) * sign_outside < value(2) * sign_outside)
    middle = inside(i)
    torque = value(i)
  end subroutine minimise_torque

  !> Adds the root between two speeds with torques of different sign: Newton's method, with bisection outside of the bracket.
  subroutine solve_bracketed(balance, z, left, right, left_torque, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)                       !! the other unknowns, [unknowns]
    real(wp), intent(in) :: left, right, left_torque   !! [rad/s], torque at `left` [N m]
    type(block_solutions_t), intent(inout) :: block
    integer, parameter :: most_steps = 200
    real(wp) :: a, b, slopes(size(z), size(z)), speed, step, torque
    integer :: i

    associate (member => block%members(1))
      a = left
      b = right
      speed = 0.5_wp * (a + b)
      do i = 1, most_steps
        torque = imbalance(balance, z, member, speed)
        if (abs(torque) <= 0.0_wp) exit
        if (torque * left_torque > 0.0_wp) then
          a = speed
        else
          b = speed
        end if
        call balance%differentiate(slopes)
        step = 0.0_wp
        if (abs(slopes(member, member)) > 0.0_wp) step = -torque / slopes(member, member)
        if (abs(slopes(member, member)) <= 0.0_wp .or. speed + step <= a .or. speed + step >= b) step = 0.5_wp * (a + b) - speed
        speed = speed + step
        if (abs(step) <= spacing(speed)) exit
      end do
      call add([speed], block)
    end associate
  end subroutine solve_bracketed

  !> Adds a solution, unless the list has it.
  subroutine add(values, block)
    real(wp), intent(in) :: values(:)   !! [members of the block]
    type(block_solutions_t), intent(inout) :: block
    integer :: i

    do i = 1, size(block%values, 2)
      if (is_same(values, block%values(:, i))) return
    end do
    if (size(block%values, 2) < most_solutions) then
      block%values = reshape([block%values, values], [size(values), size(block%values, 2) + 1])
      block%is_range = [block%is_range, .false.]
    end if
  end subroutine add

  !> Newton's method from the start of the machine and from many speeds of single and of all rigid motions.
  subroutine search_from_starts(balance, z, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)   !! start of the machine, [unknowns]
    type(block_solutions_t), intent(inout) :: block
    real(wp), parameter :: speeds(9) = [0.0_wp, 1.0_wp, -1.0_wp, 10.0_wp, -10.0_wp, 100.0_wp, -100.0_wp, 1000.0_wp, -1000.0_wp]
    real(wp) :: point(size(z))
    integer :: i, j, moving

    associate (members => block%members)
      moving = count(members <= balance%motions%freedoms())
      point = z
      call newton(balance, point, block)
      do i = 1, size(speeds)
        do j = 1, merge(size(speeds), 1, moving > 1)
          point = z
          point(members(:moving)) = speeds(i)
          if (moving > 0) point(members(1)) = speeds(merge(j, i, moving > 1))
          call newton(balance, point, block)
        end do
      end do
    end associate
  end subroutine search_from_starts

  !> Newton's method with steps of minimum norm, halved until the residuals fall. Adds the solution if it converges.
  subroutine newton(balance, z, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(inout) :: z(:)   !! start, then the last iterate, [unknowns]
    type(block_solutions_t), intent(inout) :: block
    integer, parameter :: most_steps = 100
    real(wp), parameter :: singular = 1.0e-13_wp, tiny_step = 1.0e-13_wp
    real(wp) :: slopes(size(z), size(z)), step(size(block%members)), weight(size(block%members)), before, factor
    integer :: i

    associate (members => block%members)
      call balance%evaluate(z)
      do i = 1, most_steps
        if (all(abs(balance%residual(members)) <= epsilon(1.0_wp) * balance%scale(members))) exit   ! zero up to the last bit
        call balance%differentiate(slopes)
        weight = 1.0_wp / max(maxval(abs(slopes(members, members)), dim=2), tiny(1.0_wp)**0.25_wp)
        before = norm2(weight * balance%residual(members))
        step = -matmul(pseudo_inverse(spread(weight, 2, size(members)) * slopes(members, members), singular), &
                       weight * balance%residual(members))
        factor = 1.0_wp
        do while (factor > 1.0e-6_wp)
          call balance%evaluate(moved(z, members, factor * step))
          if (norm2(weight * balance%residual(members)) < (1.0_wp - 1.0e-4_wp * factor) * before) exit
          factor = 0.5_wp * factor
        end do
        if (factor <= 1.0e-6_wp) exit
        z(members) = z(members) + factor * step
        if (all(abs(step) <= tiny_step * abs(z(members)))) exit
      end do
      call balance%evaluate(z)
      if (is_nearly_balanced(balance, members)) call add_or_join(balance, z, block)
      call balance%evaluate(z)
      if (abs(balance%residual(members(1))) < abs(block%least_torque)) then
        block%least_torque = balance%residual(members(1))
        block%least_speed = z(members(1))
      end if
    end associate
  end subroutine newton

  !> Adds a solution, unless a range of solutions leads from it to one in the list.
  subroutine add_or_join(balance, z, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)   !! [unknowns]
    type(block_solutions_t), intent(inout) :: block
    integer :: i

    do i = 1, size(block%values, 2)
      if (.not. is_joined(balance, z, block%members, block%values(:, i))) cycle
      if (.not. is_same(z(block%members), block%values(:, i))) block%is_range(i) = .true.
      return
    end do
    call add(z(block%members), block)
  end subroutine add_or_join

  !> Whether the torques balance on the whole way between two solutions, at some points of it.
  logical function is_joined(balance, z, members, other)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)        !! [unknowns]
    integer, intent(in) :: members(:)   !! unknowns of the block
    real(wp), intent(in) :: other(:)    !! [members]
    integer, parameter :: intervals = 8
    integer :: i

    is_joined = is_same(z(members), other)
    if (is_joined) return
    do i = 1, intervals - 1
      call balance%evaluate(moved(z, members, real(i, wp) / intervals * (other - z(members))))
      if (.not. is_nearly_balanced(balance, members)) return
    end do
    is_joined = .true.
  end function is_joined

  !> Whether two solutions are equal up to `same`.
  pure logical function is_same(one, other)
    real(wp), intent(in) :: one(:), other(:)   !! [members of the block]

    is_same = all(abs(one - other) <= same * max(abs(one), abs(other), same))
  end function is_same

  !> The unknowns after a step of some of them.
  pure function moved(z, members, step)
    real(wp), intent(in) :: z(:), step(:)   !! [unknowns], [members]
    integer, intent(in) :: members(:)       !! unknowns of the block
    real(wp) :: moved(size(z))

    moved = z
    moved(members) = moved(members) + step
  end function moved

  !> Whether the residuals are rounding, so that Newton's method has ended at a root.
  pure logical function is_nearly_balanced(balance, members)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: members(:)   !! unknowns of the block
    real(wp), parameter :: near = 1.0e-10_wp

    is_nearly_balanced = all(abs(balance%residual(members)) <= &
                             near * merge(balance%scale(members), 1.0_wp, members <= balance%motions%freedoms()))
  end function is_nearly_balanced

end module nocdyn_balance_search
