!> Forces on pistons along their lines, by the angles of their cranks: a mean and harmonics. Each is a bank of its own, and its
!> phase, the crank, another.
module nocdyn_piston_forces
  use nocdyn_bank, only: bank_t, role_crank
  use nocdyn_described_elements, only: stays_whole
  use nocdyn_element_rows, only: rows_between
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), phase_of
  use nocdyn_law_functions, only: harmonics
  use nocdyn_law_tape, only: at_phase, law_tape_t
  use nocdyn_quantities, only: form_total, new_quantity, quantity_t, rank_force
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_piston_force

  !> mean + sum of sine(k) sin(k base angle) + cosine(k) cos(k base angle).
  type, public :: periodic_force_t
    real(wp) :: base = 1.0_wp                 !! 1, or 1/2 of a cycle of two turns
    real(wp) :: mean = 0.0_wp                 !! [N]
    real(wp), allocatable :: sine(:), cosine(:)   !! [N]
  contains
    procedure :: value
  end type periodic_force_t

  type, extends(bank_t), public :: piston_forces_t
    integer :: orders = 0
  contains
    procedure :: describe
    procedure :: quantities
    procedure :: named_count
  end type piston_forces_t

contains

  !> The bank of one force.
  function new_piston_force(lanes, name, piston, phase, force) result(bank)
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: name
    integer, intent(in) :: piston                !! body
    real(wp), intent(in) :: phase                !! angle of the force where the angle of the crank's body is zero [rad]
    type(periodic_force_t), intent(in) :: force
    type(piston_forces_t) :: bank
    integer :: k

    call bank%connect(role_crank, lanes, [name], rows_between([0], [piston]))
    bank%elastic = [integer ::]
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%ports = at_phase
    bank%steady_part = stays_whole
    bank%orders = size(force%sine)
    bank%phase_order = force%base * bank%orders
    call bank%add_parameter('base', spread([force%base], 1, lanes), .false.)
    call bank%add_parameter('phase', spread([phase], 1, lanes), .false.)
    call bank%add_parameter('mean', spread([force%mean], 1, lanes), .false.)
    call bank%add_parameter('sine', spread(force%sine, 1, lanes), .false., [(1, k=1, bank%orders)])
    call bank%add_parameter('cosine', spread(force%cosine, 1, lanes), .false., [(1, k=1, bank%orders)])
    call bank%prepare_law()
  end function new_piston_force

  !> The force at an angle of the crank [N].
  pure real(wp) function value(self, angle)
    class(periodic_force_t), intent(in) :: self
    real(wp), intent(in) :: angle   !! [rad]
    integer :: k

    value = self%mean + sum([(self%sine(k) * sin(k * self%base * angle) + self%cosine(k) * cos(k * self%base * angle), &
                              k=1, size(self%sine))])
  end function value

  subroutine describe(self, tape)
    class(piston_forces_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), dimension(self%orders) :: cosine, sine
    integer :: k

    do k = 1, self%orders
      sine(k) = self%parameter(tape, 'sine', [k])
      cosine(k) = self%parameter(tape, 'cosine', [k])
    end do
    tape%applied = node_of(self%parameter(tape, 'mean') + &
                           harmonics([(k, k=1, self%orders)], sine, cosine, &
                                     self%parameter(tape, 'base') * (phase_of(tape) + self%parameter(tape, 'phase'))))
    tape%restoring = node_of(literal(tape, 0.0_wp))
    tape%phase_applied = node_of(literal(tape, 0.0_wp))
    tape%phase_restoring = node_of(literal(tape, 0.0_wp))
  end subroutine describe

  subroutine quantities(self, columns)
    class(piston_forces_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    allocate (columns(1))
    columns(1) = new_quantity('gas_force', 'N', [(e, e=1, self%count)], 'gas force on the piston', 'away from the crank', &
                              rank_force, form_total, 1.0_wp)
  end subroutine quantities

  !> Its name is the one of the crank.
  pure integer function named_count(self)
    class(piston_forces_t), intent(in) :: self

    named_count = 0
  end function named_count

end module nocdyn_piston_forces
