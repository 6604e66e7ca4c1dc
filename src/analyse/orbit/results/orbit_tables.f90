!> The tables of an orbit analysis: orbit.csv with a row for each point, chosen motions over their periods, harmonics, and what
!> the columns are.
module nocdyn_orbit_tables
  use nocdyn_column_lists, only: column_list_t
  use nocdyn_column_names, only: with_unit
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_measures, only: measured_motion_t, measured_orbits_t
  use nocdyn_orbit_problem, only: branch_point, doubling, fold, hopf, neimark_sacker, orbit_point_t, torque_fold
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: turn_units
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: append, string_t, strings, to_text
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: orbit_columns_json, put_harmonics_csv, put_motion_csv, put_motion_harmonics_csv, put_orbit_csv

  character(len=*), parameter, public :: orbit_table = 'orbit.csv'
  character(len=*), parameter :: statistics(*) = [character(len=10) :: 'half_range', 'largest', 'mean']
  integer, parameter, public :: most_multipliers = 6   !! in the files
  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
  real(wp), parameter :: degree = turn / 360.0_wp      ! [rad]

contains

  !> The text of the file that says what the columns of orbit.csv are that belong to signals.
  function orbit_columns_json(analysis, wanted) result(text)
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! indices of `units`
    character(len=:), allocatable :: text
    type(column_list_t) :: list
    type(json_t) :: json

    call list_columns(analysis, wanted, list)
    call json%open()
    call json%open_list('columns')
    call list%put(json)
    call json%close_list()
    call json%close()
    text = json%text()
  end function orbit_columns_json

  subroutine list_columns(analysis, wanted, list)
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)
    type(column_list_t), intent(inout) :: list
    integer :: i, k

    call list%start(orbit_table, wanted)
    do k = 1, size(analysis%signals)
      do i = 1, size(statistics)
        call list%add(analysis%signals(k), trim(statistics(i)))
      end do
    end do
    do k = 1, size(analysis%damages)
      call list%add_named('damage_per_hour', '1/h', 'damage per hour', 'fatigue', analysis%damages(k)%name)
    end do
  end subroutine list_columns

  !> Writes orbit.csv, in the order of the branches.
  subroutine put_orbit_csv(analysis, wanted, file)
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! indices of `units`
    type(output_file_t), intent(inout) :: file
    type(string_t), allocatable :: labels(:), of_signals(:)
    type(column_list_t) :: list
    integer, allocatable :: unit(:)
    real(wp), allocatable :: measured(:), row(:)
    integer :: i, k, shown

    call list_columns(analysis, wanted, list)
    call list%list_columns(of_signals, unit)
    shown = min(most_multipliers, minval([(size(analysis%branch%points(i)%multipliers), i=1, analysis%branch%count)]))
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
    call write_header(file, [labels, of_signals])
    do i = 1, analysis%branch%count
      associate (point => analysis%branch%points(i), ranges => analysis%measures(i)%ranges(:size(analysis%signals)))
        row = [real(point%branch, wp), point%orbit%value, point%orbit%rate, number_of(point), real(point%harmonics, wp), &
               point%error]
        if (analysis%settings%mode > 0) then
          row = [row, point%orbit%rate / turn, analysis%backbone%quasi_linear_rate(i) / turn]
          if (.not. analysis%settings%is_over_energy) row = [row, analysis%backbone%energy(i)]
        end if
        if (analysis%settings%has_stability) row = [row, merge(1.0_wp, 0.0_wp, point%is_stable())]
        if (analysis%body_name /= '') row = [row, point%orbit%torque]
        row = [row, (real(point%multipliers(k), wp), aimag(point%multipliers(k)), k=1, shown)]
        measured = [(ranges(k)%half_range, ranges(k)%largest, ranges(k)%mean, k=1, size(ranges)), analysis%measures(i)%damage]
      end associate
      call write_row(file, [row, from_si(measured, unit)])
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
    case (hopf)
      number_of = 6.0_wp
    case default
      number_of = 0.0_wp
    end select
  end function number_of

  !> Writes orbit_harmonics.csv: the amplitudes of all harmonics at all points.
  subroutine put_harmonics_csv(analysis, wanted, file)
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! indices of `units`
    type(output_file_t), intent(inout) :: file
    type(signal_t), allocatable :: signals(:)
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: unit(:)
    integer :: h, i, k

    allocate (signals, source=analysis%signals)
    call turn_units(signals, wanted, unit)
    labels = strings([character(len=17) :: 'point', 'branch', 'harmonic', 'frequency [rad/s]'])
    do k = 1, size(signals)
      call append(labels, with_unit(signals(k)%name, signals(k)%unit))
    end do
    call write_header(file, labels)
    do i = 1, analysis%branch%count
      associate (point => analysis%branch%points(i), amplitude => analysis%measures(i)%amplitude)
        do h = 1, size(amplitude, 1)
          call write_row(file, [real([i, point%branch, h], wp), h * point%orbit%rate, from_si(amplitude(h, :), unit)])
        end do
      end associate
    end do
  end subroutine put_harmonics_csv

  !> Writes the motion over one period, with the columns of a trajectory; angles turn with their mean rotation.
  subroutine put_motion_csv(analysis, motion, wanted, file)
    type(measured_orbits_t), intent(in) :: analysis
    type(measured_motion_t), intent(in) :: motion
    integer, intent(in) :: wanted(:)   !! indices of `units`
    type(output_file_t), intent(inout) :: file
    type(signal_t), allocatable :: signals(:)
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: unit(:)
    real(wp) :: row(size(analysis%signals)), time
    integer :: i, k, largest, n

    allocate (signals, source=analysis%signals)
    call turn_units(signals, wanted, unit)
    labels = [string_t('t [s]')]
    do k = 1, size(signals)
      call append(labels, with_unit(signals(k)%name, signals(k)%unit))
    end do
    call write_header(file, labels)
    associate (samples => motion%samples, first => analysis%columns%first)
      n = size(samples%t)
      do i = 0, n
        time = turn / motion%point%orbit%rate * i / n
        do k = 1, size(row)
          associate (values => samples%values(modulo(i, n) + 1, first(k):first(k + 1) - 1))
            largest = maxloc(abs(values), dim=1)
            row(k) = values(largest) + samples%rotation(first(k)) * time
          end associate
        end do
        call write_row(file, [time, from_si(row, unit)])
      end do
    end associate
  end subroutine put_motion_csv

  !> Writes motion_harmonics.csv: mean, amplitudes and phases of all signals; a signal is the sum of amplitude cos(frequency t +
  !> phase), its mean the harmonic 0.
  subroutine put_motion_harmonics_csv(analysis, wanted, file)
    type(measured_orbits_t), intent(in) :: analysis
    integer, intent(in) :: wanted(:)   !! indices of `units`
    type(output_file_t), intent(inout) :: file
    type(signal_t), allocatable :: signals(:)
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: unit(:)
    real(wp) :: row(2 * size(analysis%signals))
    integer :: column, h, i, k

    allocate (signals, source=analysis%signals)
    call turn_units(signals, wanted, unit)
    labels = strings([character(len=17) :: 'motion', 'harmonic', 'frequency [rad/s]'])
    do k = 1, size(signals)
      call append(labels, with_unit('amplitude_' // signals(k)%name, signals(k)%unit))
      call append(labels, 'phase_' // signals(k)%name // ' [deg]')
    end do
    call write_header(file, labels)
    do i = 1, size(analysis%motions)
      associate (samples => analysis%motions(i)%samples, point => analysis%motions(i)%point)
        do h = 0, samples%harmonics
          do k = 1, size(signals)
            column = analysis%columns%widest(k, samples)
            row(2 * k - 1) = samples%series(1, column)
            row(2 * k) = 0.0_wp
            if (h > 0) then
              row(2 * k - 1) = samples%amplitude(column, h)
              row(2 * k) = phase(samples%series(2 * h:2 * h + 1, column))
            end if
            row(2 * k - 1) = from_si(row(2 * k - 1), unit(k))
          end do
          call write_row(file, [real([i, h], wp), h * point%orbit%rate, row])
        end do
      end associate
    end do
  end subroutine put_motion_harmonics_csv

  !> The lead before cos(frequency t) [deg].
  pure real(wp) function phase(pair)
    real(wp), intent(in) :: pair(2)   !! coefficients of cosine and sine

    phase = 0.0_wp
    if (maxval(abs(pair)) > 0) phase = atan2(-pair(2), pair(1)) / degree
  end function phase

end module nocdyn_orbit_tables
