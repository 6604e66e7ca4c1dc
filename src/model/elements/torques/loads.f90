!> Loads with the viscous resistance of eq. (5), M_r = -c omega, and those that resist with c omega + quadratic |omega| omega +
!> constant tanh(omega / constant_speed) + table(omega): fans and propellers, Coulomb friction made smooth.
!>
!> Loads that damp vibrations follow the mean rotation w in place of omega, and add -c (omega - w) with a damping c of their own,
!> or one in proportion to the torque over w. The internal states w and v filter the speed over the time T:
!> w' = 2 (omega - w) / T + v, v' = (omega - w) / T^2. In a steady state and in an even run-up w = omega, so that the damping
!> takes no torque; of an oscillation with the frequency f it sees the part (i f T / (1 + i f T))^2. In the machine of a steady
!> state stand the mean laws, and the damping beside them (`vibration_damping` of the bank).
module nocdyn_loads
  use nocdyn_bank, only: bank_t, role_load
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_element_rows, only: rows_between
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), operator(/), &
    pick, speed_of, state_of
  use nocdyn_law_functions, only: add_guard, tanh
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_polynomial_laws, only: coefficient_by_speed
  use nocdyn_tables, only: add_table, curve_value, guard_segment
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_loads, new_vibration_dampers, add_resistance, resistance

  type, extends(bank_t), public :: loads_t
    integer :: quadratic_switch = 0        !! as in `resistance`
    logical :: has_resistance = .false.    !! whether it is part of the law
    logical :: follows_mean = .false.      !! whether the internal states are the mean rotation and its rate
  contains
    procedure :: describe
    procedure :: start_internal
  end type loads_t

