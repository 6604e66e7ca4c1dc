!> Motions of a machine that no torque acts on, though several speeds take part in them, such as the common rotation of two discs
!> with a viscous damper between them. Any is steady, and the momentum of the start is kept.
module nocdyn_floating_motions
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: singular_vectors
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: hold_floating

contains

  !> Keeps these motions at their momentum of the start, by a drag on them alone, which vanishes there.
  subroutine hold_floating(balance)
    type(torque_balance_t), intent(inout) :: balance
    integer :: block_of(balance%unknowns()), i, k, speeds
    integer, allocatable :: members(:)
    logical :: is_silent(size(balance%inelastic))
    real(wp), allocatable :: drag(:, :), start(:)

    allocate (balance%floating(size(block_of)), source=0)
    block_of = balance%blocks()
    speeds = size(balance%motions%free)
    call find_silent(balance, is_silent)
    allocate (start, source=balance%start())
    do i = 1, speeds
      members = pack([(k, k=1, speeds)], block_of(:speeds) == block_of(i))
      if (members(1) /= i .or. size(members) < 2) cycle
      call find_drag(balance, members, is_silent, drag, balance%floating(i))
      if (balance%floating(i) == 0) cycle
      if (.not. allocated(balance%drag)) allocate (balance%drag(speeds, speeds), source=0.0_wp)
      balance%drag(members, members) = drag
      balance%start_speed = start(:speeds)
    end do
  end subroutine hold_floating

  !> The inelastic elements without a moment at any speed, by some speeds.
  subroutine find_silent(balance, is_silent)
    type(torque_balance_t), intent(inout) :: balance
    logical, intent(out) :: is_silent(:)
    real(wp), parameter :: some(*) = [-311.0_wp, -1.7_wp, -1.0e-3_wp, 1.3e-3_wp, 2.3_wp, 173.0_wp]
    real(wp) :: moments(size(is_silent))
    integer :: i

    is_silent = .true.
    do i = 1, size(some)
      moments = balance%moments_at(some(i))
      is_silent = is_silent .and. abs(moments) <= 0.0_wp
    end do
    if (.not. allocated(balance%joints%by_moment)) return
    do i = 1, size(is_silent)   ! teeth have moments that follow from others
      if (any(balance%joints%element(balance%joints%teeth%joint) == balance%inelastic(i))) is_silent(i) = .false.
    end do
  end subroutine find_silent

  !> The drag on the motions of a block that move no element with a moment: A d d^T A with the inertias A and d^T A d = 1.
  subroutine find_drag(balance, members, is_silent, drag, count)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: members(:)      !! unknowns
    logical, intent(in) :: is_silent(:)    !! [inelastic]
    real(wp), allocatable, intent(out) :: drag(:, :)
    integer, intent(out) :: count          !! of these motions
    real(wp), parameter :: none = 1.0e-10_wp
    real(wp), dimension(size(members), size(members)) :: inertia, vectors
    real(wp), dimension(size(members)) :: momentum, values
    real(wp) :: rates(size(is_silent), size(members))
    integer :: i, k, n
    logical :: has_failed

    rates = 0.0_wp
    do i = 1, size(is_silent)
      if (is_silent(i)) cycle
      do k = balance%first(i), balance%first(i + 1) - 1
        n = findloc(members, balance%freedom(k), dim=1)
        if (n > 0) rates(i, n) = balance%ratio(k)
      end do
      if (any(abs(rates(i, :)) > 0)) rates(i, :) = rates(i, :) / norm2(rates(i, :))
    end do
    count = 0
    allocate (drag(size(members), size(members)), source=0.0_wp)
    call singular_vectors(rates, values, vectors, has_failed)
    if (has_failed) return
    inertia = balance%inertia(members)
    do n = 1, size(members)
      if (values(n) > none * max(values(1), tiny(none))) cycle
      count = count + 1
      momentum = matmul(inertia, vectors(:, n))
      momentum = momentum / sqrt(dot_product(momentum, vectors(:, n)))
      do k = 1, size(members)
        drag(:, k) = drag(:, k) + momentum * momentum(k)
      end do
    end do
  end subroutine find_drag

end module nocdyn_floating_motions
