!> What all excitations share: a window over the time in which they act, and a decay of their torque.
!>
!> The torque is 0 before `begin` and after `end`, and law exp(-rate (t - begin)) between them.
module nocdyn_excitation_banks
  use nocdyn_bank, only: bank_t
  use nocdyn_described_elements, only: never
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(-), pick, time_of
  use nocdyn_law_functions, only: add_guard, exp
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  !> An extension gives the torque without the window.
  type, abstract, extends(bank_t), public :: excitation_bank_t
    logical, private :: has_window = .false.
  contains
    procedure :: describe
    procedure(torque_interface), deferred :: torque
    procedure :: set_window
    procedure :: has_ended
  end type excitation_bank_t

  abstract interface
    !> The torque as if there were no window [N m].
    function torque_interface(self, tape) result(torque)
      import :: excitation_bank_t, expression_t, law_tape_t
      class(excitation_bank_t), intent(in) :: self
      type(law_tape_t), target, intent(inout) :: tape
      type(expression_t) :: torque
    end function torque_interface
  end interface

  integer, parameter :: before = 1, during = 2, after = 3   ! the branches

contains

  !> Gives every excitation a window, with a switch; after the constructor. It begins at `time` unless at `start`.
  subroutine set_window(self, keys, first)
    class(excitation_bank_t), intent(inout) :: self
    class(element_keys_t), intent(in) :: keys
    integer, intent(in) :: first   !! its first element among the ones of the keys
    real(wp), dimension(keys%lanes, size(keys%names)) :: begin, decay, rate
    integer :: e

    begin = keys%values('start', absent=-never)
    where (begin <= -never) begin = max(keys%t_start, keys%values('time', absent=keys%t_start))
    decay = keys%values('decay')
    rate = 0.0_wp
    where (decay > 0) rate = 1 / decay
    self%has_window = .true.
    associate (end => keys%values('end', absent=never), last => first + self%count - 1)
      call self%add_parameter('window begin', begin(:, first:last), is_key=.false.)
      call self%add_parameter('window end', end(:, first:last), is_key=.false.)
      call self%add_parameter('decay rate', rate(:, first:last), is_key=.false.)
    end associate
    call self%add_switches([('start or end', e=1, self%count)], after)
    call self%prepare_law()
  end subroutine set_window

  subroutine describe(self, tape)
    class(excitation_bank_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: begin, decay, none, one, torque
    integer :: switch

    torque = self%torque(tape)
    if (self%has_window) then
      switch = size(self%switch_element) / self%count
      none = literal(tape, 0.0_wp)
      one = literal(tape, 1.0_wp)
      begin = self%parameter(tape, 'window begin')
      decay = exp(-(pick(switch, [none, one, none]) * self%parameter(tape, 'decay rate') * (time_of(tape) - begin)))
      torque = pick(switch, [none, one, none]) * torque * decay
      call add_guard(switch, before, begin - time_of(tape), none)   ! time does not go back across a boundary
      call add_guard(switch, during, self%parameter(tape, 'window end') - time_of(tape), none)
    end if
    tape%applied = node_of(torque)
  end subroutine describe

  !> Whether an excitation in the first lane has no part in a steady state: it ends or decays.
  pure logical function has_ended(self, element)
    class(excitation_bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank

    has_ended = .false.
    if (.not. self%has_window) return
    associate (end => self%parameters(self%number_of('window end'))%value(1, element), &
               rate => self%parameters(self%number_of('decay rate'))%value(1, element))
      has_ended = end < never .or. rate > 0
    end associate
  end function has_ended

end module nocdyn_excitation_banks