contains

  !> A bank of loads, each on one body, that are viscous or have all terms. If one damps vibrations, all do.
  function new_loads(keys, is_steady) result(bank)
    class(element_keys_t), intent(in) :: keys
    logical, intent(in), optional :: is_steady   !! whether it is the machine of a steady state; absent: it is not
    type(loads_t) :: bank
    integer :: switch
    logical :: damps

    damps = keys%has('vibration_damping') .or. keys%has('vibration_factor')
    if (damps) call prepare_damping(bank, is_steady)
    call bank%connect(role_load, keys)
    call bank%add_key(keys, 'viscous')
    if (.not. bank%follows_mean) call bank%add_term('viscous', coefficient_by_speed, -1.0_wp)
    bank%has_resistance = any(keys%values('quadratic') > 0) .or. any(keys%values('constant') > 0) .or. keys%has('table_speed')
    bank%is_polynomial = .not. (bank%has_resistance .or. bank%follows_mean)
    bank%has_paper_law = bank%is_polynomial .and. .not. damps
    if (bank%has_resistance) then
      call add_resistance(bank, keys, .true., switch)
      bank%quadratic_switch = switch
    end if
    if (damps) call add_damping(bank, keys%values('vibration_damping'), keys%values('vibration_factor'), &
                                keys%values('mean_time', absent=1.0_wp), .true.)
    if (.not. bank%is_polynomial) call bank%prepare_law()
  end function new_loads

  !> A bank of dampers of vibrations without a load, each on one body.
  function new_vibration_dampers(names, body, damping, mean_time, is_steady) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: damping(:, :)     !! [N m s/rad], [lanes, dampers]
    real(wp), intent(in) :: mean_time         !! [s]
    logical, intent(in) :: is_steady          !! whether it is the machine of a steady state
    type(loads_t) :: bank

    call prepare_damping(bank, is_steady)
    bank%is_damper = .true.
    call bank%connect(role_load, size(damping, 1), names, rows_between(0 * body, body))
    call bank%add_parameter('viscous', 0.0_wp * damping, is_key=.false.)
    bank%is_polynomial = .not. bank%follows_mean
    bank%has_paper_law = .false.
    call add_damping(bank, damping, 0.0_wp * damping, mean_time + 0.0_wp * damping, .false.)
    if (.not. bank%is_polynomial) call bank%prepare_law()
  end function new_vibration_dampers

  !> The internal states of loads that damp vibrations, which are not in the machine of a steady state; before `connect`.
  subroutine prepare_damping(bank, is_steady)
    type(loads_t), intent(inout) :: bank
    logical, intent(in), optional :: is_steady

    bank%follows_mean = .true.
    if (present(is_steady)) bank%follows_mean = .not. is_steady
    if (.not. bank%follows_mean) return
    bank%states = 2
    allocate (bank%internal_names, source=[character(len=24) :: 'mean speed', 'mean acceleration'])
  end subroutine prepare_damping

  !> The damping of vibrations: in the law, or beside it in the machine of a steady state.
  subroutine add_damping(bank, damping, factor, mean_time, are_keys)
    type(loads_t), intent(inout) :: bank
    real(wp), intent(in) :: damping(:, :)     !! [N m s/rad], [lanes, elements]
    real(wp), intent(in) :: factor(:, :)      !! c over the torque over w, the same
    real(wp), intent(in) :: mean_time(:, :)   !! T [s], the same
    logical, intent(in) :: are_keys           !! whether these are values of keys

    if (bank%follows_mean) then
      call bank%add_parameter('vibration_damping', damping, are_keys)
      call bank%add_parameter('vibration_factor', factor, are_keys)
      call bank%add_parameter('mean_time', mean_time, are_keys)
    else
      bank%vibration_damping = damping(1, :)
      bank%vibration_factor = factor(1, :)
    end if
  end subroutine add_damping

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

    if (self%follows_mean) then
      call describe_damping(self, tape)
    else
      tape%applied = node_of(resistance(self, self%quadratic_switch, tape, speed_of(tape)))
    end if
  end subroutine describe

  !> The law of loads that damp vibrations, and their mean rotation.
  subroutine describe_damping(self, tape)
    class(loads_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    real(wp), parameter :: still = 1.0e-3_wp   ! the torque over w has no limit at w = 0 [rad/s]
    type(expression_t) :: damping, mean, moment, slip, time

    mean = state_of(tape, 1)
    slip = speed_of(tape) - mean
    time = self%parameter(tape, 'mean_time')
    moment = -(self%parameter(tape, 'viscous') * mean)
    if (self%has_resistance) moment = moment + resistance(self, self%quadratic_switch, tape, mean)
    damping = self%parameter(tape, 'vibration_damping')
    if (any(abs(self%parameters(self%number_of('vibration_factor'))%value) > 0)) then
      damping = damping - self%parameter(tape, 'vibration_factor') * (moment * mean) / (mean * mean + still * still)
    end if
    tape%applied = node_of(moment - damping * slip)
    tape%rate(1) = node_of(2.0_wp * slip / time + state_of(tape, 2))
    tape%rate(2) = node_of(slip / (time * time))
  end subroutine describe_damping

  !> The mean rotation begins with the speed.
  subroutine start_internal(self, speed, internal)
    class(loads_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)   !! u' [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)   !! [lanes, states, loads]
    integer :: e

    internal = 0.0_wp
    if (.not. self%follows_mean) return
    do e = 1, self%count
      associate (first => self%lanes * self%states * (e - 1))
        internal(first + 1:first + self%lanes) = speed(self%lanes * (e - 1) + 1:self%lanes * e)
      end associate
    end do
  end subroutine start_internal

  !> The moment that resists, without its viscous part: a formula of a bank with the parameters and switches of such loads.
  function resistance(bank, switch, tape, speed) result(moment)
    class(bank_t), intent(in) :: bank
    integer, intent(in) :: switch          !! of `quadratic` among the ones of an element; 0: there is no such term
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: speed   !! omega, or the mean rotation
    type(expression_t) :: moment, speed_scale

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
