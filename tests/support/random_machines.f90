!> Random machines of any size, different with every seed, of one lane or several.
module nocdyn_test_random_machines
  use nocdyn_constraints, only: constraints_t
  use nocdyn_couplings, only: new_couplings
  use nocdyn_excitations, only: new_excitations
  use nocdyn_kinds, only: wp
  use nocdyn_loads, only: new_loads
  use nocdyn_machine, only: machine_t
  use nocdyn_motors, only: new_motors
  use nocdyn_test_given_keys, only: keys
  use nocdyn_test_machines, only: machine_of_bodies, finish, gear_rows, install, numbered_names
  use nocdyn_test_random, only: random_stream, random_stream_t
  implicit none (type, external)
  private

  public :: random_machine
  public :: add_couplings, add_torques, drawn   ! for machines with other constraints

contains

  !> Trees of gears, external and internal, with redundant gears, and polynomial elements of all roles.
  !>
  !> The structure depends on `seed`, the parameters of a lane on `seed` and on the variant of the lane.
  function random_machine(seed, bodies, variants, wanted, choice) result(machine)
    integer, intent(in) :: seed, bodies
    integer, intent(in) :: variants(:)   !! of each lane
    integer, intent(in) :: wanted(:)     !! bodies that become the coordinates; empty: they are found
    integer, intent(in) :: choice        !! complement_...
    class(machine_t), allocatable :: machine
    type(random_stream_t) :: layout, lanes(size(variants))
    real(wp) :: speed(size(variants), bodies)   ! speeds that satisfy all gears
    integer :: b, l

    layout = random_stream(seed)
    do l = 1, size(lanes)
      lanes(l) = random_stream(1000 * seed + variants(l))
    end do
    machine = machine_of_bodies(drawn(lanes, 0.5_wp, 10.0_wp, bodies))
    speed = drawn(lanes, 0.4_wp, 2.5_wp, bodies)
    do b = 1, bodies
      if (layout%number(0.0_wp, 1.0_wp) < 0.6_wp) speed(:, b) = -speed(:, b)
    end do
    machine%constraints = random_gears(layout, lanes, speed)
    call add_couplings(layout, lanes, machine)
    call add_torques(layout, lanes, machine)
    machine%start_speed = speed
    machine%start_angle = drawn(lanes, -1.0_wp, 1.0_wp, bodies)
    call finish(machine, wanted, choice)
  end function random_machine

  !> Gears that the speeds satisfy: m speed(b) * omega(a) - m speed(a) * omega(b) = 0.
  function random_gears(layout, lanes, speed) result(constraints)
    type(random_stream_t), intent(inout) :: layout, lanes(:)
    real(wp), intent(in) :: speed(:, :)   !! [lanes, bodies]
    type(constraints_t) :: constraints
    real(wp), allocatable :: coefficients(:, :), measure(:, :)
    integer, allocatable :: wheels(:, :)
    integer :: i

    allocate (wheels, source=random_wheels(layout, size(speed, 2)))
    allocate (measure, source=drawn(lanes, 0.5_wp, 2.0_wp, size(wheels, 2)))
    allocate (coefficients(size(lanes), size(wheels)))
    do i = 1, size(wheels, 2)
      coefficients(:, 2 * i - 1) = measure(:, i) * speed(:, wheels(2, i))
      coefficients(:, 2 * i) = -measure(:, i) * speed(:, wheels(1, i))
    end do
    constraints = gear_rows(size(speed, 2), wheels, coefficients)
  end function random_gears

  !> Most bodies mesh with an earlier one; then some redundant gears within the groups.
  function random_wheels(layout, bodies) result(wheels)
    type(random_stream_t), intent(inout) :: layout
    integer, intent(in) :: bodies
    integer, allocatable :: wheels(:, :)   !! [2, gears]
    integer :: a, b, i, root(bodies)

    wheels = reshape([integer ::], [2, 0])
    do b = 1, bodies
      root(b) = b
      if (b == 1) cycle
      if (layout%number(0.0_wp, 1.0_wp) > 0.7_wp) cycle
      a = layout%whole(1, b - 1)
      root(b) = root(a)
      wheels = reshape([wheels, a, b], [2, size(wheels, 2) + 1])
    end do
    do i = 1, bodies / 3
      a = layout%whole(1, bodies)
      b = layout%whole(1, bodies)
      if (a /= b .and. root(a) == root(b)) wheels = reshape([wheels, a, b], [2, size(wheels, 2) + 1])
    end do
  end function random_wheels

  !> As many couplings as bodies, one in three without damping.
  subroutine add_couplings(layout, lanes, machine)
    type(random_stream_t), intent(inout) :: layout, lanes(:)
    type(machine_t), intent(inout) :: machine
    integer :: from(machine%bodies), to(machine%bodies)
    real(wp), dimension(size(lanes), machine%bodies) :: cubic, damping, rest, stiffness
    integer :: i

    do i = 1, machine%bodies
      from(i) = layout%whole(0, machine%bodies)
      to(i) = modulo(from(i) + layout%whole(1, machine%bodies), machine%bodies + 1)
    end do
    damping = drawn(lanes, 0.5_wp, 3.0_wp, machine%bodies)
    damping(:, 3::3) = 0.0_wp
    stiffness = drawn(lanes, 50.0_wp, 150.0_wp, machine%bodies)
    cubic = drawn(lanes, -10.0_wp, 10.0_wp, machine%bodies)
    rest = drawn(lanes, -0.3_wp, 0.3_wp, machine%bodies)
    call install(machine%banks, new_couplings(keys(numbered_names('shaft', machine%bodies), [from, to], &
                                                   'damping rest_twist stiffness cubic_stiffness', &
                                                   [damping, rest, stiffness, cubic])))
  end subroutine add_couplings

  !> Two motors, three loads, two excitations, which may share bodies.
  subroutine add_torques(layout, lanes, machine)
    type(random_stream_t), intent(inout) :: layout, lanes(:)
    type(machine_t), intent(inout) :: machine
    integer :: body(7), i

    do i = 1, size(body)
      body(i) = layout%whole(1, machine%bodies)
    end do
    call install(machine%banks, new_motors(keys(numbered_names('motor', 2), body(1:2), 'a b c', &
                                                [drawn(lanes, 50.0_wp, 200.0_wp, 2), drawn(lanes, 1.0_wp, 10.0_wp, 2), &
                                                 drawn(lanes, -1.0_wp, 1.0_wp, 2)])))
    call install(machine%banks, new_loads(keys(numbered_names('load', 3), body(3:5), 'viscous', &
                                               [drawn(lanes, 1.0_wp, 100.0_wp, 3)])))
    call install(machine%banks, new_excitations(keys(numbered_names('shaker', 2), body(6:7), 'amplitude frequency phase', &
                                                     [drawn(lanes, 1.0_wp, 30.0_wp, 2), drawn(lanes, 1.0_wp, 8.0_wp, 2), &
                                                      drawn(lanes, -3.0_wp, 3.0_wp, 2)])))
  end subroutine add_torques

  !> Random numbers of every lane from its own stream, [lanes, count].
  function drawn(lanes, low, high, count) result(values)
    type(random_stream_t), intent(inout) :: lanes(:)
    real(wp), intent(in) :: low, high
    integer, intent(in) :: count
    real(wp) :: values(size(lanes), count)
    integer :: i, l

    do i = 1, count
      do l = 1, size(lanes)
        values(l, i) = lanes(l)%number(low, high)
      end do
    end do
  end function drawn

end module nocdyn_test_random_machines
