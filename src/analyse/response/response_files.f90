!> The files of a forced response: response.csv, response_orders.csv, what their columns are, and response.json.
module nocdyn_response_files
  use nocdyn_column_lists, only: column_list_t
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_heat_results, only: heat_values, list_heat, put_rubber
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_margins, only: put_margin, put_mode
  use nocdyn_output_file, only: output_file_t
  use nocdyn_report_openings, only: open_analysis_report
  use nocdyn_response_analysis, only: response_analysis_t
  use nocdyn_response_axes, only: response_axis_t
  use nocdyn_response_limits, only: no_limit, response_limit_t
  use nocdyn_response_summary, only: critical_t, response_summary_t, worst_ratio
  use nocdyn_text, only: string_t
  use nocdyn_verdicts, only: verdict_t
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: put_response_csv, put_orders_csv, put_response_grid, response_columns_json, put_response

  character(len=*), parameter, public :: response_table = 'response.csv', orders_table = 'response_orders.csv'
  character(len=*), parameter, public :: response_grid = 'response.nc'   !! in place of both

  real(wp), parameter :: degree = acos(-1.0_wp) / 180.0_wp, turn = 2.0_wp * acos(-1.0_wp)

contains

  !> Writes response.csv: a row for every speed with means, half ranges, peaks, stresses, limits and heat.
  subroutine put_response_csv(analysis, wanted, file)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! units of speeds: indices of `units`
    type(output_file_t), intent(inout) :: file
    type(column_list_t) :: list
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: unit(:)
    real(wp), allocatable :: row(:)
    integer :: i

    call list_columns(analysis, wanted, list)
    call list%list_columns(labels, unit)
    allocate (row(size(labels)))
    call write_header(file, labels)
    do i = 1, size(analysis%response%points)
      call fill_row(analysis, i, row)
      call write_row(file, from_si(row, unit))
    end do
  end subroutine put_response_csv

  !> The columns of response.csv.
  subroutine list_columns(analysis, wanted, list)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! indices of `units`
    type(column_list_t), intent(out) :: list
    integer :: i, k, q

    call list%start(trim(merge(response_grid // ' ', response_table, analysis%writes_grid)), wanted)
    if (analysis%settings%axis%is_frequency) then
      call list%add_named('frequency', 'Hz', 'frequency of the shaker')
    else
      call list%add_named('omega', 'rad/s', 'speed that is held', 'body', analysis%body_name)
      call list%add_named('drive', '1', 'share of the torques of the drives that holds the speed')
      call list%add_named('drive_torque', 'N m', 'torque that holds the speed')
    end if
    associate (quantities => analysis%response%quantities, limits => analysis%limits)
      do i = 1, size(analysis%shown)
        q = analysis%shown(i)
        associate (signal => quantities(q)%signal_t)
          call list%add(signal, 'mean')
          call list%add(signal, 'half_range')
          call list%add(signal, 'peak')
          call list_heat(analysis%response, q, list)
          if (any(limits%quantity == q)) call list%add(signal, 'ratio', '1')
        end associate
      end do
      do k = 1, size(limits)
        associate (signal => quantities(limits(k)%quantity)%signal_t)
          if (any(limits(:k - 1)%quantity == limits(k)%quantity) .or. all(analysis%shown /= limits(k)%quantity)) cycle
          if (has_continuous(analysis, signal%name)) call list%add(signal, 'limit')
          if (has_transient(analysis, signal%name)) call list%add(signal, 'transient_limit')
          if (has_peak(limits, limits(k)%quantity)) call list%add(signal, 'peak_limit')
        end associate
      end do
    end associate
    do k = 1, size(analysis%fatigue)
      call list%add_named('damage_per_hour', '1/h', 'damage per hour', 'fatigue', analysis%fatigue(k)%name)
    end do
  end subroutine list_columns

  !> Whether some limit of a quantity bounds its half range.
  logical function has_continuous(analysis, label)
    type(response_analysis_t), intent(in) :: analysis
    character(len=*), intent(in) :: label
    integer :: k

    has_continuous = .false.
    do k = 1, size(analysis%limits)
      if (analysis%response%quantities(analysis%limits(k)%quantity)%name /= label) cycle
      has_continuous = has_continuous .or. analysis%limits(k)%continuous_limit(analysis%settings%speeds(1)) < no_limit
    end do
  end function has_continuous

  !> Whether some limit of a quantity holds while a speed is passed.
  logical function has_transient(analysis, label)
    type(response_analysis_t), intent(in) :: analysis
    character(len=*), intent(in) :: label
    integer :: k

    has_transient = .false.
    do k = 1, size(analysis%limits)
      if (analysis%response%quantities(analysis%limits(k)%quantity)%name /= label) cycle
      has_transient = has_transient .or. analysis%limits(k)%transient_limit(analysis%settings%speeds(1)) < no_limit
    end do
  end function has_transient

  !> Whether some limit bounds the largest magnitude of a quantity.
  pure logical function has_peak(limits, quantity)
    type(response_limit_t), intent(in) :: limits(:)
    integer, intent(in) :: quantity

    has_peak = any(limits%quantity == quantity .and. limits%peak_limit() < no_limit)
  end function has_peak

  !> The row of one speed.
  subroutine fill_row(analysis, i, row)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: i             !! point of the response
    real(wp), intent(out) :: row(:)
    real(wp), allocatable :: heat(:)
    integer :: j, k, n, q

    n = 0
    associate (quantities => analysis%response%quantities, limits => analysis%limits, point => analysis%response%points(i), &
               speed => analysis%response%points(i)%state%speed)
      call put(analysis%settings%axis%stored(speed))
      if (.not. analysis%settings%axis%is_frequency) then
        call put(point%state%factor)
        call put(point%state%torque)
      end if
      do j = 1, size(analysis%shown)
        q = analysis%shown(j)
        row(n + 1:n + 3) = [point%mean(q), point%half_range(q), point%peak(q)]
        n = n + 3
        heat = heat_values(analysis%response, q, point)
        row(n + 1:n + size(heat)) = heat
        n = n + size(heat)
        if (any(limits%quantity == q)) call put(worst_ratio(limits, point, q))
      end do
      do k = 1, size(limits)
        if (any(limits(:k - 1)%quantity == limits(k)%quantity) .or. all(analysis%shown /= limits(k)%quantity)) cycle
        if (has_continuous(analysis, quantities(limits(k)%quantity)%name)) then
          call put(minval(limits%continuous_limit(speed), mask=limits%quantity == limits(k)%quantity))
        end if
        if (has_transient(analysis, quantities(limits(k)%quantity)%name)) then
          call put(minval(limits%transient_limit(speed), mask=limits%quantity == limits(k)%quantity))
        end if
        if (has_peak(limits, limits(k)%quantity)) then
          call put(minval(limits%peak_limit(), mask=limits%quantity == limits(k)%quantity))
        end if
      end do
      do k = 1, size(analysis%fatigue)
        call put(analysis%fatigue(k)%rate(i))
      end do
    end associate

  contains

    subroutine put(value)
      real(wp), intent(in) :: value

      n = n + 1
      row(n) = value
    end subroutine put

  end subroutine fill_row

  !> Writes response_orders.csv: a row for every speed and line with amplitudes and phases.
  subroutine put_orders_csv(analysis, wanted, file)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! units of speeds and angles: indices of `units`
    type(output_file_t), intent(inout) :: file
    type(column_list_t) :: list
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: unit(:)
    real(wp), allocatable :: row(:)
    integer :: i, l

    call list_order_columns(analysis, wanted, list)
    call list%list_columns(labels, unit)
    allocate (row(size(labels)))
    call write_header(file, labels)
    do i = 1, size(analysis%response%points)
      do l = 1, size(analysis%response%lines)
        call fill_order_row(analysis, i, l, row)
        call write_row(file, from_si(row, unit))
      end do
    end do
  end subroutine put_orders_csv

  !> The row of one speed and line.
  subroutine fill_order_row(analysis, i, l, row)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: i, l          !! point and line of the response
    real(wp), intent(out) :: row(:)
    integer :: before, n

    associate (response => analysis%response, point => analysis%response%points(i), shown => analysis%shown, &
               angles => analysis%response%angle_place(analysis%response%angles(analysis%shown_angles)%source%index))
      before = 1
      row(1) = analysis%settings%axis%stored(point%state%speed)
      if (.not. analysis%settings%axis%is_frequency) then
        before = 3
        row(2:3) = [point%frequency(l) / abs(point%state%speed), point%frequency(l) / turn]
        if (response%lines(l)%is_order) row(2) = response%lines(l)%order   ! without the rounding of the frequency
      end if
      n = before + 2 * size(shown)
      row(before + 1:n:2) = abs(point%quantity(l, shown))
      row(before + 2:n:2) = phase(point%quantity(l, shown))
      row(n + 1::3) = abs(point%angle(l, angles))
      row(n + 2::3) = phase(point%angle(l, angles))
      row(n + 3::3) = point%frequency(l) * row(n + 1::3)
    end associate
  end subroutine fill_order_row

  !> Writes the columns of response.csv over the speed, and the ones of response_orders.csv over speed and line, to one file.
  subroutine put_response_grid(analysis, input, wanted, folder, file)
    type(response_analysis_t), intent(in) :: analysis
    type(input_t), intent(in) :: input
    integer, intent(in) :: wanted(:)               !! units of speeds and angles: indices of `units`
    character(len=*), intent(in) :: folder
    class(grid_file_t), intent(inout) :: file      !! not open
    type(column_list_t) :: list, order_list
    type(string_t), allocatable :: labels(:), order_labels(:)
    integer, allocatable :: order_unit(:), unit(:)
    real(wp), allocatable :: order_row(:), row(:)
    integer :: i, l

    call list_columns(analysis, wanted, list)
    call list%list_columns(labels, unit)
    call list_order_columns(analysis, wanted, order_list)
    call order_list%list_columns(order_labels, order_unit)
    allocate (row(size(labels)), order_row(size(order_labels)))
    associate (speed => labels(1)%text, points => size(analysis%response%points), lines => size(analysis%response%lines))
      call file%open(folder, response_grid, [string_t(speed(:index(speed, ' [', back=.true.) - 1)), string_t('line')], &
                     [points, lines], input%title(), input_text(input))
      call file%begin_table(labels, 1)
      do i = 1, points
        call fill_row(analysis, i, row)
        call file%put_row(from_si(row, unit))
      end do
      call file%begin_table(order_labels(2:), 2)
      do i = 1, points
        do l = 1, lines
          call fill_order_row(analysis, i, l, order_row)
          call file%put_row(from_si(order_row(2:), order_unit(2:)))
        end do
      end do
    end associate
  end subroutine put_response_grid

  !> The columns of response_orders.csv.
  subroutine list_order_columns(analysis, wanted, list)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! indices of `units`
    type(column_list_t), intent(out) :: list
    integer :: i

    call list%start(trim(merge(response_grid // '        ', orders_table, analysis%writes_grid)), wanted)
    if (analysis%settings%axis%is_frequency) then
      call list%add_named('frequency', 'Hz', 'frequency of the shaker')
    else
      call list%add_named('omega', 'rad/s', 'speed that is held', 'body', analysis%body_name)
      call list%add_named('order', '1', 'oscillations per turn of the body')
      call list%add_named('frequency', 'Hz', 'frequency')
    end if
    do i = 1, size(analysis%shown)
      associate (signal => analysis%response%quantities(analysis%shown(i))%signal_t)
        call list%add(signal)
        call list%add(signal, 'phase', 'deg')
      end associate
    end do
    do i = 1, size(analysis%shown_angles)
      associate (signal => analysis%response%angles(analysis%shown_angles(i)))
        call list%add(signal)
        call list%add(signal, 'phase', 'deg')
        call list%add_named('omega_amplitude', 'rad/s', 'amplitude of the speed', 'body', signal%element)
      end associate
    end do
  end subroutine list_order_columns

  !> The text of the file that says what the columns of both tables are.
  function response_columns_json(analysis, wanted) result(text)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! indices of `units`
    character(len=:), allocatable :: text
    type(column_list_t) :: list, orders
    type(json_t) :: json

    call list_columns(analysis, wanted, list)
    call list_order_columns(analysis, wanted, orders)
    call json%open()
    call json%open_list('columns')
    call list%put(json)
    call orders%put(json)
    call json%close_list()
    call json%close()
    text = json%text()
  end function response_columns_json

  !> The lead of an oscillation before cos(Omega t) [deg].
  elemental real(wp) function phase(amplitude)
    complex(wp), intent(in) :: amplitude

    phase = 0.0_wp
    if (abs(amplitude) > 0) phase = atan2(aimag(amplitude), real(amplitude, wp)) / degree
  end function phase

  !> The members of response.json.
  subroutine put_response(json, input, analysis, summary, verdict)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    type(verdict_t), intent(in) :: verdict
    real(wp), allocatable :: unstable(:)
    type(response_axis_t) :: axis
    integer :: i

    axis = analysis%settings%axis
    call open_analysis_report(json, input)
    call verdict%put(json)
    call json%put('wall_time_s', analysis%wall_time)
    call json%put('notes', analysis%notes)
    if (size(analysis%unstable) > 0) then
      unstable = axis%stored(analysis%unstable%speed)
      call json%put('unstable_' // trim(merge('frequencies_Hz', 'speeds_rad_s  ', axis%is_frequency)), unstable)
    end if
    if (axis%is_frequency) call json%put('excitation', analysis%settings%shaker_name)
    call json%put('body', analysis%body_name)
    associate (points => analysis%settings%speeds)
      call json%put(axis%key(''), axis%stored([points(1), points(size(points))]))
    end associate
    if (size(analysis%settings%operating) > 0) then
      call json%put('operating_rad_s', analysis%settings%operating)
      call json%put('margin', analysis%settings%margin)
    end if
    call json%open_list('lines')
    do i = 1, merge(0, size(analysis%response%lines), axis%is_frequency)
      call json%open()
      call put_line(json, analysis, i)
      call json%close()
    end do
    call json%close_list()
    if (analysis%modes%modes > 0) call json%put('modes_numbered_at_rad_s', analysis%modes%numbered_at)
    call json%open_list(trim(merge('resonances     ', 'critical_speeds', axis%is_frequency)))
    do i = 1, size(summary%criticals)
      call json%open()
      call put_mode(json, analysis%response%machine, analysis%modes, summary%criticals(i)%crossing%mode)
      if (.not. axis%is_frequency) then
        call put_line(json, analysis, summary%criticals(i)%crossing%line)
        call json%put('speed_rad_s', summary%criticals(i)%crossing%speed)
      end if
      call json%put('frequency_Hz', summary%criticals(i)%crossing%frequency / turn)
      call json%put('damping_ratio', summary%criticals(i)%crossing%damping_ratio)
      if (summary%criticals(i)%quantity > 0) then
        call json%put('coupling', analysis%response%quantities(summary%criticals(i)%quantity)%element)
        if (.not. summary%criticals(i)%is_unbounded) then
          call json%put(axis%key('peak_'), axis%stored(summary%criticals(i)%speed))
          call json%put('moment_N_m', summary%criticals(i)%amplitude)
          if (summary%criticals(i)%stress > 0) call json%put('stress_Pa', summary%criticals(i)%stress)
          call json%put('half_range_N_m', summary%criticals(i)%half_range)
          if (summary%criticals(i)%ratio > 0) call json%put('ratio_to_limit', summary%criticals(i)%ratio)
        end if
      end if
      call put_margin(json, analysis%settings, analysis%modes, summary%criticals(i)%crossing%mode, summary%criticals(i)%margin)
      call json%close()
    end do
    call json%close_list()
    call put_largest(json, analysis, summary)
    call put_rubber(json, analysis%response)
    call put_barred(json, input, analysis, summary)
    call put_fatigue(json, analysis)
  end subroutine put_response

  !> The order of a line, or its number, its name and its frequencies at both ends if these do not grow with the speed.
  subroutine put_line(json, analysis, l)
    type(json_t), intent(inout) :: json
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: l   !! number of the line

    associate (line => analysis%response%lines(l), points => analysis%response%points)
      if (line%is_order) then
        call json%put('order', line%order)
      else
        call json%put('line', l)
        call json%put('line_name', line%word())
        call json%put('line_frequency_Hz', [points(1)%frequency(l), points(size(points))%frequency(l)] / turn)
      end if
    end associate
  end subroutine put_line

  subroutine put_largest(json, analysis, summary)
    type(json_t), intent(inout) :: json
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    integer :: i, q

    call json%open_list('largest')
    do i = 1, size(analysis%shown)
      q = analysis%shown(i)
      associate (largest => summary%largest(q), points => analysis%response%points, one => analysis%response%quantities(q), &
                 axis => analysis%settings%axis)
        call json%open()
        call json%put('quantity', one%name)
        call json%put('unit', one%unit)
        call json%put('half_range', largest%half_range)
        call json%put(axis%key('half_range_'), axis%stored(points(largest%half_point)%state%speed))
        if (.not. axis%is_frequency) call json%put('half_range_by_order', abs(points(largest%half_point)%quantity(:, q)))
        call json%put('peak', largest%peak)
        call json%put(axis%key('peak_'), axis%stored(points(largest%peak_point)%state%speed))
        if (largest%ratio_point > 0) then
          call json%put('ratio_to_limit', largest%ratio)
          call json%put(axis%key('ratio_'), axis%stored(points(largest%ratio_point)%state%speed))
        end if
        if (largest%peak_ratio > 0) call json%put('peak_ratio_to_limit', largest%peak_ratio)
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_largest

  subroutine put_barred(json, input, analysis, summary)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    integer :: i

    call json%open_list(trim(merge('barred_frequency_ranges', 'barred_speed_ranges    ', analysis%settings%axis%is_frequency)))
    do i = 1, size(summary%barred)
      associate (range => summary%barred(i), limit => analysis%limits(summary%barred(i)%limit), axis => analysis%settings%axis)
        call json%open()
        call json%put('quantity', analysis%response%quantities(limit%quantity)%name)
        call json%put('limit_at', input%place(limit%group, ''))
        call json%put(trim(merge('from_Hz   ', 'from_rad_s', axis%is_frequency)), axis%stored(range%from))
        call json%put(trim(merge('to_Hz   ', 'to_rad_s', axis%is_frequency)), axis%stored(range%to))
        if (range%has_tolerance) call json%put('with_tolerance_rad_s', range%barred)
        call json%put('can_be_passed', range%can_be_passed)
        call json%put('is_allowed', range%is_allowed)
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_barred

  !> The damage per hour and the one of profiles, of all groups &fatigue; nothing without them.
  subroutine put_fatigue(json, analysis)
    type(json_t), intent(inout) :: json
    type(response_analysis_t), intent(in) :: analysis
    integer :: i

    if (size(analysis%fatigue) == 0) return
    call json%open_list('fatigue')
    do i = 1, size(analysis%fatigue)
      associate (item => analysis%fatigue(i))
        call json%open()
        call json%put('name', item%name)
        call json%put('element', item%element)
        call json%put('quantity', item%quantity)
        call json%put('largest_damage_per_hour', item%rate(item%largest))
        call json%put(analysis%settings%axis%key(''), &
                      analysis%settings%axis%stored(analysis%response%points(item%largest)%state%speed))
        call json%put('mean_exceeds_strength', item%exceeds_strength)
        if (size(item%hours) > 0) then
          call json%put('profile_speeds_rad_s', item%speeds)
          call json%put('profile_hours', item%hours)
          call json%put('profile_damage_per_hour', item%profile_rate)
          call json%put('damage_of_profile', item%damage())
          if (item%damage() > 0) call json%put('hours_to_failure', sum(item%hours) / item%damage())
        end if
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_fatigue

end module nocdyn_response_files
