!> Motors on inverters, whose speed is controlled: torque_limit y with the throttle y of a governor, from -1 to 1, and harmonics.
!>
!> The harmonics of the air gap's torque have multiples of the electrical frequency, the number of pole pairs times the speed:
!> (1 + sum of share_k sin(n_k p u + phase_k)) times the control torque, plus a sum of torque_k sin(n_k p u + phase_k).
module nocdyn_inverter_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_governed_banks, only: governed_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: angle_of, expression_t, node_of, operator(*), operator(+)
  use nocdyn_law_functions, only: sin
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_inverter_motors

  type, extends(governed_bank_t), public :: inverter_motors_t
    integer, private :: harmonics = 0   !! of each motor
  contains
    procedure :: describe
  end type inverter_motors_t

contains

  !> A bank of motors, each on one body. Harmonics that a motor lacks have no size.
  function new_inverter_motors(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(inverter_motors_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    allocate (bank%internal_names, source=[character(len=24) :: 'governor integral'])
    call bank%connect(role_motor, keys)
    call bank%add_key(keys, 'torque_limit')
    bank%harmonics = keys%longest('harmonics')
    associate (n => bank%harmonics)
      call bank%add_parts('order', spread(0.5_wp * keys%values('poles'), 3, n) * keys%lists('harmonics', n))
      call bank%add_parts('share', keys%lists('harmonic_shares', n))
      call bank%add_parts('torque', keys%lists('harmonic_torques', n))
      call bank%add_parts('phase', keys%lists('harmonic_phases', n))
    end associate
    call bank%add_governor(keys, least=-1.0_wp)
    call bank%prepare_law()
  end function new_inverter_motors

  subroutine describe(self, tape)
    class(inverter_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: control, torque, wave
    integer :: columns(self%count), k

    control = self%parameter(tape, 'torque_limit') * self%throttle(tape)
    tape%control = node_of(control)
    torque = control
    do k = 1, self%harmonics
      columns = self%part_columns(k)
      wave = sin(self%parameter(tape, 'order', columns) * angle_of(tape) + self%parameter(tape, 'phase', columns))
      torque = torque + (self%parameter(tape, 'torque', columns) + self%parameter(tape, 'share', columns) * control) * wave
    end do
    tape%applied = node_of(torque)
  end subroutine describe

end module nocdyn_inverter_motors
