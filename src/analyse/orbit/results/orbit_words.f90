!> A branch of periodic motions as printed: special points in words, unstable ranges, the largest half ranges.
module nocdyn_orbit_words
  use nocdyn_column_names, only: with_unit
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_backbone_words, only: append_backbone
  use nocdyn_orbit_measures, only: measured_orbits_t
  use nocdyn_orbit_parts, only: jump_direction, part_t, unstable_stretches
  use nocdyn_orbit_problem, only: branch_point, doubling, fold, hopf, neimark_sacker, torque_fold
  use nocdyn_orbit_problem, only: orbit_point_t
  use nocdyn_quantities, only: rank_moment
  use nocdyn_report_openings, only: append_notes
  use nocdyn_table_text, only: cell, padded, text_width
  use nocdyn_text, only: counted, quoted, rounded_text, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_written_values, only: speed_text
  implicit none (type, external)
  private

  public :: orbit_text

  integer, parameter :: most_peaks = 12        ! lines of largest half ranges
  integer, parameter :: digits = 6             ! of printed numbers
  integer, parameter :: exact = 10             ! of special values
  integer, parameter :: damage_digits = 4
  real(wp), parameter :: rounding = 1.0e-12_wp ! of a mean, as a share of the half range

contains

  !> The printed report.
  function orbit_text(input, analysis) result(text)
    type(input_t), intent(in) :: input
    type(measured_orbits_t), intent(in) :: analysis
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    integer :: i

    call append_notes(report, input%shown_case(), analysis%notes)
    associate (points => analysis%branch%points(:analysis%branch%count))
      text = counted(size(points), 'periodic motion', 'periodic motions')
      if (analysis%is_self_excited) text = counted(size(points), 'steady state or limit cycle', 'steady states and limit cycles')
      text = input%shown_case() // ': ' // text // ' over ' // &
             analysis%parameter // ' from ' // shown(analysis, analysis%settings%from) // ' to ' // &
             shown(analysis, analysis%settings%to) // ', ' // method_of(points)
      call report%append_line(text // ', largest error ' // rounded_text(maxval(points%error), 2) // ' of the motion')
      if (maxval(points%error) > analysis%settings%tolerance) then
        i = count(points%error > analysis%settings%tolerance)
        call report%append_line('  ' // counted(i, 'point has', 'points have') // ' an error above the tolerance, ' // &
                                rounded_text(analysis%settings%tolerance, 2))
      end if
      if (analysis%branch%ending /= '') call report%append_line('  the branch ends ' // analysis%branch%ending)
      if (analysis%settings%starts > 0) call append_starts(analysis, points, report)
      call append_jumps(analysis, points, report)
      if (analysis%settings%mode > 0) then
        call append_backbone(analysis%orbit_analysis_t, report)
      else
        call append_parts(analysis, points, report)
      end if
    end associate
    call append_peaks(analysis, report)
    call append_damages(analysis, report)
    text = report%text()
  end function orbit_text

  !> How the points were found: 'by shooting', or '5 to 9 harmonics'.
  function method_of(points) result(text)
    type(orbit_point_t), intent(in) :: points(:)
    character(len=:), allocatable :: text

    text = 'by shooting'
    if (maxval(points%harmonics) == 0) return
    text = to_text(minval(points%harmonics))
    if (maxval(points%harmonics) > minval(points%harmonics)) text = text // ' to ' // to_text(maxval(points%harmonics))
    text = text // ' harmonics'
  end function method_of

  !> A value of the parameter with its unit; a speed also in the unit of the input.
  function shown(analysis, value, figures) result(text)
    type(measured_orbits_t), intent(in) :: analysis
    real(wp), intent(in) :: value
    integer, intent(in), optional :: figures
    character(len=:), allocatable :: text
    integer :: all_figures

    all_figures = digits
    if (present(figures)) all_figures = figures
    text = rounded_text(value, all_figures)
    if (analysis%unit /= '') text = text // ' ' // analysis%unit
    if (analysis%settings%speed_unit > 0) text = text // ' (' // &
      speed_text(value, analysis%settings%speed_unit, all_figures) // ')'
  end function shown

  !> What scattered starts have found.
  subroutine append_starts(analysis, points, report)
    type(measured_orbits_t), intent(in) :: analysis
    type(orbit_point_t), intent(in) :: points(:)
    type(text_buffer_t), intent(inout) :: report
    integer :: k

    associate (found => analysis%found)
      call report%append_line('  ' // counted(found%tried, 'scattered start', 'scattered starts') // ', ' // &
                              to_text(found%periodic) // ' led to periodic motions, ' // &
                              counted(found%branches, 'isolated branch', 'isolated branches'))
      do k = 2, found%branches + 1
        call report%append_line('  branch ' // to_text(k) // ' is isolated: from ' // &
          shown(analysis, minval(points%orbit%value, mask=points%branch == k), exact) // ' to ' // &
          shown(analysis, maxval(points%orbit%value, mask=points%branch == k), exact))
      end do
    end associate
  end subroutine append_starts

  !> Special points, one a line: what a slow change of the parameter meets there.
  subroutine append_jumps(analysis, points, report)
    type(measured_orbits_t), intent(in) :: analysis
    type(orbit_point_t), intent(in) :: points(:)
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: words
    integer :: i

    do i = 2, size(points) - 1
      select case (points(i)%kind)
      case (fold)
        words = 'fold'
        if (analysis%settings%has_stability) words = 'fold; the motions on both sides of it are unstable'
        if (jump_direction(points, i) > 0) words = 'fold; a rising value jumps there'
        if (jump_direction(points, i) < 0) words = 'fold; a falling value jumps there'
        if (analysis%body_name /= '') words = 'fold; the mean speed turns back there'
        words = words // landing_words(analysis, i)
      case (torque_fold)
        words = 'the holding torque turns back there'
      case (doubling)
        words = 'period doubling; a motion of twice the period branches off' // led_to(points(i))
      case (neimark_sacker)
        words = 'Neimark-Sacker point; oscillations of another frequency begin or end'
      case (branch_point)
        words = 'branch point; another motion of the same period branches off' // led_to(points(i))
      case (hopf)
        words = 'Hopf point, ' // rounded_text(points(i)%orbit%rate / (2 * acos(-1.0_wp)), digits) // ' Hz'
        if (points(i)%leads_to > 0) words = words // trim(merge(', supercritical', ', subcritical  ', &
                                                                points(i)%is_supercritical))
        words = words // '; limit cycles branch off' // led_to(points(i))
      case default
        cycle
      end select
      if (points(i)%branch > 1) words = words // ' (branch ' // to_text(points(i)%branch) // ')'
      call report%append_line('  at ' // shown(analysis, points(i)%orbit%value, exact) // ': ' // words)
    end do
  end subroutine append_jumps

  !> What a jump does to the half range of the first signal that is told; '' if there is no jump, or nowhere to end.
  function landing_words(analysis, number) result(words)
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the point
    character(len=:), allocatable :: words
    integer :: i
    integer, allocatable :: told(:)

    words = ''
    allocate (told, source=told_signals(analysis))
    if (.not. any(analysis%jump == number) .or. size(told) == 0) return
    associate (signal => analysis%signals(told(1)))
      words = ', half range of ' // signal%name // ' from ' // &
              rounded_text(analysis%measures(number)%ranges(told(1))%half_range, digits)
      do i = 1, size(analysis%jump)
        if (analysis%jump(i) /= number) cycle
        words = words // ' to ' // rounded_text(analysis%landings(i)%measure%ranges(told(1))%half_range, digits)
        if (any(analysis%jump(i + 1:) == number)) words = words // ' or'
      end do
      if (signal%unit /= '') words = words // ' ' // signal%unit
    end associate
  end function landing_words

  !> The branch that begins at a special point, if it is known.
  function led_to(point) result(words)
    type(orbit_point_t), intent(in) :: point
    character(len=:), allocatable :: words

    words = ''
    if (point%leads_to > 0) words = ': branch ' // to_text(point%leads_to)
  end function led_to

  !> The ranges in which the motion is unstable.
  subroutine append_parts(analysis, points, report)
    type(measured_orbits_t), intent(in) :: analysis
    type(orbit_point_t), intent(in) :: points(:)
    type(text_buffer_t), intent(inout) :: report
    type(part_t), allocatable :: stretches(:)
    character(len=:), allocatable :: line
    real(wp) :: ends(2)
    integer :: i

    if (.not. analysis%settings%has_stability) then
      call report%append_line('  the stability is not determined; stability = .true. in &orbit does so')
      return
    end if
    call unstable_stretches(points, stretches)
    if (analysis%body_name /= '') call report%append_line('  stability with a constant holding torque:')
    if (size(stretches) == 0) call report%append_line('  all motions are stable')
    do i = 1, size(stretches)
      associate (along => points(stretches(i)%first:stretches(i)%last)%orbit%value)
        ends = [minval(along), maxval(along)]
        if (along(size(along)) < along(1)) ends = [maxval(along), minval(along)]
        line = '  unstable from '
        if (analysis%is_self_excited .and. points(stretches(i)%first)%branch == 1) line = '  steady state unstable from '
        line = line // shown(analysis, ends(1), exact) // ' to ' // shown(analysis, ends(2), exact)
      end associate
      associate (branch => points(stretches(i)%first)%branch)
        if (branch > 1) line = line // ' (branch ' // to_text(branch) // ')'
      end associate
      call report%append_line(line)
    end do
  end subroutine append_parts

  !> The signals whose half ranges are told: the moments, or all if there are none.
  pure function told_signals(analysis) result(told)
    type(measured_orbits_t), intent(in) :: analysis
    integer, allocatable :: told(:)
    integer :: i

    told = pack([(i, i=1, size(analysis%signals))], analysis%signals%rank == rank_moment .and. &
                .not. analysis%signals%is_inner())
    if (size(told) == 0) told = [(i, i=1, size(analysis%signals))]
    told = told(:min(size(told), most_peaks))
  end function told_signals

  !> The largest half ranges.
  subroutine append_peaks(analysis, report)
    type(measured_orbits_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    integer, allocatable :: told(:)
    integer :: at, i, width

    allocate (told, source=told_signals(analysis))
    width = 0
    do i = 1, size(told)
      width = max(width, text_width(with_unit(analysis%signals(told(i))%name, analysis%signals(told(i))%unit)))
    end do
    call report%append_line('  ' // padded('', width) // cell('half range') // cell('mean') // cell('at') // &
                            '  (largest half range)')
    do i = 1, size(told)
      at = analysis%peak(told(i))
      associate (signal => analysis%signals(told(i)), point => analysis%branch%points(at), &
                 range => analysis%measures(at)%ranges(told(i)))
        call report%append_line('  ' // padded(with_unit(signal%name, signal%unit), width) // &
          cell(range%half_range) // &
          cell(merge(range%mean, 0.0_wp, abs(range%mean) > rounding * range%half_range)) // &
          cell(rounded_text(point%orbit%value, digits)) // trim(merge('            ', '  (unstable)', point%is_stable())))
      end associate
    end do
  end subroutine append_peaks

  !> The largest damages of motions on which the machine can stay.
  subroutine append_damages(analysis, report)
    type(measured_orbits_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    integer :: at, i

    do i = 1, size(analysis%damages)
      at = analysis%worst_damage(i)
      if (at == 0) cycle
      call report%append_line('  fatigue ' // quoted(analysis%damages(i)%name) // ': damage up to ' // &
                              rounded_text(analysis%measures(at)%damage(i), damage_digits) // ' per hour, at ' // &
                              shown(analysis, analysis%branch%points(at)%orbit%value))
    end do
  end subroutine append_damages

end module nocdyn_orbit_words
