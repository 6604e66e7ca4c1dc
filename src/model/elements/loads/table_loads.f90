!> Loads that resist with a table over the speed, besides the terms of `nonlinear_loads_t`.
module nocdyn_table_loads
  use nocdyn_bank, only: boundary_width
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_nonlinear_loads, only: new_nonlinear_loads, nonlinear_loads_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_table_loads

  !> The branches are the segments of the curves.
  type, extends(nonlinear_loads_t), public :: table_loads_t
    type(curve_t), allocatable :: curve(:, :)   !! resisting torque [N m] over speed [rad/s], shape [lanes, loads]
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: choose
    procedure :: indicator
    procedure :: switch_name
  end type table_loads_t

contains

  !> A bank of loads, each on one body.
  function new_table_loads(names, body, viscous, quadratic, constant, constant_speed, curve) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :), quadratic(:, :), constant(:, :), constant_speed(:, :)   !! [lanes, loads]
    type(curve_t), intent(in) :: curve(:, :)   !! a positive torque resists a positive speed, [lanes, loads]
    type(table_loads_t) :: bank
    integer :: e

    bank%nonlinear_loads_t = new_nonlinear_loads(names, body, viscous, quadratic, constant, constant_speed)
    allocate (bank%curve, source=curve)
    call bank%set_switches([(e, e=1, size(body))])
  end function new_table_loads

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(table_loads_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)
    integer :: e, i, l

    call self%nonlinear_loads_t%evaluate(time, angle, speed, restoring, applied)
    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        applied(i) = applied(i) - self%curve(l, e)%value(self%branch(l, e), speed(i))
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, elements)
    class(table_loads_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    integer :: e, i, l

    call self%nonlinear_loads_t%differentiate(elements)
    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        elements%applied_speed(l, i) = elements%applied_speed(l, i) &
                                       - self%curve(l, e)%slope(self%branch(l, e), elements%speed(l, i))
      end do
    end do
  end subroutine differentiate

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(table_loads_t), intent(inout) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)

    self%branch(lane, switch) = self%curve(lane, switch)%segment(speed)
  end subroutine choose

  pure function indicator(self, switch, lane, t, angle, speed, internal)
    class(table_loads_t), intent(in) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)
    real(wp) :: indicator

    indicator = self%curve(lane, switch)%inset(self%branch(lane, switch), speed, boundary_width)
  end function indicator

  function switch_name(self, switch) result(name)
    class(table_loads_t), intent(in) :: self
    integer, intent(in) :: switch
    character(len=:), allocatable :: name

    name = 'point in the table'
  end function switch_name

  subroutine list_parameters(self, parameters)
    class(table_loads_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%nonlinear_loads_t%list_parameters(parameters)
    call parameters%add_curves(self%curve)
  end subroutine list_parameters

end module nocdyn_table_loads
