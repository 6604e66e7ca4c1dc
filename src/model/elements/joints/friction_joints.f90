!> Joints of two bodies that lock: clutches, brakes, dog clutches and freewheels.
!>
!> A locked joint is a row u' = 0 of L_lambda, whose reaction is its moment M; it slips where M would leave the range
!> from `least` to `most`. Slipping forwards (u' > 0) the joint has its least moment, slipping backwards its greatest: Coulomb
!> friction, with other numbers than at rest. A clutch has a range about zero; a freewheel has a range on one side of it and
!> overruns on the other. A dog clutch has no bounds, nor has a freewheel without a capacity on its side: where one locks with a
!> slip, there is an impact. All grow with the engagement, a table over the time or 1. The friction while a joint slips may depend
!> on the speed of the slip, by a table.
!>
!> The mode is a branch of the law that is not chosen by guards: which joints lock follows from all of them together
!> (`nocdyn_joint_sets`).
module nocdyn_friction_joints
  use nocdyn_bank, only: bank_t, role_bearing
  use nocdyn_bank_states, only: bank_state_t
  use nocdyn_curves, only: curve_t
  use nocdyn_element_rows, only: rows_between
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), pick, speed_of, time_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_quantities, only: form_applied, form_speed, new_quantity, quantity_t, rank_loss, rank_slip, rank_torque
  use nocdyn_tables, only: add_table, curve_value, guard_picked_square, guard_segment, picked_value
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_friction_joints, first_wheel_drives, direction_of

  integer, parameter, public :: locked = 1, slips_forwards = 2, slips_backwards = 3   !! modes
  integer, parameter, public :: idle = 4   !! mode of a joint without a moment whose slip is held at zero by others
  !> Modes of teeth with losses whose first wheel drives; where it is driven they are `slips_...`.
  integer, parameter, public :: driven_forwards = 5, driven_backwards = 6

  integer, parameter :: at_least = 1, at_most = 2, slip_least = 3, slip_most = 4   ! numbers of the parameters

  !> The ranges of the moments of joints with full engagement [N m], shape [lanes, joints] all. Those at rest may be huge.
  type, public :: joint_ranges_t
    real(wp), allocatable :: least(:, :), most(:, :)                   !! at rest
    real(wp), allocatable :: sliding_least(:, :), sliding_most(:, :)   !! slipping; 0 where there is no such slip
  end type joint_ranges_t

  type, extends(bank_t), public :: friction_joints_t
    integer :: mode_switch = 1   !! of each element, the switch of its mode
    type(curve_t), allocatable :: over_slip   !! friction while it slips [N m] over the speed of the slip [rad/s] of all elements
  contains
    procedure :: connect_joints
    procedure :: add_modes
    procedure :: describe
    procedure :: find_range
    procedure :: set_mode
    procedure :: set_mode_by_slip
    procedure :: extremes
    procedure :: quantities
  end type friction_joints_t

