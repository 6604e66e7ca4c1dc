!> Joints at rest in a steady state: which sets of them can be at rest together, and the moments with which they hold.
!>
!> A set is the joints whose speeds are zero where the ones of some are; in a machine with one rigid motion these are all joints
!> or none. They hold if moments between their bounds leave the rigid motions no acceleration: the complementarity problem of a
!> run (`nocdyn_joint_choices`), with twists that stay. Where several joints share what is to be held, each takes a part as the
!> square of what it can hold.
module nocdyn_resting_joints
  use nocdyn_friction_joints, only: friction_joints_t, locked, slips_backwards, slips_forwards
  use nocdyn_joint_balance, only: dense_motions, loads_by_moments, rates_of_elements
  use nocdyn_joint_choices, only: joint_choices_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_linearisation, only: mass_matrix
  use nocdyn_torque_balance, only: torque_balance_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  implicit none (type, external)
  private

  public :: list_resting_sets, new_resting_joints, slips_where_it_cannot

  integer, parameter :: most_sets = 256
  real(wp), parameter :: singular = 1.0e-11_wp   ! relative to the largest singular value
  real(wp), parameter :: rounding = 1.0e-9_wp    ! of accelerations, relative to their terms

  !> What moments do to the joints, of which the ones of a set are at rest.
  type, public :: resting_joints_t
    real(wp), allocatable :: mobility(:, :)    !! accelerations of the rigid motions by torques along them, [motions, motions]
    real(wp), allocatable :: rates(:, :)       !! of the joints by the rigid motions, [joints, motions]
    real(wp), allocatable :: by_element(:, :)  !! rates of all elements by the rigid motions, [elements, motions]
    real(wp), allocatable :: loads(:, :)       !! torques of teeth by the moments of the elements, [losses, elements]
    real(wp), allocatable :: moment(:)         !! of the joints at rest, and of teeth that turn, after `hold` [N m], [joints]
    integer :: overloaded = 0                  !! a joint that cannot hold, 0: none
    real(wp) :: needed = 0.0_wp                !! its moment if it held [N m]
    real(wp) :: least = 0.0_wp, most = 0.0_wp  !! between which it holds [N m]
  contains
    procedure :: hold
    procedure, private :: share_friction
  end type resting_joints_t

