!> Couplings whose elastic moment cannot exceed a limit: S tanh(K1 w / S) with w = u - rest_twist.
module nocdyn_saturated_couplings
  use nocdyn_couplings, only: coupling_common_t, couplings_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(-), operator(/)
  use nocdyn_law_functions, only: log_cosh, tanh
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_saturated_couplings

  type, extends(couplings_t), public :: saturated_couplings_t
  contains
    procedure :: describe
  end type saturated_couplings_t

contains

  !> Couplings with the elastic moment saturation * tanh(stiffness * w / saturation).
  function new_saturated_couplings(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(saturated_couplings_t) :: bank
    integer :: e

    call bank%set_common(coupling_common_t(keys))
    call bank%add_damping()
    call bank%add_key(keys, 'stiffness')
    call bank%add_key(keys, 'saturation')
    bank%elastic = [(e, e=1, bank%count)]
    call bank%prepare_law()
  end function new_saturated_couplings

  !> The energy is S^2 / K1 ln cosh(K1 w / S).
  subroutine describe(self, tape)
    class(saturated_couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: k1, moment, s, w, x

    call self%couplings_t%describe(tape)
    w = self%twist_from_rest(tape)
    k1 = self%parameter(tape, 'stiffness')
    s = self%parameter(tape, 'saturation')
    x = k1 / s * w
    moment = s * tanh(x)
    tape%restoring = node_of(-moment)
    tape%stored = node_of(s * s / k1 * log_cosh(x))
  end subroutine describe

end module nocdyn_saturated_couplings
