!> Banks of motors that a governor may throttle.
module nocdyn_governed_banks
  use nocdyn_bank, only: quantity_t
  use nocdyn_elements, only: elements_t
  use nocdyn_governors, only: governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_table_laws, only: table_laws_t
  implicit none (type, external)
  private

  !> The integral of a governor is the last internal state of its motor. The switches of the governors follow those of the tables.
  type, extends(table_laws_t), public :: governed_bank_t
    type(governor_t), allocatable :: governor   !! of all motors; not allocated: none
  contains
    procedure :: add_governor
    procedure :: first_governor
    procedure :: throttle
    procedure :: list_parameters
    procedure :: start_internal
    procedure :: steady_internal
    procedure :: knees
    procedure :: choose
    procedure :: indicator
    procedure :: quantities
    procedure :: observe
  end type governed_bank_t

contains

  !> Gives every motor a governor, with an internal state and a switch; after `connect` and `set_curves`.
  subroutine add_governor(self, governor)
    class(governed_bank_t), intent(inout) :: self
    type(governor_t), intent(in) :: governor   !! of all motors
    integer :: e

    allocate (self%governor, source=governor)
    self%states = self%states + 1
    self%internal_values = self%states * self%values
    call self%add_switches([('limit of the governor', e=1, size(self%to))])
  end subroutine add_governor

  !> Number of switches before those of the governors.
  pure integer function first_governor(self)
    class(governed_bank_t), intent(in) :: self

    first_governor = size(self%switch_element) - merge(size(self%to), 0, allocated(self%governor))
  end function first_governor

  !> Throttle y on the present branch.
  pure real(wp) function throttle(self, lane, motor, integral, speed)
    class(governed_bank_t), intent(in) :: self
    integer, intent(in) :: lane, motor
    real(wp), intent(in) :: integral, speed   !! z of the governor, speed of the motor [rad/s]

    throttle = self%governor%throttle(lane, motor, self%branch(lane, self%first_governor() + motor), integral, speed)
  end function throttle

  !> The integrals with which the throttles have their values at the start; other states start at 0.
  subroutine start_internal(self, speed, internal)
    class(governed_bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)   !! [lanes, states, motors]
    integer :: e, l

    internal = 0.0_wp
    if (.not. allocated(self%governor)) return
    do e = 1, size(self%to)
      do l = 1, self%lanes
        associate (governor => self%governor)
          internal(self%lanes * (self%states * e - 1) + l) = &
            governor%start(l, e) - governor%gain(l, e) * (governor%set_speed(l, e) - speed(self%lanes * (e - 1) + l))
        end associate
      end do
    end do
  end subroutine start_internal

  !> The integral of a governor at rest is its throttle.
  subroutine steady_internal(self, speed, internal)
    class(governed_bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(:)         !! u' [rad/s], [motors]
    real(wp), intent(inout) :: internal(:)   !! [states * motors]
    integer :: e

    if (.not. allocated(self%governor)) return
    do e = 1, size(self%to)
      internal(self%states * e) = self%governor%steady_throttle(e, speed(e))
    end do
  end subroutine steady_internal

  !> The points of a table, and the speed that a governor keeps.
  function knees(self, element) result(speeds)
    class(governed_bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), allocatable :: speeds(:)

    speeds = self%table_laws_t%knees(element)
    if (allocated(self%governor)) speeds = [speeds, self%governor%set_speed(1, element)]
  end function knees

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(governed_bank_t), intent(inout) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    associate (motor => switch - self%first_governor())
      if (motor > 0) then
        self%branch(lane, switch) = self%governor%branch(lane, motor, internal(self%states), speed)
      else
        call self%table_laws_t%choose(switch, lane, t, angle, speed, internal)
      end if
    end associate
  end subroutine choose

  pure real(wp) function indicator(self, switch, lane, t, angle, speed, internal)
    class(governed_bank_t), intent(in) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    associate (motor => switch - self%first_governor())
      if (motor > 0) then
        indicator = self%governor%indicator(lane, motor, self%branch(lane, switch), internal(self%states), speed)
      else
        indicator = self%table_laws_t%indicator(switch, lane, t, angle, speed, internal)
      end if
    end associate
  end function indicator

  !> Torque, armature current where that is a state, and throttle where there is a governor.
  function quantities(self) result(columns)
    class(governed_bank_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(1 + self%states))
    columns(1) = quantity_t('torque', 'N m', [(e, e=1, size(self%to))])
    if (self%states > 0) columns(2) = quantity_t('current', 'A', columns(1)%elements)
    if (allocated(self%governor)) columns(1 + self%states) = quantity_t('throttle', '1', columns(1)%elements)
  end function quantities

  pure subroutine observe(self, elements, quantity, lane, values)
    class(governed_bank_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! index in `quantities`
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]
    integer :: e, s

    values = elements%applied(lane, self%first:self%last())
    do e = 1, size(values)
      s = self%first_internal + self%states * e - 1   ! the last state
      if (quantity == 2) values(e) = elements%internal%value(lane, s + 1 - self%states)
      if (quantity == 1 + self%states .and. allocated(self%governor)) then
        values(e) = self%throttle(lane, e, elements%internal%value(lane, s), elements%speed(lane, self%first + e - 1))
      end if
    end do
  end subroutine observe

  subroutine list_parameters(self, parameters)
    class(governed_bank_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%table_laws_t%list_parameters(parameters)
    if (allocated(self%governor)) call self%governor%list_parameters(parameters)
  end subroutine list_parameters

end module nocdyn_governed_banks
