!> The torque balance of speeds that depend on each other, with all of them but one eliminated.
!>
!> Most torques never rise with their speed: the ones of loads, of slipping couplings, of motors with a falling curve. They are
!> the gradient of a concave function of the speeds. So one speed is set, which is the one of the elements whose torques rise
!> somewhere, or jump; the others follow, and what is left over along the first speed is a function of it alone. Where elements
!> with rising torques have speeds of their own, the speeds that follow need not be the only ones.
!>
!> Internal states are those that do not change at the speeds.
module nocdyn_eliminated_balance
  use nocdyn_brackets, only: bracket_t, have_same_sign, new_bracket
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse, sort_ascending
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: new_eliminated_balance, new_speed_grid

  real(wp), parameter :: rounding = 8 * epsilon(1.0_wp)   ! a sum below this share of its terms is zero
  real(wp), parameter :: tight = 1.0e-13_wp, loose = 1.0e-9_wp   ! shares below which torques balance: the aim, and what serves

  integer, parameter :: decades = 6            ! from 1e-6 to 1e6 rad/s, in both directions
  integer, parameter :: knee_decades = 8       ! distances from a knee, down to 1e-8 of its speed
  integer, parameter :: knee_points = 6        ! per decade
  integer, parameter :: most_dense_knees = 30  ! of more, only the knees themselves are added

  !> Knees of the elements whose torques rise somewhere, or jump, and whose speed is the one of a column of the basis.
  type, public :: rising_speed_t
    real(wp), allocatable :: knees(:)   !! [rad/s]
  end type rising_speed_t

  !> The balance of one block of unknowns.
  type, public :: eliminated_balance_t
    type(torque_balance_t), pointer :: balance => null()   !! of the machine
    integer, allocatable :: speeds(:)      !! unknowns that are speeds of rigid motions
    real(wp), allocatable :: row(:)        !! the speed that is set = sum of row * speeds, [speeds]
    real(wp), allocatable :: basis(:, :)   !! speeds = basis (the speed that is set, the others), [speeds, speeds]
    real(wp), allocatable :: knees(:)      !! values of the speed that is set at which a law bends [rad/s]
    integer :: choices = 1                 !! speeds with rising torques; of one, the other speeds are determined by it
    type(rising_speed_t), allocatable :: rising(:)   !! for each column of the basis
    real(wp), allocatable :: z(:)          !! all unknowns; the ones of the block after `solve`
    real(wp) :: torque = 0.0_wp            !! left over along the speed that is set, 0 if it is rounding, after `solve` [N m]
    logical :: is_balanced = .true.        !! whether the torques along the other speeds balance, after `solve`
    real(wp), private :: reach = 0.0_wp    !! how far another speed moved last [rad/s]
  contains
    procedure :: solve
    procedure, private :: torque_along
  end type eliminated_balance_t

