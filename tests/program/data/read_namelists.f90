!> Reads a machine with Fortran's own namelist read and prints every value of every group, defaults included.
program read_namelists
  use, intrinsic :: iso_fortran_env, only: real64
  implicit none (type, external)

  integer, parameter :: wp = real64
  integer, parameter :: most_bodies = 8       ! in a list
  real(wp), parameter :: not_given = -huge(1.0_wp)
  character(len=256) :: file
  integer :: unit

  call get_command_argument(1, file)
  open (newunit=unit, file=trim(file), action='read', status='old')
  call read_case()
  call read_bodies()
  call read_couplings()
  call read_gears()
  call read_motors()
  call read_loads()
  call read_excitations()
  call read_run()
  call read_output()

contains

  subroutine read_case()
    character(len=80) :: title
    integer :: status
    namelist /case/ title

    title = ''
    rewind (unit)
    read (unit, nml=case, iostat=status)
    if (status > 0) error stop 'case'
    print '(*(g0, 1x))', 'case', trim(title)
  end subroutine read_case

  subroutine read_bodies()
    character(len=64) :: name
    real(wp) :: inertia, angle, speed
    integer :: status
    namelist /body/ name, inertia, angle, speed

    rewind (unit)
    do
      angle = 0.0_wp
      speed = 0.0_wp
      read (unit, nml=body, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'body'
      print '(*(g0, 1x))', 'body', trim(name), inertia, angle, speed
    end do
  end subroutine read_bodies

  subroutine read_couplings()
    character(len=64) :: name, bodies(2)
    real(wp) :: stiffness, cubic_stiffness, damping, rest_twist
    integer :: status
    namelist /coupling/ name, bodies, stiffness, cubic_stiffness, damping, rest_twist

    rewind (unit)
    do
      stiffness = 0.0_wp
      cubic_stiffness = 0.0_wp
      damping = 0.0_wp
      rest_twist = 0.0_wp
      read (unit, nml=coupling, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'coupling'
      print '(*(g0, 1x))', 'coupling', trim(name), trim(bodies(1)), trim(bodies(2)), stiffness, cubic_stiffness, damping, &
        rest_twist
    end do
  end subroutine read_couplings

  subroutine read_gears()
    character(len=64) :: name, bodies(2)
    real(wp) :: radii(2)
    integer :: teeth(2), status
    logical :: internal
    namelist /gear/ name, bodies, radii, teeth, internal

    rewind (unit)
    do
      radii = not_given
      teeth = 0
      internal = .false.
      read (unit, nml=gear, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'gear'
      print '(*(g0, 1x))', 'gear', trim(name), trim(bodies(1)), trim(bodies(2)), radii, teeth, internal
    end do
  end subroutine read_gears

  subroutine read_motors()
    character(len=64) :: name, body
    real(wp) :: a, b, c
    integer :: status
    namelist /motor/ name, body, a, b, c

    rewind (unit)
    do
      read (unit, nml=motor, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'motor'
      print '(*(g0, 1x))', 'motor', trim(name), trim(body), a, b, c
    end do
  end subroutine read_motors

  subroutine read_loads()
    character(len=64) :: name, body
    real(wp) :: viscous
    integer :: status
    namelist /load/ name, body, viscous

    rewind (unit)
    do
      viscous = 0.0_wp
      read (unit, nml=load, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'load'
      print '(*(g0, 1x))', 'load', trim(name), trim(body), viscous
    end do
  end subroutine read_loads

  subroutine read_excitations()
    character(len=64) :: name, body
    real(wp) :: amplitude, frequency, phase
    integer :: status
    namelist /excitation/ name, body, amplitude, frequency, phase

    rewind (unit)
    do
      phase = 0.0_wp
      read (unit, nml=excitation, iostat=status)
      if (is_iostat_end(status)) exit
      if (status /= 0) error stop 'excitation'
      print '(*(g0, 1x))', 'excitation', trim(name), trim(body), amplitude, frequency, phase
    end do
  end subroutine read_excitations

  subroutine read_run()
    real(wp) :: t_start, t_end, rtol, atol
    character(len=64) :: method, formulation, complement, independent(most_bodies)
    integer :: max_steps, i
    namelist /run/ t_start, t_end, method, rtol, atol, formulation, independent, complement, max_steps

    t_start = 0.0_wp
    method = 'auto'
    rtol = 1.0e-6_wp
    atol = 1.0e-9_wp
    formulation = 'reduced'
    independent = ''
    complement = 'natural'
    max_steps = 1000000
    rewind (unit)
    read (unit, nml=run)
    print '(*(g0, 1x))', 'run', t_start, t_end, trim(method), rtol, atol, trim(formulation), trim(complement), max_steps, &
      (trim(independent(i)), i=1, most_bodies)
  end subroutine read_run

  subroutine read_output()
    real(wp) :: interval
    integer :: points, status
    character(len=256) :: directory
    namelist /output/ interval, points, directory

    interval = not_given
    points = 0
    directory = ''
    rewind (unit)
    read (unit, nml=output, iostat=status)
    if (status > 0) error stop 'output'
    if (points == 0 .and. interval < 0) points = 1001
    print '(*(g0, 1x))', 'output', interval, points, trim(directory)
  end subroutine read_output

end program read_namelists
