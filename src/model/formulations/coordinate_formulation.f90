!> Formulations whose states are the speeds and angles of the independent coordinates, q' and q: `reduced`.
!>
!> q is measured from the start and from an origin that moves with the rigid motions: phi = start_angle + L_tau (origin + q). The
!> elements have the angles u = u_0 + U q and the speeds u' = U q', which are no differences of large angles.
module nocdyn_coordinate_formulation
  use nocdyn_element_coordinates, only: element_coordinates_t, new_element_coordinates, twist_map
  use nocdyn_element_sets, only: coupling_elements, has_springs_only
  use nocdyn_error_measures, only: new_error_measures
  use nocdyn_joint_formulation, only: joint_formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_moving_origin, only: moving_origin_t, new_moving_origin
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  !> Extensions compute the accelerations.
  type, abstract, extends(joint_formulation_t), public :: coordinate_formulation_t
    real(wp), allocatable :: twist_at_origin(:, :)       !! u_0 [rad], [lanes, elements]: `zero_twist` and the moving origin
    type(sparse_map_t) :: twists                         !! U
    type(element_coordinates_t) :: incidence             !! entries of which U is made
    type(element_coordinates_t) :: switching             !! entries of the elements that the switches look at
    type(moving_origin_t), private :: origin
    real(wp), allocatable, private, dimension(:, :) :: switch_angle, switch_speed   !! their motion, [lanes, elements]
  contains
    procedure :: set_coordinates, list_coordinates, start, project_start_speeds, set_state, gather, find_far
    procedure :: shift_state, restore_state, reset_origin, angle_at_zero, body_angle, twist_at_zero, switch_motion
    procedure :: accelerate, element_rate, push_element, block_indicators, reactions, describe_steps
  end type coordinate_formulation_t

