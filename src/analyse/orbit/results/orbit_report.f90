!> The report of an orbit analysis, orbit.json.
module nocdyn_orbit_report
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_measures, only: measured_orbits_t, orbit_measure_t
  use nocdyn_orbit_parts, only: find_parts, part_t
  use nocdyn_orbit_problem, only: hopf, orbit_point_t
  use nocdyn_orbit_tables, only: most_multipliers
  use nocdyn_report_openings, only: open_analysis_report
  use nocdyn_text, only: to_text
  use nocdyn_verdicts, only: verdict_t
  implicit none (type, external)
  private

  public :: motion_name, put_orbit

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]

contains

  !> Fills orbit.json.
  subroutine put_orbit(json, input, analysis, verdict)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(measured_orbits_t), intent(in) :: analysis
    type(verdict_t), intent(in) :: verdict
    type(part_t), allocatable :: parts(:)
    integer :: i

    call open_analysis_report(json, input)
    call verdict%put(json)
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
    call put_damages(json, analysis)
    call put_motions(json, analysis)
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

  !> A special point, with its multipliers and the stable motions on which a jump from it can end.
  subroutine put_point(json, analysis, number)
    type(json_t), intent(inout) :: json
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the point
    integer :: k

    associate (point => analysis%branch%points(number))
      call json%open()
      call json%put('branch', point%branch)
      call json%put('kind', point%kind)
      call json%put('value', point%orbit%value)
      call json%put('point', number)
      if (point%kind == hopf) then
        call json%put('frequency_hz', point%orbit%rate / turn)
        if (point%leads_to > 0) call json%put('supercritical', point%is_supercritical)
      end if
      if (point%orbit%subharmonic > 1) call json%put('subharmonic', point%orbit%subharmonic)
      if (point%leads_to > 0) call json%put('leads_to', point%leads_to)
      call put_orbit_of(json, point)
      if (any(analysis%jump == number)) then
        call json%open_list('lands_on')
        do k = 1, size(analysis%jump)
          if (analysis%jump(k) /= number) cycle
          call json%open()
          call json%put('branch', analysis%landings(k)%point%branch)
          call put_ranges(json, analysis, analysis%landings(k)%measure)
          call json%close()
        end do
        call json%close_list()
        call put_ranges(json, analysis, analysis%measures(number))
      end if
      call json%close()
    end associate
  end subroutine put_point

  !> The describing functions of the couplings whose stiffness changes along the branches, at each point.
  subroutine put_couplings(json, analysis)
    type(json_t), intent(inout) :: json
    type(measured_orbits_t), intent(in) :: analysis
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
    type(measured_orbits_t), intent(in) :: analysis

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

  !> Period, multipliers and error.
  subroutine put_orbit_of(json, point)
    type(json_t), intent(inout) :: json
    type(orbit_point_t), intent(in) :: point

    call json%put('period', turn / point%orbit%rate)
    associate (shown => point%multipliers(:min(most_multipliers, size(point%multipliers))))
      call json%put('multipliers_real', real(shown, wp))
      call json%put('multipliers_imaginary', aimag(shown))
    end associate
    call json%put('error', point%error)
  end subroutine put_orbit_of

  !> Half ranges of all signals.
  subroutine put_ranges(json, analysis, measure)
    type(json_t), intent(inout) :: json
    type(measured_orbits_t), intent(in) :: analysis
    type(orbit_measure_t), intent(in) :: measure
    integer :: i

    call json%open('half_ranges')
    do i = 1, size(analysis%signals)
      call json%put(analysis%signals(i)%name, measure%ranges(i)%half_range)
    end do
    call json%close()
  end subroutine put_ranges

  !> The largest half range of each signal.
  subroutine put_peaks(json, analysis)
    type(json_t), intent(inout) :: json
    type(measured_orbits_t), intent(in) :: analysis
    integer :: at, i

    call json%open_list('peaks')
    do i = 1, size(analysis%signals)
      at = analysis%peak(i)
      call json%open()
      call json%put('quantity', analysis%signals(i)%name)
      call json%put('unit', analysis%signals(i)%unit)
      associate (range => analysis%measures(at)%ranges(i))
        call json%put('half_range', range%half_range)
        call json%put('largest', range%largest)
        call json%put('mean', range%mean)
      end associate
      call json%put('value', analysis%branch%points(at)%orbit%value)
      if (analysis%settings%has_stability) call json%put('stable', analysis%branch%points(at)%is_stable())
      call json%close()
    end do
    call json%close_list()
  end subroutine put_peaks

  !> The largest damage per hour by each &fatigue, of motions on which the machine can stay.
  subroutine put_damages(json, analysis)
    type(json_t), intent(inout) :: json
    type(measured_orbits_t), intent(in) :: analysis
    integer :: at, i

    if (size(analysis%damages) == 0) return
    call json%open_list('fatigue')
    do i = 1, size(analysis%damages)
      call json%open()
      call json%put('name', analysis%damages(i)%name)
      call json%put('element', analysis%damages(i)%element)
      at = analysis%worst_damage(i)
      if (at > 0) then
        call json%put('largest_damage_per_hour', analysis%measures(at)%damage(i))
        call json%put('value', analysis%branch%points(at)%orbit%value)
        call json%put('mean_exceeds_strength', analysis%measures(at)%exceeds_strength(i))
      end if
      call json%close()
    end do
    call json%close_list()
  end subroutine put_damages

  !> The motions that the input asks for, and their files.
  subroutine put_motions(json, analysis)
    type(json_t), intent(inout) :: json
    type(measured_orbits_t), intent(in) :: analysis
    integer :: i

    if (size(analysis%settings%motions) == 0) return
    call json%open_list('motions')
    do i = 1, size(analysis%motions)
      associate (point => analysis%motions(i)%point)
        call json%open()
        call json%put('motion', i)
        call json%put('file', motion_name(i))
        call json%put('branch', point%branch)
        call json%put('value', point%orbit%value)
        if (analysis%settings%has_stability) call json%put('stable', point%is_stable())
        if (analysis%body_name /= '') call json%put('torque', point%orbit%torque)
        call json%put('harmonics', point%harmonics)
        call put_orbit_of(json, point)
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_motions

  !> The file of a motion.
  pure function motion_name(number) result(name)
    integer, intent(in) :: number
    character(len=:), allocatable :: name

    name = 'motion_' // to_text(number) // '.csv'
  end function motion_name

end module nocdyn_orbit_report
