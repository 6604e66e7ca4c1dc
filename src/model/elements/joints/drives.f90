!> Prescribed motions of bodies, u = g(t) + constant with g = 0 at the start. Their moments are reactions.
!>
!> Of a speed, u' = speed + table(t) + amplitude sin(frequency t + phase); of an angle, u = table(t) + amplitude
!> sin(frequency t + phase) + constant, with a table whose slope is continuous. The boundaries of the branches are the points of
!> the tables.
module nocdyn_drives
  use nocdyn_bank, only: role_drive
  use nocdyn_curves, only: curve_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: literal, node_of, time_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_moving_rows, only: moving_rows_t
  use nocdyn_tables, only: add_table, guard_segment
  implicit none (type, external)
  private

  public :: new_drives

  type, extends(moving_rows_t), public :: drives_t
    logical :: prescribe_angles = .false.
    real(wp) :: t_start = 0.0_wp   !! [s]
  contains
    procedure :: describe
    procedure :: motion
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
    if (.not. present(table)) return
    bank%is_polynomial = .false.
    call add_table(bank, table)
    call bank%prepare_law()
  end function new_drives

  !> No moment but the reaction; the points of the tables.
  subroutine describe(self, tape)
    class(drives_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    if (.not. allocated(self%curve)) error stop 'nocdyn_drives: there are no tables'
    tape%applied = node_of(literal(tape, 0.0_wp))
    call guard_segment(tape, time_of(tape), is_time=.true.)
  end subroutine describe

  pure subroutine motion(self, element, segment, v, g)
    class(drives_t), intent(in) :: self
    integer, intent(in) :: element, segment
    real(wp), intent(in) :: v          !! time [s]
    real(wp), intent(out) :: g(0:3)    !! [rad]
    real(wp) :: sine(0:3), table(0:3)

    associate (amplitude => self%parameters(2)%value(1, element), frequency => self%parameters(3)%value(1, element), &
               x => self%parameters(3)%value(1, element) * v + self%parameters(4)%value(1, element), &
               start => self%parameters(3)%value(1, element) * self%t_start + self%parameters(4)%value(1, element))
      table = 0.0_wp
      if (self%prescribe_angles) then
        sine = amplitude * [sin(x) - sin(start), frequency * cos(x), -frequency**2 * sin(x), -frequency**3 * cos(x)]
      else
        sine = amplitude * [(cos(start) - cos(x)) / frequency, sin(x), frequency * cos(x), -frequency**2 * sin(x)]
        sine(:1) = sine(:1) + self%parameters(1)%value(1, element) * [v - self%t_start, 1.0_wp]
      end if
    end associate
    if (allocated(self%curve)) table = table_motion(self, element, segment, v)
    g = sine + table
  end subroutine motion

  !> The part of a table.
  pure function table_motion(self, element, segment, t) result(g)
    class(drives_t), intent(in) :: self
    integer, intent(in) :: element, segment
    real(wp), intent(in) :: t   !! [s]
    real(wp) :: g(0:3)

    associate (curve => self%curve(1, element), t_start => self%t_start)
      g = curve%derivatives(segment, t)
      if (self%prescribe_angles) then
        g(0) = g(0) - curve%value(t_start)
      else
        g = [curve%integral_to(segment, t) - curve%integral_to(curve%segment(t_start), t_start), g(:2)]
      end if
    end associate
  end function table_motion

  !> The one of the sines.
  pure real(wp) function fastest_wave(self, lane)
    class(drives_t), intent(in) :: self
    integer, intent(in) :: lane

    fastest_wave = maxval(self%parameters(3)%value(lane, :), mask=abs(self%parameters(2)%value(lane, :)) > 0)
    fastest_wave = max(fastest_wave, 0.0_wp)
  end function fastest_wave

end module nocdyn_drives
