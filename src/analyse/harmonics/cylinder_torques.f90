!> The torques of the cylinders of an engine, from the keys of its group.
module nocdyn_cylinder_torques
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
      fired = gas_torque(group, 'pressures')
      missed = gas_torque(group, 'misfire_pressures')
    else
      fired = table_torque(group, 'amplitudes', 'phases')
      missed = table_torque(group, 'misfire_amplitudes', 'misfire_phases')
      fired%mean = fired%mean + group%number('mean_torque', absent=0.0_wp) / size(firing)
    end if
    call add_inertia(group, fired)
    call add_inertia(group, missed)
    allocate (torque(size(firing)))
    do c = 1, size(firing)
      torque(c) = turned(fired, factor(c), firing(c))
      if (c == group%whole_number('misfire')) torque(c) = turned(missed, 1.0_wp, firing(c))
    end do
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

  !> The torque of a cylinder by its pressure; 0 if there are no values.
  function gas_torque(group, pressures) result(torque)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: pressures   !! key of the pressures
    type(order_torque_t) :: torque
    real(wp), allocatable :: angle(:), pressure(:)
    real(wp) :: cycle
    integer :: k

    cycle = cycle_of(group)
    associate (n => int(group%number('harmonics_up_to') * cycle / (2.0_wp * pi) + 1.0e-9_wp))
      allocate (torque%order(n))
      torque%order(:) = [(k * 2.0_wp * pi / cycle, k=1, n)]
      allocate (torque%speed(1), torque%mean(1), torque%sine(n, 1), torque%cosine(n, 1), source=0.0_wp)
    end associate
    allocate (torque%square_order(0), torque%square_sine(0), torque%square_cosine(0))
    if (size(group%numbers(pressures)) == 0) return
    call take_pressures(group, pressures, angle, pressure)
    call gas_harmonics(cylinder(group), cycle, angle, pressure, torque%mean(1), torque%sine(:, 1), torque%cosine(:, 1))
  end function gas_torque

  !> The torque of a cylinder by its pressure at equal distances over a cycle, with all its harmonics [N m].
  function sampled_torque(group, pressures) result(torque)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: pressures   !! key of the pressures, which are given
    real(wp) :: torque(samples)
    real(wp), allocatable :: angle(:), pressure(:)

    call take_pressures(group, pressures, angle, pressure)
    torque = sampled_gas_torque(cylinder(group), cycle_of(group), angle, pressure)
  end function sampled_torque

  !> The points of one cycle, with the pressure above the one of the crankcase.
  pure subroutine take_pressures(group, pressures, angle, pressure)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: pressures   !! key of the pressures
    real(wp), allocatable, intent(out) :: angle(:), pressure(:)   !! [rad], [Pa]

    allocate (pressure, source=group%numbers(pressures))
    allocate (angle, source=group%numbers('crank_angles'))
    call close_cycle(cycle_of(group), angle, pressure)
    pressure = pressure - group%number('crankcase_pressure')
  end subroutine take_pressures

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
