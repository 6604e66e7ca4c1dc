!> Excitations with a table over the time.
module nocdyn_table_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_law_expressions, only: expression_t, time_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_tables, only: add_table, curve_value, guard_segment
  implicit none (type, external)
  private

  public :: new_table_excitations

  type, extends(excitation_bank_t), public :: table_excitations_t
  contains
    procedure :: torque
  end type table_excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_table_excitations(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(table_excitations_t) :: bank

    call bank%connect(role_excitation, keys)
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call add_table(bank, keys%curves('table_time', 'table_torque', extrapolation='constant'))
    call bank%prepare_law()
  end function new_table_excitations

  function torque(self, tape)
    class(table_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque

    if (.not. allocated(self%curve)) error stop 'nocdyn_table_excitations: there are no tables'
    torque = curve_value(tape, time_of(tape))
    call guard_segment(tape, time_of(tape), is_time=.true.)
  end function torque

end module nocdyn_table_excitations
