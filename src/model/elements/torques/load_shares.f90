!> Excitations whose amplitudes are shares of the torque of a load at the present speed of its body: the blades of a propeller.
!>
!> The torque is (c u' + quadratic |u'| u' + constant tanh(u' / constant_speed) + table(u')) times the sum of
!> share sin(order u + phase).
module nocdyn_load_shares
  use nocdyn_curves, only: curve_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, operator(*), operator(-), speed_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_loads, only: resistance
  use nocdyn_tables, only: add_table
  use nocdyn_text, only: string_t
  use nocdyn_wave_excitations, only: new_wave_excitations, wave_excitations_t
  implicit none (type, external)
  private

  public :: new_load_shares

  type, extends(wave_excitations_t), public :: load_shares_t
    logical :: has_quadratic = .false.
  contains
    procedure :: torque
  end type load_shares_t

  !> The loads of some excitations, with the terms of `new_nonlinear_loads`.
  type, public :: shared_load_t
    real(wp), allocatable :: viscous(:, :), quadratic(:, :)         !! [N m s/rad], [N m s2/rad2], [lanes, excitations]
    real(wp), allocatable :: constant(:, :), constant_speed(:, :)   !! [N m], [rad/s], [lanes, excitations]
    type(curve_t), allocatable :: curve(:, :)   !! resisting torque [N m] over speed [rad/s], [lanes, excitations]; or 0
  end type shared_load_t

contains

  !> A bank of excitations, each on one body.
  function new_load_shares(names, body, owner, share, order, phase, load) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    integer, intent(in) :: owner(:)                                        !! excitation of each term
    real(wp), intent(in) :: share(:, :), order(:, :), phase(:, :)          !! [1], [1], [rad], shape [lanes, terms]
    type(shared_load_t), intent(in) :: load
    type(load_shares_t) :: bank
    real(wp) :: still(size(share, 1), size(share, 2))
    integer :: e

    still = 0.0_wp
    bank%wave_excitations_t = new_wave_excitations(names, body, owner, share, still, order, phase)
    call bank%add_parameter('viscous', load%viscous, is_key=.false.)
    call bank%add_parameter('quadratic', load%quadratic, is_key=.false.)
    call bank%add_parameter('constant', load%constant, is_key=.false.)
    call bank%add_parameter('constant_speed', load%constant_speed, is_key=.false.)
    if (allocated(load%curve)) call add_table(bank, load%curve)
    bank%has_quadratic = any(abs(load%quadratic) > 0)
    if (bank%has_quadratic) call bank%add_switches([('standstill', e=1, size(body))], 2)
    call bank%prepare_law()
  end function new_load_shares

  function torque(self, tape)
    class(load_shares_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque

    torque = (self%parameter(tape, 'viscous') * speed_of(tape) - resistance(self, self%has_quadratic, tape)) &
             * self%sum_of_waves(tape)
  end function torque

end module nocdyn_load_shares
