!> A run whose mean speed follows given points: torques make up for what drives and loads lack for it.
!>
!> They are torques over the time, together J a - M(omega), with the mean torque M and the inertia J of the machine by its rigid
!> motion. They depend on nothing that vibrates, so that they neither damp nor hold a body. They act where the machine is driven:
!> on the cranks of engines, else on the bodies of motors, else on the body whose speed follows.
module nocdyn_speed_ramps
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_equilibrium, only: mean_formulation, t_infinity
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_joint_simplifications, only: refuse_joints
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_schema, only: first_key, group_rule_index, last_key
  use nocdyn_text, only: append, quoted, string_t, to_text
  use nocdyn_torque_balance, only: set_up_balance, torque_balance_t
  implicit none (type, external)
  private

  public :: add_ramp

  integer, parameter :: points = 100           ! of the torque from one given point to the next
  real(wp), parameter :: corner = 0.02_wp      ! share of their time in which the acceleration begins, and ends: whole points
  character(len=*), parameter :: name = 'ramp of transit'

  !> The mean motion of a machine with one rigid motion.
  type :: mean_motion_t
    type(torque_balance_t) :: balance
    real(wp) :: ratio = 1.0_wp     !! speed of the body by the rigid motion
    real(wp) :: inertia = 0.0_wp   !! of the rigid motion [kg m2]
    type(string_t), allocatable :: drivers(:)   !! bodies on which the torques act
    real(wp), allocatable :: share(:)           !! of the torque along the rigid motion on each of them
  end type mean_motion_t

