!> Direct-current motors with an inductance: torque k i, inductance i' = y voltage - resistance i - k omega, i = 0 at the start.
module nocdyn_dc_motors
  use nocdyn_bank, only: bank_t, quantity_t, role_motor
  use nocdyn_elements, only: elements_t
  use nocdyn_governors, only: governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_dc_motors

  !> The internal states of a motor are its armature current i [A] and, where a governor throttles the voltage, its integral.
  type, extends(bank_t), public :: dc_motors_t
    real(wp), allocatable :: voltage(:, :)         !! [V], shape [lanes, motors] as all parameters
    real(wp), allocatable :: resistance(:, :)      !! [Ohm]
    real(wp), allocatable :: flux_constant(:, :)   !! k [V s/rad]
    real(wp), allocatable :: inductance(:, :)      !! [H], positive
    type(governor_t), allocatable :: governor
  contains
    procedure :: list_parameters
    procedure :: start_internal
    procedure :: evaluate_internal
    procedure :: differentiate
    procedure :: choose
    procedure :: indicator
    procedure :: quantities
    procedure :: observe
  end type dc_motors_t

contains

  !> A bank of motors, each on one body.
  function new_dc_motors(names, body, voltage, resistance, flux_constant, inductance, governor) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: voltage(:, :), resistance(:, :)         !! [V], [Ohm], shape [lanes, motors]
    real(wp), intent(in) :: flux_constant(:, :), inductance(:, :)   !! [V s/rad], [H], shape [lanes, motors]
    type(governor_t), intent(in), optional :: governor   !! no motor has one if absent
    type(dc_motors_t) :: bank
    integer :: e

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%states = 1
    if (present(governor)) bank%states = 2
    allocate (bank%internal_names, source=[character(len=24) :: 'armature current', 'governor integral'])
    call bank%connect(role_motor, size(voltage, 1), names, [(0, e=1, size(body))], body)
    allocate (bank%voltage, source=voltage)
    allocate (bank%resistance, source=resistance)
    allocate (bank%flux_constant, source=flux_constant)
    allocate (bank%inductance, source=inductance)
    if (.not. present(governor)) return
    allocate (bank%governor, source=governor)
    call bank%add_switches([('limit of the governor', e=1, size(body))])
  end function new_dc_motors

  subroutine start_internal(self, speed, internal)
    class(dc_motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)   !! [lanes, states, motors]
    integer :: e, l

    internal = 0.0_wp
    if (.not. allocated(self%governor)) return
    do e = 1, size(self%to)
      do l = 1, self%lanes
        internal(self%lanes * (2 * e - 1) + l) = self%governor%start_integral(l, e, speed(self%lanes * (e - 1) + l))
      end do
    end do
  end subroutine start_internal

  subroutine evaluate_internal(self, speed, internal, applied, rate)
    class(dc_motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(in) :: internal(self%internal_values)   !! [lanes, states, motors]
    real(wp), intent(inout) :: applied(self%values)   !! [N m]
    real(wp), intent(inout) :: rate(self%internal_values)   !! [lanes, states, motors]
    real(wp) :: throttle
    integer :: current, e, i, l

    throttle = 1.0_wp
    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        current = self%lanes * self%states * (e - 1) + l
        if (allocated(self%governor)) then
          associate (integral => current + self%lanes)
            throttle = self%governor%throttle(l, e, self%branch(l, e), internal(integral), speed(i))
            rate(integral) = self%governor%rate(l, e, throttle, internal(integral))
          end associate
        end if
        applied(i) = applied(i) + self%flux_constant(l, e) * internal(current)
        rate(current) = (throttle * self%voltage(l, e) - self%resistance(l, e) * internal(current) &
                         - self%flux_constant(l, e) * speed(i)) / self%inductance(l, e)
      end do
    end do
  end subroutine evaluate_internal

  subroutine differentiate(self, elements)
    class(dc_motors_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: by_integral, by_speed
    integer :: e, l, s

    do e = 1, size(self%to)
      s = self%first_internal + self%states * (e - 1)
      do l = 1, self%lanes
        associate (internal => elements%internal, inductance => self%inductance(l, e))
          internal%applied(l, s) = self%flux_constant(l, e)
          internal%rate_speed(l, s) = -self%flux_constant(l, e) / inductance
          internal%rate_internal(l, 1, s) = -self%resistance(l, e) / inductance
          if (.not. allocated(self%governor)) cycle
          call self%governor%slopes(l, e, self%branch(l, e), by_integral, by_speed, internal%rate_internal(l, 2, s + 1), &
                                    internal%rate_speed(l, s + 1))
          internal%rate_speed(l, s) = internal%rate_speed(l, s) + by_speed * self%voltage(l, e) / inductance
          internal%rate_internal(l, 2, s) = by_integral * self%voltage(l, e) / inductance
          internal%applied(l, s + 1) = 0.0_wp
          internal%rate_internal(l, 1, s + 1) = 0.0_wp
        end associate
      end do
    end do
  end subroutine differentiate

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(dc_motors_t), intent(inout) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    self%branch(lane, switch) = self%governor%branch(lane, switch, internal(2), speed)
  end subroutine choose

  pure function indicator(self, switch, lane, t, angle, speed, internal)
    class(dc_motors_t), intent(in) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element
    real(wp) :: indicator

    indicator = self%governor%indicator(lane, switch, self%branch(lane, switch), internal(2), speed)
  end function indicator

  !> Torque, armature current and, with a governor, throttle.
  function quantities(self) result(columns)
    class(dc_motors_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(1 + self%states))
    columns(1) = quantity_t('torque', 'N m', [(e, e=1, size(self%to))])
    columns(2) = quantity_t('current', 'A', [(e, e=1, size(self%to))])
    if (allocated(self%governor)) columns(3) = quantity_t('throttle', '1', [(e, e=1, size(self%to))])
  end function quantities

  pure subroutine observe(self, elements, quantity, lane, values)
    class(dc_motors_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! index in `quantities`
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]
    integer :: e

    do e = 1, size(self%to)
      associate (speed => elements%speed(lane, self%first + e - 1), &
                 internal => elements%internal%value(lane, self%first_internal + self%states * (e - 1):))
        select case (quantity)
        case (1)
          values(e) = elements%applied(lane, self%first + e - 1)
        case (2)
          values(e) = internal(1)
        case default
          values(e) = self%governor%throttle(lane, e, self%branch(lane, e), internal(2), speed)
        end select
      end associate
    end do
  end subroutine observe

  subroutine list_parameters(self, parameters)
    class(dc_motors_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_key('voltage', self%voltage)
    call parameters%add_key('resistance', self%resistance)
    call parameters%add_key('flux_constant', self%flux_constant)
    call parameters%add_key('inductance', self%inductance)
    if (allocated(self%governor)) call self%governor%list_parameters(parameters)
  end subroutine list_parameters

end module nocdyn_dc_motors
