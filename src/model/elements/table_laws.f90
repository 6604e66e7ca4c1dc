!> Laws with a tabulated part: a moment over the twist, over the speed or over the time, for elements of any role.
!>
!> A bank may do without tables: then all of this adds nothing. An extension that has further switches or moments of its own
!> overrides the procedures and calls those of its parent.
module nocdyn_table_laws
  use nocdyn_bank, only: bank_t, boundary_width, time_reached
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_table_laws

  integer, parameter, public :: over_twist = 1   !! restoring moment -curve(u - rest_twist)
  integer, parameter, public :: over_speed = 2   !! applied moment curve(u') of a source, -curve(u') of a load
  integer, parameter, public :: over_time = 3    !! applied moment curve(t)

  !> The branches are the segments of the curves; switch k belongs to element k.
  type, extends(bank_t), public :: table_laws_t
    integer :: argument = over_twist              !! over_...
    type(curve_t), allocatable :: curve(:, :)     !! [N m] over [rad], [rad/s] or [s], shape [lanes, elements]
    real(wp), allocatable :: rest_twist(:, :)     !! [rad], shape [lanes, elements]; of couplings
  contains
    procedure :: set_curves
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
    procedure :: choose
    procedure :: indicator
    procedure :: knees
    procedure, private :: argument_of
  end type table_laws_t

contains

  !> A bank whose law is tables alone, each element on one body.
  function new_table_laws(role, names, body, argument, curve) result(bank)
    integer, intent(in) :: role                !! role_... of `nocdyn_bank`
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    integer, intent(in) :: argument            !! over_speed or over_time
    type(curve_t), intent(in) :: curve(:, :)   !! [N m] over [rad/s] or [s], shape [lanes, elements]
    type(table_laws_t) :: bank

    call bank%connect(role, size(curve, 1), names, body)
    call bank%set_curves(argument, curve)
  end function new_table_laws

  !> Gives every element a curve and a switch; after `connect`.
  subroutine set_curves(self, argument, curve)
    class(table_laws_t), intent(inout) :: self
    integer, intent(in) :: argument          !! over_...
    type(curve_t), intent(in) :: curve(:, :) !! [lanes, elements]
    integer :: e

    self%argument = argument
    self%is_polynomial = .false.
    self%has_paper_law = .false.
    if (argument == over_twist) self%has_polynomial_potential = .false.
    allocate (self%curve, source=curve)
    call self%add_switches([('point in the table', e=1, size(self%to))])
  end subroutine set_curves

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(table_laws_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
    integer :: e, i, l
    logical :: is_source

    if (.not. allocated(self%curve)) return
    is_source = self%is_source()
    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        associate (curve => self%curve(l, e), segment => self%branch(l, e))
          if (self%argument == over_twist) then
            restoring(i) = restoring(i) - curve%value(segment, angle(i) - self%rest_twist(l, e))
          else if (self%argument == over_time) then
            applied(i) = applied(i) + curve%value(segment, time(l))
          else if (is_source) then
            applied(i) = applied(i) + curve%value(segment, speed(i))
          else
            applied(i) = applied(i) - curve%value(segment, speed(i))
          end if
        end associate
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, elements)
    class(table_laws_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: slope, x
    integer :: e, i, l
    logical :: is_source

    if (.not. allocated(self%curve)) return
    is_source = self%is_source()
    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        associate (curve => self%curve(l, e), segment => self%branch(l, e))
          x = self%argument_of(l, e, elements%time(l), elements%angle(l, i), elements%speed(l, i))
          slope = curve%slope(segment, x)
          if (self%argument == over_twist) then
            elements%restoring_angle(l, i) = elements%restoring_angle(l, i) - slope
            elements%restoring_curvature(l, i) = elements%restoring_curvature(l, i) - curve%curvature(segment, x)
          else if (self%argument == over_time) then
            elements%applied_time(l, i) = elements%applied_time(l, i) + slope
          else
            elements%applied_speed(l, i) = elements%applied_speed(l, i) + merge(slope, -slope, is_source)
          end if
        end associate
      end do
    end do
  end subroutine differentiate

  !> The energy of a curve over the twist, counted from w = u - rest_twist = 0.
  subroutine evaluate_energies(self, elements)
    class(table_laws_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, i, l

    if (.not. allocated(self%curve) .or. self%argument /= over_twist) return
    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        associate (curve => self%curve(l, e), segment => self%branch(l, e))
          w = elements%angle(l, i) - self%rest_twist(l, e)
          elements%stored(l, i) = elements%stored(l, i) &
                                  + (curve%integral(segment, w) - curve%integral(curve%segment(0.0_wp), 0.0_wp))
          if (abs(w) > 0) elements%secant(l, i) = elements%secant(l, i) + curve%value(segment, w) / w
        end associate
      end do
    end do
  end subroutine evaluate_energies

  !> What the curve of an element is a function of.
  pure real(wp) function argument_of(self, lane, element, t, angle, speed)
    class(table_laws_t), intent(in) :: self
    integer, intent(in) :: lane, element
    real(wp), intent(in) :: t              !! [s]
    real(wp), intent(in) :: angle, speed   !! u [rad], u' [rad/s]

    select case (self%argument)
    case (over_twist)
      argument_of = angle - self%rest_twist(lane, element)
    case (over_speed)
      argument_of = speed
    case default
      argument_of = t
    end select
  end function argument_of

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(table_laws_t), intent(inout) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    self%branch(lane, switch) = self%curve(lane, switch)%segment(self%argument_of(lane, switch, time_reached(t), angle, speed))
  end subroutine choose

  !> Of a curve over the time in seconds: time does not go back across a boundary.
  pure real(wp) function indicator(self, switch, lane, t, angle, speed, internal)
    class(table_laws_t), intent(in) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    associate (curve => self%curve(lane, switch), segment => self%branch(lane, switch))
      if (self%argument == over_time) then
        indicator = curve%distance_to_end(segment, t)
      else
        indicator = curve%inset(segment, self%argument_of(lane, switch, t, angle, speed), boundary_width)
      end if
    end associate
  end function indicator

  function knees(self, element) result(speeds)
    class(table_laws_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), allocatable :: speeds(:)

    allocate (speeds(0))
    if (allocated(self%curve) .and. self%argument == over_speed) speeds = self%curve(1, element)%knots()
  end function knees

  subroutine list_parameters(self, parameters)
    class(table_laws_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(allocated(self%curve))
    if (allocated(self%curve)) call parameters%add_curves(self%curve)
  end subroutine list_parameters

end module nocdyn_table_laws