contains

  !> The sets of joints that can be at rest, [joints, sets]: first that without any but those that always hold, and those that no
  !> rigid motion moves.
  subroutine list_resting_sets(balance, sets, is_complete)
    type(torque_balance_t), intent(in) :: balance        !! without joints at rest
    logical, allocatable, intent(out) :: sets(:, :)      !! [joints, sets]
    logical, intent(out) :: is_complete                  !! whether all are listed
    real(wp), allocatable :: n(:, :), rows(:, :)
    real(wp) :: rates(balance%joints%count, size(balance%loose%free) + 1)   ! also by drives
    logical :: is_candidate(size(rates, 1)), larger(size(rates, 1))
    integer :: i, j, next

    is_complete = .true.
    allocate (n, source=dense_motions(balance%loose))
    allocate (rows, source=rates_of_elements(balance%incidence, balance%joints%element, balance%coordinates))
    rates(:, :size(n, 2)) = matmul(rows, n)
    rates(:, size(n, 2) + 1) = 0.0_wp
    if (allocated(balance%formulation%driven_rate)) then
      rates(:, size(n, 2) + 1) = balance%formulation%driven_rate(balance%joints%element)
    end if
    larger = .false.
    do j = 1, size(larger)
      call look_at_bounds(balance, j, is_candidate(j), larger(j))
    end do
    call close_set(rates, larger)
    sets = reshape(larger, [size(larger), 1])
    next = 0
    do while (next < size(sets, 2))
      next = next + 1
      do j = 1, size(larger)
        if (sets(j, next) .or. .not. is_candidate(j)) cycle
        larger = sets(:, next)
        larger(j) = .true.
        call close_set(rates, larger)
        if (any([(all(larger .eqv. sets(:, i)), i=1, size(sets, 2))])) cycle
        is_complete = size(sets, 2) < most_sets
        if (.not. is_complete) return
        sets = reshape([sets, larger], [size(larger), size(sets, 2) + 1])
      end do
    end do
  end subroutine list_resting_sets

  !> Whether a joint may be at rest, and whether it always is.
  subroutine look_at_bounds(balance, joint, may_rest, always_rests)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: joint
    logical, intent(out) :: may_rest, always_rests
    real(wp) :: least, most

    may_rest = .true.
    always_rests = .false.
    associate (joints => balance%joints)
      select type (bank => balance%formulation%machine%banks(joints%bank(joint))%bank)
      class is (tooth_losses_t)
        return
      class is (friction_joints_t)
        call bank%find_range(joints%number(joint), balance%t(1), least, most)
        may_rest = most > least
        always_rests = least <= -huge(least) .and. most >= huge(most)
      end select
    end associate
  end subroutine look_at_bounds

  !> Adds the joints that have no speed where the ones of a set have none.
  pure subroutine close_set(rates, is_at_rest)
    real(wp), intent(in) :: rates(:, :)            !! [joints, motions]
    logical, intent(inout) :: is_at_rest(:)        !! [joints]
    real(wp) :: basis(size(rates, 2), size(rates, 2)), scale(size(rates, 1)), left(size(rates, 2))
    real(wp), parameter :: none = 1.0e-10_wp
    integer :: found, j

    found = 0
    scale = [(maxval([0.0_wp, abs(rates(j, :))]), j=1, size(scale))]
    do j = 1, size(is_at_rest)
      if (.not. is_at_rest(j) .or. found == size(rates, 2)) cycle
      left = remainder(rates(j, :), basis(:, :found))
      if (maxval([0.0_wp, abs(left)]) <= none * scale(j)) cycle
      found = found + 1
      basis(:, found) = left / norm2(left)
    end do
    do j = 1, size(is_at_rest)
      left = remainder(rates(j, :), basis(:, :found))
      is_at_rest(j) = is_at_rest(j) .or. maxval([0.0_wp, abs(left)]) <= none * scale(j)
    end do
  end subroutine close_set

  !> What is left of a row without its parts along orthonormal ones.
  pure function remainder(row, basis) result(left)
    real(wp), intent(in) :: row(:), basis(:, :)   !! [motions], [motions, rows]
    real(wp) :: left(size(row))
    integer :: i, pass

    left = row
    do pass = 1, 2
      do i = 1, size(basis, 2)
        left = left - dot_product(basis(:, i), left) * basis(:, i)
      end do
    end do
  end function remainder

  !> What moments do to the joints of a balance.
  function new_resting_joints(balance) result(self)
    type(torque_balance_t), intent(inout) :: balance
    type(resting_joints_t) :: self
    real(wp), allocatable :: inertia(:, :), n(:, :), rows(:, :)
    integer :: e

    allocate (n, source=dense_motions(balance%loose))
    associate (machine => balance%formulation%machine)
      allocate (inertia, source=mass_matrix(machine))
      inertia = matmul(transpose(n), matmul(inertia, n))
      allocate (self%mobility, source=pseudo_inverse(inertia, singular))
      allocate (rows, source=rates_of_elements(balance%incidence, [(e, e=1, machine%elements%count)], balance%coordinates))
      allocate (self%by_element, source=matmul(rows, n))
      allocate (self%rates, source=self%by_element(balance%joints%element, :))
      call balance%differentiate_at_start()
      allocate (self%loads, source=loads_by_moments(balance%joints%teeth, machine, balance%formulation%state%elements, &
                                                    balance%incidence, balance%loose, &
                                                    balance%elastic))
    end associate
    allocate (self%moment(balance%joints%count), source=0.0_wp)
  end function new_resting_joints

  !> Finds the moments of the joints at rest, in the state at which the balance is evaluated.
  subroutine hold(self, balance)
    class(resting_joints_t), intent(inout) :: self
    type(torque_balance_t), intent(inout) :: balance
    type(joint_choices_t) :: choices
    real(wp) :: applied(balance%formulation%machine%elements%count), moment
    real(wp), dimension(size(self%mobility, 1)) :: acceleration, scale, torque
    logical :: holds
    integer :: e, j
    integer, allocatable :: resting(:)
    real(wp), allocatable :: inverse(:, :), moments(:)

    self%overloaded = 0
    associate (joints => balance%joints, elements => balance%formulation%state%elements)
      elements%applied(1, joints%element(joints%teeth%joint)) = 0.0_wp
      applied = 0.0_wp
      do e = 1, size(applied)
        if (.not. balance%is_elastic(e)) applied(e) = elements%restoring(1, e) + elements%applied(1, e)
      end do
      torque = 0.0_wp
      scale = 0.0_wp
      call add_torques(self%by_element, applied, torque, scale)
      acceleration = matmul(self%mobility, torque)
      call gather(self, balance, matmul(self%rates, acceleration), applied, choices)
      call self%share_friction(choices, holds)
      if (.not. holds) call choices%choose()
      self%moment = choices%moment
      call add_torques(self%rates, self%moment, torque, scale)
      if (choices%doubtful == 0 .and. all(abs(torque) <= rounding * maxval([scale, tiny(1.0_wp)]))) then
        elements%applied(1, joints%element) = elements%applied(1, joints%element) + self%moment
        return
      end if
      self%overloaded = 1
      do j = 1, size(choices%mode)   ! the one that would slip
        if (joints%is_at_rest(j) .and. choices%mode(j) /= locked) self%overloaded = j
      end do
      choices%mode = merge(locked, choices%mode, joints%is_at_rest)
      self%least = choices%least(self%overloaded)
      self%most = choices%most(self%overloaded)
    end associate
    ! the moment of a joint if all at rest are locked, with the least norm
    resting = pack([(j, j=1, size(choices%mode))], choices%is_at_rest)
    allocate (inverse, source=pseudo_inverse(choices%w(resting, resting), singular))
    moments = -matmul(inverse, choices%rate(resting))
    moment = sum(pack(moments, resting == self%overloaded))
    self%needed = moment
  end subroutine hold

  !> Adds the torques of moments along the rigid motions, and the sums of their absolute terms.
  pure subroutine add_torques(rates, moment, torque, scale)
    real(wp), intent(in) :: rates(:, :)                  !! of the elements by the motions, [elements, motions]
    real(wp), intent(in) :: moment(:)                    !! [N m], [elements]
    real(wp), intent(inout) :: torque(:), scale(:)       !! [N m], [motions]
    integer :: m

    do m = 1, size(torque)
      torque(m) = torque(m) + sum(rates(:, m) * moment)
      scale(m) = scale(m) + sum(abs(rates(:, m) * moment))
    end do
  end subroutine add_torques

  !> The complementarity problem of the joints.
  subroutine gather(self, balance, rate, applied, choices)
    type(resting_joints_t), intent(in) :: self
    type(torque_balance_t), intent(in) :: balance   !! evaluated
    real(wp), intent(in) :: rate(:)                 !! accelerations of the joints without those at rest [rad/s2], [joints]
    real(wp), intent(in) :: applied(:)              !! moments of the elements that are not elastic [N m], [elements]
    type(joint_choices_t), intent(out) :: choices
    real(wp), allocatable :: turned(:, :)   ! accelerations of the motions by moments of the joints
    real(wp) :: load(balance%joints%teeth%count), slope, speed
    integer :: j

    associate (joints => balance%joints, n => balance%joints%count)
      allocate (turned, source=transpose(self%rates))
      turned = matmul(self%mobility, turned)
      choices%w = matmul(self%rates, turned)
      choices%rate = rate
      choices%is_at_rest = joints%is_at_rest
      choices%slip = balance%formulation%state%elements%speed(1, joints%element)
      allocate (choices%v(n, n), choices%sliding(2, n), source=0.0_wp)
      allocate (choices%least(n), choices%most(n), choices%load(n), choices%driving(n), choices%driven(n), source=0.0_wp)
      allocate (choices%mode(n), source=locked)
      allocate (choices%moment(n), source=0.0_wp)
      allocate (choices%has_teeth(n), source=joints%teeth%loss_of(:n) > 0)
      load = matmul(self%loads, applied) + joints%offset
      do j = 1, n
        speed = merge(0.0_wp, choices%slip(j), choices%is_at_rest(j))
        if (.not. choices%is_at_rest(j)) choices%mode(j) = merge(slips_forwards, slips_backwards, speed > 0)
        select type (bank => balance%formulation%machine%banks(joints%bank(j))%bank)
        class is (tooth_losses_t)
          choices%v(j, :) = self%loads(joints%teeth%loss_of(j), joints%element)
          choices%load(j) = load(joints%teeth%loss_of(j))
          call bank%share(joints%number(j), .true., speed, choices%driving(j), slope)
          call bank%share(joints%number(j), .false., speed, choices%driven(j), slope)
        class is (friction_joints_t)
          call bank%find_range(joints%number(j), balance%t(1), choices%least(j), choices%most(j), choices%sliding(:, j))
        end select
      end do
    end associate
  end subroutine gather

  !> Shares what is to be held between joints with friction, if no teeth are among the ones of the machine.
  subroutine share_friction(self, choices, holds)
    class(resting_joints_t), intent(in) :: self
    type(joint_choices_t), intent(inout) :: choices
    logical, intent(out) :: holds   !! whether that is within all bounds
    real(wp), parameter :: unbounded = 1.0e3_wp   ! times the largest bound
    real(wp), allocatable :: inverse(:, :), share(:), weighted(:, :)
    real(wp) :: capacity(size(choices%mode))
    integer, allocatable :: resting(:)
    integer :: i, j

    holds = .not. any(choices%has_teeth)
    if (.not. holds) return
    resting = pack([(j, j=1, size(choices%mode))], choices%is_at_rest)
    capacity = 0.0_wp
    where (choices%most < huge(1.0_wp)) capacity = choices%most
    where (choices%least > -huge(1.0_wp)) capacity = max(capacity, -choices%least)
    capacity = merge(unbounded * max(1.0_wp, maxval([0.0_wp, capacity])), capacity, &
                     choices%least <= -huge(1.0_wp) .or. choices%most >= huge(1.0_wp))
    weighted = spread(capacity(resting), 2, size(resting)) * choices%w(resting, resting) * &
               spread(capacity(resting), 1, size(resting))
    allocate (inverse, source=pseudo_inverse(weighted, singular))
    share = -matmul(inverse, capacity(resting) * choices%rate(resting))
    choices%moment(:) = 0.0_wp
    do i = 1, size(resting)
      choices%moment(resting(i)) = capacity(resting(i)) * share(i)
    end do
    holds = all(choices%moment(resting) >= choices%least(resting) .and. choices%moment(resting) <= choices%most(resting))
    if (size(self%mobility) == 0) choices%moment(:) = 0.0_wp
  end subroutine share_friction

  !> Whether a joint that is not at rest slips in a direction in which it cannot, or does not slip.
  logical function slips_where_it_cannot(balance)
    type(torque_balance_t), intent(in) :: balance   !! evaluated
    real(wp), parameter :: none = 1.0e-10_wp        ! relative to the largest speed
    real(wp) :: least, most, scale
    integer :: j

    slips_where_it_cannot = .false.
    associate (joints => balance%joints, speed => balance%formulation%state%elements%speed)
      scale = none * maxval([0.0_wp, abs(speed(1, :))])
      do j = 1, joints%count
        if (joints%is_at_rest(j)) cycle
        select type (bank => balance%formulation%machine%banks(joints%bank(j))%bank)
        class is (tooth_losses_t)
          cycle
        class is (friction_joints_t)
          call bank%find_range(joints%number(j), balance%t(1), least, most)
        end select
        associate (slip => speed(1, joints%element(j)))
          slips_where_it_cannot = slips_where_it_cannot .or. (slip > scale .and. least <= -huge(least)) .or. &
                                  (slip < -scale .and. most >= huge(most)) .or. (abs(slip) <= scale .and. most > least)
        end associate
      end do
    end associate
  end function slips_where_it_cannot

end module nocdyn_resting_joints
