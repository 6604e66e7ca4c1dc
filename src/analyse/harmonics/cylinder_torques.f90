!> The torques of the cylinders of an engine, from the keys of its group.
module nocdyn_cylinder_torques
  use nocdyn_crank_efforts, only: effort_harmonics, known_harmonics, sampled_effort
  use nocdyn_harmonic_tables, only: table_torque
  use nocdyn_input, only: group_t
  use nocdyn_kinds, only: wp
  use nocdyn_order_excitations, only: order_torque_t
  use nocdyn_slider_cranks, only: close_cycle, cylinder_t, gas_harmonics, inertia_harmonics, sampled_gas_torque, &
    samples
  implicit none (type, external)
  private

  public :: cylinder_torques, cycle_of, gas_torque, sampled_torque

  real(wp), parameter :: pi = acos(-1.0_wp)

contains

  !> The torque of each cylinder of a group &engine without mistakes.
  function cylinder_torques(group) result(torque)
    type(group_t), intent(in) :: group
    type(order_torque_t), allocatable :: torque(:)   !! [cylinders]
    type(order_torque_t) :: fired, missed            ! of a cylinder that fires at phi = 0, and of one that does not fire
    real(wp), allocatable :: factor(:), firing(:)
    integer :: c

    allocate (firing, source=group%numbers('firing'))
    allocate (factor, source=factors(group))
    if (group%has_value('pressures')) then
      call find_cycles('pressures', 'misfire_pressures')
    else if (group%has_value('torques')) then
      call find_cycles('torques', 'misfire_torques')
    else
      fired = table_torque(group, 'amplitudes', 'phases')
      missed = table_torque(group, 'misfire_amplitudes', 'misfire_phases')
      fired%mean = fired%mean + group%number('mean_torque', absent=0.0_wp) / size(firing)
    end if
    if (group%text('works') == 'compressor' .and. .not. group%has_value('pressures')) then
      fired = turned(fired, -1.0_wp, 0.0_wp)   ! given as torques that resist
      missed = turned(missed, -1.0_wp, 0.0_wp)
    end if
    call add_inertia(group, fired)
    call add_inertia(group, missed)
    allocate (torque(size(firing)))
    do c = 1, size(firing)
      torque(c) = turned(fired, factor(c), firing(c))
      if (c == group%whole_number('misfire')) torque(c) = turned(missed, 1.0_wp, firing(c))
    end do
  contains
    subroutine find_cycles(values, misfire_values)
      character(len=*), intent(in) :: values, misfire_values   ! keys

      fired = gas_torque(group, values)
      missed = turned(fired, 0.0_wp, 0.0_wp)
      if (size(group%numbers(misfire_values)) > 0) missed = gas_torque(group, misfire_values)
    end subroutine find_cycles
  end function cylinder_torques

  !> Angle of the crank in a cycle [rad].
  pure real(wp) function cycle_of(group)
    type(group_t), intent(in) :: group   !! &engine or &crank

    cycle_of = pi * group%whole_number('stroke')
  end function cycle_of

  !> 1 + the scatter of each cylinder. One value stands for + and - in turn, in the order in which the cylinders fire.
  pure function factors(group)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: factors(:)   !! [cylinders]
    real(wp), allocatable :: firing(:), scatter(:)
    integer :: c

    allocate (firing, source=group%numbers('firing'))
    allocate (scatter, source=group%numbers('cylinder_scatter'))
    if (size(scatter) == 0) then
      factors = spread(1.0_wp, 1, size(firing))
    else if (size(scatter) == 1) then
      factors = [(1.0_wp + merge(scatter(1), -scatter(1), modulo(fired_before(c), 2) == 0), c=1, size(firing))]
    else
      factors = 1.0_wp + scatter
    end if
  contains
    !> How many cylinders fire before a cylinder.
    pure integer function fired_before(c)
      integer, intent(in) :: c

      fired_before = count(firing < firing(c)) + count(.not. abs(firing(:c - 1) - firing(c)) > 0)
    end function fired_before
  end function factors

  !> The torque of a cylinder by its pressure or its torque over the angle of the crank.
  function gas_torque(group, values) result(torque)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: values   !! key of the pressures or torques, which are given
    type(order_torque_t) :: torque
    real(wp), allocatable :: angle(:), value(:)
    real(wp) :: cycle
    integer :: k, n

    cycle = cycle_of(group)
    call take_points(group, values, angle, value)
    n = int(group%number('harmonics_up_to') * cycle / (2.0_wp * pi) + 1.0e-9_wp)
    if (group%has_value('torques')) n = min(n, known_harmonics(cycle, angle))
    allocate (torque%order(n))
    torque%order(:) = [(k * 2.0_wp * pi / cycle, k=1, n)]
    allocate (torque%speed(1), torque%mean(1), torque%sine(n, 1), torque%cosine(n, 1), source=0.0_wp)
    allocate (torque%square_order(0), torque%square_sine(0), torque%square_cosine(0))
    if (group%has_value('torques')) then
      call effort_harmonics(cycle, angle, value, torque%mean(1), torque%sine(:, 1), torque%cosine(:, 1))
    else
      call gas_harmonics(cylinder(group), cycle, angle, value, torque%mean(1), torque%sine(:, 1), torque%cosine(:, 1))
    end if
  end function gas_torque

  !> The torque of a cylinder that fires at equal distances over a cycle, with all its harmonics [N m].
  function sampled_torque(group) result(torque)
    type(group_t), intent(in) :: group   !! with pressures or torques
    real(wp) :: torque(samples)
    real(wp), allocatable :: angle(:), value(:)

    if (group%has_value('torques')) then
      call take_points(group, 'torques', angle, value)
      torque = sampled_effort(cycle_of(group), angle, value)
    else
      call take_points(group, 'pressures', angle, value)
      torque = sampled_gas_torque(cylinder(group), cycle_of(group), angle, value)
    end if
  end function sampled_torque

  !> The points of one cycle with their values; a pressure is the one above the crankcase's.
  pure subroutine take_points(group, values, angle, value)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: values                     !! key of the pressures or torques
    real(wp), allocatable, intent(out) :: angle(:), value(:)   !! [rad], [Pa] or [N m]

    allocate (angle, source=group%numbers('crank_angles'))
    allocate (value, source=group%numbers(values))
    call close_cycle(cycle_of(group), angle, value)
    if (.not. group%has_value('torques')) value = value - group%number('crankcase_pressure')
  end subroutine take_points

  type(cylinder_t) function cylinder(group)
    type(group_t), intent(in) :: group

    cylinder = cylinder_t(group%number('bore', absent=0.0_wp), group%number('crank_radius'), group%number('rod_length'), &
                          group%number('offset', absent=0.0_wp))
  end function cylinder

  !> Sets the harmonics of the inertia torque, if the engine has a reciprocating mass.
  subroutine add_inertia(group, torque)
    type(group_t), intent(in) :: group
    type(order_torque_t), intent(inout) :: torque

    integer :: k

    if (.not. group%has_value('reciprocating_mass')) return
    call inertia_harmonics(cylinder(group), group%number('reciprocating_mass'), torque%square_sine, torque%square_cosine)
    torque%square_order = [(real(k, wp), k=1, size(torque%square_sine))]
  end subroutine add_inertia

  !> The torque of a cylinder that fires at another angle, its gas torque times a factor.
  pure function turned(torque, factor, firing) result(other)
    type(order_torque_t), intent(in) :: torque
    real(wp), intent(in) :: factor, firing   !! [1], [rad]
    type(order_torque_t) :: other
    integer :: k

    other = torque
    other%mean = factor * torque%mean
    do k = 1, size(torque%order)
      associate (angle => torque%order(k) * firing)
        other%sine(k, :) = factor * (torque%sine(k, :) * cos(angle) + torque%cosine(k, :) * sin(angle))
        other%cosine(k, :) = factor * (torque%cosine(k, :) * cos(angle) - torque%sine(k, :) * sin(angle))
      end associate
    end do
    do k = 1, size(torque%square_order)
      associate (angle => torque%square_order(k) * firing)
        other%square_sine(k) = torque%square_sine(k) * cos(angle) + torque%square_cosine(k) * sin(angle)
        other%square_cosine(k) = torque%square_cosine(k) * cos(angle) - torque%square_sine(k) * sin(angle)
      end associate
    end do
  end function turned

end module nocdyn_cylinder_torques
