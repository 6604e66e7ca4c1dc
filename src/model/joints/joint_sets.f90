!> Clutches and freewheels of a machine, which lock and slip, among the rows that hold (`nocdyn_held_rows`).
!>
!> After an event, which joints lock is a complementarity problem over all that are at rest together: a joint whose moment is
!> inside its range stays, one at a bound slips away from it, or would if redundant others did not hold it. Its moment then is
!> the moment of slip, which may be smaller than at rest, and the others are looked at again. A row that moves has no bounds.
module nocdyn_joint_sets
  use nocdyn_bank, only: bank_slot_t
  use nocdyn_bank_states, only: bank_state_t
  use nocdyn_bounded_complementarity, only: at_upper, is_free, solve_bounded_complementarity, solve_scaled_complementarity
  use nocdyn_elements, only: element_values_t
  use nocdyn_friction_joints, only: direction_of, friction_joints_t, idle, locked, slips_backwards, &
    slips_forwards
  use nocdyn_held_rows, only: held_rows_t
  use nocdyn_joint_choices, only: joint_choices_t
  use nocdyn_joint_log, only: joint_event_t, joint_log_t, new_joint_log
  use nocdyn_kinds, only: wp
  use nocdyn_row_motions, only: new_row_motions
  use nocdyn_switches, only: switches_t
  use nocdyn_tooth_loads, only: new_tooth_loads, widened
  use nocdyn_tooth_losses, only: tooth_losses_t
  implicit none (type, external)
  private

  public :: new_joint_sets

  real(wp), parameter, public :: rest_width = 1.0e-10_wp      !! a slip below it is none, relative to the speeds
  real(wp), parameter, public :: boundary_shift = 1.0e-12_wp  !! shift of boundaries outwards, relative to speeds or moments

  type, extends(held_rows_t), public :: joint_sets_t
    integer, allocatable :: bank(:), number(:)   !! bank of each joint, and its number there, [joints] as all that follow
    integer, allocatable :: joint_of(:)      !! joint of each switch of the machine, 0 for none, [switches]
    real(wp), allocatable :: impulse(:)      !! of the last impact [N m s]; 0 after other events
    real(wp), allocatable :: shift(:)        !! by which the boundary of a slip lies beyond zero [rad/s]
    logical, allocatable :: is_jammed(:)     !! teeth that turn and stop at once, by an impulse
    real(wp) :: moment_shift = 0.0_wp        !! by which the boundaries of the moments lie beyond their ranges [N m]
    type(joint_log_t) :: log                 !! of the motion
  contains
    procedure :: start
    procedure :: assume
    procedure :: decide
    procedure :: find_impact
    procedure :: note
    procedure :: shift_boundaries
    procedure :: indicator
    procedure :: is_open
    procedure :: has_teeth, has_stopped, is_moved, only_lock
  end type joint_sets_t

