!> Formulations with joints that lock: clutches and freewheels (`nocdyn_joint_sets`), in a block of one lane.
module nocdyn_joint_formulation
  use nocdyn_formulation, only: choose_branch, indicate_branch, observe_elements, start_branches
  use nocdyn_friction_joints, only: direction_of, idle, locked
  use nocdyn_geared_pairs, only: has_other_ratio
  use nocdyn_joint_sets, only: boundary_shift, rest_width
  use nocdyn_kinds, only: wp
  use nocdyn_row_formulation, only: row_formulation_t
  implicit none (type, external)
  private

  public :: change_with_joints, observe_with_joints   ! for extensions that add to them

  integer, parameter :: by_state = 0   ! no joint

  type, abstract, extends(row_formulation_t), public :: joint_formulation_t
  contains
    procedure, private :: settle_joints
    procedure :: observe => observe_with_joints
    procedure :: start_lane => start_with_joints
    procedure :: indicator_values => indicate_all
    procedure :: set_indicator => indicate_one
    procedure :: find_fastest_wave
    procedure :: change_branch => change_with_joints
  end type joint_formulation_t

contains

  !> Evaluates bodies, elements and torques at a state, as `observe` of `formulation_t`.
  subroutine observe_with_joints(self, t, y, in_motion)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states], at least
    logical, intent(in), optional :: in_motion    !! as in `observe_elements`
    logical :: by_modes

    by_modes = .false.
    if (present(in_motion)) by_modes = in_motion
    if (self%joints%count > 0) then
      ! evaluates the elements where some joints may be locked, in a block of one lane
      self%joint_state(1, :) = y(1, :self%states)
      call self%gather(self%joint_state)
      call self%state%choose_branches(self%machine, [t(1)])
      self%near(:) = y(1, :self%states)
      if (self%joints%motions%count > 0) call self%project(t(1), self%near)
      if (.not. by_modes) call start_joints(self, t(1), self%near)
      call self%find_held_moments(t(1), self%near)
      call self%state%elements%scatter(self%machine%elements%rows, self%torque)
    else
      call observe_elements(self, t, y)
    end if
  end subroutine observe_with_joints

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

    if (any(self%joints%mode(:self%joints%locking) == locked) .or. self%joints%teeth%count > 0) then
      call self%find_held_moments(t, y(:self%states))
    end if
    do switch = 1, self%switches
      if (self%joints%joint_of(switch) > 0) then
        call set_joint_indicator(self, switch, t, y, g)
      else
        call indicate_branch(self, switch, lane, t, y, g)
      end if
    end do
  end subroutine indicate_all

  !> Indicator of one switch.
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
    associate (joint => self%joints%joint_of(which))
      if (self%joints%mode(joint) == locked .or. self%joints%has_teeth(joint)) call self%find_held_moments(t, y(:self%states))
    end associate
    call set_joint_indicator(self, which, t, y, g)
  end subroutine indicate_one

  !> Indicator of a joint; the moment of a locked one must be known.
  subroutine set_joint_indicator(self, switch, t, y, g)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: switch
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(in) :: y(:)      !! state, [states + quadratures]
    real(wp), contiguous, intent(inout) :: g(:)   !! [switches]

    associate (joint => self%joints%joint_of(switch))
      g(switch) = self%joints%indicator(self%machine%banks, joint, t, self%joint_slip(joint, y))
    end associate
  end subroutine set_joint_indicator

  !> The largest rate at which the moments of joints that hold oscillate at a state [rad/s].
  subroutine find_fastest_wave(self, lane, y, fastest)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp), intent(out) :: fastest

    self%joint_state(1, :) = y(:self%states)
    call self%gather(self%joint_state)
    fastest = self%fastest_wave(lane)
  end subroutine find_fastest_wave

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
      call engage_at_rest(self, findloc(self%joints%element, self%machine%switches%element(which), dim=1), t, y)
    end if
  end subroutine change_with_joints

  !> Decides anew which joints are locked where the engagement of one changes that others hold at rest.
  subroutine engage_at_rest(self, joint, t, y)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: joint                  !! the one whose engagement changes; nothing happens if it is 0
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(inout) :: y(:)   !! state, [states + quadratures]

    if (joint == 0) return
    if (self%joints%mode(joint) == locked) return
    if (abs(self%joint_slip(joint, y)) <= rest_width * speed_scale(self, y)) call settle_at_event(self, joint, t, y)
  end subroutine engage_at_rest

  !> The speed by which slips that are none are measured [rad/s].
  pure real(wp) function speed_scale(self, y)
    class(joint_formulation_t), intent(in) :: self
    real(wp), intent(in) :: y(:)   !! [states] at least

    speed_scale = max(1.0_wp, maxval(abs(y(:size(self%moving)))))
  end function speed_scale

  !> Decides which joints are locked at a state of a block of one lane: of those that are at rest, the one that has just come to
  !> rest or reached its capacity among them. Slips that are left over from rounding are taken out of the speeds. Teeth that jam
  !> are stopped in an event, by which the others are looked at again.
  subroutine settle_joints(self, which, t, y)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: which        !! the joint, or by_state: those without slip are at rest
    real(wp), intent(in) :: t           !! [s]
    real(wp), intent(inout) :: y(:)     !! [states] at least
    logical :: is_at_rest(self%joints%count), is_struck
    real(wp) :: speed
    integer :: j, turn

    associate (joints => self%joints)
      if (which /= by_state) joints%impulse(:) = 0.0_wp
      do turn = 0, joints%teeth%count
        if (joints%motions%count > 0) call self%project(t, y)
        speed = speed_scale(self, y)
        is_struck = turn > 0
        if (which /= by_state) call strike(self, t, rest_width * speed, y, is_struck)
        call decide_at(self, merge(by_state, which, is_struck), t, y, is_at_rest)
        if (which == by_state .or. .not. any(joints%is_jammed)) exit
      end do
      call self%hold(joints%motions%speed, y, of_speeds=.true.)
      call self%find_held_moments(t, y(:self%states))
      call joints%shift_boundaries(self%machine%banks, self%state%elements, t)
      do j = 1, joints%count
        if (is_at_rest(j) .and. joints%mode(j) /= locked) then   ! a drive may leave it a slip in the other direction
          joints%shift(j) = boundary_shift * speed + max(0.0_wp, -direction_of(joints%mode(j)) * self%joint_slip(j, y))
        end if
        if (joints%mode(j) == idle) joints%shift(j) = rest_width * speed
      end do
    end associate
  end subroutine settle_joints

  !> Decides the modes at a state.
  subroutine decide_at(self, which, t, y, is_at_rest)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: which                !! as in `settle_joints`; by_state also after an impact
    real(wp), intent(in) :: t                   !! [s]
    real(wp), intent(in) :: y(:)                !! [states] at least
    logical, intent(out) :: is_at_rest(:)       !! [joints]
    real(wp), parameter :: near = 1.0e3_wp   ! times the tolerance: from farther off it is not brought
    logical :: has_stopped, is_changed, is_solved
    real(wp) :: moments, resting(size(y)), slip(self%joints%count), tolerance
    integer :: j

    associate (joints => self%joints, elements => self%state%elements)
      tolerance = rest_width * speed_scale(self, y)
      do j = 1, joints%count
        slip(j) = self%joint_slip(j, y)
        is_at_rest(j) = abs(slip(j)) <= tolerance .or. j > joints%locking
        if (which /= by_state) is_at_rest(j) = is_at_rest(j) .or. joints%mode(j) == locked &
                                               .or. (j == which .and. joints%has_stopped(j, slip(j)))
      end do
      has_stopped = .false.
      if (which /= by_state) has_stopped = joints%mode(which) /= locked .and. is_at_rest(which)
      call joints%assume(self%machine%banks, self%state%banks, is_at_rest, slip)
      resting = y
      if (has_stopped) then
        ! The state after a joint has stopped, in which those at rest have no slip left, so that no acceleration comes from one.
        ! Others are at rest as well that they now hold there: of joints that stop at one time, the first one stops them all.
        associate (joints => self%joints)
          call self%hold(joints%motions%speed, resting(:size(self%moving)), of_speeds=.true.)
          is_changed = .false.
          do j = 1, joints%locking
            if (is_at_rest(j) .or. abs(slip(j)) > near * tolerance) cycle
            slip(j) = self%joint_slip(j, resting)
            is_at_rest(j) = abs(slip(j)) <= tolerance
            is_changed = is_changed .or. is_at_rest(j)
          end do
          if (is_changed) call joints%assume(self%machine%banks, self%state%banks, is_at_rest, slip)
        end associate
      end if
      call self%find_held_moments(t, resting(:self%states))
      call self%clean_rates()
      moments = sum(abs(elements%applied(1, :))) + sum(abs(elements%restoring(1, :)))
      joints%moment_shift = boundary_shift * max(moments, tiny(moments))
      call joints%decide(self%machine%banks, self%state%banks, t, is_at_rest, slip, is_solved)
    end associate
  end subroutine decide_at

  !> Changes the speeds where joints lock with a slip. The energy that is lost is work of these joints.
  subroutine strike(self, t, tolerance, y, is_struck)
    class(joint_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t            !! [s]
    real(wp), intent(in) :: tolerance    !! of a slip that is none [rad/s]
    real(wp), intent(inout) :: y(:)      !! [states] at least
    logical, intent(inout) :: is_struck   !! set where there are any
    real(wp), dimension(self%joints%count) :: before, impulse, slip
    integer :: j, work
    logical :: is_hit

    associate (joints => self%joints, elements => self%state%elements)
      before = [(self%joint_slip(j, y), j=1, joints%count)]
      slip = before
      slip(joints%locking + 1:) = 0.0_wp
      call joints%find_impact(self%machine%banks, t, slip, tolerance, impulse, is_hit)
      if (.not. is_hit) return
      is_struck = .true.
      joints%impulse(:) = joints%impulse + impulse
      do j = 1, joints%locking
        if (abs(impulse(j)) <= 0) cycle
        if (has_other_ratio(self%machine%coordinates, self%machine%elements%rows, joints%element(j))) joints%lost = j
      end do
      do j = 1, joints%count
        call self%push(j, impulse(j), y)
      end do
      if (size(y) <= self%states) return
      do j = 1, joints%count
        work = findloc(self%machine%with_work, joints%element(j), dim=1)
        if (work == 0) cycle   ! it has none
        work = self%states + work
        y(work) = y(work) + 0.5_wp * impulse(j) * (before(j) + self%joint_slip(j, y))
      end do
    end associate
  end subroutine strike

  !> Settles joints at an event in a motion, and notes it.
  subroutine settle_at_event(self, which, t, y)
    class(joint_formulation_t), intent(inout) :: self
    integer, intent(in) :: which                  !! joint
    real(wp), intent(in) :: t                     !! [s]
    real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]
    integer :: before(self%joints%count), j
    real(wp) :: slip(self%joints%count)

    before = self%joints%mode
    slip = [(self%joint_slip(j, y), j=1, self%joints%count)]
    call self%settle_joints(which, t, y)
    do j = 1, self%joints%locking
      if (self%joints%mode(j) == before(j)) cycle
      if (all([before(j), self%joints%mode(j)] /= locked)) then   ! another wheel drives, or others hold it at a bound
        if (direction_of(before(j)) == direction_of(self%joints%mode(j)) .or. .not. self%joints%is_moved(j)) cycle
      end if
      if (before(j) /= locked) then   ! it is not, and cannot be
        if (self%joints%is_open(self%machine%banks, j, t)) cycle
      end if
      self%joints%moment(j) = self%state%elements%applied(1, self%joints%element(j))
      call self%joints%note(t, j, before(j), slip(j), self%joints%impulse(j))
    end do
  end subroutine settle_at_event

end module nocdyn_joint_formulation
