!> Motors on inverters, whose speed is controlled: torque_limit y with the throttle y of a governor, from -1 to 1, and harmonics.
!>
!> The harmonics of the air gap's torque have multiples of the electrical frequency, the number of pole pairs times the speed:
!> (1 + sum of share_k sin(n_k p u + phase_k)) times the control torque, plus a sum of torque_k sin(n_k p u + phase_k).
module nocdyn_inverter_motors
  use nocdyn_bank, only: role_motor
  use nocdyn_governed_banks, only: governed_bank_t, governor_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: angle_of, expression_t, node_of, operator(*), operator(+)
  use nocdyn_law_functions, only: sin
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_inverter_motors

  !> The harmonics of the motors of a bank; those that a motor lacks have no size. Shape [lanes, motors, harmonics].
  type, public :: torque_harmonics_t
    real(wp), allocatable :: order(:, :, :)    !! oscillations per turn of the body
    real(wp), allocatable :: share(:, :, :)    !! of the control torque
    real(wp), allocatable :: torque(:, :, :)   !! [N m]
    real(wp), allocatable :: phase(:, :, :)    !! at u = 0 [rad]
  end type torque_harmonics_t

  type, extends(governed_bank_t), public :: inverter_motors_t
    integer, private :: harmonics = 0   !! of each motor
  contains
    procedure :: describe
  end type inverter_motors_t

contains

  !> A bank of motors, each on one body.
  function new_inverter_motors(names, body, torque_limit, governor, harmonics) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: torque_limit(:, :)   !! [N m], positive, shape [lanes, motors]
    type(governor_t), intent(in) :: governor     !! of all motors, down to -1
    type(torque_harmonics_t), intent(in) :: harmonics
    type(inverter_motors_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    allocate (bank%internal_names, source=[character(len=24) :: 'governor integral'])
    call bank%connect(role_motor, size(torque_limit, 1), names, body)
    call bank%add_parameter('torque_limit', torque_limit)
    bank%harmonics = size(harmonics%order, 3)
    call bank%add_parts('order', harmonics%order)
    call bank%add_parts('share', harmonics%share)
    call bank%add_parts('torque', harmonics%torque)
    call bank%add_parts('phase', harmonics%phase)
    call bank%add_governor(governor)
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
