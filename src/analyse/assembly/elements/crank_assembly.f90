!> The slider-cranks of an input: their pistons and rods, which become bodies after all others, and the banks of their rows and
!> forces.
module nocdyn_crank_assembly
  use nocdyn_bank, only: append_bank
  use nocdyn_bank_states, only: bank_state_t, new_bank_state
  use nocdyn_crank_rows, only: crank_rows_t, new_crank_rows, slider_crank_t
  use nocdyn_cylinder_torques, only: cycle_of
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_engine_checks, only: check_crank_angles, check_reach, check_stroke
  use nocdyn_fourier, only: fourier_coefficients
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_order_excitations, only: new_order_excitations, order_excitations_t, order_torque_t
  use nocdyn_phases, only: new_phases
  use nocdyn_piston_forces, only: new_piston_force, periodic_force_t
  use nocdyn_slider_cranks, only: close_cycle, inertia_orders, sample_cycle, samples, turn_angles
  use nocdyn_text, only: append, string_t, to_text
  use nocdyn_torque_assembly, only: in_lanes
  implicit none (type, external)
  private

  public :: check_crank, add_cranks, force_of, sampled_force

  real(wp), parameter :: pi = acos(-1.0_wp)

contains

  !> Refuses cranks that cannot turn, and forces that are not the ones of one cycle.
  subroutine check_crank(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: key, text

    associate (group => input%groups(index))
      call check_reach(group, key, text)
      if (text /= '') call input%report(index, key, text, diagnostics)
      if (group%number('rod_mass') > 0 .and. .not. group%has_value('rod_center')) then
        call input%report(index, 'rod_mass', 'rod_mass = ' // to_text(group%number('rod_mass')) // &
                   ' kg, but rod_center is missing', diagnostics)
      end if
      if (.not. group%has_value('crank_angles')) return
      call check_stroke(group, key, text)
      if (text == '') call check_crank_angles(group, key, text)
      if (text == '') return
      call input%report(index, key, text, diagnostics)
    end associate
  end subroutine check_crank

  !> Adds the pistons and rods and the banks of their rows and forces to a machine.
  subroutine add_cranks(groups, is_steady, machine)
    type(element_groups_t), intent(in) :: groups
    logical, intent(in) :: is_steady   !! whether means over a turn stand for them
    type(machine_t), intent(inout) :: machine
    integer, allocatable :: body(:)
    integer :: i

    if (size(groups%indices) == 0) return
    allocate (body, source=groups%bodies('body', 1))
    do i = 1, size(groups%indices)
      if (is_steady) then
        call add_mean_crank(groups%input%groups(groups%indices(i)), groups%names(i), body(i), machine)
      else
        call add_crank(groups%input%groups(groups%indices(i)), groups%names(i), body(i), machine)
      end if
    end do
  end subroutine add_cranks

  !> One crank, whose rows are a bank of their own. A rod without an inertia of its own is two masses.
  subroutine add_crank(group, name, body, machine)
    type(group_t), intent(in) :: group
    type(string_t), intent(in) :: name
    integer, intent(in) :: body
    type(machine_t), intent(inout) :: machine
    character(len=*), parameter :: part_names(*) = [character(len=10) :: 'piston', 'rod along', 'rod across', 'rod angle']
    type(crank_rows_t) :: bank
    type(string_t), allocatable :: nodes(:)
    real(wp), allocatable :: inertia(:)
    integer :: k, piston

    call find_masses(group, body, machine, inertia)
    allocate (nodes(0))
    do k = 1, size(inertia)
      call append(nodes, name%text // '[' // trim(part_names(k)) // ']')
    end do
    if (size(inertia) == 2) nodes(2)%text = name%text // '[rod end]'
    piston = machine%bodies + 1
    call machine%add_nodes(nodes, inertia)
    bank = new_crank_rows(machine%lanes, spread(name, 1, size(inertia)), [(piston - 1 + k, k=1, size(inertia))], crank_of(group))
    machine%start_angle(:, piston:) = spread(bank%positions(machine%start_angle(1, body)), 1, machine%lanes)
    call append_bank(machine%banks, bank)
    call append_bank(machine%banks, new_phases(machine%lanes, spread(name, 1, size(inertia)), spread(body, 1, size(inertia))))
    if (.not. group%has_value('crank_angles')) return
    call append_bank(machine%banks, new_piston_force(machine%lanes, name, piston, group%number('phase'), force_of(group)))
    call append_bank(machine%banks, new_phases(machine%lanes, [name], [body]))
  end subroutine add_crank

  !> The masses of piston and rod and the inertia of the rod. One without its own is two masses, at the pin
  !> of the piston and on the body.
  subroutine find_masses(group, body, machine, inertia)
    type(group_t), intent(in) :: group
    integer, intent(in) :: body
    type(machine_t), intent(inout) :: machine
    real(wp), allocatable, intent(out) :: inertia(:)   !! [kg], [kg m2], of each row
    real(wp) :: share   ! of the rod at the piston

    share = group%number('rod_center', absent=0.0_wp) / group%number('rod_length')
    associate (rod => group%number('rod_mass'))
      if (group%has_value('rod_inertia')) then
        inertia = [group%number('piston_mass'), rod, rod, group%number('rod_inertia')]
      else
        inertia = [group%number('piston_mass'), share * rod]
        inertia = pack(inertia, inertia > 0)
        machine%inertia(:, body) = machine%inertia(:, body) + (1.0_wp - share) * rod * group%number('crank_radius')**2
      end if
    end associate
  end subroutine find_masses

  !> The mean inertia of a crank in place of it, and its torque by orders: F x' of the force, and -J' omega^2 / 2 of the inertia
  !> J = sum of m x'^2 over what moves.
  subroutine add_mean_crank(group, name, body, machine)
    type(group_t), intent(in) :: group
    type(string_t), intent(in) :: name
    integer, intent(in) :: body
    type(machine_t), intent(inout) :: machine
    type(order_torque_t) :: torque
    type(order_excitations_t) :: bank
    type(periodic_force_t) :: force
    type(crank_rows_t) :: rows
    type(bank_state_t) :: state
    real(wp), allocatable :: masses(:)
    real(wp), allocatable :: angle(:), g(:, :), inertia(:)
    real(wp) :: gas(samples)
    integer :: i, k

    call find_masses(group, body, machine, masses)
    rows = new_crank_rows(1, spread(name, 1, size(masses)), [(0, k=1, size(masses))], crank_of(group))
    state = new_bank_state(rows, size(masses))
    allocate (g(0:3, size(masses)))
    force%base = 1.0_wp
    allocate (force%sine(0), force%cosine(0))
    if (group%has_value('crank_angles')) force = force_of(group)
    allocate (angle, source=turn_angles())
    allocate (inertia(size(angle)))
    do i = 1, size(angle)
      call rows%motions(state, spread(angle(i), 1, size(masses)), g)
      inertia(i) = sum(masses * g(1, :)**2)
    end do
    do i = 1, samples
      angle(1) = 2.0_wp * pi / force%base * (i - 1) / samples
      call rows%motions(state, spread(angle(1), 1, size(masses)), g)
      gas(i) = g(1, 1) * force%value(angle(1) + group%number('phase'))
    end do
    machine%inertia(:, body) = machine%inertia(:, body) + sum(inertia) / size(inertia)
    call inertia_orders(inertia, torque%square_sine, torque%square_cosine)
    torque%square_order = [(real(k, wp), k=1, size(torque%square_sine))]
    torque%order = [(k * force%base, k=1, size(force%sine))]
    torque%speed = [0.0_wp]
    allocate (torque%mean(1), torque%sine(size(torque%order), 1), torque%cosine(size(torque%order), 1))
    call fourier_coefficients(gas, torque%mean(1), torque%sine(:, 1), torque%cosine(:, 1))
    bank = new_order_excitations([name], [body], in_lanes([torque], machine%lanes))
    bank%is_engine = .true.
    call append_bank(machine%banks, bank)
  end subroutine add_mean_crank

  type(slider_crank_t) function crank_of(group) result(crank)
    type(group_t), intent(in) :: group

    crank = slider_crank_t(group%number('crank_radius'), group%number('rod_length'), group%number('offset'), &
                           group%number('phase'), group%number('rod_center', absent=0.0_wp))
  end function crank_of

  !> The force on the piston away from the crank over the angle of the crank, from its points by their harmonics.
  function force_of(group) result(force)
    type(group_t), intent(in) :: group
    type(periodic_force_t) :: force

    force%base = 2.0_wp * pi / cycle_of(group)
    associate (n => int(group%number('harmonics_up_to') / force%base + 1.0e-9_wp))
      allocate (force%sine(n), force%cosine(n))
    end associate
    call fourier_coefficients(sampled_force(group), force%mean, force%sine, force%cosine)
  end function force_of

  !> Force at equal distances over a cycle.
  function sampled_force(group) result(force)
    type(group_t), intent(in) :: group
    real(wp) :: force(samples)   !! [N]
    real(wp), allocatable :: angle(:), values(:)

    allocate (angle, source=group%numbers('crank_angles'))
    if (group%has_value('forces')) then
      values = -group%numbers('forces')
    else
      values = (group%number('crankcase_pressure') - group%numbers('pressures')) * 0.25_wp * pi * group%number('bore')**2
    end if
    call close_cycle(cycle_of(group), angle, values)
    force = sample_cycle(cycle_of(group), angle, values)
  end function sampled_force

end module nocdyn_crank_assembly
