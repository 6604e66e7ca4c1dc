!> Motors whose torque is a function of their speed: eq. (20), Kloss' formula, or a table. A governor may throttle them.
module nocdyn_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_governed_banks, only: governed_bank_t, has_governors
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(+), operator(-), operator(/), speed_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_polynomial_laws, only: coefficient_by_speed, coefficient_by_speed_squared, coefficient_constant
  use nocdyn_tables, only: add_table, curve_value, guard_segment
  implicit none (type, external)
  private

  public :: new_motors, new_table_motors, new_induction_motors

  character(len=*), parameter :: share_name = 'share of frequency'   ! of the supply, where a speed is held

  !> M = law(omega), with a governor of the throttle y M = y law(omega) - drag omega.
  type, abstract, extends(governed_bank_t) :: speed_motors_t
  contains
    procedure :: describe
    procedure(torque_interface), deferred :: torque
  end type speed_motors_t

  abstract interface
    !> The torque at full throttle [N m].
    function torque_interface(self, tape) result(torque)
      import :: expression_t, law_tape_t, speed_motors_t
      class(speed_motors_t), intent(in) :: self
      type(law_tape_t), target, intent(inout) :: tape
      type(expression_t) :: torque
    end function torque_interface
  end interface

  !> Eq. (20): A - B omega - C omega^2; also constant torques, and dc motors without inductance, which are linear.
  type, extends(speed_motors_t), public :: motors_t
  contains
    procedure :: torque => quadratic_torque
    procedure :: extremes => quadratic_extremes
  end type motors_t

  !> The curve of a table.
  type, extends(speed_motors_t), public :: table_motors_t
  contains
    procedure :: torque => table_torque
  end type table_motors_t

  !> Kloss' formula 2 T_k / (s / s_k + s_k / s) with the slip s = 1 - omega / synchronous_speed, as 2 T_k s s_k / (s^2 + s_k^2).
  type, extends(speed_motors_t), public :: induction_motors_t
    logical, private :: has_supply = .false.   !! whether the supply may have another frequency, after `hold_speed`
  contains
    procedure :: torque => induction_torque
    procedure :: hold_speed, follows_supply, set_supply, idle_supply
    procedure :: extremes => induction_extremes
  end type induction_motors_t

