!> Banks of motors that a PI governor may throttle: y = clip(z + gain (set_speed - omega)) between 0 and 1, z' = (y - z) / time.
!> The one of an inverter is between -1 and 1. The set speed may follow the time.
!>
!> Between the limits z' = gain (set_speed - omega) / time, the integral of a PI controller. At a limit z tends to the limit.
!> Stopping the integration there (clamping) would make the state slide along the limit when the governor leaves it.
!> (K. J. Astrom, T. Hagglund, PID Controllers, 2nd ed. 1995, section 3.5: anti-windup by tracking, with the integral time.)
module nocdyn_governed_banks
  use nocdyn_bank, only: bank_t
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), operator(/), &
    pick, speed_of, state_of
  use nocdyn_law_functions, only: add_guard
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_quantities, only: form_applied, form_observed, new_quantity, quantity_t, rank_current, rank_torque
  use nocdyn_schedules, only: add_schedule, guard_schedule, join_points, schedule_t, scheduled_value, value_at
  implicit none (type, external)
  private

  public :: has_governors

  !> The integral z of a governor is the last internal state of its motor. The switches of the governors are the last ones.
  type, extends(bank_t), public :: governed_bank_t
    logical :: has_governor = .false.
    logical, private :: has_course = .false.   !! whether the set speeds follow the time; their switch is the last but one
    real(wp), private :: least = 0.0_wp        !! lower limit of the throttle
    logical, private :: is_held = .false.   !! whether the throttles stay open at every speed, after `hold_speed`
  contains
    procedure :: add_governor
    procedure :: throttle
    procedure :: hold_speed
    procedure :: integral_of, least_throttle
    procedure :: start_internal
    procedure :: decide_internal
    procedure :: extremes
    procedure :: quantities
    procedure :: observe
  end type governed_bank_t

  character(len=*), parameter :: course = 'set speed'   ! the schedule
  integer, parameter :: governing = 1, closed = 2, open = 3   ! the branches

