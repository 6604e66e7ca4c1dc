!> Prescribed motions of bodies, u = g(t) + constant with g = 0 at the start. Their moments are reactions.
!>
!> Of a speed, u' = speed + table(t) + amplitude sin(frequency t + phase); of an angle, u = table(t) + amplitude
!> sin(frequency t + phase) + constant, with a table whose slope is continuous. The boundaries of the branches are the points of
!> the tables.
module nocdyn_drives
  use nocdyn_bank, only: role_drive
  use nocdyn_curves, only: curve_t
  use nocdyn_described_rows, only: described_rows_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), operator(/)
  use nocdyn_law_functions, only: cos, sin
  use nocdyn_law_operators, only: operator(*)
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_tables, only: add_table, curve_integral, curve_value, guard_segment
  implicit none (type, external)
  private

  public :: new_drives

  type, extends(described_rows_t), public :: drives_t
    logical :: prescribe_angles = .false.
    real(wp) :: t_start = 0.0_wp   !! [s]
  contains
    procedure :: describe
    procedure :: fastest_wave
  end type drives_t

contains

  !> A bank of drives, each of one body.
  function new_drives(keys, prescribe_angles, table) result(bank)
    class(element_keys_t), intent(in) :: keys
    logical, intent(in) :: prescribe_angles
    type(curve_t), intent(in), optional :: table(:, :)   !! [rad/s] or [rad] over [s], [lanes, drives]
    type(drives_t) :: bank

    bank%is_driven_by_time = .true.
    bank%prescribe_angles = prescribe_angles
    bank%t_start = keys%t_start
    call bank%connect_rows_only(role_drive, keys%lanes, keys%names, keys%bodies('body', 1))
    call bank%add_parameter('speed', keys%values('speed'), is_key=.false.)
    call bank%add_parameter('amplitude', keys%values(merge('angle_amplitude', 'speed_amplitude', prescribe_angles)), .false.)
    call bank%add_parameter('frequency', keys%values('frequency', absent=1.0_wp), is_key=.false.)
    call bank%add_parameter('phase', keys%values('phase'), is_key=.false.)
    if (present(table)) then
      bank%is_polynomial = .false.
      call add_table(bank, table)
      call bank%add_parameter('table_start', starts_of(table, bank%t_start, prescribe_angles), is_key=.false.)
    end if
    call bank%prepare_rows()
  end function new_drives

  !> The part of g of a table at the start [rad].
  elemental real(wp) function starts_of(table, t_start, prescribe_angles) result(start)
    type(curve_t), intent(in) :: table
    real(wp), intent(in) :: t_start   !! [s]
    logical, intent(in) :: prescribe_angles

    if (prescribe_angles) then
      start = table%value(t_start)
    else
      start = table%integral_to(table%segment(t_start), t_start) - table%integral_to(table%segment(0.0_wp), 0.0_wp)
    end if
  end function starts_of

  !> g, no moment but the reaction, and the points of the tables.
  subroutine describe(self, tape)
    class(drives_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: amplitude, frequency, g, phase, start, t, x

    amplitude = self%parameter(tape, 'amplitude')
    frequency = self%parameter(tape, 'frequency')
    phase = self%parameter(tape, 'phase')
    t = self%driver(tape)
    x = frequency * t + phase
    start = frequency * self%t_start + phase
    if (self%prescribe_angles) then
      g = amplitude * sin(x) - amplitude * sin(start)
    else
      g = (amplitude / frequency) * (cos(start) - cos(x)) + self%parameter(tape, 'speed') * (t - self%t_start)
    end if
    if (allocated(self%curve)) then
      if (self%prescribe_angles) then
        g = g + curve_value(tape, t) - self%parameter(tape, 'table_start')
      else
        g = g + curve_integral(tape, t) - self%parameter(tape, 'table_start')
      end if
      tape%applied = node_of(literal(tape, 0.0_wp))
      call guard_segment(tape, t, is_time=.true.)
    end if
    tape%row = [node_of(g)]
  end subroutine describe

  !> The one of the sines.
  pure real(wp) function fastest_wave(self, lane)
    class(drives_t), intent(in) :: self
    integer, intent(in) :: lane

    fastest_wave = maxval(self%parameters(3)%value(lane, :), mask=abs(self%parameters(2)%value(lane, :)) > 0)
    fastest_wave = max(fastest_wave, 0.0_wp)
  end function fastest_wave

end module nocdyn_drives
