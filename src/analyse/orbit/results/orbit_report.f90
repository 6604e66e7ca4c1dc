!> The results of a branch of periodic motions: for orbit.json and as orbit.csv.
module nocdyn_orbit_report
  use nocdyn_column_names, only: with_unit
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_analysis, only: orbit_analysis_t
  use nocdyn_orbit_parts, only: find_parts, part_t
  use nocdyn_orbit_points, only: branch_point, doubling, fold, neimark_sacker, torque_fold
  use nocdyn_orbit_problem, only: orbit_point_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units, turn_units
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: append, string_t, strings, to_text
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: put_orbit, put_orbit_csv

  integer, parameter :: most_multipliers = 6   ! in the files
  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]

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
    call put_couplings(json, analysis)
    if (analysis%settings%mode > 0) call put_backbone(json, analysis)
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

  !> The describing functions of the couplings whose stiffness changes along the branches, at each point.
  subroutine put_couplings(json, analysis)
    type(json_t), intent(inout) :: json
    type(orbit_analysis_t), intent(in) :: analysis
    integer :: i

    call json%open_list('couplings')
    do i = 1, size(analysis%couplings%names)
      if (.not. analysis%couplings%changes(i)) cycle
      associate (equivalents => analysis%couplings%equivalents(i, :))
        call json%open()
        call json%put('coupling', analysis%couplings%names(i)%text)
        call json%put('twist', equivalents%twist)
        call json%put('equivalent_stiffness', equivalents%stiffness)
        call json%put('equivalent_damping', equivalents%damping)
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_couplings

  !> The frequencies of a mode over its amplitude.
  subroutine put_backbone(json, analysis)
    type(json_t), intent(inout) :: json
    type(orbit_analysis_t), intent(in) :: analysis

    associate (orbits => analysis%branch%points(:analysis%branch%count)%orbit)
      call json%open('backbone')
      call json%put('mode', analysis%settings%mode)
      call json%put('linear_frequency_hz', analysis%backbone%linear_rate / turn)
      if (.not. analysis%settings%is_over_energy) call json%put('amplitude', orbits%value)
      call json%put('energy', analysis%backbone%energy)
      call json%put('frequency_hz', orbits%rate / turn)
      call json%put('quasi_linear_frequency_hz', analysis%backbone%quasi_linear_rate / turn)
      call json%put('largest_damping', maxval(abs(orbits%damping)))
      call json%close()
    end associate
  end subroutine put_backbone

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
    if (analysis%settings%mode > 0) labels = [labels, strings([character(len=27) :: 'frequency [Hz]', &
                                                              'quasi_linear_frequency [Hz]'])]
    if (analysis%settings%mode > 0 .and. .not. analysis%settings%is_over_energy) call append(labels, 'energy [J]')
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
        if (analysis%settings%mode > 0) then
          row = [row, point%orbit%rate / turn, analysis%backbone%quasi_linear_rate(i) / turn]
          if (.not. analysis%settings%is_over_energy) row = [row, analysis%backbone%energy(i)]
        end if
        if (analysis%settings%has_stability) row = [row, merge(1.0_wp, 0.0_wp, point%is_stable())]
        if (analysis%body_name /= '') row = [row, point%orbit%torque]
        row = [row, (real(point%multipliers(k), wp), aimag(point%multipliers(k)), k=1, shown)]
        row = [row, (from_si(analysis%ranges(k, i)%half_range, unit(k)), from_si(analysis%ranges(k, i)%largest, unit(k)), &
                     from_si(analysis%ranges(k, i)%mean, unit(k)), k=1, size(signals))]
      end associate
      call write_row(file, row)
    end do
  end subroutine put_orbit_csv

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

end module nocdyn_orbit_report
