!> Formulations with joints that lock: clutches and freewheels (`nocdyn_joint_sets`), in a block of one lane.
!>
!> Locked joints add their moments to those of the elements, so that q'' is that on the complement of all rows that hold.
!> Extensions say how the slips follow from the states, and how the states answer to the moments of joints.
module nocdyn_joint_formulation
  use nocdyn_formulation, only: choose_branch, formulation_t, indicate_branch, observe_elements, start_branches
  use nocdyn_friction_joints, only: locked
  use nocdyn_joint_sets, only: boundary_shift, rest_width
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  integer, parameter :: by_state = 0   ! no joint

  type, abstract, extends(formulation_t), public :: joint_formulation_t
    real(wp), allocatable :: acceleration(:)             !! of the first states without locked joints, work space, [moving]
    real(wp), allocatable, private :: joint_state(:, :)  !! work space, [1, states]
  contains
    procedure :: prepare_joints
    procedure :: hold
    procedure(accelerate_interface), deferred :: accelerate
    procedure(rate_interface), deferred :: joint_rate
    procedure(push_interface), deferred :: push
    procedure, private :: find_held_moments
    procedure, private :: settle_joints
    procedure :: observe => observe_with_joints
    procedure :: start_lane => start_with_joints
    procedure :: indicator_values => indicate_all
    procedure :: set_indicator => indicate_one
    procedure :: change_branch => change_with_joints
  end type joint_formulation_t

  abstract interface

    !> The accelerations of the first states from the torques `torque` on the bodies, in a block of one lane.
    subroutine accelerate_interface(self, acceleration)
      import :: joint_formulation_t, wp
      class(joint_formulation_t), intent(inout) :: self
      real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [moving]
    end subroutine accelerate_interface

    !> The slip of a joint from the speeds of the first states, or its derivative from their accelerations.
    pure real(wp) function rate_interface(self, joint, rates)
      import :: joint_formulation_t, wp
      class(joint_formulation_t), intent(in) :: self
      integer, intent(in) :: joint
      real(wp), intent(in) :: rates(:)   !! [rad/s] or [rad/s2], [moving] at least
    end function rate_interface

    !> Adds what the moment or the impulse of a joint does to the accelerations or speeds of the first states.
    pure subroutine push_interface(self, joint, moment, rates)
      import :: joint_formulation_t, wp
      class(joint_formulation_t), intent(in) :: self
      integer, intent(in) :: joint
      real(wp), intent(in) :: moment        !! [N m] or [N m s]
      real(wp), intent(inout) :: rates(:)   !! [moving] at least
    end subroutine push_interface

  end interface