contains

  !> The joints of a machine, none of which is locked.
  function new_joint_sets(banks, switches, elements) result(self)
    type(bank_slot_t), intent(in) :: banks(:)
    type(switches_t), intent(in) :: switches
    integer, intent(in) :: elements   !! of the machine
    type(joint_sets_t) :: self
    integer :: b, e, k, next

    self%motions = new_row_motions(banks)
    allocate (self%element(0), self%bank(0), self%number(0), self%joint_of(switches%count))
    self%joint_of(:) = 0
    next = 0
    do b = 1, size(banks)
      select type (bank => banks(b)%bank)
      class is (friction_joints_t)
        do e = 1, bank%count
          self%element = [self%element, bank%first - 1 + e]
          self%bank = [self%bank, b]
          self%number = [self%number, e]
          k = next + (bank%mode_switch - 1) * bank%count + e
          self%joint_of(k) = size(self%element)
        end do
      end select
      next = next + size(banks(b)%bank%switch_element)
    end do
    self%locking = size(self%element)
    self%driver = [spread(0, 1, self%locking), self%motions%driver]
    self%element = [self%element, self%motions%element]
    self%bank = [self%bank, self%motions%bank]
    self%number = [self%number, self%motions%number]
    self%count = size(self%element)
    self%teeth = new_tooth_loads(banks, self%bank, self%number, elements)
    call self%allocate_rows(slips_forwards)
    allocate (self%shift(self%count), self%impulse(self%count), source=0.0_wp)
    allocate (self%is_jammed(self%count), source=.false.)
    self%log = new_joint_log()
  end function new_joint_sets

  !> Weighs the rows at the start, where `mutual` is known, and gives the laws the modes.
  subroutine start(self, banks, states)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(inout) :: states(:)   !! of the banks

    call self%start_rows()
    call set_modes(self, banks, states)
  end subroutine start

  !> Whether all joints only lock and slip: then each lane of a block may have a set of its own, and moments have Taylor series.
  !> Rows that move and teeth with losses do more.
  pure logical function only_lock(self)
    class(joint_sets_t), intent(in) :: self

    only_lock = self%motions%count == 0 .and. self%teeth%count == 0
  end function only_lock

  !> Whether a joint is one of teeth with losses.
  pure logical function has_teeth(self, joint)
    class(joint_sets_t), intent(in) :: self
    integer, intent(in) :: joint

    has_teeth = self%teeth%loss_of(joint) > 0
  end function has_teeth

  !> Whether a joint whose mode ends does so because its slip has ended. The mode of teeth may end where the other wheel drives.
  pure logical function has_stopped(self, joint, slip)
    class(joint_sets_t), intent(in) :: self
    integer, intent(in) :: joint
    real(wp), intent(in) :: slip   !! u' [rad/s]

    has_stopped = .true.
    if (self%has_teeth(joint)) has_stopped = direction_of(self%mode(joint)) * slip + self%shift(joint) <= 0
  end function has_stopped

  !> Whether a joint cannot have any moment.
  logical function is_open(self, banks, joint, t)
    class(joint_sets_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: joint
    real(wp), intent(in) :: t   !! [s]
    real(wp) :: least, most, sliding(2)

    call find_ranges(self, banks, joint, t, least, most, sliding)
    is_open = most <= least
  end function is_open

  !> Locks the joints at rest without any moment, until `decide`; the others slip.
  subroutine assume(self, banks, states, is_at_rest, slip)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(inout) :: states(:)   !! of the banks
    logical, intent(in) :: is_at_rest(:)   !! [joints]
    real(wp), intent(in) :: slip(:)        !! u' [rad/s], [joints]

    self%is_assumed = .true.
    self%mode(:) = merge(locked, merge(slips_forwards, slips_backwards, slip > 0), is_at_rest)
    call set_modes(self, banks, states)
    call self%change_set()
  end subroutine assume

  !> Decides the modes of the joints at rest at a time t; the others have the modes of their slips. `rate` has the accelerations
  !> without any moment of the joints at rest.
  subroutine decide(self, banks, states, t, is_at_rest, slip, is_solved)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(inout) :: states(:)   !! of the banks
    real(wp), intent(in) :: t                !! [s]
    logical, intent(in) :: is_at_rest(:)     !! [joints]
    real(wp), intent(in) :: slip(:)          !! u' [rad/s], [joints]
    logical, intent(out) :: is_solved
    integer, allocatable :: resting(:)
    integer :: i

    self%is_assumed = .false.
    where (.not. is_at_rest) self%mode = merge(slips_forwards, slips_backwards, slip > 0)
    self%shift(:) = 0.0_wp
    if (self%teeth%count > 0) then
      call decide_with_teeth(self, banks, t, is_at_rest, slip, is_solved)
    else
      resting = pack([(i, i=1, self%count)], is_at_rest)
      call decide_resting(self, banks, t, resting, is_solved)
    end if
    do i = 1, self%locking
      if (is_at_rest(i)) call rest_idly(self, banks, i, t)
    end do
    call set_modes(self, banks, states)
    call self%change_set()
  end subroutine decide

  elemental logical function is_unbounded(moment)
    real(wp), intent(in) :: moment   !! [N m]

    is_unbounded = abs(moment) >= huge(moment)
  end function is_unbounded

  !> The impulses that end slips which joints without bounds do not allow, and the impulses of teeth that jam. Finite friction
  !> contributes no impulse. A slip that none can end is `lost`: another joint or a drive does not let it.
  subroutine find_impact(self, banks, t, slip, tolerance, impulse, is_struck)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    real(wp), intent(in) :: t            !! [s]
    real(wp), intent(in) :: slip(:)      !! u' [rad/s], [joints]
    real(wp), intent(in) :: tolerance    !! of a slip that is none [rad/s]
    real(wp), intent(out) :: impulse(:)  !! [N m s], [joints]
    logical, intent(out) :: is_struck    !! whether there are any
    real(wp), dimension(self%count) :: least, most, slip_after
    real(wp) :: sliding(2)
    integer :: j, state(self%count)
    logical :: is_solved, is_wrong(self%count)

    impulse = 0.0_wp
    do j = 1, self%count
      call find_ranges(self, banks, j, t, least(j), most(j), sliding)
    end do
    where (self%is_jammed)
      least = -huge(1.0_wp)
      most = huge(1.0_wp)
    end where
    where (.not. is_unbounded(least)) least = 0.0_wp
    where (.not. is_unbounded(most)) most = 0.0_wp
    is_wrong = (slip > tolerance .and. is_unbounded(least)) .or. (slip < -tolerance .and. is_unbounded(most))
    is_struck = any(is_wrong)
    if (.not. is_struck) return
    call solve_bounded_complementarity(self%weight, slip, least, most, impulse, slip_after, state, is_solved)
    if (.not. is_solved) self%lost = findloc(is_wrong, .true., dim=1)
    self%is_jammed(:) = .false.
  end subroutine find_impact

  !> Whether the accelerations of the joints, after `find_moments`, move a joint whose slip has ended.
  pure logical function is_moved(self, joint)
    class(joint_sets_t), intent(in) :: self
    integer, intent(in) :: joint
    real(wp), parameter :: rounding = 1.0e-10_wp

    associate (parts => self%weight(joint, :) * self%moment, rate => self%rate(joint))
      is_moved = abs(rate + sum(parts)) > rounding * (abs(rate) + sum(abs(parts)))
    end associate
  end function is_moved

  !> Sets the mode of an open joint at rest that does not begin to slip.
  subroutine rest_idly(self, banks, joint, t)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: joint
    real(wp), intent(in) :: t   !! [s]

    if (self%has_teeth(joint) .or. self%is_moved(joint)) return
    if (self%is_open(banks, joint, t)) self%mode(joint) = idle
  end subroutine rest_idly

  !> Decides the modes of the joints at rest: whenever some slip, the others are looked at again.
  subroutine decide_resting(self, banks, t, resting, is_solved)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    real(wp), intent(in) :: t            !! [s]
    integer, intent(in) :: resting(:)    !! joints
    logical, intent(out) :: is_solved
    real(wp), dimension(size(resting)) :: a, least, most, scale, x
    real(wp) :: sliding(2, size(resting))
    integer :: i, state(size(resting))
    logical :: has_changed

    do i = 1, size(resting)
      call find_ranges(self, banks, resting(i), t, least(i), most(i), sliding(:, i))
    end do
    scale = 1.0_wp   ! redundant locks share with the least norm of `find_moments`
    do i = 1, merge(size(resting), 0, self%motions%count > 0)
      scale(i) = 1.0_wp / sqrt(max(self%weight(resting(i), resting(i)), tiny(scale)))
    end do
    self%mode(resting) = locked
    self%moment(:) = 0.0_wp
    has_changed = .true.
    do while (has_changed)
      has_changed = .false.
      call solve_scaled_complementarity(self%weight(resting, resting), self%rate(resting), scale, reshape([least, most], &
                                        [size(x), 2]), x, a, state, is_solved)
      if (.not. is_solved) then   ! other rows contradict one of these
        self%lost = resting(maxloc(abs(a), dim=1))
        return
      end if
      do i = 1, size(resting)
        if (self%mode(resting(i)) /= locked .or. state(i) == is_free) cycle
        self%mode(resting(i)) = slips_forwards
        if (state(i) == at_upper .or. (least(i) >= most(i) .and. a(i) < 0)) self%mode(resting(i)) = slips_backwards
        most(i) = sliding(merge(1, 2, self%mode(resting(i)) == slips_forwards), i)
        has_changed = has_changed .or. abs(most(i) - x(i)) > 0
        least(i) = most(i)
      end do
    end do
    self%moment(resting) = x
  end subroutine decide_resting

  !> Decides joints at rest where some are teeth with losses: which of their wheels drives is decided even where they turn.
  subroutine decide_with_teeth(self, banks, t, is_at_rest, slip, is_solved)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    real(wp), intent(in) :: t                !! [s]
    logical, intent(in) :: is_at_rest(:)     !! [joints]
    real(wp), intent(in) :: slip(:)          !! u' [rad/s], [joints]
    logical, intent(out) :: is_solved
    type(joint_choices_t) :: choices
    integer :: j
    real(wp) :: slope, speed

    allocate (choices%w, source=self%weight)
    allocate (choices%v, source=0.0_wp * self%weight)
    allocate (choices%rate, source=self%rate)
    allocate (choices%is_at_rest, source=is_at_rest)
    allocate (choices%slip, source=slip)
    allocate (choices%mode, source=self%mode)
    allocate (choices%moment, source=self%moment)
    allocate (choices%least, choices%most, choices%load, choices%driving, choices%driven, source=0.0_wp * slip)
    allocate (choices%sliding(2, self%count), source=0.0_wp)
    choices%has_teeth = [(self%has_teeth(j), j=1, self%count)]
    do j = 1, self%count
      call find_ranges(self, banks, j, t, choices%least(j), choices%most(j), choices%sliding(:, j))
      if (.not. choices%has_teeth(j)) cycle
      speed = merge(0.0_wp, slip(j), is_at_rest(j))
      choices%v(j, :) = self%teeth%by_joint(self%teeth%loss_of(j), :)
      choices%load(j) = self%teeth%applied(self%teeth%loss_of(j))
      select type (bank => banks(self%bank(j))%bank)
      class is (tooth_losses_t)
        call bank%share(self%number(j), .true., speed, choices%driving(j), slope)
        call bank%share(self%number(j), .false., speed, choices%driven(j), slope)
      end select
    end do
    choices%most_beyond = 0.1_wp * self%moment_shift
    call choices%choose()
    self%mode(:) = choices%mode
    self%moment(:) = choices%moment
    is_solved = choices%doubtful == 0
    if (.not. is_solved) self%lost = choices%doubtful
    if (choices%jammed > 0) self%is_jammed(choices%jammed) = .true.
  end subroutine decide_with_teeth

  !> The moments between which a joint is at rest, and its moments when it slips forwards and backwards.
  subroutine find_ranges(self, banks, joint, t, least, most, sliding)
    class(joint_sets_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: joint
    real(wp), intent(in) :: t   !! [s]
    real(wp), intent(out) :: least, most, sliding(2)   !! [N m]

    select type (bank => banks(self%bank(joint))%bank)
    class is (tooth_losses_t)
      call bank%range_under_load(self%number(joint), self%teeth%load(self%teeth%loss_of(joint)), least, most)
      sliding = 0.0_wp
    class is (friction_joints_t)
      call bank%find_range(self%number(joint), t, least, most, sliding)
    class default   ! a row that moves
      least = -huge(least)
      most = huge(most)
      sliding = 0.0_wp
    end select
  end subroutine find_ranges

  !> Gives the laws the modes.
  subroutine set_modes(self, banks, states)
    type(joint_sets_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(inout) :: states(:)   !! of the banks
    integer :: j

    do j = 1, self%locking
      select type (bank => banks(self%bank(j))%bank)
      class is (friction_joints_t)
        call bank%set_mode(states(self%bank(j)), self%number(j), self%mode(j))
      end select
    end do
  end subroutine set_modes

  !> Keeps an event of a joint whose mode was `from`.
  subroutine note(self, t, joint, from, slip, impulse)
    class(joint_sets_t), intent(inout) :: self
    real(wp), intent(in) :: t         !! [s]
    integer, intent(in) :: joint, from
    real(wp), intent(in) :: slip      !! u' before [rad/s]
    real(wp), intent(in) :: impulse   !! [N m s]

    call self%log%add(joint_event_t(t, joint, from, self%mode(joint), 0.0_wp - slip, self%moment(joint), impulse))
  end subroutine note

  !> Shifts the boundaries of moments, and of the torques of teeth, after a decision.
  subroutine shift_boundaries(self, banks, elements, t)
    class(joint_sets_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(element_values_t), intent(in) :: elements
    real(wp), intent(in) :: t   !! [s]
    integer :: j
    real(wp) :: inside, least, most, sliding(2)

    call self%teeth%shift_boundaries(elements, self%moment_errors(), self%moment_shift, self%mode)
    inside = 0.0_wp
    do j = 1, self%locking
      if (self%mode(j) /= locked) cycle
      call find_ranges(self, banks, j, t, least, most, sliding)
      inside = min(inside, most - self%moment(j), self%moment(j) - least)
    end do
    self%moment_shift = widened(self%moment_shift, inside)
  end subroutine shift_boundaries

  !> Positive in the present mode of a joint: its slip, or how far its moment is inside the range [N m]. Teeth that turn change
  !> their mode with the sign of their torque as well.
  real(wp) function indicator(self, banks, joint, t, slip) result(g)
    class(joint_sets_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: joint
    real(wp), intent(in) :: t      !! [s]
    real(wp), intent(in) :: slip   !! u' [rad/s]
    real(wp) :: least, most, sliding(2)

    call find_ranges(self, banks, joint, t, least, most, sliding)
    associate (mode => self%mode(joint), moment => self%moment(joint))
      if (self%is_jammed(joint)) then
        g = -1.0_wp   ! an impulse is due
      else if (mode == locked) then
        g = min(most - moment, moment - least) + self%moment_shift
      else if (mode == idle) then
        g = self%shift(joint) - abs(slip)
      else
        g = direction_of(mode) * slip + self%shift(joint)
        if (mode == slips_forwards .and. is_unbounded(least)) g = -1.0_wp   ! there is no such slip
        if (mode == slips_backwards .and. is_unbounded(most)) g = -1.0_wp
        if (.not. self%has_teeth(joint)) return
        associate (loss => self%teeth%loss_of(joint))
          g = min(g, self%teeth%power_of_driver(loss, mode) + self%teeth%shift(loss))
        end associate
      end if
    end associate
  end function indicator

end module nocdyn_joint_sets