contains

  !> Forms what depends on the coordinates of `machine`.
  subroutine set_coordinates(self, with_energy_balance, is_block)
    class(coordinate_formulation_t), intent(inout) :: self
    logical, intent(in) :: with_energy_balance   !! whether the powers of the elements `machine%with_work` are integrated
    logical, intent(in) :: is_block              !! whether a single lane gets the layout of a block
    type(element_coordinates_t) :: turning   ! entries of the couplings
    integer, allocatable :: couplings(:)
    logical :: has_offset(self%machine%elements%count)

    call self%allocate_state(self%machine%coordinates%body, 2 * self%machine%coordinates%freedoms, with_energy_balance)
    self%incidence = new_element_coordinates(self%machine%elements, self%machine%coordinates)
    self%zero_twist = self%machine%start_twist()
    self%twist_at_origin = self%zero_twist
    associate (machine => self%machine, incidence => self%incidence, freedoms => self%machine%coordinates%freedoms)
      self%switching = incidence%selected(machine%switches%moving, with_ratio_only=.true.)
      self%origin = new_moving_origin(machine%lanes, freedoms, incidence, machine%elastic(), has_springs_only(machine))
      has_offset = any(abs(self%zero_twist) > 0, dim=1)
      has_offset(self%origin%turning) = .true.
      self%twists = twist_map(incidence, has_offset, without_bands=is_block)
      self%may_shift = size(self%origin%motions%free) > 0
      self%has_block_indicators = machine%lanes > 1
      if (allocated(self%switch_angle)) deallocate (self%switch_angle, self%switch_speed)
      allocate (self%switch_angle(machine%lanes, size(machine%switches%moving)), source=0.0_wp)
      allocate (self%switch_speed, source=self%switch_angle)
      allocate (couplings, source=coupling_elements(machine))
      turning = incidence%selected(couplings, with_ratio_only=.true.)
      call self%set_norm(new_error_measures(couplings, turning%first, turning%coordinate, turning%ratio, &
                                            self%origin%motions%free, freedoms, self%states, without_bands=is_block))
    end associate
    call self%prepare_joints()
  end subroutine set_coordinates

  !> Passes the arrays that may differ from variant to variant.
  subroutine list_coordinates(self, parameters)
    class(coordinate_formulation_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%machine%pass_parameters(parameters)
    call parameters%add('zero_twist', self%zero_twist)
    call self%incidence%pass_parameters(parameters)
    call self%twists%pass_parameters(parameters)
    call self%switching%pass_parameters(parameters)
    call self%origin%pass_parameters(parameters)
    call self%norm%pass_parameters(parameters)
  end subroutine list_coordinates

  !> Start speeds and angles of the coordinates and start values of the internal states; the work integrals are zero.
  function start(self) result(y)
    class(coordinate_formulation_t), intent(in) :: self
    real(wp), allocatable :: y(:, :)
    integer :: l

    allocate (y(self%lanes, self%states + self%quadratures), source=0.0_wp)
    do l = 1, self%lanes
      call self%project_start_speeds(l, y(l, :))
    end do
    y(:, self%mechanical + 1:self%states) = self%machine%start_internal()
  end function start

  !> Sets the start speeds of the coordinates of one lane; the rest of the state stays.
  pure subroutine project_start_speeds(self, lane, y)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: y(:)   !! [states + quadratures]

    real(wp) :: speed(self%machine%bodies)

    speed = self%machine%start_speed(lane, :)
    if (allocated(self%machine%driven_speed)) speed = speed - self%machine%driven_speed
    call self%machine%coordinates%project(lane, self%machine%inertia(lane, :), speed, y(:self%machine%coordinates%freedoms))
  end subroutine project_start_speeds

  !> omega = L_tau q', eq. (82) of section 5, phi = start_angle + L_tau (origin + q), and the internal states.
  subroutine set_state(self, y)
    class(coordinate_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: y(:, :)   !! state, [lanes, states], at least
    integer :: b, c, f, k, l

    f = self%machine%coordinates%freedoms
    if (self%internal > 0) self%state%elements%internal%value(:, :) = y(:, self%mechanical + 1:self%states)
    if (self%lanes == 1) then
      call set_single_state(self, size(y, 2), y)
      if (allocated(self%machine%driven_speed)) self%omega(1, 1:) = self%omega(1, 1:) + self%machine%driven_speed
      return
    end if
    associate (coordinates => self%machine%coordinates, start_angle => self%machine%start_angle)
      do b = 1, self%machine%bodies
        self%omega(:, b) = 0.0_wp
        self%phi(:, b) = start_angle(:, b)
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          c = coordinates%coordinate(k)
          do l = 1, self%lanes
            self%omega(l, b) = self%omega(l, b) + coordinates%ratio(l, k) * y(l, c)
            self%phi(l, b) = self%phi(l, b) + coordinates%ratio(l, k) * (self%origin%q(l, c) + y(l, f + c))
          end do
        end do
      end do
    end associate
  end subroutine set_state

  !> `set_state` of a block of one lane, in the same bits, without loops of one turn.
  pure subroutine set_single_state(self, components, y)
    class(coordinate_formulation_t), intent(inout) :: self
    integer, intent(in) :: components
    real(wp), intent(in) :: y(components)
    real(wp) :: angle, speed
    integer :: b, c, f, k

    f = self%machine%coordinates%freedoms
    associate (coordinates => self%machine%coordinates)
      do b = 1, self%machine%bodies
        speed = 0.0_wp
        angle = self%machine%start_angle(1, b)
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          c = coordinates%coordinate(k)
          speed = speed + coordinates%ratio(1, k) * y(c)
          angle = angle + coordinates%ratio(1, k) * (self%origin%q(1, c) + y(f + c))
        end do
        self%omega(1, b) = speed
        self%phi(1, b) = angle
      end do
    end associate
  end subroutine set_single_state

  !> Sets the motion of bodies and elements; the twists are not differences of the bodies' angles, which may be large.
  subroutine gather(self, y)
    class(coordinate_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states], at least

    call self%set_state(y)
    associate (f => self%machine%coordinates%freedoms, elements => self%state%elements)
      call self%twists%multiply_pair(self%twist_at_origin, y(:, f + 1:2 * f), y(:, :f), elements%angle, elements%speed)
      if (allocated(self%driven_rate)) elements%speed(1, :) = elements%speed(1, :) + self%driven_rate
    end associate
  end subroutine gather

  !> Finds the lanes in which a rigid motion has gone far from the origin.
  subroutine find_far(self, columns, y, is_far)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: columns
    real(wp), intent(in) :: y(self%lanes, columns)   !! [lanes, states], at least
    logical, intent(inout) :: is_far(self%lanes)
    integer :: m

    is_far = .false.
    associate (free => self%origin%motions%free, before => self%machine%coordinates%freedoms)
      do m = 1, size(free)
        is_far = is_far .or. abs(y(:, before + free(m))) > self%origin%unit
      end do
    end associate
  end subroutine find_far

  !> Describes the measured quantities of several lanes, and where their states are shifted.
  subroutine describe_steps(self, steps)
    class(coordinate_formulation_t), intent(in) :: self
    type(plain_steps_t), intent(inout) :: steps

    call self%norm%describe_map(steps)
    call self%origin%describe_limits(steps)
  end subroutine describe_steps

  !> Puts the coordinates of a lane back near the origin, and moves the origin instead.
  subroutine shift_state(self, lane, y, shift)
    class(coordinate_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:, :)     !! [lanes, columns]
    real(wp), contiguous, intent(inout) :: shift(:)    !! [states + quadratures]

    associate (first => self%machine%coordinates%freedoms + 1, last => 2 * self%machine%coordinates%freedoms)
      shift(:) = 0.0_wp
      call self%origin%find_shift(lane, y(lane, first:last), shift(first:last))
      y(lane, first:last) = y(lane, first:last) - shift(first:last)
      call self%origin%move(lane, shift(first:last))
    end associate
    self%twist_at_origin(lane, :) = self%zero_twist(lane, :)
    call self%origin%move_twists(lane, self%incidence, self%twist_at_origin)
  end subroutine shift_state

  subroutine restore_state(self, lane, y)
    class(coordinate_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]

    associate (f => self%machine%coordinates%freedoms)
      y(f + 1:2 * f) = y(f + 1:2 * f) + self%origin%q(lane, :)
    end associate
    call self%reset_origin(lane)
  end subroutine restore_state

  !> Puts the origin of a lane back to the start.
  subroutine reset_origin(self, lane)
    class(coordinate_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%origin%start_lane(lane, self%incidence, self%machine%laws%linear(lane, :))
    self%twist_at_origin(lane, :) = self%zero_twist(lane, :)
  end subroutine reset_origin

  !> The angle of a body where the angles in the state are zero [rad].
  pure real(wp) function angle_at_zero(self, lane, body)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: lane, body
    integer :: k

    angle_at_zero = self%machine%start_angle(lane, body)
    associate (coordinates => self%machine%coordinates)
      do k = coordinates%first(body), coordinates%first(body + 1) - 1
        angle_at_zero = angle_at_zero + coordinates%ratio(lane, k) * self%origin%q(lane, coordinates%coordinate(k))
      end do
    end associate
  end function angle_at_zero

  !> The angle of a body in a state of a lane, to the bits of `set_state` [rad].
  pure real(wp) function body_angle(self, lane, body, y) result(angle)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: lane, body
    real(wp), intent(in) :: y(:)   !! state, [states] at least
    integer :: c, k

    angle = self%machine%start_angle(lane, body)
    associate (coordinates => self%machine%coordinates)
      do k = coordinates%first(body), coordinates%first(body + 1) - 1
        c = coordinates%coordinate(k)
        angle = angle + coordinates%ratio(lane, k) * (self%origin%q(lane, c) + y(coordinates%freedoms + c))
      end do
    end associate
  end function body_angle

  !> Twist of an element where all coordinates are zero [rad].
  pure real(wp) function twist_at_zero(self, lane, element)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: lane, element

    twist_at_zero = self%twist_at_origin(lane, element)
  end function twist_at_zero

  !> Relative angle and speed of the element of a switch, and of its phase.
  pure subroutine switch_motion(self, lane, switch, y, motion)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: lane, switch
    real(wp), contiguous, intent(in) :: y(:)   !! state, [states + quadratures]
    real(wp), intent(out) :: motion(4)         !! [rad], [rad/s], twice

    motion = 0.0_wp
    associate (switches => self%machine%switches)
      call place_motion(self, lane, switches%place(switch), y, motion(1), motion(2))
      if (switches%phase_place(switch) == switches%place(switch)) return
      call place_motion(self, lane, switches%phase_place(switch), y, motion(3), motion(4))
    end associate
  end subroutine switch_motion

  !> The motion of an element that switches look at.
  pure subroutine place_motion(self, lane, place, y, angle, speed)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: place               !! in `moving` of the switches
    real(wp), contiguous, intent(in) :: y(:)   !! state, [states + quadratures]
    real(wp), intent(out) :: angle, speed      !! [rad], [rad/s]
    integer :: k

    angle = self%twist_at_origin(lane, self%machine%switches%moving(place))
    speed = 0.0_wp
    if (allocated(self%driven_rate)) speed = self%driven_rate(self%machine%switches%moving(place))
    associate (switching => self%switching, f => self%machine%coordinates%freedoms)
      do k = switching%first(place), switching%first(place + 1) - 1
        angle = angle + switching%ratio(lane, k) * y(f + switching%coordinate(k))
        speed = speed + switching%ratio(lane, k) * y(switching%coordinate(k))
      end do
    end associate
  end subroutine place_motion

  subroutine block_indicators(self, columns, t, y, g)
    class(coordinate_formulation_t), intent(inout) :: self
    integer, intent(in) :: columns
    real(wp), intent(in) :: t(self%lanes)                         !! [s]
    real(wp), intent(in) :: y(self%lanes, columns)
    real(wp), intent(inout) :: g(self%lanes, self%switches)
    integer :: i, k, l

    associate (switches => self%machine%switches, angle => self%switch_angle, speed => self%switch_speed, &
               entries => self%switching, f => self%machine%coordinates%freedoms)
      do i = 1, size(switches%moving)
        angle(:, i) = self%twist_at_origin(:, switches%moving(i))
        speed(:, i) = 0.0_wp
        do k = entries%first(i), entries%first(i + 1) - 1
          do l = 1, self%lanes
            angle(l, i) = angle(l, i) + entries%ratio(l, k) * y(l, f + entries%coordinate(k))
            speed(l, i) = speed(l, i) + entries%ratio(l, k) * y(l, entries%coordinate(k))
          end do
        end do
      end do
      call switches%block_indicators(self%machine%banks, self%state%banks, t, angle, speed, &
                                     y(:, self%mechanical + 1:self%states), g)
    end associate
  end subroutine block_indicators

  !> q'' = (L_tau^T J L_tau)^-1 L_tau^T T.
  subroutine accelerate(self, acceleration)
    class(coordinate_formulation_t), intent(inout) :: self
    real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [freedoms]
    integer :: b, k

    acceleration(:) = 0.0_wp
    associate (coordinates => self%machine%coordinates)
      do b = 1, self%machine%bodies
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          associate (entry => acceleration(coordinates%coordinate(k)))
            entry = entry + coordinates%response(1, k) * self%torque(1, b)
          end associate
        end do
      end do
    end associate
  end subroutine accelerate

  !> The rate of an element.
  pure real(wp) function element_rate(self, element, rates)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: rates(:)   !! q' [rad/s] or q'' [rad/s2], [freedoms] at least
    integer :: k

    element_rate = 0.0_wp
    associate (map => self%incidence)
      do k = map%first(element), map%first(element + 1) - 1
        element_rate = element_rate + map%ratio(1, k) * rates(map%coordinate(k))
      end do
    end associate
  end function element_rate

  !> Adds the response to the moment or the impulse of an element.
  pure subroutine push_element(self, element, moment, rates)
    class(coordinate_formulation_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: moment        !! [N m] or [N m s]
    real(wp), intent(inout) :: rates(:)   !! q'' [rad/s2] or q' [rad/s], [freedoms] at least
    integer :: k

    associate (map => self%incidence)
      do k = map%first(element), map%first(element + 1) - 1
        rates(map%coordinate(k)) = rates(map%coordinate(k)) + map%response(1, k) * moment
      end do
    end associate
  end subroutine push_element

  !> Reactions from the torques of the last `observe`.
  subroutine reactions(self, lane, lambda)
    class(coordinate_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: lambda(:)   !! [rows]

    call self%machine%coordinates%reactions_of_torques(lane, self%torque(lane, 1:), lambda)
  end subroutine reactions

end module nocdyn_coordinate_formulation