contains

  !> Evaluates bodies, elements and torques at a state, as `observe` of `formulation_t`.
  subroutine observe_with_joints(self, t, y)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states], at least

    call observe_elements(self, t, y)
    if (self%joints%count > 0) call observe_joints(self, t(1), y(1, :self%states))
  end subroutine observe_with_joints

  !> Evaluates the elements where some joints may be locked, in a block of one lane.
  subroutine observe_joints(self, t, y)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t      !! [s]
    real(wp), intent(in) :: y(:)   !! [states]
    real(wp) :: moved(size(y))

    if (associated(self%joints%leader)) then
      call self%joints%follow(self%machine%banks)
    else
      moved = y
      call self%settle_joints(by_state, t, moved)
    end if
    call self%find_held_moments(t, y)
    call self%machine%elements%scatter(self%torque)
  end subroutine observe_joints

  !> Prepares a lane that starts at time t and state y.
  subroutine start_with_joints(self, lane, t, y)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! state, [states + quadratures]

    call start_branches(self, lane, t, y)
    if (self%joints%count > 0) call start_joints(self, t, y)
  end subroutine start_with_joints

  !> Decides which joints are locked at the start.
  subroutine start_joints(self, t, y)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t      !! [s]
    real(wp), intent(in) :: y(:)   !! [states] at least
    real(wp) :: moved(size(y))

    moved = y
    call self%settle_joints(by_state, t, moved)
  end subroutine start_joints

  !> Indicators of all switches of one lane. The moments of locked joints are found once.
  subroutine indicate_all(self, lane, t, y, g)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]
    integer :: switch

    if (any(self%joints%mode == locked)) call self%find_held_moments(t, y(:self%states))
    do switch = 1, self%switches
      if (self%joints%joint_of(switch) > 0) then
        call set_joint_indicator(self, switch, t, y, g)
      else
        call indicate_branch(self, switch, lane, t, y, g)
      end if
    end do
  end subroutine indicate_all

  !> One of them.
  subroutine indicate_one(self, which, lane, t, y, g)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: which, lane            !! switch, 1 to `switches`; lane
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]

    if (self%joints%joint_of(which) == 0) then
      call indicate_branch(self, which, lane, t, y, g)
      return
    end if
    if (self%joints%mode(self%joints%joint_of(which)) == locked) call self%find_held_moments(t, y(:self%states))
    call set_joint_indicator(self, which, t, y, g)
  end subroutine indicate_one

  !> That of a joint, if it is not locked or its moment has been found.
  subroutine set_joint_indicator(self, switch, t, y, g)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: switch
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]

    associate (joint => self%joints%joint_of(switch))
      g(switch) = self%joints%indicator(self%machine%banks, joint, t, self%joint_rate(joint, y))
    end associate
  end subroutine set_joint_indicator

  !> Changes the branch of a law, or decides anew which joints are locked.
  subroutine change_with_joints(self, lane, which, t, y)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which                  !! switch, 1 to `switches`
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(inout) :: y(:)   !! state, [states + quadratures]

    if (self%joints%joint_of(which) > 0) then
      call settle_at_event(self, self%joints%joint_of(which), t, y)
    else
      call choose_branch(self, lane, which, t, y)
    end if
  end subroutine change_with_joints

  !> How the joints of the machine act on one another in the first lane.
  subroutine prepare_joints(self)
    class(joint_formulation_t), intent(inout) :: self
    integer :: i, j

    call self%joints%start()
    if (self%joints%count == 0) return
    self%acceleration = spread(0.0_wp, 1, size(self%moving))
    self%joint_state = reshape(spread(0.0_wp, 1, self%states), [1, self%states])
    do j = 1, self%joints%count
      self%acceleration(:) = 0.0_wp
      call self%push(j, 1.0_wp, self%acceleration)
      do i = 1, self%joints%count
        self%joints%weight(i, j) = self%joint_rate(i, self%acceleration)
      end do
    end do
  end subroutine prepare_joints

  !> The moments of the locked joints at a state of a block of one lane, where the branches are known; they are put among those of
  !> the elements.
  subroutine find_held_moments(self, t, y)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t      !! [s]
    real(wp), intent(in) :: y(:)   !! [states]

    self%joint_state(1, :) = y
    call self%gather(self%joint_state)
    call self%machine%evaluate_elements([t])
    call self%machine%elements%scatter(self%torque)
    call self%accelerate(self%acceleration)
    call self%hold(self%acceleration)
  end subroutine find_held_moments

  !> Adds the moments of the locked joints to the accelerations of the first states, and puts them among those of the elements.
  subroutine hold(self, acceleration)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [moving] at least; or speeds [rad/s]
    integer :: j

    associate (joints => self%joints)
      do j = 1, joints%count
        joints%rate(j) = self%joint_rate(j, acceleration)
      end do
      call joints%find_moments()
      do j = 1, joints%count
        if (joints%mode(j) /= locked) cycle
        call self%push(j, joints%moment(j), acceleration)
        self%machine%elements%applied(1, joints%element(j)) = joints%moment(j)
      end do
    end associate
  end subroutine hold

  !> Decides which joints are locked at a state of a block of one lane: of those that are at rest, the one that has just come to
  !> rest or reached its capacity among them. Slips that are left over from rounding are taken out of the speeds.
  subroutine settle_joints(self, which, t, y)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: which        !! the joint, or by_state: those without slip are at rest
    real(wp), intent(in) :: t           !! [s]
    real(wp), intent(inout) :: y(:)     !! [states] at least
    logical :: is_at_rest(self%joints%count), is_solved, is_struck
    real(wp) :: slip(self%joints%count), moments, speed
    integer :: j

    associate (joints => self%joints, elements => self%machine%elements)
      speed = max(1.0_wp, maxval(abs(y(:size(self%moving)))))
      is_struck = .false.
      if (which /= by_state) call strike(self, t, rest_width * speed, y, is_struck)
      do j = 1, joints%count
        slip(j) = self%joint_rate(j, y)
        is_at_rest(j) = abs(slip(j)) <= rest_width * speed
        if (which /= by_state .and. .not. is_struck) is_at_rest(j) = is_at_rest(j) .or. joints%mode(j) == locked .or. j == which
      end do
      call joints%assume(self%machine%banks, is_at_rest, slip)
      call self%find_held_moments(t, y(:self%states))
      call joints%decide(self%machine%banks, t, is_at_rest, slip, is_solved)
      do j = 1, joints%count
        if (is_at_rest(j) .and. joints%mode(j) /= locked) joints%shift(j) = boundary_shift * speed
      end do
      moments = sum(abs(elements%applied(1, :))) + sum(abs(elements%restoring(1, :)))
      joints%moment_shift = boundary_shift * max(moments, tiny(moments))
      call self%hold(y)
    end associate
  end subroutine settle_joints

  !> Changes the speeds where joints lock with a slip. The energy that is lost is work of these joints.
  subroutine strike(self, t, tolerance, y, is_struck)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t            !! [s]
    real(wp), intent(in) :: tolerance    !! of a slip that is none [rad/s]
    real(wp), intent(inout) :: y(:)      !! [states] at least
    logical, intent(out) :: is_struck
    real(wp) :: before(self%joints%count)
    integer :: j, work

    associate (joints => self%joints)
      before = [(self%joint_rate(j, y), j=1, joints%count)]
      call joints%find_impact(self%machine%banks, t, before, tolerance, joints%impulse, is_struck)
      if (.not. is_struck) return
      do j = 1, joints%count
        call self%push(j, joints%impulse(j), y)
      end do
      if (size(y) <= self%states) return
      do j = 1, joints%count
        work = self%states + findloc(self%machine%with_work, joints%element(j), dim=1)
        y(work) = y(work) + 0.5_wp * joints%impulse(j) * (before(j) + self%joint_rate(j, y))
      end do
    end associate
  end subroutine strike

  !> The same at an event in a motion, which is noted.
  subroutine settle_at_event(self, which, t, y)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: which                  !! joint
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]
    integer :: before(self%joints%count), j
    real(wp) :: slip(self%joints%count)

    before = self%joints%mode
    slip = [(self%joint_rate(j, y), j=1, self%joints%count)]
    call self%settle_joints(which, t, y)
    call self%find_held_moments(t, y(:self%states))
    do j = 1, self%joints%count
      if (self%joints%mode(j) == before(j)) cycle
      if (before(j) /= locked) then   ! it is not, and cannot be
        if (self%joints%is_open(self%machine%banks, j, t)) cycle
      end if
      self%joints%moment(j) = self%machine%elements%applied(1, self%joints%element(j))
      call self%joints%note(t, j, before(j), slip(j), self%joints%impulse(j))
    end do
  end subroutine settle_at_event

end module nocdyn_joint_formulation
