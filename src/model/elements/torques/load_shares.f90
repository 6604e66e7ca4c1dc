!> Excitations whose amplitudes are shares of the torque of a load at the present speed of its body: the blades of a propeller.
!>
!> The torque is (c u' + quadratic |u'| u' + constant tanh(u' / constant_speed) + table(u')) times the sum of
!> share sin(order u + phase).
module nocdyn_load_shares
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, operator(*), operator(-), speed_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_loads, only: add_resistance, resistance
  use nocdyn_wave_excitations, only: new_wave_excitations, wave_excitations_t
  implicit none (type, external)
  private

  public :: new_load_shares

  type, extends(wave_excitations_t), public :: load_shares_t
    integer :: quadratic_switch = 0   !! as in `resistance`
  contains
    procedure :: torque
  end type load_shares_t

contains

  !> A bank of excitations, each on one body.
  function new_load_shares(keys, load) result(bank)
    class(element_keys_t), intent(in) :: keys
    class(element_keys_t), intent(in) :: load   !! the keys of the load of each excitation
    type(load_shares_t) :: bank
    integer :: switch

    associate (share => keys%joined('share_of_load'))
      bank%wave_excitations_t = new_wave_excitations(keys, keys%owners('orders'), share, 0.0_wp * share, keys%joined('orders'), &
                                                     keys%joined('phases'))
    end associate
    call bank%add_parameter('viscous', load%values('viscous'), is_key=.false.)
    call add_resistance(bank, load, .false., switch)
    bank%quadratic_switch = switch
    call bank%prepare_law()
  end function new_load_shares

  function torque(self, tape)
    class(load_shares_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: torque

    torque = (self%parameter(tape, 'viscous') * speed_of(tape) - resistance(self, self%quadratic_switch, tape, speed_of(tape))) &
             * self%sum_of_waves(tape)
  end function torque

end module nocdyn_load_shares
