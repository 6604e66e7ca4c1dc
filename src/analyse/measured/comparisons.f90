!> A measurement beside what was computed: differences, their statistics, and how they are printed and written.
module nocdyn_comparisons
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_measurements, only: measured_frequency, measured_kinds, measured_order, measured_peak, measured_series, &
    measurement_t, peak_names
  use nocdyn_output_file, only: output_file_t
  use nocdyn_table_text, only: cell_digits
  use nocdyn_text, only: append, counted, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si, unit_hz
  implicit none (type, external)
  private

  public :: append_comparison_files, comparison_file, left_out, new_comparison, of_damping, put_comparison_table, &
    put_comparisons, put_measurement, shown_comparison, write_comparisons

  character(len=*), parameter, public :: measured_files = 'measured_', fit_files = 'fit_'   !! names begin with

  !> What was measured and computed at the same abscissae; differences are computed less measured.
  type, public :: comparison_t
    type(measurement_t) :: measurement
    real(wp), allocatable :: abscissa(:)   !! times of the run [s], speeds [rad/s], or numbers of modes
    real(wp), allocatable :: measured(:), computed(:)   !! in SI
    real(wp), allocatable :: measured_damping(:), computed_damping(:)   !! of frequencies, if dampings were measured
    integer :: outside = 0                 !! values that were measured where nothing was computed
    real(wp) :: delay = 0.0_wp             !! added to the times of the recorder [s]
    real(wp) :: clock_correlation = 0.0_wp !! by which a delay was found
    real(wp) :: bias = 0.0_wp              !! mean of the differences
    real(wp) :: spread = 0.0_wp            !! their standard deviation about it, with one less than their number
    real(wp) :: correlation = 0.0_wp       !! of measured and computed values
    logical :: has_correlation = .false.   !! whether both vary
    real(wp) :: largest = 0.0_wp, largest_at = 0.0_wp   !! difference that is largest in size, and its abscissa
  contains
    procedure :: residuals
  end type comparison_t

