!> The origin of the coordinates, which moves with the rigid motions of a machine: q stands for origin + q.
!>
!> A machine that turns has angles that grow without bound, and its twists are small differences of them. Where the angle of a
!> rigid motion has become large, all coordinates that turn with it are put back, so that their differences keep their digits.
!> The rounding of an angle disturbs the acceleration of a twist in proportion to the square of its natural frequency: the
!> stiffer a machine, the smaller its angles are kept. An origin is a whole multiple of a power of two, added up exactly.
module nocdyn_moving_origin
  use, intrinsic :: iso_c_binding, only: c_loc
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  implicit none (type, external)
  private

  public :: new_moving_origin

  real(wp), parameter :: noise = 1.0e6_wp        !! largest angle times the square of a natural frequency [rad/s2]
  integer, parameter :: smallest_exponent = 0    !! of the angles, powers of two
  integer, parameter :: largest_exponent = 8     !! of a machine of springs
  integer, parameter :: usual_exponent = 4       !! of a machine with other elastic laws

  type, public :: moving_origin_t
    type(rigid_motions_t) :: motions
    real(wp), allocatable :: q(:, :)                      !! origin of the coordinates [rad], [lanes, coordinates]
    integer, allocatable :: turning(:)                    !! elements that are not elastic but turn with a rigid motion
    real(wp), allocatable, private :: ratio(:, :)         !! as in `motions`, of each lane, [lanes, entries]
    real(wp), allocatable, private :: angle(:, :)         !! origin of the rigid motions [rad], [lanes, motions]
    real(wp), allocatable, private :: turn(:)             !! part of a shift along each rigid motion [rad], work space, [motions]
    real(wp), allocatable :: unit(:)                      !! angle from which a rigid motion is put back [rad], [lanes]
    integer, allocatable, private :: elastic(:)           !! elements that must not be twisted
    logical, private :: has_springs_only = .true.         !! whether the laws of these are polynomials
  contains
    procedure :: find_shift, move, start_lane, move_twists, pass_parameters, describe_limits
  end type moving_origin_t

contains

  !> The origin of a block of equal lanes.
  function new_moving_origin(lanes, freedoms, incidence, elastic, has_springs_only) result(self)
    integer, intent(in) :: lanes
    integer, intent(in) :: freedoms                        !! number of coordinates
    type(element_coordinates_t), intent(in) :: incidence   !! twists of the elements by coordinates
    integer, intent(in) :: elastic(:)                      !! elements that must not be twisted
    logical, intent(in) :: has_springs_only                !! whether the laws of these are polynomials
    type(moving_origin_t) :: self
    logical :: is_turning(size(incidence%first) - 1)
    integer :: e

    self%motions = new_rigid_motions(freedoms, incidence, elastic)
    allocate (self%q(lanes, freedoms), self%angle(lanes, size(self%motions%free)), source=0.0_wp)
    allocate (self%turn(size(self%motions%free)), source=0.0_wp)
    allocate (self%unit(lanes), source=1.0_wp)
    allocate (self%elastic, source=elastic)
    self%has_springs_only = has_springs_only
    allocate (self%ratio, source=spread(self%motions%ratio, 1, lanes))
    is_turning = .true.
    is_turning(elastic) = .false.
    self%turning = pack([(e, e=1, size(is_turning))], is_turning)
  end function new_moving_origin

  !> The shift of the coordinates of a lane that brings its rigid motions back near the origin [rad], [coordinates].
  pure subroutine find_shift(self, lane, q, shift)
    class(moving_origin_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: q(:)           !! angles of the coordinates [rad]
    real(wp), intent(inout) :: shift(:)    !! [rad], [coordinates]
    integer :: m

    do m = 1, size(self%turn)
      self%turn(m) = self%unit(lane) * anint(q(self%motions%free(m)) / self%unit(lane))
    end do
    call self%motions%combine(self%ratio(lane, :), self%turn, shift)
  end subroutine find_shift

  !> Moves the origin of a lane by a shift that `find_shift` gave.
  pure subroutine move(self, lane, shift)
    class(moving_origin_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: shift(:)   !! [rad], [coordinates]
    integer :: m

    do m = 1, size(self%turn)
      self%angle(lane, m) = self%angle(lane, m) + shift(self%motions%free(m))
    end do
    call self%motions%combine(self%ratio(lane, :), self%angle(lane, :), self%q(lane, :))
  end subroutine move

  !> Moves the origin of a lane back to zero, and sets how far its rigid motions may go from it.
  pure subroutine start_lane(self, lane, incidence, stiffness)
    class(moving_origin_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(element_coordinates_t), intent(in) :: incidence
    real(wp), intent(in) :: stiffness(:)   !! linear stiffness of the elements [N m/rad], [elements]
    real(wp) :: response, square   ! of the highest natural frequency of one element with the bodies that it joins
    integer :: i, k

    self%angle(lane, :) = 0.0_wp
    self%q(lane, :) = 0.0_wp
    square = noise * epsilon(square)
    do i = 1, size(self%elastic)
      response = 0.0_wp
      do k = incidence%first(self%elastic(i)), incidence%first(self%elastic(i) + 1) - 1
        response = response + incidence%ratio(lane, k) * incidence%response(lane, k)
      end do
      square = max(square, abs(stiffness(self%elastic(i))) * response)
    end do
    self%unit(lane) = scale(1.0_wp, max(smallest_exponent, min(exponent(noise / square), &
                                                               merge(largest_exponent, usual_exponent, self%has_springs_only))))
  end subroutine start_lane

  !> Adds the angle of the origin to the angles of the elements that turn with it. Elastic elements do not feel it.
  pure subroutine move_twists(self, lane, incidence, twist)
    class(moving_origin_t), intent(in) :: self
    integer, intent(in) :: lane
    type(element_coordinates_t), intent(in) :: incidence
    real(wp), intent(inout) :: twist(:, :)   !! [rad], [lanes, elements]
    integer :: e, i, k

    do i = 1, size(self%turning)
      e = self%turning(i)
      do k = incidence%first(e), incidence%first(e + 1) - 1
        twist(lane, e) = twist(lane, e) + incidence%ratio(lane, k) * self%q(lane, incidence%coordinate(k))
      end do
    end do
  end subroutine move_twists

  !> Tells plain steps where a rigid motion is put back.
  subroutine describe_limits(self, steps)
    class(moving_origin_t), target, intent(in) :: self
    type(plain_steps_t), intent(inout) :: steps

    steps%turning = size(self%motions%free)
    steps%turn = c_loc(self%motions%free)
    steps%far = c_loc(self%unit)
  end subroutine describe_limits

  !> Passes the arrays that may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(moving_origin_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%motions%free, self%motions%first, self%motions%freedom)
    call parameters%add('rigid motions: ratio', self%ratio)
  end subroutine pass_parameters

end module nocdyn_moving_origin