contains

  !> The balance of a block of unknowns.
  subroutine new_eliminated_balance(balance, members, self, choice)
    type(torque_balance_t), target, intent(inout) :: balance
    integer, intent(in) :: members(:)   !! unknowns of the block
    type(eliminated_balance_t), intent(out) :: self
    integer, intent(in), optional :: choice   !! number of the speed to be set, 1 to `choices`; absent: 1
    integer, allocatable :: elements(:)   ! the ones of the block, numbered among the inelastic ones
    real(wp), allocatable :: rows(:, :)   ! their speeds by the ones of the block, [elements, speeds]
    logical, allocatable :: rises(:)
    integer, allocatable :: choices(:)
    integer :: e, i

    self%balance => balance
    self%speeds = pack(members, members <= size(balance%motions%free))
    allocate (self%z, source=balance%start())
    allocate (self%knees(0), self%basis(size(self%speeds), size(self%speeds)))
    allocate (self%row(size(self%speeds)), source=0.0_wp)
    if (size(self%speeds) == 0) return
    call gather_rows(balance, self%speeds, elements, rows)
    allocate (rises(size(elements)), source=.false.)
    if (size(self%speeds) > 1) call find_rising_laws(balance, elements, rises)
    rises = rises .and. maxval(abs(rows), dim=2) > 0.0_wp
    self%row(1) = 1.0_wp
    if (any(rises)) then
      ! the elements with rising torques that have speeds of their own
      allocate (choices(0))
      do e = 1, size(rises)
        if (.not. rises(e)) cycle
        if (.not. any([(is_parallel(rows(e, :), rows(choices(i), :)), i=1, size(choices))])) choices = [choices, e]
      end do
      self%choices = size(choices)
      i = 1
      if (present(choice)) i = choice
      self%row = rows(choices(i), :)
    end if
    call set_basis(self%row, self%basis)
    do e = 1, size(elements)
      self%knees = [self%knees, knees_along(self, element_knees(balance, elements(e)) - balance%driven(elements(e)), rows(e, :))]
    end do
    call collect_rising(self, pack(elements, rises), rows(pack([(e, e=1, size(rises))], rises), :))
  end subroutine new_eliminated_balance

  !> Collects the speeds of the elements whose torques rise, in which the solutions may be several.
  subroutine collect_rising(self, elements, rows)
    type(eliminated_balance_t), intent(inout) :: self
    integer, intent(in) :: elements(:)   !! those whose torques rise, numbered among the inelastic ones
    real(wp), intent(in) :: rows(:, :)   !! their speeds by the ones of the block, [elements, speeds]
    real(wp) :: ratios(size(self%speeds))
    integer :: e, k

    allocate (self%rising(size(self%speeds)))
    do k = 1, size(self%speeds)
      allocate (self%rising(k)%knees(0))
      do e = 1, size(elements)
        ratios = matmul(rows(e, :), self%basis)
        if (count(abs(ratios) > 0.0_wp) /= 1 .or. abs(ratios(k)) <= 0.0_wp) cycle
        self%rising(k)%knees = [self%rising(k)%knees, (element_knees(self%balance, elements(e)) &
                                                       - self%balance%driven(elements(e))) / ratios(k)]
      end do
    end do
  end subroutine collect_rising

  !> The inelastic elements whose speeds depend on the ones of a block.
  subroutine gather_rows(balance, speeds, elements, rows)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: speeds(:)                       !! unknowns
    integer, allocatable, intent(out) :: elements(:)       !! numbered among the inelastic ones
    real(wp), allocatable, intent(out) :: rows(:, :)       !! their speeds by the ones of the block, [elements, speeds]
    integer :: column_of(size(balance%motions%free))
    integer :: e, i, k

    column_of = 0
    column_of(speeds) = [(i, i=1, size(speeds))]
    associate (first => balance%first, freedom => balance%freedom)
      ! all speeds of an element belong to one block
      elements = pack([(e, e=1, size(first) - 1)], [(any(column_of(freedom(first(e):first(e + 1) - 1)) > 0), &
                                                     e=1, size(first) - 1)])
      allocate (rows(size(elements), size(speeds)), source=0.0_wp)
      do e = 1, size(elements)
        do k = first(elements(e)), first(elements(e) + 1) - 1
          rows(e, column_of(freedom(k))) = balance%ratio(k)
        end do
      end do
    end associate
  end subroutine gather_rows

  !> Finds the elements whose torques rise somewhere with the speed, or jump. The ones of friction jump downwards only.
  subroutine find_rising_laws(balance, elements, rises)
    type(torque_balance_t), intent(inout) :: balance
    integer, intent(in) :: elements(:)   !! numbered among the inelastic ones
    logical, intent(inout) :: rises(:)   !! [elements]
    integer, parameter :: points_per_decade = 10
    real(wp), parameter :: jump = 1.0e-3_wp, near = 1.0e-7_wp   ! change of the torque within one of the speed, both relative
    real(wp), parameter :: level = 1.0e-12_wp                   ! relative change that is rounding
    real(wp), allocatable :: grid(:), knees(:), torques(:, :)
    real(wp) :: moments(size(balance%inelastic)), change(size(elements)), scale(size(elements))
    logical :: is_friction(size(elements))
    integer :: e, k

    is_friction = [(any(balance%joints%element == balance%inelastic(elements(e))), e=1, size(elements))]
    allocate (knees(0))
    do e = 1, size(elements)
      knees = [knees, element_knees(balance, elements(e))]
    end do
    allocate (grid, source=new_speed_grid(points_per_decade, 1.0_wp, knees))
    allocate (torques(size(elements), size(grid)))
    do k = 1, size(grid)
      moments = balance%moments_at(grid(k))
      torques(:, k) = moments(elements)
    end do
    do k = 2, size(grid)
      change = torques(:, k) - torques(:, k - 1)
      rises = rises .or. change > level * max(abs(torques(:, k)), abs(torques(:, k - 1)))
      if (grid(k) - grid(k - 1) > near * abs(grid(k))) cycle
      scale = maxval(abs(torques), dim=2, mask=spread(abs(grid) <= 2.0_wp * abs(grid(k)), 1, size(elements)))
      rises = rises .or. (abs(change) > jump * scale .and. .not. is_friction)
    end do
  end subroutine find_rising_laws

  !> Speeds at which the law of an element bends [rad/s].
  function element_knees(balance, element) result(knees)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: element   !! numbered among the inelastic ones
    real(wp), allocatable :: knees(:)
    integer :: i

    allocate (knees(0))
    associate (banks => balance%formulation%machine%banks, number => balance%inelastic(element))
      do i = 1, size(banks)
        if (number > banks(i)%bank%last()) cycle
        knees = banks(i)%bank%knees(number - banks(i)%bank%first + 1, balance%t(1))
        return
      end do
    end associate
  end function element_knees

  !> Knees of an element as values of the speed that is set; exact if its speed depends on no other.
  pure function knees_along(self, knees, row) result(speeds)
    type(eliminated_balance_t), intent(in) :: self
    real(wp), intent(in) :: knees(:)   !! of the element [rad/s]
    real(wp), intent(in) :: row(:)     !! its speed by the ones of the block, [speeds]
    real(wp), allocatable :: speeds(:)
    real(wp) :: ratio

    ratio = dot_product(row, self%basis(:, 1))
    if (abs(ratio) <= 0.0_wp) ratio = maxval(abs(row)) * maxval(abs(self%basis(:, 1)))
    allocate (speeds, source=knees / merge(ratio, 1.0_wp, abs(ratio) > 0.0_wp))
  end function knees_along

  !> The speeds of a block from one combination of them, the sum of row * speeds, and all but one of them.
  pure subroutine set_basis(row, basis)
    real(wp), intent(in) :: row(:)         !! [speeds]
    real(wp), intent(out) :: basis(:, :)   !! [speeds, speeds]
    integer :: i, k, pivot

    pivot = maxloc(abs(row), dim=1)
    basis = 0.0_wp
    basis(pivot, 1) = 1.0_wp / row(pivot)
    k = 1
    do i = 1, size(row)
      if (i == pivot) cycle
      k = k + 1
      basis(i, k) = 1.0_wp
      basis(pivot, k) = -row(i) / row(pivot)
    end do
  end subroutine set_basis

  pure logical function is_parallel(one, other)
    real(wp), intent(in) :: one(:), other(:)
    real(wp), parameter :: near = 1.0e-10_wp
    real(wp) :: norms

    norms = sum(one**2) * sum(other**2)
    is_parallel = norms - dot_product(one, other)**2 <= near * norms
  end function is_parallel

  !> Sets the first speed and finds the others, from the ones of the last call.
  subroutine solve(self, speed, holds_rising)
    class(eliminated_balance_t), intent(inout) :: self
    real(wp), intent(in) :: speed   !! to be set [rad/s]
    logical, intent(in), optional :: holds_rising   !! whether other speeds with rising torques stay; absent: .false.
    integer, parameter :: most_cycles = 20
    integer :: k, number
    logical :: holds

    self%is_balanced = .true.
    holds = .false.
    if (present(holds_rising)) holds = holds_rising
    associate (pivot => maxloc(abs(self%row), dim=1), others => self%z(self%speeds))
      ! the speed and nothing else decides: a difference to the last one would keep its rounding
      self%z(self%speeds(pivot)) = (speed - dot_product(self%row(:pivot - 1), others(:pivot - 1)) &
                                    - dot_product(self%row(pivot + 1:), others(pivot + 1:))) / self%row(pivot)
    end associate
    do number = 1, most_cycles
      do k = 2, size(self%speeds)
        if (holds .and. size(self%rising(k)%knees) > 0) cycle
        call balance_along(self, self%basis(:, k))
        if (.not. self%is_balanced) exit
      end do
      self%torque = self%torque_along(self%basis(:, 1))
      if (size(self%speeds) <= 2 .or. holds .or. .not. self%is_balanced) return
      if (others_balance(self, tight)) return
      call balance_along(self, newton_direction(self))
    end do
    self%is_balanced = others_balance(self, loose)
  end subroutine solve

  !> Torque along a motion of the block at the unknowns [N m]; zero if it is rounding.
  real(wp) function torque_along(self, direction) result(torque)
    class(eliminated_balance_t), intent(inout) :: self
    real(wp), intent(in) :: direction(:)   !! [speeds]

    call self%balance%settle(self%z)
    call self%balance%evaluate(self%z)
    torque = dot_product(direction, self%balance%residual(self%speeds))
    if (abs(torque) <= rounding * dot_product(abs(direction), self%balance%scale(self%speeds))) torque = 0.0_wp
  end function torque_along

  !> Moves the speeds along a motion to where no torque is left over along it. There need be no such place. Again
  !> after a move that was so long that the place has its rounding.
  subroutine balance_along(self, direction)
    type(eliminated_balance_t), intent(inout) :: self
    real(wp), intent(in) :: direction(:)   !! [speeds]
    real(wp) :: origin(size(direction)), unit, x
    integer, parameter :: most_passes = 3
    type(bracket_t) :: bracket
    integer :: pass

    unit = maxval(abs(direction))
    self%is_balanced = unit > 0.0_wp
    do pass = 1, most_passes
      if (.not. self%is_balanced) return
      origin = self%z(self%speeds)
      call enclose(self, origin, direction, bracket)
      if (.not. self%is_balanced) return
      do while (.not. bracket%is_narrow())
        x = bracket%next()
        self%z(self%speeds) = origin + x * direction
        call bracket%narrow(x, self%torque_along(direction))
        if (abs(bracket%x(2) - bracket%x(1)) * unit <= spacing(largest(self%z(self%speeds), direction))) exit
      end do
      self%z(self%speeds) = origin + bracket%root() * direction
      self%reach = abs(bracket%root()) * unit
      if (self%reach <= largest(self%z(self%speeds), direction)) exit
    end do
  end subroutine balance_along

  !> The largest of the speeds that move.
  pure real(wp) function largest(speeds, direction)
    real(wp), intent(in) :: speeds(:), direction(:)   !! [rad/s], a motion

    largest = maxval(abs(speeds), mask=abs(direction) > 0.0_wp)
  end function largest

  !> Encloses the place where the torque along a motion vanishes, in the direction of this torque, as it falls; or, if it may
  !> rise, in the other one.
  subroutine enclose(self, origin, direction, bracket)
    type(eliminated_balance_t), intent(inout) :: self
    real(wp), intent(in) :: origin(:), direction(:)   !! speeds [rad/s], the motion, [speeds]
    type(bracket_t), intent(out) :: bracket
    real(wp), parameter :: highest = 1.0e9_wp, growth = 8.0_wp   ! rad/s
    real(wp) :: first_step, step, torque(2), way(2)
    integer :: trial

    torque(1) = self%torque_along(direction)
    first_step = max(0.3_wp * self%reach, 1.0e-8_wp * maxval(abs(origin)), 1.0e-9_wp) / maxval(abs(direction))
    do trial = 1, merge(1, 2, self%choices == 1)
      way = 0.0_wp
      torque(2) = torque(1)
      step = merge(1, -1, trial == 1) * sign(first_step, torque(1))
      do while (have_same_sign(torque(1), torque(2)) .and. abs(way(2)) * maxval(abs(direction)) < highest)
        way = [way(2), way(2) + step]
        self%z(self%speeds) = origin + way(2) * direction
        torque(2) = self%torque_along(direction)
        step = growth * step
      end do
      if (.not. have_same_sign(torque(1), torque(2))) exit
    end do
    self%is_balanced = .not. have_same_sign(torque(1), torque(2))
    if (self%is_balanced) then
      ! between the last two steps the torque changes its sign; at the first of them it is nearer to zero than at the origin
      self%z(self%speeds) = origin + way(1) * direction
      if (abs(way(1)) > 0.0_wp) torque(1) = self%torque_along(direction)
      bracket = new_bracket(way, torque)
    else
      self%z(self%speeds) = origin
    end if
  end subroutine enclose

  !> Whether the torques along all speeds but the first balance, after `torque_along`.
  logical function others_balance(self, tolerance)
    type(eliminated_balance_t), intent(in) :: self
    real(wp), intent(in) :: tolerance   !! share of the terms
    integer :: k

    associate (balance => self%balance, s => self%speeds)
      others_balance = all([(abs(dot_product(self%basis(:, k), balance%residual(s))) <= &
                             tolerance * dot_product(abs(self%basis(:, k)), balance%scale(s)), k=2, size(s))])
    end associate
  end function others_balance

  !> Newton's step of the speeds that follow, after `torque_along`.
  function newton_direction(self) result(direction)
    type(eliminated_balance_t), intent(in) :: self
    real(wp) :: direction(size(self%speeds))
    real(wp), parameter :: singular = 1.0e-13_wp
    real(wp) :: slopes(size(self%z), size(self%z)), torques(size(self%speeds) - 1)
    real(wp), allocatable :: hessian(:, :)
    integer :: i

    call self%balance%differentiate(slopes)
    associate (others => self%basis(:, 2:), s => self%speeds, x => [(i, i=size(self%balance%motions%free) + 1, size(self%z))])
      torques = matmul(self%balance%residual(s), others)
      allocate (hessian, source=slopes(s, s))
      if (size(x) > 0) hessian = hessian - matmul(slopes(s, x), matmul(pseudo_inverse(slopes(x, x), singular), slopes(x, s)))
      hessian = matmul(transpose(others), matmul(hessian, others))
      direction = matmul(others, -matmul(pseudo_inverse(hessian, singular), torques))
      if (all(abs(direction) <= 0.0_wp)) direction = matmul(others, torques)
    end associate
  end function newton_direction

  !> Speeds at which laws are looked at, ascending: they grow geometrically on both sides of zero, and are dense about those where
  !> a law bends.
  function new_speed_grid(points_per_decade, unit, knees) result(grid)
    integer, intent(in) :: points_per_decade
    real(wp), intent(in) :: unit       !! the speed that is 1 rad/s of the fastest body [rad/s]
    real(wp), intent(in) :: knees(:)   !! [rad/s]
    real(wp), allocatable :: grid(:)
    real(wp) :: nearness(knee_decades * knee_points), steps(2 * decades * points_per_decade + 1)
    integer :: i

    steps = unit * [(10.0_wp**(real(i, wp) / points_per_decade), i=-decades * points_per_decade, decades * points_per_decade)]
    allocate (grid, source=[-steps, 0.0_wp, steps, knees])
    if (size(knees) <= most_dense_knees) then
      nearness = [(10.0_wp**(-real(i, wp) / knee_points), i=1, size(nearness))]
      do i = 1, size(knees)
        grid = [grid, knees(i) * (1.0_wp - nearness), knees(i) * (1.0_wp + nearness)]
      end do
    end if
    call sort_ascending(grid)
    grid = pack(grid, [.true., grid(2:) > grid(:size(grid) - 1)])
  end function new_speed_grid

end module nocdyn_eliminated_balance
