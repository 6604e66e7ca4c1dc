!> What periodic motions say of limits: each range of the parameter in which motions on which the machine can stay exceed one.
!>
!> Unstable motions do not count. Values of the parameter without a stable motion are not assessed.
module nocdyn_orbit_verdict
  use nocdyn_brackets, only: bracket_t, new_bracket
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_measures, only: comparisons, measured_orbits_t, of_half_range, of_harmonic, of_largest, orbit_measure_t
  use nocdyn_orbit_motions, only: settle_between
  use nocdyn_orbit_parts, only: find_parts, part_t
  use nocdyn_orbit_problem, only: orbit_point_t
  use nocdyn_response_limits, only: no_limit
  use nocdyn_response_verdict, only: add_other_limits
  use nocdyn_text, only: quoted, to_text
  use nocdyn_verdicts, only: in_words, is_exceeded, is_not_assessed, new_damage_line, new_verdict_line, verdict_line_t, verdict_t
  implicit none (type, external)
  private

  public :: find_orbit_verdict

  character(len=*), parameter :: names(comparisons) = [character(len=34) :: 'continuous', 'largest', &
                                                                         'of one harmonic over the frequency']
  real(wp), parameter :: narrow = 1.0e-9_wp   ! width of ranges that are none, as a share of the whole one

