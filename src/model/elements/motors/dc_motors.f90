!> Direct-current motors with an inductance: torque k i, inductance i' = y voltage - resistance i - k omega, i = 0 at the start.
module nocdyn_dc_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_elements, only: elements_t
  use nocdyn_governed_banks, only: governed_bank_t
  use nocdyn_governors, only: governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_dc_motors

  !> The internal states of a motor are its armature current i [A] and, where a governor throttles the voltage, its integral.
  type, extends(governed_bank_t), public :: dc_motors_t
    real(wp), allocatable :: voltage(:, :)         !! [V], shape [lanes, motors] as all parameters
    real(wp), allocatable :: resistance(:, :)      !! [Ohm]
    real(wp), allocatable :: flux_constant(:, :)   !! k [V s/rad]
    real(wp), allocatable :: inductance(:, :)      !! [H], positive
  contains
    procedure :: list_parameters
    procedure :: evaluate_internal
    procedure :: differentiate
    procedure :: steady_internal
    procedure :: knees
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

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%states = 1
    allocate (bank%internal_names, source=[character(len=24) :: 'armature current', 'governor integral'])
    call bank%connect(role_motor, size(voltage, 1), names, body)
    allocate (bank%voltage, source=voltage)
    allocate (bank%resistance, source=resistance)
    allocate (bank%flux_constant, source=flux_constant)
    allocate (bank%inductance, source=inductance)
    if (present(governor)) call bank%add_governor(governor)
  end function new_dc_motors

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
            throttle = self%throttle(l, e, internal(integral), speed(i))
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

  subroutine steady_internal(self, speed, internal)
    class(dc_motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(:)         !! u' [rad/s], [motors]
    real(wp), intent(inout) :: internal(:)   !! [states * motors]
    real(wp) :: throttle
    integer :: e

    call self%governed_bank_t%steady_internal(speed, internal)
    throttle = 1.0_wp
    do e = 1, size(self%to)
      if (allocated(self%governor)) throttle = internal(self%states * e)
      internal(self%states * (e - 1) + 1) = (throttle * self%voltage(1, e) - self%flux_constant(1, e) * speed(e)) &
                                            / self%resistance(1, e)
    end do
  end subroutine steady_internal

  !> The speed without torque, and that of the governor.
  function knees(self, element) result(speeds)
    class(dc_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), allocatable :: speeds(:)

    speeds = [self%governed_bank_t%knees(element), self%voltage(1, element) / self%flux_constant(1, element)]
  end function knees

  subroutine list_parameters(self, parameters)
    class(dc_motors_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%governed_bank_t%list_parameters(parameters)
    call parameters%add_key('voltage', self%voltage)
    call parameters%add_key('resistance', self%resistance)
    call parameters%add_key('flux_constant', self%flux_constant)
    call parameters%add_key('inductance', self%inductance)
  end subroutine list_parameters

end module nocdyn_dc_motors
