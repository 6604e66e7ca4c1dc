!> The solutions of one block of unknowns of a torque balance.
module nocdyn_block_solutions
  use nocdyn_kinds, only: wp
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: is_nearly_balanced

  integer, parameter :: most_solutions = 64      ! of a block
  real(wp), parameter :: same = 1.0e-7_wp        ! relative distance below which two solutions are one

  !> All solutions of one block of unknowns, and the smallest imbalance for the message if there is none.
  type, public :: block_solutions_t
    integer, allocatable :: members(:)        !! unknowns
    real(wp), allocatable :: values(:, :)     !! [members, solutions]
    logical, allocatable :: is_range(:)       !! whether a solution represents a range of solutions, [solutions]
    logical :: is_unloaded = .false.          !! no torque acts: any speed is steady, and the one of the start is taken
    logical :: is_complete = .true.           !! whether a scan of one speed has found all solutions
    integer :: starts = 0                     !! of Newton's method, if the scan has not
    logical :: is_level = .false.             !! whether the imbalance is the same at every speed
    real(wp) :: least_torque = huge(1.0_wp)   !! smallest imbalance found, with its sign [N m]
    real(wp) :: least_speed = 0.0_wp          !! speed of the smallest imbalance [rad/s]
  contains
    procedure :: add
    procedure :: add_or_join
  end type block_solutions_t

contains

  !> Adds a solution, unless the list has it.
  subroutine add(self, values, is_range)
    class(block_solutions_t), intent(inout) :: self
    real(wp), intent(in) :: values(:)   !! [members]
    logical, intent(in) :: is_range     !! whether it represents a range
    integer :: i

    do i = 1, size(self%values, 2)
      if (is_same(values, self%values(:, i))) return
    end do
    if (size(self%values, 2) < most_solutions) then
      self%values = reshape([self%values, values], [size(values), size(self%values, 2) + 1])
      self%is_range = [self%is_range, is_range]
    end if
  end subroutine add

  !> Adds a solution, unless a range of solutions leads from it to one in the list.
  subroutine add_or_join(self, balance, z)
    class(block_solutions_t), intent(inout) :: self
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)   !! [unknowns]
    integer :: i

    do i = 1, size(self%values, 2)
      if (.not. is_joined(balance, z, self%members, self%values(:, i))) cycle
      if (.not. is_same(z(self%members), self%values(:, i))) self%is_range(i) = .true.
      return
    end do
    call self%add(z(self%members), .false.)
  end subroutine add_or_join

  !> Whether the torques balance on the whole way between two solutions, at some points of it.
  logical function is_joined(balance, z, members, other)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)        !! [unknowns]
    integer, intent(in) :: members(:)   !! unknowns of the block
    real(wp), intent(in) :: other(:)    !! [members]
    integer, parameter :: intervals = 8
    real(wp) :: point(size(z))
    integer :: i

    is_joined = is_same(z(members), other)
    if (is_joined) return
    point = z
    do i = 1, intervals - 1
      point(members) = z(members) + real(i, wp) / intervals * (other - z(members))
      if (.not. is_nearly_balanced(balance, members, point)) return
    end do
    is_joined = .true.
  end function is_joined

  !> Whether two solutions are equal up to `same`.
  pure logical function is_same(one, other)
    real(wp), intent(in) :: one(:), other(:)   !! [members of the block]

    is_same = all(abs(one - other) <= same * max(abs(one), abs(other), same))
  end function is_same

  !> Whether the residuals at some unknowns are rounding: the one of their terms, and what roundings of the unknowns change.
  logical function is_nearly_balanced(balance, members, z)
    type(torque_balance_t), intent(inout) :: balance
    integer, intent(in) :: members(:)   !! unknowns of the block
    real(wp), intent(in) :: z(:)        !! [unknowns]
    real(wp), parameter :: near = 1.0e-10_wp, spacings = 8 * epsilon(1.0_wp)
    real(wp) :: slopes(size(z), size(z)), tolerance(size(members)), changes(size(members))
    integer :: i

    call balance%evaluate(z)
    call balance%differentiate(slopes)
    do i = 1, size(members)
      changes(i) = sum(abs(slopes(members(i), members) * z(members)))
    end do
    tolerance = spacings * changes + near * merge(balance%scale(members), changes, members <= size(balance%motions%free))
    is_nearly_balanced = all(abs(balance%residual(members)) <= tolerance)
  end function is_nearly_balanced

end module nocdyn_block_solutions
