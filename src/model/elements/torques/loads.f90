!> Loads with the viscous resistance of eq. (5), M_r = -c omega, and those that resist with c omega + quadratic |omega| omega +
!> constant tanh(omega / constant_speed) + table(omega): fans and propellers, Coulomb friction made smooth.
module nocdyn_loads
  use nocdyn_bank, only: bank_t, role_load
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), operator(/), &
    pick, speed_of
  use nocdyn_law_functions, only: add_guard, tanh
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_polynomial_laws, only: coefficient_by_speed
  use nocdyn_tables, only: add_table, curve_value, guard_segment
  implicit none (type, external)
  private

  public :: new_loads, add_resistance, resistance

  type, extends(bank_t), public :: loads_t
    integer :: quadratic_switch = 0   !! as in `resistance`
  contains
    procedure :: describe
  end type loads_t

contains

  !> A bank of loads, each on one body, that are viscous or have all terms.
  function new_loads(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(loads_t) :: bank
    integer :: switch

    call bank%connect(role_load, keys)
    call bank%add_key(keys, 'viscous')
    call bank%add_term('viscous', coefficient_by_speed, -1.0_wp)
    bank%is_polynomial = .not. (any(keys%values('quadratic') > 0) .or. any(keys%values('constant') > 0) .or. &
                                keys%has('table_speed'))
    bank%has_paper_law = bank%is_polynomial
    if (bank%is_polynomial) return
    call add_resistance(bank, keys, .true., switch)
    bank%quadratic_switch = switch
    call bank%prepare_law()
  end function new_loads

  !> Adds the parameters, tables and switches of `resistance`.
  subroutine add_resistance(bank, keys, are_own, switch)
    class(bank_t), intent(inout) :: bank
    class(element_keys_t), intent(in) :: keys   !! of a load for each element
    logical, intent(in) :: are_own              !! whether they are the keys of the elements themselves
    integer, intent(out) :: switch              !! as in `resistance`
    integer :: e

    call bank%add_parameter('quadratic', keys%values('quadratic'), are_own)
    call bank%add_parameter('constant', keys%values('constant'), are_own)
    call bank%add_parameter('constant_speed', keys%values('constant_speed', absent=1.0_wp), are_own)
    if (keys%has('table_speed')) call add_table(bank, keys%curves('table_speed', 'table_torque'))
    switch = 0
    if (.not. any(abs(keys%values('quadratic')) > 0)) return
    call bank%add_switches([('standstill', e=1, bank%count)], 2)
    switch = size(bank%switch_element) / bank%count
  end subroutine add_resistance

  subroutine describe(self, tape)
    class(loads_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    tape%applied = node_of(resistance(self, self%quadratic_switch, tape))
  end subroutine describe

  !> The moment that resists, without its viscous part: a formula of a bank with the parameters and switches of such loads.
  function resistance(bank, switch, tape) result(moment)
    class(bank_t), intent(in) :: bank
    integer, intent(in) :: switch          !! of `quadratic` among the ones of an element; 0: there is no such term
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: moment, speed, speed_scale

    speed = speed_of(tape)
    speed_scale = bank%parameter(tape, 'constant_speed')
    moment = -(bank%parameter(tape, 'constant') * tanh(speed / speed_scale))
    if (allocated(bank%curve)) then
      moment = moment - curve_value(tape, speed)
      call guard_segment(tape, speed)
    end if
    if (switch > 0) then
      moment = moment - pick(switch, [literal(tape, 1.0_wp), literal(tape, -1.0_wp)]) * bank%parameter(tape, 'quadratic') &
               * (speed * speed)
      call add_guard(switch, 1, speed, boundary_width * speed_scale)
      call add_guard(switch, 2, -speed, boundary_width * speed_scale)
    end if
  end function resistance

end module nocdyn_loads
