!> The rows of slider-cranks, by which pistons and rods move with their cranks. With the crank radius r, the rod length l and the
!> offset e of the piston's line beside the axis of the crank, and the angle v from where the crank points along this line, the
!> piston is at x = r cos(v) + sqrt(l^2 - p^2), p = r sin(v) - e; F. Freudenstein, Trans. ASME 77 (1955) 853 for e = 0 likewise.
!>
!> A rod with an inertia of its own has three rows more: the position of its centre of mass along the line and across, and its
!> angle asin(p / l) = atan(p / sqrt(l^2 - p^2)). Without one its mass is on its two ends; the part at the piston has one more
!> row with the motion of the piston. The force of the first row is therefore the one of the rod on the pin of the piston, however
!> the rod is given.
module nocdyn_crank_rows
  use nocdyn_bank, only: role_crank
  use nocdyn_bank_states, only: new_bank_state
  use nocdyn_described_rows, only: described_rows_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(+), operator(-), operator(/)
  use nocdyn_law_functions, only: atan, cos, sin, sqrt
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_quantities, only: form_angle, form_applied, form_observed, form_speed, new_quantity, quantity_t, rank_force, &
    rank_slip, rank_torque, rank_twist
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_crank_rows

  integer, parameter :: part_piston = 1    ! the first element; the others of a rod: along, across, angle
  integer, parameter :: all_parts = 4      ! elements if the rod has an inertia of its own

  !> Dimensions of a slider-crank.
  type, public :: slider_crank_t
    real(wp) :: crank_radius = 0.0_wp   !! r [m]
    real(wp) :: rod_length = 0.0_wp     !! l [m], more than r + |e|
    real(wp) :: offset = 0.0_wp         !! e [m]
    real(wp) :: phase = 0.0_wp          !! v where the angle of the body is zero [rad]
    real(wp) :: rod_center = 0.0_wp     !! centre of mass of the rod, distance from the crank pin [m]
  end type slider_crank_t

  type, extends(described_rows_t), public :: crank_rows_t
  contains
    procedure :: describe
    procedure :: positions
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
    call bank%prepare_rows()
  end function new_crank_rows

  !> The motion of the piston, also where the end of the rod moves with it; else of all parts.
  subroutine describe(self, tape)
    class(crank_rows_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: dimension(5), p, pin, reach, share, v   ! p and `pin`: of the crank pin across and along
    integer :: k

    do k = 1, size(dimension)
      dimension(k) = self%parameter(tape, 'dimensions', spread(k, 1, self%count))
    end do
    share = dimension(5) / dimension(2)
    associate (r => dimension(1), l => dimension(2), e => dimension(3), phase => dimension(4))
      v = self%driver(tape) + phase
      pin = r * cos(v)
      p = r * (sin(v) - e / r)
      reach = sqrt(l * l - p * p)
      tape%row = spread(node_of(pin + reach), 1, self%count)
      if (self%count < all_parts) return
      tape%row(2:) = [node_of(pin + share * reach), node_of((1.0_wp - share) * p), node_of(atan(p / reach))]
    end associate
  end subroutine describe

  !> g of all rows.
  function positions(self, v)
    class(crank_rows_t), intent(in) :: self
    real(wp), intent(in) :: v   !! angle of the body [rad]
    real(wp) :: positions(self%count)   !! [m] or [rad]
    real(wp) :: g(0:3, self%count)

    call self%motions(new_bank_state(self, self%count), spread(v, 1, self%count), g)
    positions = g(0, :)
  end function positions

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