contains

  !> Weighted differences for a fit: computed less measured, over the standard deviation if that is known. Frequencies are
  !> compared relatively; damping ratios follow them.
  pure function residuals(self)
    class(comparison_t), intent(in) :: self
    real(wp), allocatable :: residuals(:)
    integer :: dampings, n

    n = size(self%measured)
    dampings = 0
    if (allocated(self%measured_damping)) dampings = size(self%measured_damping)
    allocate (residuals(n + dampings))
    residuals(:n) = (self%computed - self%measured) * self%measurement%weight()
    if (self%measurement%kind == measured_frequency) residuals(:n) = residuals(:n) / self%measured
    if (dampings == 0) return
    residuals(n + 1:) = (self%computed_damping - self%measured_damping) * self%measurement%damping_weight()
  end function residuals

  !> A comparison as it is printed: frequencies in Hz.
  pure type(comparison_t) function shown_comparison(comparison) result(self)
    type(comparison_t), intent(in) :: comparison

    self = comparison
    if (comparison%measurement%kind /= measured_frequency .or. comparison%measurement%unit == '1') return
    self%measurement%unit = 'Hz'
    self%measured = from_si(comparison%measured, unit_hz)
    self%computed = from_si(comparison%computed, unit_hz)
    self%bias = from_si(comparison%bias, unit_hz)
    self%spread = from_si(comparison%spread, unit_hz)
    self%largest = from_si(comparison%largest, unit_hz)
  end function shown_comparison

  !> Compares values at the same abscissae.
  type(comparison_t) function new_comparison(measurement, abscissa, measured, computed) result(self)
    type(measurement_t), intent(in) :: measurement
    real(wp), intent(in) :: abscissa(:), measured(:), computed(:)   !! [values]
    real(wp) :: difference(size(measured)), of_computed, of_measured
    integer :: n

    self%measurement = measurement
    allocate (self%abscissa, source=abscissa)
    allocate (self%measured, source=measured)
    allocate (self%computed, source=computed)
    n = size(measured)
    if (n == 0) return
    difference = computed - measured
    self%bias = sum(difference) / n
    self%largest = difference(maxloc(abs(difference), dim=1))
    if (size(abscissa) == n) self%largest_at = abscissa(maxloc(abs(difference), dim=1))
    if (n == 1) return
    self%spread = sqrt(sum((difference - self%bias)**2) / (n - 1))
    of_measured = sum((measured - sum(measured) / n)**2)
    of_computed = sum((computed - sum(computed) / n)**2)
    self%has_correlation = n > 2 .and. of_measured > 0.0_wp .and. of_computed > 0.0_wp
    if (self%has_correlation) then
      self%correlation = sum((measured - sum(measured) / n) * (computed - sum(computed) / n)) / sqrt(of_measured * of_computed)
    end if
  end function new_comparison

  !> The damping ratios of frequencies as a comparison of their own; of no values if none was measured.
  type(comparison_t) function of_damping(frequencies) result(self)
    type(comparison_t), intent(in) :: frequencies
    type(measurement_t) :: m
    integer :: none(0)

    m = frequencies%measurement
    m%name = m%name // ', damping ratios'
    m%unit = '1'
    if (allocated(frequencies%measured_damping)) then
      self = new_comparison(m, frequencies%abscissa, frequencies%measured_damping, frequencies%computed_damping)
    else
      self = new_comparison(m, real(none, wp), real(none, wp), real(none, wp))
    end if
  end function of_damping

  !> Name of the file with the values of a comparison.
  pure function comparison_file(comparison, prefix) result(name)
    type(comparison_t), intent(in) :: comparison
    character(len=*), intent(in) :: prefix   !! `measured_files` ...
    character(len=:), allocatable :: name
    integer :: i

    name = prefix // comparison%measurement%name // '.csv'
    do i = 1, len(name)
      if (name(i:i) == '/') name(i:i) = '_'
    end do
  end function comparison_file

  !> Appends the names of the files of all comparisons.
  subroutine append_comparison_files(comparisons, prefix, names)
    type(comparison_t), intent(in) :: comparisons(:)
    character(len=*), intent(in) :: prefix   !! `measured_files` ...
    type(string_t), allocatable, intent(inout) :: names(:)
    integer :: i

    do i = 1, size(comparisons)
      call append(names, comparison_file(comparisons(i), prefix))
    end do
  end subroutine append_comparison_files

  !> Writes the file with a name, if it is that of a comparison: abscissa, measured and computed values, differences. Of a fit the
  !> values before it stand in between.
  subroutine put_comparison_table(comparisons, name, file, before)
    type(comparison_t), intent(in) :: comparisons(:)
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file
    type(comparison_t), intent(in), optional :: before(:)   !! of a fit, [comparisons]
    integer :: i

    do i = 1, size(comparisons)
      if (present(before)) then
        if (name == comparison_file(comparisons(i), fit_files)) call put_rows(comparisons(i), file, before(i))
      else
        if (name == comparison_file(comparisons(i), measured_files)) call put_rows(comparisons(i), file)
      end if
    end do
  end subroutine put_comparison_table

  subroutine put_rows(comparison, file, before)
    type(comparison_t), intent(in) :: comparison
    type(output_file_t), intent(inout) :: file
    type(comparison_t), intent(in), optional :: before
    type(string_t), allocatable :: labels(:)
    real(wp) :: columns(size(comparison%measured), 8)
    integer :: i, n

    allocate (labels(0))
    n = 0
    associate (m => comparison%measurement)
      select case (m%kind)
      case (measured_series)
        call add('t [s]', comparison%abscissa)
      case (measured_order)
        call add('speed [rad/s]', comparison%abscissa)
      case (measured_frequency)
        call add('mode [1]', comparison%abscissa)
      case default
        call add(trim(merge('speed [rad/s]', 'number [1]   ', abs(m%speed) > 0.0_wp)), comparison%abscissa)
      end select
      call add('measured [' // m%unit // ']', comparison%measured)
      if (has_before(size(comparison%measured))) call add('before [' // m%unit // ']', before%computed)
      call add('computed [' // m%unit // ']', comparison%computed)
      call add('difference [' // m%unit // ']', comparison%computed - comparison%measured)
      if (allocated(comparison%computed_damping)) then
        call add('measured_damping [1]', comparison%measured_damping)
        if (has_before(size(comparison%measured))) call add('before_damping [1]', before%computed_damping)
        call add('computed_damping [1]', comparison%computed_damping)
      end if
    end associate
    call write_header(file, labels)
    do i = 1, size(columns, 1)
      call write_row(file, columns(i, :n))
    end do

  contains

    !> Whether the same values were compared before; other modes may be found then.
    logical function has_before(values)
      integer, intent(in) :: values

      has_before = present(before)
      if (has_before) has_before = size(before%computed) == values
    end function has_before

    subroutine add(label, values)
      character(len=*), intent(in) :: label
      real(wp), intent(in) :: values(:)

      n = n + 1
      call append(labels, label)
      columns(:, n) = values
    end subroutine add

  end subroutine put_rows

  !> Writes members of an open object: what was measured.
  subroutine put_measurement(json, m)
    type(json_t), intent(inout) :: json
    type(measurement_t), intent(in) :: m

    call json%put('name', m%name)
    call json%put('kind', trim(measured_kinds(m%kind)))
    if (m%kind /= measured_frequency) call json%put('signal', m%signal_name)
    if (m%kind == measured_peak) call json%put('statistic', trim(peak_names(m%statistic)))
    if (m%kind == measured_order) call json%put('order', m%order)
    call json%put('unit', m%unit)
    call json%put('caption', m%caption)
  end subroutine put_measurement

  !> Writes the list `measurements` of a report.
  subroutine put_comparisons(json, comparisons)
    type(json_t), intent(inout) :: json
    type(comparison_t), intent(in) :: comparisons(:)
    type(comparison_t) :: damping
    integer :: i

    if (size(comparisons) == 0) return
    call json%open_list('measurements')
    do i = 1, size(comparisons)
      associate (one => comparisons(i), m => comparisons(i)%measurement)
        call json%open()
        call put_measurement(json, m)
        call json%put('file', comparison_file(one, measured_files))
        call json%put('values', size(one%measured))
        call json%put('outside', one%outside)
        call json%put('gaps', m%gaps)
        if (m%kind == measured_series) then
          call json%put('delay_s', one%delay)
          if (m%finds_delay) call json%put('delay_correlation', one%clock_correlation)
          if (m%drifts) call json%put('drift_s', m%drift)
          if (m%band(2) > 0.0_wp) call json%put('band_Hz', from_si(m%band, unit_hz))
        end if
        if (size(one%measured) > 0) then
          call json%put('bias', one%bias)
          call json%put('spread', one%spread)
          if (one%has_correlation) call json%put('correlation', one%correlation)
          call json%put('largest_difference', one%largest)
          call json%put('largest_difference_at', one%largest_at)
        end if
        damping = of_damping(one)
        if (size(damping%measured) > 0) then
          call json%put('damping_bias', damping%bias)
          call json%put('damping_spread', damping%spread)
        end if
        if (m%kind == measured_series .and. size(one%measured) > 1) then
          call json%put('half_range_measured', 0.5_wp * (maxval(one%measured) - minval(one%measured)))
          call json%put('half_range_computed', 0.5_wp * (maxval(one%computed) - minval(one%computed)))
        end if
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_comparisons

  !> Appends lines for the screen, one or two for each measurement.
  subroutine write_comparisons(comparisons, text)
    type(comparison_t), intent(in) :: comparisons(:)
    type(text_buffer_t), intent(inout) :: text
    character(len=:), allocatable :: line
    integer :: i

    do i = 1, size(comparisons)
      associate (one => comparisons(i), m => comparisons(i)%measurement)
        call text%append_line(line_on(shown_comparison(one)))
        if (allocated(one%measured_damping) .and. size(one%measured) > 0) call text%append_line(line_on(of_damping(one)))
        if (size(one%measured) < 2) cycle
        line = '  its clock: delay = ' // rounded_text(one%delay, 6) // ' s found by correlation, ' // &
               rounded_text(one%clock_correlation, 3)
        if (m%drifts) line = line // '; drifts by ' // rounded_text(m%drift(1), 3) // ' to ' // &
                             rounded_text(m%drift(2), 3) // ' s'
        if (m%finds_delay) call text%append_line(line)
        line = left_out(one)
        if (line /= '') call text%append_line('  ' // line)
      end associate
    end do
  end subroutine write_comparisons

  !> As "left out: 12 values where nothing was computed, 3 gaps of the file"; '' if nothing is.
  function left_out(one) result(line)
    type(comparison_t), intent(in) :: one
    character(len=:), allocatable :: line

    line = ''
    if (one%outside > 0 .or. one%measurement%gaps > 0) line = 'left out: ' // to_text(one%outside) // &
      ' values where nothing was computed, ' // to_text(one%measurement%gaps) // ' gaps of the file'
  end function left_out

  !> As "measured gauge total_moment_shaft: 301 values, bias 0.31, spread 0.19 N m, ...".
  function line_on(one) result(line)
    type(comparison_t), intent(in) :: one
    character(len=:), allocatable :: line, unit

    associate (m => one%measurement)
      unit = ' ' // m%unit
      if (m%unit == '1') unit = ''
      line = 'measured ' // m%name
      if (m%kind == measured_peak) line = line // ', ' // trim(peak_names(m%statistic)) // ' of'
      if (m%kind == measured_order) line = line // ', order ' // to_text(m%order) // ' of'
      if (m%kind /= measured_frequency) line = line // ' ' // m%signal_name
      if (size(one%measured) == 0) then
        line = line // ': none of its values is where something was computed'
        return
      end if
      if (size(one%measured) == 1) then
        line = line // ': computed ' // shown(one%computed(1)) // ', measured ' // shown(one%measured(1)) // &
               unit // ', difference ' // shown(one%largest) // ' (' // &
               rounded_text(100.0_wp * one%largest / nonzero(one%measured(1)), 3) // ' %)'
        return
      end if
      line = line // ': ' // counted(size(one%measured), 'value', 'values') // ', bias ' // shown(one%bias) // &
             ', spread ' // shown(one%spread) // unit
      if (one%has_correlation) line = line // ', correlation ' // rounded_text(one%correlation, 3)
      line = line // ', largest difference ' // shown(one%largest)
      if (m%kind == measured_series) line = line // ' at t = ' // shown(one%largest_at) // ' s'
      if (m%kind == measured_order) line = line // ' at ' // shown(one%largest_at) // ' rad/s'
      if (m%kind == measured_frequency) line = line // ' of mode ' // shown(one%largest_at)
    end associate

  contains

    function shown(value) result(short)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: short

      short = rounded_text(value, cell_digits)
    end function shown

    pure real(wp) function nonzero(value)
      real(wp), intent(in) :: value

      nonzero = sign(max(abs(value), tiny(value)), value)
    end function nonzero

  end function line_on

end module nocdyn_comparisons
