!> What a forced response says of the limits, and of critical speeds in operation or near it.
!>
!> A limit for continuous operation that is exceeded bars a range of speeds. It may be passed, 'restricted', if the rule accepts a
!> barred range there and a limit for passing it is kept: one of half ranges or, outside of operation, that of the largest
!> magnitude. In operation the limit is exceeded if there is none; outside of it the range is 'not assessed' then.
module nocdyn_response_verdict
  use nocdyn_excitation_lines, only: line_t
  use nocdyn_heat_results, only: temperatures
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: limited_kind
  use nocdyn_margins, only: add_coverage, add_critical, add_nearest
  use nocdyn_response_analysis, only: response_analysis_t
  use nocdyn_response_limits, only: no_limit, response_limit_t
  use nocdyn_response_points, only: response_point_t
  use nocdyn_response_summary, only: barred_range_t, response_summary_t
  use nocdyn_text, only: quoted, rounded_text
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  use nocdyn_verdicts, only: in_words, is_not_assessed, is_restricted, new_damage_line, new_verdict_line, verdict_line_t, &
    verdict_t
  implicit none (type, external)
  private

  public :: add_other_limits, find_response_verdict

contains

  !> Lists what is said of all limits and critical speeds.
  subroutine find_response_verdict(input, analysis, summary, verdict)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    type(verdict_t), intent(out) :: verdict
    integer :: groups(size(analysis%limits)), i

    do i = 1, size(analysis%limits)
      groups(i) = analysis%limits(i)%group
      call add_continuous(input, analysis, summary, i, verdict)
      call add_transient(input, analysis, i, verdict)
      call add_peak(input, analysis, i, verdict)
      call add_heat(input, analysis, i, verdict)
      call add_temperature(input, analysis, i, verdict)
      call add_curve(input, analysis, i, verdict)
    end do
    call add_other_limits(input, 'response', groups, 'a response has no such quantity: nocdyn run has', verdict)
    call add_fatigue(analysis, verdict)
    call add_criticals(analysis, summary, verdict)
    call add_coverage('response', analysis%settings, analysis%unstable, verdict)
  end subroutine find_response_verdict

  !> Each range of speeds in which a limit for continuous operation is exceeded; without one the speed that comes nearest to it.
  subroutine add_continuous(input, analysis, summary, number, verdict)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    integer, intent(in) :: number   !! of the limit
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    integer :: i

    associate (limit => analysis%limits(number), points => analysis%response%points)
      if (.not. limit%has_continuous()) return
      if (.not. any(summary%barred%limit == number)) then
        i = worst_point(points, limit%quantity, limit%continuous_limit(speeds_of(points)))
        call start_line(input, analysis, number, 'continuous', line)
        call compare_at(analysis, limit, i, limit%continuous_limit(points(i)%state%speed), line)
        call verdict%add(line)
      end if
      do i = 1, size(summary%barred)
        if (summary%barred(i)%limit /= number) cycle
        call start_line(input, analysis, number, 'continuous', line)
        call compare_at(analysis, limit, summary%barred(i)%worst, &
                        limit%continuous_limit(points(summary%barred(i)%worst)%state%speed), line)
        call judge_range(limit, summary%barred(i), analysis%settings%operating, line)
        call verdict%add(line)
      end do
    end associate
  end subroutine add_continuous

  !> Whether a barred range may be passed.
  subroutine judge_range(limit, range, operating, line)
    type(response_limit_t), intent(in) :: limit
    type(barred_range_t), intent(in) :: range
    real(wp), intent(in) :: operating(:)   !! speeds in operation [rad/s]; empty: unknown
    type(verdict_line_t), intent(inout) :: line
    character(len=:), allocatable :: share
    logical :: is_outside

    is_outside = .false.
    if (size(operating) == 2) then
      is_outside = max(abs(range%from), abs(range%to)) < minval(abs(operating)) .or. &
                   min(abs(range%from), abs(range%to)) > maxval(abs(operating))
    end if
    line%speeds = 2
    line%speed = [range%from, range%to]
    if (.not. range%is_allowed) then
      call limit%write_unbarred(share)
      line%reason = 'not allowed by ' // line%rule // ' from lambda ' // share // ' on'
    else if (.not. limit%has_transient() .and. .not. is_outside) then
      line%reason = 'no limit for passing the range is given'
    else if (.not. limit%has_transient() .and. limit%peak_limit() < no_limit) then
      line%finding = is_restricted
      line%reason = 'outside of operation, only to be passed, which the limit of the largest magnitude judges'
    else if (.not. limit%has_transient()) then
      line%finding = is_not_assessed
      line%reason = 'outside of operation, and no limit for passing the range is given'
    else if (.not. range%can_be_passed) then
      line%reason = 'the limit for passing the range is exceeded too'
    else
      line%finding = is_restricted
      line%reason = 'barred, to be passed quickly'
      if (range%has_tolerance) line%reason = line%reason // '; with the tolerance of the tachometer ' // range_text(range%barred)
    end if
  end subroutine judge_range

  !> "50.3 to 56.6 rpm"
  function range_text(speeds) result(text)
    real(wp), intent(in) :: speeds(2)   !! [rad/s]
    character(len=:), allocatable :: text

    text = rounded_text(from_si(speeds(1), unit_rpm), 4) // ' to ' // rounded_text(from_si(speeds(2), unit_rpm), 4) // ' rpm'
  end function range_text

  !> The limit for passing speeds quickly, where that is accepted.
  subroutine add_transient(input, analysis, number, verdict)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the limit
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    real(wp) :: allowed(size(analysis%response%points))
    integer :: worst

    associate (limit => analysis%limits(number), points => analysis%response%points)
      if (.not. limit%has_transient()) return
      allowed = limit%transient_limit(speeds_of(points))
      where (.not. limit%allows_passing(speeds_of(points))) allowed = no_limit
      worst = worst_point(points, limit%quantity, allowed)
      if (allowed(worst) >= no_limit) return
      call start_line(input, analysis, number, 'transient', line)
      call compare_at(analysis, limit, worst, allowed(worst), line)
      call verdict%add(line)
    end associate
  end subroutine add_transient

  !> The limit of the largest magnitude.
  subroutine add_peak(input, analysis, number, verdict)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the limit
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    integer :: i, worst

    associate (limit => analysis%limits(number), points => analysis%response%points)
      if (limit%peak_limit() >= no_limit) return
      worst = maxloc([(points(i)%peak(limit%quantity), i=1, size(points))], dim=1)
      call start_line(input, analysis, number, 'largest', line)
      line%rule = ''
      call line%compare(points(worst)%peak(limit%quantity), limit%peak_limit(), line%unit)
      call line%stand_at(points(worst)%state%speed)
      call verdict%add(line)
    end associate
  end subroutine add_peak

  !> The mean power that the element loses by its oscillation.
  subroutine add_heat(input, analysis, number, verdict)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the limit
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    real(wp) :: heat(size(analysis%response%points))
    integer :: i, worst

    associate (limit => analysis%limits(number), points => analysis%response%points)
      if (limit%heat >= no_limit) return
      heat = [(sum(points(i)%heat(analysis%response%quantities(limit%quantity)%elements)), i=1, size(points))]
      worst = maxloc(heat, dim=1)
      call start_line(input, analysis, number, '', line)
      line%quantity = 'heat'
      line%criterion = 'heat'
      call line%compare(heat(worst), limit%heat, 'W')
      call line%stand_at(points(worst)%state%speed)
      call verdict%add(line)
    end associate
  end subroutine add_heat

  !> The temperature of a rubber coupling.
  subroutine add_temperature(input, analysis, number, verdict)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the limit
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    real(wp), allocatable :: temperature(:)
    integer :: worst

    associate (limit => analysis%limits(number))
      if (limit%temperature >= no_limit) return
      temperature = temperatures(analysis%response, analysis%response%quantities(limit%quantity)%elements(1))
      call start_line(input, analysis, number, '', line)
      line%quantity = 'temperature'
      line%criterion = 'temperature'
      if (size(temperature) == 0) then
        line%finding = is_not_assessed
        line%reason = 'the coupling does not heat up: no data of its cooling, or a given condition'
      else
        worst = maxloc(temperature, dim=1)
        call line%compare(temperature(worst), limit%temperature, 'degC')
        call line%stand_at(analysis%response%points(worst)%state%speed)
      end if
      call verdict%add(line)
    end associate
  end subroutine add_temperature

  !> The amplitude of the order that comes nearest to a curve over the frequency.
  subroutine add_curve(input, analysis, number, verdict)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the limit
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    real(wp) :: largest, ratio
    integer :: i, k, worst(2)

    associate (limit => analysis%limits(number), points => analysis%response%points)
      if (.not. limit%has_curve()) return
      largest = -1.0_wp
      do i = 1, size(points)
        do k = 1, size(points(i)%frequency)
          ratio = limit%curve_ratio(points(i)%frequency(k), abs(points(i)%quantity(k, limit%quantity)))
          if (ratio <= largest) cycle
          largest = ratio
          worst = [i, k]
        end do
      end do
      if (largest < 0) return
      call start_line(input, analysis, number, 'of one order over the frequency', line)
      associate (point => points(worst(1)), frequency => points(worst(1))%frequency(worst(2)))
        call line%compare(abs(point%quantity(worst(2), limit%quantity)), limit%amplitude_limit(frequency), line%unit)
        call line%stand_at(point%state%speed)
        if (.not. line%are_frequencies) line%detail = title_of(analysis%response%lines(worst(2))) // ', ' // &
                                                      rounded_text(from_si(frequency, unit_hz), 4) // ' Hz'
      end associate
      line%rule = ''
      call verdict%add(line)
    end associate
  end subroutine add_curve

  !> The limits of quantities that an analysis does not have.
  subroutine add_other_limits(input, analysis, read, reason, verdict)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: analysis   !! its name
    integer, intent(in) :: read(:)             !! the groups &limit that it has read
    character(len=*), intent(in) :: reason     !! why it does not compare with the others
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    integer, allocatable :: groups(:)
    character(len=:), allocatable :: kind
    integer :: i

    allocate (groups, source=input%groups_named('limit'))
    do i = 1, size(groups)
      if (any(read == groups(i))) cycle
      kind = trim(limited_kind(input%groups(groups(i))))
      associate (group => input%groups(groups(i)))
        line = new_verdict_line(analysis, kind // ' ' // quoted(group%text(kind)), group%text('quantity'), &
                                in_words(group%text('quantity')), input%place(groups(i), ''))
      end associate
      line%finding = is_not_assessed
      line%reason = reason
      call verdict%add(line)
    end do
  end subroutine add_other_limits

  !> The damage of profiles of speeds and hours.
  subroutine add_fatigue(analysis, verdict)
    type(response_analysis_t), intent(in) :: analysis
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    integer :: i

    do i = 1, size(analysis%fatigue)
      associate (item => analysis%fatigue(i))
        if (size(item%hours) == 0 .and. .not. item%exceeds_strength) cycle
        if (size(item%hours) == 0) then
          line = new_damage_line('response', item%kind, item%element, item%name, item%exceeds_strength)
        else
          line = new_damage_line('response', item%kind, item%element, item%name, item%exceeds_strength, item%damage())
          line%detail = rounded_text(sum(item%hours), 6) // ' h'
        end if
        line%quantity = item%quantity
        call verdict%add(line)
      end associate
    end do
  end subroutine add_fatigue

  !> Critical speeds in operation or too near to it, which the response there judges.
  subroutine add_criticals(analysis, summary, verdict)
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    type(verdict_t), intent(inout) :: verdict
    character(len=:), allocatable :: element
    integer :: i

    do i = 1, size(summary%criticals)
      associate (critical => summary%criticals(i))
        if (analysis%modes%is_electrical(critical%crossing%mode)) cycle
        element = ''
        if (critical%quantity > 0) element = analysis%response%quantities(critical%quantity)%element
        call add_critical('response', analysis%settings, critical%crossing, &
                          title_of(analysis%response%lines(critical%crossing%line)), critical%margin, critical%ratio, element, &
                          verdict)
      end associate
    end do
    call add_nearest('response', analysis%settings, analysis%modes, analysis%crossings, verdict)
  end subroutine add_criticals

  !> "order 6", "twice-slip".
  function title_of(line) result(title)
    type(line_t), intent(in) :: line
    character(len=:), allocatable :: title

    title = line%word()
    if (line%is_order) title = 'order ' // title
  end function title_of

  !> A line on a limit.
  subroutine start_line(input, analysis, number, what, line)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number          !! of the limit
    character(len=*), intent(in) :: what   !! "continuous"
    type(verdict_line_t), intent(out) :: line

    associate (limit => analysis%limits(number))
      associate (one => analysis%response%quantities(limit%quantity))
        line = new_verdict_line('response', one%element_kind // ' ' // quoted(one%element), one%name, &
                                in_words(one%symbol) // ', ' // what, input%place(limit%group, ''))
        line%unit = one%unit
        line%are_frequencies = analysis%settings%axis%is_frequency
      end associate
      call limit%write_rule(line%rule)
    end associate
  end subroutine start_line

  !> Compares the half range at a point.
  subroutine compare_at(analysis, limit, point, allowed, line)
    type(response_analysis_t), intent(in) :: analysis
    type(response_limit_t), intent(in) :: limit
    integer, intent(in) :: point
    real(wp), intent(in) :: allowed   !! [unit of the line]
    type(verdict_line_t), intent(inout) :: line

    associate (one => analysis%response%points(point))
      call line%compare(one%half_range(limit%quantity), allowed, line%unit)
      call line%stand_at(one%state%speed)
      call limit%write_place(one%state%speed, line%detail)
    end associate
  end subroutine compare_at

  !> The point with the largest ratio of half range to limit.
  pure integer function worst_point(points, quantity, allowed) result(worst)
    type(response_point_t), intent(in) :: points(:)
    integer, intent(in) :: quantity
    real(wp), intent(in) :: allowed(:)   !! [points]
    integer :: i

    worst = maxloc([(points(i)%half_range(quantity) / allowed(i), i=1, size(points))], dim=1)
  end function worst_point

  pure function speeds_of(points) result(speed)
    type(response_point_t), intent(in) :: points(:)
    real(wp) :: speed(size(points))   !! [rad/s]
    integer :: i

    speed = [(points(i)%state%speed, i=1, size(points))]
  end function speeds_of

end module nocdyn_response_verdict
