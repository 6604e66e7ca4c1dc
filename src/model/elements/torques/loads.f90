!> Loads with the viscous resistance of eq. (5), M_r = -c omega, and those that resist with c omega + quadratic |omega| omega +
!> constant tanh(omega / constant_speed) + table(omega): fans and propellers, Coulomb friction made smooth.
module nocdyn_loads
  use nocdyn_bank, only: bank_t, role_load
  use nocdyn_curves, only: curve_t
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), operator(/), &
    pick, speed_of
  use nocdyn_law_functions, only: add_guard, tanh
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_polynomial_laws, only: coefficient_by_speed
  use nocdyn_tables, only: add_table, curve_value, guard_segment
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_loads, new_nonlinear_loads, resistance

  type, extends(bank_t), public :: loads_t
    logical :: has_quadratic = .false.
  contains
    procedure :: describe
  end type loads_t

contains

  !> A bank of viscous loads, each on one body.
  function new_loads(names, body, viscous) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
    type(loads_t) :: bank

    call bank%connect(role_load, size(viscous, 1), names, body)
    call bank%add_parameter('viscous', viscous)
    call bank%add_term('viscous', coefficient_by_speed, -1.0_wp)
  end function new_loads

  !> A bank of loads with all these terms, each on one body.
  function new_nonlinear_loads(names, body, viscous, quadratic, constant, constant_speed, curve) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :), quadratic(:, :)         !! [N m s/rad], [N m s2/rad2], shape [lanes, loads]
    real(wp), intent(in) :: constant(:, :), constant_speed(:, :)   !! [N m], [rad/s], shape [lanes, loads]
    type(curve_t), intent(in), optional :: curve(:, :)   !! resisting torque [N m] over speed [rad/s], [lanes, loads]; absent: 0
    type(loads_t) :: bank
    integer :: e

    bank = new_loads(names, body, viscous)
    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%add_parameter('quadratic', quadratic)
    call bank%add_parameter('constant', constant)
    call bank%add_parameter('constant_speed', constant_speed)
    if (present(curve)) call add_table(bank, curve)
    bank%has_quadratic = any(abs(quadratic) > 0)
    if (bank%has_quadratic) call bank%add_switches([('standstill', e=1, size(body))], 2)
    call bank%prepare_law()
  end function new_nonlinear_loads

  subroutine describe(self, tape)
    class(loads_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    tape%applied = node_of(resistance(self, self%has_quadratic, tape))
  end subroutine describe

  !> The moment that resists, without its viscous part: a formula of a bank with the parameters and switches of such loads.
  function resistance(bank, has_quadratic, tape) result(moment)
    class(bank_t), intent(in) :: bank
    logical, intent(in) :: has_quadratic   !! whether its last switch is the one of `quadratic`
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: moment, speed, speed_scale
    integer :: switch

    speed = speed_of(tape)
    speed_scale = bank%parameter(tape, 'constant_speed')
    moment = -(bank%parameter(tape, 'constant') * tanh(speed / speed_scale))
    if (allocated(bank%curve)) then
      moment = moment - curve_value(tape, speed)
      call guard_segment(tape, speed)
    end if
    if (has_quadratic) then
      switch = size(bank%switch_element) / bank%count
      moment = moment - pick(switch, [literal(tape, 1.0_wp), literal(tape, -1.0_wp)]) * bank%parameter(tape, 'quadratic') &
               * (speed * speed)
      call add_guard(switch, 1, speed, boundary_width * speed_scale)
      call add_guard(switch, 2, -speed, boundary_width * speed_scale)
    end if
  end function resistance

end module nocdyn_loads
