!> Excitations given over the time by a table.
module nocdyn_table_excitations
  use nocdyn_bank, only: bank_t, role_excitation, time_reached
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_table_excitations

  !> The branches are the segments of the curves.
  type, extends(bank_t), public :: table_excitations_t
    type(curve_t), allocatable :: curve(:, :)   !! [N m] over [s], shape [lanes, excitations]
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: choose
    procedure :: indicator
    procedure :: switch_name
  end type table_excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_table_excitations(names, body, curve) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    type(curve_t), intent(in) :: curve(:, :)   !! [N m] over [s], shape [lanes, excitations]
    type(table_excitations_t) :: bank
    integer :: e

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_excitation, size(curve, 1), names, [(0, e=1, size(body))], body)
    allocate (bank%curve, source=curve)
    call bank%set_switches([(e, e=1, size(body))])
  end function new_table_excitations

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(table_excitations_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        applied(i) = applied(i) + self%curve(l, e)%value(self%branch(l, e), time(l))
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, elements)
    class(table_excitations_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, self%lanes
        associate (slope => elements%applied_time(l, self%first + e - 1))
          slope = slope + self%curve(l, e)%slope(self%branch(l, e), elements%time(l))
        end associate
      end do
    end do
  end subroutine differentiate

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(table_excitations_t), intent(inout) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)

    self%branch(lane, switch) = self%curve(lane, switch)%segment(time_reached(t))
  end subroutine choose

  !> In seconds; time does not go back across a border.
  pure function indicator(self, switch, lane, t, angle, speed, internal)
    class(table_excitations_t), intent(in) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed
    real(wp), intent(in) :: internal(:)
    real(wp) :: indicator

    indicator = self%curve(lane, switch)%distance_to_end(self%branch(lane, switch), t)
  end function indicator

  function switch_name(self, switch) result(name)
    class(table_excitations_t), intent(in) :: self
    integer, intent(in) :: switch
    character(len=:), allocatable :: name

    name = 'point in the table'
  end function switch_name

  subroutine list_parameters(self, parameters)
    class(table_excitations_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_curves(self%curve)
  end subroutine list_parameters

end module nocdyn_table_excitations
