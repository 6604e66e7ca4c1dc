!> Natural frequencies over the speed, and where the orders meet them, as an analysis: campbell.csv and campbell.json.
module nocdyn_campbell_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_campbell, only: analyse_campbell, campbell_t
  use nocdyn_column_lists, only: column_list_t
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_margins, only: add_coverage, add_critical, add_nearest, margin_text, mode_text, put_margin, put_mode, unknown_ratio
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units
  use nocdyn_report_openings, only: append_notes, open_analysis_report
  use nocdyn_table_text, only: cell, right
  use nocdyn_text, only: counted, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  use nocdyn_verdicts, only: verdict_t
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  public :: line_name

  type, extends(analysis_t), public :: campbell_results_t
    type(campbell_t), private :: campbell
    character(len=:), allocatable, private :: body   !! whose speed is held
  contains
    procedure :: solve, list_tables, put_table, judge, put_report, text => printed
  end type campbell_results_t

  integer, parameter :: most_modes = 20, most_crossings = 60   ! that are printed; all are in campbell.json

contains

  subroutine solve(self, input, machine, options, error)
    class(campbell_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error

    call analyse_campbell(input, machine, modes_choice_t(options%modes, options%has_range, options%range_hz), self%campbell, &
                          error)
    if (.not. allocated(error)) self%body = machine%names(self%campbell%settings%body)%text
  end subroutine solve

  subroutine list_tables(self, names)
    class(campbell_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    names = [string_t('campbell.csv')]
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(campbell_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file
    type(column_list_t) :: list
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: unit(:)
    real(wp), allocatable :: row(:)
    integer :: i, l, m

    ! writes campbell.csv: a row for every speed with natural frequencies, damping ratios and frequencies of the lines
    call list%start('campbell.csv', output_units(input))
    call list%add_named('omega', 'rad/s', 'speed that is held', 'body', self%body)
    do m = 1, self%campbell%modes%modes
      call list%add_named('frequency_' // to_text(self%campbell%modes%number(m)), 'Hz', 'damped natural frequency')
    end do
    do m = 1, self%campbell%modes%modes
      call list%add_named('damping_ratio_' // to_text(self%campbell%modes%number(m)), '1', 'damping ratio')
    end do
    do m = 1, self%campbell%modes%modes
      if (self%campbell%modes%internal(m) > 0) cycle
      call list%add_named('undamped_frequency_' // to_text(self%campbell%modes%number(m)), 'Hz', 'undamped natural frequency')
    end do
    do l = 1, size(self%campbell%order)
      call list%add_named(line_name(self%campbell, l), 'Hz', 'frequency of the line')
    end do
    call list%list_columns(labels, unit)
    allocate (row(size(labels)))
    call write_header(file, labels)
    do i = 1, size(self%campbell%speed)
      row(1) = self%campbell%speed(i)
      row(2:) = [from_si(self%campbell%modes%frequency(:, i), unit_hz), self%campbell%modes%damping_ratio(:, i), &
                 from_si(pack(self%campbell%modes%undamped(:, i), self%campbell%modes%internal == 0), unit_hz), &
                 from_si(self%campbell%frequency(:, i), unit_hz)]
      call write_row(file, from_si(row, unit))
    end do
  end subroutine put_table

  !> Critical speeds in operation or near it: a diagram does not know what responds there.
  subroutine judge(self, input)
    class(campbell_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer :: i

    associate (campbell => self%campbell)
      do i = 1, size(campbell%crossings)
        associate (crossing => campbell%crossings(i))
          if (campbell%modes%is_electrical(crossing%mode)) cycle
          call add_critical('campbell', campbell%settings, crossing, line_title(campbell, crossing%line), campbell%distance(i), &
                            unknown_ratio, '', self%verdict)
        end associate
      end do
      call add_nearest('campbell', campbell%settings, campbell%modes, campbell%crossings, self%verdict)
      call add_coverage('campbell', campbell%settings, campbell%unstable, self%verdict)
    end associate
  end subroutine judge

  subroutine put_report(self, input, json)
    class(campbell_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_campbell(json, input, self%body, self%campbell, self%verdict)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(campbell_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = campbell_text(input%shown_case(), self%body, self%campbell)
  end subroutine printed

  !> "order_2.5"; a line with a fixed frequency has its number.
  function line_name(self, line) result(name)
    type(campbell_t), intent(in) :: self
    integer, intent(in) :: line
    character(len=:), allocatable :: name

    name = 'line_' // to_text(line)
    if (self%is_order(line)) name = 'order_' // rounded_text(self%order(line), 8)
  end function line_name

  !> What tables and reports call a line.
  function line_word(self, line) result(word)
    type(campbell_t), intent(in) :: self
    integer, intent(in) :: line
    character(len=:), allocatable :: word

    if (self%is_order(line)) then
      word = rounded_text(self%order(line), 6)
    else
      word = self%response%lines(line)%word()
    end if
  end function line_word

  !> The same in a sentence.
  function line_title(self, line) result(title)
    type(campbell_t), intent(in) :: self
    integer, intent(in) :: line
    character(len=:), allocatable :: title

    title = line_word(self, line)
    if (self%is_order(line)) title = 'order ' // title
  end function line_title

  !> The members of campbell.json.
  subroutine put_campbell(json, input, body, self, verdict)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: body
    type(campbell_t), intent(in) :: self
    type(verdict_t), intent(in) :: verdict
    real(wp), allocatable :: unstable(:)
    integer :: i

    call open_analysis_report(json, input)
    call verdict%put(json)
    call json%put('notes', self%notes)
    if (size(self%unstable) > 0) then
      unstable = self%unstable%speed
      call json%put('unstable_speeds_rad_s', unstable)
    end if
    call json%put('body', body)
    call json%put('speed_rad_s', [self%speed(1), self%speed(size(self%speed))])
    if (size(self%settings%operating) > 0) then
      call json%put('operating_rad_s', self%settings%operating)
      call json%put('margin', self%settings%margin)
    end if
    associate (machine => self%response%machine)
      call json%put('bodies', machine%names(:machine%bodies - machine%nodes))
    end associate
    call json%open_list('lines')
    do i = 1, size(self%order)
      call json%open()
      call put_line(json, self, i)
      call json%close()
    end do
    call json%close_list()
    call json%put('modes_numbered_at_rad_s', self%modes%numbered_at)
    call json%open_list('modes')
    do i = 1, self%modes%modes
      ! frequencies at both ends of the range, and the shape at the lowest speed
      call json%open()
      call put_mode(json, self%response%machine, self%modes, i)
      associate (ends => [1, size(self%speed)])
        call json%put('frequency_Hz', from_si(self%modes%frequency(i, ends), unit_hz))
        if (self%modes%internal(i) == 0) then
          call json%put('undamped_frequency_Hz', from_si(self%modes%undamped(i, ends), unit_hz))
        end if
      end associate
      call json%put('shape', self%modes%shape(:size(self%modes%shape, 1) - self%response%machine%nodes, i))
      call json%close()
    end do
    call json%close_list()
    call json%open_list('crossings')
    do i = 1, size(self%crossings)
      associate (crossing => self%crossings(i))
        call json%open()
        call put_mode(json, self%response%machine, self%modes, crossing%mode)
        call put_line(json, self, crossing%line)
        call json%put('speed_rad_s', crossing%speed)
        call json%put('frequency_Hz', from_si(crossing%frequency, unit_hz))
        call json%put('damping_ratio', crossing%damping_ratio)
        call put_margin(json, self%settings, self%modes, crossing%mode, self%distance(i))
        call json%close()
      end associate
    end do
    call json%close_list()
    call json%close()
  end subroutine put_campbell

  !> The order of a line, or its number and name if its frequency does not grow with the speed.
  subroutine put_line(json, self, line)
    type(json_t), intent(inout) :: json
    type(campbell_t), intent(in) :: self
    integer, intent(in) :: line

    if (self%is_order(line)) then
      call json%put('order', self%order(line))
    else
      call json%put('line', line)
      call json%put('line_name', line_word(self, line))
    end if
  end subroutine put_line

  !> All tables.
  function campbell_text(file, body, self) result(text)
    character(len=*), intent(in) :: file, body
    type(campbell_t), intent(in) :: self
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    integer :: last, m

    call append_notes(report, file, self%notes)
    last = size(self%speed)
    call report%append_line(file // ': natural frequencies from ' // rpm(self%speed(1)) // ' to ' // rpm(self%speed(last)) // &
                            ' rpm of ' // body // ', ' // counted(size(self%order), 'order', 'orders'))
    call report%append_line('  mode' // cell(rpm(self%speed(1)) // ' rpm') // cell(rpm(self%speed(last)) // ' rpm') // &
                            cell('lowest [Hz]') // cell('highest [Hz]') // cell('damping ratio') // cell('highest') &
                            // cell('undamped [Hz]') // cell('highest'))
    do m = 1, min(self%modes%modes, most_modes)
      associate (natural => from_si(self%modes%frequency(m, :), unit_hz), exists => self%modes%exists(m, :))
        call report%append_line('  ' // right(to_text(self%modes%number(m)), 4) // cell(natural(1)) // &
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
        line = '  ' // right(to_text(crossing%number), 4)
        line = line // cell(line_word(self, crossing%line)) // cell(rpm(crossing%speed)) // &
               cell(from_si(crossing%frequency, unit_hz))
        line = line // margin_text(self%settings, self%modes, crossing%mode, self%distance(i)) // &
               mode_text(self%response%machine, self%modes, crossing%mode)
        call report%append_line(line)
      end associate
    end do
    if (size(self%crossings) > most_crossings) then
      call report%append_line('  (' // to_text(size(self%crossings) - most_crossings) // ' more in campbell.json)')
    end if
  end subroutine put_crossings

end module nocdyn_campbell_results
