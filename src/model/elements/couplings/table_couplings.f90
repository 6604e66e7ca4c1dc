!> Couplings whose elastic moment over the twist is a table.
module nocdyn_table_couplings
  use nocdyn_bank, only: boundary_width
  use nocdyn_couplings, only: couplings_t, new_couplings
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_table_couplings

  !> M_el = -curve(w) on the second body, w = u - rest_twist. The branches are the segments of the curve.
  type, extends(couplings_t), public :: table_couplings_t
    type(curve_t), allocatable :: curve(:, :)   !! [N m] over [rad], shape [lanes, couplings]
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
    procedure :: choose
    procedure :: indicator
    procedure :: switch_name
  end type table_couplings_t

contains

  !> Couplings with the elastic moment of a curve over the twist.
  function new_table_couplings(names, from, to, curve, damping, rest_twist, friction, friction_speed) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)              !! bodies, 0 = ground
    type(curve_t), intent(in) :: curve(:, :)           !! [N m] over [rad], shape [lanes, couplings] as all parameters
    real(wp), intent(in) :: damping(:, :)              !! [N m s/rad]
    real(wp), intent(in) :: rest_twist(:, :)           !! [rad]
    real(wp), intent(in), optional :: friction(:, :), friction_speed(:, :)   !! [N m], [rad/s]; absent: none
    type(table_couplings_t) :: bank
    integer :: e

    bank%couplings_t = new_couplings(names, from, to, 0.0_wp * damping, 0.0_wp * damping, damping, rest_twist, &
                                     friction, friction_speed)
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    allocate (bank%curve, source=curve)
    bank%elastic = [(e, e=1, size(to))]
    call bank%set_switches([(e, e=1, size(to))])
  end function new_table_couplings

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(table_couplings_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        restoring(i) = restoring(i) - self%curve(l, e)%value(self%branch(l, e), angle(i) - self%rest_twist(l, e))
      end do
    end do
    call self%couplings_t%evaluate(time, angle, speed, restoring, applied)
  end subroutine evaluate

  subroutine differentiate(self, elements)
    class(table_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        associate (curve => self%curve(l, e), segment => self%branch(l, e))
          w = elements%angle(l, i) - self%rest_twist(l, e)
          elements%restoring_angle(l, i) = elements%restoring_angle(l, i) - curve%slope(segment, w)
          elements%restoring_curvature(l, i) = elements%restoring_curvature(l, i) - curve%curvature(segment, w)
        end associate
      end do
    end do
    call self%couplings_t%differentiate(elements)
  end subroutine differentiate

  !> The energy is counted from w = 0.
  subroutine evaluate_energies(self, elements)
    class(table_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, i, l

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

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(table_couplings_t), intent(inout) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)

    self%branch(lane, switch) = self%curve(lane, switch)%segment(angle - self%rest_twist(lane, switch))
  end subroutine choose

  pure function indicator(self, switch, lane, t, angle, speed, internal)
    class(table_couplings_t), intent(in) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)
    real(wp) :: indicator

    indicator = self%curve(lane, switch)%inset(self%branch(lane, switch), angle - self%rest_twist(lane, switch), boundary_width)
  end function indicator

  function switch_name(self, switch) result(name)
    class(table_couplings_t), intent(in) :: self
    integer, intent(in) :: switch
    character(len=:), allocatable :: name

    name = 'point in the table'
  end function switch_name

  subroutine list_parameters(self, parameters)
    class(table_couplings_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%couplings_t%list_parameters(parameters)
    call parameters%add_curves(self%curve)
  end subroutine list_parameters

end module nocdyn_table_couplings