contains

  !> Whether the first wheel of teeth with losses drives the second one.
  elemental logical function first_wheel_drives(mode)
    integer, intent(in) :: mode

    first_wheel_drives = mode == driven_forwards .or. mode == driven_backwards
  end function first_wheel_drives

  !> The sign of the slip u', 0 where there is none.
  elemental integer function direction_of(mode)
    integer, intent(in) :: mode

    select case (mode)
    case (slips_forwards, driven_forwards)
      direction_of = 1
    case (slips_backwards, driven_backwards)
      direction_of = -1
    case default
      direction_of = 0
    end select
  end function direction_of

  !> A bank of joints.
  function new_friction_joints(role, names, from, to, ranges, engagement, over_slip) result(bank)
    integer, intent(in) :: role                 !! role_clutch, role_freewheel or role_bearing
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)       !! bodies, 0 = ground
    type(joint_ranges_t), intent(in) :: ranges
    type(curve_t), intent(in), optional :: engagement(:, :)   !! over the time [s], shape [lanes, joints]; absent: 1
    type(curve_t), intent(in), optional :: over_slip          !! friction of all while they slip [N m], over the speed
                                                              !! [rad/s] from 0 on; absent: as for the ranges
    type(friction_joints_t) :: bank
    integer :: e

    call bank%connect_joints(role, size(ranges%least, 1), names, from, to)
    call bank%add_parameter('least', ranges%least, is_key=.false.)
    call bank%add_parameter('most', ranges%most, is_key=.false.)
    call bank%add_parameter('sliding least', ranges%sliding_least, is_key=.false.)
    call bank%add_parameter('sliding most', ranges%sliding_most, is_key=.false.)
    if (present(engagement)) then
      call add_table(bank, engagement)
    end if
    call bank%add_modes()
    if (present(over_slip)) then
      allocate (bank%over_slip, source=over_slip)
      call bank%add_switches([('point in the table', e=1, bank%count)], over_slip%points())
    end if
    call bank%prepare_law()
  end function new_friction_joints

  !> Sets the bodies of joints whose law is no polynomial. Every constructor calls it first.
  subroutine connect_joints(self, role, lanes, names, from, to)
    class(friction_joints_t), intent(inout) :: self
    integer, intent(in) :: role, lanes
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)   !! bodies, 0 = ground

    call self%connect(role, lanes, names, rows_between(from, to))
    self%is_polynomial = .false.
    self%has_paper_law = .false.
    self%elastic = [integer ::]
  end subroutine connect_joints

  !> Gives every joint the switch of its mode, after the one of an engagement.
  subroutine add_modes(self)
    class(friction_joints_t), intent(inout) :: self
    integer :: e

    if (allocated(self%curve)) self%mode_switch = 2
    call self%add_switches([('locking', e=1, self%count)], -1)
  end subroutine add_modes

  subroutine describe(self, tape)
    class(friction_joints_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: moment

    if (allocated(self%over_slip)) then
      moment = friction_over_slip(self, tape)
    else
      moment = pick(self%mode_switch, [literal(tape, 0.0_wp), self%parameter(tape, 'sliding least'), &
                                       self%parameter(tape, 'sliding most'), literal(tape, 0.0_wp)])
    end if
    if (allocated(self%curve)) then
      moment = moment * curve_value(tape, time_of(tape))
      call guard_segment(tape, time_of(tape), is_time=.true.)
    end if
    tape%applied = node_of(moment)
  end subroutine describe

  !> The friction by the table, whose segments are the branches of the last switch. They begin at a slip of 0, backwards too.
  function friction_over_slip(self, tape) result(moment)
    class(friction_joints_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: moment, slip

    slip = pick(self%mode_switch, by_direction(1.0_wp)) * speed_of(tape)
    moment = picked_value(tape, self%over_slip, self%mode_switch + 1, slip)
    moment = pick(self%mode_switch, by_direction(-1.0_wp)) * moment
    call guard_picked_square(tape, self%over_slip, self%mode_switch + 1, speed_of(tape) * speed_of(tape))

  contains

    !> A number by the mode, its opposite where the joint slips backwards.
    function by_direction(number) result(choices)
      real(wp), intent(in) :: number
      type(expression_t) :: choices(idle)

      choices(locked) = literal(tape, 0.0_wp)
      choices(slips_forwards) = literal(tape, number)
      choices(slips_backwards) = literal(tape, -number)
      choices(idle) = literal(tape, 0.0_wp)
    end function by_direction

  end function friction_over_slip

  !> The range of the moment at rest, and the moments of slip forwards and backwards, by the engagement: a range without bounds
  !> stays so with any.
  pure subroutine find_range(self, element, t, least, most, sliding)
    class(friction_joints_t), intent(in) :: self
    integer, intent(in) :: element     !! numbered within the bank
    real(wp), intent(in) :: t          !! [s]
    real(wp), intent(out) :: least, most              !! [N m]
    real(wp), intent(out), optional :: sliding(2)     !! [N m]
    real(wp) :: moments(at_least:slip_most)
    integer :: k

    moments = [(self%parameters(k)%value(1, element), k=at_least, slip_most)]
    if (allocated(self%curve)) then
      associate (level => self%curve(1, element)%value(t))
        where (abs(moments) < huge(moments))
          moments = moments * level
        else where
          moments = merge(moments, 0.0_wp, level > 0)
        end where
      end associate
    end if
    least = moments(at_least)
    most = moments(at_most)
    if (present(sliding)) sliding = moments(slip_least:)
  end subroutine find_range

  !> Sets the mode of a joint of the first lane.
  subroutine set_mode(self, state, element, mode)
    class(friction_joints_t), intent(in) :: self
    type(bank_state_t), intent(inout) :: state
    integer, intent(in) :: element   !! numbered within the bank
    integer, intent(in) :: mode

    call state%set_branch(self, element + (self%mode_switch - 1) * self%count, 1, mode)
  end subroutine set_mode

  !> Sets the mode of a joint that slips, or is locked.
  subroutine set_mode_by_slip(self, state, element, slip, is_locked)
    class(friction_joints_t), intent(in) :: self
    type(bank_state_t), intent(inout) :: state
    integer, intent(in) :: element     !! numbered within the bank
    real(wp), intent(in) :: slip       !! u' [rad/s]
    logical, intent(in) :: is_locked

    call self%set_mode(state, element, merge(locked, merge(slips_forwards, slips_backwards, slip >= 0), is_locked))
  end subroutine set_mode_by_slip

  !> The friction jumps where the slip changes its direction, and bends at the points of a table.
  function extremes(self, element, t) result(speeds)
    class(friction_joints_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    allocate (speeds(1), source=0.0_wp)
    if (allocated(self%over_slip)) speeds = [speeds, self%over_slip%knots(), -self%over_slip%knots()]
  end function extremes

  subroutine quantities(self, columns)
    class(friction_joints_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    if (self%role == role_bearing) then   ! its slip is the speed of the body
      allocate (columns(1))
      columns(1) = new_quantity('bearing', 'N m', [(e, e=1, self%count)], 'friction moment of the bearing', 'on the body', &
                                rank_loss, form_applied, 1.0_wp)
      return
    end if
    allocate (columns(2))
    columns(1) = new_quantity('torque', 'N m', [(e, e=1, self%count)], 'torque', 'on the second body', rank_torque, &
                              form_applied, 1.0_wp)
    columns(2) = new_quantity('slip', 'rad/s', [(e, e=1, self%count)], 'slip', 'where the first body is faster', rank_slip, &
                              form_speed, -1.0_wp)
  end subroutine quantities

end module nocdyn_friction_joints