contains

  !> A bank of motors, each on one body, with a quadratic torque-speed curve.
  function new_motors(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(motors_t) :: bank

    call bank%connect(role_motor, keys)
    call bank%add_parameter('a', keys%values('a') + keys%values('torque') + &
                            keys%values('flux_constant') * keys%values('voltage') / keys%values('resistance', absent=1.0_wp))
    if (has_governors(keys)) then
      call bank%add_key(keys, 'b')
    else
      call bank%add_parameter('b', keys%values('b') + drags(keys))
    end if
    call bank%add_key(keys, 'c')
    call govern(bank, keys)
    bank%is_polynomial = .not. bank%has_governor
    if (bank%is_polynomial) then
      call bank%add_term('a', coefficient_constant, 1.0_wp)
      call bank%add_term('b', coefficient_by_speed, -1.0_wp)
      call bank%add_term('c', coefficient_by_speed_squared, -1.0_wp)
    end if
    bank%has_paper_law = bank%is_polynomial
    call bank%prepare_law()
  end function new_motors

  !> A bank of motors, each on one body, with tables.
  function new_table_motors(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(table_motors_t) :: bank

    call bank%connect(role_motor, keys)
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call add_table(bank, keys%curves('table_speed', 'table_torque'))
    call govern(bank, keys)
    call bank%prepare_law()
  end function new_table_motors

  !> A bank of induction motors, each on one body.
  function new_induction_motors(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(induction_motors_t) :: bank

    call bank%connect(role_motor, keys)
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%add_key(keys, 'breakdown_torque')
    call bank%add_key(keys, 'breakdown_slip')
    call bank%add_key(keys, 'synchronous_speed')
    call govern(bank, keys)
    call bank%prepare_law()
  end function new_induction_motors

  !> Gives the motors governors, if they have some. The drag is not throttled.
  subroutine govern(bank, keys)
    class(speed_motors_t), intent(inout) :: bank
    class(element_keys_t), intent(in) :: keys

    if (.not. has_governors(keys)) return
    allocate (bank%internal_names, source=[character(len=24) :: 'governor integral'])
    call bank%add_governor(keys)
    call bank%add_parameter('drag', drags(keys), is_key=.false.)
    call bank%add_term('drag', coefficient_by_speed, -1.0_wp)
  end subroutine govern

  !> Drags k^2 / resistance of dc motors without inductance [N m s/rad], [lanes, motors]; others have none.
  pure function drags(keys)
    class(element_keys_t), intent(in) :: keys
    real(wp) :: drags(keys%lanes, size(keys%names))

    drags = keys%values('flux_constant')**2 / keys%values('resistance', absent=1.0_wp)
  end function drags

  subroutine describe(self, tape)
    class(speed_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    if (self%has_governor) then
      tape%applied = node_of(self%throttle(tape) * self%torque(tape))
    else
      tape%applied = node_of(self%torque(tape))
    end if
  end subroutine describe

  function quadratic_torque(self, tape) result(torque)
    class(motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque

    torque = self%parameter(tape, 'a') - (self%parameter(tape, 'b') + self%parameter(tape, 'c') * speed_of(tape)) * speed_of(tape)
  end function quadratic_torque

  function table_torque(self, tape) result(torque)
    class(table_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque

    if (.not. allocated(self%curve)) error stop 'nocdyn_motors: there are no tables'
    torque = curve_value(tape, speed_of(tape))
    call guard_segment(tape, speed_of(tape))
  end function table_torque

  function induction_torque(self, tape) result(torque)
    class(induction_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: slip, s_k, torque

    s_k = self%parameter(tape, 'breakdown_slip')
    slip = 1.0_wp - speed_of(tape) / self%parameter(tape, 'synchronous_speed')
    if (self%has_supply) slip = self%parameter(tape, share_name) - speed_of(tape) / self%parameter(tape, 'synchronous_speed')
    torque = 2.0_wp * self%parameter(tape, 'breakdown_torque') * s_k * slip / (slip * slip + s_k * s_k)
  end function induction_torque

  !> Gives the motors a supply of any frequency, unless governors hold their speeds.
  subroutine hold_speed(self)
    class(induction_motors_t), intent(inout) :: self

    call self%governed_bank_t%hold_speed()
    if (self%has_supply .or. self%has_governor) return
    self%has_supply = .true.
    call self%add_parameter(share_name, spread(spread(1.0_wp, 1, self%lanes), 2, self%count), is_key=.false.)
    call self%prepare_law()
  end subroutine hold_speed

  pure logical function follows_supply(self)
    class(induction_motors_t), intent(in) :: self

    follows_supply = self%has_supply
  end function follows_supply

  subroutine set_supply(self, share)
    class(induction_motors_t), intent(inout) :: self
    real(wp), intent(in) :: share   !! of the frequency in the input

    self%parameters(self%number_of(share_name))%value(1, :) = share
  end subroutine set_supply

  pure real(wp) function idle_supply(self, element, speed)
    class(induction_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: speed    !! u' [rad/s]

    idle_supply = speed / self%parameters(self%number_of('synchronous_speed'))%value(1, element)
  end function idle_supply

  !> The vertex, and the speeds without torque, where a, b and c are of sizes that belong together.
  function quadratic_extremes(self, element, t) result(speeds)
    class(motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)
    real(wp), parameter :: together = 1.0e-20_wp   ! ratio of coefficients below which one is no part of the law
    real(wp) :: a, b, c, discriminant

    speeds = self%governed_bank_t%extremes(element, t)
    a = self%parameters(self%number_of('a'))%value(1, element)
    b = self%parameters(self%number_of('b'))%value(1, element)
    c = self%parameters(self%number_of('c'))%value(1, element)
    discriminant = b**2 + 4.0_wp * a * c
    if (abs(c) > together * max(abs(a), abs(b))) then
      speeds = [speeds, -0.5_wp / c * [b, b - sqrt(max(discriminant, 0.0_wp)), b + sqrt(max(discriminant, 0.0_wp))]]
    else if (abs(b) > together * abs(a)) then
      speeds = [speeds, a / b]
    end if
  end function quadratic_extremes

  !> The synchronous speed, and the ones of the largest torque as a motor and as a generator.
  function induction_extremes(self, element, t) result(speeds)
    class(induction_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    associate (synchronous => self%parameters(self%number_of('synchronous_speed'))%value(1, element), &
               slip => self%parameters(self%number_of('breakdown_slip'))%value(1, element))
      speeds = [self%governed_bank_t%extremes(element, t), synchronous * (1.0_wp + slip * [-1.0_wp, 0.0_wp, 1.0_wp])]
    end associate
  end function induction_extremes

end module nocdyn_motors
