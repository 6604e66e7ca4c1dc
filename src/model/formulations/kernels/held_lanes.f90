!> The moments of joints that are locked, for all lanes of a block at once: -W^+ u'', with zeros in W^+ for joints that slip
!> (`nocdyn_held_rows`). They are linear in the accelerations, and so hold for each Taylor coefficient of these too.
module nocdyn_held_lanes
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_joint_sets, only: joint_sets_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_held_lanes

  type, public :: held_lanes_t
    logical :: is_active = .false.             !! whether a joint is locked in some lane
    logical, allocatable :: is_held(:)         !! whether this one is, [joints]
    real(wp), allocatable :: moment(:, :)      !! of the joints that hold [N m], [lanes, joints]
    real(wp), allocatable :: rate(:, :)        !! u'' without these moments [rad/s2], or u' [rad/s], [lanes, joints]
    real(wp), allocatable, private :: holding(:, :, :)   !! W^+ [kg m2], [lanes, joints, joints]
    integer, allocatable, private :: element(:)          !! of the machine, [joints]
  contains
    procedure :: take_set, hold, hold_coefficients, find_rates
  end type held_lanes_t

contains

  !> No joint is locked.
  function new_held_lanes(lanes, joints) result(self)
    integer, intent(in) :: lanes
    type(joint_sets_t), intent(in) :: joints
    type(held_lanes_t) :: self

    associate (n => joints%count)
      allocate (self%is_held(n), source=.false.)
      allocate (self%moment(lanes, n), self%rate(lanes, n), self%holding(lanes, n, n), source=0.0_wp)
    end associate
    allocate (self%element, source=joints%element)
  end function new_held_lanes

  !> Takes the joints that hold in a lane.
  subroutine take_set(self, lane, set)
    class(held_lanes_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(joint_sets_t), intent(inout) :: set
    integer :: j

    call set%find_holding(self%holding(lane, :, :))
    do j = 1, size(self%is_held)
      self%is_held(j) = any(abs(self%holding(:, j, j)) > 0)   ! W^+ is semidefinite
    end do
    self%is_active = any(self%is_held)
  end subroutine take_set

  !> Adds what the joints that hold do to the accelerations of some lanes, or to Taylor coefficients of these, and sets their
  !> moments.
  pure subroutine hold(self, map, first, last, lanes, freedoms, acceleration)
    class(held_lanes_t), intent(inout) :: self
    type(element_coordinates_t), intent(in) :: map
    integer, intent(in) :: first, last, lanes, freedoms
    real(wp), intent(inout) :: acceleration(lanes, freedoms)   !! [rad/s2]
    integer :: i, j, k

    if (.not. self%is_active) return
    do j = 1, size(self%is_held)
      self%moment(first:last, j) = 0.0_wp
    end do
    do j = 1, size(self%is_held)
      if (.not. self%is_held(j)) cycle
      call self%find_rates(map, j, first, last, lanes, freedoms, acceleration)
      do i = 1, size(self%is_held)
        if (self%is_held(i)) self%moment(first:last, i) = self%moment(first:last, i) - self%holding(first:last, i, j) &
                                                                                       * self%rate(first:last, j)
      end do
    end do
    do j = 1, size(self%is_held)
      if (.not. self%is_held(j)) cycle
      do k = map%first(self%element(j)), map%first(self%element(j) + 1) - 1
        associate (push => acceleration(first:last, map%coordinate(k)))
          push = push + map%response(first:last, k) * self%moment(first:last, j)
        end associate
      end do
    end do
  end subroutine hold

  !> `hold` of Taylor coefficients. What is left of them by rounding alone becomes zero: over a long step of a machine that is at
  !> rest, where the torques oscillate many times, it would grow by orders of magnitude.
  pure subroutine hold_coefficients(self, map, first, last, lanes, freedoms, coefficient)
    class(held_lanes_t), intent(inout) :: self
    type(element_coordinates_t), intent(in) :: map
    integer, intent(in) :: first, last, lanes, freedoms
    real(wp), intent(inout) :: coefficient(lanes, freedoms)   !! of the accelerations
    real(wp), parameter :: rounding = 256.0_wp * epsilon(1.0_wp)
    real(wp) :: before(first:last, freedoms)

    before = coefficient(first:last, :)
    call self%hold(map, first, last, lanes, freedoms, coefficient)
    where (abs(coefficient(first:last, :)) <= rounding * abs(before)) coefficient(first:last, :) = 0.0_wp
  end subroutine hold_coefficients

  !> Sets the rates of a joint in some lanes, from accelerations or speeds.
  pure subroutine find_rates(self, map, joint, first, last, lanes, freedoms, acceleration)
    class(held_lanes_t), intent(inout) :: self
    type(element_coordinates_t), intent(in) :: map
    integer, intent(in) :: joint, first, last, lanes, freedoms
    real(wp), intent(in) :: acceleration(lanes, freedoms)   !! [rad/s2], or speeds [rad/s]
    integer :: k

    associate (rate => self%rate(first:last, joint), e => self%element(joint))
      rate = 0.0_wp
      do k = map%first(e), map%first(e + 1) - 1
        rate = rate + map%ratio(first:last, k) * acceleration(first:last, map%coordinate(k))
      end do
    end associate
  end subroutine find_rates

end module nocdyn_held_lanes
