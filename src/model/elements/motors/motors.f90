!> Motors whose torque is a function of their speed: eq. (20), another law, or a table. A governor may throttle them.
module nocdyn_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_governed_banks, only: governed_bank_t
  use nocdyn_governors, only: governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_table_laws, only: over_speed
  use nocdyn_text, only: string_t
  use nocdyn_torque_curves, only: quadratic_curve_t, torque_curve_t
  implicit none (type, external)
  private

  public :: new_motors, new_curve_motors

  !> M = law(omega), or that of tables; with a governor of the throttle y, M = y law(omega) - drag omega.
  type, extends(governed_bank_t), public :: motors_t
    class(torque_curve_t), allocatable :: law   !! of all motors; not allocated: they have tables
    real(wp), allocatable :: drag(:, :)         !! not throttled [N m s/rad], shape [lanes, motors]; allocated with a governor
  contains
    procedure :: list_parameters
    procedure :: polynomials
    procedure :: evaluate
    procedure :: evaluate_internal
    procedure :: differentiate
    procedure :: torque
    procedure :: slope
    procedure :: knees
  end type motors_t

contains

  !> A bank of motors without governors, each on one body, with a quadratic torque-speed curve, eq. (20): M_m = A - B omega -
  !> C omega^2.
  function new_motors(names, body, a, b, c) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: a(:, :), b(:, :), c(:, :)   !! [N m], [N m s/rad], [N m s2/rad2], shape [lanes, motors]
    type(motors_t) :: bank
    type(quadratic_curve_t) :: law

    allocate (law%a, source=a)
    allocate (law%b, source=b)
    allocate (law%c, source=c)
    bank = new_curve_motors(names, body, size(a, 1), law)
    bank%is_polynomial = .true.
    bank%has_paper_law = .true.
  end function new_motors

  !> A bank of motors, each on one body, either with a law or with tables.
  function new_curve_motors(names, body, lanes, law, curve, governor, drag) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:), lanes
    class(torque_curve_t), intent(in), optional :: law    !! of all motors
    type(curve_t), intent(in), optional :: curve(:, :)    !! [N m] over [rad/s], shape [lanes, motors]
    type(governor_t), intent(in), optional :: governor    !! of all motors; no motor has one if absent
    real(wp), intent(in), optional :: drag(:, :)          !! [N m s/rad], shape [lanes, motors]; present with `governor`
    type(motors_t) :: bank

    if (present(law) .eqv. present(curve)) error stop 'nocdyn_motors: motors have either a law or tables'
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_motor, lanes, names, body)
    if (present(law)) allocate (bank%law, source=law)
    if (present(curve)) call bank%set_curves(over_speed, curve)
    if (.not. present(governor)) return
    allocate (bank%internal_names, source=[character(len=24) :: 'governor integral'])
    call bank%add_governor(governor)
    allocate (bank%drag, source=drag)
  end function new_curve_motors

  subroutine polynomials(self, laws)
    class(motors_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    associate (first => self%first, last => self%last())
      if (allocated(self%drag)) laws%by_speed(:, first:last) = -self%drag
      if (.not. self%is_polynomial) return
      select type (law => self%law)
      type is (quadratic_curve_t)
        laws%constant(:, first:last) = law%a
        laws%by_speed(:, first:last) = -law%b
        laws%by_speed_squared(:, first:last) = -law%c
      end select
    end associate
  end subroutine polynomials

  !> Torque of a motor at full throttle [N m].
  pure real(wp) function torque(self, lane, motor, speed)
    class(motors_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]

    if (allocated(self%law)) then
      torque = self%law%torque(lane, motor, speed)
    else
      torque = self%curve(lane, motor)%value(self%branch(lane, motor), speed)
    end if
  end function torque

  !> Derivative of `torque` by the speed [N m s/rad].
  pure real(wp) function slope(self, lane, motor, speed)
    class(motors_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: speed   !! [rad/s]

    if (allocated(self%law)) then
      slope = self%law%slope(lane, motor, speed)
    else
      slope = self%curve(lane, motor)%slope(self%branch(lane, motor), speed)
    end if
  end function slope

  !> Adds nothing for motors with governors: their torque depends on the throttle, by an internal state.
  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(motors_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
    integer :: e, i, l

    if (self%is_polynomial .or. allocated(self%governor)) return
    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        applied(i) = applied(i) + self%torque(l, e, speed(i))
      end do
    end do
  end subroutine evaluate

  subroutine evaluate_internal(self, speed, internal, applied, rate)
    class(motors_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(in) :: internal(self%internal_values)   !! [lanes, states, motors]
    real(wp), intent(inout) :: applied(self%values)   !! [N m]
    real(wp), intent(inout) :: rate(self%internal_values)   !! [lanes, states, motors]
    real(wp) :: throttle
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        throttle = self%throttle(l, e, internal(i), speed(i))
        applied(i) = applied(i) + throttle * self%torque(l, e, speed(i))
        rate(i) = self%governor%rate(l, e, throttle, internal(i))
      end do
    end do
  end subroutine evaluate_internal

  subroutine differentiate(self, elements)
    class(motors_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: by_integral, by_speed, slope, torque
    integer :: e, i, l, s

    if (self%is_polynomial) return
    do e = 1, size(self%to)
      i = self%first + e - 1
      s = self%first_internal + e - 1
      do l = 1, self%lanes
        slope = self%slope(l, e, elements%speed(l, i))
        if (allocated(self%governor)) then
          call self%governor%slopes(l, e, self%branch(l, self%first_governor() + e), by_integral, by_speed, &
                                    elements%internal%rate_internal(l, 1, s), elements%internal%rate_speed(l, s))
          torque = self%torque(l, e, elements%speed(l, i))
          slope = self%throttle(l, e, elements%internal%value(l, s), elements%speed(l, i)) * slope + by_speed * torque
          elements%internal%applied(l, s) = by_integral * torque
        end if
        elements%applied_speed(l, i) = elements%applied_speed(l, i) + slope
      end do
    end do
  end subroutine differentiate

  function knees(self, element) result(speeds)
    class(motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), allocatable :: speeds(:)

    speeds = self%governed_bank_t%knees(element)
    if (allocated(self%law)) speeds = [speeds, self%law%knees(element)]
  end function knees

  subroutine list_parameters(self, parameters)
    class(motors_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%governed_bank_t%list_parameters(parameters)
    if (allocated(self%law)) call self%law%list_parameters(parameters)
    if (allocated(self%drag)) call parameters%add('drag', self%drag)
  end subroutine list_parameters

end module nocdyn_motors