contains

  !> Whether the motors of a bank have governors: all have one, or none.
  pure logical function has_governors(keys)
    class(element_keys_t), intent(in) :: keys

    has_governors = keys%has('governor_speed') .or. keys%has('set_times')
  end function has_governors

  !> Gives every motor a governor, with an internal state and a switch; after `connect` and `add_table`.
  subroutine add_governor(self, keys, least)
    class(governed_bank_t), intent(inout) :: self
    class(element_keys_t), intent(in) :: keys
    real(wp), intent(in), optional :: least   !! lower limit of the throttle; absent: 0
    type(schedule_t), allocatable :: schedule(:, :)
    real(wp) :: set_speed(self%lanes, self%count)   ! at the start
    integer :: e, lane

    self%has_governor = .true.
    self%states = self%states + 1
    self%internal_values = self%states * self%values
    if (present(least)) self%least = least
    self%has_course = keys%has('set_times')
    set_speed = keys%values('governor_speed')
    allocate (schedule(merge(self%lanes, 0, self%has_course), self%count))
    do e = 1, self%count
      do lane = 1, size(schedule, 1)
        call join_points(keys%numbers('set_times', lane, e), keys%numbers('set_speeds', lane, e), schedule(lane, e))
        set_speed(lane, e) = schedule(lane, e)%at(keys%t_start)
      end do
    end do
    call self%add_parameter('governor_speed', set_speed, is_key=.false.)
    self%parameters(size(self%parameters))%is_set_point = .not. self%has_course
    call self%add_parameter('governor_gain', keys%values('governor_gain'), is_key=.false.)
    call self%add_key(keys, 'governor_time')
    call self%add_parameter('governor_start', keys%values('governor_start'), is_key=.false.)
    if (self%has_course) call add_schedule(self, course, schedule, 'point of the set speed')
    call self%add_switches([('limit of the governor', e=1, self%count)], open)
  end subroutine add_governor

  !> Throttle y of the motors; sets the rate of the integrals and guards the limits.
  function throttle(self, tape) result(y)
    class(governed_bank_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: y
    type(expression_t) :: free, least, none, one, set_speed, shift, z
    integer :: switch

    switch = size(self%switch_element) / self%count
    none = literal(tape, 0.0_wp)
    one = literal(tape, 1.0_wp)
    shift = literal(tape, boundary_width)
    z = state_of(tape, self%states)
    least = literal(tape, self%least)
    set_speed = self%parameter(tape, 'governor_speed')
    if (self%has_course) set_speed = scheduled_value(self, tape, course, switch - 1)
    if (self%has_course) call guard_schedule(self, tape, course, switch - 1)
    free = z + self%parameter(tape, 'governor_gain') * (set_speed - speed_of(tape))
    y = pick(switch, [none, least, one]) + pick(switch, [one, none, none]) * free
    tape%rate(self%states) = node_of((y - z) / self%parameter(tape, 'governor_time'))
    call add_guard(switch, governing, free - self%least, shift)   ! continuous in the time, though it has picks of the course
    call add_guard(switch, governing, 1.0_wp - free, shift)
    call add_guard(switch, closed, self%least - free, shift)
    call add_guard(switch, open, free - 1.0_wp, shift)
  end function throttle

  !> The integrals with which the throttles have their values at the start; other states start at 0.
  subroutine start_internal(self, speed, internal)
    class(governed_bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)   !! [lanes, states, motors]
    integer :: e, l

    internal = 0.0_wp
    if (.not. self%has_governor) return
    associate (set_speed => self%parameters(self%number_of('governor_speed'))%value, &
               gain => self%parameters(self%number_of('governor_gain'))%value, &
               start => self%parameters(self%number_of('governor_start'))%value)
      do e = 1, self%count
        do l = 1, self%lanes
          internal(self%lanes * (self%states * e - 1) + l) = &
            start(l, e) - gain(l, e) * (set_speed(l, e) - speed(self%lanes * (e - 1) + l))
        end do
      end do
    end associate
  end subroutine start_internal

  !> Opens the throttles, whatever the speed is.
  subroutine hold_speed(self)
    class(governed_bank_t), intent(inout) :: self

    self%is_held = .true.
  end subroutine hold_speed

  !> The integral with which a throttle between its limits has a value at a time and a speed, in the first lane.
  pure real(wp) function integral_of(self, element, t, speed, throttle) result(z)
    class(governed_bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), intent(in) :: speed    !! u' [rad/s]
    real(wp), intent(in) :: throttle   !! y, 1 if it is open

    associate (gain => self%parameters(self%number_of('governor_gain'))%value(1, element))
      z = throttle - gain * (set_speed_at(self, element, t) - speed)
    end associate
  end function integral_of

  !> The lower limit of the throttles.
  pure real(wp) function least_throttle(self)
    class(governed_bank_t), intent(in) :: self

    least_throttle = self%least
  end function least_throttle

  !> The integral of a governor at rest is its throttle; at the set speed, where any is steady, the open one.
  subroutine decide_internal(self, t, speed, internal, is_decided)
    class(governed_bank_t), intent(in) :: self
    real(wp), intent(in) :: t                !! [s]
    real(wp), intent(in) :: speed(:)         !! u' [rad/s], [motors]
    real(wp), intent(inout) :: internal(:)   !! [states * motors]
    logical, intent(out) :: is_decided(:)    !! [states]
    integer :: e

    is_decided = .false.
    if (.not. self%has_governor) return
    is_decided(self%states) = .true.
    associate (gain => self%parameters(self%number_of('governor_gain'))%value)
      do e = 1, self%count
        associate (demand => gain(1, e) * (set_speed_at(self, e, t) - speed(e)))
          if (self%is_held) then   ! beyond the limit, where the throttle does not depend on the speed
            internal(self%states * e) = 2.0_wp + abs(demand)
          else
            internal(self%states * e) = merge(1.0_wp, self%least, demand >= 0.0_wp)
          end if
        end associate
      end do
    end associate
  end subroutine decide_internal

  !> The set speed of a governor in the first lane [rad/s].
  pure real(wp) function set_speed_at(self, element, t)
    class(governed_bank_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: t   ! [s]

    if (self%has_course) then
      set_speed_at = value_at(self, course, element, t)
    else
      set_speed_at = self%parameters(self%number_of('governor_speed'))%value(1, element)
    end if
  end function set_speed_at

  !> The speed that a governor keeps.
  function extremes(self, element, t) result(speeds)
    class(governed_bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    allocate (speeds(0))
    if (self%has_governor) speeds = [set_speed_at(self, element, t)]
  end function extremes

  !> Torque, armature current where that is a state, and throttle where there is a governor.
  subroutine quantities(self, columns)
    class(governed_bank_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    allocate (columns(1 + self%states))
    columns(1) = new_quantity('torque', 'N m', [(e, e=1, self%count)], 'torque on the body', 'with a positive speed', &
                              rank_torque, form_applied, 1.0_wp)
    if (self%states > 0) columns(2) = new_quantity('current', 'A', columns(1)%elements, 'armature current', &
                                                    '', rank_current, form_observed, 1.0_wp)
    if (self%has_governor) columns(1 + self%states) = new_quantity('throttle', '1', columns(1)%elements, 'throttle opening', &
                                                                   '', rank_current, form_observed, 1.0_wp)
  end subroutine quantities

  pure subroutine observe(self, elements, quantity, lane, values)
    class(governed_bank_t), intent(in) :: self
    type(element_values_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! index in `quantities`
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]
    integer :: e, s

    do e = 1, size(values)
      s = self%first_internal + self%states * e - 1   ! the last state
      values(e) = elements%internal%value(lane, s + 1 - self%states)
      if (quantity == 1 + self%states .and. self%has_governor) then   ! y = z + time z'
        values(e) = elements%internal%value(lane, s) &
                    + self%parameters(self%number_of('governor_time'))%value(lane, e) * elements%internal%rate(lane, s)
      end if
    end do
  end subroutine observe

end module nocdyn_governed_banks
