!> The files of Campbell's diagram: campbell.csv and campbell.json.
module nocdyn_campbell_files
  use nocdyn_campbell, only: campbell_t
  use nocdyn_column_lists, only: column_list_t
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_margins, only: put_margin, put_mode
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: rounded_text, string_t, to_text
  use nocdyn_units, only: from_si, unit_hz
  implicit none (type, external)
  private

  public :: put_campbell_csv, put_campbell

contains

  !> Writes campbell.csv: a row for every speed with natural frequencies, damping ratios and frequencies of the lines.
  subroutine put_campbell_csv(self, body, wanted, file)
    type(campbell_t), intent(in) :: self
    character(len=*), intent(in) :: body   !! whose speed is held
    integer, intent(in) :: wanted(:)       !! units of speeds: indices of `units`
    type(output_file_t), intent(inout) :: file
    type(column_list_t) :: list
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: unit(:)
    real(wp), allocatable :: row(:)
    integer :: i, l, m

    call list%start('campbell.csv', wanted)
    call list%add_named('omega', 'rad/s', 'speed that is held', 'body', body)
    do m = 1, self%modes%modes
      call list%add_named('frequency_' // to_text(m), 'Hz', 'damped natural frequency')
    end do
    do m = 1, self%modes%modes
      call list%add_named('damping_ratio_' // to_text(m), '1', 'damping ratio')
    end do
    do m = 1, self%modes%modes
      if (self%modes%internal(m) > 0) cycle
      call list%add_named('undamped_frequency_' // to_text(m), 'Hz', 'undamped natural frequency')
    end do
    do l = 1, size(self%order)
      call list%add_named(line_name(self, l), 'Hz', 'frequency of the line')
    end do
    call list%list_columns(labels, unit)
    allocate (row(size(labels)))
    call write_header(file, labels)
    do i = 1, size(self%speed)
      row(1) = self%speed(i)
      row(2:) = [from_si(self%modes%frequency(:, i), unit_hz), self%modes%damping_ratio(:, i), &
                 from_si(pack(self%modes%undamped(:, i), self%modes%internal == 0), unit_hz), &
                 from_si(self%frequency(:, i), unit_hz)]
      call write_row(file, from_si(row, unit))
    end do
  end subroutine put_campbell_csv

  !> "order_2.5"; a line with a fixed frequency has its number.
  function line_name(self, line) result(name)
    type(campbell_t), intent(in) :: self
    integer, intent(in) :: line
    character(len=:), allocatable :: name

    name = 'line_' // to_text(line)
    if (self%is_order(line)) name = 'order_' // rounded_text(self%order(line), 8)
  end function line_name

  !> The members of campbell.json.
  subroutine put_campbell(json, input, body, self)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: body
    type(campbell_t), intent(in) :: self
    real(wp), allocatable :: unstable(:)
    integer :: i

    call json%open_report(input%file, input%title())
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
        if (self%is_order(crossing%line)) then
          call json%put('order', self%order(crossing%line))
        else
          call json%put('line', crossing%line)
        end if
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

end module nocdyn_campbell_files