contains

  !> Lists what is said of all limits.
  subroutine find_orbit_verdict(input, analysis, verdict)
    type(input_t), intent(in) :: input
    type(measured_orbits_t), intent(inout) :: analysis
    type(verdict_t), intent(out) :: verdict
    character(len=:), allocatable :: reason
    integer :: compared, i
    integer, allocatable :: groups(:)

    if (size(input%groups_named('limit')) + size(input%groups_named('fatigue')) == 0) return
    allocate (groups(size(analysis%limits)))
    do i = 1, size(analysis%limits)
      groups(i) = analysis%limits(i)%group
      do compared = 1, comparisons
        call add_limit(input, analysis, i, compared, verdict)
      end do
      call add_left_out(input, analysis, i, verdict)
    end do
    reason = 'a periodic motion has no such quantity'
    if (analysis%settings%mode > 0) reason = 'a nonlinear mode is no motion of operation'
    call add_other_limits(input, 'orbit', groups, reason, verdict)
    if (analysis%settings%mode > 0) return
    call add_damages(input, analysis, verdict)
    call add_gaps(analysis, verdict)
  end subroutine find_orbit_verdict

  !> One comparison of one limit: a line for each range in which it is exceeded; without one the motion nearest to it.
  subroutine add_limit(input, analysis, number, compared, verdict)
    type(input_t), intent(in) :: input
    type(measured_orbits_t), intent(inout) :: analysis
    integer, intent(in) :: number     !! of the limit
    integer, intent(in) :: compared   !! of_...
    type(verdict_t), intent(inout) :: verdict
    logical :: possible(analysis%branch%count), exceeds(analysis%branch%count)
    real(wp) :: ratio(analysis%branch%count)
    type(verdict_line_t) :: line
    integer :: first, i, last

    if (all([(analysis%measures(i)%allowed(compared, number) >= no_limit, i=1, size(ratio))])) return
    possible = analysis%are_possible()
    ratio = [(ratio_of(analysis%measures(i), number, compared), i=1, size(ratio))]
    exceeds = possible .and. ratio > 1
    call start_line(input, analysis, number, compared, line)
    if (line%rule /= '' .and. analysis%reference == 0 .and. compared == of_half_range) then
      line%finding = is_not_assessed
      line%reason = 'the rule follows the speed of a body; required: body of &orbit or of &response'
    else if (.not. any(possible)) then
      line%finding = is_not_assessed
      line%reason = 'no stable motion was found'
    else if (.not. any(exceeds)) then
      i = maxloc(ratio, dim=1, mask=possible)
      call compare_at(analysis, number, compared, i, line)
    end if
    if (line%finding == is_not_assessed .or. .not. any(exceeds)) then
      call verdict%add(line)
      return
    end if
    last = 0
    do
      first = last + findloc(exceeds(last + 1:), .true., dim=1)
      if (first == last) exit
      last = first
      do while (last < size(ratio))
        if (.not. exceeds(last + 1) .or. analysis%branch%points(last + 1)%branch /= analysis%branch%points(first)%branch) exit
        last = last + 1
      end do
      call start_line(input, analysis, number, compared, line)
      call compare_at(analysis, number, compared, first - 1 + maxloc(ratio(first:last), dim=1), line)
      call span_range(analysis, number, compared, [first, last], line)
      call verdict%add(line)
    end do
  end subroutine add_limit

  !> The value as a share of what is allowed; 0 without a limit.
  pure real(wp) function ratio_of(measure, number, compared) result(ratio)
    type(orbit_measure_t), intent(in) :: measure
    integer, intent(in) :: number, compared

    ratio = 0.0_wp
    associate (allowed => measure%allowed(compared, number))
      if (allowed < no_limit) ratio = measure%value(compared, number) / allowed
    end associate
  end function ratio_of

  subroutine start_line(input, analysis, number, compared, line)
    type(input_t), intent(in) :: input
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: number, compared
    type(verdict_line_t), intent(out) :: line

    associate (limit => analysis%limits(number))
      associate (signal => analysis%columns%signals(limit%quantity))
        line = new_verdict_line('orbit', signal%element_kind // ' ' // quoted(signal%element), signal%name, &
                                in_words(signal%symbol) // ', ' // trim(names(compared)), input%place(limit%group, ''))
        line%unit = signal%unit
      end associate
      if (compared == of_half_range) call limit%write_rule(line%rule)
    end associate
  end subroutine start_line

  !> Compares the motion of a point.
  subroutine compare_at(analysis, number, compared, point, line)
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: number, compared, point
    type(verdict_line_t), intent(inout) :: line

    associate (measure => analysis%measures(point), one => analysis%branch%points(point))
      call line%compare(measure%value(compared, number), measure%allowed(compared, number), line%unit)
      call stand_at(analysis, [one%orbit%value], line)
      if (line%rule /= '') call analysis%limits(number)%write_place(analysis%reference_speed(one), line%detail)
      if (one%branch == 1) return
      if (line%detail /= '') line%detail = line%detail // ', '
      line%detail = line%detail // 'branch ' // to_text(one%branch)
    end associate
  end subroutine compare_at

  !> Says at which value or range of the parameter something is.
  pure subroutine stand_at(analysis, values, line)
    type(measured_orbits_t), intent(in) :: analysis
    real(wp), intent(in) :: values(:)   !! one or two
    type(verdict_line_t), intent(inout) :: line

    line%speeds = size(values)
    line%speed(:size(values)) = values
    if (analysis%body_name /= '') return
    line%axis = analysis%parameter
    line%axis_unit = analysis%unit
  end subroutine stand_at

  !> The range from the point where a limit is met to the one where it is kept again, of points that exceed it.
  subroutine span_range(analysis, number, compared, ends, line)
    type(measured_orbits_t), intent(inout) :: analysis
    integer, intent(in) :: number, compared
    integer, intent(in) :: ends(2)      !! first and last point
    type(verdict_line_t), intent(inout) :: line
    real(wp) :: along(ends(1):ends(2)), from, to
    integer :: i

    along = [(analysis%branch%points(i)%orbit%value, i=ends(1), ends(2))]
    from = edge_of(analysis, number, compared, ends(1), ends(1) - 1)
    to = edge_of(analysis, number, compared, ends(2), ends(2) + 1)
    call stand_at(analysis, [min(minval(along), from, to), max(maxval(along), from, to)], line)
  end subroutine span_range

  !> Where a limit is met between a point that exceeds it and its neighbour; the value at the point if this cannot be.
  real(wp) function edge_of(analysis, number, compared, point, neighbour) result(value)
    type(measured_orbits_t), intent(inout) :: analysis
    integer, intent(in) :: number, compared
    integer, intent(in) :: point, neighbour
    integer, parameter :: steps = 12
    real(wp), parameter :: exact = 1.0e-7_wp   ! of the share of the limit
    type(bracket_t) :: bracket
    type(orbit_point_t) :: middle
    type(orbit_measure_t) :: measure
    type(error_t), allocatable :: error
    real(wp) :: place, share
    integer :: k

    value = analysis%branch%points(point)%orbit%value
    if (neighbour < 1 .or. neighbour > analysis%branch%count) return
    associate (other => analysis%branch%points(neighbour))
      if (other%branch /= analysis%branch%points(point)%branch) return
      share = ratio_of(analysis%measures(neighbour), number, compared) - 1
      if (share > 0 .or. .not. abs(other%orbit%value - value) > 0) return   ! the motion loses its stability there
      bracket = new_bracket([value, other%orbit%value], [ratio_of(analysis%measures(point), number, compared) - 1, share])
    end associate
    do k = 1, steps
      if (bracket%is_narrow()) exit
      place = bracket%next()
      call settle_between(analysis%orbit_analysis_t, min(point, neighbour), place, middle, error)
      if (.not. allocated(error)) call analysis%measure(middle, measure, error)
      if (allocated(error)) exit
      share = ratio_of(measure, number, compared) - 1
      call bracket%narrow(place, share)
      if (abs(share) <= exact) exit
    end do
    value = bracket%root()
  end function edge_of

  !> What limits ask of passages and of heat.
  subroutine add_left_out(input, analysis, number, verdict)
    type(input_t), intent(in) :: input
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the limit
    type(verdict_t), intent(inout) :: verdict

    associate (limit => analysis%limits(number))
      if (limit%has_transient()) call add('transient', 'for speeds that are passed: nocdyn response and nocdyn transit')
      if (limit%heat < no_limit) call add('heat', 'the power that is lost: nocdyn response')
      if (limit%temperature < no_limit) call add('temperature', 'temperatures: nocdyn response')
    end associate

  contains

    subroutine add(what, whose)
      character(len=*), intent(in) :: what, whose
      type(verdict_line_t) :: line

      call start_line(input, analysis, number, of_half_range, line)
      line%criterion = in_words(analysis%columns%signals(analysis%limits(number)%quantity)%symbol) // ', ' // what
      if (what /= 'transient') line%criterion = what
      line%finding = is_not_assessed
      line%reason = whose // trim(merge(' compare with it ', ' compares with it', what == 'transient'))
      call verdict%add(line)
    end subroutine add

  end subroutine add_left_out

  !> Means that leave no strength, and profiles of hours, which only a response adds up.
  subroutine add_damages(input, analysis, verdict)
    type(input_t), intent(in) :: input
    type(measured_orbits_t), intent(in) :: analysis
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    logical :: possible(analysis%branch%count)
    integer :: i, k

    possible = analysis%are_possible()
    if (size(analysis%damages) == 0 .and. size(input%groups_named('fatigue')) > 0) then
      line = new_verdict_line('orbit', 'machine', '', 'damage', '')
      line%finding = is_not_assessed
      line%reason = 'found by harmonic balance only'
      call verdict%add(line)
    end if
    do k = 1, size(analysis%damages)
      associate (one => analysis%damages(k))
        if (any([(analysis%measures(i)%exceeds_strength(k) .and. possible(i), i=1, size(possible))])) then
          line = new_damage_line('orbit', one%kind, one%element, one%name, .true.)
        else if (input%groups(one%group)%has_value('profile_hours')) then
          line = new_damage_line('orbit', one%kind, one%element, one%name, .false.)
          line%finding = is_not_assessed
          line%reason = 'of a profile of speeds: nocdyn response adds it up'
        else
          cycle
        end if
        line%quantity = analysis%columns%signals(one%signal)%name
        call verdict%add(line)
      end associate
    end do
  end subroutine add_damages

  !> Values of the parameter at which no motion is known on which the machine can stay.
  subroutine add_gaps(analysis, verdict)
    type(measured_orbits_t), intent(in) :: analysis
    type(verdict_t), intent(inout) :: verdict
    type(part_t), allocatable :: parts(:)
    real(wp), allocatable :: low(:), high(:)   ! ends of stable parts
    real(wp) :: from, least, to
    integer :: i

    call find_parts(analysis%branch%points(:analysis%branch%count), parts)
    parts = pack(parts, parts%is_stable)
    associate (points => analysis%branch%points, settings => analysis%settings)
      allocate (low(size(parts)), high(size(parts)))
      low(:) = [(min(points(parts(i)%first)%orbit%value, points(parts(i)%last)%orbit%value), i=1, size(parts))]
      high(:) = [(max(points(parts(i)%first)%orbit%value, points(parts(i)%last)%orbit%value), i=1, size(parts))]
      from = min(settings%from, settings%to)
      to = max(settings%from, settings%to)
    end associate
    least = narrow * (to - from)
    do while (from < to - least)
      do while (any(low <= from + least .and. high > from))
        from = maxval(high, mask=low <= from + least)
      end do
      if (from >= to - least) return
      call add([from, min(to, minval(low, mask=low > from))])
      from = min(to, minval(low, mask=low > from))
    end do

  contains

    subroutine add(ends)
      real(wp), intent(in) :: ends(2)
      type(verdict_line_t) :: line

      line = new_verdict_line('orbit', 'machine', '', 'stable periodic motion', '')
      line%finding = is_not_assessed
      line%reason = 'no motion that was found is stable there'
      call stand_at(analysis, ends, line)
      call verdict%add(line)
    end subroutine add

  end subroutine add_gaps

end module nocdyn_orbit_verdict
