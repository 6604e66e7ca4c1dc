!> The rows of slider-cranks, by which pistons and rods move with their cranks. With the crank radius r, the rod length l and the
!> offset e of the piston's line beside the axis of the crank, and the angle v from where the crank points along this line, the
!> piston is at x = r cos(v) + sqrt(l^2 - p^2), p = r sin(v) - e; F. Freudenstein, Trans. ASME 77 (1955) 853 for e = 0 likewise.
!>
!> A rod with an inertia of its own has three rows more: the position of its centre of mass along the line and across, and its
!> angle asin(p / l). Without one its mass is on its two ends; the part at the piston has one more row with the motion of the
!> piston. The force of the first row is therefore the one of the rod on the pin of the piston, however the rod is given.
module nocdyn_crank_rows
  use nocdyn_bank, only: role_crank
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_moving_rows, only: moving_rows_t
  use nocdyn_quantities, only: form_angle, form_applied, form_observed, form_speed, new_quantity, quantity_t, rank_force, &
    rank_slip, rank_torque, rank_twist
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_crank_rows

  integer, parameter :: part_piston = 1, part_rod_along = 2, part_rod_across = 3   ! the elements; the fourth is the rod's angle

  !> Dimensions of a slider-crank.
  type, public :: slider_crank_t
    real(wp) :: crank_radius = 0.0_wp   !! r [m]
    real(wp) :: rod_length = 0.0_wp     !! l [m], more than r + |e|
    real(wp) :: offset = 0.0_wp         !! e [m]
    real(wp) :: phase = 0.0_wp          !! v where the angle of the body is zero [rad]
    real(wp) :: rod_center = 0.0_wp     !! centre of mass of the rod, distance from the crank pin [m]
  end type slider_crank_t

  type, extends(moving_rows_t), public :: crank_rows_t
  contains
    procedure :: motion
    procedure, private :: crank
    procedure :: position
    procedure :: quantities => columns_of_cranks
    procedure :: observe => observe_cranks
    procedure :: named_count
  end type crank_rows_t

