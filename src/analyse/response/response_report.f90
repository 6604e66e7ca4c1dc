!> The printed report of a forced response: critical speeds, the largest synthesis of every coupling, barred ranges.
module nocdyn_response_report
  use nocdyn_column_names, only: with_unit
  use nocdyn_comparisons, only: write_comparisons
  use nocdyn_kinds, only: wp
  use nocdyn_margins, only: margin_text, mode_text
  use nocdyn_report_openings, only: append_notes
  use nocdyn_response_analysis, only: response_analysis_t
  use nocdyn_response_points, only: response_point_t
  use nocdyn_response_summary, only: critical_t, response_summary_t
  use nocdyn_table_text, only: cell, padded, right, text_width
  use nocdyn_text, only: counted, quoted, rounded_text, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: response_text

  integer, parameter :: most_criticals = 40, most_quantities = 60   ! that are printed; all are in response.json
  integer, parameter :: most_orders = 3                             ! of a half range that are named
  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp), mega = 1.0e6_wp

contains

  !> All tables.
  function response_text(file, analysis, summary) result(text)
    character(len=*), intent(in) :: file
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    character(len=:), allocatable :: range
    type(text_buffer_t) :: report

    call append_notes(report, file, analysis%notes)
    associate (speeds => analysis%settings%speeds)
      range = 'at ' // shown(analysis, speeds(1))
      if (size(speeds) > 1) range = 'from ' // shown(analysis, speeds(1)) // ' to ' // shown(analysis, speeds(size(speeds)))
      range = file // ': forced response ' // range // ' ' // analysis%settings%axis%unit() // ' of '
      if (analysis%settings%axis%is_frequency) then
        call report%append_line(range // 'excitation ' // analysis%settings%shaker_name)
      else
        call report%append_line(range // analysis%body_name // ', ' // &
                                counted(size(analysis%response%lines), 'order', 'orders'))
      end if
    end associate
    call put_criticals(analysis, summary, report)
    call put_largest(analysis, summary, report)
    call put_fatigue(analysis, report)
    if (allocated(analysis%comparisons)) call write_comparisons(analysis%comparisons, report)
    text = report%text()
  end function response_text

  !> A speed in rpm, or a frequency in Hz.
  function shown(analysis, point) result(text)
    type(response_analysis_t), intent(in) :: analysis
    real(wp), intent(in) :: point   !! [rad/s]
    character(len=:), allocatable :: text

    text = rounded_text(analysis%settings%axis%shown(point), 6)
  end function shown

  !> The heading of such a column.
  pure function at_heading(analysis) result(text)
    type(response_analysis_t), intent(in) :: analysis
    character(len=:), allocatable :: text

    text = 'at [' // analysis%settings%axis%unit() // ']'
  end function at_heading

  !> Mode by order.
  subroutine put_criticals(analysis, summary, report)
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line
    integer :: i, order_width, width
    logical :: has_ratio, has_stress

    if (size(summary%criticals) == 0) then
      if (analysis%settings%axis%is_frequency) call report%append_line('  no natural frequency is in this range')
      if (.not. analysis%settings%axis%is_frequency) then
        call report%append_line('  no order meets a natural frequency in this range')
      end if
      return
    end if
    width = maxval([8, (text_width(coupling_name(analysis, summary%criticals(i))), i=1, size(summary%criticals))])
    order_width = 2 + maxval([6, (len(order_word(analysis, summary%criticals(i))), i=1, size(summary%criticals))])
    has_ratio = any(summary%criticals%ratio > 0)
    has_stress = any(summary%criticals%stress > 0)
    line = '  mode  frequency [Hz]' // right('order', order_width) // '  critical [rpm]  damping ratio  '
    if (analysis%settings%axis%is_frequency) line = '  mode  resonance [Hz]  damping ratio  '
    line = line // padded('coupling', width) // cell('moment [N m]') // cell(at_heading(analysis))
    if (has_stress) line = line // cell('stress [MPa]')
    if (has_ratio) line = line // cell('of limit')
    if (size(analysis%settings%operating) > 0) line = line // '  distance to operation'
    call report%append_line(line)
    do i = 1, min(size(summary%criticals), most_criticals)
      call put_critical(analysis, summary%criticals(i), order_width, width, has_stress, has_ratio, report)
    end do
    if (size(summary%criticals) > most_criticals) then
      call report%append_line('  (' // to_text(size(summary%criticals) - most_criticals) // ' more in response.json)')
    end if
  end subroutine put_criticals

  function coupling_name(analysis, critical) result(name)
    type(response_analysis_t), intent(in) :: analysis
    type(critical_t), intent(in) :: critical
    character(len=:), allocatable :: name

    name = ''
    if (critical%quantity > 0) name = analysis%response%quantities(critical%quantity)%element
  end function coupling_name

  !> "0.5", "fixed", "twice-slip".
  function order_word(analysis, critical) result(word)
    type(response_analysis_t), intent(in) :: analysis
    type(critical_t), intent(in) :: critical
    character(len=:), allocatable :: word

    word = analysis%response%lines(critical%crossing%line)%word()
  end function order_word

  subroutine put_critical(analysis, critical, order_width, width, has_stress, has_ratio, report)
    type(response_analysis_t), intent(in) :: analysis
    type(critical_t), intent(in) :: critical
    integer, intent(in) :: order_width, width   !! of the orders, of the names
    logical, intent(in) :: has_stress, has_ratio
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: at_order, line, stress

    at_order = ''
    if (.not. analysis%settings%axis%is_frequency) at_order = right(order_word(analysis, critical), order_width) // &
                                                              right(shown(analysis, critical%crossing%speed), 16)
    line = right(to_text(critical%crossing%number), 6) // right(rounded_text(critical%crossing%frequency / turn, 7), 16) // &
           at_order // right(rounded_text(critical%crossing%damping_ratio, 3), 15) // &
           '  ' // padded(coupling_name(analysis, critical), width)
    if (critical%quantity == 0) then
      call report%append_line(line)
      return
    end if
    if (critical%is_unbounded) then
      line = line // cell('unbounded') // cell('')
    else
      line = line // cell(amplitude_text(analysis, critical)) // cell(shown(analysis, critical%speed))
    end if
    stress = ''
    if (critical%stress > 0) stress = rounded_text(critical%stress / mega, 4)
    if (has_stress) line = line // cell(stress)
    if (has_ratio) line = line // cell(ratio_text(critical%ratio))
    associate (modes => analysis%modes, mode => critical%crossing%mode)
      line = line // margin_text(analysis%settings, modes, mode, critical%margin) // &
             mode_text(analysis%response%machine, modes, mode)
    end associate
    call report%append_line(trim(line))
  end subroutine put_critical

  !> The amplitude, with its unit if that is not N m: the force of a mesh.
  function amplitude_text(analysis, critical) result(text)
    type(response_analysis_t), intent(in) :: analysis
    type(critical_t), intent(in) :: critical
    character(len=:), allocatable :: text

    text = rounded_text(critical%amplitude, 5)
    associate (unit => analysis%response%quantities(critical%quantity)%unit)
      if (unit /= 'N m') text = text // ' ' // unit
    end associate
  end function amplitude_text

  function ratio_text(ratio) result(text)
    real(wp), intent(in) :: ratio
    character(len=:), allocatable :: text

    text = ''
    if (ratio > 0) text = rounded_text(100.0_wp * ratio, 3) // ' %'
  end function ratio_text

  !> Per quantity the largest half range with its speed and orders.
  subroutine put_largest(analysis, summary, report)
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line
    integer :: q, shown, width

    associate (quantities => analysis%response%quantities)
      shown = min(size(analysis%shown), most_quantities)
      if (shown == 0) return
      width = maxval([(text_width(with_unit(quantities(analysis%shown(q))%name, quantities(analysis%shown(q))%unit)), &
                       q=1, shown)])
      line = '  ' // padded('largest', width) // cell('half range') // cell(at_heading(analysis)) // cell('peak') // &
             cell(at_heading(analysis))
      if (any(summary%largest%ratio > 0)) line = line // cell('of limit') // cell(at_heading(analysis))
      if (.not. analysis%settings%axis%is_frequency) line = line // '  orders in the half range'
      call report%append_line(line)
      do q = 1, shown
        call put_largest_of(analysis, summary, analysis%shown(q), width, report)
      end do
      if (shown < size(analysis%shown)) then
        call report%append_line('  (' // to_text(size(analysis%shown) - shown) // ' more in response.json)')
      end if
    end associate
  end subroutine put_largest

  subroutine put_largest_of(analysis, summary, q, width, report)
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    integer, intent(in) :: q       !! quantity
    integer, intent(in) :: width   !! of the labels
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line

    associate (largest => summary%largest(q), points => analysis%response%points, one => analysis%response%quantities(q))
      line = '  ' // padded(with_unit(one%name, one%unit), width) // &
             cell(rounded_text(largest%half_range, 5)) // cell(shown(analysis, points(largest%half_point)%state%speed)) // &
             cell(rounded_text(largest%peak, 5)) // cell(shown(analysis, points(largest%peak_point)%state%speed))
      if (largest%ratio_point > 0) then
        line = line // cell(ratio_text(largest%ratio)) // cell(shown(analysis, points(largest%ratio_point)%state%speed))
      else if (any(summary%largest%ratio > 0)) then
        line = line // cell('') // cell('')
      end if
      if (.not. analysis%settings%axis%is_frequency) line = line // '  ' // orders_text(analysis, points(largest%half_point), q)
      call report%append_line(line)
    end associate
  end subroutine put_largest_of

  !> The orders with the largest amplitudes at a speed: "3 (420), 4.5 (96)".
  function orders_text(analysis, point, quantity) result(text)
    type(response_analysis_t), intent(in) :: analysis
    type(response_point_t), intent(in) :: point
    integer, intent(in) :: quantity
    character(len=:), allocatable :: text
    real(wp), parameter :: smallest = 0.02_wp   ! of the largest amplitude
    real(wp) :: left(size(point%frequency))
    integer :: k, l

    left = abs(point%quantity(:, quantity))
    text = ''
    do k = 1, min(most_orders, size(left))
      l = maxloc(left, dim=1)
      if (left(l) <= smallest * maxval(abs(point%quantity(:, quantity)))) exit
      if (k > 1) text = text // ', '
      associate (line => analysis%response%lines(l))
        if (line%is_order .or. line%is_fixed) then
          text = text // rounded_text(point%frequency(l) / abs(point%state%speed), 5)
        else
          text = text // line%word()
        end if
      end associate
      text = text // ' (' // rounded_text(left(l), 4) // ')'
      left(l) = -1.0_wp
    end do
  end function orders_text

  !> The damage by &fatigue.
  subroutine put_fatigue(analysis, report)
    type(response_analysis_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line
    integer :: i

    do i = 1, size(analysis%fatigue)
      associate (item => analysis%fatigue(i), points => analysis%response%points)
        line = '  fatigue ' // quoted(item%name) // ': '
        if (item%rate(item%largest) > 0) then
          line = line // 'damage per hour up to ' // rounded_text(item%rate(item%largest), 4) // ' at ' // &
                 shown(analysis, points(item%largest)%state%speed) // ' ' // analysis%settings%axis%unit()
        else
          line = line // 'no damage at any ' // analysis%settings%axis%noun()
        end if
        if (size(item%hours) > 0) then
          line = line // '; damage of the profile of ' // rounded_text(sum(item%hours), 6) // ' h: ' // &
                 rounded_text(item%damage(), 4)
          if (item%damage() > 0) line = line // ', the life is ' // rounded_text(sum(item%hours) / item%damage(), 4) // ' h'
        end if
        if (item%exceeds_strength) line = line // '; the mean exceeds the strength'
        call report%append_line(line)
      end associate
    end do
  end subroutine put_fatigue

end module nocdyn_response_report
