!> Reads a machine with Fortran's own namelist read and prints every value of every group, defaults included.
program read_namelists
  use, intrinsic :: iso_fortran_env, only: real64
  implicit none (type, external)

  integer, parameter :: wp = real64
  integer, parameter :: most_bodies = 8       ! in a list
  integer, parameter :: most_numbers = 16     ! in a list
  real(wp), parameter :: not_given = -huge(1.0_wp)
  real(wp), parameter :: hertz = 2.0_wp * acos(-1.0_wp)   ! [rad/s]
  real(wp), parameter :: degree = hertz / 360.0_wp        ! [rad]
  character(len=256) :: file
  integer :: unit

  call get_command_argument(1, file)
  open (newunit=unit, file=trim(file), action='read', status='old')
  call read_case()
  call read_bodies()
  call read_couplings()
  call read_gears()
  call read_planetaries()
  call read_differentials()
  call read_constraints()
  call read_motors()
  call read_loads()
  call read_excitations()
  call read_engines()
  call read_run()
  call read_output()
  call read_sweep()
  call read_varies()
  call read_records()

contains

  subroutine read_case()
    character(len=80) :: author, customer, revision, title
    integer :: status
    namelist /case/ title, author, customer, revision

    title = ''
    rewind (unit)
    read (unit, nml=case, iostat=status)
    if (status > 0) error stop 'case'
    print '(*(g0, 1x))', 'case', trim(title)
  end subroutine read_case

  subroutine read_bodies()
    character(len=64) :: name
    real(wp) :: bearing_friction, inertia, angle, speed, speed_rpm
    integer :: status
    namelist /body/ name, inertia, angle, speed, speed_rpm, bearing_friction

    rewind (unit)
    do
      angle = 0.0_wp; speed = 0.0_wp; speed_rpm = not_given; bearing_friction = 0.0_wp
      read (unit, nml=body, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'body'
      if (speed_rpm > not_given) speed = speed_rpm * hertz / 60.0_wp
      print '(*(g0, 1x))', 'body', trim(name), inertia, angle, speed, bearing_friction
    end do
  end subroutine read_bodies

  subroutine read_couplings()
    character(len=64) :: name, bodies(2), interpolation, extrapolation
    real(wp) :: stiffness, cubic_stiffness, damping, rest_twist, gap, saturation, friction, friction_speed
    real(wp) :: relative_damping, damping_frequency, damping_frequency_hz
    real(wp), dimension(most_numbers) :: polynomial, table_twist, table_moment
    character(len=16) :: kind
    integer :: status
    namelist /coupling/ name, kind, bodies, stiffness, cubic_stiffness, polynomial, damping, rest_twist, gap, saturation, &
      friction, friction_speed, relative_damping, damping_frequency, damping_frequency_hz, table_twist, table_moment, &
      interpolation, extrapolation

    rewind (unit)
    do
      stiffness = 0.0_wp
      cubic_stiffness = 0.0_wp
      polynomial = not_given
      damping = 0.0_wp
      rest_twist = 0.0_wp
      gap = 0.0_wp
      saturation = not_given
      friction = 0.0_wp
      friction_speed = 0.01_wp
      relative_damping = not_given
      damping_frequency = not_given
      damping_frequency_hz = not_given
      table_twist = not_given
      table_moment = not_given
      interpolation = 'linear'
      extrapolation = 'linear'
      read (unit, nml=coupling, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'coupling'
      if (damping_frequency_hz > not_given) damping_frequency = damping_frequency_hz * hertz
      print '(*(g0, 1x))', 'coupling', trim(name), trim(bodies(1)), trim(bodies(2)), stiffness, cubic_stiffness, polynomial, &
        damping, rest_twist, gap, saturation, friction, friction_speed, relative_damping, damping_frequency, table_twist, &
        table_moment, trim(interpolation), trim(extrapolation)
    end do
  end subroutine read_couplings

  subroutine read_gears()
    character(len=64) :: name, bodies(2)
    real(wp) :: radii(2), efficiency, reverse_efficiency
    integer :: teeth(2), status
    logical :: internal
    namelist /gear/ name, bodies, radii, teeth, internal, efficiency, reverse_efficiency

    rewind (unit)
    do
      radii = not_given
      efficiency = not_given
      reverse_efficiency = not_given
      teeth = 0
      internal = .false.
      read (unit, nml=gear, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'gear'
      print '(*(g0, 1x))', 'gear', trim(name), trim(bodies(1)), trim(bodies(2)), radii, teeth, internal, efficiency, &
        reverse_efficiency
    end do
  end subroutine read_gears

  subroutine read_planetaries()
    character(len=64) :: name, sun, ring, carrier
    integer :: teeth(2), status
    namelist /planetary/ name, sun, ring, carrier, teeth

    rewind (unit)
    do
      read (unit, nml=planetary, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'planetary'
      print '(*(g0, 1x))', 'planetary', trim(name), trim(sun), trim(ring), trim(carrier), teeth
    end do
  end subroutine read_planetaries

  subroutine read_differentials()
    character(len=64) :: name, sides(2), case
    integer :: status
    namelist /differential/ name, sides, case

    rewind (unit)
    do
      read (unit, nml=differential, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'differential'
      print '(*(g0, 1x))', 'differential', trim(name), trim(sides(1)), trim(sides(2)), trim(case)
    end do
  end subroutine read_differentials

  subroutine read_constraints()
    character(len=64) :: name, bodies(most_bodies)
    real(wp) :: coefficients(most_bodies)
    integer :: i, status
    namelist /constraint/ name, bodies, coefficients

    rewind (unit)
    do
      bodies = ''
      coefficients = not_given
      read (unit, nml=constraint, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'constraint'
      print '(*(g0, 1x))', 'constraint', trim(name), (trim(bodies(i)), i=1, most_bodies), coefficients
    end do
  end subroutine read_constraints

  subroutine read_motors()
    character(len=64) :: name, body, kind, interpolation, extrapolation
    real(wp) :: a, b, c, torque, breakdown_torque, breakdown_slip, synchronous_speed, voltage, resistance, flux_constant
    real(wp) :: inductance, governor_speed, governor_gain, governor_time, governor_start
    real(wp), dimension(most_numbers) :: table_speed, table_torque
    integer :: status
    namelist /motor/ name, body, kind, a, b, c, torque, table_speed, table_torque, interpolation, extrapolation, &
      breakdown_torque, breakdown_slip, synchronous_speed, voltage, resistance, flux_constant, inductance, governor_speed, &
      governor_gain, governor_time, governor_start

    rewind (unit)
    do
      kind = 'quadratic'
      interpolation = 'linear'
      extrapolation = 'linear'
      a = not_given
      b = not_given
      c = not_given
      torque = not_given
      breakdown_torque = not_given
      breakdown_slip = not_given
      synchronous_speed = not_given
      voltage = not_given
      resistance = not_given
      flux_constant = not_given
      inductance = 0.0_wp
      governor_speed = not_given
      governor_gain = not_given
      governor_time = not_given
      governor_start = 1.0_wp
      table_speed = not_given
      table_torque = not_given
      read (unit, nml=motor, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'motor'
      print '(*(g0, 1x))', 'motor', trim(name), trim(body), trim(kind), a, b, c, torque, table_speed, table_torque, &
        trim(interpolation), trim(extrapolation), breakdown_torque, breakdown_slip, synchronous_speed, voltage, resistance, &
        flux_constant, inductance, governor_speed, governor_gain, governor_time, governor_start
    end do
  end subroutine read_motors

  subroutine read_loads()
    character(len=64) :: name, body, interpolation, extrapolation
    real(wp) :: viscous, quadratic, constant, constant_speed, mean_time, vibration_factor
    real(wp), dimension(most_numbers) :: table_speed, table_torque
    integer :: status
    namelist /load/ name, body, viscous, quadratic, constant, constant_speed, table_speed, table_torque, interpolation, &
      extrapolation, mean_time, vibration_factor

    rewind (unit)
    do
      viscous = 0.0_wp
      quadratic = 0.0_wp
      constant = 0.0_wp
      constant_speed = 0.01_wp
      mean_time = not_given
      vibration_factor = not_given
      table_speed = not_given
      table_torque = not_given
      interpolation = 'linear'
      extrapolation = 'linear'
      read (unit, nml=load, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'load'
      print '(*(g0, 1x))', 'load', trim(name), trim(body), viscous, quadratic, constant, constant_speed, table_speed, &
        table_torque, trim(interpolation), trim(extrapolation), mean_time, vibration_factor
    end do
  end subroutine read_loads

  subroutine read_excitations()
    character(len=64) :: name, body, kind, interpolation
    real(wp) :: amplitude, frequency, frequency_hz, phase, time, duration
    real(wp), dimension(most_numbers) :: orders, amplitudes, phases, share_of_load, speeds, table_time, table_torque
    integer :: pole_pairs, status
    namelist /excitation/ name, body, kind, amplitude, frequency, frequency_hz, phase, orders, amplitudes, phases, table_time, &
      table_torque, interpolation, time, duration, pole_pairs, share_of_load, speeds

    rewind (unit)
    do
      kind = 'harmonic'
      amplitude = not_given
      frequency = not_given
      frequency_hz = not_given
      phase = 0.0_wp
      orders = not_given
      amplitudes = not_given
      phases = 0.0_wp
      share_of_load = not_given
      speeds = not_given
      table_time = not_given
      table_torque = not_given
      interpolation = 'linear'
      time = not_given
      duration = not_given
      pole_pairs = 0
      read (unit, nml=excitation, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'excitation'
      if (frequency_hz > not_given) frequency = frequency_hz * hertz
      print '(*(g0, 1x))', 'excitation', trim(name), trim(body), trim(kind), amplitude, frequency, phase, orders, amplitudes, &
        phases, share_of_load, speeds, table_time, table_torque, trim(interpolation), time, duration, pole_pairs
    end do
  end subroutine read_excitations

  subroutine read_engines()
    character(len=64) :: name, cylinders(most_numbers)
    real(wp), dimension(most_numbers) :: amplitudes, firing, firing_deg, orders, phases
    real(wp) :: crank_radius, mean_time, mean_torque, offset, reciprocating_mass, rod_length, vibration_damping
    character(len=64) :: works
    integer :: i, misfire, status, stroke
    namelist /engine/ name, cylinders, stroke, firing, firing_deg, orders, amplitudes, phases, mean_torque, misfire, &
      crank_radius, reciprocating_mass, rod_length, offset, works, vibration_damping, mean_time

    rewind (unit)
    do
      cylinders = ''
      firing_deg = not_given
      firing = not_given
      orders = not_given
      amplitudes = not_given
      phases = 0.0_wp
      mean_torque = 0.0_wp
      misfire = 0
      crank_radius = not_given
      offset = 0.0_wp
      works = 'engine'
      vibration_damping = not_given
      mean_time = not_given
      reciprocating_mass = not_given
      rod_length = not_given
      read (unit, nml=engine, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'engine'
      where (firing_deg > not_given) firing = firing_deg * degree
      print '(*(g0, 1x))', 'engine', trim(name), (trim(cylinders(i)), i=1, most_numbers), stroke, firing, orders, amplitudes, &
        phases, mean_torque, misfire, crank_radius, reciprocating_mass, rod_length, offset, trim(works), &
        vibration_damping, mean_time
    end do
  end subroutine read_engines

  subroutine read_run()
    real(wp) :: t_start, t_end, rtol, atol
    character(len=64) :: method, formulation, complement, start, independent(most_bodies)
    integer :: max_steps, i
    namelist /run/ t_start, t_end, method, rtol, atol, formulation, independent, complement, start, max_steps

    t_start = 0.0_wp
    method = 'auto'
    rtol = 1.0e-6_wp
    atol = 1.0e-9_wp
    formulation = 'reduced'
    independent = ''
    complement = 'natural'
    start = 'given'
    max_steps = 1000000
    rewind (unit)
    read (unit, nml=run)
    print '(*(g0, 1x))', 'run', t_start, t_end, trim(method), rtol, atol, trim(formulation), trim(complement), trim(start), &
      max_steps, (trim(independent(i)), i=1, most_bodies)
  end subroutine read_run

  subroutine read_output()
    real(wp) :: interval, extremes_from
    integer :: points, status
    character(len=256) :: directory
    character(len=64) :: columns(8), format
    namelist /output/ interval, points, columns, format, extremes_from, directory

    interval = not_given
    points = 0
    columns = ''
    format = 'csv'
    extremes_from = not_given
    directory = ''
    rewind (unit)
    read (unit, nml=output, iostat=status)
    if (status > 0) error stop 'output'
    if (points == 0 .and. interval < 0) points = 1001
    print '(*(g0, 1x))', 'output', interval, points, columns, trim(format), extremes_from, trim(directory)
  end subroutine read_output

  subroutine read_sweep()
    character(len=64) :: design
    integer :: samples, seed, status
    namelist /sweep/ design, samples, seed

    design = ''
    samples = 0
    seed = 0
    rewind (unit)
    read (unit, nml=sweep, iostat=status)
    if (status > 0) error stop 'sweep'
    print '(*(g0, 1x))', 'sweep', trim(design), samples, seed
  end subroutine read_sweep

  subroutine read_varies()
    character(len=256) :: target
    character(len=64) :: distribution, scale
    real(wp) :: low, high, mean, deviation, median, log_deviation
    integer :: count, status
    namelist /vary/ target, scale, distribution, low, high, mean, deviation, median, log_deviation, count

    rewind (unit)
    do
      distribution = 'uniform'
      scale = 'absolute'
      low = not_given
      high = not_given
      mean = not_given
      deviation = not_given
      median = not_given
      log_deviation = not_given
      count = 0
      read (unit, nml=vary, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'vary'
      print '(*(g0, 1x))', 'vary', trim(target), trim(scale), trim(distribution), low, high, mean, deviation, median, &
        log_deviation, count
    end do
  end subroutine read_varies

  subroutine read_records()
    character(len=256) :: quantity, response
    character(len=64) :: statistic(8)
    real(wp) :: from, band, order
    integer :: mode, trajectories(most_numbers), status
    namelist /record/ quantity, mode, response, order, statistic, from, band, trajectories

    rewind (unit)
    do
      quantity = ''
      response = ''
      mode = 0
      order = not_given
      statistic = ''
      from = not_given
      band = not_given
      trajectories = 0
      read (unit, nml=record, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'record'
      print '(*(g0, 1x))', 'record', trim(quantity), mode, trim(response), order, statistic, from, band, trajectories
    end do
  end subroutine read_records

end program read_namelists