contains

  !> The rows of one slider-crank; the crank is the driver of all.
  function new_crank_rows(lanes, names, driven, crank) result(bank)
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)           !! the one of the crank, [elements]
    integer, intent(in) :: driven(:)                 !! piston, and what stands for the rod; [elements], 1, 2 or 4
    type(slider_crank_t), intent(in) :: crank
    type(crank_rows_t) :: bank

    call bank%connect_rows_only(role_crank, lanes, names, driven)
    call bank%add_parameter('dimensions', spread([crank%crank_radius, crank%rod_length, crank%offset, crank%phase, &
                                                  crank%rod_center], 1, lanes), .false., spread(1, 1, 5))
  end function new_crank_rows

  pure subroutine motion(self, element, segment, v, g)
    class(crank_rows_t), intent(in) :: self
    integer, intent(in) :: element, segment
    real(wp), intent(in) :: v          !! angle of the body [rad]
    real(wp), intent(out) :: g(0:3)    !! [m] or [rad]

    type(slider_crank_t) :: crank
    real(wp) :: share   ! of the rod between the crank pin and its centre of mass

    crank = self%crank()
    share = crank%rod_center / crank%rod_length
    if (self%count == 2) then   ! the end of the rod moves with the piston
      g = piston_motion(crank, v)
      return
    end if
    select case (element)
    case (part_piston)
      g = piston_motion(crank, v)
    case (part_rod_along)
      g = share * piston_motion(crank, v) + (1.0_wp - share) * turned_arm(crank, v)
    case (part_rod_across)
      g = (1.0_wp - share) * crossed_arm(crank, v)
    case default
      call rod_motion(crank, v, g)
    end select
  end subroutine motion

  !> Its dimensions in the first lane.
  pure type(slider_crank_t) function crank(self)
    class(crank_rows_t), intent(in) :: self

    associate (x => self%parameters(1)%value(1, :))
      crank = slider_crank_t(x(1), x(2), x(3), x(4), x(5))
    end associate
  end function crank

  !> g alone.
  pure real(wp) function position(self, element, v)
    class(crank_rows_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: v   !! angle of the body [rad]
    real(wp) :: g(0:3)

    call self%motion(element, 1, v, g)
    position = g(0)
  end function position

  !> r cos(v), the crank pin along the line of the piston, and its derivatives.
  pure function turned_arm(crank, v) result(g)
    type(slider_crank_t), intent(in) :: crank
    real(wp), intent(in) :: v   !! [rad]
    real(wp) :: g(0:3)          !! [m]

    associate (a => v + crank%phase)
      g = crank%crank_radius * [cos(a), -sin(a), -cos(a), sin(a)]
    end associate
  end function turned_arm

  !> p = r sin(v) - e, the crank pin across it.
  pure function crossed_arm(crank, v) result(g)
    type(slider_crank_t), intent(in) :: crank
    real(wp), intent(in) :: v   !! [rad]
    real(wp) :: g(0:3)          !! [m]

    associate (a => v + crank%phase)
      g = crank%crank_radius * [sin(a), cos(a), -sin(a), -cos(a)]
    end associate
    g(0) = g(0) - crank%offset
  end function crossed_arm

  !> Position of the piston from the axis of the crank.
  pure function piston_motion(crank, v) result(g)
    type(slider_crank_t), intent(in) :: crank
    real(wp), intent(in) :: v   !! angle of the body [rad]
    real(wp) :: g(0:3)          !! [m]

    g = turned_arm(crank, v) + rod_reach(crank, crossed_arm(crank, v))
  end function piston_motion

  !> w = sqrt(l^2 - p^2), by w w' = -p p' and its derivatives.
  pure function rod_reach(crank, p) result(w)
    type(slider_crank_t), intent(in) :: crank
    real(wp), intent(in) :: p(0:3)   !! [m]
    real(wp) :: w(0:3)               !! [m]

    w(0) = sqrt(crank%rod_length**2 - p(0)**2)
    w(1) = -p(0) * p(1) / w(0)
    w(2) = -(p(1)**2 + p(0) * p(2) + w(1)**2) / w(0)
    w(3) = -(3.0_wp * p(1) * p(2) + p(0) * p(3) + 3.0_wp * w(1) * w(2)) / w(0)
  end function rod_reach

  !> The angle beta of the rod: sin(beta) = p / l, w beta' = p' and its derivatives.
  pure subroutine rod_motion(crank, v, beta)
    type(slider_crank_t), intent(in) :: crank
    real(wp), intent(in) :: v             !! [rad]
    real(wp), intent(out) :: beta(0:3)    !! [rad]
    real(wp) :: p(0:3), w(0:3)

    p = crossed_arm(crank, v)
    w = rod_reach(crank, p)
    beta(0) = asin(p(0) / crank%rod_length)
    beta(1) = p(1) / w(0)
    beta(2) = (p(2) - w(1) * beta(1)) / w(0)
    beta(3) = (p(3) - 2.0_wp * w(1) * beta(2) - w(2) * beta(1)) / w(0)
  end subroutine rod_motion

  !> Position, speed and force of the piston, and the torque of piston and rod on the crank.
  subroutine columns_of_cranks(self, columns)
    class(crank_rows_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)

    allocate (columns(4))
    columns(1) = new_quantity('position', 'm', [part_piston], 'position of the piston', &
                              'away from the crank', rank_twist, form_angle, 1.0_wp)
    columns(2) = new_quantity('velocity', 'm/s', [part_piston], 'velocity of the piston', 'away from the crank', rank_slip, &
                              form_speed, 1.0_wp)
    columns(3) = new_quantity('force', 'N', [part_piston], 'force of the rod on the piston', 'away from the crank', &
                              rank_force, form_applied, 1.0_wp)
    columns(4) = new_quantity('torque', 'N m', [part_piston], 'torque of piston and rod on the crank', 'with a positive speed', &
                              rank_torque, form_observed, 1.0_wp)
  end subroutine columns_of_cranks

  pure subroutine observe_cranks(self, elements, quantity, lane, values)
    class(crank_rows_t), intent(in) :: self
    type(element_values_t), intent(in) :: elements
    integer, intent(in) :: quantity
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]

    if (quantity /= 4) error stop 'nocdyn_crank_rows: the torque is the quantity without a form'
    values = 0.0_wp
    values(part_piston) = sum(elements%applied(lane, self%last() + 1:self%last() + self%count))
  end subroutine observe_cranks

  !> All rows have the name of the crank.
  pure integer function named_count(self)
    class(crank_rows_t), intent(in) :: self

    named_count = 1
  end function named_count

end module nocdyn_crank_rows
