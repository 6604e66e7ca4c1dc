!> The printed report of Campbell's diagram: modes and critical speeds.
module nocdyn_campbell_report
  use nocdyn_campbell, only: campbell_t
  use nocdyn_kinds, only: wp
  use nocdyn_margins, only: margin_text, mode_text
  use nocdyn_table_text, only: cell
  use nocdyn_text, only: counted, rounded_text, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  implicit none (type, external)
  private

  public :: campbell_text

  integer, parameter :: most_modes = 20, most_crossings = 60   ! that are printed; all are in campbell.json

contains

  !> All tables.
  function campbell_text(file, body, self) result(text)
    character(len=*), intent(in) :: file, body
    type(campbell_t), intent(in) :: self
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    integer :: i, last, m

    do i = 1, size(self%notes)
      call report%append_line(file // ': note: ' // self%notes(i)%text)
    end do
    last = size(self%speed)
    call report%append_line(file // ': natural frequencies from ' // rpm(self%speed(1)) // ' to ' // rpm(self%speed(last)) // &
                            ' rpm of ' // body // ', ' // counted(size(self%order), 'order', 'orders'))
    call report%append_line('  mode' // cell(rpm(self%speed(1)) // ' rpm') // cell(rpm(self%speed(last)) // ' rpm') // &
                            cell('lowest [Hz]') // cell('highest [Hz]') // cell('damping ratio') // cell('highest') &
                            // cell('undamped [Hz]') // cell('highest'))
    do m = 1, min(self%modes%modes, most_modes)
      associate (natural => from_si(self%modes%frequency(m, :), unit_hz), exists => self%modes%exists(m, :))
        call report%append_line('  ' // repeat(' ', 4 - len(to_text(m))) // to_text(m) // cell(natural(1)) // &
                                cell(natural(last)) // cell(minval(natural, mask=exists)) // cell(maxval(natural)) // &
                                cell(rounded_text(minval(self%modes%damping_ratio(m, :), mask=exists), 3)) // &
                                cell(rounded_text(maxval(self%modes%damping_ratio(m, :), mask=exists), 3)) // &
                                undamped_cells(self, m) // &
                                mode_text(self%response%machine, self%modes, m))
      end associate
    end do
    if (self%modes%modes > most_modes) then
      call report%append_line('  (' // to_text(self%modes%modes - most_modes) // ' more in campbell.csv)')
    end if
    call put_crossings(self, report)
    text = report%text()
  end function campbell_text

  !> The lowest and highest undamped frequency of a mode; empty for one that is mostly an internal state.
  function undamped_cells(self, mode) result(text)
    type(campbell_t), intent(in) :: self
    integer, intent(in) :: mode
    character(len=:), allocatable :: text

    text = cell('') // cell('')
    if (self%modes%internal(mode) > 0) return
    associate (undamped => from_si(self%modes%undamped(mode, :), unit_hz), exists => self%modes%exists(mode, :))
      text = cell(minval(undamped, mask=exists)) // cell(maxval(undamped, mask=exists))
    end associate
  end function undamped_cells

  function rpm(speed) result(text)
    real(wp), intent(in) :: speed   !! [rad/s]
    character(len=:), allocatable :: text

    text = rounded_text(from_si(speed, unit_rpm), 6)
  end function rpm

  subroutine put_crossings(self, report)
    type(campbell_t), intent(in) :: self
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line
    integer :: i

    if (size(self%crossings) == 0) then
      call report%append_line('  no order meets a natural frequency in this range')
      return
    end if
    line = '  mode' // cell('order') // cell('critical [rpm]') // cell('frequency [Hz]')
    if (size(self%settings%operating) > 0) line = line // '  distance to operation'
    call report%append_line(line)
    do i = 1, min(size(self%crossings), most_crossings)
      associate (crossing => self%crossings(i))
        line = '  ' // repeat(' ', 4 - len(to_text(crossing%mode))) // to_text(crossing%mode)
        if (self%is_order(crossing%line)) then
          line = line // cell(rounded_text(self%order(crossing%line), 6))
        else
          line = line // cell(self%response%lines(crossing%line)%word())
        end if
        line = line // cell(rpm(crossing%speed)) // cell(from_si(crossing%frequency, unit_hz))
        line = line // margin_text(self%settings, self%modes, crossing%mode, self%distance(i)) // &
               mode_text(self%response%machine, self%modes, crossing%mode)
        call report%append_line(line)
      end associate
    end do
    if (size(self%crossings) > most_crossings) then
      call report%append_line('  (' // to_text(size(self%crossings) - most_crossings) // ' more in campbell.json)')
    end if
  end subroutine put_crossings

end module nocdyn_campbell_report
