!> Blocks of lanes of the reduced formulation with joints that lock (`nocdyn_joint_sets`), each lane with its own set.
!>
!> All lanes are evaluated at once (`nocdyn_held_lanes`). What is decided in one lane, at the start of a variant and at events,
!> is decided by a formulation of that lane alone, which has its parameters, branches and joints. Rows that move and teeth with
!> losses are in blocks of one lane only.
module nocdyn_joint_blocks
  use nocdyn_held_lanes, only: new_held_lanes
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: new_reduced, reduced_t
  use nocdyn_row_obstacles, only: describe_obstacle
  use nocdyn_system, only: evaluation_fatal
  implicit none (type, external)
  private

  !> The formulation of a lane alone, once the lane has started. It is a `class`, as compilers write out the copy of a `type`
  !> wherever one is a component: a tenth of the time of the whole build.
  type :: single_t
    class(reduced_t), allocatable :: single
  end type single_t

  type, extends(reduced_t), public :: joint_block_t
    private
    class(reduced_t), allocatable :: any_single           !! the formulation of a lane
    type(single_t), allocatable :: lane(:)                !! [lanes]
    real(wp), allocatable :: lane_acceleration(:, :)      !! q'' [rad/s2], work space, [lanes, freedoms]
    type(lane_parameters_t) :: parameters                 !! of a lane that starts
  contains
    procedure, public :: attach
    procedure, public :: derivative, find_sets, hold_jacobian, refresh_lane, observe, evaluation_obstacle
    procedure, public :: start_lane, indicator_values, set_indicator, block_indicators, find_fastest_wave, find_fastest_waves
    procedure, public :: change_branch
  end type joint_block_t