contains

  !> Lets a run follow the points of &transit from a steady state at the first one to the last one.
  subroutine add_ramp(input, body, error)
    type(input_t), intent(inout) :: input
    character(len=*), intent(in) :: body   !! whose speed follows
    type(error_t), allocatable, intent(out) :: error
    type(mean_motion_t) :: motion
    real(wp), allocatable :: omega(:), speeds(:), t(:), times(:), torque(:)
    integer :: b, i, n

    call new_mean_motion(input, body, motion, error)
    if (allocated(error)) return
    associate (group => input%groups(input%position('transit')))
      times = group%numbers('ramp_times')
      speeds = group%numbers('ramp_speeds')
    end associate
    n = points * (size(times) - 1)
    allocate (t(0:n), torque(0:n))
    do i = 0, n
      call find_point(motion, times, speeds, i, t(i), torque(i))
    end do
    do i = 1, size(motion%drivers)
      call append_torque(input, motion%drivers(i)%text, t, motion%share(i) * torque)
    end do
    call set_number(input%groups(input%position('run')), 't_start', times(1))
    call set_number(input%groups(input%position('run')), 't_end', times(size(times)))
    call set_text(input%groups(input%position('run')), 'start', 'equilibrium')
    omega = motion%balance%body_speeds([speeds(1) / motion%ratio])
    do i = 1, size(input%groups)
      if (input%groups(i)%kind /= 'body') cycle
      b = findloc([(motion%balance%formulation%machine%names(n)%text == input%groups(i)%name, n=1, size(omega))], .true., dim=1)
      call set_number(input%groups(i), 'speed', omega(b))
    end do
  end subroutine add_ramp

  !> The mean motion, whose body turns by one rigid motion.
  subroutine new_mean_motion(input, body, motion, error)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: body
    type(mean_motion_t), intent(out) :: motion
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable :: formulation
    type(machine_t) :: steady
    real(wp) :: matrix(1, 1)
    real(wp), allocatable :: omega(:)
    integer, allocatable :: motors(:)
    integer :: b, i

    call refuse_joints(input, .true., 'a ramp of &transit', error)
    allocate (motors, source=input%groups_named('motor'))
    do i = 1, size(motors)
      if (allocated(error) .or. .not. input%groups(motors(i))%has_value('governor_gain')) cycle
      call raise(error, exit_input, input%location(motors(i)) // ': its governor keeps a speed of its own, and a ramp of ' // &
                 '&transit another one; allowed: set_speeds of the governor in place of ramp_speeds, or no governor')
    end do
    if (.not. allocated(error)) call assemble_steady_machine(input, .true., steady, error)
    if (allocated(error)) return
    call mean_formulation(steady, formulation)
    call set_up_balance(formulation, t_infinity, motion%balance)
    if (size(motion%balance%motions%free) == 1) then
      omega = motion%balance%body_speeds([1.0_wp])
      b = findloc([(steady%names(i)%text == body, i=1, size(omega))], .true., dim=1)
      motion%ratio = omega(b)
      matrix = motion%balance%inertia([1])
      motion%inertia = matrix(1, 1)
      call find_drivers(input, body, omega, motion)
      if (abs(motion%ratio) > 0) return
    end if
    call raise(error, exit_input, input%location(input%position('transit'), 'ramp_speeds') // ': the speed of ' // &
               quoted(body) // ' does not settle that of the whole machine; required: bodies that all turn with it')
  end subroutine new_mean_motion

  !> The bodies that are driven, and their shares by the power of equal torques.
  subroutine find_drivers(input, body, omega, motion)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: body
    real(wp), intent(in) :: omega(:)   !! speeds of the bodies by the rigid motion
    type(mean_motion_t), intent(inout) :: motion
    integer :: b, g, i

    allocate (motion%drivers(0))
    do g = 1, size(input%groups)
      if (input%groups(g)%kind /= 'engine') cycle
      if (input%groups(g)%text('works') == 'engine') motion%drivers = [motion%drivers, input%groups(g)%texts('cylinders')]
    end do
    do g = 1, merge(size(input%groups), 0, size(motion%drivers) == 0)
      if (input%groups(g)%kind == 'motor') call append(motion%drivers, input%groups(g)%text('body'))
    end do
    if (size(motion%drivers) == 0) call append(motion%drivers, body)
    allocate (motion%share(size(motion%drivers)))
    do i = 1, size(motion%drivers)
      b = findloc([(motion%balance%formulation%machine%names(g)%text == motion%drivers(i)%text, g=1, size(omega))], .true., dim=1)
      motion%share(i) = omega(b)
    end do
    motion%share = motion%share / sum(motion%share**2)
  end subroutine find_drivers

  !> Time and torque along the rigid motion of a point. The acceleration is even between two given points, but for corners.
  subroutine find_point(motion, times, speeds, number, t, torque)
    type(mean_motion_t), intent(inout) :: motion
    real(wp), intent(in) :: times(:), speeds(:)   !! the given points [s], [rad/s]
    integer, intent(in) :: number                 !! from 0 on
    real(wp), intent(out) :: t, torque            !! [s], [N m]
    real(wp) :: acceleration, omega, x
    real(wp) :: z(motion%balance%unknowns())
    integer :: k

    k = min(1 + number / points, size(times) - 1)
    x = real(number - points * (k - 1), wp) / points
    t = times(k) + x * (times(k + 1) - times(k))
    ! a trapezoid of the acceleration, whose area is the difference of the speeds
    acceleration = (speeds(k + 1) - speeds(k)) / ((times(k + 1) - times(k)) * (1.0_wp - corner))
    omega = speeds(k) + acceleration * (times(k + 1) - times(k)) * area(x)
    acceleration = acceleration * min(1.0_wp, x / corner, (1.0_wp - x) / corner)
    z = motion%balance%start()
    z(1) = omega / motion%ratio
    call motion%balance%settle(z)
    call motion%balance%evaluate(z)
    torque = motion%inertia * acceleration / motion%ratio - motion%balance%residual(1)
  end subroutine find_point

  !> Area of a trapezoid of height 1 over 0 to 1, up to x.
  pure real(wp) function area(x)
    real(wp), intent(in) :: x

    if (x < corner) then
      area = 0.5_wp * x**2 / corner
    else if (x <= 1.0_wp - corner) then
      area = x - 0.5_wp * corner
    else
      area = 1.0_wp - corner - 0.5_wp * (1.0_wp - x)**2 / corner
    end if
  end function area

  !> Appends an &excitation with a torque over the time.
  subroutine append_torque(input, body, t, torque)
    type(input_t), intent(inout) :: input
    character(len=*), intent(in) :: body
    real(wp), intent(in) :: t(:), torque(:)   !! [s], [N m]
    type(group_t) :: group
    type(group_t), allocatable :: longer(:)
    integer :: i

    group%kind = 'excitation'
    group%rule = group_rule_index('excitation')
    group%ordinal = size(input%groups_named('excitation')) + 1
    group%name = name // ' ' // to_text(group%ordinal)
    allocate (group%values(last_key(group%rule) - first_key(group%rule) + 1))
    call set_text(group, 'name', group%name)
    call set_text(group, 'body', body)
    call set_text(group, 'kind', 'table')
    call set_text(group, 'interpolation', 'linear')
    group%values(group%key_position('table_time')) = value_t(is_given=.true., numbers=t)
    group%values(group%key_position('table_torque')) = value_t(is_given=.true., numbers=torque)
    allocate (longer(size(input%groups) + 1))
    do i = 1, size(input%groups)
      longer(i) = input%groups(i)
    end do
    longer(size(longer)) = group
    call move_alloc(longer, input%groups)
  end subroutine append_torque

  pure subroutine set_number(group, key, number)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: number

    group%values(group%key_position(key)) = value_t(is_given=.true., numbers=[number])
  end subroutine set_number

  subroutine set_text(group, key, text)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: key, text

    group%values(group%key_position(key)) = value_t(is_given=.true., texts=[string_t(text)])
  end subroutine set_text

end module nocdyn_speed_ramps
