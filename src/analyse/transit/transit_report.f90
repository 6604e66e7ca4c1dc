!> The results of passages: for transit.json, as transit.csv, and as printed.
module nocdyn_transit_report
  use nocdyn_column_names, only: with_unit
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_energy_balance, only: put_energy_balance
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units
  use nocdyn_report_openings, only: append_notes, open_analysis_report
  use nocdyn_response_limits, only: no_limit
  use nocdyn_table_text, only: cell, padded, text_width
  use nocdyn_text, only: append, counted, quoted, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_transit_analysis, only: passage_t, transit_analysis_t
  use nocdyn_transit_verdict, only: direction_word, range_text, sum_life, transit_life_t
  use nocdyn_units, only: from_si, unit_for, unit_rpm, units
  use nocdyn_verdicts, only: verdict_t
  implicit none (type, external)
  private

  public :: put_transit, put_transit_csv, transit_text

  integer, parameter :: digits = 4   ! of printed numbers

contains

  !> Fills transit.json.
  subroutine put_transit(json, input, analysis, verdict)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(verdict_t), intent(in) :: verdict
    integer :: k

    call open_analysis_report(json, input)
    call verdict%put(json)
    call json%put('body', analysis%body_name)
    call json%put('turns_of_mean', analysis%settings%turns)
    call json%put('mean_speeds_rad_s', analysis%settings%forwards * [analysis%lowest, analysis%highest])
    call json%open_list('ranges')
    do k = 1, size(analysis%settings%ranges)
      associate (range => analysis%settings%ranges(k))
        call json%open()
        call json%put('speeds_rad_s', analysis%settings%forwards * [range%low, range%high])
        if (range%order > 0) call json%put('order', range%order)
        call json%close()
      end associate
    end do
    call json%close_list()
    call json%open_list('passages')
    do k = 1, size(analysis%passages)
      call put_passage(json, analysis, analysis%passages(k))
    end do
    call json%close_list()
    call put_lives(json, input, analysis)
    if (allocated(analysis%energy_balance)) call put_energy_balance(json, analysis%energy_balance)
    call json%put('notes', analysis%notes)
    call json%close()
  end subroutine put_transit

  subroutine put_passage(json, analysis, passage)
    type(json_t), intent(inout) :: json
    type(transit_analysis_t), intent(in) :: analysis
    type(passage_t), intent(in) :: passage
    integer :: i, k

    call json%open()
    call json%put('range', passage%range)
    call json%put('direction', direction_word(passage%visit))
    call json%put('passes', passage%visit%passes())
    call json%put('enters', passage%visit%enters)
    call json%put('leaves', passage%visit%leaves)
    call json%put('time_in_range', passage%visit%duration())
    call json%put('turns', passage%turns)
    associate (order => analysis%settings%ranges(passage%range)%order)
      if (order > 0) call json%put('cycles_of_order', order * passage%turns)
    end associate
    call json%put('counted_from', passage%visit%begin)
    call json%put('counted_to', passage%visit%end)
    call json%open_list('peaks')
    do i = 1, size(passage%peaks)
      call put_peak(json, passage, i)
    end do
    call json%close_list()
    call json%open_list('fatigue')
    do i = 1, size(passage%fatigue%items)
      k = passage%fatigue%worst(i)
      call json%open()
      call json%put('name', passage%fatigue%items(i)%name)
      call json%put('cycles', passage%fatigue%counters(k)%cycles)
      call json%put('largest_range', passage%fatigue%counters(k)%largest_range)
      call json%put('unit', passage%fatigue%items(i)%unit)
      call json%put('damage', passage%fatigue%counters(k)%damage)
      call json%close()
    end do
    call json%close_list()
    call json%close()
  end subroutine put_passage

  subroutine put_peak(json, passage, number)
    type(json_t), intent(inout) :: json
    type(passage_t), intent(in) :: passage
    integer, intent(in) :: number

    associate (peak => passage%peaks(number))
      call json%open()
      call json%put('quantity', peak%signal%name)
      call json%put('unit', peak%signal%unit)
      call json%put('largest', peak%largest)
      call json%put('time', peak%largest_time)
      call json%put('speed_rad_s', peak%largest_speed)
      call json%put('half_range', peak%half_range)
      call json%put('half_range_time', peak%half_range_time)
      call json%put('half_range_speed_rad_s', peak%half_range_speed)
      if (peak%allowed < no_limit) call json%put('half_range_limit', peak%allowed)
      call json%close()
    end associate
  end subroutine put_peak

  subroutine put_lives(json, input, analysis)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(transit_life_t), allocatable :: lives(:)
    integer :: i

    call sum_life(input, analysis, lives)
    call json%open_list('fatigue')
    do i = 1, size(lives)
      call json%open()
      call json%put('name', lives(i)%item%name)
      call json%put('element', lives(i)%item%element)
      if (lives(i)%item%last > lives(i)%item%first) call json%put('position', lives(i)%position)
      call json%put('passages', lives(i)%repeats)
      call json%put('damage', lives(i)%damage)
      if (lives(i)%damage > 0) call json%put('passages_to_failure', lives(i)%repeats / lives(i)%damage)
      call json%put('mean_exceeds_strength', lives(i)%exceeds_strength)
      call json%close()
    end do
    call json%close_list()
  end subroutine put_lives

  !> Writes transit.csv: the rows of all passages.
  subroutine put_transit_csv(input, analysis, file)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(output_file_t), intent(inout) :: file
    character(len=:), allocatable :: unit
    type(string_t), allocatable :: labels(:)
    integer :: i, k, q, speed

    speed = unit_for('rad/s', output_units(input))
    unit = 'rad/s'
    if (speed > 0) unit = trim(units(speed)%name)
    labels = [string_t('passage'), string_t('t [s]')]
    call append(labels, with_unit('mean_' // analysis%names(2)%text, unit))
    call append(labels, with_unit(analysis%names(2)%text, unit))
    do i = 3, size(analysis%names)
      do q = 1, size(analysis%quantities)
        if (analysis%quantities(q)%name == analysis%names(i)%text) exit
      end do
      call append(labels, with_unit(analysis%names(i)%text, analysis%quantities(q)%unit))
    end do
    call write_header(file, labels)
    do k = 1, size(analysis%passages)
      associate (rows => analysis%passages(k)%rows)
        do i = 1, size(rows, 2)
          call write_row(file, [real(k, wp), rows(1, i), from_si(rows(2:3, i), speed), rows(4:, i)])
        end do
      end associate
    end do
  end subroutine put_transit_csv

  !> The printed tables.
  function transit_text(input, analysis) result(text)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    integer :: i

    call append_notes(report, input%shown_case(), analysis%notes)
    text = input%shown_case() // ': ' // counted(size(analysis%passages), 'passage', 'passages') // ' of '
    do i = 1, size(analysis%settings%ranges)
      if (i > 1) text = text // ', '
      text = text // range_text(analysis%settings%ranges(i))
    end do
    if (size(analysis%settings%ranges) == 0) text = text // 'no range'
    call report%append_line(text // ', mean speed of ' // analysis%body_name // ' over ' // &
                            counted(analysis%settings%turns, 'turn', 'turns'))
    if (size(analysis%passages) > 0) then
      call append_passages(analysis, report)
      call append_peaks(analysis, report)
      call append_lives(input, analysis, report)
    end if
    text = report%text()
  end function transit_text

  subroutine append_passages(analysis, report)
    type(transit_analysis_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line
    integer :: k

    call report%append_line('  passage' // cell('enters at [s]') // cell('in range [s]') // cell('turns') // cell('order') // &
                            cell('its cycles') // '  range, direction')
    do k = 1, size(analysis%passages)
      associate (passage => analysis%passages(k), range => analysis%settings%ranges(analysis%passages(k)%range))
        line = '  ' // padded(to_text(k), len('passage')) // cell(rounded_text(passage%visit%enters, digits)) // &
               cell(rounded_text(passage%visit%duration(), digits)) // cell(rounded_text(passage%turns, digits))
        if (range%order > 0) then
          line = line // cell(rounded_text(range%order, digits)) // cell(rounded_text(range%order * passage%turns, digits))
        else
          line = line // cell('') // cell('')
        end if
        call report%append_line(line // '  ' // range_text(range) // ', ' // direction_word(passage%visit))
      end associate
    end do
  end subroutine append_passages

  subroutine append_peaks(analysis, report)
    type(transit_analysis_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    integer :: i, k, width

    if (size(analysis%limits) == 0) return
    associate (peaks => analysis%passages(1)%peaks)
      width = maxval([(text_width(with_unit(peaks(i)%signal%name, peaks(i)%signal%unit)), i=1, size(peaks))])
    end associate
    call report%append_line('  passage  ' // padded('', width) // cell('largest') // cell('at t [s]') // cell('at [rpm]') // &
                            cell('half range') // cell('at [rpm]'))
    do k = 1, size(analysis%passages)
      do i = 1, size(analysis%passages(k)%peaks)
        associate (peak => analysis%passages(k)%peaks(i))
          call report%append_line('  ' // padded(to_text(k), len('passage')) // '  ' // &
                                  padded(with_unit(peak%signal%name, peak%signal%unit), width) // cell(peak%largest) // &
                                  cell(rounded_text(peak%largest_time, digits)) // rpm(peak%largest_speed) // &
                                  cell(peak%half_range) // rpm(peak%half_range_speed))
        end associate
      end do
    end do
  end subroutine append_peaks

  function rpm(speed) result(text)
    real(wp), intent(in) :: speed   !! [rad/s]
    character(len=:), allocatable :: text

    text = cell(rounded_text(from_si(speed, unit_rpm), digits))
  end function rpm

  subroutine append_lives(input, analysis, report)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    type(transit_life_t), allocatable :: lives(:)
    character(len=:), allocatable :: line
    integer :: i, k

    call sum_life(input, analysis, lives)
    do i = 1, size(lives)
      line = 'fatigue ' // quoted(lives(i)%item%name) // ':'
      do k = 1, size(analysis%passages)
        associate (fatigue => analysis%passages(k)%fatigue)
          associate (counter => fatigue%counters(fatigue%worst(i)))
            line = line // ' passage ' // to_text(k) // ' ' // rounded_text(counter%cycles, digits) // ' cycles, damage ' // &
                   rounded_text(counter%damage, digits) // ';'
          end associate
        end associate
      end do
      line = line // ' ' // rounded_text(lives(i)%repeats, digits) // ' times all of them: damage ' // &
             rounded_text(lives(i)%damage, digits)
      if (lives(i)%damage > 0) line = line // ', the life is ' // rounded_text(lives(i)%repeats / lives(i)%damage, digits) // &
                                      ' times'
      call report%append_line(line)
    end do
  end subroutine append_lives

end module nocdyn_transit_report