contains

  !> Makes the formulations of the lanes, after `formulate`.
  subroutine attach(self, machine)
    class(joint_block_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine   !! of one lane, with the structure of the block

    allocate (self%any_single, source=new_reduced(machine, self%has_energy_balance, as_block=.true.))
    allocate (self%lane(self%lanes))
    self%held = new_held_lanes(self%lanes, self%joints)
    allocate (self%lane_acceleration(self%lanes, size(self%moving)), source=0.0_wp)
  end subroutine attach

  !> Takes the branches and joints of a lane, after they have been decided.
  subroutine take_decision(self, lane)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: lane

    associate (single => self%lane(lane)%single)
      call self%state%take_branches(self%machine, lane, single%state, 1)
      single%joints%log%count = 0   ! nobody reads it
      call self%held%take_set(lane, single%joints)
    end associate
  end subroutine take_decision

  !> Gives the formulation of a lane the origin of the coordinates of that lane.
  subroutine give_origin(self, lane)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: lane

    self%lane(lane)%single%twist_at_origin(1, :) = self%twist_at_origin(lane, :)
  end subroutine give_origin

  !> Updates what depends on the parameters of a lane; its joints are made anew at its start.
  subroutine refresh_lane(self, lane)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%refresh_parameters(lane)
  end subroutine refresh_lane

  !> Prepares a lane that starts at time t and state y: its branches are chosen, and it is decided which joints are locked.
  subroutine start_lane(self, lane, t, y)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! state, [states + quadratures]

    if (.not. allocated(self%lane(lane)%single)) allocate (self%lane(lane)%single, source=self%any_single)
    call self%refresh_lane(lane)
    call self%norm%start_lane(lane, y, self%zero_twist(lane, :), self%machine%laws%rest(lane, :))
    call self%parameters%take(lane, with_structure=.false.)
    call self%pass_parameters(self%parameters)
    call self%parameters%give(1)
    call self%lane(lane)%single%pass_parameters(self%parameters)
    call self%lane(lane)%single%start_lane(1, t, y)
    call take_decision(self, lane)
  end subroutine start_lane

  !> The derivative, with the moments of the joints that hold.
  subroutine derivative(self, t, y, dydt, status)
    class(joint_block_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)                                         !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)         !! state
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)   !! its derivative
    integer, intent(inout) :: status(self%lanes)

    call self%find_sets(status)
    call self%reduced_t%derivative(t, y, dydt, status)
    call hold(self, dydt)
  end subroutine derivative

  !> Finds lanes without a motion that fits their joints; those that hold are known.
  subroutine find_sets(self, status)
    class(joint_block_t), intent(inout) :: self
    integer, intent(inout) :: status(self%lanes)
    integer :: lane

    do lane = 1, self%lanes
      if (.not. allocated(self%lane(lane)%single)) cycle
      if (self%lane(lane)%single%joints%lost > 0) status(lane) = evaluation_fatal
    end do
  end subroutine find_sets

  !> Adds what the joints that hold do to the accelerations of all lanes, and sets their moments.
  subroutine hold(self, acceleration)
    class(joint_block_t), intent(inout) :: self
    real(wp), intent(inout) :: acceleration(self%lanes, size(self%moving))   !! [rad/s2]

    call self%held%hold(self%incidence, 1, self%lanes, self%lanes, size(self%moving), acceleration)
  end subroutine hold

  !> The Jacobian where joints hold: each column has the accelerations that these leave.
  subroutine hold_jacobian(self, components, dfdy, dfdt)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: components                                      !! states + quadratures
    real(wp), intent(inout) :: dfdy(self%lanes, components, self%states)
    real(wp), intent(inout) :: dfdt(self%lanes, components)
    integer :: k

    call self%spread_jacobian(components, dfdy)
    if (.not. self%held%is_active) return
    do k = 1, self%states
      call hold(self, dfdy(:, :, k))
    end do
    call hold(self, dfdt)
  end subroutine hold_jacobian

  !> Evaluates bodies, elements and torques at a state of all lanes, whose joints keep their modes.
  subroutine observe(self, t, y, in_motion)
    class(joint_block_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states], at least
    logical, intent(in), optional :: in_motion    !! as in `observe_elements`, and true
    integer :: j

    if (.not. present(in_motion)) error stop 'nocdyn_joint_blocks: only motions are observed'
    call self%gather(y)
    call self%state%choose_branches(self%machine, t)
    call self%state%evaluate_elements(self%machine, t)
    if (self%held%is_active) then
      call find_held_moments(self)
      associate (applied => self%state%elements%applied)
        do j = 1, self%joints%count
          associate (e => self%joints%element(j))
            applied(:, e) = applied(:, e) + self%held%moment(:, j)
          end associate
        end do
      end associate
    end if
    call self%state%elements%scatter(self%machine%elements%rows, self%torque)
  end subroutine observe

  !> The moments of the joints that hold, after the evaluation of the elements.
  subroutine find_held_moments(self)
    class(joint_block_t), intent(inout) :: self
    integer :: b, c, k

    call self%state%elements%scatter(self%machine%elements%rows, self%torque)
    self%lane_acceleration(:, :) = 0.0_wp
    associate (coordinates => self%machine%coordinates, q => self%lane_acceleration)
      do b = 1, self%machine%bodies
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          c = coordinates%coordinate(k)
          q(:, c) = q(:, c) + coordinates%response(:, k) * self%torque(:, b)
        end do
      end do
    end associate
    call hold(self, self%lane_acceleration)
  end subroutine find_held_moments

  !> Indicators of all switches in all lanes.
  subroutine block_indicators(self, columns, t, y, g)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: columns
    real(wp), intent(in) :: t(self%lanes)                         !! [s]
    real(wp), intent(in) :: y(self%lanes, columns)
    real(wp), intent(inout) :: g(self%lanes, self%switches)
    integer :: lane, switch

    call self%reduced_t%block_indicators(columns, t, y, g)
    if (self%held%is_active) then
      call self%evaluate_at(self%lanes * self%machine%coordinates%freedoms, self%lanes * self%internal, t, y)
      call find_held_moments(self)
    end if
    do switch = 1, self%switches
      associate (joint => self%joints%joint_of(switch))
        if (joint == 0) cycle
        call self%held%find_rates(self%incidence, joint, 1, self%lanes, self%lanes, size(self%moving), y)
        do lane = 1, self%lanes
          if (.not. allocated(self%lane(lane)%single)) cycle
          associate (joints => self%lane(lane)%single%joints, banks => self%lane(lane)%single%machine%banks)
            joints%moment(joint) = self%held%moment(lane, joint)
            g(lane, switch) = joints%indicator(banks, joint, t(lane), self%held%rate(lane, joint))
          end associate
        end do
      end associate
    end do
  end subroutine block_indicators

  !> Indicators of all switches of one lane.
  subroutine indicator_values(self, lane, t, y, g)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]

    call give_origin(self, lane)
    call self%lane(lane)%single%indicator_values(1, t, y, g)
  end subroutine indicator_values

  !> Indicator of one switch.
  subroutine set_indicator(self, which, lane, t, y, g)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: which, lane            !! switch, 1 to `switches`; lane
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]

    call give_origin(self, lane)
    call self%lane(lane)%single%set_indicator(which, 1, t, y, g)
  end subroutine set_indicator

  !> The largest rate at which the moments of joints that hold oscillate at a state [rad/s].
  subroutine find_fastest_wave(self, lane, y, fastest)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp), intent(out) :: fastest

    call give_origin(self, lane)
    call self%lane(lane)%single%find_fastest_wave(1, y, fastest)
  end subroutine find_fastest_wave

  subroutine find_fastest_waves(self, columns, y, fastest)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: columns
    real(wp), intent(in) :: y(self%lanes, columns)
    real(wp), intent(inout) :: fastest(self%lanes)
    integer :: lane

    associate (f => self%machine%coordinates%freedoms, elements => self%state%elements)
      call self%twists%multiply_pair(self%twist_at_origin, y(1, f + 1), y, elements%angle, elements%speed)
    end associate
    do lane = 1, self%lanes
      fastest(lane) = self%fastest_wave(lane)
    end do
  end subroutine find_fastest_waves

  !> Changes the branch of a law of one lane, or decides anew which joints are locked.
  subroutine change_branch(self, lane, which, t, y)
    class(joint_block_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which                  !! switch, 1 to `switches`
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(inout) :: y(:)   !! state, [states + quadratures]

    call give_origin(self, lane)
    call self%lane(lane)%single%change_branch(1, which, t, y)
    call take_decision(self, lane)
  end subroutine change_branch

  !> Why no motion fits the joints of a lane.
  function evaluation_obstacle(self, lane) result(text)
    class(joint_block_t), intent(in) :: self
    integer, intent(in) :: lane
    character(len=:), allocatable :: text

    associate (single => self%lane(lane)%single)
      call describe_obstacle(single%joints, single%machine%banks, single%machine%elements%rows, single%machine%coordinates, text)
    end associate
  end function evaluation_obstacle

end module nocdyn_joint_blocks
