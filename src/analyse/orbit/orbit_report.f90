!> The results of a branch of periodic motions: for orbit.json, as orbit.csv, and as printed.
module nocdyn_orbit_report
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_analysis, only: orbit_analysis_t
  use nocdyn_orbit_points, only: branch_point, doubling, fold, neimark_sacker, orbit_point_t, torque_fold
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units, turn_units
  use nocdyn_quantities, only: rank_moment
  use nocdyn_signals, only: signal_t
  use nocdyn_table_text, only: cell, padded, text_width
  use nocdyn_text, only: append, counted, rounded_text, string_t, strings, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: put_orbit, put_orbit_csv, orbit_text

  integer, parameter :: most_multipliers = 6   ! in the files
  integer, parameter :: most_peaks = 12        ! in the printed report
  integer, parameter :: digits = 6             ! of printed numbers
  integer, parameter :: exact = 10             ! of special values

  !> A part of the branch without a change of its stability, nor of its direction.
  type :: part_t
    integer :: first = 1, last = 1   !! points
    logical :: is_stable = .true.
  end type part_t

contains

  !> Fills orbit.json.
  subroutine put_orbit(json, input, analysis)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(orbit_analysis_t), intent(in) :: analysis
    type(part_t), allocatable :: parts(:)
    integer :: i

    call json%open_report(input%file, input%title())
    if (allocated(input%load_case)) call json%put('load_case', input%load_case%name)
    call json%put('parameter', analysis%parameter)
    call json%put('unit', analysis%unit)
    call json%put('range', [analysis%settings%from, analysis%settings%to])
    call json%put('subharmonic', analysis%settings%subharmonic)
    associate (points => analysis%branch%points(:analysis%branch%count))
      call json%put('points', size(points))
      call json%put('harmonics', [minval(points%harmonics), maxval(points%harmonics)])
      call json%put('largest_error', maxval(points%error))
      call json%put('tolerance', analysis%settings%tolerance)
      if (analysis%branch%ending /= '') call json%put('ends', analysis%branch%ending)
      call json%open_list('special_points')
      do i = 1, size(points)
        if (points(i)%kind /= '') call put_point(json, analysis, i)
      end do
      call json%close_list()
      call find_parts(points, parts)
      call json%open_list('parts')
      do i = 1, size(parts)
        call json%open()
        call json%put('branch', points(parts(i)%first)%branch)
        call json%put('from', points(parts(i)%first)%orbit%value)
        call json%put('to', points(parts(i)%last)%orbit%value)
        if (analysis%settings%has_stability) call json%put('stable', parts(i)%is_stable)
        call json%close()
      end do
      call json%close_list()
    end associate
    call put_peaks(json, analysis)
    if (analysis%settings%starts > 0) then
      call json%open('starts')
      call json%put('tried', analysis%found%tried)
      call json%put('periodic', analysis%found%periodic)
      call json%put('isolated_branches', analysis%found%branches)
      call json%close()
    end if
    call json%put('notes', analysis%notes)
    call json%close()
  end subroutine put_orbit

  !> A special point, with its multipliers.
  subroutine put_point(json, analysis, number)
    type(json_t), intent(inout) :: json
    type(orbit_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the point

    associate (point => analysis%branch%points(number))
      call json%open()
      call json%put('branch', point%branch)
      call json%put('kind', point%kind)
      call json%put('value', point%orbit%value)
      call json%put('point', number)
      call json%put('period', 2 * acos(-1.0_wp) / point%orbit%rate)
      associate (shown => point%multipliers(:min(most_multipliers, size(point%multipliers))))
        call json%put('multipliers_real', real(shown, wp))
        call json%put('multipliers_imaginary', aimag(shown))
      end associate
      call json%put('error', point%error)
      call json%close()
    end associate
  end subroutine put_point

  !> The largest half range of each signal.
  subroutine put_peaks(json, analysis)
    type(json_t), intent(inout) :: json
    type(orbit_analysis_t), intent(in) :: analysis
    integer :: at, i

    call json%open_list('peaks')
    do i = 1, size(analysis%signals)
      at = maxloc(analysis%ranges(i, :)%half_range, dim=1)
      call json%open()
      call json%put('quantity', analysis%signals(i)%name)
      call json%put('unit', analysis%signals(i)%unit)
      call json%put('half_range', analysis%ranges(i, at)%half_range)
      call json%put('largest', analysis%ranges(i, at)%largest)
      call json%put('mean', analysis%ranges(i, at)%mean)
      call json%put('value', analysis%branch%points(at)%orbit%value)
      if (analysis%settings%has_stability) call json%put('stable', analysis%branch%points(at)%is_stable())
      call json%close()
    end do
    call json%close_list()
  end subroutine put_peaks

  !> Writes orbit.csv: a row for each point, in the order of the branch.
  subroutine put_orbit_csv(input, analysis, file)
    type(input_t), intent(in) :: input
    type(orbit_analysis_t), intent(in) :: analysis
    type(output_file_t), intent(inout) :: file
    type(string_t), allocatable :: labels(:)
    type(signal_t), allocatable :: signals(:)
    integer, allocatable :: unit(:)
    real(wp), allocatable :: row(:)
    integer :: i, k, shown

    allocate (signals, source=analysis%signals)
    call turn_units(signals, output_units(input), unit)
    shown = min(most_multipliers, size(analysis%branch%points(1)%multipliers))
    labels = [string_t('branch')]
    call append(labels, with_unit(analysis%parameter, analysis%unit))
    labels = [labels, strings([character(len=12) :: 'rate [rad/s]', 'special', 'harmonics', 'error'])]
    if (analysis%settings%has_stability) call append(labels, 'stable')
    if (analysis%body_name /= '') call append(labels, 'torque_' // analysis%body_name // ' [N m]')
    do k = 1, shown
      call append(labels, 'multiplier_' // to_text(k) // '_real')
      call append(labels, 'multiplier_' // to_text(k) // '_imaginary')
    end do
    do k = 1, size(signals)
      call append(labels, with_unit('half_range_' // signals(k)%name, signals(k)%unit))
      call append(labels, with_unit('largest_' // signals(k)%name, signals(k)%unit))
      call append(labels, with_unit('mean_' // signals(k)%name, signals(k)%unit))
    end do
    call write_header(file, labels)
    do i = 1, analysis%branch%count
      associate (point => analysis%branch%points(i))
        row = [real(point%branch, wp), point%orbit%value, point%orbit%rate, number_of(point), real(point%harmonics, wp), &
               point%error]
        if (analysis%settings%has_stability) row = [row, merge(1.0_wp, 0.0_wp, point%is_stable())]
        if (analysis%body_name /= '') row = [row, point%orbit%torque]
        row = [row, (real(point%multipliers(k), wp), aimag(point%multipliers(k)), k=1, shown)]
        row = [row, (from_si(analysis%ranges(k, i)%half_range, unit(k)), from_si(analysis%ranges(k, i)%largest, unit(k)), &
                     from_si(analysis%ranges(k, i)%mean, unit(k)), k=1, size(signals))]
      end associate
      call write_row(file, row)
    end do
  end subroutine put_orbit_csv

  pure function with_unit(name, unit) result(label)
    character(len=*), intent(in) :: name, unit
    character(len=:), allocatable :: label

    label = name
    if (unit /= '') label = name // ' [' // unit // ']'
  end function with_unit

  !> What `special` says in orbit.csv: 0, or the kind of a special point in their order in the pages.
  pure real(wp) function number_of(point)
    type(orbit_point_t), intent(in) :: point

    select case (point%kind)
    case (fold)
      number_of = 1.0_wp
    case (doubling)
      number_of = 2.0_wp
    case (neimark_sacker)
      number_of = 3.0_wp
    case (branch_point)
      number_of = 4.0_wp
    case (torque_fold)
      number_of = 5.0_wp
    case default
      number_of = 0.0_wp
    end select
  end function number_of

  !> The parts of the branch.
  subroutine find_parts(points, parts)
    type(orbit_point_t), intent(in) :: points(:)
    type(part_t), allocatable, intent(out) :: parts(:)
    integer :: i

    allocate (parts(0))
    if (size(points) == 0) return
    parts = [part_t(1, 1, points(1)%is_stable())]
    do i = 2, size(points)
      if (points(i)%branch /= points(i - 1)%branch) then
        parts = [parts, part_t(i, i, points(i)%is_stable())]
        cycle
      end if
      associate (last => parts(size(parts)))
        last%last = i
        if (last%last - last%first == 1 .and. points(last%first)%kind /= '') last%is_stable = points(i)%is_stable()
      end associate
      if (points(i)%kind == '' .or. i == size(points)) cycle
      if (points(i + 1)%branch == points(i)%branch) parts = [parts, part_t(i, i, points(i + 1)%is_stable())]
    end do
  end subroutine find_parts

  !> The printed report.
  function orbit_text(input, analysis) result(text)
    type(input_t), intent(in) :: input
    type(orbit_analysis_t), intent(in) :: analysis
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    integer :: i

    do i = 1, size(analysis%notes)
      call report%append_line(input%shown_case() // ': note: ' // analysis%notes(i)%text)
    end do
    associate (points => analysis%branch%points(:analysis%branch%count))
      text = input%shown_case() // ': ' // counted(size(points), 'periodic motion', 'periodic motions') // ' over ' // &
             analysis%parameter // ' from ' // shown(analysis, analysis%settings%from) // ' to ' // &
             shown(analysis, analysis%settings%to) // ', ' // to_text(minval(points%harmonics))
      if (maxval(points%harmonics) > minval(points%harmonics)) text = text // ' to ' // to_text(maxval(points%harmonics))
      call report%append_line(text // ' harmonics, largest error ' // rounded_text(maxval(points%error), 2) // ' of the motion')
      if (maxval(points%error) > analysis%settings%tolerance) then
        i = count(points%error > analysis%settings%tolerance)
        call report%append_line('  ' // counted(i, 'point has', 'points have') // ' an error above the tolerance, ' // &
                                rounded_text(analysis%settings%tolerance, 2))
      end if
      if (analysis%branch%ending /= '') call report%append_line('  the branch ends ' // analysis%branch%ending)
      if (analysis%settings%starts > 0) call append_starts(analysis, points, report)
      call append_jumps(analysis, points, report)
      call append_parts(analysis, points, report)
    end associate
    call append_peaks(analysis, report)
    text = report%text()
  end function orbit_text

  !> A value of the parameter, with its unit.
  function shown(analysis, value, figures) result(text)
    type(orbit_analysis_t), intent(in) :: analysis
    real(wp), intent(in) :: value
    integer, intent(in), optional :: figures
    character(len=:), allocatable :: text

    text = rounded_text(value, digits)
    if (present(figures)) text = rounded_text(value, figures)
    if (analysis%unit /= '') text = text // ' ' // analysis%unit
  end function shown

  !> What scattered starts have found.
  subroutine append_starts(analysis, points, report)
    type(orbit_analysis_t), intent(in) :: analysis
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
    type(orbit_analysis_t), intent(in) :: analysis
    type(orbit_point_t), intent(in) :: points(:)
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: words
    integer :: i

    do i = 2, size(points) - 1
      select case (points(i)%kind)
      case (fold)
        words = 'fold'
        if (analysis%settings%has_stability) words = 'fold; the motions on both sides of it are unstable'
        if (points(i - 1)%is_stable() .and. points(i - 1)%direction > 0) words = 'fold; a rising value jumps there'
        if (points(i - 1)%is_stable() .and. points(i - 1)%direction < 0) words = 'fold; a falling value jumps there'
        if (points(i + 1)%is_stable() .and. points(i + 1)%direction > 0) words = 'fold; a falling value jumps there'
        if (points(i + 1)%is_stable() .and. points(i + 1)%direction < 0) words = 'fold; a rising value jumps there'
        if (analysis%body_name /= '') words = 'fold; the mean speed turns back there'
      case (torque_fold)
        words = 'the holding torque turns back there'
      case (doubling)
        words = 'period doubling; a motion of twice the period branches off'
      case (neimark_sacker)
        words = 'Neimark-Sacker point; oscillations of another frequency begin or end'
      case (branch_point)
        words = 'branch point; another motion of the same period branches off'
      case default
        cycle
      end select
      if (points(i)%branch > 1) words = words // ' (branch ' // to_text(points(i)%branch) // ')'
      call report%append_line('  at ' // shown(analysis, points(i)%orbit%value, exact) // ': ' // words)
    end do
  end subroutine append_jumps

  !> The ranges in which the motion is unstable.
  subroutine append_parts(analysis, points, report)
    type(orbit_analysis_t), intent(in) :: analysis
    type(orbit_point_t), intent(in) :: points(:)
    type(text_buffer_t), intent(inout) :: report
    type(part_t), allocatable :: parts(:)
    integer :: i

    if (.not. analysis%settings%has_stability) then
      call report%append_line('  the stability is not determined; stability = .true. in &orbit does so')
      return
    end if
    call find_parts(points, parts)
    if (analysis%body_name /= '') call report%append_line('  stability with a constant holding torque:')
    if (all(parts%is_stable)) then
      call report%append_line('  all motions are stable')
      return
    end if
    do i = 1, size(parts)
      if (parts(i)%is_stable) cycle
      call report%append_line('  unstable from ' // shown(analysis, points(parts(i)%first)%orbit%value, exact) // ' to ' // &
                              shown(analysis, points(parts(i)%last)%orbit%value, exact))
    end do
  end subroutine append_parts

  !> The largest half ranges: of the moments, or of all signals if there are none.
  subroutine append_peaks(analysis, report)
    type(orbit_analysis_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    integer, allocatable :: listed(:)
    integer :: at, i, width

    listed = pack([(i, i=1, size(analysis%signals))], analysis%signals%rank == rank_moment .and. &
                  .not. analysis%signals%is_inner())
    if (size(listed) == 0) listed = [(i, i=1, size(analysis%signals))]
    listed = listed(:min(size(listed), most_peaks))
    width = 0
    do i = 1, size(listed)
      width = max(width, text_width(with_unit(analysis%signals(listed(i))%name, analysis%signals(listed(i))%unit)))
    end do
    call report%append_line('  ' // padded('', width) // cell('half range') // cell('mean') // cell('at') // &
                            '  (largest half range)')
    do i = 1, size(listed)
      at = maxloc(analysis%ranges(listed(i), :)%half_range, dim=1)
      associate (signal => analysis%signals(listed(i)), point => analysis%branch%points(at))
        call report%append_line('  ' // padded(with_unit(signal%name, signal%unit), width) // &
          cell(analysis%ranges(listed(i), at)%half_range) // cell(analysis%ranges(listed(i), at)%mean) // &
          cell(rounded_text(point%orbit%value, digits)) // trim(merge('            ', '  (unstable)', point%is_stable())))
      end associate
    end do
  end subroutine append_peaks

end module nocdyn_orbit_report
