!> Couplings with the elastic moment of a table over the twist.
module nocdyn_table_couplings
  use nocdyn_couplings, only: coupling_common_t, couplings_t
  use nocdyn_curves, only: curve_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_law_expressions, only: expression_t, node_of, operator(-)
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_tables, only: add_table, curve_integral, curve_value, guard_segment
  implicit none (type, external)
  private

  public :: new_table_couplings, set_table

  !> M_el = -curve(u - rest_twist) on the second body.
  type, extends(couplings_t), public :: table_couplings_t
  contains
    procedure :: describe
  end type table_couplings_t

contains

  !> Couplings with the elastic moment of a curve over the twist.
  function new_table_couplings(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(table_couplings_t) :: bank

    call set_table(bank, coupling_common_t(keys), keys%curves('table_twist', 'table_moment'))
    call bank%prepare_law()
  end function new_table_couplings

  !> Sets what couplings with a curve have in common, before the law is prepared.
  subroutine set_table(bank, common, curve)
    class(table_couplings_t), intent(inout) :: bank
    type(coupling_common_t), intent(in) :: common
    type(curve_t), intent(in) :: curve(:, :)   !! moment over the twist from rest, [lanes, couplings]
    integer :: e

    call bank%set_common(common)
    call bank%add_damping()
    call add_table(bank, curve)
    bank%elastic = [(e, e=1, bank%count)]
  end subroutine set_table

  subroutine describe(self, tape)
    class(table_couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: moment, w

    call self%couplings_t%describe(tape)
    w = self%twist_from_rest(tape)
    moment = curve_value(tape, w)
    tape%restoring = node_of(-moment)
    tape%stored = node_of(curve_integral(tape, w))
    call guard_segment(tape, w)
  end subroutine describe

end module nocdyn_table_couplings
